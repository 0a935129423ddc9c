"""Reassessment of the rejected runs of an edited log: what the rejected runs of manoeuvring flights are, beside what
the decisions say."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.core import odds
from ftproc.core.editing import two_pass
from ftproc.core.editing.lasting.rejected import followed, joining, rejected_runs
from ftproc.core.editing.lasting.rejected.joining import LENGTHS, Run
from ftproc.core.work import Work
from ftproc.quality.verdict import SUSPECT
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate

pytestmark = pytest.mark.compiled

UNKNOWN = two_pass.Known(np.full(3, np.nan), None, 4.0)


def error_m(seed):
    """RMS of the smoothed positions of a manoeuvring flight at 10 Hz with nine patches."""
    flight = simulate("manoeuvre", seed=seed, dt_s=0.1, duration_s=60.0)
    found = two_pass.edit(flight.log.time_s, flight.log.measurement, UNKNOWN)
    off = found.smoothed().state[:, :3] - flight.truth.position_m
    return float(np.sqrt((off**2).sum(1).mean()))


@pytest.mark.parametrize(
    ("seed", "most_m"),
    [
        (22, 0.84),  # a ramp whose first five readings the track has followed
        (24, 1.5),  # a patch that was followed: the 46 good readings after it were rejected
        (30, 1.0),  # a walk-off that begins slowly
        (31, 1.25),  # a ramp that was followed for 29 readings, beside another patch
        (33, 0.65),  # a ramp that was followed up to the end of the log
    ],
)
def test_patches_that_were_followed(monkeypatch, seed, most_m):
    assert error_m(seed) < most_m
    monkeypatch.setattr(two_pass, "reassess_rejected", lambda record, decision, work: (decision, ()))
    assert error_m(seed) > 1.15 * most_m


@pytest.mark.parametrize("seed", [22, 23])
def test_a_patch_that_was_followed_up_to_the_first_good_readings_behind_it(monkeypatch, seed):
    """Offsets of 9 and 10 sigmas over 19 and 16 readings of an azimuth, that a manoeuvring target seems to follow: two
    or four readings where the track leaves and returns are rejected, some of them the good ones behind the patch."""
    flight = simulate(
        "manoeuvre", seed=seed, dt_s=0.2, duration_s=240.0, outliers="isolated=0.03:6-300,offset=2:8-20:8-100"
    )

    def off():
        found = pipeline.filter_log(flight.log, FilterSettings(smooth=True))
        away = np.abs(found.state[:, :3] - flight.truth.position_m) / found.sigma[:, :3]
        missed = (flight.truth.outlier > 0) & (found.outlier == 0)
        return float((away > 5).any(1).mean()), int(missed.sum())

    assert off() == (0.0, 0)
    monkeypatch.setattr(rejected_runs, "followed", lambda *_: ())
    share, missed = off()
    assert share > 0.015
    assert missed > 12


@pytest.mark.parametrize(("margin", "chosen"), [(43.0, "a patch of outliers"), (47.0, "motion")])
def test_what_may_be_motion_or_a_patch_is_named(monkeypatch, margin, chosen):
    """That the ramp is a patch is likelier by 45: with a prior of about so much against it either may be."""
    others = SimpleNamespace(FAULT=-margin, MOTION=odds.MOTION, LIKELIER=odds.LIKELIER, ONE_END=odds.ONE_END)
    monkeypatch.setattr(rejected_runs, "odds", others)
    flight = simulate("manoeuvre", seed=31, dt_s=0.1, duration_s=60.0)
    summary = pipeline.filter_log(flight.log, FilterSettings(smooth=True)).metadata["summary"]
    (rival,) = summary["rivals"]
    assert (rival["component"], rival["chosen"]) == ("azimuth", chosen)
    assert 13 < rival["from_s"] < rival["to_s"] < 19
    assert 0 < rival["nats"] < 5
    assert summary["trust"]["verdict"] == SUSPECT
    assert any("may be" in reason for reason in summary["trust"]["reasons"])


@pytest.mark.parametrize("seed", [0, 13])
def test_a_launch_at_the_beginning_of_a_log_is_no_patch(monkeypatch, seed):
    """A rocket burns for a second or two, with which its log begins: azimuth and elevation leave together what becomes
    of it. Each by itself seems a patch, 17 and 30 m off."""

    def off_m():
        found = pipeline.filter_log(flight.log, FilterSettings(smooth=True))
        error_m = np.sqrt(((found.state[:, :3] - flight.truth.position_m) ** 2).sum(1).mean())
        return error_m, (found.outlier != 0).sum()

    flight = simulate("ballistic", seed=seed)
    error_m, outliers = off_m()
    assert error_m < 0.7
    assert outliers == 0
    monkeypatch.setattr(joining, "_together", lambda alone: ())
    assert off_m()[0] > 10.0


def test_runs_that_are_rejected_at_the_same_time_are_weighed_together():
    runs = [Run(c, np.arange(*span), np.arange(*motion), True) for c, span, motion in (
        (0, (10, 30), (10, 30)), (1, (12, 34), (12, 34)), (2, (12, 34), (0, 0)), (2, (40, 60), (40, 60)),
    )]  # fmt: skip
    (found,) = joining._together(runs)
    assert (found.component, [each.component for each in found.beside]) == (0, [1])
    assert found.key != runs[0].key
    ways = list(rejected_runs._ways(None, np.zeros((100, 3)), found, 0))
    assert [follows for _, follows in ways] == [False, True]
    assert all((way.sum(0) == [20, 22, 0]).all() for way, _ in ways)
    before, after = np.zeros((100, 3)), ways[0][0]
    assert found.moves(before, after, 0)
    after[:, 1] = 0.0
    assert not found.moves(before, after, 0)


def test_what_is_alike_is_left_alone():
    """Where nothing is rejected there is nothing to reassess, and the very decision is returned."""
    flight = simulate("calibration", seed=2, duration_s=60.0, dt_s=0.2, outliers="none")
    record, decision = two_pass._decided(
        flight.log.time_s, flight.log.measurement, UNKNOWN, None, two_pass.Work(len(flight.log)), False,
        np.zeros(flight.log.measurement.shape, bool),
    )  # fmt: skip
    decision = decision._replace(weight=record.possible.astype(float))
    assert rejected_runs.reassess_rejected(record, decision, Work(10**6)) == (decision, ())
    assert rejected_runs.reassess_rejected(record, decision, Work(10**6))[0] is decision


def test_ways_to_begin():
    n, samples = 200, np.arange(90, 100)
    part = two_pass.Record(
        np.arange(float(n)), np.zeros((n, 3)), np.ones((n, 3), bool), np.ones((n, 3)), *[None] * 5
    )  # fmt: skip
    weight = np.ones((n, 3))
    weight[samples, 1] = 0.0
    ways = [way for way, _ in rejected_runs._ways(part, weight, Run(1, samples + 1000, samples[:0], True), 1000)]
    assert len(ways) == 1 + 4 * len(LENGTHS)
    rejected = {tuple(np.flatnonzero(way[:, 1] == 0)[[0, -1]]) for way in ways}
    assert rejected == {
        (90, 99), *((90 - length, 99) for length in LENGTHS), *((90, 99 + length) for length in LENGTHS),
        *((90 - length, 89) for length in LENGTHS), *((100, 99 + length) for length in LENGTHS),
    }  # fmt: skip
    assert all((way[:, [0, 2]] == 1).all() for way in ways)
    taken_in, _ = next(rejected_runs._ways(part, weight, Run(1, samples, samples, True), 0))
    assert (taken_in == 1).all()


def test_runs_that_no_work_was_left_for_are_counted():
    flight = simulate("manoeuvre", seed=3, duration_s=60.0, dt_s=0.1)
    seen = []

    def reassessed(record, decision, work):
        seen.append((record, decision))
        return decision, ()

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(two_pass, "reassess_rejected", reassessed)
        two_pass.edit(flight.log.time_s, flight.log.measurement, UNKNOWN)
    (record, decision), = seen  # fmt: skip
    work = Work(0, 1, 0)
    rejected_runs.reassess_rejected(record, decision, work)
    runs = len(list(joining.rejected_runs(record, decision, 10)))
    assert work.passed == runs - 1


def test_no_patch_lies_beside_a_run_where_readings_are_not_off(monkeypatch):
    """Two good readings are rejected: without those beside them any track is as likely, but they are not off it."""
    flight = simulate("calibration", seed=2, duration_s=60.0, dt_s=0.2, outliers="none")
    record, decision = two_pass._decided(
        flight.log.time_s, flight.log.measurement, UNKNOWN, None, two_pass.Work(len(flight.log)), False,
        np.zeros(flight.log.measurement.shape, bool),
    )  # fmt: skip
    weight, samples = record.possible.astype(float), np.arange(90, 92)
    weight[samples, 1] = 0.0
    decision, run = followed.with_weight(record, decision, weight), Run(1, samples, samples[:0], True)
    assert not list(followed.followed(record, decision, run, 0, decision.model))
    monkeypatch.setattr(followed, "SURELY_OFF", 0.0)
    assert list(followed.followed(record, decision, run, 0, decision.model))
    by_hand = record._replace(accepted=np.ones(weight.shape, bool))
    assert all((other == 1).all() for other in followed.followed(by_hand, decision, run, 0, decision.model))
    monkeypatch.setattr(followed, "_likely", lambda *_: -np.inf)  # a component has too few readings without a patch
    assert not list(followed.followed(record, decision, run, 0, decision.model))
