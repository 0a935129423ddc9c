"""Matlab files: tables in structures, cells and matrices, wherever they lie."""

from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused
from tests.files.zoo.flight import Flight, flight

NAMES = ("time_s", "range_m", "azimuth_rad", "elevation_rad")


def fields(f: Flight) -> dict[str, Any]:
    return {name: column[:, None] for name, column in zip(NAMES, f, strict=True)}


def cells(rows: list[Any], shape: tuple[int, ...]) -> Any:
    found = np.empty(len(rows), object)
    found[:] = rows
    return found.reshape(shape)


def below_names(f: Flight) -> Any:
    flat = [*NAMES, *(float(value) for row in np.column_stack(f) for value in row)]
    return cells(flat, (len(f.t) + 1, 4))


ONE = flight()
WAYS = {
    "a structure": {"radar": fields(ONE), "info": "x"},
    "structures inside each other": {"flight": {"date": "2024", "sensors": {"radar": {"data": fields(ONE), "id": 1}}}},
    "a matrix beside its names": {"data": np.column_stack(ONE), "names": np.array(NAMES, object)},
    "names inside a structure": {"log": {"colheaders": np.array(NAMES, object), "data": np.column_stack(ONE)}},
    "cells below names": {"log": below_names(ONE)},
    "a cell for each number": {k: cells(v.tolist(), (len(v), 1)) for k, v in zip(NAMES, ONE, strict=True)},
    "a structure for each row": {
        "log": cells([dict(zip(NAMES, row, strict=True)) for row in zip(*ONE, strict=True)], (1, 120))
    },
    "one log among other tables": {"radar": fields(ONE), "weather": {"h": np.arange(9.0), "p": np.arange(9.0)}},
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
def test_a_table_is_found(make: Make, way: str) -> None:
    path = make("", "a.mat")
    savemat(path, WAYS[way])
    log = logs.read(path)
    np.testing.assert_array_equal(log.time_s, ONE.t)
    np.testing.assert_array_equal(log.measurement, np.column_stack(ONE[1:]))


def test_of_two_tracks_one_is_named(make: Make) -> None:
    path = make("", "a.mat")
    savemat(path, {"tracks": cells([fields(ONE), fields(flight(1))], (1, 2))})
    assert f"tracks(1), tracks(2). Name one behind #, such as {path}#tracks(1)" in refused(path)
    np.testing.assert_array_equal(logs.read(f"{path}#tracks(2)").measurement[:, 0], flight(1).r)
