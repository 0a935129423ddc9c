"""The block bootstrap against what it stands for."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.correction.training.bootstrap import DRAWS, Blocks


def test_blocks_are_at_least_five_seconds_and_never_span_pieces() -> None:
    times = [np.arange(0, 60, 0.1), np.empty(0), np.arange(100, 131, 0.1)]
    blocks = Blocks.of(times)
    joined = np.concatenate(times)
    assert len(blocks) == 11 + 6
    for number in range(len(blocks)):
        inside = joined[blocks.block == number]
        assert 5.0 - 0.11 < inside[-1] - inside[0] < 6.0
        assert (inside[0] < 60) == (blocks.piece[number] == 0)


def test_eight_pieces_are_drawn_whole() -> None:
    assert len(Blocks.of([np.arange(100.0)] * 8)) == 8


def test_long_records_get_longer_blocks() -> None:
    assert len(Blocks.of([np.arange(0, 600.0)] * 2)) == 2 * 20


def test_sums_and_totals() -> None:
    rng = np.random.default_rng(0)
    blocks = Blocks.of([np.arange(40.0), np.arange(25.0)])
    values = rng.normal(size=(65, 2)) + 3.0
    sums = blocks.sums(values)
    assert sums[0] == pytest.approx(values[blocks.block == 0].sum(axis=0))
    assert sums.sum(axis=0) == pytest.approx(values.sum(axis=0))
    totals = blocks.totals(np.ones((11, 1)), rng)
    # Two pieces of 7 and 4 blocks are drawn twice: 14, 11 or 8 blocks.
    assert set(np.unique(totals)) == {8.0, 11.0, 14.0}
    assert np.mean(totals == 11.0) == pytest.approx(0.5, abs=4 * np.sqrt(0.25 / DRAWS))


def test_the_spread_of_whole_pieces_is_that_of_the_plain_bootstrap() -> None:
    rng = np.random.default_rng(1)
    sums = rng.normal(size=(50, 1))
    totals = Blocks.of([np.arange(10.0)] * 50).totals(sums, rng)
    assert totals.std() == pytest.approx(np.sqrt(50) * sums.std(), rel=0.1)
    assert totals.mean() == pytest.approx(sums.sum(), abs=4 * totals.std() / np.sqrt(DRAWS))


def test_two_flights_that_disagree_prove_nothing_however_long() -> None:
    blocks = Blocks.of([np.arange(0, 600.0), np.arange(0, 600.0)])
    sums = np.where(blocks.piece == 0, 10.0, -1.0)[:, None]
    assert np.quantile(blocks.totals(sums, np.random.default_rng(2)), 0.05) < 0.0 < sums.sum()
