"""Truths: round trip, order, and what is wrong with one."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from ftproc.errors import InputError
from ftproc.files.reading import truth
from ftproc.files.writing import flights
from ftproc.records import Truth
from tests.files.conftest import Make

finite = st.floats(allow_nan=False, allow_infinity=False)


@st.composite
def some_truths(draw: st.DrawFn) -> Truth:
    n = draw(st.integers(1, 20))
    vectors = hnp.arrays(np.float64, (n, 3), elements=finite)
    return Truth(
        "a",
        np.sort(draw(hnp.arrays(np.float64, n, elements=finite))),
        draw(vectors),
        draw(st.none() | vectors),
        draw(st.none() | vectors),
        draw(st.none() | hnp.arrays(np.uint8, (n, 3), elements=st.integers(0, 3))),
    )


def assert_same(one: np.ndarray | None, other: np.ndarray | None) -> None:
    assert (one is None) == (other is None)
    if one is not None and other is not None:
        assert (one.shape, one.dtype, one.tobytes()) == (other.shape, other.dtype, other.tobytes())


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz", ".parquet", ".feather"])
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=30)
@given(original=some_truths())
def test_every_bit_comes_back(tmp_path: Path, suffix: str, original: Truth) -> None:
    path = tmp_path / f"truth{suffix}"
    flights.write_truth(original, path)
    back = truth.read(path)
    assert back.name == str(path)
    for name in ("time_s", "position_m", "velocity_mps", "acceleration_mps2", "outlier"):
        assert_same(getattr(back, name), getattr(original, name))


def test_the_columns_are_named_as_promised(tmp_path: Path) -> None:
    three = np.ones((1, 3))
    flights.write_truth(Truth("a", np.zeros(1), three, three, three, np.ones((1, 3), np.uint8)), tmp_path / "t.csv")
    assert (tmp_path / "t.csv").read_text() == (
        "time_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,outlier_range,outlier_azimuth,"
        "outlier_elevation\n0,1,1,1,1,1,1,1,1,1,1,1,1\n"
    )


def test_rows_are_put_in_time_order_and_other_columns_ignored(make: Make) -> None:
    read = truth.read(make("note,z_m,y_m,x_m,time_s,outlier_azimuth\na,3,2,1,5,1\nb,6,5,4,0,\nc,9,8,7,5,2\n"))
    assert read.time_s.tolist() == [0, 5, 5]
    assert read.position_m.tolist() == [[4, 5, 6], [1, 2, 3], [7, 8, 9]]
    assert read.velocity_mps is None
    assert read.acceleration_mps2 is None
    assert read.outlier is not None
    assert read.outlier.tolist() == [[0, 0, 0], [0, 1, 0], [0, 2, 0]]


def test_many_equal_times_keep_the_order_of_the_file() -> None:
    position = np.arange(3000.0)
    table = pa.table({"time_s": np.tile([2.0, 1.0, 3.0], 1000), "x_m": position, "y_m": position, "z_m": position})
    expected = [*range(1, 3000, 3), *range(0, 3000, 3), *range(2, 3000, 3)]
    assert truth.read(table).position_m[:, 0].tolist() == expected


def test_timestamps_count_as_in_a_log_of_the_same_day(make: Make) -> None:
    assert truth.read(make("time_s,x_m,y_m,z_m\n2024-05-31T01:00:00Z,1,2,3\n")).time_s.tolist() == [3600]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "time_s,x_m,y_m,Zm\n0,1,2,3\n",
            'no column "z_m"; did you mean "Zm"? Its columns are: time_s, x_m, y_m, Zm. Rename the right',
        ),
        ("time,x_m,y_m,z_m\n0,1,2,3\n", 'there is no column "time_s"; did you mean "time"?'),
        ("time_s,x_m,y_m,z_m,vx_mps\n0,1,2,3,4\n", 'there is no column "vy_mps"'),
        ("time_s,x_m,y_m,z_m,z_m\n0,1,2,3,4\n", 'column "z_m" is there twice; rename or delete all but one.'),
        (
            "time_s,x_m,y_m,z_m\n0,1,2,3\n1,2,,3\n",
            'row 1 (the first data row is 0), column "y_m": the value is missing. Fill it in',
        ),
        ("time_s,x_m,y_m,z_m\n0,1,2,3\n,2,2,3\n", 'column "time_s": the value is missing'),
        (
            "time_s,x_m,y_m,z_m\n0,1,2,q\n",
            'row 0 (the first data row is 0), column "z_m": "q" is not a number; expected a number. Correct the cell.',
        ),
        ("time_s,x_m,y_m,z_m\n0,1,2,inf\n", '"inf" is not finite'),
        ("time_s,x_m,y_m,z_m\n", "there are column names but no rows."),
        (
            "time_s,x_m,y_m,z_m,outlier_range\n0,1,2,3,0.5\n",
            'column "outlier_range": "0.5" is not a flag; expected a whole number from 0 to 255.',
        ),
    ],
)
def test_the_fault_of_a_truth_is_named(make: Make, text: str, expected: str) -> None:
    path = make(text)
    with pytest.raises(InputError) as caught:
        truth.read(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert expected in str(caught.value)


@pytest.mark.parametrize(
    ("head", "factors"),
    [
        ("time_ms,x_km,y_km,z_km", (1e3, 1e-3)),
        ("Time (s),X (ft),Y (ft),Z (ft)", (1.0, 1 / 0.3048)),
        ("time_s,x_m,y_m,z_m", (1.0, 1.0)),
    ],
)
def test_a_truth_in_other_units_comes_in_si_units(make: Make, head: str, factors: tuple[float, float]) -> None:
    rows = "".join(f"{k * factors[0]!r},{','.join(repr(1000.0 * c * factors[1]) for c in (1, 2, 3))}\n" for k in (0, 1))
    found = truth.read(make(f"{head}\n{rows}"))
    np.testing.assert_allclose(found.time_s, [0.0, 1.0])
    np.testing.assert_allclose(found.position_m, [[1000.0, 2000.0, 3000.0]] * 2)


def test_two_columns_that_may_be_the_position_are_not_chosen_between(make: Make) -> None:
    with pytest.raises(InputError, match=r"Rename the right one to x_m, or to x_km, x_ft if it is in such a unit\."):
        truth.read(make("time_s,x_km,x_ft,y_m,z_m\n0,1,2,3,4\n"))


@pytest.mark.parametrize("rows", [(7,), (7, 20, 30)])
def test_a_number_that_means_a_missing_value_is_refused(make: Make, rows: tuple[int, ...]) -> None:
    lines = [f"{k},{-9999 if k in rows else 5000 + 15 * k},0,100" for k in range(40)]
    with pytest.raises(InputError, match=r'row 7 .*, column "x_m": -9999 stands far .* Delete such rows\.'):
        truth.read(make("time_s,x_m,y_m,z_m\n" + "\n".join(lines)))


def test_a_flight_through_such_a_number_is_a_flight(make: Make) -> None:
    lines = [f"{k},{-9999 + 15 * (k - 20)},0,100" for k in range(40)]
    assert -9999 in truth.read(make("time_s,x_m,y_m,z_m\n" + "\n".join(lines))).position_m


def test_a_position_too_large_in_metres(tmp_path):
    path = tmp_path / "truth.csv"
    path.write_text("time_s,x_km,y_m,z_m\n0,1e308,2,3\n1,2,3,4\n")
    with pytest.raises(InputError, match=r'truth\.csv: row 0 .*, column "x_km": "inf" is not finite'):
        truth.read(path)


@pytest.mark.parametrize(
    ("names", "mps"),
    [("vx_kmh,vy_kmh,vz_kmh", 1 / 3.6), ("vx [kt],vy [kt],vz [kt]", 1852 / 3600), ("vx_mps,vy_mps,vz_mps", 1)],
)
def test_velocities_may_be_in_other_units(make: Make, names: str, mps: float) -> None:
    found = truth.read(make(f"time_s,x_m,y_m,z_m,{names}\n0,1,2,3,10,20,30\n1,1,2,3,10,20,30\n"))
    assert found.velocity_mps is not None
    np.testing.assert_allclose(found.velocity_mps, [[10 * mps, 20 * mps, 30 * mps]] * 2)


def test_a_velocity_in_a_unit_that_nobody_knows_is_not_left_out_in_silence(make: Make) -> None:
    with pytest.raises(InputError, match=r'no column "vz_mps".*vz_kmh, vz_kt'):
        truth.read(make("time_s,x_m,y_m,z_m,vx_kmh,vy_kmh,vz_furlongs\n0,1,2,3,10,20,30\n"))
