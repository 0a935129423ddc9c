"""The letters of surveyors: H, V and S, of which none says what it is alone."""

from __future__ import annotations

import numpy as np

from ftproc.files.reading import logs
from ftproc.settings import Station
from tests.files.conftest import Make, refused
from tests.files.reading.standards.test_layouts import DEG, A, E, R, T


def test_no_column_beside_v_is_left_out_without_a_question(make: Make) -> None:
    rows = zip(T, A * DEG, 90 - E * DEG, R, strict=True)
    path = make("t,H,V,S\n" + "".join(",".join(f"{value:.6f}" for value in row) + "\n" for row in rows))
    station, units = Station(elevation_from="zenith"), "elevation=deg"
    assert 'column "S" may be the range' in refused(path, station=station, units=units)
    assert "azimuth=H" in refused(path, station=station, units=units, columns="range=S")
    log = logs.read(path, station=station, units="azimuth=deg,elevation=deg", columns="range=S,azimuth=H")
    np.testing.assert_allclose(log.measurement, np.transpose([R, A, E]), rtol=0, atol=1e-5)
