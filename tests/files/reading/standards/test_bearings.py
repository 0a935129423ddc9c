"""Bearings from the head of a ship and from north, in the words of several languages."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused
from tests.files.reading.standards.test_layouts import DEG, A, N, R, T

HEAD = 73.0 + 0.5 * T
NORTH = [f"{value:.4f}" for value in A * DEG % 360]
RELATIVE = [f"{value:.4f}" for value in (A * DEG - HEAD) % 360]
COLUMNS = {"t": [f"{t:.1f}" for t in T], "r": [f"{r:.2f}" for r in R], "true": NORTH, "relative": RELATIVE,
           "head": [f"{value:.4f}" for value in HEAD], "speed": ["12.1"] * N}  # fmt: skip


def table(**names: str) -> str:
    """Columns of COLUMNS under names of their own, semicolons between them."""
    rows = zip(*(COLUMNS[column] for column in names), strict=True)
    return ";".join(names.values()) + "\n" + "".join(";".join(row) + "\n" for row in rows)


@pytest.mark.parametrize(
    ("time", "distance", "relative", "heading"),
    [
        ("Heure (s)", "Distance (m)", "Gisement (°)", "Cap (°)"),
        ("Tiempo (s)", "Distancia (m)", "Marcación (°)", "Proa (°)"),
        ("Ora (s)", "Distanza (m)", "Rilevamento polare (°)", "Prora (°)"),
        ("Zeit (s)", "Entfernung (m)", "Seitenpeilung (°)", "Steuerkurs (°)"),
        ("Время, с", "Дальность, м", "Курсовой угол, град", "Курс, град"),
        ("Time (s)", "Range (m)", "Rel. Bearing (deg)", "Heading (deg)"),
        ("Time (s)", "Range (m)", "Bearing (deg rel)", "Heading (deg true)"),
        ("Czas (s)", "Odległość (m)", "Kąt kursowy (°)", "Kurs (°)"),
    ],
)
def test_a_relative_bearing_and_a_heading_are_a_bearing_from_north(
    make: Make, time: str, distance: str, relative: str, heading: str
) -> None:
    log = logs.read(make(table(t=time, relative=relative, head=heading, r=distance)))
    assert log.frame == "north-east-up"
    np.testing.assert_allclose(np.mod(log.measurement[:, 1] - A + 1, 2 * np.pi), 1, atol=1e-5)
    course = heading.startswith(("Kurs", "Курс"))
    assert (f'"{heading}" is the heading of the carrier' in log.understood["assumed"]) == course


@pytest.mark.parametrize(
    ("relative", "true"),
    [
        ("Gisement (°)", "Azimut vrai (°)"),
        ("Marcación (°)", "Demora (°)"),
        ("Marcación relativa (°)", "Marcación verdadera (°)"),
        ("Rilevamento polare (°)", "Rilevamento vero (°)"),
        ("Seitenpeilung (°)", "rw. Peilung (°)"),
        ("Курсовой угол, град", "Пеленг, град"),
        ("Relative Bearing (deg)", "True Bearing (deg)"),
    ],
)
def test_the_true_bearing_is_taken_and_no_other_direction_offered_as_an_elevation(
    make: Make, relative: str, true: str
) -> None:
    log = logs.read(make(table(t="Time (s)", relative=relative, true=true, r="Range (m)", head="Rumbo (°)")))
    assert log.frame == "north-east-up"
    np.testing.assert_allclose(np.mod(log.measurement[:, 1] - A + 1, 2 * np.pi), 1, atol=1e-5)
    assert np.isnan(log.measurement[:, 2]).all()


def test_a_bearing_beside_a_course_is_no_elevation(make: Make) -> None:
    log = logs.read(make(table(t="Zeit (s)", true="Peilung (°)", head="Kurs (°)", speed="Fahrt (kn)", r="Abstand (m)")),
                    columns="range=Abstand (m)")  # fmt: skip
    assert np.isnan(log.measurement[:, 2]).all()


@pytest.mark.parametrize(("name", "counts"), [("Gisement (°)", "may count"), ("Marcación (°)", "counts")])
def test_a_relative_bearing_alone_is_a_condition(make: Make, name: str, counts: str) -> None:
    log = logs.read(make(table(t="t (s)", relative=name, r="Range (m)")))
    assert f"the head of the carrier, from which the azimuth {counts}, stays where it is" in log.understood["assumed"]
    assert log.frame == "local"


def test_a_gisement_of_gunners_counts_from_no_ship(make: Make) -> None:
    log = logs.read(make(table(t="t (s)", relative="Gisement (gr)", r="Distance oblique (m)")))
    assert not any("carrier" in each for each in log.understood["assumed"])


def test_whose_course_it_is_beside_a_speed_is_asked(make: Make) -> None:
    path = make(table(t="Zeit (s)", relative="Seitenpeilung (°)", head="Kurs (°)", speed="Fahrt (kn)", r="Range (m)"))
    question = refused(path)
    assert "--columns 'azimuth=Seitenpeilung (°)+Kurs (°)' if it is the heading" in question
    log = logs.read(path, columns="azimuth=Seitenpeilung (°)+Kurs (°)")
    np.testing.assert_allclose(np.mod(log.measurement[:, 1] - A + 1, 2 * np.pi), 1, atol=1e-5)


def test_a_compass_bearing_and_the_variation_are_a_bearing_from_north(make: Make) -> None:
    log = logs.read(make(table(t="t (s)", relative="Compass Bearing (deg)", head="Magnetic Variation (deg)",
                               r="Range (m)")))  # fmt: skip
    assert log.frame == "north-east-up"
    np.testing.assert_allclose(np.mod(log.measurement[:, 1] - A + 1, 2 * np.pi), 1, atol=1e-5)


@pytest.mark.parametrize(
    "distance", ["Abstand (sm)", "Entfernung [sm]", "Distanz (Seemeilen)", "Abstand (NM)", "Distancia (mn)"]
)
def test_nautical_miles_of_seafarers(make: Make, distance: str) -> None:
    log = logs.read(make(table(t="Uhrzeit (s)", true="rw. Peilung (°)", r=distance)))
    np.testing.assert_allclose(log.measurement[:, 0], 1852 * np.round(R, 2), rtol=1e-9)


def test_sm_in_english_are_statute_miles(make: Make) -> None:
    log = logs.read(make(table(t="Time (s)", true="Bearing (deg)", r="Range (sm)")))
    np.testing.assert_allclose(log.measurement[:, 0], 1609.344 * np.round(R, 2), rtol=1e-9)


@pytest.mark.parametrize(("name", "unit"), [("Depth_m", 1.0), ("depth_ft", 0.3048), ("Profondeur (m)", 1.0)])
def test_a_depth_beside_ranges_and_bearings_is_asked_about_and_counts_downwards(
    make: Make, name: str, unit: float
) -> None:
    path = make(table(t="t (s)", true="Bearing (deg)", r="Slant Range (m)", speed=name))
    assert f"height={name}" in refused(path)
    log = logs.read(path, columns={"height": name})
    assert log.heights is not None
    np.testing.assert_allclose(log.heights.above_m, -12.1 * unit)
    assert not log.heights.barometric
    assert logs.read(path, columns={"height": "none"}).heights is None
    below = make(path.read_text().replace(";12.1", ";-12.1"))  # with the sign of a height
    np.testing.assert_allclose(logs.read(below, columns={"height": name}).heights.above_m, -12.1 * unit)


def test_other_words_cut_short_before_a_distance_say_nothing(make: Make) -> None:
    log = logs.read(make(table(t="Время, с", true="Пеленг, град", r="Накл. расстояние, м")))
    np.testing.assert_allclose(log.measurement[:, 0], np.round(R, 2))
