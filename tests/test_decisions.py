"""What decisions by hand do to an estimate: in all ways of editing, for one station and for several."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import ftproc
from ftproc import pipeline
from ftproc.core.by_hand import Accepted
from ftproc.core.editing import two_pass
from ftproc.core.editing.decisions import Decision, Record
from ftproc.core.work import Work
from ftproc.errors import InputError
from ftproc.files import decisions
from ftproc.files.decisions import Decisions
from ftproc.methods import anti_outlier
from ftproc.records import ACCEPTED, ENDS, GOOD, MISSING, REJECTED, Line, MeasurementLog, Trajectory
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate
from ftproc.simulation.simulation import Simulation

SMOOTH = FilterSettings(smooth=True)
WAYS = {
    "two-pass": SMOOTH,
    "live": FilterSettings(editing="live", lag_s=1.0),
    "forward": FilterSettings(editing="forward"),
    "forward, specified": FilterSettings(editing="forward", noise=(3.0, 2e-4, 2e-4), jerk_psd_m2ps5=10.0),
}


@cache
def followed(seed: int) -> Simulation:
    """A flight with a fifth of its readings in three patches of all components at once, as of another target."""
    spec = "all.offset=3:30-50:40-400,isolated=0.01"
    return simulate("manoeuvre", seed=seed, dt_s=0.1, duration_s=60, outliers=spec)


@cache
def clean(seed: int = 5, duration_s: float = 40) -> Simulation:
    return simulate("manoeuvre-clean", seed=seed, dt_s=0.1, duration_s=duration_s)


def by_hand(log: MeasurementLog, *decided: tuple[str, int, int, str]) -> MeasurementLog:
    """The log with decisions: component, first and last sample, use."""
    lines = [
        Line(k, component, ENDS[0], float(log.time_s[first]), float(log.time_s[last]), use)
        for k, (component, first, last, use) in enumerate(decided, 2)
    ]
    return Decisions("d.csv", "0", tuple(lines)).applied(log)


def patches(flight: Simulation) -> list[tuple[str, int, int, str]]:
    """The patches of all components as decisions."""
    assert flight.truth.outlier is not None
    together = np.r_[0, (flight.truth.outlier != 0).all(1).astype(int), 0]
    edges = np.flatnonzero(np.diff(together)).reshape(-1, 2)
    return [("all", int(low), int(high) - 1, "bad") for low, high in edges if high - low > 5]


def error_m(trajectory: Trajectory, flight: Simulation) -> float:
    off = trajectory.state[:, :3] - flight.truth.position_m[np.searchsorted(flight.truth.time_s, trajectory.time_s)]
    return float(np.sqrt((off**2).sum(1).mean()))


def verdict(trajectory: Trajectory) -> str:
    return str(trajectory.metadata["summary"]["trust"]["verdict"])


@pytest.mark.parametrize("seed", [3, 7, pytest.param(18, marks=pytest.mark.slow)])
def test_three_lines_free_the_rest(seed: int) -> None:
    """Of a flight that comes out wrong; what they leave is as good as if the readings had been blanked."""
    flight = followed(seed)
    decided = by_hand(flight.log, *patches(flight))
    assert decided.by_hand is not None
    bad = decided.by_hand.flags == REJECTED
    assert len(patches(flight)) == 3
    assert bad.mean() > 0.18
    before, after = (pipeline.filter_log(log, SMOOTH) for log in (flight.log, decided))
    blanked = pipeline.filter_log(
        replace(flight.log, measurement=np.where(bad, np.nan, flight.log.measurement)), SMOOTH
    )
    assert verdict(before) != "consistent"
    assert verdict(after) == "consistent"
    assert error_m(before, flight) > 2 * error_m(after, flight)
    assert error_m(after, flight) < 1.1 * error_m(blanked, flight)
    assert (after.outlier[bad] == REJECTED).all()
    assert (after.outlier[~bad] < MISSING).all()


@pytest.mark.parametrize("way", WAYS)
def test_what_is_rejected_is_not_used(way: str) -> None:
    flight = clean()
    log = by_hand(flight.log, ("azimuth", 200, 230, "bad"))
    moved = replace(log, measurement=log.measurement.copy())
    moved.measurement[200:231, 1] += 0.5
    one, other = (pipeline.filter_log(each, WAYS[way]) for each in (log, moved))
    assert (one.outlier[200:231, 1] == REJECTED).all()
    assert np.array_equal(one.state, other.state, equal_nan=True)
    assert np.array_equal(one.sigma, other.sigma, equal_nan=True)


@pytest.mark.parametrize("way", WAYS)
def test_what_is_accepted_is_used_whatever_the_editor_thinks(way: str) -> None:
    flight = clean(4, 30)
    log = replace(flight.log, measurement=flight.log.measurement.copy())
    log.measurement[200:220, 0] += 200.0  # some 60 sigma
    settings = WAYS[way]
    left, used = (pipeline.filter_log(each, settings) for each in (log, by_hand(log, ("range", 200, 219, "good"))))
    assert not np.isin(left.outlier[205:220, 0], (GOOD, ACCEPTED)).all()
    assert (used.outlier[200:220, 0] == ACCEPTED).all()
    follows = np.abs(used.measurement[205:219, 0] - log.measurement[205:219, 0])
    assert np.median(follows) < 60.0
    inside = used.metadata["decisions"]["lines"][0]["inside_gate"]  # where the estimate follows them as motion
    assert verdict(used) != "consistent" or inside == 20, "accepted readings that the rest contradicts are said"


def test_held_readings_are_used_when_they_are_accepted() -> None:
    """They are taken neither for copies nor for a component that is stuck."""
    flight = clean()
    log = replace(flight.log, measurement=flight.log.measurement.copy())
    log.measurement[1:-1:2, 2] = log.measurement[0:-2:2, 2]
    plain, used = (pipeline.filter_log(each, SMOOTH) for each in (log, by_hand(log, ("elevation", 200, 211, "good"))))
    held = [found.metadata["summary"]["components"]["elevation"]["held"] for found in (plain, used)]
    assert (used.outlier[200:212, 2] == ACCEPTED).all()
    assert held[0] - held[1] == 6


def test_every_round_of_decisions_keeps_what_is_accepted() -> None:
    log = clean().log
    measurement, far = log.measurement.copy(), np.arange(5, 400, 50)
    measurement[far, 0] += np.where(far % 100 == 5, 300.0, -300.0)
    for times, kept in ((log.time_s[far], True), (log.time_s[:0], False)):
        known = two_pass.Known(np.full(3, np.nan), None, 4.0, Accepted((times, times[:0], times[:0])))
        _, decision = two_pass._decided(
            log.time_s, measurement, known, None, Work(len(log)), False, np.zeros(measurement.shape, bool)
        )
        assert (decision.weight[far, 0] > 0).all() == kept


def test_no_later_step_takes_back_what_is_accepted(monkeypatch: pytest.MonkeyPatch) -> None:
    def rejecting(record: Record, decision: Decision, work: Work) -> tuple[Decision, tuple[()]]:
        weight = decision.weight.copy()
        weight[200:220] = 0.0
        return decision._replace(weight=weight), ()

    monkeypatch.setattr(two_pass, "reassess_rejected", rejecting)
    found = pipeline.filter_log(by_hand(clean().log, ("range", 200, 219, "good")), SMOOTH)
    assert (found.outlier[200:220, 0] == ACCEPTED).all()
    assert (found.outlier[200:220, 1] != GOOD).all()


def test_each_line_has_its_effect_in_the_metadata() -> None:
    flight = followed(3)
    decided = by_hand(flight.log, *patches(flight), ("range", 0, 3, "auto"), ("range", 5, 6, "good"))
    found = pipeline.filter_log(decided, SMOOTH).metadata
    lines = found["decisions"]["lines"]
    assert [line["line"] for line in lines] == [2, 3, 4, 5, 6]
    assert found["decisions"]["sha256"] == "0"
    low, high = patches(flight)[0][1:3]
    assert lines[0]["readings"] == np.isfinite(flight.log.measurement[low : high + 1]).sum()
    assert lines[0]["inside_gate"] < 0.1 * lines[0]["readings"]
    assert lines[4] | {"readings": 2, "inside_gate": 2} == lines[4]
    assert found["summary"]["by_hand"] | {"accepted": 2, "contradicted": [], "idle": []} == found["summary"]["by_hand"]


def test_from_python(tmp_path: Path) -> None:
    """With a file, or with decisions that were read before."""
    path = tmp_path / "d.csv"
    path.write_text("component,from_row,to_row,use\nrange,3,5,bad\n")
    for given in (path, str(path), decisions.read(path)):
        found = ftproc.filter_log(clean().log, decisions=given)
        assert np.flatnonzero(found.outlier[:, 0] == REJECTED).tolist() == [3, 4, 5]


def test_a_component_rejected_throughout_is_not_observable() -> None:
    flight = clean()
    found = pipeline.filter_log(by_hand(flight.log, ("range", 0, len(flight.log) - 1, "bad")))
    assert found.metadata["summary"]["not_observable"] == ["range"]
    assert (found.outlier[:, 0] == REJECTED).all()
    assert np.isnan(found.state).all()
    with pytest.raises(InputError, match="every reading is rejected by hand"):
        pipeline.filter_log(by_hand(flight.log, ("all", 0, len(flight.log) - 1, "bad")))


def test_a_long_log_in_segments(monkeypatch: pytest.MonkeyPatch) -> None:
    """Decisions fall on the right samples of each."""
    for name, value in (("LONGEST_WHOLE", 3000), ("KEPT", 3000), ("KEPT_MARGINS", 1)):
        monkeypatch.setattr(anti_outlier, name, value)
    flight = simulate("cruise", seed=2, dt_s=0.1, duration_s=1000)
    log = by_hand(flight.log, ("azimuth", 2000, 2100, "bad"), ("range", 7000, 7005, "good"))
    log.measurement[7000:7006, 0] += 30.0
    found = pipeline.filter_log(log)
    assert found.metadata["segments"] > 1
    rejected, accepted = found.outlier[:, 1] == REJECTED, found.outlier[:, 0] == ACCEPTED
    there = np.isfinite(log.measurement)
    assert np.array_equal(np.flatnonzero(rejected), 2000 + np.flatnonzero(there[2000:2101, 1]))
    assert np.array_equal(np.flatnonzero(accepted), 7000 + np.flatnonzero(there[7000:7006, 0]))
