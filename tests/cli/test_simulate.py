"""`ftproc simulate`."""

from __future__ import annotations

import gzip

import numpy as np
import pandas as pd
import pytest

from ftproc.files.reading import logs, truth


def simulate(run, *args):
    result = run("simulate", "--scenario", *args)
    assert (result.code, result.out, result.err) == (0, "", "")


def test_writes_a_log_and_its_truth(run, here):
    simulate(run, "zuo2021", "--seed", 4, "--duration", 10, "--dt", 0.5, "-o", "a.csv", "--truth", "a.truth.parquet")
    log, real = logs.read("a.csv"), truth.read("a.truth.parquet")
    assert len(log) == len(real) == 21
    assert log.time_s[1] == 0.5
    np.testing.assert_array_equal(log.time_s, real.time_s)
    assert real.velocity_mps is not None
    assert real.outlier is not None


def test_same_seed_same_bytes(run, here):
    for name in ("a.parquet", "b.parquet", "a.csv.gz", "b.csv.gz"):
        simulate(run, "manoeuvre", "--duration", 5, "--seed", 9, "-o", name)
    simulate(run, "manoeuvre", "--duration", 5, "--seed", 8, "-o", "c.parquet")
    assert (here / "a.parquet").read_bytes() == (here / "b.parquet").read_bytes() != (here / "c.parquet").read_bytes()
    assert (here / "a.csv.gz").read_bytes() == (here / "b.csv.gz").read_bytes()
    assert gzip.decompress((here / "a.csv.gz").read_bytes()).startswith(b"time_s,range_m,")


def test_noise_and_outliers(run, here):
    simulate(
        run, "zuo2021", "--noise", "0,0,0", "--outliers", "range.offset=1:5:50m", "-o", "a.csv", "--truth", "t.csv"
    )
    log, real = logs.read("a.csv"), truth.read("t.csv")
    off = np.abs(log.measurement[:, 0] - np.linalg.norm(real.position_m, axis=1))
    assert sorted(np.round(off, 6).tolist())[-6:] == [0, 50, 50, 50, 50, 50]


def test_errors_of_the_instrument(run, here):
    """Azimuth: zero-set error, and collimation over cos E; the noise is the same with them as without."""
    for name, spec in (("perfect", "none"), ("real", "azimuth_zero_mrad=2,collimation_mrad=1")):
        simulate(run, "calibration", "--duration", 60, "--instrument-errors", spec, "-o", f"{name}.csv")
    perfect, real = logs.read("perfect.csv").measurement, logs.read("real.csv").measurement
    off = np.angle(np.exp(1j * (real[:, 1] - perfect[:, 1])))
    np.testing.assert_allclose(off, 2e-3 + 1e-3 / np.cos(perfect[:, 2]), atol=2e-6)
    np.testing.assert_array_equal(real[:, [0, 2]], perfect[:, [0, 2]])


def test_units_and_azimuth_from_north(run, here):
    """The same flight, written as a survey radar writes it, is understood as the same log."""
    simulate(run, "radar", "--seed", 3, "-o", "si.csv")
    units = "range=km,azimuth=deg,elevation=mrad,time=ms"
    simulate(run, "radar", "--seed", 3, "--units", units, "--azimuth-from", "north", "-o", "survey.csv")
    table = pd.read_csv("survey.csv")
    assert list(table.columns) == ["time_ms", "range_km", "azimuth_deg", "elevation_mrad"]
    assert table["azimuth_deg"].between(0, 360, inclusive="left").all()
    si, survey = logs.read("si.csv"), logs.read("survey.csv", azimuth_from="north")
    assert survey.frame == "north-east-up"
    np.testing.assert_allclose(survey.time_s, si.time_s, rtol=1e-12)
    np.testing.assert_allclose(survey.measurement[:, [0, 2]], si.measurement[:, [0, 2]], rtol=1e-12)
    np.testing.assert_allclose(np.exp(1j * survey.measurement[:, 1]), np.exp(1j * si.measurement[:, 1]), rtol=1e-12)


@pytest.mark.parametrize(
    ("args", "sentence"),
    [
        (["--scenario", "moon", "-o", "a.csv"], 'There is no scenario "moon". Choose one of zuo2021,'),
        (["--scenario", "radar", "-o", "a.xlsx"], "a.xlsx: not a kind of file that can be written"),
        (["--scenario", "radar", "-o", "no/a.csv"], "there is no directory no; create it first"),
        (["--scenario", "radar", "-o", "a.csv", "--truth", "./a.csv"], "-o and --truth are both ./a.csv"),
        (["--scenario", "radar", "-o", "-", "--truth", "-"], "-o and --truth are both -"),
        (["--scenario", "radar", "-o", "a.csv", "--truth", "a.truth"], "a.truth: not a kind of file"),
        (["--scenario", "radar", "-o", "a.csv", "--noise", "1,2"], '"1,2" is not three numbers, R,A,E in m, rad, rad'),
        (["--scenario", "radar", "-o", "a.csv", "--noise", "1,-2,3"], '"1,-2,3" is not three numbers'),
        (["--scenario", "radar", "-o", "a.csv", "--dt", "0"], '"0" is not a number above zero'),
        (["--scenario", "radar", "-o", "a.csv", "--dt", "nan"], '"nan" is not a number above zero'),
        (["--scenario", "radar", "-o", "a.csv", "--duration", "1e9"], "The duration is at most"),
        (["--scenario", "radar", "-o", "a.csv", "--outliers", "isolatd=1"], 'unknown item "isolatd=1"'),
        (["--scenario", "radar", "-o", "a.csv", "--instrument-errors", "tilt=1"], 'there is no error "tilt"'),
        (["--scenario", "radar", "-o", "a.csv", "--units", "range=ly"], '--units: "ly" is not a unit of range'),
        (["--scenario", "radar", "-o", "a.csv", "--seed", "-1"], "Invalid value for '--seed'"),
    ],
)
def test_errors(run, here, args, sentence):
    result = run("simulate", *args)
    assert sentence in result.err
    assert len(result.err.splitlines()) == 1
    assert result.code == (
        1 if "file that can be" in sentence or "no directory" in sentence or "kind" in sentence else 2
    )
    assert result.out == ""
    assert list(here.iterdir()) == []
