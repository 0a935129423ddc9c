"""The comparison of initial weights, and its table."""

from __future__ import annotations

import numpy as np

from ftproc.correction.training.study import CONTENDERS, Comparison, compare
from ftproc.settings import TrainSettings
from tests.correction import fake

QUICK = TrainSettings("window", hidden=3, population=6, generations=4, epochs=40)


def test_every_contender_learns_and_the_table_names_them() -> None:
    found = compare(fake.flights(2, 8, lag=2.0, n=250), QUICK, seeds=2)
    assert found.error.shape == (len(CONTENDERS), 2)
    assert (found.error < 0.98).all()
    assert np.array_equal(compare(fake.flights(2, 8, lag=2.0, n=250), QUICK, seeds=1).error, found.error[:, :1])
    lines = found.text().splitlines()
    assert [line.split("  ")[0] for line in lines[2:]] == list(CONTENDERS)


def test_the_conclusion_follows_the_interval() -> None:
    base = np.linspace(0.5, 0.6, 10)
    error = np.stack([base, base - 0.1, base + 0.1, base + 0.01 * (-1.0) ** np.arange(10), base, base])
    words = [row[3] for row in Comparison("window", 1e9, error).rows()]
    assert words[:4] == ["-", "better", "worse", "no difference"]
