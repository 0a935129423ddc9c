"""Training and its verdict: help where there is something to learn, and never harm where there is not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from ftproc.correction.apply import correct
from ftproc.correction.feature_sets import named
from ftproc.correction.features import SETTLING
from ftproc.correction.model import Model, Stage
from ftproc.correction.model_file import to_bytes
from ftproc.correction.training.prepared import prepare
from ftproc.correction.training.samples import Flight, samples, split
from ftproc.correction.training.train import train
from ftproc.errors import InputError, UsageError
from ftproc.settings import TrainSettings
from tests.correction import fake

QUICK = TrainSettings("window", hidden=6, population=8, generations=5, epochs=60)
BIAS = (0.0, 0.0, 1.5, 0.0, 0.0, 0.0)


def ratio(model: Stage, flights: Sequence[Flight], columns: slice = slice(0, 3)) -> float:
    """Error with the correction over error without, on new flights."""
    before = after = 0.0
    for flight in flights:
        error = flight.error[SETTLING:, columns]
        left = error - correct(flight.run, model).values[SETTLING:, columns]
        before, after = before + np.sum(error**2), after + np.sum(left**2)
    return float(np.sqrt(after / before))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("features", ["window", "correction"])
def test_independent_noise_gets_zero_gain_and_no_harm(features: str, seed: int) -> None:
    model = train(fake.flights(seed, 8), replace(QUICK, features=features, seed=seed))
    assert not model.gain.any()
    assert ratio(model, fake.flights(100 + seed, 3)) == 1.0
    assert model.verdict is not None
    assert not model.verdict.helps
    assert "No significant improvement on the held-out flights: the correction is zero." in model.verdict.sentences()


def test_a_bias_that_differs_from_flight_to_flight_is_not_significant() -> None:
    def made(seed: int, count: int) -> list[Flight]:
        biases = np.random.default_rng(seed).normal(size=(count, 6))
        return [fake.flights(seed + i, 1, bias=tuple(b), n=300)[0] for i, b in enumerate(biases)]

    model = train(made(1000, 24), QUICK)
    assert ratio(model, made(2000, 12)) <= 1.005


def test_a_repeatable_bias_is_learned_and_significant() -> None:
    model = train(fake.flights(1, 8, bias=BIAS), QUICK)
    assert model.gain[2] > 0.9
    assert not model.gain[[0, 1, 3, 4, 5]].any()
    assert ratio(model, fake.flights(101, 3, bias=BIAS)) < 0.9
    assert model.verdict is not None
    up = model.verdict.components[2]
    assert up.name == "up"
    assert up.proof > 0.2
    assert up.test is not None
    assert up.test.low <= up.test.value <= up.test.high
    assert up.test.value == pytest.approx(np.sqrt(1 / (1 + 1.5**2)), abs=0.06)
    assert any("better" in sentence for sentence in model.verdict.sentences())


def test_a_repeatable_bias_is_learned_in_the_papers_way_too() -> None:
    model = train(fake.flights(1, 8, bias=BIAS), replace(QUICK, features="correction"))
    assert model.gain[2] > 0.9  # z
    assert ratio(model, fake.flights(101, 3, bias=BIAS)) < 0.95


@pytest.mark.parametrize(("optimiser", "start"), [("l-bfgs", "random"), ("momentum", "genetic")])
def test_the_effect_of_an_earlier_innovation_is_learned(optimiser: str, start: str) -> None:
    model = train(fake.flights(2, 8, lag=2.0), replace(QUICK, optimiser=optimiser, start=start))
    assert model.gain[0] > 0.9
    assert ratio(model, fake.flights(102, 3, lag=2.0)) < 0.75


def test_a_correction_that_does_not_hold_on_other_flights_gets_zero_gain() -> None:
    # Half of the flights have the opposite bias; whatever is learned from some fails on the others.
    flights = fake.flights(3, 12, bias=BIAS)[:12:2] + fake.flights(4, 12, bias=[-b for b in BIAS])[1::2]
    assert not train(flights, QUICK).gain[2]


def test_the_bound_follows_an_overconfident_filter() -> None:
    bias = (0.0, 8.0, 0.0, 0.0, 0.0, 0.0)
    model = train(fake.flights(5, 8, bias=bias), QUICK)
    assert model.bound_sigma[1] == pytest.approx(2 * 8.5, abs=0.5)
    assert model.bound_sigma[0] == pytest.approx(2.0, abs=0.1)
    fresh = fake.flights(105, 3, bias=bias)
    narrow = replace(model, bound_sigma=np.full(6, 2.0))
    assert ratio(model, fresh) < 0.5 < ratio(narrow, fresh) < 1.0


def test_the_same_seed_gives_the_same_bytes_and_another_seed_others() -> None:
    flights = fake.flights(6, 8, bias=BIAS)
    first, second, other = (
        to_bytes(Model({"filter": train(flights, replace(QUICK, epochs=10, seed=s))})) for s in (7, 7, 8)
    )
    assert first == second
    assert first != other


def test_other_data_have_another_fingerprint() -> None:
    flights = fake.flights(6, 8)
    moved = replace(flights[3], truth_position=flights[3].truth_position + 1e-9)
    changed = [*flights[:3], moved, *flights[4:]]
    features = named("window")
    assert prepare(flights, features, 0).fingerprint != prepare(changed, features, 0).fingerprint


def test_one_long_flight_is_enough_to_learn_from() -> None:
    model = train(fake.flights(9, 1, bias=BIAS, n=6000), QUICK)
    assert model.gain[2] > 0.9
    assert model.verdict is not None
    assert model.verdict.by == "block"


def test_too_little_data_is_refused_with_a_plain_sentence() -> None:
    with pytest.raises(InputError, match=r"1 flight\(s\) give 2 block\(s\) of 30 s"):
        train(fake.flights(0, 1, n=610), QUICK)
    with pytest.raises(InputError, match="0 flight"):
        train([], QUICK)
    flights = fake.flights(0, 6)
    unknown = [replace(f, truth_position=np.full((600, 3), np.nan)) for f in flights]
    with pytest.raises(InputError, match="0 usable samples for training"):
        train(unknown, QUICK)


def test_truth_that_covers_only_a_part_is_used_where_it_is() -> None:
    flights = fake.flights(10, 8, bias=BIAS)
    for flight in flights:
        flight.truth_position[:200] = np.nan
    x, t = samples(flights, split(flights, np.random.default_rng(0)).training, named("window"))
    assert len(x) == len(t) == 4 * 400
    assert train(flights, QUICK).gain[2] > 0.9


def test_progress_by_stages_and_an_interrupt_ends_the_training() -> None:
    stages: list[str] = []

    def report(stage: str, done: int, total: int) -> None:
        assert 0 <= done <= total
        stages.append(stage)

    train(fake.flights(0, 6), QUICK, report)
    assert list(dict.fromkeys(stages)) == ["genetic search", "back-propagation", "validation"]

    def interrupt(stage: str, done: int, total: int) -> None:
        if stage == "back-propagation":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(fake.flights(0, 6), QUICK, interrupt)


def test_unknown_choices_are_named() -> None:
    with pytest.raises(UsageError, match="l-bfgs, momentum"):
        train([], replace(QUICK, optimiser="adam"))
    with pytest.raises(UsageError, match="genetic, genetic-solved, random, solved"):
        train([], replace(QUICK, start="zero"))
    with pytest.raises(UsageError, match="no feature set"):
        train([], replace(QUICK, features="all"))
