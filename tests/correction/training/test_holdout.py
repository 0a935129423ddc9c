"""The arithmetic and the bootstrap behind the gain."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.correction.training.holdout import with_verdict
from ftproc.correction.training.samples import Piece, Split
from tests.correction import fake
from tests.correction.test_apply import constant


def parts(count: int) -> Split:
    pieces = [Piece(i, 0, 600) for i in range(count)]
    return Split((), tuple(pieces[:-1]), (pieces[-1],), "flight")


@pytest.mark.parametrize(("output", "gain"), [(0.5, 1.0), (1.0, 1.0), (2.0, 0.5), (-1.0, 0.0)])
def test_the_gain_is_the_least_squares_one_within_0_and_1(output: float, gain: float) -> None:
    flights = fake.flights(0, 10, bias=(1.0,) * 6)
    judged = with_verdict(constant("window", output), flights, parts(10), np.random.default_rng(0))
    assert judged.gain == pytest.approx(np.full(6, gain), abs=0.03)


def test_whole_flights_are_drawn_so_that_one_lucky_flight_is_no_proof() -> None:
    flights = fake.flights(1, 10)
    lucky = fake.flights(2, 1, bias=(4.0,) * 6)
    judged = with_verdict(constant("window", 0.4), [*lucky, *flights[1:]], parts(10), np.random.default_rng(0))
    assert not judged.gain.any()


def test_a_gain_in_sigmas_that_costs_metres_is_refused() -> None:
    # Right where sigma is small, wrong where it is large: an improvement in sigmas, harm in metres.
    flights = []
    for number in range(10):
        filtered = fake.run(np.random.default_rng(number))
        sigma = filtered.los_sigma.copy()
        sigma[400:] *= 20.0
        bias = np.where(np.arange(600)[:, None] < 400, 1.0, -0.3)
        flights.append(fake.with_error(filtered._replace(los_sigma=sigma), np.tile(bias, (1, 6))))
    judged = with_verdict(constant("window", 0.5), flights, parts(10), np.random.default_rng(0))
    assert not judged.gain.any()


def test_too_few_blocks_prove_nothing() -> None:
    flights = fake.flights(4, 2, bias=(1.0,) * 6, n=120)
    split = Split((), (Piece(0, 0, 120),), (Piece(1, 0, 120),), "flight")
    assert not with_verdict(constant("window", 1.0), flights, split, np.random.default_rng(0)).gain.any()


def test_without_test_samples_there_is_no_ratio() -> None:
    flights = fake.flights(5, 3, bias=(1.0,) * 6)
    split = Split((), (Piece(0, 0, 600), Piece(1, 0, 600)), (Piece(2, 0, 20),), "flight")
    verdict = with_verdict(constant("window", 1.0), flights, split, np.random.default_rng(0)).verdict
    assert verdict is not None
    assert verdict.position is None
    assert all(c.test is None for c in verdict.components)
