"""A small limited-memory BFGS for the smooth likelihoods of this package: a dozen to a few thousand parameters,
bounds, and an expensive gradient that comes with the value and a rough curvature. (Loading a general optimiser would
cost more than its few dozen steps.) Nocedal and Wright 2006, algorithms 7.4 and 7.5, with projection onto the bounds;
what the steps so far do not tell of the Hessian is the curvature's, a tridiagonal matrix."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel
from ftproc.core.signatures import Vector

FloatArray = NDArray[np.float64]

MEMORY = 8
SUFFICIENT = 1e-4  # Armijo
FARTHEST = 2.0  # that a parameter moves at once: a factor e^2
FLATTEST = 0.01  # curvature: of what a function says less, it says nothing


class Point(NamedTuple):
    """A function where it was asked for: its value, its gradient (m,), and a rough Hessian: diagonal (m,), and what is
    beside it (m - 1,), None for zero."""

    value: float
    gradient: FloatArray
    curvature: FloatArray
    beside: FloatArray | None = None


def minimise(
    function: Callable[[FloatArray], Point],
    theta: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    steps: int,
    tolerance: float,
) -> FloatArray:
    """Minimiser of a smooth function between bounds, from `theta` (m,).

    Stops after `steps` steps, or when a step is expected to gain less than `tolerance`, or has: a function that is
    rough, as likelihoods of a track that is nearly lost are, promises more than it keeps.
    """
    here = function(theta)
    history: list[tuple[FloatArray, FloatArray, float]] = []
    for _ in range(steps):
        free = ~(((theta <= lower) & (here.gradient > 0)) | ((theta >= upper) & (here.gradient < 0)))
        gradient = np.where(free, here.gradient, 0.0)
        direction, slope = _downward(gradient, here, history)
        if slope >= 0 and history:  # of what was cut off, too much was the way down
            history.clear()
            direction, slope = _downward(gradient, here, history)
        if slope > -tolerance:
            break
        step = 1.0
        for _ in range(12):
            trial = np.clip(theta + step * direction, lower, upper)
            there = function(trial)
            if np.isfinite(there.value) and there.value <= here.value + SUFFICIENT * step * slope:
                break
            step *= 0.3
        else:
            break
        moved, turned = trial - theta, there.gradient - here.gradient
        bend = float(moved @ turned)
        if bend > 1e-12 * float(moved @ moved):
            history = [*history, (moved, turned, bend)][-MEMORY:]
        gained, theta, here = here.value - there.value, trial, there
        if gained < tolerance:
            break
    return theta


def _downward(
    gradient: FloatArray, here: Point, history: list[tuple[FloatArray, FloatArray, float]]
) -> tuple[FloatArray, float]:
    """The direction of a step, in which no parameter goes too far, and how fast the function falls along it. A zero in
    the gradient (m,) is of a parameter at its bound."""
    wanted = -_apply_inverse(gradient, here, history) * (gradient != 0)
    direction: FloatArray = np.clip(wanted, -FARTHEST, FARTHEST)
    return direction, float(direction @ gradient)


def _apply_inverse(
    gradient: FloatArray, here: Point, history: list[tuple[FloatArray, FloatArray, float]]
) -> FloatArray:
    """The two-loop recursion: approximate inverse Hessian times the gradient."""
    g = gradient.copy()
    weights = []
    for moved, turned, bend in reversed(history):
        a = float(moved @ g) / bend
        weights.append(a)
        g -= a * turned
    curvature = np.maximum(here.curvature, FLATTEST)
    g = g / curvature if here.beside is None else solve(curvature, here.beside, g)
    for (moved, turned, bend), a in zip(history, reversed(weights), strict=True):
        g += moved * (a - float(turned @ g) / bend)
    return g


@kernel
def solve(diagonal: Vector, beside: Vector, right: Vector) -> Vector:
    """(m,) solution of a symmetric tridiagonal system; diagonal (m,), beside it (m - 1,), right-hand side (m,)."""
    n = len(right)
    pivot, x = diagonal.copy(), right.copy()
    for k in range(1, n):
        share = beside[k - 1] / pivot[k - 1]
        pivot[k] -= share * beside[k - 1]
        x[k] -= share * x[k - 1]
    x[n - 1] /= pivot[n - 1]
    for k in range(n - 2, -1, -1):
        x[k] = (x[k] - beside[k] * x[k + 1]) / pivot[k]
    return x
