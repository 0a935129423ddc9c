"""Midnight is asked about; a glitch, and rows out of order, are not midnight."""

import numpy as np
import pytest

from ftproc.errors import InputError
from ftproc.files.reading.cells import Origin
from ftproc.files.reading.rollover import refuse

ORIGIN = Origin("a.csv", "T0", "a time in s")
DAY = np.arange(86_000.0, 86_900.0, 10.0) % 86_400


def test_the_row_and_the_cure_are_named() -> None:
    with pytest.raises(InputError) as caught:
        refuse(ORIGIN, np.insert(DAY, 3, np.nan))
    assert str(caught.value) == (
        'a.csv: row 41 (the first data row is 0), column "T0": the time falls from 86390 s to 0 s, which looks like '
        "midnight. If so, add 86400 s to the times from this row on, or give timestamps with their date; if the rows "
        "are only out of order, sort them by time."
    )


@pytest.mark.parametrize(
    "time",
    [
        np.sort(DAY),
        DAY[::-1],
        np.r_[DAY[:40], DAY[40:] + 86_400],
        np.r_[DAY[:20], 0.0, DAY[20:40]],
        np.r_[DAY[:39], 0.0, DAY[39]],
        np.r_[86_000.0, 40.0, 86_010.0, 86_020.0, 30.0, 86_030.0],
        np.r_[80_000.0:80_100.0:10, 0.0:100.0:10],
        np.random.default_rng(0).permutation(DAY),
        np.array([]),
        np.array([1.0, 0.0]),
    ],
    ids=[
        "sorted",
        "reversed",
        "added",
        "glitch",
        "late glitch",
        "glitches",
        "another flight",
        "shuffled",
        "none",
        "two",
    ],
)
def test_no_midnight(time: np.ndarray) -> None:
    refuse(ORIGIN, time)
