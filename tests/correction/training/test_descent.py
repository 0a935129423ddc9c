"""Back-propagation on functions that can and cannot be learned."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.correction import network
from ftproc.correction.network import Shape
from ftproc.correction.training.descent import OPTIMISERS, Problem, descend
from ftproc.correction.training.samples import Samples


def taught(n: int, seed: int, noise: float = 0.05) -> Samples:
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(n, 3))
    t = np.stack([np.sin(x[:, 0]) * x[:, 1], x[:, 2] - 0.5], axis=1)
    return Samples(x, t + noise * rng.normal(size=t.shape))


@pytest.mark.parametrize("optimiser", OPTIMISERS)
def test_back_propagation_learns_a_function(optimiser: str) -> None:
    shape = Shape(3, 10, 2)
    start = np.random.default_rng(0).uniform(-1, 1, shape.size) * network.scale(shape)
    training, validation = taught(1500, 1), taught(500, 2)
    fit = descend(optimiser, start, Problem(shape, training, validation), 300, np.random.default_rng(0))
    assert network.cost(start, shape, *validation) > 1.0
    assert fit.validation_cost < 0.1
    assert network.cost(fit.vector, shape, *validation) == fit.validation_cost


def test_training_stops_early_when_there_is_nothing_to_learn() -> None:
    shape = Shape(3, 10, 2)
    rng = np.random.default_rng(3)
    noise = [Samples(rng.normal(size=(60, 3)), rng.normal(size=(60, 2))) for _ in range(2)]
    start = 0.1 * rng.normal(size=shape.size)
    fit = descend("l-bfgs", start, Problem(shape, *noise), 1000, rng)
    assert fit.stopped_early
    assert fit.epochs < 200
    assert fit.validation_cost <= network.cost(start, shape, *noise[1])
