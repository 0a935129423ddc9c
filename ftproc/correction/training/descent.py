"""Back-propagation from initial weights, with early stopping: scipy's L-BFGS, or the paper's gradient descent with
momentum in mini-batches, which scipy lacks (with one BLAS thread: the same validation cost within 0.2 %, in 1.3 to 1.8
times the time)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ftproc.correction.network import Shape, cost, cost_and_gradient
from ftproc.correction.training import Steps, silent
from ftproc.correction.training.samples import Samples
from ftproc.records import FloatArray
from ftproc.settings import EPOCHS

OPTIMISERS = tuple(EPOCHS)
DECAY = 1e-3  # weight decay
PATIENCE = 25  # epochs without a better validation cost
LEARNING_RATE, MOMENTUM, BATCH = 0.01, 0.9, 128


class Problem(NamedTuple):
    """A network to be fitted to normalised training samples, and validation samples that stop the fit early. near:
    (size,) weights that it is held near, if there are such, and how strongly."""

    shape: Shape
    training: Samples
    validation: Samples
    near: FloatArray | None = None
    held: float = 0.0

    def cost_and_gradient(self, vector: FloatArray, samples: Samples) -> tuple[float, FloatArray]:
        """Of the weights, with their decay: towards zero, or towards those that they are held near."""
        if self.near is None:
            return cost_and_gradient(vector, self.shape, *samples, DECAY)
        value, slope = cost_and_gradient(vector, self.shape, *samples, 0.0)
        away = vector - self.near
        return value + self.held * float(away @ away), slope + 2.0 * self.held * away


class Fit(NamedTuple):
    """vector (size,) with the lowest validation cost, that cost, the epochs run, and whether they ended early."""

    vector: FloatArray
    validation_cost: float
    epochs: int
    stopped_early: bool


class _EarlyStopping:
    """Keeps the weights with the lowest validation cost, and says when to stop."""

    def __init__(self, initial: FloatArray, problem: Problem, epochs: int, progress: Steps) -> None:
        self.problem, self.limit, self.progress = problem, epochs, progress
        self.best, self.best_cost = initial.copy(), cost(initial, problem.shape, *problem.validation)
        self.epochs, self.since_best = 0, 0

    def finished(self, vector: FloatArray) -> bool:
        self.epochs += 1
        now = cost(vector, self.problem.shape, *self.problem.validation)
        # A gain in the sixth digit is kept, but does not reset the patience.
        self.since_best = 0 if now < self.best_cost * (1.0 - 1e-5) else self.since_best + 1
        if now < self.best_cost:
            self.best, self.best_cost = vector.copy(), now
        self.progress(self.epochs, self.limit)
        return self.since_best >= PATIENCE

    def fit(self) -> Fit:
        return Fit(self.best, self.best_cost, self.epochs, self.since_best >= PATIENCE)


def descend(
    optimiser: str,
    initial: FloatArray,
    problem: Problem,
    epochs: int,
    rng: np.random.Generator,
    progress: Steps = silent,
) -> Fit:
    """At most `epochs` of one of OPTIMISERS, with weight decay, from (size,) initial weights. rng: of the batches."""
    stopping = _EarlyStopping(initial, problem, epochs, progress)
    if optimiser == "momentum":
        _momentum(initial, problem, stopping, rng)
    else:
        _lbfgs(initial, problem, stopping)
    return stopping.fit()


def _lbfgs(initial: FloatArray, problem: Problem, stopping: _EarlyStopping) -> None:
    from scipy.optimize import minimize

    def objective(vector: FloatArray) -> tuple[float, FloatArray]:
        return problem.cost_and_gradient(vector, problem.training)

    def after_iteration(xk: FloatArray) -> None:
        if stopping.finished(xk):
            raise StopIteration

    minimize(
        objective,
        initial,
        jac=True,
        method="L-BFGS-B",
        callback=after_iteration,
        options={"maxiter": stopping.limit, "maxfun": 3 * stopping.limit, "maxcor": 20},
    )


def _momentum(initial: FloatArray, problem: Problem, stopping: _EarlyStopping, rng: np.random.Generator) -> None:
    vector, velocity = initial.copy(), np.zeros_like(initial)
    inputs, targets = problem.training
    for _ in range(stopping.limit):
        order = rng.permutation(len(inputs))
        for first in range(0, len(inputs), BATCH):
            rows = order[first : first + BATCH]
            _, slope = problem.cost_and_gradient(vector, Samples(inputs[rows], targets[rows]))
            velocity = MOMENTUM * velocity - LEARNING_RATE * slope
            vector = vector + velocity
        if stopping.finished(vector):
            break
