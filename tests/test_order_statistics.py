"""Order statistics against numpy's."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.order_statistics import distinct, median, medians, quantile, typical


@pytest.mark.parametrize("n", [1, 2, 3, 10, 4001])
def test_they_are_those_of_numpy(n):
    rng = np.random.default_rng(n)
    values = rng.normal(size=n).round(2)
    assert median(values) == pytest.approx(np.median(values), rel=1e-15)
    for share in (0.0, 0.01, 0.3, 0.5, 0.99, 1.0):
        assert quantile(values, share) == pytest.approx(np.quantile(values, share), rel=1e-12, abs=1e-15)
    np.testing.assert_array_equal(distinct(values), np.unique(values))
    table = rng.normal(size=(n, 4))
    np.testing.assert_allclose(medians(table), np.median(table, 0), rtol=1e-15)
    if n <= 10:
        assert typical(values) == median(values)


def test_a_nan_is_heard():
    values = np.array([1.0, np.nan, 2.0, 5.0])
    assert np.isnan(median(values))
    assert np.isnan(quantile(values, 0.1))
    np.testing.assert_array_equal(medians(np.stack([values, np.arange(4.0)], 1)), [np.nan, 1.5])


def test_nothing_has_no_median():
    assert np.isnan(median(np.zeros(0)))
    assert distinct(np.zeros(0)).size == 0
