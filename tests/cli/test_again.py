"""What the metadata say of how a trajectory came about, and `--again`."""

import hashlib
import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from ftproc import __version__
from ftproc.quality import provenance


def metadata(path: str) -> dict:
    return json.loads(pq.read_schema(path).metadata[b"ftproc"])


def test_log_command_options_and_versions_are_in_the_metadata(run, flight):
    result = run("filter", flight, "--jerk", "3", "--where", "time_s<50", "--no-smooth", "-o", "a.parquet", "--jobs", 1)
    assert result.code == 0, result.err
    found = metadata("a.parquet")
    assert found["log_sha256"] == hashlib.sha256(Path(flight).read_bytes()).hexdigest()
    assert found["command"] == f"ftproc filter {flight} --jerk 3 --where 'time_s<50' --no-smooth"
    assert found["options"] == {"jerk": 3.0, "smooth": False, "where": ["time_s<50"]}
    assert found["versions"].keys() == {"python", "numpy", "pyarrow"}
    assert found["date_utc"] == provenance.date_utc()


def test_a_station_file_is_in_the_options(run, flight):
    Path("radar.toml").write_text("[azimuth]\nbias_mrad = 2\n[filter]\nsmooth = true\n")
    assert run("filter", flight, "--config", "radar.toml", "--gate", 5, "-o", "a.parquet").code == 0
    found = metadata("a.parquet")
    assert found["options"] == {"bias": [0.0, 0.002, 0.0], "gate": 5.0, "smooth": True}
    assert found["command"] == f"ftproc filter {flight} --config radar.toml --gate 5"


def test_where_things_go_changes_no_byte(run, flight):
    assert run("filter", flight, "-o", "a.parquet").code == 0
    assert run("filter", flight, "-o", "b.parquet", "--summary", "none", "--debug").code == 0
    assert Path("a.parquet").read_bytes() == Path("b.parquet").read_bytes()


@pytest.mark.parametrize(("stated", "date"), [("0", "1970-01-01"), ("1700000000", "2023-11-14"), ("x", None)])
def test_the_date_of_reproducible_builds(monkeypatch, stated, date):
    today = provenance.date_utc()
    monkeypatch.setenv("SOURCE_DATE_EPOCH", stated)
    assert provenance.date_utc() == (date or today)


def test_one_of_all_methods_is_made_again_alone(run, flight):
    assert run("filter", flight, "--method", "all", "-o", "d/").code == 0
    (name,) = (str(each) for each in Path("d").iterdir() if each.name.endswith(".ekf.trajectory.csv"))
    found = json.loads(Path(name).with_suffix(".json").read_text())
    assert found["command"] == f"ftproc filter {flight} --method ekf"
    assert run("filter", "--again", name, "-o", "e.csv").code == 0
    assert same(name, "e.csv")
    assert same(str(Path(name).with_suffix(".json")), "e.json")


def test_the_jerk_profile_has_a_place_of_its_own(run, flight):
    assert run("filter", flight, "-o", "a.csv").code == 0
    text = Path("a.json").read_text()
    found = json.loads(text)
    assert list(found)[-1] == "jerk_profile"
    assert len(found["jerk_profile"]["psd_m2ps5"]) == 1 or found["jerk_profile"]["knot_s"] > 0
    assert found["settings"]["jerk_psd_m2ps5"] is None
    assert '"psd_m2ps5": [ ' in text, "a list of numbers is one line"


def same(one: str, other: str) -> bool:
    return Path(one).read_bytes() == Path(other).read_bytes()


@pytest.mark.parametrize("run_before", ["a.csv", "a.json", "summary.json"])
def test_again_gives_the_same_bytes(run, flight, run_before, monkeypatch):
    """On another day too, from the trajectory, the JSON beside it, or the printed summary; beside the first run."""
    Path("radar.toml").write_text("[azimuth]\nbias_mrad = 2\n[filter]\nsmooth = true\n")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    first = run(
        "filter", flight, "--config", "radar.toml", "--noise", "auto,2e-4,auto", "-o", "a.csv", "--summary", "json"
    )
    assert first.code == 0, first.err
    Path("summary.json").write_text(first.out)
    monkeypatch.delenv("SOURCE_DATE_EPOCH")
    Path("radar.toml").unlink()  # what it said is in the metadata
    second = run("filter", "--again", run_before)
    assert second.code == 0, second.err
    output = f"{Path(flight).stem}.again.trajectory.csv"
    assert f"{output} is the same as a.csv, to the last byte" in second.err
    assert same("a.csv", output)
    assert same("a.json", output.replace(".csv", ".json"))


def test_again_with_decisions_needs_their_file_no_more(run, flight):
    Path("d.csv").write_text("component,from_row,to_row,use\nrange,3,5,bad\n")
    assert run("filter", flight, "--decisions", "d.csv", "-o", "a.parquet").code == 0
    found = metadata("a.parquet")["decisions"]
    assert found["sha256"] == hashlib.sha256(Path("d.csv").read_bytes()).hexdigest()
    assert found["lines"][0] | {"line": 2, "from_row": 3, "to_row": 5, "use": "bad"} == found["lines"][0]
    Path("d.csv").unlink()
    assert run("filter", "--again", "a.parquet", "-o", "b.parquet").code == 0
    assert same("a.parquet", "b.parquet")


def test_again_says_what_differs(run, flight, monkeypatch):
    """The version, the log, options that win, and the estimate."""
    assert run("filter", flight, "-o", "a.parquet").code == 0
    monkeypatch.setattr(provenance, "__version__", "9.9")
    second = run("filter", "--again", "a.parquet", "-o", "b.parquet")
    assert f"ftproc: version of ftproc: was {__version__}, is 9.9" in second.err
    assert "every number of the estimate is the same" in second.err
    log = Path(flight).read_text().splitlines()
    Path(flight).write_text("\n".join([*log[:-1], ""]))
    third = run("filter", "--again", "a.parquet", "--smooth", "-o", "c.parquet")
    assert third.code == 0, third.err
    assert "content of the log (SHA-256): was " in third.err
    assert "options: was none, is smooth True" in third.err
    assert f"command: was ftproc filter {flight}, is ftproc filter {flight} --smooth" in third.err
    assert "rows: were" in third.err


def test_again_overwrites_nothing_and_names_what_it_cannot_read(run, flight):
    assert run("filter", flight, "-o", "a.parquet").code == 0
    refused = run("filter", "--again", "a.parquet", "-o", "a.parquet")
    assert refused.code == 1
    assert "a.parquet" in refused.err
    Path("other.json").write_text('{"program": "ftproc"}')
    Path("bad.json").write_text("{")
    for name, sentence in (
        ("other.json", "does not say with which options it was made"),
        ("bad.json", "this is not JSON"),
        ("none.parquet", "no such file"),
    ):
        assert sentence in run("filter", "--again", name).err
    assert "give one of the two" in run("filter", "--again", "a.parquet", "--config", "x.toml").err
    Path(flight).unlink()
    assert "no such file" in run("filter", "--again", "a.parquet").err


def test_the_next_step_is_said_with_the_command_to_type(run, flight):
    """And in the JSON; the command does what is said."""
    result = run("filter", flight, "--noise", "0.01,1e-6,1e-6", "--jerk", "1e-4", "-o", "a.parquet")
    assert result.code == 0, result.err
    steps = metadata("a.parquet")["summary"]["trust"]["next_steps"]
    assert steps[0]["outcome"] == "consistent"
    lines = result.out.splitlines()
    k = next(k for k, line in enumerate(lines) if line.startswith("  next "))
    assert lines[k].split(None, 1)[1] == f"{steps[0]['advice']}: then it is consistent"
    assert lines[k + 1].strip() == steps[0]["command"]
    words = steps[0]["command"].split()
    assert words[:2] == ["ftproc", "filter"]
    assert "verdict    consistent" in run(*words[1:], "-o", "b.parquet").out


def test_scores_on_a_closed_standard_output_end(shell, flight):
    """An error that was raised from itself was looked at for ever."""
    assert shell(f"ftproc filter {flight} -o a.csv --summary none").code == 0
    result = shell("timeout 60 ftproc score a.csv >&-")
    assert (result.code, result.err.startswith("ftproc: standard output is closed")) == (1, True)
