"""Units behind names that the program does not know."""

import pytest

from ftproc.files.reading.meaning.schema import resolve
from tests.files.reading.test_schema import refused


@pytest.mark.parametrize(
    ("name", "quantity"),
    [("R_furlong", "range"), ("slant_varas", "range"), ("radar_range_rod", "range"), ("A_brads", "azimuth"),
     ("distance_league", "range"), ("t_jiffies", "time")],
)  # fmt: skip
def test_an_unknown_unit_behind_any_name_is_asked_about_until_a_unit_is_stated(name: str, quantity: str) -> None:
    names = [*{"time": "t", "range": "R_m", "azimuth": "az_deg"}.items()]
    names = [name if each == quantity else usual for each, usual in names]
    unit = name.rpartition("_")[2]
    for options in ({}, {quantity: name}):
        assert f'"{unit}" in column "{name}" is not a unit of {quantity}' in refused(names, columns=options)
    stated = {"time": "ms", "range": "ft", "azimuth": "mil"}[quantity]
    found = resolve("log.csv", names, {quantity: stated}, {quantity: name})
    assert found[quantity].unit.name == stated
