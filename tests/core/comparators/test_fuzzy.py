"""The fuzzy weights of Shao et al. 2020 and the chi-square quantiles under them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ftproc.core.comparators import fuzzy

EDGES = [fuzzy.chi_square_quantile(p, 3) for p in fuzzy.EDGES]


def test_quantile_of_the_paper():
    """Its gate of 6.626 is that of 5 degrees of freedom; its readings have 6."""
    assert fuzzy.chi_square_quantile(0.75, 5) == pytest.approx(6.626, abs=5e-4)
    assert fuzzy.chi_square_quantile(0.75, 6) == pytest.approx(7.841, abs=5e-4)
    assert fuzzy.chi_square_quantile(0.75, 3) == pytest.approx(4.108, abs=5e-4)


@given(st.floats(0, 1e6), st.integers(1, 8))
def test_memberships_add_up_to_one(rho, freedom):
    found = fuzzy.memberships(rho, freedom)
    assert found.shape == (3,)
    assert found.sum() == pytest.approx(1.0, abs=1e-12)
    assert (found >= 0).all()


def test_memberships_at_their_corners():
    first, second, third = EDGES
    rho = [0.0, first, (first + second) / 2, second, (second + third) / 2, third, 1e9]
    expected = [[1, 0, 0], [1, 0, 0], [0.5, 0.5, 0], [0, 1, 0], [0, 0.5, 0.5], [0, 0, 1], [0, 0, 1]]
    np.testing.assert_allclose(fuzzy.memberships(rho, 3), expected, atol=1e-12)


def test_trust_in_a_reading_at_the_corners_of_the_rules():
    assert [fuzzy.trust_in_reading(rho, 3) for rho in (0.0, *EDGES, 1e6)] == pytest.approx([1, 1, 0.5, 0, 0])


@pytest.mark.parametrize(("row", "mean"), list(enumerate([0.0, EDGES[1], 1e6])))
def test_trust_in_members_at_the_corners_of_the_rules(row, mean):
    table = [[1, 1, 0.5], [0.5, 0.5, 0], [0, 0, 0]]
    found = fuzzy.trust_in_members(mean, np.array([0.0, EDGES[1], 1e6]), 3)
    np.testing.assert_allclose(found, table[row], atol=1e-12)


@given(st.floats(0, 60), st.floats(0, 60))
def test_trust_in_members_by_the_rules_one_by_one(mean, member):
    a, b = fuzzy.memberships(mean, 3), fuzzy.memberships(member, 3)
    top = bottom = 0.0
    for i in range(3):
        for j in range(3):
            applies = min(a[i], b[j])
            top += applies * [[1, 1, 0.5], [0.5, 0.5, 0], [0, 0, 0]][i][j]
            bottom += applies
    assert fuzzy.trust_in_members(mean, np.array([member]), 3)[0] == pytest.approx(top / bottom, abs=1e-12)


@given(st.lists(st.floats(0, 60), min_size=2, max_size=20))
def test_a_larger_innovation_never_weighs_more(rho):
    rho = sorted(rho)
    gamma = [fuzzy.trust_in_reading(r, 3) for r in rho]
    assert all(a >= b - 1e-12 for a, b in itertools.pairwise(gamma))
