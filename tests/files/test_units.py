"""Units and their factors."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ftproc.files.units import UNITS, si_unit, unit_named
from ftproc.files.words import QUANTITIES

ONE_IN_SI = [
    ("time", "s", 1.0),
    ("time", "ms", 1e-3),
    ("time", "us", 1e-6),
    ("range", "m", 1.0),
    ("range", "km", 1000.0),
    ("range", "ft", 0.3048),
    ("range", "nmi", 1852.0),
    ("range", "nm", 1852.0),
    ("range", "cable", 185.2),
    ("range", "fathom", 1.8288),
    ("azimuth", "rad", 1.0),
    ("azimuth", "deg", math.pi / 180),
    ("azimuth", "mrad", 1e-3),
    ("azimuth", "mil", 2 * math.pi / 6400),
    ("azimuth", "grad", 2 * math.pi / 400),
    ("elevation", "deg", math.pi / 180),
    ("elevation", "mil", 2 * math.pi / 6400),
    ("elevation", "grad", 2 * math.pi / 400),
    ("elevation", "gon", 2 * math.pi / 400),
    ("azimuth", "mgon", 2 * math.pi / 400e3),
    ("azimuth", "arcsec", math.pi / 180 / 3600),
]


@pytest.mark.parametrize(("quantity", "unit", "one"), ONE_IN_SI)
def test_one_of_each_unit_in_si(quantity: str, unit: str, one: float) -> None:
    assert UNITS[quantity][unit].to_si(np.array([1.0]))[0] == pytest.approx(one, rel=1e-15)


def test_the_first_unit_of_each_quantity_is_the_si_unit() -> None:
    assert [si_unit(quantity).name for quantity in QUANTITIES] == ["s", "m", "rad", "rad"]


@given(st.integers(0, 2**50))
def test_whole_milliseconds_and_microseconds_are_rounded_once(ticks: int) -> None:
    assert UNITS["time"]["ms"].to_si(np.array([float(ticks)]))[0] == ticks / 1000
    assert UNITS["time"]["us"].to_si(np.array([float(ticks)]))[0] == ticks / 1000000


def test_a_turn_is_a_turn_in_every_unit() -> None:
    turns = {"deg": 360.0, "mil": 6400.0, "grad": 400.0, "gon": 400.0, "arcsec": 1_296_000.0, "mrad": 2000 * math.pi}
    for unit, turn in turns.items():
        assert UNITS["azimuth"][unit].to_si(np.array([turn]))[0] == pytest.approx(2 * math.pi, rel=1e-15)


@pytest.mark.parametrize(
    ("quantity", "word", "one"),
    [
        ("time", "1/128 s", 1 / 128),
        ("time", "100ns", 1e-7),
        ("range", "x1000 ft", 304.8),
        ("range", "*10 m", 10.0),
        ("range", "0.1 m", 0.1),
        ("azimuth", "10^-3 rad", 1e-3),
        ("azimuth", "1e-3 rad", 1e-3),
        ("azimuth", "360/65536 deg", 2 * math.pi / 65536),
        ("azimuth", "6400 mil", 2 * math.pi / 6400),
    ],
)
def test_a_factor_before_a_unit_counts(quantity: str, word: str, one: float) -> None:
    unit = unit_named(quantity, word)
    assert unit is not None
    assert unit.to_si(np.array([1.0]))[0] == pytest.approx(one, rel=1e-14)
    assert unit_named(quantity, unit.name) == unit


@pytest.mark.parametrize(
    ("quantity", "word", "one"),
    [
        ("time", "cs", 1e-2),
        ("time", "deciseconds", 0.1),
        ("range", "dam", 10.0),
        ("range", "hm", 100.0),
        ("range", "dm", 0.1),
        ("range", "Kilometre", 1000.0),
        ("range", "um", 1e-6),
        ("range", "us survey ft", 1200 / 3937),
        ("azimuth", "ddeg", math.pi / 1800),
        ("azimuth", "cgon", math.pi / 20_000),
        ("azimuth", "μrad", 1e-6),
        ("azimuth", "millirev", 2e-3 * math.pi),
        ("range_rate", "dm/s", 0.1),
    ],
)
def test_prefixes_of_tens_count(quantity: str, word: str, one: float) -> None:
    unit = unit_named(quantity, word)
    assert unit is not None
    assert unit.to_si(np.array([1.0]))[0] == pytest.approx(one, rel=1e-14)
    assert unit_named(quantity, unit.name) == unit


def test_prefixes_that_mean_several_things_are_no_units() -> None:
    for quantity, word in (("azimuth", "hdeg"), ("range", "DM"), ("range", "Dm"), ("range", "Mm"), ("time", "hs")):
        assert unit_named(quantity, word) is None


def test_what_is_no_plain_factor_is_no_unit() -> None:
    for word in ("0 m", "1/0 m", "x m", "1000's of ft", "5", "1e999 m", "Mm"):
        assert unit_named("range", word) is None
