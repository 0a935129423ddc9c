"""A small limited-memory BFGS for the smooth likelihoods of this package: a dozen to a few hundred parameters,
bounds, and an expensive gradient that comes with the value. (Loading a general optimiser would cost more than its
few dozen steps.) Nocedal and Wright 2006, algorithms 7.4 and 7.5, with projection onto the bounds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

MEMORY = 8
SUFFICIENT = 1e-4  # Armijo


def minimise(
    value_and_gradient: Callable[[FloatArray], tuple[float, FloatArray]],
    theta: FloatArray,
    curvature: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    steps: int,
    tolerance: float,
) -> FloatArray:
    """Minimiser of a smooth function between bounds, from `theta` (m,).

    curvature: (m,) rough diagonal of the Hessian, which sets the first steps. Stops after `steps` steps, or when a
    step is expected to gain less than `tolerance`.
    """
    value, gradient = value_and_gradient(theta)
    history: list[tuple[FloatArray, FloatArray, float]] = []
    for _ in range(steps):
        free = ~(((theta <= lower) & (gradient > 0)) | ((theta >= upper) & (gradient < 0)))
        direction = -_apply_inverse(np.where(free, gradient, 0.0), history, curvature) * free
        slope = float(direction @ gradient)
        if slope > -tolerance:
            break
        step = min(1.0, 2.0 / max(float(np.abs(direction).max()), 1e-300))  # at most a factor e^2 at once
        for _ in range(12):
            trial = np.clip(theta + step * direction, lower, upper)
            trial_value, trial_gradient = value_and_gradient(trial)
            if np.isfinite(trial_value) and trial_value <= value + SUFFICIENT * step * slope:
                break
            step *= 0.3
        else:
            break
        moved, turned = trial - theta, trial_gradient - gradient
        bend = float(moved @ turned)
        if bend > 1e-12 * float(moved @ moved):
            history = [*history, (moved, turned, bend)][-MEMORY:]
        theta, value, gradient = trial, trial_value, trial_gradient
    return theta


def _apply_inverse(
    gradient: FloatArray, history: list[tuple[FloatArray, FloatArray, float]], curvature: FloatArray
) -> FloatArray:
    """The two-loop recursion: approximate inverse Hessian times the gradient."""
    g = gradient.copy()
    weights = []
    for moved, turned, bend in reversed(history):
        a = float(moved @ g) / bend
        weights.append(a)
        g -= a * turned
    g /= curvature
    for (moved, turned, bend), a in zip(history, reversed(weights), strict=True):
        g += moved * (a - float(turned @ g) / bend)
    return g
