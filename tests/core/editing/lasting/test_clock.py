"""Clocks that jump: by more than their rates tell, in a gap, and such that the target seems to go back."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.core.editing.lasting import clock
from ftproc.core.editing.lasting.curves import CLOCK, Curve, Setting
from ftproc.core.model.moving import between
from ftproc.records import PATCH
from ftproc.settings import FilterSettings
from tests.core.editing.lasting.scenes import N, scene
from tests.simulated import simulate
from tests.trust import hard

pytestmark = pytest.mark.compiled


@pytest.mark.parametrize(("seed", "size_s", "most_m"), [(0, 1.866, 1.0), (2, -1.46, 4.0), (5, 0.843, 1.0)])
def test_a_jump_of_the_clock_of_an_agile_target_is_found_and_taken_out(seed, size_s, most_m):
    """A car that weaves and a fighter, whose stamps go on evenly, and a sea-skimmer, whose stamps have a gap: within
    the jump they turn, so that the rates of their readings tell little."""
    late = hard.make("clock", seed).simulated
    found = pipeline.filter_log(late.log, FilterSettings(smooth=True))
    (step,) = found.metadata["summary"]["steps"]
    assert step["component"] == "clock"
    assert step["size_s"] == pytest.approx(size_s, abs=0.1)
    seen = late.log.time_s > size_s  # from the clock's first moment on
    error = (found.state[:, :3] - late.truth.position_m)[seen]
    assert np.sqrt(np.mean((error**2).sum(1))) < most_m


def test_readings_that_no_stamp_is_left_for_tell_the_track_all_the_same():
    """The first stamps are 1.9 s too early: when the readings are moved on, none is left for the first samples, but
    those after them lie on a track that the first readings tell."""
    late = hard.make("clock", 0).simulated
    found = pipeline.filter_log(late.log, FilterSettings(smooth=True))
    first = np.flatnonzero(late.log.time_s > 1.9)[:20]
    assert (found.outlier[: first[0]] == PATCH).all()
    assert np.abs(found.state[first, :3] - late.truth.position_m[first]).max() < 0.3  # 2.5 m by the later ones alone


@pytest.mark.parametrize(
    ("name", "seed", "spec", "size_s"),
    [
        ("overhead", 43, "late=1:0.5-2", 1.95),  # all components jump, but not as the rates there say
        ("manoeuvre", 41, "late=1:0.5-2", -1.397),  # three steps explain more, on a longer part of the log
        ("overhead", 43, "clock=1:0.5-2", 1.951),  # and stamps without readings say nothing for late ones
    ],
)
def test_a_jump_of_the_clock_is_no_step_of_three_components(name, seed, spec, size_s):
    late = simulate(name, seed=seed, duration_s=80.0, outliers=spec)
    found = pipeline.filter_log(late.log, FilterSettings(smooth=True))
    (step,) = found.metadata["summary"]["steps"]
    assert (step["component"], step["size_s"]) == ("clock", pytest.approx(size_s, abs=0.02))
    assert np.sqrt(np.mean(((found.state[:, :3] - late.truth.position_m) ** 2).sum(1))) < 1.0


def test_gaps_are_the_intervals_of_several_others_and_the_jump_is_as_long():
    time_s = np.r_[np.arange(10.0), 9.0 + np.arange(6.0, 20.0)]
    setting = Setting(time_s, np.zeros((24, 3)))
    assert [(jump.sample, jump.ways) for jump in clock.gaps(setting, 5)] == [(10, ((CLOCK,),))]
    assert clock.gap_s(setting, 10) == 5.0
    assert clock.gap_s(setting, 11) == 0.0
    assert clock.gap_s(setting, 0) == 0.0
    left = [clock.leaves_gap(setting, 10, late_s) for late_s in (5.0, 3.5, 6.5, 2.0, -1.0, 8.0)]
    assert left == [False, False, False, True, True, True]


def test_a_scene_is_put_in_the_order_of_the_times_without_the_jump():
    whole = scene((0, 5, 8))
    late = clock.moved(whole, Curve(CLOCK, 20, N, (0.0,)), 3.5)
    assert (np.diff(late.scene.log.time_s) >= 0).all()
    assert sorted(late.order.tolist()) == list(range(N))
    assert (late.scene.log.weight == whole.log.weight[late.order]).all()
    assert (late.scene.log.measurement == whole.log.measurement[late.order]).all()
    assert (late.scene.setting.time_s == late.scene.log.time_s).all()
    assert late.scene.log.time_s[late.order == 20] == whole.log.time_s[20] - 3.5


def test_states_between_those_of_a_track_are_on_it():
    t, wanted = np.arange(0.0, 5.0), np.array([0.25, 1.5, 3.75])

    def state(t):
        p = np.stack([t**2, 3 * t, 1 - 2 * t**2], 1)
        v = np.stack([2 * t, 3 + 0 * t, -4 * t], 1)
        return np.hstack([p, v, np.broadcast_to([2.0, 0.0, -4.0], (len(t), 3))])

    assert between(t, state(t), wanted) == pytest.approx(state(wanted))
