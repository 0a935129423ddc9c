"""Units that lines above a table state."""

import numpy as np
import pytest

from ftproc.files.reading import logs
from ftproc.files.reading.meaning.preamble import units_stated
from tests.files.conftest import Make


@pytest.mark.parametrize(
    ("above", "units"),
    [
        (["Range unit: ft", "Angle unit: deg"], ["", "ft", "deg", "deg"]),
        (["# Units: time=s, range=ft, azimuth=deg, elevation=gon"], ["s", "ft", "deg", "gon"]),
        (["Angle unit;gon", "Distance unit;m"], ["", "m", "gon", "gon"]),
        (["units: slant range in ft, azimuth and elevation in deg"], ["", "ft", "deg", "deg"]),
        (["Units  range ft  az deg  el deg"], ["", "ft", "deg", "deg"]),
        (["Unit of time: ms"], ["ms", "", "", ""]),
        (["Unit: Radar 7, range 40 km, rate unit: ft", "Range rate unit: ft"], []),
        (["# range in 0.1 m", "# az, el in units of 0.01 deg"], ["", "0.1 m", "0.01 deg", "0.01 deg"]),
        (["# Range unit: x10 m", "# time in 1/128 s"], ["1/128 s", "x10 m", "", ""]),
        (["Speed unit: m", "max range in km", "Range unit: furlong"], []),
    ],
)
def test_units_are_found_above_the_table(above: list[str], units: list[str]) -> None:
    assert units_stated(above, ["t", "R", "A", "E"]) == units


def test_the_name_of_a_column_has_the_last_word() -> None:
    assert units_stated(["Range unit: ft", "Angle unit: deg"], ["t", "range_m", "A", "El (gon)"]) == ["", "", "deg", ""]


def test_units_above_the_table_are_used(make: Make) -> None:
    rows = "".join(f"{k},{1000 + k},{60 + k},10\n" for k in range(5))
    log = logs.read(make(f"Range unit: ft\nAngle unit: deg\n\nt,R,A,E\n{rows}"))
    np.testing.assert_allclose(log.measurement[0], [304.8, np.pi / 3, np.pi / 18])
    assert "units stated above the table" in log.understood["file"]
