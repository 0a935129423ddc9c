"""The minimiser on functions whose minimum is known."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.identification.optimizer import FARTHEST, Point, minimise
from ftproc.core.identification.optimizer import solve as tridiagonal

FREE = 1e9


def solve(function, theta, curvature=None, lower=-FREE, upper=FREE, steps=200, tolerance=1e-14, beside=None):
    theta = np.array(theta, float)
    bounds = np.broadcast_to(lower, theta.shape).astype(float), np.broadcast_to(upper, theta.shape).astype(float)
    curvature = np.ones_like(theta) if curvature is None else curvature
    return minimise(lambda x: Point(*function(x), curvature, beside), theta, *bounds, steps, tolerance)


def quadratic(scale, target):
    return lambda x: (float(0.5 * scale @ (x - target) ** 2), scale * (x - target))


def rosenbrock(x):
    value = np.sum(100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2)
    gradient = np.zeros_like(x)
    gradient[:-1] = -400 * x[:-1] * (x[1:] - x[:-1] ** 2) - 2 * (1 - x[:-1])
    gradient[1:] += 200 * (x[1:] - x[:-1] ** 2)
    return float(value), gradient


@pytest.mark.parametrize("n", [1, 2, 10, 100])
def test_quadratic(n):
    rng = np.random.default_rng(n)
    target, scale = rng.normal(0, 3, n), 10 ** rng.uniform(-1, 2, n)
    np.testing.assert_allclose(solve(quadratic(scale, target), np.zeros(n)), target, atol=1e-3)


def test_quadratic_with_its_own_curvature_takes_few_steps():
    target, scale = np.array([0.3, -1.0, 0.7]), np.array([1.0, 1e3, 1e6])
    np.testing.assert_allclose(
        solve(quadratic(scale, target), np.zeros(3), curvature=scale, steps=2), target, atol=1e-12
    )  # fmt: skip


def test_quadratic_whose_neighbours_are_coupled_takes_few_steps():
    rng = np.random.default_rng(1)
    beside = -rng.uniform(0.1, 1.0, 49)
    diagonal = rng.uniform(0.5, 2.0, 50) - np.append(beside, 0) - np.insert(beside, 0, 0)
    hessian, target = np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1), rng.normal(0, 0.3, 50)

    def cost(x):
        return float(0.5 * (x - target) @ hessian @ (x - target)), hessian @ (x - target)

    found = solve(cost, np.zeros(50), curvature=diagonal, beside=beside, steps=1)
    np.testing.assert_allclose(found, target, atol=1e-12)


@pytest.mark.parametrize("n", [1, 2, 3, 100])
def test_tridiagonal_system(n):
    rng = np.random.default_rng(n)
    diagonal, beside, right = rng.uniform(2.1, 4.0, n), rng.uniform(-1, 1, n - 1), rng.normal(0, 1, n)
    matrix = np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1)
    given = diagonal.copy(), beside.copy(), right.copy()
    np.testing.assert_allclose(tridiagonal(*given), np.linalg.solve(matrix, right), rtol=1e-10, atol=1e-14)
    for left, before in zip(given, (diagonal, beside, right), strict=True):
        np.testing.assert_array_equal(left, before)


def test_no_parameter_goes_too_far_at_once():
    tried = []

    def cost(x):
        tried.append(x.copy())
        return quadratic(np.ones(3), np.array([0.5, 100.0, -100.0]))(x)

    found = solve(cost, np.zeros(3), steps=1)
    np.testing.assert_allclose(found, [0.5, FARTHEST, -FARTHEST])
    assert len(tried) == 2


@pytest.mark.parametrize("begin", [(-1.2, 1.0), (0.0, 0.0), (2.0, -1.0)])
def test_rosenbrock(begin):
    np.testing.assert_allclose(solve(rosenbrock, begin), 1.0, atol=1e-5)


def test_rosenbrock_in_ten_dimensions():
    np.testing.assert_allclose(solve(rosenbrock, np.zeros(10), steps=500), 1.0, atol=1e-4)


def test_bounds_are_respected_and_reached():
    tried = []

    def cost(x):
        tried.append(x.copy())
        return quadratic(np.array([1.0, 2.0, 3.0]), np.array([5.0, -5.0, 0.5]))(x)

    found = solve(cost, np.zeros(3), lower=-1.7, upper=2.6)
    np.testing.assert_allclose(found, [2.6, -1.7, 0.5], atol=1e-9)
    assert np.min(tried) >= -1.7
    assert np.max(tried) <= 2.6


def test_fixed_parameter_stays():
    found = solve(rosenbrock, (0.5, 0.0), lower=np.array([0.5, -9]), upper=np.array([0.5, 9]))
    np.testing.assert_allclose(found, [0.5, 0.25], atol=1e-6)


def test_leaves_a_bound_it_begins_at():
    found = solve(quadratic(np.ones(2), np.array([0.5, 2.0])), np.array([0.0, 1.0]), lower=0.0, upper=1.0)
    np.testing.assert_allclose(found, [0.5, 1.0], atol=1e-9)


def test_never_ends_higher_than_it_began():
    def cliff(x):
        """Rises steeply beyond 1 and is not a number beyond 2."""
        value = float(np.exp(8 * x[0]) - 2 * x[0]) if x[0] < 2 else np.nan
        return value, np.array([8 * np.exp(8 * x[0]) - 2])

    found = solve(cliff, [-3.0])
    assert found[0] == pytest.approx(np.log(0.25) / 8, abs=1e-4)


def test_tolerance_and_steps_stop_it():
    calls = []

    def cost(x):
        calls.append(1)
        return rosenbrock(x)

    solve(cost, (-1.2, 1.0), steps=3)
    assert 4 <= len(calls) <= 40
    calls.clear()
    begin = np.array([1.001, 1.002])
    np.testing.assert_array_equal(solve(cost, begin, tolerance=1e3), begin)
    assert len(calls) == 1


def test_a_rough_function_ends_the_search():
    """It promises more than it keeps: a value that has hardly fallen, at a place where it should have, is the last."""
    asked = []

    def rough(theta):
        asked.append(theta.copy())
        value = float(np.abs(theta).sum()) + 30.0 * (len(asked) % 3 == 2)
        return Point(value, 500.0 * np.sign(theta), np.full(len(theta), 50.0))

    minimise(rough, np.full(3, 2.0), np.full(3, -5.0), np.full(3, 5.0), 100, 0.5)
    assert len(asked) < 40
