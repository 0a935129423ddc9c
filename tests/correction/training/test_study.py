"""The study of first weights: equal cost, counted by hand, and a table that says what it says."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.correction import network
from ftproc.correction.network import Shape
from ftproc.correction.training import starts
from ftproc.correction.training.descent import Samples
from ftproc.correction.training.genetic import GeneticSettings
from ftproc.correction.training.starts import STARTS, first_weights, linear
from ftproc.correction.training.study import CONTENDERS, Comparison, compare
from ftproc.settings import TrainSettings
from tests.correction import fake

QUICK = TrainSettings("window", hidden=3, population=6, generations=4, epochs=60)
SEARCH = GeneticSettings(population=12, generations=12)


def learnable(direct: bool) -> tuple[Shape, Samples]:
    rng = np.random.default_rng(0)
    x = rng.normal(size=(400, 3))
    return Shape(3, 5, 2, direct), Samples(x, np.stack([np.sin(2 * x[:, 0]), x[:, 1] - x[:, 2]], axis=1))


@pytest.mark.parametrize("direct", [False, True])
@pytest.mark.parametrize("start", STARTS)
def test_first_weights_are_those_of_the_seed_and_the_search_pays_for_itself(start: str, direct: bool) -> None:
    shape, samples = learnable(direct)
    one, again, other = (first_weights(start, shape, samples, SEARCH, np.random.default_rng(s)) for s in (1, 1, 2))
    assert one.shape == (shape.size,)
    assert np.array_equal(one, again)
    assert not np.array_equal(one, other)
    unsearched = {"genetic": "random", "genetic-solved": "solved"}.get(start)
    if unsearched:
        drawn = [first_weights(unsearched, shape, samples, SEARCH, np.random.default_rng(s)) for s in range(5)]
        costs = [network.cost(vector, shape, *samples) for vector in drawn]
        assert network.cost(one, shape, *samples) < np.mean(costs)


def test_linear_regression_is_exact_where_all_is_linear() -> None:
    shape, samples = learnable(True)
    answer = network.forward(network.unpack(linear(shape, samples), shape), samples.inputs)
    assert answer[:, 1] == pytest.approx(samples.targets[:, 1], abs=0.02)  # ridge
    assert not network.unpack(linear(shape, samples), shape).w2.any()


def test_thinning_keeps_the_order() -> None:
    _, samples = learnable(False)
    numbered = Samples(np.arange(400.0)[:, None], samples.targets)
    few = starts.thinned(numbered, 50, np.random.default_rng(0)).inputs[:, 0]
    assert len(few) == 50
    assert (np.diff(few) > 0).all()
    assert starts.thinned(numbered, 400, np.random.default_rng(0)) is numbered


def test_every_contender_learns_and_the_table_names_them() -> None:
    found = compare(fake.flights(2, 8, lag=2.0), QUICK, seeds=3)
    assert found.error.shape == (len(CONTENDERS), 3)
    assert (found.error < 0.98).all()
    assert np.array_equal(compare(fake.flights(2, 8, lag=2.0), QUICK, seeds=3).error, found.error)
    lines = found.text().splitlines()
    assert [line.split("  ")[0] for line in lines[2:]] == list(CONTENDERS)


def test_the_words_follow_the_interval() -> None:
    base = np.linspace(0.5, 0.6, 10)
    error = np.stack([base, base - 0.1, base + 0.1, base + 0.01 * (-1.0) ** np.arange(10), base, base])
    words = [row[3] for row in Comparison("window", 1e9, error).rows()]
    assert words[:4] == ["-", "better", "worse", "no difference"]
