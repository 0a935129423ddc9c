"""Comparison of the kinds of initial weights, at equal cost, from many seeds.

Cost is counted in multiplications, not seconds, so that the table is the same on any machine. A fit that stops early is
followed by another from other random numbers until the budget is spent; the validation flights choose the best attempt,
and its error is that on the untouched test flights.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ftproc.correction import network
from ftproc.correction.feature_sets import named
from ftproc.correction.training import Progress, descent, silent
from ftproc.correction.training.descent import Problem
from ftproc.correction.training.genetic import GeneticSettings
from ftproc.correction.training.initial_weights import SEARCH_SAMPLES, initial_weights
from ftproc.correction.training.parallel import each
from ftproc.correction.training.prepared import prepare
from ftproc.correction.training.samples import Flight, Samples
from ftproc.records import FloatArray
from ftproc.settings import TrainSettings

SEEDS = 10
SAMPLES = 3000  # of the training flights, and half as many for validation
DRAWS = 2000

CONTENDERS = {  # name -> initial weights, optimiser
    "random, L-BFGS": ("random", "l-bfgs"),
    "random with solved outputs, L-BFGS": ("solved", "l-bfgs"),
    "genetic, L-BFGS": ("genetic", "l-bfgs"),
    "genetic with solved outputs, L-BFGS": ("genetic-solved", "l-bfgs"),
    "random, momentum": ("random", "momentum"),
    "genetic, momentum (Zuo et al. 2021)": ("genetic", "momentum"),
}


@dataclass(frozen=True)
class Comparison:
    """features: the feature set. budget: multiplications of each contender per seed. error: (contenders, seeds)
    root-mean-square error on the test flights, over that without a network."""

    features: str
    budget: float
    error: FloatArray

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Name, median with its range, and the paired difference to the first contender with its 90 % interval."""
        rng = np.random.default_rng(0)
        drawn = rng.integers(0, self.error.shape[1], (DRAWS, self.error.shape[1]))
        rows = []
        for name, error in zip(CONTENDERS, self.error, strict=True):
            ahead = error - self.error[0]
            low, high = np.quantile(np.median(ahead[drawn], axis=1), [0.05, 0.95])
            word = "better" if high < 0 else "worse" if low > 0 else "no difference"
            paired = f"{np.median(ahead):+.4f} ({low:+.4f} to {high:+.4f})"
            spread = f"{np.median(error):.4f} ({error.min():.4f} to {error.max():.4f})"
            rows.append((name, spread, paired, word) if name != next(iter(CONTENDERS)) else (name, spread, "-", "-"))
        return rows

    def text(self) -> str:
        """The table for the terminal."""
        head = ("initial weights and descent", "error with / without", "minus random, paired", "")
        table = [head, *self.rows()]
        widths = [max(len(row[k]) for row in table) for k in range(4)]
        lines = ["  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in table]
        seeds = self.error.shape[1]
        return "\n".join(
            [
                f"Initial weights of the network '{self.features}' at equal cost ({self.budget:.2g} multiplications), "
                f"{seeds} seeds: median (range) on test flights; median difference (90 % interval).",
                *lines,
            ]
        )


def compare(
    flights: Sequence[Flight], settings: TrainSettings, progress: Progress = silent, jobs: int = 1, seeds: int = SEEDS
) -> Comparison:
    """Compare the contenders on the same flights. Raises as `train.train`."""
    features = named("window" if settings.features == "auto" else settings.features)
    data = prepare(flights, features, settings.seed)
    rng = np.random.default_rng(settings.seed)
    trial = _Trial(
        Problem(
            data.shape(settings.hidden), data.training.thinned(SAMPLES, rng), data.validation.thinned(SAMPLES // 2, rng)
        ),
        data.test if len(data.test.inputs) else data.validation,
        GeneticSettings(population=settings.population, generations=settings.generations),
        settings.epochs,
    )
    tasks = [(trial, *kinds, settings.seed + seed) for kinds in CONTENDERS.values() for seed in range(seeds)]
    found = each(_error, tasks, jobs, progress)
    return Comparison(features.name, trial.budget, np.array(found).reshape(len(CONTENDERS), seeds))


@dataclass(frozen=True)
class _Trial:
    """One network's fit and test, and its cost in multiplications. epochs: of back-propagation that the budget allows
    from random weights."""

    problem: Problem
    test: Samples
    search: GeneticSettings
    epochs: int

    @property
    def budget(self) -> float:
        """Of one contender and seed."""
        return self.epochs * self.epoch_cost

    @property
    def epoch_cost(self) -> float:
        """Of a gradient, three times the cost of an output, and the validation cost."""
        return (3.0 * len(self.problem.training.inputs) + len(self.problem.validation.inputs)) * self._output_cost

    def initial_cost(self, kind: str) -> float:
        """Of the initial weights."""
        n, searched = len(self.problem.training.inputs), self.search.population * (1.0 + self.search.generations / 2)
        few = min(SEARCH_SAMPLES, n)
        return {
            "random": 0.0,
            "solved": n * self._solution_cost,
            "genetic": searched * few * self._output_cost,
            "genetic-solved": searched * few * (self._solution_cost + self._output_cost) + n * self._solution_cost,
        }[kind]

    @property
    def _output_cost(self) -> float:
        """Of one output vector of the network."""
        d, h, o, _ = self.problem.shape
        return h * d + o * self.problem.shape.regressors

    @property
    def _solution_cost(self) -> float:
        """Of the least squares for the outer weights, per sample."""
        d, h, o, _ = self.problem.shape
        m = self.problem.shape.regressors + 1
        return h * d + m * (m + o)


def _error(trial: _Trial, kind: str, optimiser: str, seed: int, progress: Progress = silent) -> float:
    """Error on the test flights, over that without a network, of the best attempt within the budget."""
    rng = np.random.default_rng([seed, 7])
    problem, budget = trial.problem, trial.budget
    best, best_cost = np.zeros(problem.shape.size), np.inf
    while (epochs := int((budget - trial.initial_cost(kind)) // trial.epoch_cost)) > 0:
        initial = initial_weights(kind, problem.shape, problem.training, trial.search, rng)
        fit = descent.descend(optimiser, initial, problem, epochs, rng)
        budget -= trial.initial_cost(kind) + max(fit.epochs, 1) * trial.epoch_cost
        if fit.validation_cost < best_cost:
            best, best_cost = fit.vector, fit.validation_cost
    progress(f"{kind}, {optimiser}", seed % SEEDS + 1, SEEDS)
    without = float(np.vdot(trial.test.targets, trial.test.targets)) / len(trial.test.targets)
    return float(np.sqrt(network.cost(best, problem.shape, *trial.test) / without))
