"""Decisions by hand on the readings of several stations, and a fused run made again."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq

from ftproc.records import ACCEPTED, REJECTED


def stations(folder: Path) -> list[str]:
    return list(tomllib.loads((folder / "range.toml").read_text())["station"])


def test_stations_are_named_and_each_line_has_its_effect(folder, run):
    one, other = stations(folder)[:2]
    Path("d.csv").write_text(
        f"component,from_s,to_s,use,station\nazimuth,10,12,bad,{one}\nelevation,15,15.5,good,{other}\n"
    )
    result = run("filter", "--fuse", "range.toml", "--smooth", "--decisions", "d.csv", "--write-decisions", "e.csv",
                 "-o", "a.parquet")  # fmt: skip
    assert result.code == 0, result.err
    assert "by hand, d.csv: " in result.out
    table = pq.read_table(f"a.edited/{one}.parquet").to_pandas()
    inside = (table.time_s >= 10) & (table.time_s <= 12) & (table.outlier_azimuth != 3)
    assert inside.any()
    assert ((table.outlier_azimuth == REJECTED) == inside).all()
    second = pq.read_table(f"a.edited/{other}.parquet").to_pandas()
    assert (second.outlier_elevation == ACCEPTED).any()
    found = json.loads(pq.read_schema("a.parquet").metadata[b"ftproc"])
    assert [line["readings"] for line in found["decisions"]["lines"]] == [
        int(inside.sum()), int((second.outlier_elevation == ACCEPTED).sum()),
    ]  # fmt: skip
    assert found["decisions"]["lines"][0]["inside_gate"] > 0.8 * inside.sum(), "they are good"
    assert Path("e.csv").read_text().startswith("component,from_s,to_s,use,station,reason\nazimuth,10.0,12.0,bad,")
    again = run("filter", "--again", "a.parquet", "-o", "b.parquet")
    assert again.code == 0, again.err
    assert Path("a.parquet").read_bytes() == Path("b.parquet").read_bytes(), again.err
    wrong = run("filter", "--fuse", "range.toml", "--decisions", "e.csv", "--write-decisions", "e.csv")
    assert wrong.code != 0


def test_what_is_rejected_by_hand_is_not_used(folder, run):
    """However wrong it is."""
    one = stations(folder)[0]
    Path("d.csv").write_text(f"component,from_s,to_s,use,station\nall,10,12,bad,{one}\n")
    assert run("filter", "--fuse", "range.toml", "--decisions", "d.csv", "-o", "a.parquet").code == 0
    log = Path(tomllib.loads(Path("range.toml").read_text())["station"][one]["log"])
    table = pq.read_table(log).to_pandas() if log.suffix == ".parquet" else pd.read_csv(log)
    inside = table.time_s.between(10, 12)
    table.loc[inside, table.columns[2]] += 0.3
    table.to_parquet(log) if log.suffix == ".parquet" else table.to_csv(log, index=False)
    assert run("filter", "--fuse", "range.toml", "--decisions", "d.csv", "-o", "b.parquet").code == 0
    first, second = (pq.read_table(name).to_pandas() for name in ("a.parquet", "b.parquet"))
    np.testing.assert_array_equal(first.x_m, second.x_m)


def test_a_fused_run_that_is_not_consistent_says_what_to_do_next(folder, run):
    """First to smooth, then to decide: with the place, and a command that can be typed."""
    one = stations(folder)[0]
    log = Path(tomllib.loads(Path("range.toml").read_text())["station"][one]["log"])
    table = pq.read_table(log).to_pandas() if log.suffix == ".parquet" else pd.read_csv(log)
    table.loc[table.time_s.between(10, 30), table.columns[2]] += 0.3
    table.to_parquet(log) if log.suffix == ".parquet" else table.to_csv(log, index=False)
    other = pd.read_csv("theodolite3.csv")
    other[~other.time_s.between(6, 20)].to_csv("theodolite3.csv", index=False)
    result = run("filter", "--fuse", "range.toml", "-o", "a.parquet")
    found = json.loads(pq.read_schema("a.parquet").metadata[b"ftproc"])["summary"]
    assert found["trust"]["verdict"] != "consistent"
    steps = found["trust"]["next_steps"]
    assert [step["command"] for step in steps] == [
        "ftproc filter --fuse range.toml --smooth",
        "ftproc filter --fuse range.toml --write-decisions decisions.csv",
    ]
    longest = max(found["stretches"], key=lambda each: each["to_s"] - each["from_s"])
    assert steps[1]["place"].startswith(f"{longest['station']}, {longest['from_s']:.6g} to ")
    assert "  next " in result.out
