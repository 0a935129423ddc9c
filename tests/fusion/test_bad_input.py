"""Range files that cannot be, and stations that have nothing in common: a plain sentence each, and no output."""

from __future__ import annotations

import re

import pandas as pd
import pytest


def changed(folder, old, new, count=1):
    path = folder / "range.toml"
    text = path.read_text()
    assert re.search(old, text)
    path.write_text(re.sub(old, new, text, count=count))


def refused(run, code, *words):
    result = run("filter", "--fuse", "range.toml", "--smooth", "-o", "best.parquet")
    assert result.code == code, result
    assert "Traceback" not in result.err
    assert result.err.startswith("ftproc: ") or result.err.startswith("Usage")
    for word in words:
        assert word in result.err, result.err
    return result


CASES = {
    "log missing": (
        r'log = "radar.csv"',
        'log = "raddar.csv"',
        2,
        ("[station.radar]", "there is no log", "raddar.csv"),
    ),
    "no log": (r'log = "radar.csv"\n', "", 2, ("[station.radar]", "names no log")),
    "two of one name": (r"\[station.theodolite2\]", "[station.radar]", 2, ("two stations", "radar")),
    "unknown key": (
        r"azimuth_bias_sigma_mrad",
        "azimuth_bias_sigm_mrad",
        2,
        ("azimuth_bias_sigm_mrad", "did you mean"),
    ),
    "no unit": (r"clock_offset_sigma_s", "clock_offset_sigma", 2, ("clock_offset_sigma", "must end in its unit")),
    "negative sigma": (r"range_bias_sigma_m = 25", "range_bias_sigma_m = -25", 2, ("range_bias_sigma_m", "expected")),
    "unknown section": (r"\[origin\]", "[origins]", 2, ("origins", "did you mean")),
    "half an origin": (r"height_m = .*", "", 2, ("[origin]", "height_m is missing")),
    "no origin": (r"\[origin\]\n(.*\n){3}", "", 2, ("[station.radar]", "[origin]")),
    "same log": (r'log = "theodolite2.csv"', 'log = "radar.csv"', 2, ("have the same log",)),
    "a path for a name": (r"\[station.radar\]", '[station."../radar"]', 2, ("rename it",)),
    "not TOML": (r"\[origin\]", "[origin", 2, ("not TOML",)),
    "two places": (r'log = "radar.csv"', 'log = "radar.csv"\neast_m = 3', 2, ("lat_deg and east_m",)),
}


@pytest.mark.parametrize("case", CASES)
def test_range_files(run, folder, case):
    old, new, code, words = CASES[case]
    changed(folder, old, new)
    refused(run, code, "range.toml", *words)
    assert not (folder / "best.parquet").exists()


@pytest.mark.parametrize(("key", "word"), [("lat_deg", "latitude"), ("lon_deg", "longitude")])
def test_the_wrong_hemisphere(run, folder, key, word):
    text = (folder / "range.toml").read_text()
    text = re.sub("lat_deg = .*", "lat_deg = 40.0", re.sub("lon_deg = .*", "lon_deg = 20.0", text))
    place = text.index(key, text.index("[station.radar]"))
    (folder / "range.toml").write_text(text[:place] + re.sub("= ", "= -", text[place:], count=1))
    refused(run, 2, "[station.radar]", "km from the origin", f"other sign of its {word}")


def test_no_range_file(run, folder):
    result = run("filter", "--fuse", "nothing.toml")
    assert result.code == 2
    assert "nothing.toml: there is no such file" in result.err


def shifted(folder, name, seconds):
    log = pd.read_csv(folder / f"{name}.csv")
    log["time_s"] += seconds
    log.to_csv(folder / f"{name}.csv", index=False)


def test_clocks_off_by_an_hour(run, folder):
    shifted(folder, "radar", 3600.0)
    refused(run, 1, "radar", "overlaps with no other station", "time zone", "time_offset_s = -3600")
    path = folder / "range.toml"  # what it says to write is understood
    path.write_text(path.read_text().replace('log = "radar.csv"', 'log = "radar.csv"\ntime_offset_s = -3600'))
    assert run("filter", "--fuse", "range.toml", "-o", "best.parquet").code == 0


def test_no_overlap(run, folder):
    shifted(folder, "theodolite3", 1234567.0)
    refused(run, 1, "theodolite3", "overlaps with no other station", "leave the station out")


def test_a_target_that_is_handed_over(run, folder):
    """One station sees it before a pause, another after it: no overlap is needed where both see its place."""
    log = pd.read_csv(folder / "radar.csv")
    log[log.time_s < 25].to_csv(folder / "radar.csv", index=False)
    log[log.time_s > 27].to_csv(folder / "next.csv", index=False)
    path = folder / "range.toml"
    first, *sections = path.read_text().split("\n[station.")
    (radar,) = (each for each in sections if each.startswith("radar"))
    path.write_text("\n[station.".join([first, radar, radar.replace("radar", "next")]))
    found = run("filter", "--fuse", "range.toml", "-o", "best.parquet")
    assert found.code == 0
    assert "saw the target at other times than all others" in found.out + found.err


def test_readings_that_meet_nowhere(run, folder):
    text = (folder / "range.toml").read_text()
    parts = text.split("\n[station.")
    (folder / "range.toml").write_text(parts[0] + "\n[station." + parts[2])
    one = pd.read_csv(folder / "theodolite2.csv")
    half = one.copy()
    half["elevation_rad"] = float("nan")
    half.to_csv(folder / "half.csv", index=False)
    section = parts[2].replace("theodolite2", "half")
    (folder / "range.toml").write_text(parts[0] + "\n[station." + parts[2] + "\n[station." + section)
    refused(run, 1, "meet nowhere", "theodolite2, half")


def test_options_that_mean_nothing(run, folder):
    for option in (
        ["--noise", "3,1e-4,1e-4"],
        ["--site", "48,11,600"],
        ["--method", "ekf"],
        ["--azimuth-from", "north"],
    ):
        result = run("filter", "--fuse", "range.toml", *option)
        assert result.code == 2
        assert f"{option[0]} does nothing with --fuse" in result.err
    assert "no place on the command line" in run("filter", "--fuse", "range.toml", "radar.csv").err
    assert "does nothing without --fuse" in run("filter", "radar.csv", "--write-calibration", "x").err
    assert "never overwritten" in run("filter", "--fuse", "range.toml", "-o", "radar.csv").err
    assert (folder / "radar.csv").read_text().startswith("time_s")


@pytest.mark.parametrize("station", [pytest.param("radar", marks=pytest.mark.slow), "theodolite2"])
def test_a_station_a_kilometre_off_its_place(run, folder, station):
    path = folder / "range.toml"
    head, _, tail = path.read_text().partition(f"[station.{station}]")
    moved = re.sub(r"lat_deg = (\S+)", lambda m: f"lat_deg = {float(m[1]) + 0.009}", tail, count=1)
    path.write_text(f"{head}[station.{station}]{moved}")
    result = run("filter", "--fuse", "range.toml", "--smooth", "-o", "best.parquet")
    assert (result.code, result.err) == (0, "")
    assert re.search("verdict    (suspect|unreliable)", result.out)
    assert "check its place, its clock and its conventions" in result.out


@pytest.mark.parametrize(
    ("sigma", "sentence"),
    [
        pytest.param("0", "all clocks are taken as exact", marks=pytest.mark.slow),
        ("0.08", "no clock is the"),
    ],
)
def test_clocks_that_are_all_alike(run, folder, sigma, sentence):
    path = folder / "range.toml"
    path.write_text(re.sub("clock_offset_sigma_s = .*", f"clock_offset_sigma_s = {sigma}", path.read_text()))
    result = run("filter", "--fuse", "range.toml", "--smooth", "-o", "best.parquet")
    assert (result.code, result.err) == (0, "")
    assert sentence in result.out
    if sigma != "0":
        biases = pd.read_csv("best.biases.csv").query("parameter == 'clock_s'")
        assert "common clock" in result.out
        assert biases.sigma.min() > 0.6 * 0.08 / len(biases) ** 0.5  # what they share is as uncertain as before


def test_the_report_is_a_page_or_a_pdf_and_is_refused_before_the_work(run, folder, monkeypatch):
    monkeypatch.setenv("PATH", str(folder / "empty"))
    for name, why in (
        ("best.ps", "--report best.ps: end the name in .html or .pdf, or in / if it is a directory."),
        ("best.pdf", "best.pdf: a PDF is printed by Chromium, Google Chrome or Microsoft Edge"),
    ):
        result = run("filter", "--fuse", "range.toml", "-o", "best.parquet", "--report", name)
        assert (result.code, result.out) == (2, "")
        assert why in result.err
    (folder / "radar.html").write_text((folder / "radar.csv").read_text())
    text = (folder / "range.toml").read_text().replace('"radar.csv"', '"radar.html"')
    (folder / "range.toml").write_text(text)
    result = run("filter", "--fuse", "range.toml", "-o", "best.parquet", "--report", "radar.html")
    assert "which is never overwritten" in result.err
    assert not (folder / "best.parquet").exists()
