"""Which column is which quantity, in which unit."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ftproc.errors import InputError
from ftproc.files.layout import CANONICAL
from ftproc.files.options import parse_units
from ftproc.files.reading.meaning.schema import remarks, resolve
from ftproc.files.units import UNITS
from ftproc.files.words import ALIASES


def found(
    names: list[str], units: dict[str, str] | None = None, columns: dict[str, str] | None = None
) -> dict[str, tuple[str, str]]:
    columns_found = resolve("log.csv", names, units or {}, columns or {})
    assert all(names[column.position] == column.name for column in columns_found.values())
    return {quantity: (column.name, column.unit.name) for quantity, column in columns_found.items()}


def refused(names: list[str], units: dict[str, str] | None = None, columns: dict[str, str] | None = None) -> str:
    with pytest.raises(InputError) as caught:
        resolve("log.csv", names, units or {}, columns or {})
    assert str(caught.value).startswith("log.csv: ")
    return str(caught.value)


def test_canonical_names() -> None:
    assert CANONICAL == {
        "time": "time_s",
        "range": "range_m",
        "azimuth": "azimuth_rad",
        "elevation": "elevation_rad",
    }
    assert found(list(CANONICAL.values())) == {
        "time": ("time_s", "s"),
        "range": ("range_m", "m"),
        "azimuth": ("azimuth_rad", "rad"),
        "elevation": ("elevation_rad", "rad"),
    }


@given(st.data())
def test_every_bare_name_with_every_unit_in_any_case_and_order(data: st.DataObject) -> None:
    expected = {}
    for quantity, aliases in ALIASES.items():
        stem = data.draw(st.sampled_from(aliases))
        unit = data.draw(st.sampled_from(list(UNITS[quantity])))
        name = data.draw(st.sampled_from([f"{stem}_{unit}", f"{stem}_{unit}".upper(), f"{stem.capitalize()}_{unit}"]))
        expected[quantity] = (name, unit)
    names = data.draw(st.permutations([name for name, _ in expected.values()]))
    assert found(names) == expected


@pytest.mark.parametrize(
    "names", [["t", "R", "A", "E"], ["Time", "Range", "AZ", "El"], ["T", "r", "azimuth", "ELEVATION"]]
)
def test_bare_names_are_si_unless_units_say_otherwise(names: list[str]) -> None:
    assert [unit for _, unit in found(names).values()] == ["s", "m", "rad", "rad"]
    units = {"time": "ms", "range": "km", "azimuth": "deg", "elevation": "mil"}
    assert [unit for _, unit in found(names, units).values()] == ["ms", "km", "deg", "mil"]


def test_the_exact_canonical_name_wins_over_bare_names() -> None:
    names = ["T", "A", "E", "R", "time", *CANONICAL.values()]
    assert [name for name, _ in found(names).values()] == list(CANONICAL.values())


def test_components_may_be_absent_but_not_all() -> None:
    assert set(found(["time_s", "azimuth_rad", "elevation_rad"])) == {"time", "azimuth", "elevation"}
    sentence = refused(["time_s", "Rnge", "speed"])
    assert "neither range nor azimuth nor elevation" in sentence
    assert 'did you mean "Rnge"?' in sentence
    assert "Its columns are: time_s, Rnge, speed." in sentence
    assert "--columns range=Rnge." in sentence


def test_a_log_without_time_lists_its_columns_and_the_nearest_one() -> None:
    sentence = refused(["Tme_s", "range_m"])
    assert "no time column (expected time_s or time or t)" in sentence
    assert 'did you mean "Tme_s"?' in sentence
    assert "Its columns are: Tme_s, range_m." in sentence
    assert "--columns time=Tme_s." in sentence


def test_a_truth_is_not_taken_for_a_log_with_a_strange_azimuth() -> None:
    sentence = refused(["time_s", "x_m", "y_m", "z_m", "ax_mps2", "ay_mps2", "az_mps2"])
    assert (
        "x_m, y_m, z_m are columns of a truth, for `ftproc score TRAJECTORY --truth log.csv`, not of a log: it has"
        in sentence
    )


def test_a_long_list_of_columns_is_cut() -> None:
    sentence = refused([f"c{index}" for index in range(50)])
    assert "c19 and 30 more" in sentence
    assert "c20" not in sentence


def test_a_file_without_names_is_read_by_numbers() -> None:
    names = ["1", "2", "3", "4"]
    assert "--columns time=NAME,range=NAME,azimuth=NAME,elevation=NAME." in refused(names)
    columns = {"time": "1", "azimuth": "3"}
    assert found(names, columns=columns) == {"time": ("1", "s"), "azimuth": ("3", "rad")}
    assert found(["UTC", "RNG"], columns={"time": "1", "range": "2"})["range"] == ("RNG", "m")


@pytest.mark.parametrize(
    "pair", [("range_m", "range_km"), ("R", "r"), ("range", "R"), ("range_ft", "R"), ("range_m", "RANGE_M")]
)
def test_two_columns_for_one_quantity_are_refused_and_columns_decides(pair: tuple[str, str]) -> None:
    names = ["time_s", *pair]
    sentence = refused(names)
    assert f"columns {pair[0]} and {pair[1]} could each be the range" in sentence
    assert f"--columns range={pair[0]}" in sentence
    assert found(names, columns={"range": pair[1]})["range"][0] == pair[1]


def test_a_needed_name_there_twice_is_refused_an_unneeded_one_is_not() -> None:
    assert 'column "range_m" is there 2 times' in refused(["time_s", "range_m", "range_m"])
    assert 'column "X" is there 2 times' in refused(["time_s", "X", "X"], columns={"range": "X"})
    assert found(["time_s", "range_m", "note", "note"])["range"] == ("range_m", "m")


def test_named_columns_take_their_unit_from_units_else_from_the_name_else_si() -> None:
    names = ["T0", "RNG", "enc_az_deg", "E"]
    columns = {"time": "T0", "range": "RNG", "azimuth": "enc_az_deg"}
    assert found(names, {}, columns)["azimuth"] == ("enc_az_deg", "deg")
    assert found(names, {"azimuth": "mil", "range": "km"}, columns) == {
        "time": ("T0", "s"),
        "range": ("RNG", "km"),
        "azimuth": ("enc_az_deg", "mil"),
        "elevation": ("E", "rad"),
    }


def test_a_column_given_to_one_quantity_is_not_taken_for_another() -> None:
    assert found(["t", "E", "R"], columns={"azimuth": "E"}) == {
        "time": ("t", "s"),
        "range": ("R", "m"),
        "azimuth": ("E", "rad"),
    }


def test_a_named_column_that_is_absent_is_refused_with_the_nearest() -> None:
    sentence = refused(["time_s", "RNG1", "A"], columns={"range": "RNG"})
    assert (
        'there is no column "RNG", which --columns or the station file names for range; did you mean "RNG1"?'
        in sentence
    )
    assert "Its columns are: time_s, RNG1, A." in sentence


def test_none_says_that_a_quantity_is_absent() -> None:
    assert set(found(["t", "R", "A"], columns={"range": "none"})) == {"time", "azimuth"}


def test_a_name_and_units_that_contradict_are_refused_and_the_cure_works() -> None:
    sentence = refused(["time_s", "range_km"], {"range": "m"})
    assert 'the name of column "range_km" says km, but --units says range=m' in sentence
    assert "--columns range=range_km --units range=m" in sentence
    assert found(["time_s", "range_km"], {"range": "m"}, {"range": "range_km"})["range"] == ("range_km", "m")
    assert found(["time_s", "range_km"], {"range": "km"})["range"] == ("range_km", "km")


def test_an_unknown_unit_in_a_name_is_not_taken_for_an_angles_only_log() -> None:
    sentence = refused(["time_s", "range_furlong", "azimuth_rad"])
    assert '"furlong" in column "range_furlong" is not a unit of range; understood are m, km, ft, nmi, nm' in sentence
    assert "--columns range=none" in sentence
    assert set(found(["time_s", "range_furlong", "azimuth_rad"], columns={"range": "none"})) == {"time", "azimuth"}
    assert '"furlong"' in refused(["time_s", "Range [furlong]"], columns={"range": "Range [furlong]"})
    stated = found(["time_s", "Range [furlong]"], {"range": "201.168 m"}, {"range": "Range [furlong]"})
    assert stated["range"] == ("Range [furlong]", "201.168 m")
    assert "range=none" not in refused(["time_fortnight", "range_m"])
    assert "time=none" not in refused(["time_fortnight", "range_m"])


def test_rates_and_sigmas_are_not_taken_for_a_quantity_in_an_unknown_unit() -> None:
    names = ["time_s", "range_rate", "range_sigma", "azimuth_rad"]
    assert set(found(names)) == {"time", "azimuth"}
    assert set(found(["time_s", "range_m", "range_furlong"])) == {"time", "range"}


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [("Range (km)", "range", "km"), ("EL[gon]", "elevation", "gon"), ("Az [ deg ]", "azimuth", "deg"),
     ("R_NM", "range", "nm"), ("time [ms]", "time", "ms")],
)  # fmt: skip
def test_units_in_brackets(name: str, quantity: str, unit: str) -> None:
    names = ["t", "A", name] if quantity == "range" else ["t", "R", name] if quantity != "time" else [name, "R"]
    assert found(names)[quantity] == (name, unit)


def test_an_unknown_unit_in_brackets() -> None:
    assert '"furlong" in column "Range (furlong)" is not a unit of range' in refused(["t", "Range (furlong)", "A"])


def test_what_a_user_should_know_of_the_columns() -> None:
    names = ["time_s", "RNG", "A", "el_deg", "note"]
    units, columns = parse_units("az=deg"), {"range": "RNG"}
    taken = resolve("log.csv", names, units, columns)
    assert remarks(names, taken, False) == ('no unit is stated, so these are taken to be: "RNG" in m',)
    taken = resolve("log.csv", ["t", "A", "x", "y"], {}, {})
    assert remarks(["t", "A", "x", "y"], taken, True) == (
        'no unit is stated, so these are taken to be: "A" in rad',
        "no column is taken for range and elevation; not used: x, y",
    )
    assert remarks(["time_s", "range_m"], resolve("log.csv", ["time_s", "range_m"], {}, {}), False) == ()


@pytest.mark.parametrize(
    ("names", "answer"),
    [
        (
            ["time_s", "range_m", "elevation_rad", "drive azimuth_rad"],
            "--columns 'azimuth=drive azimuth_rad', or --",
        ),
        (["time_s", "range_m", "azimuth_rad", "phi"], "--columns elevation=phi, or --columns elevation=none"),
        (["time_s", "rho", "theta", "phi"], "--columns azimuth=theta,elevation=phi or --columns azimuth=phi,elev"),
        (["time_s", "azimuth_rad", "elevation_rad", "range fine_m"], "--columns 'range=range fine_m', or --columns"),
    ],
)
def test_a_component_is_not_left_out_without_a_word(names: list[str], answer: str) -> None:
    with pytest.raises(InputError) as question:
        resolve("a.csv", names, {}, {})
    assert answer in str(question.value)


@pytest.mark.parametrize("other", ["azimuth_rate_dps", "azimuth_sigma_rad", "azimuth offset (deg)", "heading"])
def test_what_is_of_another_kind_is_no_component(other: str) -> None:
    assert set(resolve("a.csv", ["time_s", "range_m", "elevation_rad", other], {}, {})) == {
        "time", "range", "elevation",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("Range (x1000 ft)", "x1000 ft"),
        ("Range [100 m]", "100 m"),
        ("Range in 0.1 m", "0.1 m"),
        ("Range (10⁻³ km)", "10^-3 km"),
        ("Range (m, 0-5000)", "m"),
        ("Range (mm)", "mm"),
        ("Range (MM)", "mm"),
    ],
)
def test_a_factor_in_the_brackets_of_a_unit_is_applied(name: str, unit: str) -> None:
    assert found(["t", name])["range"] == (name, unit)


@pytest.mark.parametrize("inside", ["1000's of ft", "LSB 100 m", "m x 100", "hundreds of m", "Mm", "m / 10"])
def test_what_stands_beside_a_unit_and_is_no_plain_factor_is_asked_about(inside: str) -> None:
    for stem in ("Range", "R"):
        sentence = refused(["t", f"{stem} ({inside})", "az_deg"]) if (stem, inside) != ("R", "Mm") else "--units range="
        assert "--units range=" in sentence
    assert found(["t", f"Range ({inside})"], {"range": "100 m"}, {"range": "2"})["range"][1] == "100 m"


def test_angles_in_hours_are_refused_unless_the_user_says_degrees() -> None:
    names = ["t", "Range (m)", "Az (hms)", "El (deg)"]
    assert "Convert it to degrees (15 to the hour)" in refused(names)
    assert found(names, {"azimuth": "deg"})["azimuth"] == ("Az (hms)", "deg")


def test_the_limits_of_an_angle_beside_its_unit_are_no_factor() -> None:
    for inside in ("0-360 deg", "0 to 360 deg", "±180 deg", "deg, 0..360", "deg true"):
        assert found(["t", f"Azimuth ({inside})"])["azimuth"][1] == "deg"


def test_t_s_is_a_time_in_s_and_ts_a_time_stamp() -> None:
    names = ["t_s", "range_m"]
    assert remarks(names, resolve("a", names, {}, {}), False) == ()
    assert found(["TS", "range_m"])["time"] == ("TS", "s")


def test_a_truth_is_not_explained_as_a_log() -> None:
    sentence = refused(["time_s", "x_m", "y_m", "z_m"])
    assert "ftproc score TRAJECTORY --truth log.csv" in sentence
    assert "--columns" not in sentence


def test_a_time_in_ms_is_no_fraction_of_itself() -> None:
    assert found(["seconds_ms", "range_m", "azimuth_rad", "elevation_rad"])["time"] == ("seconds_ms", "ms")


def test_of_two_times_with_words_beside_none_is_taken() -> None:
    message = refused(["recv_time_s", "sensor_time_s", "range_m", "azimuth_rad"])
    assert "recv_time_s and sensor_time_s could each be the time" in message


@pytest.mark.parametrize("name", ["flight_time_s", "dwell_time_ms", "time_to_go_s", "time_error_ms"])
def test_durations_are_no_time(name: str) -> None:
    assert "no time column" in refused([name, "range_m", "azimuth_rad", "elevation_rad"])


def test_remarks_are_no_elevation() -> None:
    assert "elevation" not in found(["time_s", "dist_m", "hz_deg", "remark"])
    assert "elevation=q" in refused(["time_s", "dist_m", "hz_deg", "q"])
