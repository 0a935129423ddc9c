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


def test_what_has_no_sign_has_none() -> None:
    for name in ("range_wander_m", "stamp_jitter_s", "azimuth_rounding_mrad"):
        with pytest.raises(UsageError, match="expected a number from 0 to"):
            parse_instrument(f"{name}=-1")
    with pytest.raises(UsageError, match="expected a number from 1 to"):
        parse_instrument("range_walk_at_m=0")
    for value in ("0", "2.5", "1001"):
        with pytest.raises(UsageError, match="expected a whole number from 1 to 1000"):
            parse_instrument(f"range_held={value}")


def test_each_effect_is_in_the_readings_and_the_truth_stays() -> None:
    def measured(text: str, scenario: str = "manoeuvre-clean") -> tuple[np.ndarray, np.ndarray]:
        flight = simulate(scenario, seed=3, duration_s=30, outliers="none", instrument=parse_instrument(text))
        return flight.log.measurement, np.hstack([flight.truth.position_m, flight.truth.velocity_mps])

    plain, truth = measured("none")
    rounded, same = measured("range_rounding_m=8,elevation_rounding_mrad=2")
    assert (truth == same).all()
    np.testing.assert_allclose(rounded[:, 0] / 8, np.round(plain[:, 0] / 8), atol=1e-9)
    np.testing.assert_allclose(rounded[:, 2] / 2e-3, np.round(plain[:, 2] / 2e-3), atol=1e-9)
    assert (rounded[:, 1] == plain[:, 1]).all()
    held, same = measured("azimuth_held=4")
    assert (truth == same).all()
    assert (held[:, 1] == plain[np.arange(len(plain)) // 4 * 4, 1]).all()
    assert (held[:, [0, 2]] == plain[:, [0, 2]]).all()
    wandering, same = measured("range_wander_m=20,wander_s=0.5")
    assert (truth == same).all()
    off = wandering[:, 0] - plain[:, 0]
    assert np.std(off) == pytest.approx(20, rel=0.3)
    assert np.corrcoef(off[1:], off[:-1])[0, 1] == pytest.approx(np.exp(-0.05 / 0.5), abs=0.05)
    late, same = measured("stamp_jitter_s=0.05")
    assert (truth == same).all()
    speed = np.sum(truth[:, :3] * truth[:, 3:6], 1) / np.linalg.norm(truth[:, :3], axis=1)
    stamp = (late[:, 0] - plain[:, 0]) / speed
    assert np.std(stamp[np.abs(speed) > 50]) == pytest.approx(0.05, rel=0.15)


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
    assert str(raised.value).startswith("--instrument: ")
    assert sentence in str(raised.value)


def test_ranges_walk_as_their_echoes_fade() -> None:
    text = "range_walk_m=6,range_walk_at_m=9000,echo_db=8,echo_s=4"
    how = {"seed": 3, "duration_s": 200.0, "noise": (0, 0, 0), "outliers": "none"}
    flight = simulate("manoeuvre-clean", instrument=parse_instrument(text), **how)
    signal_db = flight.log.signal_db
    assert signal_db is not None
    assert flight.log.extra is not None
    assert flight.log.extra.column("signal_db").to_numpy().tolist() == signal_db.tolist()
    distance = np.linalg.norm(flight.truth.position_m, axis=1)
    off = flight.log.measurement[:, 0] - distance
    weak = np.expm1(off / 6)  # the power at which walking begins, over that of the echo
    np.testing.assert_allclose(-10 * np.log10(weak), signal_db - 13, atol=2.5)
    changes = -10 * np.log10(weak) + 40 * np.log10(distance / 9000)
    assert np.std(changes) == pytest.approx(8, rel=0.3)
    step = flight.log.time_s[1] - flight.log.time_s[0]
    assert np.corrcoef(changes[1:], changes[:-1])[0, 1] == pytest.approx(np.exp(-step / 4), abs=0.02)
    steady = simulate("manoeuvre-clean", instrument=parse_instrument(text.replace("echo_db=8", "echo_db=0")), **how)
    assert steady.log.extra is None
    assert steady.log.signal_db is None
    assert (steady.log.measurement[:, 1:] == flight.log.measurement[:, 1:]).all()
