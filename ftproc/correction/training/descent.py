"""Back-propagation training from given first weights: momentum gradient descent (the paper's way) or
L-BFGS."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ftproc.correction.network import Shape, cost, cost_and_gradient
from ftproc.records import FloatArray

DECAY = 1e-3  # weight decay
PATIENCE = 25  # epochs without a better validation cost
LEARNING_RATE, MOMENTUM, BATCH = 0.01, 0.9, 128

EpochProgress = Callable[[int, int], None]


class Samples(NamedTuple):
    """Normalised inputs (n, d) and targets (n, o)."""

    inputs: FloatArray
    targets: FloatArray


class Fit(NamedTuple):
    """vector (size,) with the lowest validation cost, that cost, the epochs run, and whether it stopped
    early."""

    vector: FloatArray
    validation_cost: float
    epochs: int
    stopped_early: bool


class _Watch:
    """Remembers the weights that did best on validation data, and says when to stop."""

    def __init__(
        self,
        start: FloatArray,
        shape: Shape,
        validation: Samples,
        epochs: int,
        progress: EpochProgress | None,
    ):
        self.shape, self.validation, self.total, self.progress = shape, validation, epochs, progress
        self.best, self.best_cost = start.copy(), cost(start, shape, *validation)
        self.epochs, self.since_best = 0, 0

    def finished(self, vector: FloatArray) -> bool:
        self.epochs += 1
        now = cost(vector, self.shape, *self.validation)
        if now < self.best_cost:
            # Gains in the sixth digit are kept, but do not buy more time.
            self.since_best = 0 if now < self.best_cost * (1.0 - 1e-5) else self.since_best + 1
            self.best, self.best_cost = vector.copy(), now
        else:
            self.since_best += 1
        if self.progress is not None:
            self.progress(self.epochs, self.total)
        return self.since_best >= PATIENCE

    def result(self) -> Fit:
        return Fit(self.best, self.best_cost, self.epochs, self.since_best >= PATIENCE)


def lbfgs(
    start: FloatArray,
    shape: Shape,
    training: Samples,
    validation: Samples,
    epochs: int,
    progress: EpochProgress | None = None,
) -> Fit:
    """At most `epochs` iterations of L-BFGS with weight decay and early stopping on `validation`."""
    from scipy.optimize import minimize

    watch = _Watch(start, shape, validation, epochs, progress)

    def objective(vector: FloatArray) -> tuple[float, FloatArray]:
        return cost_and_gradient(vector, shape, *training, DECAY)

    def after_iteration(xk: FloatArray) -> None:
        if watch.finished(xk):
            raise StopIteration

    minimize(
        objective,
        start,
        jac=True,
        method="L-BFGS-B",
        callback=after_iteration,
        options={"maxiter": epochs, "maxfun": 3 * epochs, "maxcor": 20},
    )
    return watch.result()


def momentum(
    start: FloatArray,
    shape: Shape,
    training: Samples,
    validation: Samples,
    epochs: int,
    rng: np.random.Generator,
    progress: EpochProgress | None = None,
) -> Fit:
    """At most `epochs` passes of mini-batch gradient descent with momentum and early stopping."""
    watch = _Watch(start, shape, validation, epochs, progress)
    vector, velocity = start.copy(), np.zeros_like(start)
    n = len(training.inputs)
    for _ in range(epochs):
        order = rng.permutation(n)
        for first in range(0, n, BATCH):
            rows = order[first : first + BATCH]
            _, slope = cost_and_gradient(vector, shape, training.inputs[rows], training.targets[rows], DECAY)
            velocity = MOMENTUM * velocity - LEARNING_RATE * slope
            vector = vector + velocity
        if watch.finished(vector):
            break
    return watch.result()
