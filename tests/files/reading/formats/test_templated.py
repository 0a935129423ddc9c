"""Lines of the same words with numbers between them."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused
from tests.files.reading.standards.test_layouts import DEG, A, E, R, T

SYSLOG = "Jun 14 12:34:{s:02d} radar1 trackd[311]: "
NAMED = (
    SYSLOG + "range {r} m az {a} deg el {e} deg",
    SYSLOG + "RNG {r} m AZ {a} deg EL {e} deg q 7",
    "TIME {t} s RNG {r} m AZ {a} deg EL {e} deg",
    "2023-06-14 12:34:{s:02d},000 INFO [main] Tracker - slant range {r} m, azimuth {a} deg, elevation {e} deg",
    "{t}: r={r} m, az={a} deg, el={e} deg",
)


def lines(pattern: str) -> list[str]:
    cells = zip(T, R, A * DEG, E * DEG, strict=True)
    return [
        pattern.format(t=f"{t:.1f}", s=int(t), r=f"{r:.3f}", a=f"{a:.5f}", e=f"{e:.5f}") + "\n" for t, r, a, e in cells
    ]


@pytest.mark.parametrize("pattern", NAMED)
def test_words_before_numbers_are_their_names_and_words_behind_them_units(make: Make, pattern: str) -> None:
    text = lines(pattern)
    text[7:7] = ["Jun 14 12:34:06 radar1 trackd[311]: locked on\n"]
    log = logs.read(make("".join(text), "log.txt"))
    np.testing.assert_allclose(log.time_s - log.time_s[0], T, atol=1e-6)
    np.testing.assert_allclose(log.measurement, np.column_stack([R, A, E]), atol=1e-3)


@pytest.mark.parametrize("before", ["2023-06-14T12:34:{s:02d}Z host app[1]: ", "2023-06-14 12:34:{s:02d} PLOT "])
def test_numbers_behind_words_without_names_are_asked_about(make: Make, before: str) -> None:
    said = refused(make("".join(lines(before + "{r},{a},{e}")), "log.txt"))
    assert "Its columns are: Timestamp, 2, 3, 4" in said


def test_a_table_with_words_in_its_cells_stays_one(make: Make) -> None:
    for pattern in ("radar 1;{t};{r};{a};{e}", "14 Jun 2023 12:34:{s:02d};{r};{a};{e}"):
        assert "there is no line of column names" in refused(make("".join(lines(pattern)), "log.txt"))
    refused(make("a 1 " * 100_000, "log.txt"))
    refused(make("ab 1\n" * 100_000, "log.txt"))
