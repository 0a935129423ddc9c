"""Names that are apart in another way than the rows, more or fewer of them than cells, and rows of fewer units."""

import itertools

import numpy as np
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused
from tests.files.zoo.flight import flight

FLIGHT = flight()
ROWS = [
    (f"{t:.1f}", f"{r:.3f}", f"{a:.5f}", f"{e:.5f}")
    for t, r, a, e in zip(FLIGHT.t, FLIGHT.r, np.degrees(FLIGHT.a), np.degrees(FLIGHT.e), strict=True)
]
NAMES = ["Time (s)", "Slant Range (m)", "Az (deg)", "El (deg)"]
PLAIN = ["Time", "Range", "Azimuth", "Elevation"]
APART = {"commas": ",", "semicolons": ";", "tabs": "\t", "bars": "|", "blanks": "  ", "a comma and a blank": ", "}


def is_read(path: object) -> None:
    log = logs.read(path)  # type: ignore[arg-type]
    np.testing.assert_allclose(log.time_s - log.time_s[0], FLIGHT.t, atol=1e-6)
    turned = (log.measurement - np.column_stack(FLIGHT[1:]) + np.pi) % (2 * np.pi) - np.pi
    assert np.nanmax(np.abs(turned)) < 1e-3
    assert not np.isnan(log.measurement).any()


@pytest.mark.parametrize(("above", "below"), list(itertools.permutations(APART, 2)))
def test_names_apart_in_another_way_than_rows(make: Make, above: str, below: str) -> None:
    text = "".join(APART[below].join(row) + "\n" for row in ROWS)
    is_read(make(APART[above].join(NAMES) + "\n" + text))


def test_one_blank_between_names_that_end_in_brackets(make: Make) -> None:
    is_read(make(" ".join(NAMES) + "\n" + "".join(" ".join(row) + "\n" for row in ROWS)))


@pytest.mark.parametrize("mark", [",", ";", "\t", "  "])
@pytest.mark.parametrize("units", [["s", "m", "deg"], ["m", "deg", "deg"], ["m", "deg"], ["[s]", "[m]", "[deg]"]])
def test_a_row_of_fewer_units_than_columns(make: Make, mark: str, units: list[str]) -> None:
    lines = [PLAIN, units, *ROWS]
    is_read(make("".join(mark.join(line) + "\n" for line in lines)))


def test_a_unit_of_fewer_counts_where_it_must_stand(make: Make) -> None:
    lines = [PLAIN, ["km", "deg", "deg"], *((t, f"{float(r) / 1e3:.6f}", a, e) for t, r, a, e in ROWS)]
    is_read(make("".join(",".join(line) + "\n" for line in lines)))


@pytest.mark.parametrize("mark", [",", ";", "\t"])
@pytest.mark.parametrize("cells", [("", "{}"), ("{}", ""), ("{}", "", ""), ("{row}", "{}")])
def test_cells_without_a_name(make: Make, mark: str, cells: tuple[str, ...]) -> None:
    """Empty ones at either end, and the numbers of rows."""
    row = mark.join(cells)
    lines = [mark.join(NAMES), *(row.format(mark.join(each), row=k + 1) for k, each in enumerate(ROWS))]
    is_read(make("\n".join(lines) + "\n"))


@pytest.mark.parametrize("mark", [",", ";", "\t", "  "])
def test_names_that_are_too_many_or_too_few_shift_no_column(make: Make, mark: str) -> None:
    whole = [(f"{k}", *row[1:]) for k, row in enumerate(ROWS)]  # times that might be numbers of rows
    for names in ([*NAMES, "SNR"], ["No", *NAMES], NAMES[:3], NAMES[1:], [*NAMES[:2], "Doppler", *NAMES[2:]]):
        said = refused(make("".join(mark.join(line) + "\n" for line in [names, *whole])))
        assert "has 4 cells where the header has" in said or "Say" in said or "Name" in said
