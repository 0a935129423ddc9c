"""Every log of the zoo is read right with nothing but what no program can know, or asks for the one option it needs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ftproc.errors import InputError
from ftproc.files import leap_seconds
from ftproc.files.options import Extract, parse_where
from ftproc.files.reading import logs
from ftproc.records import MeasurementLog
from ftproc.settings import Station
from tests.files.zoo.animals import all_animals
from tests.files.zoo.exports import all_exports
from tests.files.zoo.flight import Animal, flight
from tests.files.zoo.neighbours import all_neighbours
from tests.files.zoo.others import all_others
from tests.files.zoo.radars import all_radars
from tests.files.zoo.standards import all_standards
from tests.files.zoo.strangers import all_strangers

ANIMALS = [
    *all_animals(),
    *all_others(),
    *all_strangers(),
    *all_radars(),
    *all_standards(),
    *all_neighbours(),
    *all_exports(),
]
MOST_QUESTIONS = 0.1  # share of the animals


def read(path: Path, options: dict[str, Any]) -> MeasurementLog:
    given = dict(options)
    where = parse_where(given.pop("where", None))
    extract = Extract(tuple(given.pop("widths", ())), where, given.pop("target", ""))
    station = Station(azimuth_from=given.pop("azimuth_from", "x"), elevation_from=given.pop("elevation_from", None))
    return logs.read(path, station=station, extract=extract, **given)


@pytest.mark.parametrize("animal", ANIMALS, ids=lambda animal: animal.name)
def test_is_read_right(animal: Animal, tmp_path: Path) -> None:
    path = animal.write(tmp_path)
    options = animal.options
    if animal.asks:
        with pytest.raises(InputError) as question:
            read(path, options)
        assert animal.asks in str(question.value)
        options = {**options, **animal.answer}
    log = read(path, options)
    truth = flight(animal.which)
    np.testing.assert_allclose(log.time_s - log.time_s[0], truth.t, atol=animal.clock)
    if np.isfinite(animal.first_s):
        assert log.time_s[0] == pytest.approx(animal.first_s, abs=animal.clock)
    expected = np.column_stack([truth.r, truth.a, truth.e])
    turned = (log.measurement[:, 1] - expected[:, 1] + np.pi) % (2 * np.pi) - np.pi
    error = np.column_stack([log.measurement[:, 0] - expected[:, 0], turned, log.measurement[:, 2] - expected[:, 2]])
    absent = np.isnan(log.measurement).all(0)
    assert absent.tolist() == list(animal.absent)
    present = error[:, ~absent]
    assert np.isnan(present).sum() == animal.missing
    limit = np.array([1, 1e-5, 1e-5])[~absent] * max(animal.tolerance, 1e-2)
    assert (np.abs(np.nan_to_num(present)) <= limit).all(), np.nanmax(np.abs(present), axis=0)
    assert log.epoch == "" or animal.utc
    if animal.utc:
        first = leap_seconds.utc(log.epoch, log.time_s[:1], float(log.time_s[0]))[0]
        assert abs(first - np.datetime64(animal.utc)) < np.timedelta64(1, "ms")


def test_few_ask_and_there_are_many() -> None:
    assert len(ANIMALS) >= 60
    assert sum(bool(animal.asks) for animal in ANIMALS) <= MOST_QUESTIONS * len(ANIMALS)
    assert len({animal.name for animal in ANIMALS}) == len(ANIMALS)
