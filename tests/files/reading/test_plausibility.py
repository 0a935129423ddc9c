"""Angles in a mistaken unit are refused with the cure; a forgotten option is remarked on."""

import numpy as np
import pyarrow as pa
import pytest

from ftproc.files.reading import logs
from ftproc.settings import Station
from tests.files.conftest import Make, refused


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "t,A,E\n0,180,0.1\n",
            "it looks like degrees (or gon); use --units azimuth=deg (and elevation=deg if that is so too).",
        ),
        (
            "t,A,E\n0,1,45\n",
            '"E" lies beyond 45 rad, which is no elevation: it looks like degrees (or gon); use --units elevation=deg',
        ),
        ("t,A\n0,380\n", "it looks like gradians (gon); use --units azimuth=grad"),
        (
            "t,A\n0,100\n1,200\n2,390\n",
            'half of column "A" lies beyond 200 rad, which is no azimuth: it looks like grad',
        ),
        ("t,A\n0,100\n1,200\n2,350\n", "it looks like degrees"),
        ("t,A\n0,3200\n", "it looks like mils; use --units azimuth=mil"),
        ("t,el_deg\n0,800\n", "lies beyond 800 deg, which is no elevation: it looks like mils"),
        ("t,A\n0,1e9\n", "it looks like another unit; use --units azimuth=UNIT"),
        ("t,azimuth_rad\n0,180\n", "use --columns azimuth=azimuth_rad --units azimuth=deg."),
        ("t,A\n0,\n1,-180\n2,1\n3,-170\n", "it looks like degrees"),
    ],
)
def test_angles_in_a_mistaken_unit(make: Make, text: str, expected: str) -> None:
    assert expected in refused(make(text))


def test_the_cures_for_a_mistaken_unit_work(make: Make) -> None:
    bare, stated = make("t,A\n0,180\n", "a.csv"), make("t,azimuth_rad\n0,180\n", "b.csv")
    assert logs.read(bare, units="azimuth=deg").measurement[0, 1] == pytest.approx(3.14159265358979)
    assert logs.read(bare, units="azimuth=rad").measurement[0, 1] == 180
    options = {"columns": "azimuth=azimuth_rad", "units": "azimuth=deg"}
    assert logs.read(stated, **options).measurement[0, 1] == pytest.approx(3.14159265358979)  # type: ignore[arg-type]


def test_a_few_outliers_are_no_mistaken_unit(make: Make) -> None:
    log = logs.read(make("t,A,E\n0,1,1\n1,400,80\n2,12,1.5\n"))
    assert log.measurement[1, 1:].tolist() == [400, 80]


def table(**columns: object) -> pa.Table:
    return pa.table({"time_s": [0.0, 1.0], "range_m": [5.0, 6.0], **columns})


def test_a_forgotten_zenith_is_suspected() -> None:
    sentence = "half of the elevations are above 60 deg: if they are zenith angles, say --elevation-from zenith"
    assert logs.read(table(elevation_rad=[1.5, 1.4])).remarks == (sentence,)
    assert logs.read(table(elevation_rad=[1.0, 1.0])).remarks == ()
    assert logs.read(table(elevation_rad=[0.1, 0.2]), station=Station(elevation_from="zenith")).remarks == ()


def test_a_turn_of_400_degrees_is_suspected() -> None:
    gon = np.linspace(0, 399, 50)
    log = pa.table({"time_s": np.arange(50.0), "azimuth_deg": gon})
    assert logs.read(log).remarks == ("the azimuth runs from 0 to 400 deg: if they are gon, say --units azimuth=gon",)
    assert logs.read(log.rename_columns(["time_s", "azimuth_gon"])).remarks == ()
    assert logs.read(log.set_column(1, "azimuth_deg", pa.array(gon + 300))).remarks == ()  # counts on after a turn
