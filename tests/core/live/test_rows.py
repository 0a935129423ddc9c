"""Rows that leave: sigmas that follow what the innovations of the last samples say."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.records import empty_rows
from ftproc.core.live.rows import LATELY, widened, without_what_is_lost


def rows_of(nis, used=3):
    rows = empty_rows(len(nis))
    rows["nis"], rows["sigma"], rows["los_sigma"] = nis, 1.0, 2.0
    rows["weight"] = 0.0
    rows["weight"][:, :used] = 1.0
    return rows


def test_sigmas_are_as_much_wider_as_the_last_innovations_are():
    rows = rows_of([3.0] * 20 + [12.0] * 20)
    found = widened(rows, 0)
    assert found["sigma"][:20] == pytest.approx(1.0)
    assert (np.diff(found["sigma"][19 : 20 + LATELY, 0]) > 0).all()
    assert found["sigma"][20 + LATELY :] == pytest.approx(2.0)
    assert found["los_sigma"][20 + LATELY :] == pytest.approx(4.0)


def test_sigmas_are_never_narrower():
    assert widened(rows_of([0.1] * 20), 0)["sigma"] == pytest.approx(1.0)


def test_each_innovation_counts_for_the_readings_that_it_is_of():
    assert widened(rows_of([2.0] * 20, used=2), 0)["sigma"] == pytest.approx(1.0)
    assert widened(rows_of([2.0] * 20, used=1), 0)["sigma"] == pytest.approx(np.sqrt(2.0))


def test_samples_without_readings_say_nothing():
    nis = np.full(20, 12.0)
    nis[3:9] = np.nan
    assert widened(rows_of(nis), 0)["sigma"] == pytest.approx(2.0)
    assert widened(rows_of([np.nan] * 20), 0)["sigma"] == pytest.approx(1.0)


def test_a_row_is_the_same_alone_as_among_others():
    rows = rows_of(np.random.default_rng(1).chisquare(4, 50))
    whole = widened(rows.copy(), 0)
    for k in range(LATELY, 50):
        (alone,) = widened(rows[k - LATELY + 1 : k + 1].copy(), LATELY - 1)
        assert alone["sigma"] == pytest.approx(whole[k]["sigma"])


def test_a_velocity_that_may_be_that_of_anything_is_no_estimate():
    rows = empty_rows(3)
    rows["sigma"] = 1.0
    rows["sigma"][1, 4] = 2e4
    np.testing.assert_array_equal(without_what_is_lost(rows), [True, False, True])
    assert np.isnan(rows["state"][1]).all()
    assert (rows["state"][[0, 2]] == 0).all()
