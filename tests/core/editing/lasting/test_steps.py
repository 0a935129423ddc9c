"""Steps that stay, in flights that obey the filter's model: found with place and size, and bridged; none elsewhere."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ftproc.core.editing import two_pass
from ftproc.core.editing.lasting import faults, settling
from ftproc.core.editing.lasting.curves import CLOCK, Curve, Setting, without
from ftproc.core.editing.lasting.faults import Shift, Step, levelled
from ftproc.core.filtering.records import Observations
from ftproc.core.model.frames import from_cartesian, line_of_sight_axes, to_cartesian, wrap
from tests.core.tracks import SIGMA, matched
from tests.simulated import simulate

pytestmark = pytest.mark.compiled

UNKNOWN = two_pass.Known(np.full(3, np.nan), None, 4.0)
N = 500
DIRT = "isolated=0.2:8-300,offset=2:10-30:20-200"


def flight(seed):
    return matched(seed, N, dt=0.2, q=0.5, distance=7000.0)


def edit(a, z):
    return two_pass.edit(a.time, z, UNKNOWN)


@pytest.mark.parametrize(
    ("c", "k", "size"),
    [
        pytest.param(c, k, size, marks=pytest.mark.slow if c == number else [])
        for c, k in ((0, 120), (1, 380), (2, 240))
        for number, size in enumerate([300.0, 20.0, 40.0])
    ],
)
def test_a_step_is_found_with_its_place_and_size_and_the_longer_side_is_kept(c, k, size):
    a = flight(c)
    z = a.z.copy()
    z[k:, c] -= size * SIGMA[c]
    found = edit(a, z)
    (step,) = found.faults.steps
    assert (step.component, step.sample) == (c, pytest.approx(k, abs=1))
    assert step.size == pytest.approx(-size * SIGMA[c], abs=5 * step.sigma)
    assert 0.1 * SIGMA[c] < step.sigma < 3 * SIGMA[c]
    truth = a.truth[:, :3] if k > N / 2 else to_cartesian(from_cartesian(a.truth[:, :3]) - _at(c, size * SIGMA[c]))
    off = np.abs(found.smoothed().state[:, :3] - truth)
    extra, _ = faults.spread(found.smoothed().state, found.faults.shifts)
    assert (off < 5 * np.sqrt(found.smoothed().sigma[:, :3] ** 2 + extra)).all(1).mean() > 0.98
    assert found.weight.mean() > 0.98


@pytest.mark.parametrize(("c", "k"), [(0, 100), (1, 350), (2, 300)])
def test_a_step_in_noise_that_grows(c, k):
    a = flight(c)
    z = a.z + np.random.default_rng(c).standard_normal(a.z.shape) * SIGMA * np.linspace(0, 3, N)[:, None]
    z[k:, c] += 20 * SIGMA[c]
    found = edit(a, z)
    assert found.decision.drifts
    (step,) = found.faults.steps
    assert (step.component, step.sample) == (c, pytest.approx(k, abs=1))
    assert step.size == pytest.approx(20 * SIGMA[c], abs=5 * step.sigma)


@pytest.mark.parametrize("interval_s", [1.0, 3.0])
def test_a_step_that_the_motion_hides_is_left_in(interval_s):
    a = matched(5, 400, dt=interval_s, q=5.0, distance=9000.0)
    z = a.z.copy()
    z[180:, 1] += 10 * SIGMA[1]
    found = edit(a, z)
    assert not any(step.sure for step in found.faults.steps)
    assert found.faults.shifts == ()
    assert (found.log.measurement == z).all()
    assert (found.weight[:, 1] == 0).sum() < 12


def _at(c, value):
    return value * np.eye(3)[c]


def test_both_angles_at_once_among_outliers_and_after_a_loss_of_track():
    a, draw = flight(7), np.random.default_rng(1)
    z = a.z.copy()
    z[200:, 1:] += np.array([30, -25]) * SIGMA[1:]
    spike = draw.random(z.shape) < 0.02
    z += spike * draw.choice([-1, 1], z.shape) * draw.uniform(10, 100, z.shape) * SIGMA
    z[195:200] = np.nan
    found = edit(a, z).faults.steps
    assert sorted(s.component for s in found) == [1, 2]
    assert all(195 <= s.sample <= 210 for s in found)


@pytest.mark.slow
def test_steps_that_hard_flying_hides_among_many_outliers():
    """The filter follows such a step as motion, and rejects what lies beside it."""
    found = 0
    for seed in (0, 3, 5, 6, 7, 8, 9):
        dirty = simulate("manoeuvre", seed=seed, duration_s=60.0, dt_s=0.1, outliers=DIRT)
        c, k, z = seed % 3, 250 + 17 * seed, dirty.log.measurement.copy()
        size = (-1) ** seed * 40 * dirty.sigma[c]
        z[k:, c] += size
        known = two_pass.edit(dirty.log.time_s, z, UNKNOWN).faults.steps
        found += any(step.component == c and abs(step.sample - k) < 12 for step in known)
    assert found >= 4


@pytest.mark.parametrize("late", [0.4, pytest.param(-0.8, marks=pytest.mark.slow)])
def test_a_clock_that_jumps(late):
    a = matched(11, N, dt=0.2, q=0.05, distance=7000.0)
    k = 300
    time = a.time + late * (np.arange(N) >= k) * (late > 0)
    z = a.z.copy()
    if late < 0:  # under an even clock, readings of a target that is further on its way
        place = a.truth[:, :3] - late * a.truth[:, 3:6] + 0.5 * late**2 * a.truth[:, 6:]
        z[k:] += (from_cartesian(place) - from_cartesian(a.truth[:, :3]))[k:]
        z[:, 1] = wrap(z[:, 1])
    found = edit(a._replace(time=time), z).faults.steps
    assert (found[0].component, found[0].sample) == (CLOCK, pytest.approx(k, abs=1))
    assert found[0].size == pytest.approx(late, abs=5 * found[0].sigma + 0.05)


@pytest.mark.parametrize(("gap", "seen"), [(0, True), (6, True), (12, False), (60, False)])
def test_a_step_behind_a_gap_of_its_component_is_not_sure(gap, seen):
    """A track that was not seen for a while may be anywhere, and so may seem to jump."""
    possible = np.ones((100, 3), bool)
    possible[60 - gap : 60, 1] = False
    scene = SimpleNamespace(possible=possible)
    assert settling._seen_before(scene, Curve(1, 60, 100, (1.0,))) == seen
    assert settling._seen_before(scene, Curve(0, 60, 100, (1.0,)))


@pytest.mark.parametrize(("speed_mps", "may_be"), [(2.0, True), (7.0, True), (8.0, False), (200.0, False)])
@pytest.mark.parametrize("late_s", [1.0, -1.0])
def test_a_clock_that_jumps_by_a_second_may_be_a_halt_of_what_is_slow(speed_mps, may_be, late_s):
    """Standing still for a second and catching up asks for four times the way by the second squared."""
    way = speed_mps * (0.1 * np.arange(100))
    z = from_cartesian(np.stack([300 + way, 400 - 0 * way, 50 + 0 * way], 1))
    late = -np.gradient(z, 0.1, axis=0)
    z[70] = np.nan
    scene = SimpleNamespace(log=SimpleNamespace(measurement=z), setting=SimpleNamespace(late=late))
    assert settling._may_be_a_halt(scene, Curve(CLOCK, 60, 100, (late_s,))) == may_be


@pytest.mark.parametrize("seed", range(6))
def test_none_in_clean_flights_with_spikes_and_patches_and_bad_starts(seed):
    a, draw = flight(seed), np.random.default_rng(seed)
    z = a.z.copy()
    if seed % 2:
        z[draw.random(z.shape) < 0.03] += 1e-2
        z[300:315, 1] += 60 * SIGMA[1]
        z[:8] += 50 * SIGMA
    assert edit(a, z).faults.steps == ()


def test_what_is_taken_out_is_what_was_added_and_the_level_of_most_readings_stays():
    a = flight(3)
    added = [Step(0, 100, 70.0, 1.0), Step(0, 350, -70.0, 1.0), Step(1, 400, -3e-3, 1e-4), Step(2, 210, 2e-3, 1e-4)]
    setting, z = Setting(a.time, np.zeros((N, 3))), a.z.copy()
    z[100:350, 0] += 70.0  # the readings on both sides agree
    z[400:, 1] -= 3e-3
    z[210:, 2] += 2e-3
    moved = levelled(Observations(a.time, z, np.ones((N, 3))), SIGMA**2, added)
    assert [(m.component, m.begin, m.end) for m in moved] == [(0, 100, 350), (1, 400, N), (2, 0, 210)]
    back = without(z, setting, moved)
    np.testing.assert_allclose(back[:, 0], a.z[:, 0], atol=1e-9)
    np.testing.assert_allclose(wrap(back[:, 1] - a.z[:, 1]), 0, atol=1e-12)
    np.testing.assert_allclose(back[:, 2] - a.z[:, 2], 2e-3, atol=1e-12)


def test_spread_is_the_move_of_the_position():
    a = flight(4)
    for c in range(3):
        shift = Shift(c, 300, N, 1e-3 * (1000 if c == 0 else 1))
        axes, lines = faults.spread(a.truth, [shift])
        moved = to_cartesian(from_cartesian(a.truth[:, :3]) + _at(c, 1e-3 * shift.sigma)) - a.truth[:, :3]
        np.testing.assert_allclose(np.sqrt(axes[300:]), 1e3 * np.abs(moved[300:]), rtol=1e-2, atol=1e-3)
        along = np.einsum("kij,kj->ki", line_of_sight_axes(a.truth[:, :3]), 1e3 * moved)
        np.testing.assert_allclose(np.sqrt(lines[300:]), np.abs(along[300:]), rtol=1e-2, atol=2e-2)
        assert not axes[:300].any()
