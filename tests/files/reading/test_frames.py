"""Columns that count frames or samples, with the rate in a line above or in their name, and no other time."""

import numpy as np
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused
from tests.files.zoo.flight import flight, lines

FLIGHT = flight()  # two rows in a second
COLUMNS = (FLIGHT.r, np.degrees(FLIGHT.a), np.degrees(FLIGHT.e))
NUMBERS = np.arange(1, len(FLIGHT.t) + 1)


def written(above: str, name: str, numbers: np.ndarray = NUMBERS) -> str:
    return lines(f"{above}\n{name},range_m,az_deg,el_deg".lstrip(), numbers, *COLUMNS)


@pytest.mark.parametrize(
    ("above", "name"),
    [
        ("# 2 frames per second", "Frame"),
        ("# Video 1920x1080, 2 fps", "frame_no"),
        ("# Frame rate: 2.0 Hz", "Frame No."),
        ("% Sampling rate: 2 Hz", "sample"),
        ("# fs = 2 Hz", "n"),
        ("# FPS: 2", "index"),
        ("# dt = 0.5 s", "n"),
        ("# dt = 0.5", "sample"),
        ("# Sample interval: 500 ms", "Sample #"),
        ("# one record every 500 ms", "record"),
        ("# Abtastintervall: 0,5 s", "index"),
        ("", "frame (2 fps)"),
        ("", "frame_2fps"),
    ],
)
def test_a_rate_makes_frames_a_time_and_is_said(make: Make, above: str, name: str) -> None:
    log = logs.read(make(written(above, name)))
    np.testing.assert_allclose(log.time_s - log.time_s[0], FLIGHT.t, atol=1e-9)
    np.testing.assert_allclose(log.measurement[:, 0], FLIGHT.r, rtol=1e-6)
    assert any(f'"{name}" is the time in steps of' in note and (above or name) in note for note in log.remarks)


def test_frames_that_were_dropped_leave_gaps(make: Make) -> None:
    numbers = NUMBERS + 10 * (NUMBERS > 50)
    log = logs.read(make(written("# 2 frames per second", "frame", numbers)))
    np.testing.assert_allclose(np.diff(log.time_s), np.diff(numbers) / 2)


@pytest.mark.parametrize("above", ["", "# PRF: 640 Hz", "# Samples: 120", "# Baud rate: 9600", "# Frame 25"])
def test_without_a_rate_frames_are_asked_about(make: Make, above: str) -> None:
    path = make(written(above, "frame"))
    assert "no time column" in refused(path)
    assert "nothing says how many there are in a second. Say --columns time=frame --units time=UNIT" in refused(
        path, columns="time=frame"
    )
    assert len(logs.read(path, columns="time=frame", units="time=1/2 s")) == len(NUMBERS)


def test_two_rates_are_asked_about(make: Make) -> None:
    said = refused(make(written("# 2 frames per second\n# Sampling rate: 50 Hz", "frame")))
    assert "--columns time=frame --units 'time=1/2 s' or --columns time=frame --units 'time=1/50 s'" in said


def test_a_time_is_no_matter_of_rates(make: Make) -> None:
    log = logs.read(make(lines("# 50 fps\nframe,time_s,range_m,az_deg,el_deg", NUMBERS, FLIGHT.t, *COLUMNS)))
    np.testing.assert_allclose(log.time_s, FLIGHT.t)
