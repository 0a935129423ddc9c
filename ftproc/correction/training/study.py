"""Does the genetic start help? First weights of several kinds, at equal cost, from many seeds.

Cost is counted in multiplications, not seconds, so that the table is the same wherever it is made. Who stops early
begins again with other random numbers until the budget is spent; the validation flights choose the best attempt, and
the untouched test flights tell what it is worth.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ftproc.correction import network
from ftproc.correction.feature_sets import named
from ftproc.correction.network import Shape
from ftproc.correction.training import descent, starts
from ftproc.correction.training.genetic import GeneticSettings
from ftproc.correction.training.parallel import each
from ftproc.correction.training.samples import Flight
from ftproc.correction.training.train import prepare
from ftproc.records import FloatArray
from ftproc.settings import TrainSettings

Progress = Callable[[str, int, int], None]

SEEDS = 10
SAMPLES = 3000  # of the training flights, and half as many for validation
DRAWS = 2000

CONTENDERS = {
    "random, L-BFGS": ("random", "l-bfgs"),
    "random with solved outputs, L-BFGS": ("solved", "l-bfgs"),
    "genetic, L-BFGS": ("genetic", "l-bfgs"),
    "genetic with solved outputs, L-BFGS": ("genetic-solved", "l-bfgs"),
    "random, momentum": ("random", "momentum"),
    "genetic, momentum (Zuo et al. 2021)": ("genetic", "momentum"),
}


@dataclass(frozen=True)
class Comparison:
    """error: (contenders, seeds) root mean square of what is left on the test flights, over that without a network.
    budget: multiplications each contender might spend per seed. features: the feature set."""

    features: str
    budget: float
    error: FloatArray

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Name, median with its range, and the paired difference to random starts with its 90 % interval."""
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
        head = ("start and descent", "error with / without", "minus random, paired", "")
        table = [head, *self.rows()]
        widths = [max(len(row[k]) for row in table) for k in range(4)]
        lines = ["  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in table]
        seeds = self.error.shape[1]
        return "\n".join(
            [
                f"First weights of the network '{self.features}' at equal cost ({self.budget:.2g} multiplications), "
                f"{seeds} seeds: median (range) on test flights; median difference (90 % interval).",
                *lines,
            ]
        )


def compare(
    flights: Sequence[Flight],
    settings: TrainSettings,
    progress: Progress | None = None,
    jobs: int = 1,
    seeds: int = SEEDS,
) -> Comparison:
    """Hold the contenders against each other on the same flights. Raises as `training.train`."""
    features = named("window" if settings.features == "auto" else settings.features)
    data = prepare(flights, features, settings.seed)
    rng = np.random.default_rng(settings.seed)
    small = _Problem(
        data.shape(settings.hidden),
        starts.thinned(data.training, SAMPLES, rng),
        starts.thinned(data.validation, SAMPLES // 2, rng),
        data.test if len(data.test.inputs) else data.validation,
        GeneticSettings(population=settings.population, generations=settings.generations),
        settings.epochs,
    )
    tasks = [(small, *kinds, settings.seed + seed) for kinds in CONTENDERS.values() for seed in range(seeds)]
    found = each(_attempts, tasks, jobs, progress)
    return Comparison(features.name, small.budget, np.array(found).reshape(len(CONTENDERS), seeds))


@dataclass(frozen=True)
class _Problem:
    shape: Shape
    training: descent.Samples
    validation: descent.Samples
    test: descent.Samples
    search: GeneticSettings
    epochs: int

    @property
    def epoch(self) -> float:
        """Multiplications of one gradient, which takes three times an answer, and of one look at validation."""
        return (3.0 * len(self.training.inputs) + len(self.validation.inputs)) * self.answer

    @property
    def answer(self) -> float:
        """Multiplications of one answer of the network."""
        d, h, o, _ = self.shape
        return h * d + o * self.shape.regressors

    @property
    def equations(self) -> float:
        """Multiplications per sample of the least squares for the outer weights."""
        m = self.shape.regressors + 1
        return self.shape.hidden * self.shape.inputs + m * (m + self.shape.outputs)

    @property
    def budget(self) -> float:
        return self.epochs * self.epoch

    def start_cost(self, start: str) -> float:
        n, looked_at = len(self.training.inputs), self.search.population * (1.0 + self.search.generations / 2)
        few = min(starts.SEARCH_SAMPLES, n)
        return {
            "random": 0.0,
            "solved": n * self.equations,
            "genetic": looked_at * few * self.answer,
            "genetic-solved": looked_at * few * (self.equations + self.answer) + n * self.equations,
        }[start]


def _attempts(problem: _Problem, start: str, optimiser: str, seed: int, progress: Progress | None = None) -> float:
    """Error on the test flights, over that without a network, of the best attempt within the budget."""
    rng = np.random.default_rng([seed, 7])
    shape, left = problem.shape, problem.budget
    best, best_cost = np.zeros(shape.size), np.inf
    while (epochs := int((left - problem.start_cost(start)) // problem.epoch)) > 0:
        vector = starts.first_weights(start, shape, problem.training, problem.search, rng)
        given = (vector, shape, problem.training, problem.validation, epochs)
        fit = descent.momentum(*given, rng) if optimiser == "momentum" else descent.lbfgs(*given)
        left -= problem.start_cost(start) + max(fit.epochs, 1) * problem.epoch
        if fit.validation_cost < best_cost:
            best, best_cost = fit.vector, fit.validation_cost
    if progress is not None:
        progress(f"{start}, {optimiser}", seed % SEEDS + 1, SEEDS)
    without = float(np.vdot(problem.test.targets, problem.test.targets)) / len(problem.test.targets)
    return float(np.sqrt(network.cost(best, shape, *problem.test) / without))
