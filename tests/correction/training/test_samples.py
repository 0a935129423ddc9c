"""The split of flights, and the samples made of them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from ftproc.correction.training.samples import APART, BLOCK_S, Flight, Samples, overconfidence, split
from tests.correction import fake


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


def test_velocity_and_acceleration_of_the_truth_are_differenced_when_not_given() -> None:
    filtered = fake.run(np.random.default_rng(0), n=50)
    time = filtered.time_s.copy()
    time[10] = time[9]  # two measurements at one instant
    position = np.stack([time**2, 3 * time, np.zeros(50)], axis=1)
    error = Flight(filtered._replace(time_s=time), position).error + filtered.state
    assert error[5, 3:6] == pytest.approx([2 * time[5], 3.0, 0.0])
    assert error[30, 6:] == pytest.approx([2.0, 0.0, 0.0], abs=1e-9)
    assert np.isfinite(error).all()


def test_consistent_sigmas_are_not_widened() -> None:
    flights = fake.flights(12, 6)
    pieces = split(flights, np.random.default_rng(0)).training
    assert overconfidence(flights, pieces, 0.683) == pytest.approx(np.ones(6), abs=0.05)


def test_thinning_keeps_the_order() -> None:
    numbered = Samples(np.arange(400.0)[:, None], np.zeros((400, 2)))
    few = numbered.thinned(50, np.random.default_rng(0)).inputs[:, 0]
    assert len(few) == 50
    assert (np.diff(few) > 0).all()
    assert numbered.thinned(400, np.random.default_rng(0)) is numbered
