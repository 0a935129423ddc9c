"""`ftproc filter --follow`: options, row numbers, and a whole output whatever ends the run."""

from __future__ import annotations

import io
import json
import signal
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ftproc.live import sources
from ftproc.live.outputs import page
from ftproc.live.outputs import rows as growing_rows
from tests.simulated import simulate

HEADER = "time_s,range_m,azimuth_rad,elevation_rad"


@pytest.fixture(scope="module")
def rows() -> list[str]:
    log = simulate("manoeuvre", seed=1, duration_s=10.0, dt_s=0.1).log
    return [",".join(map(repr, (t, *z))) for t, z in zip(log.time_s.tolist(), log.measurement.tolist(), strict=True)]


def text(*lines: str) -> str:
    return "".join(f"{line}\n" for line in lines)


def table(csv: str) -> pd.DataFrame:
    return pd.read_csv(io.StringIO(csv))


@pytest.fixture
def ends(monkeypatch):
    """ends(signal) -> a file has no more lines: this signal comes when they have been read."""

    def by(number: int) -> None:
        monkeypatch.setattr(sources.time, "sleep", lambda _seconds: signal.raise_signal(number))

    return by


def test_zenith_angles_are_known_by_the_name_of_their_column(run, here, rows):
    parts = (row.rpartition(",") for row in rows)
    zenith = text(HEADER.replace("elevation", "zenith"), *(f"{r},{np.pi / 2 - float(e)}" for r, _, e in parts))
    followed = run("filter", "-", "--follow", stdin=zenith)
    assert followed.code == 0
    assert "readings: elevation from zenith angles" in followed.err
    Path("a.csv").write_text(zenith)
    assert run("filter", "a.csv", "--editing", "live", "--summary", "none", "-o", "-").out == followed.out
    assert table(followed.out)["elevation_rad"].mean() < 1


@pytest.mark.parametrize("lag", [pytest.param("0", marks=pytest.mark.slow), "1"])
def test_range_rates_are_used_as_of_a_complete_log(run, here, lag):
    flight = simulate("manoeuvre", seed=1, duration_s=30.0, dt_s=0.1)
    slant = np.sqrt((flight.truth.position_m**2).sum(1))
    rate = (flight.truth.position_m * flight.truth.velocity_mps).sum(1) / slant
    rate += 0.3 * np.random.default_rng(0).standard_normal(len(rate))
    rate[200] += 80.0
    pairs = zip(flight.log.time_s.tolist(), flight.log.measurement.tolist(), rate.tolist(), strict=True)
    log = text(f"{HEADER},range_rate_mps", *(",".join(map(repr, (t, *z, r))) for t, z, r in pairs))
    followed = run("filter", "-", "--follow", "--lag", lag, stdin=log)
    assert followed.code == 0
    Path("a.csv").write_text(log)
    whole = run("filter", "a.csv", "--editing", "live", "--lag", lag, "--summary", "none", "-o", "-")
    pd.testing.assert_frame_equal(table(followed.out), table(whole.out))
    found = table(followed.out)
    assert found.outlier_range_rate[200] == 1
    assert found.sigma_range_rate_mps[250:].median() < 0.3


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--where", "q=1"], "--where is not for --follow, which reads every row. Let only the rows that count"),
        (["--keep-columns"], "--keep-columns is not for --follow, which copies no other columns. Leave it out, or"),
        (["--smooth"], "--smooth is not for --follow, which knows no later rows."),
        (["--report", "a.pdf"], "--report a.pdf: with --follow it is one page that opens in a browser; end its name"),
        (["--model", "m.safetensors"], "--model is not for --follow, which corrects with the packaged network."),
        (["--jobs", "2"], "--jobs is not for --follow, which runs in one process."),
        (["--scheduler", "tcp://10.0.0.1:8786"], "--scheduler is not for --follow, which runs in one process."),
        (["--summary", "json"], "--summary is not for --follow, which has no summary but the number of rows."),
        (["--editing", "two-pass"], "--editing two-pass is not for --follow, which decides on each row as it comes."),
        (["--editing", "none"], "--editing none is not for --follow"),
        (["--set", "window=6"], "ga-bpnn-ukf has no parameter"),
        (["--ecef"], "--ecef needs the station: give --site LAT,LON,HEIGHT"),
        (["-o", "a.kml"], "a.kml: a .kml map needs the station"),
    ],
)
def test_options_that_do_nothing_are_refused(run, here, rows, options, sentence):
    result = run("filter", "-", "--follow", *options, stdin=text(HEADER, *rows))
    assert (result.code, result.out) == (2, "")
    assert sentence in result.err
    assert not list(here.iterdir())


def test_what_a_station_file_asks_for_in_vain_is_said(run, here, rows):
    Path("a.toml").write_text("[filter]\nkeep_columns = true\nediting = 'two-pass'\n")
    result = run("filter", "-", "--follow", "--config", "a.toml", "--summary", "none", stdin=text(HEADER, *rows))
    assert result.code == 0
    assert result.err.startswith("ftproc: --follow copies no other columns of the log;")


def test_other_kinds_of_output_are_refused_before_the_log_is_read(run, here):
    result = run("filter", "-", "--follow", "-o", "a.xyz", stdin="")
    assert result.code == 1
    assert "a.xyz: not a kind of file that can be written" in result.err


def test_places_on_the_earth_are_those_of_the_complete_log(run, here, rows):
    pytest.importorskip("pymap3d")
    Path("a.csv").write_text(text(HEADER, *rows))
    options = ("--site", "48,11,600", "--ecef", "--azimuth-from", "north", "--target", "none", "--summary", "none")
    followed = run("filter", "-", "--follow", *options, stdin=text(HEADER, *rows))
    whole = run("filter", "a.csv", "--editing", "live", "-o", "-", *options)
    assert (followed.code, followed.err) == (0, "")
    assert followed.out == whole.out
    assert {"lat_deg", "x_ecef_m"} <= set(table(followed.out).columns)


def test_rows_are_numbered_as_in_the_log(run, here, rows):
    lines = ["# note", HEADER, *rows[:9], ",1000,,", *rows[9:40], ",,,", "# note", "", *rows[40:50], HEADER, *rows[50:]]
    result = run("filter", "-", "--follow", stdin=text(*lines))
    Path("a.csv").write_text(text(*lines))
    whole = table(run("filter", "a.csv", "-o", "-", "--summary", "none").out)
    assert result.code == 0
    assert "2 rows have no time, and are left out" in result.err
    assert table(result.out)["row"].tolist() == whole["row"].tolist()
    assert whole["row"].tolist()[-1] == len(rows) + 1


@pytest.mark.parametrize("output", ["out.csv", "out.parquet", "out.feather", "out.csv.gz"])
def test_a_bad_line_ends_the_run_with_a_whole_output(run, here, rows, output):
    lines = text(HEADER, *rows[:20], "2.0,abc,0.1,0.2", *rows[20:])
    result = run("filter", "-", "--follow", "--lag", "1", "-o", output, stdin=lines)
    assert result.code == 1
    assert 'line 22: the range is "abc", which is no number' in result.err
    found = pd.read_parquet(output) if output == "out.parquet" else None
    found = pd.read_feather(output) if output == "out.feather" else found
    found = pd.read_csv(output) if found is None else found
    assert found["row"].tolist() == list(range(20))
    if "csv" in output:
        assert json.loads(Path("out.json").read_text())["summary"]["rows"] == 20


def test_a_bad_line_comes_after_what_was_printed(run, here, rows):
    result = run("filter", "-", "--follow", "--lag", "1", stdin=text(HEADER, *rows[:20], "2.0,1000"))
    assert result.code == 1
    assert "line 22 has 2 cells where the header has 4" in result.err
    assert table(result.out)["row"].tolist() == list(range(20))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_the_run_with_a_whole_output(run, here, rows, ends, number):
    Path("a.csv").write_text(text(HEADER, *rows))
    ends(number)
    result = run("filter", "a.csv", "--follow", "--lag", "1", "-o", "out.csv")
    assert result.code == 0
    assert pd.read_csv("out.csv")["row"].tolist() == list(range(len(rows)))
    assert json.loads(Path("out.json").read_text())["summary"]["rows"] == len(rows)


@pytest.mark.parametrize("output", [(), ("-o", "out.csv")])
@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (HEADER, "a.csv: no row came after the line of names, so nothing is written."),
        (text(HEADER, ",1000,0.1,0.2"), "a.csv: no row has a time, so nothing is written; fill the times in."),
        ("", "a.csv: there is no line; expected a line of names and rows."),
    ],
)
def test_a_log_without_rows_is_said_to_have_none(run, here, ends, output, content, sentence):
    Path("a.csv").write_text(text(content))
    ends(signal.SIGINT)
    result = run("filter", "a.csv", "--follow", *output)
    assert (result.code, result.out) == (1, "")
    assert sentence in result.err
    assert [path.name for path in here.iterdir()] == ["a.csv"]


def test_a_log_that_is_not_there_is_named(run, here):
    result = run("filter", "none.csv", "--follow")
    assert (result.code, result.err) == (1, "ftproc: none.csv: there is no such file.\n")


def test_a_sidecar_never_replaces_a_file_of_somebody_else(run, here, rows):
    Path("out.json").write_text("[1, 2]")
    result = run("filter", "-", "--follow", "-o", "out.csv", stdin=text(HEADER, *rows))
    assert result.code == 1
    assert "out.json" in result.err
    assert Path("out.json").read_text() == "[1, 2]"
    assert not Path("out.csv").exists()


def test_the_log_may_be_the_value_of_follow(run, here, rows):
    Path("a.csv").write_text(text(HEADER, *rows))
    whole = run("filter", "a.csv", "--editing", "live", "-o", "-", "--summary", "none")
    followed = run("filter", "--follow", "-", "--summary", "none", stdin=text(HEADER, *rows))
    assert (followed.code, followed.out) == (0, whole.out)
    result = run("filter", "a.csv", "--follow", "b.csv")
    assert (result.code, result.out) == (2, "")
    assert "--follow reads one log; name a file that grows, udp://HOST:PORT, tcp://HOST:PORT, or - for" in result.err


@pytest.mark.parametrize("option", [("--state", "s"), ("--coast", "2"), ("--heartbeat", "2")])
def test_what_only_a_followed_log_has_is_refused_for_others(run, here, rows, option):
    Path("a.csv").write_text(text(HEADER, *rows))
    result = run("filter", "a.csv", *option)
    assert result.code == 2
    assert "do nothing without --follow" in result.err


@pytest.mark.parametrize("option", ["-o", "--state", "--report"])
def test_no_output_is_the_log(run, here, rows, option):
    Path("a.csv").write_text(text(HEADER, *rows))
    Path("a.html").symlink_to("a.csv")
    result = run("filter", "a.csv", "--follow", option, "a.html" if option == "--report" else "a.csv")
    assert result.code in (1, 2)
    assert "never overwritten" in result.err
    assert Path("a.csv").read_text() == text(HEADER, *rows)


def grown(monkeypatch, lines, between):
    """A file that gets these lines one by one, with something between; then the program is stopped."""
    path, left = Path("a.csv"), list(lines)
    path.write_text("")

    def nap(_seconds):
        if not left:
            signal.raise_signal(signal.SIGTERM)
        else:
            with path.open("a") as file:
                file.write(f"{left.pop(0)}\n")
            between(len(left))

    monkeypatch.setattr(sources.time, "sleep", nap)


@pytest.mark.parametrize("output", ["out.csv", "out.jsonl", "out.parquet", "out.csv.gz"])
def test_a_file_is_seen_to_grow_and_is_whole_at_any_time(run, here, rows, monkeypatch, output):
    seen = []
    monkeypatch.setattr(growing_rows, "EVERY_S", 0.0)

    def look(_left):
        if Path(output).exists():
            found = read(output)
            assert found["row"].tolist() == list(range(len(found)))
            seen.append(len(found))

    grown(monkeypatch, [HEADER, *rows], look)
    assert run("filter", "--follow", "a.csv", "-o", output).code == 0
    assert len(set(seen)) > 50
    assert max(seen) >= len(rows) - 2
    assert read(output)["row"].tolist() == list(range(len(rows)))
    metadata = Path("out.json")
    if output != "out.parquet":
        assert json.loads(metadata.read_text())["summary"]["rows"] == len(rows)


def read(output):
    kind = output.partition(".")[2]
    return pd.read_parquet(output) if kind == "parquet" else pd.read_json(output, lines=True) if kind == "jsonl" else (
        pd.read_csv(output)
    )  # fmt: skip


def test_a_page_follows_and_stands_still_at_the_end(run, here, rows, monkeypatch):
    pytest.importorskip("plotly")
    monkeypatch.setattr(page, "EVERY_S", 0.0)
    pages = set()

    def look(left):
        if left == 5:
            while not Path("live.html").exists():
                time.sleep(0.05)
        if Path("live.html").exists():
            pages.add(Path("live.html").read_text("utf-8"))

    time_sleep = time.sleep
    grown(monkeypatch, [HEADER, *rows], look)
    nap = sources.time.sleep
    monkeypatch.setattr(sources.time, "sleep", lambda s: time_sleep(s) if s == 0.05 else nap(s))
    assert run("filter", "--follow", "a.csv", "-o", "out.csv", "--report", "live.html").code == 0
    assert pages
    assert all(text.endswith("</html>\n") and 'http-equiv="refresh"' in text for text in pages)
    last = Path("live.html").read_text("utf-8")
    assert last.endswith("</html>\n")
    assert 'http-equiv="refresh"' not in last


@pytest.mark.parametrize("form", ["csv", "jsonl"])
def test_a_heartbeat_is_a_line_that_is_no_row(run, here, rows, monkeypatch, form):
    grown(monkeypatch, [HEADER, *rows], lambda _left: None)
    result = run("filter", "a.csv", "--follow", form, "--heartbeat", "1e-9")
    lines = result.out.splitlines()
    if form == "csv":
        assert any(line.startswith("# heartbeat: utc ") for line in lines)
        assert len(pd.read_csv(io.StringIO(result.out), comment="#")) == len(rows)
    else:
        found = [json.loads(line) for line in lines]
        beats = [each["heartbeat"] for each in found if "heartbeat" in each]
        assert beats[-1]["rows"] > 50
        assert len(found) - len(beats) == len(rows)
