"""The verdict's sentences, and the arithmetic behind the gain."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from ftproc.correction.training.judging import judge
from ftproc.correction.training.samples import Piece, Split
from ftproc.correction.verdict import ComponentVerdict, Ratio, Verdict
from tests.correction import fake
from tests.correction.test_apply import constant

PLAIN = Verdict(
    "flight",
    12,
    8,
    4,
    (ComponentVerdict("radial", 0.8, 0.1, Ratio(0.7, 0.6, 0.8)),),
    None,
    Ratio(0.9, 0.85, 0.95),
    None,
)


def test_there_and_back_through_json() -> None:
    assert Verdict.from_dict(json.loads(json.dumps(PLAIN.to_dict()))) == PLAIN


def test_sentences_of_help() -> None:
    assert PLAIN.sentences() == [
        "Trained on 12, judged on 8 and tested on 4 held-out flights.",
        "  radial: gain 0.80; test error with over without 0.700 (0.600 to 0.800).",
        "Error in position on the test flights, with over without: 0.900 (0.850 to 0.950), it helps.",
    ]


@pytest.mark.parametrize(
    ("ratio", "remark"),
    [(Ratio(1.2, 1.1, 1.3), "HARMS"), (Ratio(0.99, 0.9, 1.1), "no difference proven")],
)
def test_sentences_of_harm_and_doubt(ratio: Ratio, remark: str) -> None:
    assert remark in replace(PLAIN, position=ratio).sentences()[-1]


def test_sentences_of_nothing() -> None:
    nothing = replace(PLAIN, components=(ComponentVerdict("radial", 0.0, 0.0, None),), by="block")
    assert nothing.sentences()[1:] == [
        "The correction brings nothing on held-out blocks of at least 30 s: its gain is zero."
    ]


def parts(count: int) -> Split:
    pieces = [Piece(i, 0, 600) for i in range(count)]
    return Split((), tuple(pieces[:-1]), (pieces[-1],), "flight")


@pytest.mark.parametrize(("says", "gain"), [(0.5, 1.0), (1.0, 1.0), (2.0, 0.5), (-1.0, 0.0)])
def test_the_gain_is_the_least_squares_one_within_0_and_1(says: float, gain: float) -> None:
    flights = fake.flights(0, 10, bias=(1.0,) * 6)
    judged = judge(constant("window", says), flights, parts(10), np.random.default_rng(0))
    assert judged.gain == pytest.approx(np.full(6, gain), abs=0.03)


def test_whole_flights_are_drawn_so_that_one_lucky_flight_is_no_proof() -> None:
    flights = fake.flights(1, 10)
    lucky = fake.flights(2, 1, bias=(4.0,) * 6)
    judged = judge(constant("window", 0.4), [*lucky, *flights[1:]], parts(10), np.random.default_rng(0))
    assert not judged.gain.any()


def test_a_gain_in_sigmas_that_costs_metres_is_refused() -> None:
    # Where sigma is small the answer is right, where it is large it is wrong: fine in sigmas, harm in metres.
    flights = []
    for number in range(10):
        filtered = fake.run(np.random.default_rng(number))
        sigma = filtered.los_sigma.copy()
        sigma[400:] *= 20.0
        bias = np.where(np.arange(600)[:, None] < 400, 1.0, -0.3)
        flights.append(fake.with_error(replace(filtered, los_sigma=sigma), np.tile(bias, (1, 6))))
    judged = judge(constant("window", 0.5), flights, parts(10), np.random.default_rng(0))
    assert not judged.gain.any()


def test_hardly_any_validation_data_is_no_proof() -> None:
    flights = fake.flights(4, 2, bias=(1.0,) * 6, n=120)
    split = Split((), (Piece(0, 0, 120),), (Piece(1, 0, 120),), "flight")
    assert not judge(constant("window", 1.0), flights, split, np.random.default_rng(0)).gain.any()


def test_without_test_samples_there_is_no_ratio() -> None:
    flights = fake.flights(5, 3, bias=(1.0,) * 6)
    split = Split((), (Piece(0, 0, 600), Piece(1, 0, 600)), (Piece(2, 0, 20),), "flight")
    verdict = judge(constant("window", 1.0), flights, split, np.random.default_rng(0)).verdict
    assert verdict is not None
    assert verdict.position is None
    assert all(c.test is None for c in verdict.components)
