"""Station files: every key, the message of every fault, and the round trip."""

from __future__ import annotations

import math
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ftproc.config import reading, writing
from ftproc.config.keys import KEYS, every
from ftproc.config.recipe import Recipe
from ftproc.errors import UsageError
from ftproc.settings import Air, FilterSettings, Station

FULL = """
[site]
lat_deg = 48
lon_deg = 11.5
height_m = 612.0
geoid_m = 46.2
datum = "WGS-84"
[time]
column = "UTC"
unit = "ms"
offset_ms = -20
[range]
column = "RNG"
unit = "km"
sigma_ft = 10
bias_km = 0.002
rate_interval_mps = 60
[azimuth]
from = "north"
sense = "anticlockwise"
zero_gon = 100
bias_mgon = 2
[elevation]
column = "none"
from = "zenith"
sigma_arcsec = 20
bias_deg = -0.5
[refraction]
correct = true
temperature_c = -3
pressure_hpa = 900
[height]
unit = "ft"
prior_m = "9000,50"
[filter]
method = "ukf"
model = "none"
smooth = true
editing = "forward"
lag_s = 1.5
jerk_psd_m2ps5 = 5
motion = "turning-force"
gate = 3.5
max_patch_s = 9
set = "window=6,m=0.01"
weight_form = "gain"
ecef = true
derived = true
particles = 150
seed = 7
keep_columns = true
"""


def test_every_key_is_understood():
    said = {(section, key.rpartition("_")[0] if key.rpartition("_")[0] in KEYS[section] else key)
            for section, keys in tomllib.loads(FULL).items() for key in keys}  # fmt: skip
    unsaid = {(section, name) for section, name, _ in every()} - said
    assert unsaid == {
        ("file", "widths"),
        ("azimuth", "column"),
        ("azimuth", "unit"),
        ("azimuth", "sigma"),
        ("elevation", "unit"),
        ("height", "column"),
    }
    found = Recipe.of(reading.parse(FULL, "s.toml"))
    assert found.settings == FilterSettings(
        "ukf", "forward", True, (3.048, None, pytest.approx(20 * math.pi / 648000)), 5.0, 3.5, 9.0, 150, 7, True,
        (48.0, 11.5, 612.0), True, 46.2, (("window", 6.0), ("m", 0.01)), 1.5, True,
        "turning-force", (9000.0, 50.0),
    )  # fmt: skip
    assert found.station == Station(
        "north", "anticlockwise", pytest.approx(math.pi / 2), "zenith",
        (2.0, pytest.approx(0.002 * math.pi / 200), pytest.approx(math.radians(-0.5))), -0.02, Air(-3.0, 900.0), 60.0,
    )  # fmt: skip
    assert (found.model, found.keep_columns) == ("none", True)
    assert found.units == {"time": "ms", "range": "km", "height": "ft"}
    assert found.columns == {"time": "UTC", "range": "RNG", "elevation": "none"}


def test_an_empty_file_gives_the_defaults():
    assert Recipe.of(reading.parse("", "s.toml")) == Recipe()
    assert reading.parse(writing.dump({}), "s.toml") == {}


def test_defaults_that_a_comment_shows_are_the_real_ones():
    """Uncommented, every key that has a default sets it."""
    usual = tuple(f"# {name} = " for _, name, key in every() if key.default)
    lines = [line.removeprefix("# ") if line.startswith(usual) else line for line in writing.dump({}).splitlines()]
    said = reading.parse("\n".join(lines), "s.toml")
    assert {"method", "gate", "editing", "model", "temperature_c", "pressure_hpa"} <= set(said)
    assert Recipe.of(said) == Recipe()


def test_every_example_can_be_used():
    lines = [line.removeprefix("# ") if " = " in line else line for line in writing.dump({}).splitlines()]
    said = reading.parse("\n".join(lines[2:]), "s.toml")
    assert set(said) == {key.option for _, _, key in every()}


numbers = st.floats(1e-6, 1e6, allow_subnormal=False)
angles = st.floats(1e-6, 20, allow_subnormal=False)
names = st.text(st.characters(codec="utf-8", exclude_characters="\r"), min_size=1).filter(str.strip)
OPTIONS = st.fixed_dictionaries(
    {},
    optional={
        "site": st.tuples(st.floats(-90, 90), st.floats(-180, 360), st.floats(-1000, 1e5)),
        "geoid_m": st.floats(-150, 150),
        "noise": st.tuples(st.none() | numbers, st.none() | angles, st.none() | angles).filter(any),
        "bias": st.tuples(numbers, angles, angles),
        "columns": st.dictionaries(st.sampled_from(["time", "range", "azimuth"]), names, min_size=1),
        "units": st.just({"range": "km"}) | st.just({"time": "us", "azimuth": "mil", "elevation": "gon"}),
        "time_offset_s": numbers,
        "range_rate_interval_mps": numbers,
        "azimuth_from": st.just("north"),
        "azimuth_sense": st.sampled_from(["clockwise", "anticlockwise"]),
        "azimuth_zero_rad": angles,
        "elevation_from": st.sampled_from(["horizon", "zenith"]),
        "widths": st.just("10,8,12"),
        "refraction": st.just(True),
        "temperature_c": st.floats(-90, 14),
        "pressure_hpa": st.floats(300, 1000),
        "method": st.just("ekf"),
        "model": st.just("none"),
        "smooth": st.just(True),
        "editing": st.sampled_from(["forward", "none"]),
        "jerk": numbers,
        "gate": st.floats(5, 50),
        "max_patch": numbers,
        "lag": st.floats(1e-3, 3600),
        "weight_form": st.just("gain"),
        "motion": st.sampled_from(["white-jerk", "turning-force", "ballistic", "orbital"]),
        "ecef": st.just(True),
        "derived": st.just(True),
        "set": st.sampled_from(["window=6", "m = 0.01, F_range_m=3e2"]),
        "particles": st.integers(101, 10_000),
        "seed": st.integers(1, 2**31),
        "keep_columns": st.just(True),
        "height": st.tuples(st.floats(-100, 1e5), numbers),
    },
)


@given(OPTIONS)
def test_what_is_written_reads_back_the_same(options):
    assert reading.parse(writing.dump(options), "s.toml") == options


def test_every_option_is_in_the_round_trip():
    in_round_trip = set(OPTIONS.wrapped_strategy.optional if hasattr(OPTIONS, "wrapped_strategy") else OPTIONS.optional)
    assert in_round_trip == {key.option for _, _, key in every()} - {"datum"}


def test_a_model_lies_beside_its_file(tmp_path, monkeypatch):
    (tmp_path / "s.toml").write_text('[filter]\nmodel = "m.safetensors"\n')
    found = reading.load(tmp_path / "s.toml")
    assert found["model"] == str(tmp_path / "m.safetensors")
    monkeypatch.chdir(tmp_path)
    assert f'model = "{tmp_path}/m.safetensors"' in writing.dump({"model": "m.safetensors"})


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[range]\nbais_m = 1", '[range] has no key "bais_m"; did you mean "bias_m"? Its keys are: column, unit, '
         "sigma_UNIT, bias_UNIT, rate_interval_mps."),
        ("[azimut]\nzero_deg = 1", 'there is no section "azimut"; did you mean "azimuth"? The sections: [site], '
         "[file], [time], [range], [azimuth], [elevation], [height], [refraction], [filter]."),
        ("[file]\nwidths = '8,x'", '[file] widths = "8,x": expected widths such as "10,12,12,12".'),
        ("gate = 3", '"gate" stands outside of its section; write it below [filter].'),
        ("unit = 'm'", '"unit" stands outside of its section; write it below [time] or [range] or [azimuth] or '
         "[elevation] or [height]."),
        ("nonsense = 3", 'there is no key "nonsense". The sections: [site], [file], [time], [range], [azimuth], '
         '[elevation], [height], '
         "[refraction], [filter]."),
        ("site = 3", '"site" is a section: write [site], and its keys below it.'),
        ("[range]\nbias_ell = 1", '[range] "bias_ell" must end in its unit: bias_m, bias_km, bias_ft, bias_nmi, '
         'bias_nm, bias_mi, bias_yd, bias_kyd, bias_kft, bias_cm, bias_mm, bias_dmi, '
         'bias_inch, bias_usft, bias_cable, bias_fathom; '
         'did you mean "bias_m"?'),
        ("[range]\nbias = 1", '[range] "bias" must end in its unit: bias_m, bias_km, bias_ft, bias_nmi, '
         'bias_nm, bias_mi, bias_yd, bias_kyd, bias_kft, bias_cm, bias_mm, bias_dmi, '
         'bias_inch, bias_usft, bias_cable, bias_fathom; did '
         'you mean "bias_m"?'),
        ("[range]\nbias_m = 1\nbias_ft = 3", "[range] has bias in two units; leave one out."),
        ("[site]\nlat_deg = 98\nlon_deg = 1\nheight_m = 1", "[site] lat_deg = 98: expected a number from -90 to 90."),
        ("[site]\nlat_deg = '48'", '[site] lat_deg = "48": expected a number from -90 to 90.'),
        ("[site]\nlat_deg = 48.0", "[site] needs all of lat_deg, lon_deg and height_m."),
        ("[site]\ndatum = 'ED50'", '[site] datum = "ED50": expected "WGS-84".'),
        ("[filter]\nsmooth = 1", "[filter] smooth = 1: expected true or false."),
        ("[filter]\ngate = true", "[filter] gate = true: expected a number above zero."),
        ("[filter]\ngate = 0", "[filter] gate = 0: expected a number above zero."),
        ("[filter]\nset = 'window'", '[filter] set = "window": expected parameters of a method, such as '
         '"window=6,m=0.01".'),
        ("[filter]\nset = 3", "[filter] set = 3: expected a text in quotes."),
        ("[filter]\ngate = inf", "[filter] gate = inf: expected a number above zero."),
        ("[filter]\nmethod = 'ekff'", '[filter] method = "ekff": expected the name of a method, see --list-methods; '
         'did you mean "ekf".'),
        ("[azimuth]\nsense = 'clokwise'", '[azimuth] sense = "clokwise": expected "clockwise" or "anticlockwise"; did '
         'you mean "clockwise"?'),
        ("[azimuth]\nunit = 'km'", '[azimuth] unit = "km": expected "rad" or "deg" or "mrad" or "mil" or "mil6300" or '
         '"mil6000" or "grad" or "gon" or "mgon" or "urad" or "mdeg" or "cdeg" or "turn" or "bam16" or "arcmin" or '
         '"arcsec".'),
        ("[azimuth]\nbias_deg = 'x'", '[azimuth] bias_deg = "x": expected a number.'),
        ("[range]\ncolumn = ''", '[range] column = "": expected a text in quotes.'),
        ("[refraction]\npressure_hpa = 101325", "[refraction] pressure_hpa = 101325: expected a number from 300 to "
         "1100."),
        ("[range\n", "this is not TOML: Expected ']' at the end of a table declaration (at line 1, column 7). "
         "Correct it there."),
    ],
)  # fmt: skip
def test_the_fault_of_a_key_is_named(text, sentence):
    with pytest.raises(UsageError) as caught:
        reading.parse(text, "s.toml")
    assert str(caught.value) == f"s.toml: {sentence}"


def test_the_name_of_an_option_is_answered_with_its_key():
    for text, sentence in {
        "[filter]\nnoise = 3": '[filter] has no key "noise"; what --noise says is sigma_m under [range], sigma_rad '
        "under [azimuth], sigma_rad under [elevation]. Its keys are: method, ",
        "max_patch = 3": 'there is no key "max_patch"; what --max-patch says is max_patch_s under [filter]. The ',
    }.items():
        with pytest.raises(UsageError) as caught:
            reading.parse(text, "s.toml")
        assert str(caught.value).startswith(f"s.toml: {sentence}")


def test_files_that_cannot_be_read(tmp_path):
    for name, sentence in {
        "none.toml": "there is no such file. ftproc filter --write-config > {} makes one.",
        "": "cannot be read (is a directory); name a station file.",
        "latin.toml": "this is not UTF-8 text; save it as UTF-8.",
    }.items():
        (tmp_path / "latin.toml").write_bytes(b"# \xe9t\xe9\n")
        with pytest.raises(UsageError) as caught:
            reading.load(tmp_path / name)
        assert str(caught.value) == f"{tmp_path / name}: {sentence.format(tmp_path / name)}"


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("[azimuth]\nzero_rad = 1e308", "[azimuth] zero_rad = 1e+308: expected at most 20 rad."),
        ("[azimuth]\nzero_deg = -1e6", "[azimuth] zero_deg = -1000000.0: expected at least -20 rad."),
        ("[range]\nbias_km = 1e300", "[range] bias_km = 1e+300: expected at most 1e+09 m."),
        ("[range]\nsigma_m = 1e-12", "[range] sigma_m = 1e-12: expected at least 1e-06 m."),
        ("[elevation]\nsigma_mrad = 1e-9", "[elevation] sigma_mrad = 1e-09: expected at least 1e-09 rad."),
        ("[time]\noffset_h = 1e100", "[time] offset_h = 1e+100: expected at most 1e+10 s."),
    ],
)
def test_errors_that_no_instrument_has(line, said):
    with pytest.raises(UsageError) as caught:
        reading.parse(line, "s.toml")
    assert str(caught.value) == f"s.toml: {said}"
