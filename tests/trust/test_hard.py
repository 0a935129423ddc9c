"""The generator of hard faults and hard flights, and short versions of their tables."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.records import FlagArray, FloatArray
from ftproc.simulation import Simulation, simulate_range
from ftproc.simulation.contamination import CODES
from tests.simulated import runs as runs_of
from tests.simulated import trajectory_for
from tests.trust import fused_faults, hard, hard_flights, runs, tables


def codes(name: str, seed: int) -> tuple[FlagArray, Simulation]:
    simulated = hard.make(name, seed).simulated
    assert simulated.truth.outlier is not None
    return simulated.truth.outlier, simulated


def test_flights_cover_rates_distances_and_noise() -> None:
    assert len(hard_flights.TARGETS) >= 40
    rates = [target.rate_hz for target in hard_flights.TARGETS]
    noises = [target.sigma[0] for target in hard_flights.TARGETS]
    assert (min(rates), max(rates)) == (0.2, 1000)
    assert (min(noises), max(noises)) == (0.002, 100)
    assert len(hard_flights.ORDER) == sum(1 + target.manoeuvring for target in hard_flights.TARGETS)
    away = []
    for number, target in enumerate(hard_flights.TARGETS):
        time_s = np.arange(0, target.lasts_s, 1 / target.rate_hz)
        path = target.build(np.random.default_rng(number), target.lasts_s).at(time_s)[0]
        away.append(float(np.median(np.linalg.norm(path, axis=1))))
        assert 300 <= len(time_s) <= 5000, target.name
        assert (path[:, 2] > 0).mean() > 0.9, target.name
    assert min(away) < 100
    assert max(away) > 1.2e6


@pytest.mark.parametrize("name", list(hard.CLASSES))
def test_a_class_and_a_seed_are_always_the_same_log(name: str) -> None:
    one, other = hard.make(name, 1), hard.make(name, 1)
    np.testing.assert_array_equal(one.simulated.log.measurement, other.simulated.log.measurement)
    assert one.what == other.what
    assert len(one.simulated.log) == len(one.simulated.truth)
    far = np.abs(off_truth(one.simulated)) > 8 * np.array(one.simulated.sigma)
    assert far.sum() >= hard.FEWEST_SHOWN or name not in hard.SHOWN


def off_truth(simulated: Simulation) -> FloatArray:
    off = simulated.log.measurement - from_cartesian(simulated.truth.position_m)
    off[:, 1] = wrap(off[:, 1])
    return off


@pytest.mark.parametrize("seed", range(4))
def test_classes_are_what_they_are_called(seed: int) -> None:
    code, _ = codes("two", seed)
    assert sorted((code != 0).any(0)) == [False, True, True]
    code, _ = codes("ends", seed)
    assert (code[[-1, 0][(seed + 1) % 2]] != 0).sum() == 1
    code, _ = codes("three", seed)
    assert sum(len(runs_of(column)) for column in code.T) <= 3
    code, _ = codes("exchange", seed)
    assert set(code.any(1)) == {False, True}
    assert (code.any(1) == (code == CODES["other"]).all(1)).all()
    _, simulated = codes("noiseless", seed)
    assert sorted(np.median(np.abs(off_truth(simulated)), 0) < 1e-9) == [False, False, True]
    _, simulated = codes("missing", seed)
    assert np.isnan(simulated.log.measurement).mean() == pytest.approx(0.5, abs=0.06)


def test_missed_and_false_alarms_are_counted() -> None:
    code, simulated = codes("exchange", 0)
    bad = (code > 0).astype(np.uint8)
    none, all_of_them, others = (flagged(simulated, each) for each in (0 * bad, bad, 1 - bad))
    assert none.missed == none.outliers > 0.5 * bad.sum()
    assert (all_of_them.missed, all_of_them.false_alarms) == (0, 0)
    assert others.false_alarms == others.good == int((bad == 0).sum())
    step, stepped = codes("step", 0)
    assert flagged(stepped, 0 * step).outliers == 0
    assert flagged(stepped, 0 * step).good == int((step == 0).sum())


def flagged(simulated: Simulation, outlier: FlagArray) -> runs.Detected:
    return runs.detected(trajectory_for(simulated.truth, outlier=outlier), simulated)


def test_few_runs_are_within_their_bounds() -> None:
    """One seed of the cheap classes of each group; the bounds of `make trust` are of more."""
    found = {name: hard.run(name, 0) for name in ("stuck", "step", "noise", "isolated", "clean", "abrupt")}
    found["offset"] = hard.run("offset", 2)
    sound = [*found["clean"], *found["abrupt"]]
    assert not list(tables.beyond("sound", sound, tables.Bound(wrong=0, reported=0)))
    assert max(run.detected.false_alarms / run.detected.good for run in sound) < 1e-3
    assert all(run.detected.missed == 0 for run in found["isolated"])
    every = [run for each in found.values() for run in each]
    assert not list(tables.beyond("all", every, tables.Bound(wrong=0.4, confident=0)))


@pytest.mark.parametrize("fault", list(fused_faults.FAULTS))
def test_a_fault_is_in_one_station(fault: str) -> None:
    for scenario in fused_faults.SCENARIOS:
        simulated = simulate_range(scenario, 1, 20.0)
        if not fused_faults.able(simulated, fault):
            continue
        changed, station = fused_faults.spoilt(simulated, fault, 1)
        for before, after in zip(simulated.stations, changed.stations, strict=True):
            logs = [np.column_stack([s.log.time_s, s.log.measurement]) for s in (before, after)]
            assert np.array_equal(*logs, equal_nan=True) == (before.name != station)
            assert (np.diff(after.log.time_s) >= 0).all()


@pytest.mark.slow
def test_a_step_of_one_station_is_told_from_the_same_flight_without_it() -> None:
    (run,) = fused_faults.run(("elevation-50",), "range-radar", 0)
    assert run.ratio < 1.2
    assert not run.confident
    assert run.named == "it"
    assert "range-radar 0 elevation-50 in radar: " in str(run)


def test_the_command_prints_runs_and_a_table(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["hard", "1-1", "clean", "-v", "-j", "1"])
    hard.main()
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(",")[0] for line in lines[:2]] == ["clean 1 filter", "clean 1 smooth"]
    assert lines[-1].startswith("| clean | 2 | 0 | 0 | 0 | - |")
    monkeypatch.setattr(sys, "argv", ["hard", "1-1", "clear"])
    with pytest.raises(SystemExit):
        hard.main()
    assert "there is no clear; there are offset, ramp" in capsys.readouterr().err
