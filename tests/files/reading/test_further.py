"""The height of the target beside range and azimuth, and range rates."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d, median_filter

from ftproc.core.impact import heights as true_heights
from ftproc.errors import InputError, UsageError
from ftproc.files.options import Extract
from ftproc.files.reading import computed, logs
from ftproc.simulation import simulate

HEARD = Extract(signal=True)


def table(tmp_path, head, cells=("350", "351", "")):
    path = tmp_path / "log.csv"
    rows = "\n".join(f"{k},{50000 + 100 * k},0.{k + 1},{cell}" for k, cell in enumerate(cells))
    path.write_text(f"time_s,range_m,azimuth_rad,{head}\n{rows}\n")
    return path


@pytest.mark.parametrize(
    ("head", "metres", "barometric"),
    [
        ("flight_level", 30.48, True),
        ("FL", 30.48, True),
        ("Mode C", 30.48, True),
        ("I090.FL", 30.48, True),
        ("height (FL)", 30.48, True),
        ("altitude_ft", 0.3048, True),
        ("Altitude (m)", 1.0, True),
        ("geo_height_ft", 0.3048, False),
        ("height_m", 1.0, False),
        ("target height [km]", 1000.0, True),
    ],
)
def test_names_and_units(tmp_path, head, metres, barometric):
    log = logs.read(table(tmp_path, head))
    np.testing.assert_allclose(log.heights.above_m, [350 * metres, 351 * metres, np.nan])
    assert log.heights.barometric == barometric
    assert log.understood["columns"]["height"]["column"] == head
    assert head not in log.understood["not_used"]


def test_a_unit_that_nothing_states_is_asked_for(tmp_path):
    path = table(tmp_path, "altitude")
    with pytest.raises(InputError, match=r"--units height=ft .*--columns height=none"):
        logs.read(path)
    assert logs.read(path, units="height=ft").heights.above_m[0] == pytest.approx(350 * 0.3048)
    assert logs.read(path, columns="height=none").heights is None


def test_a_column_is_named(tmp_path):
    path = table(tmp_path, "H1")
    assert logs.read(path).heights is None
    assert logs.read(path, columns="height=H1", units="height=fl").heights.above_m[0] == pytest.approx(10668)
    with pytest.raises(InputError, match='there is no column "H2", which --columns names for the height'):
        logs.read(path, columns="height=H2")
    with pytest.raises(UsageError, match="expected time, range, azimuth, elevation, height"):
        logs.read(path, columns="hight=H1")


def test_two_heights_are_asked_about(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,range_m,azimuth_rad,FL,geo_height_m\n0,50000,0.1,350,10700\n1,50100,0.1,350,10700\n")
    with pytest.raises(InputError, match="FL, geo_height_m could each be the height"):
        logs.read(path)
    log = logs.read(path, columns="height=geo_height_m")
    assert not log.heights.barometric


@pytest.mark.parametrize(("head", "cells"), [("altitude", "350"), ("FL,geo_height_m", "350,10700")])
def test_with_elevations_nobody_asks(tmp_path, head, cells):
    path = tmp_path / "log.csv"
    path.write_text(
        f"time_s,range_m,azimuth_rad,elevation_rad,{head}\n0,5000,0.1,0.1,{cells}\n1,5010,0.1,0.1,{cells}\n"
    )
    log = logs.read(path)
    assert log.heights is None
    name = head.replace(",", ", ")
    assert f'"{name}" may be the height of the target: if so, say --columns height=NAME' in " ".join(log.remarks)
    first = head.split(",")[0]
    assert logs.read(path, columns=f"height={first}", units="height=fl").heights is not None


def beside_elevations(tmp_path, above_m, head="alt_ft", unit_m=0.3048):
    """A log of a radar, with a column of heights by (ranges, sines of elevations, true heights)."""
    flight = simulate("radar", seed=1)
    r, a, e = flight.log.measurement.T
    values = above_m(r, np.sin(e), true_heights(flight.truth.position_m)) / unit_m
    path = tmp_path / "radar.csv"
    rows = "".join(
        ",".join("" if np.isnan(x) else repr(float(x)) for x in row) + "\n"
        for row in zip(flight.log.time_s, r, a, e, values, strict=True)
    )
    path.write_text(f"time_s,range_m,azimuth_rad,elevation_rad,{head}\n{rows}")
    return path


NOISE = np.random.default_rng(1).standard_normal(10_000)


@pytest.mark.parametrize("noise_m", [0.0, 3.0, 30.0])
def test_heights_beside_elevations_are_kept(tmp_path, noise_m):
    path = beside_elevations(tmp_path, lambda r, s, h: h + 100 + noise_m * NOISE[: len(h)])
    log = logs.read(path, keep_columns=True)
    assert log.heights.barometric
    assert np.isfinite(log.heights.above_m).all()
    assert '"alt_ft" is the height of the target, beside the elevation' in log.remarks
    assert log.extra.column_names == ["alt_ft"]
    assert logs.read(path, columns="height=none").heights is None


def smoothed(values):
    known = np.isfinite(values)
    values = np.interp(np.arange(len(values)), np.flatnonzero(known), values[known])
    values = median_filter(values, 5)
    return gaussian_filter1d(values, 2.0)


@pytest.mark.parametrize(
    "above_m",
    [
        lambda r, s, h: r * s + 50,
        lambda r, s, h: r * s + r**2 * (1 - s**2) * 0.75 / 2 / 6_371_000,
        lambda r, s, h: np.round(r * s),
        lambda r, s, h: np.round(r * s / 10) * 10,
        lambda r, s, h: np.round(r * s / 7.62) * 7.62,
        lambda r, s, h: np.round(smoothed(r * s)),
    ],
    ids=["plain", "refracted", "1 m", "10 m", "25 ft", "smoothed"],
)
def test_heights_computed_from_elevations_are_not_used(tmp_path, above_m):
    log = logs.read(beside_elevations(tmp_path, above_m))
    assert log.heights is None
    assert computed.COMPUTED in log.remarks


def test_heights_that_do_not_change_are_not_used(tmp_path):
    log = logs.read(beside_elevations(tmp_path, lambda r, s, h: np.full(len(h), 612.0)))
    assert log.heights is None
    assert computed.CONSTANT in log.remarks


def test_words_are_no_heights(tmp_path):
    assert logs.read(table(tmp_path, "altitude", ("low", "high", ""))).heights is None


def test_rows_stay_together(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,range_m,azimuth_rad,FL,ok\n2,50200,0.1,352,1\n0,50000,0.1,350,1\n1,50100,0.1,351,0\n")
    log = logs.read(path, extract=logs.Extract(where=logs.parse_where(["ok=1"])))
    np.testing.assert_allclose(log.heights.above_m / 30.48, [350, 352])
    assert log.stretch(slice(1, 2)).heights.above_m == pytest.approx([352 * 30.48])


@pytest.mark.parametrize(
    ("head", "mps"),
    [
        ("range_rate_mps", 1.0),
        ("Doppler (m/s)", 1.0),
        ("radial_velocity_kt", 1852 / 3600),
        ("radialVelocity [km/h]", 1 / 3.6),
        ("closing_speed_kmh", -1 / 3.6),
        ("RDOT_ft/s", 0.3048),
        ("target range rate, km/s", 1000.0),
        ("range_rate_m_s", 1.0),
        ("rr_m_per_s", 1.0),
        ("rangeRateKt", 1852 / 3600),
        ("radial velocity in feet per second", 0.3048),
        ("Vr [m·s⁻¹]", 1.0),
        ("радиальная скорость, км/ч", 1 / 3.6),
    ],
)
def test_names_and_units_of_range_rates(tmp_path, head, mps):
    path = tmp_path / "log.csv"
    path.write_text(f'time_s,range_m,azimuth_rad,elevation_rad,"{head}"\n0,50000,0.1,0.1,35\n1,50100,0.1,0.1,\n')
    log = logs.read(path)
    np.testing.assert_allclose(log.range_rate, [35 * mps, np.nan])
    assert log.understood["columns"]["range_rate"]["column"] == head


def test_a_range_rate_without_a_unit_is_left_out_with_a_word(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,range_m,azimuth_rad,elevation_rad,doppler\n0,50000,0.1,0.1,35\n1,50100,0.1,0.1,36\n")
    log = logs.read(path)
    assert log.range_rate is None
    assert "--units range_rate=mps" in " ".join(log.remarks)
    assert logs.read(path, units="range_rate=kt").range_rate[0] == pytest.approx(35 * 1852 / 3600)
    assert "--units range_rate" not in " ".join(logs.read(path, columns="range_rate=none").remarks)


@pytest.mark.parametrize("mps", [1.0, -1.0, 1 / 3.6, 1852 / 3600, 0.3048, 1000.0])
def test_the_ranges_tell_the_unit_of_a_rate_that_states_none(tmp_path, mps):
    noise = np.random.default_rng(1).normal(size=(2, 400))
    time_s = 0.1 * np.arange(400)
    ranges_m = np.hypot(40 * (time_s - 15), 800)
    rate = np.gradient(ranges_m, time_s) + 0.3 * noise[0]
    rate[::17] = 900.0
    rows = [
        f"{t:.1f},{r:.3f},0.1,0.1,{float(v / mps)!r}\n"
        for t, r, v in zip(time_s, ranges_m + 0.5 * noise[1], rate, strict=True)
    ]
    path = tmp_path / "log.csv"
    path.write_text("time_s,range_m,azimuth_rad,elevation_rad,range_rate\n" + "".join(rows))
    log = logs.read(path)
    np.testing.assert_allclose(log.range_rate, rate * np.sign(mps), rtol=1e-4)
    assert log.understood["columns"]["range_rate"]["why"] == "its name, and its unit by the ranges"


@pytest.mark.parametrize("kind", ["constant", "noise", "another thing"])
def test_what_is_no_rate_of_the_ranges_is_left_out(tmp_path, kind):
    noise = np.random.default_rng(2).normal(size=400)
    column = {"constant": np.full(400, 30.0), "noise": 5 * noise, "another thing": 40 + np.cumsum(noise)}[kind]
    rows = [f"{0.1 * k:.1f},{5000 + 3 * k},0.1,0.1,{value:.4f}\n" for k, value in enumerate(column)]
    path = tmp_path / "log.csv"
    path.write_text("time_s,range_m,azimuth_rad,elevation_rad,range_rate\n" + "".join(rows))
    log = logs.read(path)
    assert log.range_rate is None
    assert "may be a range rate" in " ".join(log.remarks)


def test_doppler_in_hertz_is_no_range_rate(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,range_m,azimuth_rad,elevation_rad,Doppler (Hz)\n0,50000,0.1,0.1,35\n1,50100,0.1,0.1,36\n")
    assert logs.read(path).range_rate is None


@pytest.mark.parametrize(
    "head", ["signal_db", "SNR (dB)", "RSSI [dBm]", "Rx power/dBW", "CN0 [dB-Hz]", "RxLevel_dBm", "信噪比_dB"]
)
def test_the_strength_of_the_signal_is_read_where_it_is_wanted(tmp_path, head):
    path = table(tmp_path, head, ("-31.5", "-9999", "", *map(str, range(-40, -30))))
    assert logs.read(path).signal_db is None
    log = logs.read(path, extract=HEARD, keep_columns=True)
    np.testing.assert_array_equal(log.signal_db, [-31.5, np.nan, np.nan, *range(-40, -30)])
    assert log.understood["columns"]["signal"] == {
        "column": head, "unit": "db", "unit_from": "over any reference", "why": "its name"
    }  # fmt: skip
    assert log.extra.column_names == [head]
    assert logs.read(path, extract=HEARD, columns="signal=none").signal_db is None
    assert log.stretch(slice(0, 2)).signal_db.size == 2


def test_a_strength_of_no_known_unit_is_stated_or_none(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,range_m,azimuth_rad,SNR,RSSI_dBm,AGC\n0,50000,0.1,3,-80,7\n1,50100,0.1,4,-81,8\n")
    assert logs.read(path, extract=HEARD).signal_db.tolist() == [-80, -81]
    both = {"columns": "signal=AGC", "units": "signal=dB"}
    assert logs.read(path, **both).signal_db.tolist() == [7, 8]
    assert logs.read(path, extract=HEARD, columns="signal=AGC").signal_db is None
    two = tmp_path / "two.csv"
    two.write_text(path.read_text().replace("SNR", "SNR_dB"))
    with pytest.raises(InputError, match="SNR_dB, RSSI_dBm could each be the strength of the signal"):
        logs.read(two, extract=HEARD)
