"""How a log is understood, as a user asks: --explain, --debug, --where, --target, and the first commands to try."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ftproc.files.reading import targets
from tests.files.zoo import animals, radars

ZOO = {animal.name: animal for animal in animals.all_animals()}
LINES = ["file", "columns", "clock", "readings", "doubtful"]

NO_HEIGHT = "--columns", "height=none"


@pytest.fixture
def tracks(here: Path) -> Path:
    return ZOO["two tracks"].write(here)


def explained(text: str) -> dict[str, str]:
    lines = [line.split(None, 1) for line in text.splitlines()[1:6]]
    return {line[0]: line[1] for line in lines}


def test_explain_says_in_five_lines_how_a_log_is_understood(run, here):
    log = ZOO["title and units"].write(here)
    done = run("filter", log, "--explain", "--azimuth-from", "north")
    assert (done.code, done.err) == (0, "")
    found = explained(done.out)
    assert list(found) == LINES
    assert "3 lines above the table, a row of units" in found["file"] or "2 lines above" in found["file"]
    assert 'range = "RANGE" in km (in its name)' in found["columns"]
    assert "azimuth clockwise from north" in found["readings"]
    assert done.out.splitlines()[6].split() == ["time_s", "range_m", "azimuth_rad", "elevation_rad"]
    assert float(done.out.splitlines()[7].split()[1]) == pytest.approx(animals.F.r[0])
    assert list(here.iterdir()) == [log], "nothing is filtered"


def test_explain_as_json_has_the_doubts_with_their_options(run, here):
    log = ZOO["bare degrees"].write(here)
    found = json.loads(run("filter", log, "--explain", "--summary", "json").out)
    assert found["columns"]["azimuth"] == {"column": "AZ", "unit": "deg", "unit_from": "assumed", "why": "its name"}
    assert any("--azimuth-from north" in doubt for doubt in found["doubts"])
    assert any("--units azimuth=grad" in doubt for doubt in found["doubts"]) is False, "it turns at 360"
    assert len(found["first_rows"]) == 3
    assert found["first_rows"][0]["elevation_rad"] == pytest.approx(animals.F.e[0])


def test_explain_of_what_is_refused(run, here, tracks):
    done = run("filter", tracks, "none.csv", "--explain")
    assert done.code == 1
    assert 'column "track" tells 2 targets apart' in done.err
    assert "none.csv: there is no such file" in done.err


def test_the_same_lines_stand_in_debug_and_in_the_metadata(run, here):
    log = ZOO["leap second"].write(here)
    done = run("filter", log, "--debug", "-o", "out.csv")
    assert done.code == 0
    assert list(explained(done.err[done.err.index("understood as") :])) == LINES
    understood = json.loads(Path("out.json").read_text())["understood"]
    assert understood["clock"].startswith("year-month-day and time of day")
    assert understood["epoch"] == "2016-12-31T00:00:00Z"


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_utc_stands_beside_the_seconds_where_the_clock_is_known(run, here, kind):
    log = ZOO["GPS week and seconds"].write(here)
    assert run("filter", log, "-o", f"out.{kind}").code == 0
    frame = pd.read_csv("out.csv", parse_dates=["time_utc"]) if kind == "csv" else pd.read_parquet("out.parquet")
    moments = frame["time_utc"].dt.tz_convert(None).to_numpy()
    assert (moments == animals.F.moments()).all()
    plain = ZOO["tabs"].write(here)
    assert run("filter", plain, "-o", "plain.csv").code == 0
    assert "time_utc" not in Path("plain.csv").read_text()


def test_a_target_and_each_target(run, here, tracks):
    assert "--target track=12" in run("filter", tracks).err
    one = run("filter", tracks, "--target", "track=7", "-o", "one.csv")
    assert (one.code, one.err) == (0, "")
    assert "120 of 240 rows are left out, which do not meet track=7" in one.out
    rows = pd.read_csv("one.csv")["row"].to_numpy()
    assert (pd.read_csv(tracks)["track"].to_numpy()[rows] == 7).all()
    each = run("filter", tracks, "--target", "track", "-o", "each", "--summary", "json")
    assert each.code == 0
    assert sorted(path.name for path in Path("each").glob("*.csv")) == ["a.12.trajectory.csv", "a.7.trajectory.csv"]
    np.testing.assert_array_equal(pd.read_csv("each/a.7.trajectory.csv")["x_m"], pd.read_csv("one.csv")["x_m"])
    assert [found["target"] for found in json.loads(each.out)] == ["track=7", "track=12"]
    assert run("filter", tracks, "--target", "none", "-o", "all.csv").code == 0
    assert 'did you mean "track"?' in run("filter", tracks, "--target", "trak", "-o", "each").err
    assert "name a directory" in run("filter", tracks, "--target", "track", "-o", "-").err


def test_targets_in_one_table_name_themselves_in_a_column(run, here, tracks):
    assert run("filter", tracks, "--target", "track", "-o", "each/").code == 0
    for name in ("all.csv", "all.parquet"):
        assert run("filter", tracks, "--target", "track", "-o", name, "--jobs", "2").code == 0
    table = pd.read_csv("all.csv")
    assert list(table.columns[:2]) == ["target", "row"]
    assert table["target"].drop_duplicates().tolist() == [7, 12]  # in the order of the log
    for target in (7, 12):
        alone = pd.read_csv(f"each/a.{target}.trajectory.csv")
        pd.testing.assert_frame_equal(
            table[table["target"] == target].drop(columns="target").reset_index(drop=True), alone, check_dtype=False
        )
    again = pd.read_parquet("all.parquet")
    assert again["target"].tolist() == table["target"].astype(str).tolist()
    np.testing.assert_array_equal(again["x_m"], table["x_m"])
    metadata = json.loads(Path("all.json").read_text())
    assert list(metadata["targets"]) == ["7", "12"]
    for name in ("all.csv", "all.parquet"):
        assert "the trajectories of 2 targets (7, 12)" in run("score", name, "--truth", "each/a.7.trajectory.csv").err
    assert metadata["targets"]["7"]["summary"]["rows"] == 120
    assert sorted(path.name for path in Path().iterdir()) == ["a.csv", "all.csv", "all.json", "all.parquet", "each"]


def test_a_target_that_fails_leaves_the_others_in_the_table(run, here, tracks):
    with Path(tracks).open("a") as log:
        log.write("1.0,,,,3\n")
    done = run("filter", tracks, "--target", "track", "-o", "all.csv")
    assert done.code == 1
    assert pd.read_csv("all.csv")["target"].drop_duplicates().tolist() == [7, 12]


def test_rows_are_left_out_by_conditions_and_counted(run, here):
    text = "time_s,range_m,quality,mode\n" + "".join(f"{k},{1000 + k},{k % 3},{'ab'[k % 2]}\n" for k in range(60))
    Path("q.csv").write_text(text)
    done = run("filter", "q.csv", "--where", "quality>=1", "--where", "mode=a", "--explain", "--summary", "json")
    found = json.loads(done.out)
    assert any(
        "40 of 60 rows are left out, which do not meet quality>=1 and mode=a" in doubt for doubt in found["doubts"]
    )
    assert [row["time_s"] for row in found["first_rows"]] == [2, 4, 8]
    assert "no row meets quality>5" in run("filter", "q.csv", "--where", "quality>5").err
    assert "compares words by size" in run("filter", "q.csv", "--where", "mode>a").err
    assert 'there is no column "qualty"' in run("filter", "q.csv", "--where", "qualty>1").err
    assert run("filter", "q.csv", "--where", "quality").code == 2


def test_widths_from_the_option_and_from_a_station_file(run, here):
    log = ZOO["columns without blanks between"].write(here)
    columns = ("--columns", "time=1,range=2,azimuth=3,elevation=4", "--explain")
    assert run("filter", log, *columns).code == 1
    by_option = run("filter", log, "--widths", "6,9,9,9", *columns)
    Path("s.toml").write_text("[file]\nwidths = [6, 9, 9, 9]\n")
    by_file = run("filter", log, "--config", "s.toml", *columns)
    assert by_option.code == by_file.code == 0
    assert by_option.out == by_file.out
    assert 'widths = "6,9,9,9"' in run("filter", "--widths", "6,9,9,9", "--write-config").out


def test_without_a_log_three_commands_are_shown_and_they_work(run, here):
    done = run("filter")
    assert (done.code, done.out) == (2, "")
    assert "Name at least one log." in done.err
    commands = [line.split()[1:] for line in done.err.splitlines()[1:]]
    assert len(commands) == 3
    for command in commands:
        assert run(*command).code == 0, command
    Path("real.log.csv").write_text("t,R\n0,1\n")
    Path("flight.csv").unlink()
    assert "ftproc filter real.log.csv --explain" in run("filter").err


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("fligth.csv", None, 'there is no such file; did you mean "flight.csv"?'),
        ("s.toml", "[filter]", "this is a station file: ftproc filter LOG --config s.toml."),
        ("m.safetensors", "x", "this is a correction model: ftproc filter LOG --model m.safetensors."),
        ("t.csv", "time_s,x_m,y_m,z_m\n0,1,2,3\n", "ftproc score TRAJECTORY --truth t.csv"),
    ],
)
def test_a_wrong_file_gets_the_right_command(run, flight, name, content, sentence):
    if content is not None:
        Path(name).write_text(content)
    assert sentence in run("filter", name).err


def test_a_trajectory_is_no_log(run, flight):
    assert run("filter", "flight.csv").code == 0
    assert "this is a trajectory that ftproc wrote, no log: ftproc score" in run("filter", "flight.trajectory.csv").err


@pytest.mark.parametrize(
    ("head", "stamp", "stands"),
    [
        ("Time,", "2026-06-14T15:32:{:02d},", False),
        ("Time,", "2026-06-14T15:32:{:02d}Z,", True),
        ("Time (UTC),", "2026-06-14 15:32:{:02d},", True),
        ("Date,Clock,", "14.06.2026,15:32:{:02d},", False),
        ("Date,UTC,", "14.06.2026,15:32:{:02d},", True),
    ],
)
def test_utc_stands_there_only_where_the_zone_is_known(run, here, head, stamp, stands):
    rows = "".join(f"{stamp.format(k)}{1000 + 9 * k},{0.1 + 0.01 * k},0.2\n" for k in range(40))
    Path("log.csv").write_text(f"{head}range_m,azimuth_rad,elevation_rad\n{rows}")
    assert run("filter", "log.csv", "-o", "out.csv").code == 0
    assert ("time_utc" in Path("out.csv").read_text()) == stands


def plots(name: str, *wanted: dict[str, int]) -> None:
    """ASTERIX 048, the plots of each aircraft or radar behind those of the one before."""
    found = [radars.block(48, radars.plot_048(*row, **each)) for each in wanted for row in radars.readings()]
    Path(name).write_bytes(b"".join(found))


def test_the_targets_that_a_standard_tells_apart_get_a_trajectory_each(run, here):
    plots("a.ast", {"icao": 0x3C660C}, {"icao": 0x4BAACD})
    said = 'holds 2 targets by column "I220.ACAddr" (3C660C, 4BAACD): a trajectory of each. '
    done = run("filter", "a.ast", *NO_HEIGHT, "-o", "all.csv")
    assert done.code == 0
    assert f"{said}--target I220.ACAddr=3C660C makes one." in done.err
    assert pd.read_csv("all.csv")["target"].drop_duplicates().tolist() == ["3C660C", "4BAACD"]
    for one in ("--target", "--where"):
        done = run("filter", "a.ast", *NO_HEIGHT, one, "I220.ACAddr=4BAACD", "-o", "one.csv")
        assert (done.code, done.err) == (0, "")
    shown = run("filter", "a.ast", *NO_HEIGHT, "--explain")
    assert said in shown.err
    assert "do not meet I220.ACAddr=3C660C" in shown.out


def test_stations_that_measure_one_after_the_other_get_a_trajectory_each(run, here):
    plots("a.ast", {"sic": 1}, {"sic": 2})
    done = run("filter", "a.ast", *NO_HEIGHT, "-o", "each/")
    assert done.code == 0
    assert 'holds 2 stations by column "I010.SIC" (1, 2): a trajectory of each' in done.err
    assert "for one of all, ftproc filter --fuse --write-config a.ast prints a range file" in done.err
    assert len(list(Path("each").glob("*.csv"))) == 2


def test_stations_that_measure_in_turns_are_asked_about(run, here):
    rows = list(radars.readings())
    two = [radars.block(48, radars.plot_048(*row, sic=sic)) for row in rows for sic in (1, 2)]
    Path("a.ast").write_bytes(b"".join(two))
    assert "--where I010.SIC=NAME" in run("filter", "a.ast", *NO_HEIGHT, "-o", "all.csv").err


def test_a_log_that_cannot_be_looked_into_fails_by_itself(run, here, monkeypatch):
    plots("a.ast", {"icao": 0x3C660C}, {"icao": 0x4BAACD})
    Path("b.csv").write_text("time_s,range_m\n" + "".join(f"{k},{1000 + k}\n" for k in range(60)))
    monkeypatch.setattr(targets, "targets", lambda *_: 1 / 0)
    done = run("filter", "a.ast", "b.csv", *NO_HEIGHT, "-o", "each/")
    assert done.code == 1
    assert "a.ast: it holds 2 targets" in done.err
    assert Path("each/b.trajectory.csv").exists()


def test_a_name_of_a_target_is_printed_without_its_control_characters(run, here):
    rows = [f"{k};201;{10 + k / 100:.6f};{k};5307;;\x07{k % 2}" for k in range(60)]
    Path("a.csv").write_text("\n".join(["TIME;SIC;RHO;THETA;MODE 3/A;FL;TA", *rows]))
    said = run("filter", "a.csv", "-o", "each/").err
    assert 'holds 2 targets by column "TA"' in said
    assert "\x07" not in said


@pytest.mark.parametrize("beside", ['{"targets": 3}', '{"targets": ["a"]}'])
def test_what_another_program_wrote_beside_a_trajectory_is_no_table_of_targets(run, here, beside):
    Path("a.csv").write_text("time_s,x_m,y_m,z_m\n" + "".join(f"{k},{k},0,0\n" for k in range(9)))
    Path("a.json").write_text(beside)
    assert run("score", "a.csv", "--truth", "a.csv").code == 0
