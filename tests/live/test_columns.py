"""What the lines of a log that is followed mean: as a complete log of the same lines is understood."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.config.recipe import Recipe
from ftproc.errors import InputError
from ftproc.files.reading import logs
from ftproc.live.columns import Reader
from ftproc.live.lines.growing import Block
from ftproc.settings import FilterSettings, Station
from tests.simulated import simulate

ROWS = "0,1000,0.1,0.2\n1,1010,0.1,0.2\n2,1020,0.1,0.2\n"
LATER = "3,1030,0.1,0.2\n4,1040,0.1,0.2\n"
HEADER = "time_s,range_m,azimuth_rad,elevation_rad\n"


def followed(text, recipe=None, at_once=3):
    """The readings (n, 4), the error of the row after them, and what is said; so many lines come at once."""
    readings, *others = followed_with_rates(text, recipe, at_once)
    return readings[:, :4], *others


def followed_with_rates(text, recipe=None, at_once=3):
    """The same with range rates, (n, 5)."""
    said = []
    reader = Reader("a.csv", recipe or Recipe(), said.append)
    texts = text.splitlines()
    parts, fault = [], None
    for low in range(0, len(texts), at_once):
        readings, fault = reader.read(Block(low + 1, texts[low : low + at_once]))
        parts.append(readings)
        if fault is not None:
            break
    if fault is None:
        reader.finish()
    return np.vstack(parts), fault, said


@pytest.mark.parametrize("at_once", [1, 2, 100])
@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        ("time_s,range_km,azimuth_gon,zenith_deg\n0,1,100,50\n1,1,100,51\n", {}, "elevation from zenith angles"),
        ("time_s;range_m;az_mils;depression (mrad)\n0;1000;1600;50\n1;1000;1600;51\n", {}, "counts downwards"),
        ("t\tR\tA\tE\n0\t1\t40\t50\n", {"units": "time=ms,range=km,azimuth=deg,elevation=deg"}, ""),
        ("0,1,40,50\n", {"columns": "time=1,range=2,azimuth=3,elevation=4", "units": "azimuth=deg,elevation=deg"}, ""),
        (f"# note\nFlight 12\n{HEADER}s,m,rad,rad\n{ROWS}", {}, ""),
        (f"# {HEADER}{ROWS}# note\n{LATER}", {}, ""),
        (HEADER + ROWS + HEADER + LATER, {}, ""),
        (HEADER + ',1000,0.1,0.2\n3,"1000",NaN,\n\n4,NULL,0.1,0.2\n', {}, ""),
        ("time_s   range_m  azimuth_rad\n0.5   1000   0.1\n", {}, ""),
        ("0.500100010\n", {"widths": "5,4,2", "columns": "time=1,range=2,azimuth=3"}, ""),
        (HEADER + ROWS, {"station": Station("north", "anticlockwise", 0.3, None, (5.0, 0.1, 0.2), 7.0)}, "reversed"),
    ],
)
def test_the_readings_are_those_of_the_complete_log(tmp_path, text, options, words, at_once):
    (tmp_path / "a.csv").write_text(text)
    recipe = Recipe(**options)
    readings, fault, said = followed(text, recipe, at_once)
    whole = logs.read(tmp_path / "a.csv", **recipe.reading())
    timed = np.flatnonzero(np.isfinite(readings[:, 0]))
    np.testing.assert_array_equal(timed, whole.row)
    np.testing.assert_array_equal(readings[timed], np.column_stack([whole.time_s, whole.measurement]))
    assert fault is None
    assert words in " ".join(said)


@pytest.mark.parametrize(
    ("row", "sentence"),
    [
        ("3,1000", "a.csv: line 6 has 2 cells where the header has 4. Complete the row, or delete it."),
        ("3,1000,1,1,1", "a.csv: line 6 has 5 cells where the header has 4."),
        ("3,far,0.1,0.2", 'a.csv: line 6: the range is "far", which is no number; expected a number of m.'),
        ("1717156785000,1,1,1", "a.csv: line 6: the time 1717156785000 s is not that of a flight; state another unit"),
        ("inf,1,1,1", "a.csv: line 6: the time inf s is not that of a flight"),
        ("elevation_rad,time_s,range_m,azimuth_rad", 'a.csv: line 6: the time is "elevation_rad", which is no number'),
    ],
)
def test_a_bad_row_is_named_and_the_rows_before_it_count(row, sentence):
    readings, fault, _ = followed(f"{HEADER}{ROWS}# note\n{row}\n{LATER}", at_once=100)
    assert readings[:, 0].tolist() == [0, 1, 2]
    assert sentence in str(fault)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("JD,range_m\n2460462.5,1000\n2460462.6,1000\n", 'the times in column "JD" look like Julian date'),
        ("time,range_m\n1717156785.5e3,1\n", "not that of a flight; state another unit, such as --units time=ms"),
        ("tod,range_m\n43200000,1\n", 'the times in column "tod" look like numbers in ms, by their size'),
        ("Date,Time,R\n2024-05-31,12:00:00,1\n", 'one column of numbers in one unit for each quantity, not "Date + T'),
        ("time_s,range_m,az_dms\n0,1000,12.3045\n", "Name another with --columns azimuth=NAME, or filter the log"),
        ("when,dist\n0,1000\n1,1001\n", "a.csv: no time column"),
        ("0,1000,0.1,0.2\n", "there is no line of column names. Say which column is which by their numbers"),
        (HEADER, "no row came after the line of names, so nothing is written."),
        ("", "a.csv: there is no line; expected a line of names and rows."),
        ("hello\n" * 30, "none of its first 20 lines looks like a row of a log; expected a line of names"),
    ],
)
def test_a_table_that_is_not_understood_is_refused(text, sentence):
    with pytest.raises(InputError) as error:
        raise followed(text, at_once=1)[1] or AssertionError("it was understood")
    assert sentence in str(error.value)


def test_units_that_nobody_stated_are_said_once_and_judged_by_the_first_rows():
    log = simulate("manoeuvre", seed=5, duration_s=15.0, dt_s=0.1).log
    columns = np.column_stack([log.time_s * 1e3, log.measurement[:, 0], np.degrees(log.measurement[:, 1:])])
    text = "t,R,A,E\n" + "".join(",".join(map(repr, row)) + "\n" for row in columns.tolist())
    _, fault, said = followed(text)
    assumed, judged = said
    assert fault is None
    assert 'are taken to be: "t" in s, "R" in m, "A" in rad, "E" in rad; state others with --units' in assumed
    assert "such as --units time=ms,range=km,azimuth=deg,elevation=deg." in assumed
    assert "the first 100 rows look like other units than those assumed: if so, say --units time=ms," in judged
    assert "azimuth=deg,elevation=deg." in judged
    stated = Recipe(units="time=ms,range=m,azimuth=deg,elevation=deg")
    assert followed(text, stated)[2] == []


@pytest.mark.parametrize("line", ["", "# note", "# " + "x" * 100_000])
def test_a_head_that_does_not_end_is_refused_before_it_fills_the_memory(line):
    reader = Reader("a.csv", Recipe(), print)
    blocks = (Block(number + 1, [line] * 10) for number in range(0, 20_000, 10))
    with pytest.raises(InputError, match=r"none of its first \d+ lines looks like a row of a log"):
        list(map(reader.read, blocks))
    assert sum(map(len, reader._head)) < 5_000_000


def test_a_long_head_may_have_a_table_below_it():
    readings, fault, _ = followed("# note\n" * 1900 + HEADER + ROWS, at_once=1000)
    assert (len(readings), fault) == (3, None)


@pytest.mark.parametrize(
    ("name", "options", "expected"),
    [
        ("range_rate_mps", {}, [-30.0, np.nan]),
        ("Doppler (km/h)", {}, [-30 / 3.6, np.nan]),
        ("closing_speed_mps", {}, [30.0, np.nan]),
        ("RR", {"columns": "range_rate=RR", "units": "range_rate=kt"}, [-30 * 1852 / 3600, np.nan]),
        ("remark", {}, [np.nan, np.nan]),
    ],
)
def test_range_rates_are_read_as_in_a_complete_log(tmp_path, name, options, expected):
    text = f"time_s,range_m,azimuth_rad,elevation_rad,{name}\n0,1000,0.1,0.2,-30\n1,970,0.1,0.2,\n"
    recipe = Recipe(**options)
    readings, _, _ = followed_with_rates(text, recipe)
    np.testing.assert_allclose(readings[:, 4], expected)
    (tmp_path / "a.csv").write_text(text)
    whole = logs.read(tmp_path / "a.csv", **recipe.reading())
    if whole.range_rate is not None:
        np.testing.assert_allclose(whole.range_rate, expected)


@pytest.mark.parametrize(
    "stamp",
    ["2026-06-14T23:59:{:02d}.500", "14.06.2026 23:59:{:02d}.500", "23:59:{:02d}.500", "2026-06-14 23:59:{:02d},500Z"],
)
@pytest.mark.parametrize("at_once", [1, 2, 100])
def test_moments_are_those_of_the_complete_log(tmp_path, stamp, at_once):
    stamps = [stamp.format(57 + k) for k in range(3)]
    stamps += [each.replace("23:59:57", "00:00:01").replace("14", "15", 1) for each in stamps[:1]]
    text = "Time;R;A;E\n" + "".join(f"{each};{1000 + k};0.1;0.2\n" for k, each in enumerate(stamps))
    (tmp_path / "a.csv").write_text(text)
    complete = logs.read(tmp_path / "a.csv")
    readings, fault, _ = followed(text, at_once=at_once)
    assert fault is None
    np.testing.assert_array_equal(readings[:, 0], complete.time_s)


def test_a_cell_that_is_no_moment_like_the_others_is_a_fault():
    readings, fault, _ = followed("Time;R\n14.06.2026 15:32:10.000;1000\n14.06.2026 25:32:11;1010\n")
    assert len(readings) == 1
    assert "line 3: the time is" in str(fault)


@pytest.mark.parametrize(
    ("name", "recipe", "barometric"),
    [
        ("FL", Recipe(), True),
        ("height_m", Recipe(station=Station("north"), settings=FilterSettings(site=(47.0, 8.0, 400.0))), False),
        ("alt_ft", Recipe(columns="height=alt_ft"), True),
    ],
)
def test_heights_stand_for_elevations_with_the_range_of_their_row(name, recipe, barometric):
    text = f"time_s,range_m,azimuth_rad,{name}\n0,20000,0.1,100\n1,20000,0.1,\n2,,0.1,100\n3,10,0.1,100\n"
    readings, fault, said = followed(text, recipe)
    unit = {"FL": 30.48, "height_m": 1.0, "alt_ft": 0.3048}[name]
    own = 400.0 if recipe.settings.site else 0.0
    assert fault is None
    sine = (100 * unit - own) / 20000 - 20000 / (2 * 6371e3)  # of a height far smaller than the earth
    np.testing.assert_allclose(readings[0, 3], np.arcsin(sine), rtol=1e-3)
    assert np.isnan(readings[1:, 3]).all()
    assert any(f'"{name}" in' in each and "stands for the elevation" in each for each in said)
    reader = Reader("a.csv", recipe, said.append)
    reader.read(Block(1, text.splitlines()))
    assert reader.beside.barometric is barometric


def test_an_elevation_or_a_height_by_the_user_leaves_heights_alone():
    rows = "0,20000,0.1,0.2,100\n1,20000,0.1,0.2,100\n"
    readings, _, _ = followed(f"time_s,range_m,azimuth_rad,elevation_rad,FL\n{rows}")
    np.testing.assert_array_equal(readings[:, 3], 0.2)
    specified = Recipe(settings=FilterSettings(height=(5000.0, 100.0)))
    readings, _, _ = followed("time_s,range_m,azimuth_rad,FL\n0,20000,0.1,100\n", specified)
    assert np.isnan(readings[:, 3]).all()
