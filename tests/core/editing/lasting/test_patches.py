"""Patches that last: found whatever their shape, in one component or all; no motion is taken for one."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import two_pass
from ftproc.core.model.frames import from_cartesian, wrap
from tests.core.tracks import SIGMA, matched
from tests.simulated import simulate
from tests.trust import hard

pytestmark = pytest.mark.compiled

UNKNOWN = two_pass.Known(np.full(3, np.nan), None, 4.0)
N, A, B = 1200, 500, 800
QUICK = ("ramp", 1), ("ramp", 2), ("walk-off", 2), ("bent", 0)


def edited(z, time_s):
    return two_pass.edit(time_s, z, UNKNOWN)


def flown(seed):
    return simulate("manoeuvre", seed=seed, duration_s=120.0, dt_s=0.1, outliers="none")


def shapes(m):
    u = np.arange(m) / (m - 1)
    return {"offset": np.ones(m), "ramp": u, "walk-off": np.clip(1.3 * u - 0.3, 0, 1) ** 2, "bent": 1 + 0.5 * u**2}


@pytest.mark.parametrize(
    ("shape", "c"),
    [
        pytest.param(shape, c, marks=[] if (shape, c) in QUICK else pytest.mark.slow)
        for shape in ("offset", "ramp", "walk-off", "bent")
        for c in range(3)
    ],
)
def test_a_patch_of_half_a_minute_is_found_whatever_its_shape(c, shape):
    """Where it comes slowly it may end as a step that stays: that is said, too."""
    seed = 11 + (c + list(shapes(2)).index(shape)) % 2
    flight = flown(10 * c + seed)
    z, sign = flight.log.measurement.copy(), (-1) ** seed
    z[A:B, c] += sign * 80 * flight.sigma[c] * shapes(B - A)[shape]
    z[:, 1] = wrap(z[:, 1])
    found = edited(z, flight.log.time_s)
    off = 80 * shapes(B - A)[shape] > 20
    rejected = (found.weight[A:B, c][off] == 0).mean() > 0.9
    assert rejected or [(s.component, s.sample) for s in found.faults.steps] == [(c, pytest.approx(B, abs=1))]
    assert rejected or shape in ("ramp", "walk-off")
    assert np.delete(found.weight, np.s_[A - 40 : B + 3], 0).mean() > (0.88 if shape == "walk-off" else 0.99)


@pytest.mark.parametrize("seed", range(3))
def test_readings_that_are_a_little_off_for_long(seed):
    """Six sigmas, for ten seconds at ten hertz."""
    a = matched(seed, 600, dt=0.1, q=0.02, distance=7000.0)
    z = a.z.copy()
    z[250:350, seed] += 6 * SIGMA[seed]
    found = edited(z, a.time)
    assert (found.weight[250:350, seed] == 0).mean() > 0.97
    assert found.weight.mean() > 1 - 1.05 * 100 / found.weight.size


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_another_target_for_half_a_minute_is_a_patch_of_all_components(seed):
    flight, draw = flown(40 + seed), np.random.default_rng(seed)
    z = flight.log.measurement.copy()
    z[A:B] += flight.sigma * draw.uniform(60, 200, 3) * draw.choice([-1, 1], 3) * np.linspace(1, 1.2, B - A)[:, None]
    z[:, 1] = wrap(z[:, 1])
    found = edited(z, flight.log.time_s)
    assert (found.weight[A:B] == 0).mean() > 0.99
    assert found.weight[:A].mean() > 0.99
    assert found.weight[B:].mean() > 0.99
    assert found.faults.steps == ()


@pytest.mark.parametrize("seed", [2, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (0, 1, 3))])
def test_two_patches_of_a_component_and_one_of_another(seed):
    a = matched(seed, 900, dt=0.1, q=0.5, distance=7000.0)
    z = a.z.copy()
    for c, begin, end, size in ((seed % 3, 150, 260, 25), (seed % 3, 600, 720, -40), ((seed + 1) % 3, 400, 480, 30)):
        z[begin:end, c] += size * SIGMA[c]
    weight = edited(z, a.time).weight
    for c, begin, end in ((seed % 3, 150, 260), (seed % 3, 600, 720), ((seed + 1) % 3, 400, 480)):
        assert (weight[begin:end, c] == 0).mean() > 0.98
    assert weight.mean() > 1 - 1.1 * (110 + 120 + 80) / weight.size


@pytest.mark.parametrize("seed", range(8))
def test_no_turn_of_a_fighter_is_a_patch(seed):
    flight = flown(60 + seed)
    found = edited(flight.log.measurement, flight.log.time_s)
    assert found.weight.mean() > 0.998
    assert found.faults.steps == ()


@pytest.mark.parametrize("fade_s", [0.3, 1.0])
@pytest.mark.parametrize("seed", range(3))
def test_no_parachute_is_a_patch(seed, fade_s):
    flight = flown(80 + seed)
    noise = wrap_azimuth(flight.log.measurement - from_cartesian(flight.truth.position_m))
    time_s, p = flight.log.time_s, flight.truth.position_m.copy()
    k, speed = 600, (flight.truth.position_m[601] - flight.truth.position_m[599]) / 0.2
    late = (time_s[k:] - time_s[k])[:, None]
    p[k:] = p[k] + speed * (0.15 * late + 0.85 * fade_s * (1 - np.exp(-late / fade_s)))
    found = edited(wrap_azimuth(from_cartesian(p) + noise), time_s)
    assert found.weight.mean() > 0.99
    assert found.faults.steps == ()


def wrap_azimuth(z):
    z = z.copy()
    z[:, 1] = wrap(z[:, 1])
    return z


def test_a_jump_is_seen_beside_which_readings_were_rejected():
    """A ramp of 92 sigmas, after which the filter rejects what is right until it has joined the track again."""
    ramp = hard.make("ramp", 2).simulated
    bad = ramp.truth.outlier[:, 2] > 0
    found = two_pass.edit(ramp.log.time_s, ramp.log.measurement, UNKNOWN)
    assert found.weight[bad, 2].mean() < 0.05
    assert found.weight[~bad, 2].mean() > 0.99


@pytest.mark.parametrize(
    ("name", "seed", "rows", "components"),
    [
        # what lies between a patch and a step is weighed with them
        pytest.param("sidelobe", 7, slice(1062, 1346), [2], marks=pytest.mark.slow),
        (
            "two",
            8,
            slice(1237, 1729),
            [0],
        ),  # a curve of many terms between two jumps, for which process noise has grown
        ("exchange", 6, slice(1799, 1999), [0, 1, 2]),  # another target at the end of the log
    ],
)
def test_patches_of_hard_flights_are_found(name, seed, rows, components):
    log = hard.make(name, seed).simulated.log
    assert edited(log.measurement, log.time_s).weight[rows, components].mean() < 0.05
