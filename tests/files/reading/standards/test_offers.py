"""What stands deep in a document, or in cells with a unit, is offered or read as columns."""

import json

import numpy as np

from ftproc.files.reading import logs
from ftproc.files.words import COMPONENTS
from tests.files.conftest import Make, refused
from tests.files.reading.standards.test_strangers import AZIMUTHS, ELEVATIONS, RANGES, ROWS, A, E, R, T


def test_lists_of_numbers_inside_records_are_columns(make: Make) -> None:
    records = [{"t": t, "measurement": [a, e, r], "sensor": 1} for t, r, a, e in ROWS]
    path = make(json.dumps(records), "log.json")
    say = "range=measurement 3,azimuth=measurement 1,elevation=measurement 2"
    assert f"--columns '{say}', which gives a target" in refused(path)
    np.testing.assert_allclose(logs.read(path, columns=say).measurement[:, 0], R)


def test_columns_of_json_beside_values_of_the_whole_log(make: Make) -> None:
    units = {"time": "s", "range": "m", "azimuth": "deg", "elevation": "deg"}
    columns = dict(zip(units, (T.tolist(), RANGES, AZIMUTHS, ELEVATIONS), strict=True))
    log = logs.read(make(json.dumps({"station": "X", **columns, "units": units}), "log.json"))
    np.testing.assert_allclose(log.measurement, np.column_stack([R, A, E]))
    assert tuple(units)[1:] == COMPONENTS


def test_an_angle_with_its_unit_in_the_cells_is_asked_about(make: Make) -> None:
    rows = (f"{t} s,{r:.1f} m,{a:.4f}°,{e:.4f}°" for t, r, a, e in ROWS)
    said = refused(make("\n".join(["Time,Distance,Direction,Elevation", *rows]) + "\n"))
    assert 'by the values, "Direction" may be the azimuth. Say --columns azimuth=Direction' in said


def test_a_speed_is_not_proposed_for_the_elevation(make: Make) -> None:
    rows = (f"{t},{r:.1f},{a:.4f},{18.6 + 0.1 * np.sin(2 * t):.4f}" for t, r, a, _ in ROWS)
    log = logs.read(make("\n".join(["t_s,range_m,brg_deg,Spd", *rows]) + "\n"))
    assert np.isnan(log.measurement[:, 2]).all()
