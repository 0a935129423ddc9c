"""Training and its verdict: help where there is something to learn, and never harm where there is not."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from ftproc.correction.apply import correct
from ftproc.correction.feature_sets import named
from ftproc.correction.features import SETTLING
from ftproc.correction.model import Model, Stage
from ftproc.correction.model_file import to_bytes
from ftproc.correction.training.samples import APART, BLOCK_S, Flight, honesty, split, table
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


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("features", ["window", "correction"])
def test_independent_noise_gets_zero_gain_and_no_harm(features: str, seed: int) -> None:
    model = train(fake.flights(seed, 8), replace(QUICK, features=features, seed=seed))
    assert not model.gain.any()
    assert ratio(model, fake.flights(100 + seed, 3)) == 1.0
    assert model.verdict is not None
    assert not model.verdict.helps
    assert "The correction brings nothing on held-out flights: its gain is zero." in model.verdict.sentences()


def test_a_bias_that_differs_from_flight_to_flight_does_not_convince() -> None:
    def made(seed: int, count: int) -> list[Flight]:
        biases = np.random.default_rng(seed).normal(size=(count, 6))
        return [fake.flights(seed + i, 1, bias=tuple(b), n=300)[0] for i, b in enumerate(biases)]

    model = train(made(1000, 24), QUICK)
    assert ratio(model, made(2000, 12)) <= 1.005


def test_a_repeatable_bias_is_learned_proven_and_told() -> None:
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
    assert any("it helps" in sentence for sentence in model.verdict.sentences())


def test_a_repeatable_bias_is_learned_in_the_papers_way_too() -> None:
    model = train(fake.flights(1, 8, bias=BIAS), replace(QUICK, features="correction"))
    assert model.gain[2] > 0.9  # z
    assert ratio(model, fake.flights(101, 3, bias=BIAS)) < 0.95


@pytest.mark.parametrize(("optimiser", "start"), [("l-bfgs", "random"), ("momentum", "genetic")])
def test_what_an_earlier_innovation_tells_is_learned(optimiser: str, start: str) -> None:
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
    first, second, other = (to_bytes(Model({"filter": train(flights, replace(QUICK, seed=s))})) for s in (7, 7, 8))
    assert first == second
    assert first != other


def test_the_fingerprint_tells_other_data() -> None:
    flights = fake.flights(6, 8)
    moved = replace(flights[3], truth_position=flights[3].truth_position + 1e-9)
    changed = [*flights[:3], moved, *flights[4:]]
    assert train(flights, QUICK).fingerprint != train(changed, QUICK).fingerprint


def test_whole_flights_are_split_and_each_is_used_once() -> None:
    flights = fake.flights(7, 24, n=60)
    parts = split(flights, np.random.default_rng(0))
    assert parts.by == "flight"
    assert [len(p) for p in (parts.training, parts.validation, parts.test)] == [12, 8, 4]
    used = [piece.flight for piece in (*parts.training, *parts.validation, *parts.test)]
    assert sorted(used) == list(range(24))


def test_few_flights_are_cut_into_long_blocks_that_share_no_window() -> None:
    flights = fake.flights(8, 2, n=2000)
    parts = split(flights, np.random.default_rng(0))
    assert parts.by == "block"
    pieces = sorted((*parts.training, *parts.validation, *parts.test), key=lambda p: (p.flight, p.start))
    assert len(pieces) == 12
    for one, following in itertools.pairwise(pieces):
        if one.flight == following.flight:
            assert following.start - one.stop == APART
    for piece in pieces:
        time = flights[piece.flight].run.time_s
        assert time[piece.stop - 1] - time[piece.start] > BLOCK_S - 1.0


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
    x, t = table(flights, split(flights, np.random.default_rng(0)).training, named("window"))
    assert len(x) == len(t) == 4 * 400
    assert train(flights, QUICK).gain[2] > 0.9


def test_velocity_and_acceleration_of_the_truth_are_differenced_when_not_given() -> None:
    filtered = fake.run(np.random.default_rng(0), n=50)
    time = filtered.time_s.copy()
    time[10] = time[9]  # two measurements at one instant
    position = np.stack([time**2, 3 * time, np.zeros(50)], axis=1)
    error = Flight(replace(filtered, time_s=time), position).error + filtered.state
    assert error[5, 3:6] == pytest.approx([2 * time[5], 3.0, 0.0])
    assert error[30, 6:] == pytest.approx([2.0, 0.0, 0.0], abs=1e-9)
    assert np.isfinite(error).all()


def test_truth_of_another_length_is_an_error() -> None:
    with pytest.raises(ValueError, match="the run has 50 samples"):
        Flight(fake.run(np.random.default_rng(0), n=50), np.zeros((49, 3)))


def test_honest_sigmas_are_found_honest() -> None:
    flights = fake.flights(12, 6)
    pieces = split(flights, np.random.default_rng(0)).training
    assert honesty(flights, pieces) == pytest.approx(np.ones(6), abs=0.05)


def test_progress_is_told_stage_by_stage_and_an_interrupt_ends_the_training() -> None:
    stages: list[str] = []

    def tell(stage: str, done: int, total: int) -> None:
        assert 0 <= done <= total
        stages.append(stage)

    train(fake.flights(0, 6), QUICK, tell)
    assert list(dict.fromkeys(stages)) == ["genetic search", "back-propagation", "judging"]

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
