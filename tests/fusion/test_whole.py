"""Long flights, which are fused stretch by stretch."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.biases import PARAMETERS
from ftproc.core.identification.motions.motion_models import ONLY_WHITE
from ftproc.files.writing import ranges
from ftproc.fusion import logs, range_file
from ftproc.fusion.estimation import engine, flight_faults, whole
from ftproc.fusion.estimation.constants import Constants, Likelihood, parameters
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate_range

SILENT = 1e-9


@pytest.fixture(scope="module")
def stations(tmp_path_factory):
    folder = tmp_path_factory.mktemp("three")
    ranges.write(simulate_range("range-theodolites", 1, 60.0), str(folder), None)
    range_ = range_file.load(str(folder / "range.toml"))
    return logs.as_seen(range_.instruments, logs.read(range_)[1])[0]


def fused(stations, smooth=True):
    return whole.fuse(stations, FilterSettings().gate, None, smooth, lambda done, most: None)


@pytest.fixture(scope="module")
def at_once(stations):
    return fused(stations)


def in_parts(monkeypatch, most=750, beside=200):
    monkeypatch.setattr(whole, "MOST", most)
    monkeypatch.setattr(whole, "BESIDE", beside)


def cut(station, until_s):
    """What a station has seen until then."""
    n = int(np.searchsorted(station.time_s, until_s))
    return station._replace(
        time_s=station.time_s[:n], measurement=station.measurement[:n], accepted=station.accepted[:n]
    )


@pytest.mark.parametrize("smooth", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_stretches_give_what_the_whole_gives(stations, at_once, monkeypatch, smooth):
    expected = at_once if smooth else fused(stations, smooth=False)
    in_parts(monkeypatch)
    found = fused(stations, smooth)
    off = np.abs(found.constants.estimate - expected.constants.estimate) / np.maximum(expected.constants.sigma, SILENT)
    assert off.max() < 1.0
    here = np.stack([np.interp(expected.track.time_s, found.track.time_s, x) for x in found.track.state[:, :3].T], 1)
    apart = np.abs(here - expected.track.state[:, :3]) / expected.track.sigma[:, :3]
    assert np.quantile(apart, 0.9) < 0.6
    assert np.sqrt((apart**2).mean()) < 1.0  # where one station alone sees the target, what is known of it is little
    assert (np.diff(found.track.time_s) > 0).all()
    for s in range(len(stations)):
        assert (found.weight[s] != expected.weight[s]).mean() < 0.003
        assert np.isfinite(found.position[s]).all()
        seen = np.isfinite(stations[s].measurement)
        assert np.isfinite(found.residual[s][seen]).all()


def test_a_station_may_be_silent_for_a_whole_stretch(stations, monkeypatch):
    some = [stations[0], *(cut(each, 30.0) for each in stations[1:])]
    in_parts(monkeypatch)
    found = fused(some)
    assert [len(each) for each in found.weight] == [len(each.time_s) for each in some]
    assert all(np.isfinite(each).all() for each in found.position)


@pytest.mark.parametrize("fails", [pytest.param(0, marks=pytest.mark.slow), 1, -1])
def test_a_stretch_without_a_first_track_joins_its_neighbour(stations, monkeypatch, fails):
    in_parts(monkeypatch)
    sizes, tried = [], []
    fuse = flight_faults.fuse

    def fails_once(parts, *given, **more):
        sizes.append(sum(len(each.time_s) for each in parts))
        tried.append(parts[0].time_s[0])
        last = abs(parts[0].time_s[-1] - stations[0].time_s[-1]) < 1e-9
        if len(failed) == 0 and (last if fails < 0 else len(tried) == fails + 1):
            failed.append(True)
            raise engine.Alone
        return fuse(parts, *given, **more)

    failed = []
    monkeypatch.setattr(flight_faults, "fuse", fails_once)
    found = fused(stations)
    assert failed
    assert max(sizes) > 750 + 2 * 200
    assert all(np.isfinite(each).all() for each in found.position)
    monkeypatch.setattr(flight_faults, "fuse", fails_always)
    with pytest.raises(engine.Alone):
        fused(stations)


def test_what_other_stretches_have_said_narrows_the_biases(stations):
    def half(known, *ends):
        part = [each._replace(time_s=each.time_s[slice(*np.searchsorted(each.time_s, ends))],
                              measurement=each.measurement[slice(*np.searchsorted(each.time_s, ends))],
                              accepted=each.accepted[slice(*np.searchsorted(each.time_s, ends))])
                for each in stations]  # fmt: skip
        return flight_faults.fuse(part, FilterSettings().gate, None, ONLY_WHITE, known, lambda number: None)

    nothing = Likelihood.nothing(PARAMETERS * len(stations))
    first, alone = half(nothing, 0.0, 30.0), half(nothing, 30.0, 61.0)
    second = half(engine.likelihood(first), 30.0, 61.0)
    ratio = second.constants.sigma / np.maximum(alone.constants.sigma, SILENT)
    assert ratio.max() < 1.02
    assert np.median(ratio[np.stack([each.prior for each in stations]) > 0]) < 0.9


def fails_always(*given, **more):
    raise engine.Alone


def said_of(readings, k, seed):
    """What linear readings with unit noise say of k biases in units of their prior, drawn from it; and these."""
    rng = np.random.default_rng(seed)
    design, truth = rng.standard_normal((readings, k)), rng.standard_normal(k)
    z = design @ truth + rng.standard_normal(readings)
    return Likelihood(design.T @ z, design.T @ design), design, z


def test_what_is_said_adds_up_and_can_be_taken_of_some():
    prior = np.array([[2.0, 1e-3, 1e-3, 0, 0, 0.1, 0, 0], [0, 1e-3, 2e-3, 1e-4, 1e-4, 0.0, 0, 0]])
    free = np.flatnonzero(prior.ravel() > 0)
    said, design, z = said_of(50, len(free), 1)
    one, other = (Likelihood(design[h].T @ z[h], design[h].T @ design[h]) for h in (slice(20), slice(20, None)))
    both = one.among(free, prior.size).with_(other.among(free, prior.size))
    np.testing.assert_allclose(both.information, said.among(free, prior.size).information, rtol=1e-12, atol=1e-12)
    whole_ = Constants.before(prior, both)
    scale = prior.ravel()[free]
    covariance = np.linalg.inv(design.T @ design + np.eye(len(free))) * np.outer(scale, scale)
    np.testing.assert_allclose(whole_.covariance[np.ix_(free, free)], covariance, rtol=1e-9)
    np.testing.assert_allclose(whole_.estimate.ravel()[free], covariance @ (design.T @ z / scale), rtol=1e-9)
    second = Constants.before(prior[1:], both.of(parameters([1])))
    np.testing.assert_allclose(second.estimate, whole_.estimate[1:], rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(second.covariance, whole_.of([1]).covariance, rtol=1e-9, atol=1e-15)
