"""The text that names the errors of an instrument."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from ftproc.errors import UsageError
from ftproc.simulation import INSTRUMENT_GRAMMAR, InstrumentErrors, parse_instrument, simulate
from ftproc.simulation.instrument_spec import LARGEST


def test_every_error_has_a_name_and_stands_in_the_grammar() -> None:
    assert list(LARGEST) == [field.name for field in fields(InstrumentErrors)]
    for name in LARGEST:
        assert name.removesuffix("_rad") in INSTRUMENT_GRAMMAR
        assert parse_instrument(f"{name}={LARGEST[name] / 2}") == InstrumentErrors(**{name: LARGEST[name] / 2})


@pytest.mark.parametrize(
    ("text", "name", "value"),
    [
        ("mislevel_mrad=0.6", "mislevel_rad", 6e-4),
        (" mislevel_azimuth_deg = -90 ", "mislevel_azimuth_rad", -np.pi / 2),
        ("collimation_arcsec=3600", "collimation_rad", np.pi / 180),
        ("elevation_zero_urad=-200", "elevation_zero_rad", -2e-4),
        ("range_zero_m=-1e3", "range_zero_m", -1000.0),
        ("refraction=2.8e-4", "refraction", 2.8e-4),
    ],
)
def test_units_are_those_of_the_name(text: str, name: str, value: float) -> None:
    assert getattr(parse_instrument(text), name) == pytest.approx(value, rel=1e-15)
    assert getattr(parse_instrument("azimuth_zero_mrad=1," + text), name) == pytest.approx(value, rel=1e-15)


def test_none_is_a_perfect_instrument() -> None:
    assert parse_instrument("none") == InstrumentErrors()
    flight = simulate("zuo2021", seed=1, noise=(0, 0, 0), instrument=parse_instrument("range_zero_m=7"))
    off = flight.log.measurement[:, 0] - np.linalg.norm(flight.truth.position_m, axis=1)
    np.testing.assert_allclose(off, 7.0, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("mislevl_mrad=1", 'there is no error "mislevl_mrad"; did you mean "mislevel_mrad"? There are range_zero_m,'),
        ("mislevel=1", 'there is no error "mislevel"'),
        ("mislevel_m=1", 'there is no error "mislevel_m"'),
        ("refraction_mrad=1", 'there is no error "refraction_mrad"'),
        ("", 'there is no error ""'),
        ("refraction=1e-4,", 'there is no error ""'),
        ("refraction=1e-4,none", 'there is no error "none"'),
        ("mislevel_mrad", 'mislevel_mrad = "": expected a number from -100 to 100.'),
        ("mislevel_mrad=nan", 'mislevel_mrad = "nan": expected a number from -100 to 100.'),
        ("mislevel_mrad=101", 'mislevel_mrad = "101": expected a number from -100 to 100.'),
        ("range_zero_m=-inf", 'range_zero_m = "-inf": expected a number from -100000 to 100000.'),
        ("mislevel_mrad=1,mislevel_deg=1", "mislevel is given twice; leave one out."),
    ],
)
def test_what_is_not_understood_is_a_sentence(text: str, sentence: str) -> None:
    with pytest.raises(UsageError) as raised:
        parse_instrument(text)
    assert str(raised.value).startswith("--instrument-errors: ")
    assert sentence in str(raised.value)
