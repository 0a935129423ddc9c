"""Forces against their formulas and numerical derivatives; filters and smoother that know them, against the textbook.

Over an interval T, with K = half a kick of T / 2 at each end,

    x <- K_2 (Phi K_1 x)      P <- K_2 (Phi K_1 P K_1' Phi' + Q) K_2'      Q = c(T) (x) W
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ftproc.core.compiled import zeros
from ftproc.core.filtering import forward, smoother
from ftproc.core.filtering.filters import FILTER
from ftproc.core.filtering.records import Start
from ftproc.core.model import forces, gravity
from ftproc.core.model.motion import EARTH_M, Motion
from tests import naive
from tests.core.tracks import matched

UP = np.array([0.0, 0.0, 1.0])
TURNING = Motion(acts=True, turns=1.0)
PRESSED = Motion(acts=True, turns=1.0, pressed=1.0)
BLOWN = Motion(acts=True, turns=1.0, pressed=1.0, fades=0.3, wind=np.array([12.0, -7.0, 0.0]))
FADING = Motion(acts=True, turns=1.0, fades=0.8)
SPUN = Motion(acts=True, earth=np.array([[2e-5, 3e-5, 5e-5], [1e4, -2e4, -6.36e6]]))


def specific(x, by):
    """D of a state (9,), as the head of `forces` writes it."""
    p = x[:3] - by.earth[1]
    return x[6:] + mass(by) / np.linalg.norm(p) ** 3 * p + 2 * np.cross(by.earth[0], x[3:6])


def mass(by):
    """mu, or that of a round earth with the gravity of its surface."""
    return gravity.MASS_M3PS2 if by.earth[0].any() else forces.GRAVITY * EARTH_M**2


def flattening(p, w):
    """What J2 adds to the gravity at p (3,) from the centre of an earth that turns with w (3,)."""
    if not w.any():
        return np.zeros(3)
    r, n = np.linalg.norm(p), w / np.linalg.norm(w)
    u = n @ p
    size = -1.5 * gravity.FLATTENING * gravity.MASS_M3PS2 * gravity.EQUATOR_M**2 / r**5
    return size * ((1 - 5 * u**2 / r**2) * p + 2 * u * n)


def braked(x, by):
    """b of a state (9,), as the head of `forces` writes it."""
    d, u = specific(x, by), x[3:6] - by.wind
    return max(-d @ u / np.sqrt(d @ d * (u @ u + forces.AT_REST_MPS**2)), 0.0)


def scale_height(height):
    """H of the standard atmosphere: density as (1 - height / 44331 m)^4.256, higher up exp(-height / 6342 m)."""
    return max((44331.0 - height) / 4.25588, 6342.0)


def force(x, by, share=None):
    """a' of a state (9,), as the head of `forces` writes it. share: b, where it is held."""
    p, v, a = x[:3] - by.earth[1], x[3:6], x[6:]
    r, w = np.linalg.norm(p), by.earth[0]
    pull = mass(by) / r**3
    u = v - by.wind
    d, s2 = specific(x, by), u @ u + forces.AT_REST_MPS**2
    tide = -pull * (np.eye(3) - 3 * np.outer(p, p) / r**2) @ v - 2 * np.cross(w, a)
    beside = 1e3 * np.eye(3)
    tide += np.stack([flattening(p + d, w) - flattening(p - d, w) for d in beside]).T @ v / 2e3
    swells = 2 * u @ a / s2 - v @ p / r / scale_height(r - EARTH_M)
    share = braked(x, by) if share is None else share
    tide -= by.fades * forces.GRAVITY * (u @ a) / s2**1.5 * u
    return tide + by.turns * np.cross(np.cross(u, a) / s2, d) + by.pressed * share * swells * d


def kick(x, by, h, vague=0.0):
    """K and its constant part: the linear differential equation of the acceleration over h seconds, velocity held, to
    second order. vague: variance of the acceleration, by which the share of the force that is known turns and grows."""
    size = np.sum(specific(x, by) ** 2)
    by = by._replace(turns=by.turns * size / (size + vague), pressed=by.pressed * size / (size + vague))
    held, step = braked(x, by), 1e-4
    f0 = force(x, by, held)
    sides = [[force(x + side * step * e, by, held) for side in (1, -1)] for e in np.eye(9)[3:]]
    slope = np.array([(after - before) / (2 * step) for after, before in sides]).T
    a = np.zeros((10, 10))
    a[6:9, 3:9], a[6:9, 9] = slope, f0 - slope @ x[3:]
    return np.eye(10) + a * h + a @ a * (h * h / 2)


def density(x, jerk):
    """W between two states whose mean is x."""
    v = x[3:6]
    s2 = v @ v + forces.AT_REST_MPS**2
    t, u = v / np.sqrt(s2), UP - v[2] * v / s2
    return jerk[1] * np.eye(3) + (jerk[0] - jerk[1]) * np.outer(t, t) + (jerk[2] - jerk[1]) * np.outer(u, u)


def step_of(before, after, by, interval, jerk):
    """Transition (10, 10) with its constant part, and process noise (9, 9), over an interval between two states."""
    first, last = kick(before, by, interval / 2), kick(after, by, interval / 2)
    phi = np.eye(10)
    phi[:9, :9] = naive.transition(interval)
    c = naive.process_noise(interval, np.ones(3))[::3, ::3]
    q = last[:9, :9] @ np.kron(c, density((before + after) / 2, jerk)) @ last[:9, :9].T
    return last @ phi @ first, q


def state(seed, speed=150.0):
    rng = np.random.default_rng(seed)
    return np.r_[rng.normal(0, 4000, 3), speed * rng.normal(0, 0.6, 3), rng.normal(0, 15, 3)]


@pytest.mark.parametrize("by", [TURNING, PRESSED, BLOWN, FADING, SPUN])
@pytest.mark.parametrize("seed", range(3))
def test_prediction_about_the_estimate(by, seed):
    """Half a kick at the state, and half a kick at the state that is predicted."""
    rng, x, interval, jerk = np.random.default_rng(seed), state(seed), 0.1, np.array([0.5, 2.0, 7.0])
    root = rng.normal(size=(9, 9))
    f = zeros(FILTER)
    f["x"][0], f["p"][0], f["jerk"][0] = x, root @ root.T, jerk
    forces.travel(as_record(f), by, 0, 1, interval)
    p, phi = root @ root.T, naive.transition(interval)
    first = kick(x, by, interval / 2, np.trace(p[6:, 6:]))
    moved = phi @ (first @ np.r_[x, 1])[:9]
    q = np.kron(naive.process_noise(interval, np.ones(3))[::3, ::3], density(x, jerk))
    predicted = phi @ first[:9, :9] @ p @ first[:9, :9].T @ phi.T + q
    last = kick(moved, by, interval / 2, np.trace(predicted[6:, 6:]))
    np.testing.assert_allclose(f["x"][0], (last @ np.r_[moved, 1])[:9], rtol=1e-6, atol=1e-6)
    expected = last[:9, :9] @ predicted @ last[:9, :9].T
    np.testing.assert_allclose(f["p"][0], expected, rtol=2e-4, atol=2e-4)
    np.testing.assert_array_equal(f["p"][0], f["p"][0].T)


def as_record(filters):
    return filters.view(np.recarray)[0]


@pytest.mark.parametrize(("by", "seed"), [(TURNING, 1), (PRESSED, 2), (FADING, 4), (SPUN, 3)])
def test_the_splitting_is_of_second_order(by, seed):
    """Over a second in steps of 0.1 and 0.05 s, against the differential equation: a quarter of the error."""
    x, error = state(seed), []
    exact = solve_ivp(lambda _, y: np.r_[y[3:], force(y, by)], (0, 1), x, rtol=1e-11, atol=1e-9).y[:, -1]
    for steps in (10, 20):
        f = zeros(FILTER)
        f["x"][0], f["p"][0] = x, 1e-12 * np.eye(9)  # the acceleration is known
        for _ in range(steps):
            forces.travel(as_record(f), by, 0, 1, 1 / steps)
        error.append(np.linalg.norm(f["x"][0] - exact))
    assert error[1] < 0.3 * error[0]


def test_an_acceleration_along_the_path_fades_over_steps_of_any_length():
    """As in steps of 0.01 s, but that long ones leave a quarter of it."""
    for interval in (0.1, 1.0, 10.0, 100.0):
        found = []
        for steps in (1, int(100 * interval)):
            f = zeros(FILTER)
            f["x"][0] = 0, 0, 0, 20, 0, 0, 0.01, 0, 0
            f["p"][0] = 1e-12 * np.eye(9)
            for _ in range(steps):
                forces.travel(as_record(f), Motion(acts=True, fades=1.0), 0, 1, interval / steps)
            found.append(f["x"][0, 6])
        fades = forces.GRAVITY * interval / np.hypot(20.0, forces.AT_REST_MPS)
        assert 0 < found[0] < 0.01
        assert found[0] - found[1] < 0.01 * min(0.1 * fades**2 + 0.005, 0.25)


def forced(seed, n, by, **changes):
    """A matched problem whose motion is linearised about a course near its truth."""
    a = matched(seed, n, **changes)
    course = a.truth + np.random.default_rng(seed).normal(0, 0.5, a.truth.shape)
    jerk = a.model.jerk * np.array([0.3, 1.0, 2.5])
    return a._replace(model=a.model._replace(jerk=jerk, motion=by.about(course)))


def steps_of(a):
    """`naive.run` with forces, linearised about the course."""
    course, model = a.model.motion.course, a.model
    x, p, steps = a.starts[0].state, a.starts[0].covariance, []
    for k in range(len(a.time)):
        way, q = np.eye(10), np.zeros((9, 9))
        if k:
            piece = int(np.clip(a.time[k] / model.knot_s, 0, len(model.jerk) - 1))
            interval = a.time[k] - a.time[k - 1]
            way, q = step_of(course[k - 1], course[k], model.motion, interval, model.jerk[piece])
        x0, p0 = (way @ np.r_[x, 1])[:9], way[:9, :9] @ p @ way[:9, :9].T + q
        found = naive.unscented(x0, p0)
        x, p, nis, likelihood = naive.update(x0, p0, found, a.z[k], model.noise_variance, a.weight[k])
        h = np.linalg.solve(p0, found[2]).T
        steps.append(naive.Step(way[:9, :9], q, x0, p0, found[0], found[1], h, x, (p + p.T) / 2, nis, likelihood))
    return steps


@pytest.mark.parametrize("by", [TURNING, PRESSED, BLOWN, FADING, SPUN])
def test_the_smoother_is_that_of_rts(by):
    a = forced(4, 60, by, dt=0.2, q=5.0, irregular=True, missing=0.2, pieces=3)
    found, steps = smoother.smooth_log(a.log, a.model, a.starts), steps_of(a)
    x, p = naive.smooth(steps)
    sigma = np.sqrt(np.diagonal(p, axis1=1, axis2=2))
    np.testing.assert_allclose((found.state - x) / sigma, 0, atol=1e-4)
    np.testing.assert_allclose(found.sigma, sigma, rtol=1e-4)
    run = forward.filter_log(a.log, a.model, a.starts)
    np.testing.assert_allclose(run.state, [s.x for s in steps], rtol=1e-5, atol=1e-3)
    assert found.log_likelihood == pytest.approx(sum(s.likelihood for s in steps), rel=1e-5)


def test_a_vague_start_is_carried_back_over_both_kicks():
    """Of the velocity and the acceleration the filter knows next to nothing at first."""
    a = forced(5, 60, TURNING, dt=0.05, q=5.0)
    vague = np.diag(np.repeat([1.0, 300.0, 300.0], 3))
    a = a._replace(starts=[Start(0, a.starts[0].state, vague @ a.starts[0].covariance @ vague)])
    found, (x, p) = smoother.smooth_log(a.log, a.model, a.starts), naive.smooth(steps_of(a))
    sigma = np.sqrt(np.diagonal(p, axis1=1, axis2=2))
    np.testing.assert_allclose((found.state - x) / sigma, 0, atol=1e-3)
    np.testing.assert_allclose(found.sigma, sigma, rtol=1e-4)


def test_the_score_of_the_jerk_is_the_slope_of_the_likelihood():
    a = forced(6, 80, TURNING, dt=0.2, q=5.0, pieces=3, missing=0.1)
    score = smoother.score_log(a.log, a.model, a.starts).jerk.score
    for piece in range(3):
        for axis in range(3):
            sides = []
            for by in (-1e-3, 1e-3):
                jerk = a.model.jerk.copy()
                jerk[piece, axis] *= np.exp(by)
                sides.append(smoother.likelihood_of(a.log, a.model._replace(jerk=jerk), a.starts))
            assert score[piece, axis] == pytest.approx((sides[1] - sides[0]) / 2e-3, rel=1e-3, abs=1e-3)


def test_an_aircraft_that_hardly_moves_has_no_direction():
    """W is finite and the same along x and y."""
    f = zeros(FILTER)
    f["jerk"][0] = 1.0, 2.0, 3.0
    forces.orient(as_record(f), np.zeros(9), np.zeros(9))
    forces.spread(as_record(f))
    np.testing.assert_allclose(f["jerk"][0], [2.0, 2.0, 3.0])
    np.testing.assert_array_equal(f["cross"][0], 0.0)
