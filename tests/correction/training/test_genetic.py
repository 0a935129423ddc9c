"""The corrected roulette, and the search built on it."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.correction.training import genetic
from ftproc.correction.training.genetic import GeneticSettings, fitness, roulette, search
from ftproc.records import FloatArray


def sphere(genes: FloatArray) -> FloatArray:
    total: FloatArray = np.sum((genes - 0.7) ** 2, axis=1)
    return total


def test_the_best_of_five_is_selected_in_at_least_four_of_five_draws_of_two() -> None:
    rng = np.random.default_rng(0)
    cost = np.array([8.0, 1.0, 4.0, 16.0, 2.0])
    draws = np.array([roulette(fitness(cost), 2, rng) for _ in range(5000)])
    chosen = np.array([(draws == i).any(axis=1).mean() for i in range(5)])
    assert chosen[1] >= 0.80
    assert list(np.argsort(-chosen)) == [1, 4, 2, 0, 3]


def test_draws_follow_the_wheel_summed_again_after_each_removal() -> None:
    rng = np.random.default_rng(1)
    weight = np.array([1.0, 2.0, 3.0])
    draws = np.array([roulette(weight, 2, rng) for _ in range(20000)])
    for first in range(3):
        for second in {0, 1, 2} - {first}:
            expected = weight[first] / 6 * weight[second] / (6 - weight[first])
            seen = np.mean((draws[:, 0] == first) & (draws[:, 1] == second))
            assert seen == pytest.approx(expected, abs=4 * np.sqrt(expected / 20000))


def test_no_overrun_and_no_parent_twice_in_a_hundred_thousand_draws() -> None:
    rng = np.random.default_rng(2)
    for _ in range(10000):
        weight = 10.0 ** rng.uniform(-300, 300, 12)
        weight[rng.random(12) < 0.2] = 0.0
        assert len(set(roulette(weight, 10, rng).tolist())) == 10


class Highest:
    """A generator that always draws the largest number below 1."""

    def random(self) -> float:
        return float(np.nextafter(1.0, 0.0))


def test_the_largest_draw_stays_on_the_wheel() -> None:
    assert roulette(np.full(3, 5e-324), 3, Highest()).tolist() == [2, 1, 0]  # type: ignore[arg-type]
    weight = np.full(7, np.nextafter(0.1, 1.0))
    assert sorted(roulette(weight, 7, Highest())) == list(range(7))  # type: ignore[arg-type]


def test_individuals_of_zero_fitness_are_drawn_last() -> None:
    weight = fitness(np.array([np.nan, 1.0, np.inf, 2.0]))
    for seed in range(50):
        drawn = roulette(weight, 4, np.random.default_rng(seed)).tolist()
        assert set(drawn[:2]) == {1, 3}


def test_more_parents_than_individuals_is_an_error() -> None:
    with pytest.raises(ValueError, match="cannot draw 4 distinct parents from 3"):
        roulette(np.ones(3), 4, np.random.default_rng(0))


def test_a_perfect_individual_has_finite_fitness() -> None:
    assert np.isfinite(fitness(np.zeros(1))).all()


@pytest.mark.parametrize("population", [2, 3, 5, 40])
def test_the_best_never_gets_worse_and_genes_stay_within_the_limit(population: int) -> None:
    seen = []

    def watched(genes: FloatArray) -> FloatArray:
        seen.append(np.abs(genes).max())
        return sphere(genes)

    settings = GeneticSettings(population=population, generations=30, mutation=0.5, patience=30)
    found = search(watched, 6, settings, np.random.default_rng(3))
    assert all(later <= earlier for earlier, later in zip(found.history, found.history[1:], strict=False))
    assert max(seen) <= settings.gene_limit
    assert found.cost == found.history[-1] == sphere(found.best[None])[0]


def test_the_search_finds_a_minimum() -> None:
    settings = GeneticSettings(generations=200, patience=200)
    found = search(sphere, 8, settings, np.random.default_rng(4))
    assert found.cost < 0.05 * found.history[0]


def test_the_same_seed_finds_the_same_and_another_seed_another() -> None:
    settings = GeneticSettings(generations=10)
    one, two, other = (search(sphere, 5, settings, np.random.default_rng(s)) for s in (5, 5, 6))
    assert np.array_equal(one.best, two.best)
    assert not np.array_equal(one.best, other.best)


def test_the_search_gives_up_when_the_best_does_not_change() -> None:
    steps: list[int] = []
    settings = GeneticSettings(generations=60, patience=15)
    search(lambda g: np.ones(len(g)), 4, settings, np.random.default_rng(0), lambda done, _: steps.append(done))
    assert steps == list(range(1, 16))


def test_costs_that_are_not_finite_do_not_win() -> None:
    def broken(genes: FloatArray) -> FloatArray:
        return np.where(genes[:, 0] < 0, np.nan, 1.0 + genes[:, 0])

    found = search(broken, 3, GeneticSettings(generations=10), np.random.default_rng(0))
    assert np.isfinite(found.cost)


def test_mutation_shrinks_to_nothing() -> None:
    genes = np.random.default_rng(0).uniform(-1, 1, (50, 20))
    settings = GeneticSettings(mutation=1.0)
    moved = [np.abs(genetic._mutated(genes, s, settings, np.random.default_rng(1)) - genes).max() for s in (1, 0.1, 0)]
    assert moved[0] > 10 * moved[1] * 0.99 > moved[2] == 0.0
