"""Initial weights of all kinds, and the linear network."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.correction import network
from ftproc.correction.network import Shape
from ftproc.correction.training.genetic import GeneticSettings
from ftproc.correction.training.initial_weights import KINDS, initial_weights, linear
from ftproc.correction.training.samples import Samples

SEARCH = GeneticSettings(population=12, generations=12)


def learnable(direct: bool) -> tuple[Shape, Samples]:
    rng = np.random.default_rng(0)
    x = rng.normal(size=(400, 3))
    return Shape(3, 5, 2, direct), Samples(x, np.stack([np.sin(2 * x[:, 0]), x[:, 1] - x[:, 2]], axis=1))


@pytest.mark.parametrize("direct", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_initial_weights_depend_on_the_seed_and_the_search_lowers_the_cost(kind: str, direct: bool) -> None:
    shape, samples = learnable(direct)
    one, again, other = (initial_weights(kind, shape, samples, SEARCH, np.random.default_rng(s)) for s in (1, 1, 2))
    assert one.shape == (shape.size,)
    assert np.array_equal(one, again)
    assert not np.array_equal(one, other)
    unsearched = {"genetic": "random", "genetic-solved": "solved"}.get(kind)
    if unsearched:
        drawn = [initial_weights(unsearched, shape, samples, SEARCH, np.random.default_rng(s)) for s in range(5)]
        costs = [network.cost(vector, shape, *samples) for vector in drawn]
        assert network.cost(one, shape, *samples) < np.mean(costs)


def test_linear_regression_is_exact_where_all_is_linear() -> None:
    shape, samples = learnable(True)
    output = network.forward(network.unpack(linear(shape, samples), shape), samples.inputs)
    assert output[:, 1] == pytest.approx(samples.targets[:, 1], abs=0.02)  # ridge
    assert not network.unpack(linear(shape, samples), shape).w2.any()
