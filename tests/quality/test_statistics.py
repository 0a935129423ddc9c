"""Statistics of a log in parts are those of the whole."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest

from ftproc import pipeline, scoring
from ftproc.core.model.frames import from_cartesian
from ftproc.quality import statistics
from ftproc.quality.statistics import RunStatistics
from ftproc.settings import FilterSettings
from tests.simulated import simulate

SPEC = "isolated=0.03:10-200,offset=4:8-40:20-100,nan=0.02,gap=2:3-5,duplicates=4"


@pytest.fixture(scope="module")
def made():
    """A log and its estimate."""
    flight = simulate("cruise", seed=1, duration_s=90.0, outliers=SPEC)
    filtering = pipeline.Filtering(flight.log, FilterSettings(), None)
    (part,) = filtering.method.parts(filtering.record, filtering.settings)
    return flight.log, part.estimate


def counted(log, estimate, edges, correction=None):
    found = RunStatistics(log, ())
    correction = np.zeros((len(log), 6)) if correction is None else correction
    for low, high in itertools.pairwise(edges):
        rows = estimate.rows(low, high)
        found.add(log.time_s[low:high], rows, from_cartesian(rows.run.state[:, :3]), correction[low:high], 0.25)
    return found.summary({})


@pytest.mark.parametrize("size", [1, 7, 100])
def test_parts_count_as_the_whole(made, size):
    log, estimate = made
    n = len(log)
    whole = counted(log, estimate, [0, n])
    parts = counted(log, estimate, [*range(0, n, size), n])
    assert json.dumps(parts, sort_keys=True)[:40]
    flat, again = flattened(whole), flattened(parts)
    assert flat.keys() == again.keys()
    for name, value in flat.items():
        assert again[name] == (pytest.approx(value, rel=1e-9) if isinstance(value, float) else value), name


def flattened(summary, prefix=""):
    found = {}
    for name, value in summary.items():
        if isinstance(value, dict):
            found |= flattened(value, f"{prefix}{name}.")
        else:
            found[prefix + name] = value
    return found


def test_a_patch_across_parts_is_one(made):
    log, estimate = made
    label = np.zeros_like(estimate.label)
    label[40:60, 0] = 2
    label[50, 0] = 3
    found = counted(log, estimate._replace(label=label), [0, 45, 51, 55, len(log)])
    assert found["components"]["range"]["longest_patch_s"] == pytest.approx(log.time_s[59] - log.time_s[40])


def test_a_part_that_did_not_converge_decides_for_the_log(made):
    log, estimate = made
    found = RunStatistics(log, ())
    nothing = np.zeros((len(log), 6))
    for settled in (True, False, True):
        found.add(log.time_s, estimate._replace(settled=settled), log.measurement, nothing, 0.0)
    assert found.summary({})["editing_converged"] is False


def test_the_largest_sigmas_of_a_long_log_are_kept(made, monkeypatch):
    log, estimate = made
    sigma = estimate.run.sigma.copy()
    sigma[333:336] = 5000.0
    monkeypatch.setattr(statistics, "MOST_KEPT", 100)
    found = counted(log, estimate._replace(run=estimate.run._replace(sigma=sigma)), [0, 400, len(log)])
    (interval,) = [s for s in found["poorly_observable"] if s["sigma_m"] > 5000]
    assert interval["from_s"] <= log.time_s[336]
    assert interval["to_s"] >= log.time_s[333]


def test_largest_correction_of_all_parts(made):
    log, estimate = made
    correction = np.zeros((len(log), 6))
    correction[10, :3] = (3.0, 4.0, 0.0)
    found = counted(log, estimate, [0, 300, len(log)], correction)
    assert found["correction_largest_m"] == pytest.approx(5.0)
    assert found["correction_outside_training"] == pytest.approx(0.25)


@pytest.mark.parametrize("method", ["ga-bpnn-ukf", "gate", "enkf"])
@pytest.mark.parametrize("missing", [(), (0,)])
def test_average_gradient_is_that_of_the_score(method, missing):
    """Also of a circle that crosses the cut of the azimuth, with values that a method leaves empty."""
    flight = simulate("calibration", seed=1, duration_s=120.0, dt_s=1.0, outliers="isolated=0.05:20-100")
    measurement = flight.log.measurement.copy()
    measurement[:, missing] = np.nan
    trajectory = pipeline.filter_log(replace(flight.log, measurement=measurement), FilterSettings(method=method))
    found = trajectory.metadata["summary"]["average_gradient"]
    expected = scoring.score(trajectory).as_dict()["average_gradient"]
    assert found.keys() == expected.keys()
    for name, value in expected.items():
        assert found[name] == (None if value is None else pytest.approx(value, rel=1e-12)), name
    assert (found["range_m"] is None) == (missing == (0,))
    assert found["elevation_rad"] > 0


def test_metadata_are_those_of_the_joined_parts():
    flight = simulate("cruise", seed=2, duration_s=60.0)
    settings = FilterSettings(editing="forward")
    filtering = pipeline.Filtering(flight.log, settings, None)
    (part,) = filtering.parts()
    assert filtering.metadata == replace(pipeline.filter_log(flight.log, settings)).metadata
    assert part.metadata == {"frame": "local"}
