"""What the metadata say of how a trajectory came about, and `--again`."""

import hashlib
import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

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


def test_the_jerk_profile_has_a_place_of_its_own(run, flight):
    assert run("filter", flight, "-o", "a.csv").code == 0
    text = Path("a.json").read_text()
    found = json.loads(text)
    assert list(found)[-1] == "jerk_profile"
    assert len(found["jerk_profile"]["psd_m2ps5"]) == 1 or found["jerk_profile"]["knot_s"] > 0
    assert found["settings"]["jerk_psd_m2ps5"] is None
    assert '"psd_m2ps5": [ ' in text, "a list of numbers is one line"
