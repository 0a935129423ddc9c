"""When the stations of a fused flight contradict each other, and what is then left alone."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest

from ftproc.core.identification.motions.motion_models import ONLY_WHITE, Candidates
from ftproc.files.writing import ranges
from ftproc.fusion import flight, range_file
from ftproc.fusion.estimation import flight_faults
from ftproc.fusion.estimation.constants import Constants
from ftproc.fusion.estimation.events import APART_M, OFFSET, SCALE
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate_range

EITHER = Candidates(("white-jerk", "orbital"))


def current(used=(0.9, 0.9), possible=(1, 1), noise=1.0, unexamined=0):
    """A settled flight of two stations. used: share of the readings of each; possible: whether it takes part."""
    n = 100
    weight = [np.repeat((np.arange(n) < share * n).astype(float)[:, None], 3, 1) for share in used]
    return SimpleNamespace(
        stations=[SimpleNamespace(measurement=np.ones((n, 3))) for _ in used],
        weight=[each * part for each, part in zip(weight, possible, strict=True)],
        possible=[np.full((n, 3), float(part)) for part in possible],
        sigma=np.full((2, 3), noise), own=np.ones((2, 3)), unexamined=unexamined,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("changed", "contradict"),
    [
        ({}, False),
        ({"used": (0.9, 0.4)}, True),
        ({"possible": (0, 1)}, False),  # it was left out
        ({"possible": (0, 1), "used": (0.9, 0.4)}, True),
        ({"noise": 2.5}, True),
        ({"unexamined": 1}, True),
    ],
)
def test_stations_contradict_each_other_where_one_that_takes_part_is_rejected_or_noisier(changed, contradict):
    assert flight_faults._contradict(current(**changed)) is contradict


@pytest.mark.parametrize(("contradict", "expected"), [(True, ONLY_WHITE), (False, EITHER)])
def test_stations_that_contradict_each_other_tell_no_motion(monkeypatch, contradict, expected):
    found, asked = SimpleNamespace(unexamined=1, stations=[], weight=[]), []
    monkeypatch.setattr(flight_faults, "_contradict", lambda _: contradict)
    monkeypatch.setattr(flight_faults, "_explained", lambda readings, *_: (readings, found))
    monkeypatch.setattr(flight_faults.lasting.Readings, "of", lambda _: None)
    monkeypatch.setattr(flight_faults.beside, "fitted", lambda flight, *_: flight)
    monkeypatch.setattr(flight_faults.engine, "last", lambda flight, among: asked.append(among) or flight)
    found.events, found._replace = SimpleNamespace(time_s=np.zeros(3)), lambda **_: found
    assert flight_faults.fuse([], 3.0, None, EITHER, None, print) is found
    assert asked == [expected]


def test_heights_that_are_others_have_an_offset_of_their_own():
    """The other stations hear one transponder, be it the first that has its own; no stated 1-sigma means so."""
    cases = {(80.0, 80.0, APART_M): [0, 1], (APART_M, 80.0, 80.0): [1, 2], (1e3, 1e3, 80.0): [0, 1, 2]}
    for offsets, shared in cases.items():
        prior = np.zeros((3, 8))
        prior[:, OFFSET], prior[:, SCALE] = offsets, 0.02
        found = Constants.before(prior)
        assert (found.shared // 8)[:, 0].tolist() == shared
        assert found.prior[shared[1:], OFFSET].tolist() == [0.0] * (len(shared) - 1)
        assert np.count_nonzero(found.prior[:, OFFSET]) == 3 - len(shared) + 1


def _placed(folder, lower_m):
    """A flight with a theodolite that stands so much lower than its range file says; its RMS error, and the verdict."""
    simulated = simulate_range("range-radar", seed=3, duration_s=40.0)
    ranges.write(simulated, str(folder), None)
    path = folder / "range.toml"
    before, own = path.read_text().split("[station.theodolite3]")
    own = re.sub(r"height_m = (\S+)", lambda found: f"height_m = {float(found[1]) - lower_m}", own, count=1)
    path.write_text(f"{before}[station.theodolite3]{own}")
    found = flight.fuse(range_file.load(str(path)), FilterSettings(smooth=True)).trajectory
    truth = simulated.truth
    at = np.stack([np.interp(found.time_s, truth.time_s, axis) for axis in truth.position_m.T], 1)
    return np.sqrt(((found.state[:, :3] - at) ** 2).sum(1).mean()), found.metadata["summary"]["trust"]


@pytest.mark.slow
def test_a_station_at_a_wrong_place_is_left_out_where_the_others_agree(tmp_path_factory):
    """Above the sea instead of the ellipsoid: the others were blamed, and the track was ten times as far off."""
    right, _ = _placed(tmp_path_factory.mktemp("right"), 0.0)
    wrong, trust = _placed(tmp_path_factory.mktemp("wrong"), 47.0)
    assert wrong < 2 * right
    assert trust["verdict"] == "suspect"
    assert "theodolite3 contradicts the others: most of its readings are rejected" in " ".join(trust["reasons"])


def test_a_station_is_left_out_only_if_the_others_can_disagree():
    """Three components make a place: that two stations with no more agree says nothing; nor does it by odd biases."""
    stations = [SimpleNamespace(components=each) for each in ((0, 1, 2), (1, 2), (0,))]
    readings, pair = SimpleNamespace(stations=stations), SimpleNamespace(stations=stations[:2])
    probable, odd = (SimpleNamespace(constants=SimpleNamespace(farthest=each)) for each in (3.0, 5.0))
    assert flight_faults._left_out(readings, {2: probable}) == (2, probable)
    assert flight_faults._left_out(readings, {0: probable, 1: probable, 2: odd}) == (1, probable)
    assert flight_faults._left_out(readings, {1: probable, 2: probable}) is None
    assert flight_faults._left_out(readings, {0: probable}) is None
    assert flight_faults._left_out(pair, {1: probable}) is None
    assert flight_faults._left_out(readings, {}) is None


def test_a_station_is_at_a_wrong_place_if_without_it_alone_the_biases_are_probable():
    """Decisively: by more than one station's biases and a fault cost, and more than without any other."""
    stations = [SimpleNamespace(components=(1, 2))] * 4

    def flown(*sizes):
        return SimpleNamespace(constants=SimpleNamespace(estimate=np.array(sizes), prior=np.ones(len(sizes))))

    readings, odd, probable = SimpleNamespace(stations=stations), flown(3.0, -3.0, 3.0, 3.0), flown(0.5, 0.5, 0.5)
    less = flown(2.5, -2.5, 2.0)
    assert flight_faults._surprise(odd) == 16.0
    found = flight_faults._misplaced(readings, odd, {0: less, 1: probable, 2: less})
    assert found == (1, probable)
    assert flight_faults._misplaced(readings, odd, {0: probable, 1: probable}) is None
    assert flight_faults._misplaced(readings, less, {1: probable}) is None
    assert flight_faults._misplaced(readings, odd, {}) is None
    assert flight_faults._misplaced(SimpleNamespace(stations=stations[:2]), odd, {1: probable}) is None


def test_rejected_readings_ask_for_a_jump_only_where_many_lie_in_one_stretch():
    def rejects_many(rejected):
        weight = np.ones((1000, 3))
        weight[rejected, 1] = 0.0
        return flight_faults._rejects_many(SimpleNamespace(possible=[np.ones((1000, 3))], weight=[weight]))

    scattered = np.arange(0, 1000, 4)
    assert not rejects_many(scattered)
    assert not rejects_many(slice(700, 880))  # fewer than a fifth in all
    assert rejects_many(slice(700, 1000))
    assert rejects_many(np.union1d(scattered, np.arange(500, 650)))
