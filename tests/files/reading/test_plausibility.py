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
            "t,A\n0,380\n",
            'no unit is stated for "A", and the motion of the target does not tell which it is. Say --units azimuth=gr',
        ),
        ("t,Hz,V\n0,180,15\n", "Say --units azimuth=deg,elevation=deg or --units azimuth=grad,elevation=grad"),
        (
            "t,A\n0,3200\n",
            "Say --units azimuth=mil or --units azimuth=mrad or --units azimuth=mil6000.",
        ),
        ("t,el_deg\n0,800\n", "lies beyond 800 deg, which is no elevation. Say --columns elevation=el_deg --units"),
        (
            "t,el_deg\n0,95\n",
            "no elevation. Say --elevation-from zenith if the target is below the station, or take 90 degrees off",
        ),
        (
            "t,az_rad,el_rad\n0,1500,100\n",
            "or --columns azimuth=az_rad,elevation=el_rad --units azimuth=mrad,elevation=mrad.",
        ),
        (
            "t,A\n0,1e9\n",
            "is no azimuth in any unit that is known. Say --columns azimuth=A --units azimuth=UNIT.",
        ),
        ("t,azimuth_rad\n0,180\n", "no azimuth. Say --columns azimuth=azimuth_rad --units azimuth=deg or"),
    ],
)
def test_angles_whose_unit_is_open_are_asked_about(make: Make, text: str, expected: str) -> None:
    assert expected in refused(make(text))


@pytest.mark.parametrize(
    ("text", "azimuth_deg", "elevation_deg"),
    [
        ("t,A,E\n0,180,0.1\n", 180, 0.1),
        ("t,A,E\n0,1,45\n", 1, 45),
        ("t,A,E\n0,100,5\n1,200,5\n2,350,5\n", 100, 5),
        ("t,A,E\n0,-170,5\n1,-180,5\n2,1,5\n3,-170,5\n", -170, 5),
        ("t,A,E\n0,398,5\n1,399,5\n2,0.5,5\n3,1,5\n", 358.2, 4.5),
        ("t,A,E\n0,6390,80\n1,6398,80\n2,3,80\n3,9,80\n", 359.4375, 4.5),
        ("t,AZ (mil),EL (mil)\n0,5990,80\n1,5998,80\n2,3,80\n3,9,80\n", 359.4, 4.8),
    ],
)
def test_angles_whose_unit_only_one_reading_allows(
    make: Make, text: str, azimuth_deg: float, elevation_deg: float
) -> None:
    log = logs.read(make(text))
    assert np.degrees(log.measurement[0, 1:]) == pytest.approx([azimuth_deg, elevation_deg])
    assert log.remarks


def test_the_cures_for_a_mistaken_unit_work(make: Make) -> None:
    bare, stated = make("t,A\n0,180\n", "a.csv"), make("t,azimuth_rad\n0,180\n", "b.csv")
    assert logs.read(bare, units="azimuth=deg").measurement[0, 1] == pytest.approx(3.14159265358979)
    assert logs.read(bare, units="azimuth=rad").measurement[0, 1] == 180
    options = {"columns": "azimuth=azimuth_rad", "units": "azimuth=deg"}
    assert logs.read(stated, **options).measurement[0, 1] == pytest.approx(3.14159265358979)  # type: ignore[arg-type]


def test_a_few_outliers_are_no_mistaken_unit(make: Make) -> None:
    log = logs.read(make("t,A,E\n0,1,1\n1,400,80\n2,12,1.0\n"))
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


TURNS = {"mrad": 2e3 * np.pi, "mil6300": 6300.0, "mil": 6400.0, "deg": 360.0}


@pytest.mark.parametrize(("unit", "turn"), TURNS.items())
def test_the_unit_of_an_azimuth_that_turns_is_known_by_the_turn(make: Make, unit: str, turn: float) -> None:
    for first, step in ((0.9 * turn, turn / 300), (-0.4 * turn, -turn / 200)):
        azimuth = (first + step * np.arange(60)) % turn
        if first < 0:
            azimuth = np.where(azimuth > turn / 2, azimuth - turn, azimuth)
        log = logs.read(make("t,A\n" + "".join(f"{k},{a!r}\n" for k, a in enumerate(azimuth.tolist()))))
        assert log.understood["columns"]["azimuth"]["unit"] == unit


def packed(degrees: float) -> str:
    whole, rest = divmod(round(degrees * 3600), 3600)
    return f"{whole}.{rest // 60:02d}{rest % 60:02d}"


def test_degrees_whose_decimals_are_minutes_and_seconds_are_known_by_their_digits(make: Make) -> None:
    degrees = [(60 + 0.137 * k, 10 + 0.031 * k) for k in range(60)]
    rows = "".join(f"{k},{packed(a)},{packed(e)}\n" for k, (a, e) in enumerate(degrees))
    path = make("t,A,E\n" + rows)
    log = logs.read(path)
    np.testing.assert_allclose(np.degrees(log.measurement[:, 1:]), degrees, atol=2e-4)
    assert any("say --units azimuth=deg,elevation=deg" in remark for remark in log.remarks)
    assert logs.read(path, units="azimuth=deg,elevation=deg").measurement[0, 1] == pytest.approx(np.pi / 3)
    log = logs.read(make("t,azimuth_dms,elevation_dms\n" + rows))
    np.testing.assert_allclose(np.degrees(log.measurement[:, 1:]), degrees, atol=2e-4)
    decimals = "".join(f"{k},{a:.4f},{e:.4f}\n" for k, (a, e) in enumerate(degrees))
    assert len(logs.read(make("t,A,E\n" + decimals))) == 60
