"""A file of several stations becomes a range file, and gives what a log of each gives."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest

HEAD = "CCSDS_TDM_VERS = 2.0\nCREATION_DATE = 2024-06-01T00:00:00\nORIGINATOR = X\n"
KEYWORDS = {"range_m": "RANGE", "azimuth_rad": "ANGLE_1", "elevation_rad": "ANGLE_2"}


def segment(name: str, log: pd.DataFrame, north: bool) -> str:
    epochs = np.datetime64("2024-05-31", "ns") + np.round(log.time_s * 1e9).to_numpy().astype("timedelta64[ns]")
    log = log.assign(range_m=log.range_m / 1e3) if "range_m" in log else log
    for angle in {"azimuth_rad", "elevation_rad"} & set(log):
        log = log.assign(**{angle: np.degrees(log[angle])})
    if "azimuth_rad" in log and not north:
        log = log.assign(azimuth_rad=90 - log.azimuth_rad)
    data = "".join(
        f"{KEYWORDS[column]} = {epoch} {value:.12g}\n"
        for column in KEYWORDS
        if column in log
        for epoch, value in zip(epochs, log[column], strict=True)
        if np.isfinite(value)
    )
    meta = f"TIME_SYSTEM = UTC\nPARTICIPANT_1 = {name}\nPARTICIPANT_2 = A\nPATH = 2,1\nANGLE_TYPE = AZEL\n"
    return f"META_START\n{meta}META_STOP\nDATA_START\n{data}DATA_STOP\n"


@pytest.fixture
def one_file(folder):
    """The stations of `folder` in one message, and the range file for it."""
    text = (folder / "range.toml").read_text()
    parts = re.split(r"(?m)^(?=\[station\.)", text)
    segments, sections = [], [parts[0]]
    for part in parts[1:]:
        name, log = re.search(r"\[station\.(\w+)\]", part)[1], re.search(r'log = "(.*)"', part)[1]
        segments.append(segment(name, pd.read_csv(folder / log), 'azimuth_from = "north"' in part))
        part = re.sub(r"(?m)^log = .*$", f'log = "one.tdm"\nwhere = "station={name}"', part)
        sections.append(re.sub(r"(?m)^azimuth_from = .*$", 'azimuth_from = "north"', part))
    (folder / "one.tdm").write_text(HEAD + "".join(segments))
    (folder / "one.toml").write_text("".join(sections))
    return [re.search(r"\[station\.(\w+)\]", part)[1] for part in parts[1:]]


def test_a_file_of_several_stations_becomes_a_range_file(run, folder, one_file):
    result = run("filter", "--fuse", "--write-config", "one.tdm")
    assert result.code == 0
    assert re.findall(r"\[station\.(\w+)\]\nlog = \"one.tdm\"\nwhere = \"station=(\w+)\"", result.out) == [
        (name, name) for name in one_file
    ]
    assert result.out.count('azimuth_from = "north"') == len(one_file) + 1  # one in the comment above
    said = run("filter", "one.tdm").err
    assert "ftproc filter --fuse --write-config one.tdm prints a range file" in said


def test_it_gives_what_the_logs_give(run, folder, one_file):
    for name in ("range", "one"):
        assert run("filter", "--fuse", f"{name}.toml", "--smooth", "-o", f"{name}.parquet").code == 0
    found, expected = pd.read_parquet("one.parquet"), pd.read_parquet("range.parquet")
    assert len(found) == len(expected)
    for axis in ("x_m", "y_m", "z_m"):
        assert found[axis].to_numpy() == pytest.approx(expected[axis].to_numpy(), abs=0.05)


def test_the_same_rows_twice_are_refused(run, folder, one_file):
    text = (folder / "one.toml").read_text()
    (folder / "twice.toml").write_text(text.replace(f'station={one_file[1]}"', f'station={one_file[0]}"'))
    result = run("filter", "--fuse", "twice.toml", "-o", "best.parquet")
    assert result.code == 2
    assert "have the same log" in result.err
