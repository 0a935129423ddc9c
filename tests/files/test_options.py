"""The text of --units and --columns."""

from collections.abc import Callable

import pytest

from ftproc.errors import UsageError
from ftproc.files.options import Condition, parse_columns, parse_units, parse_where, parse_widths


def test_units_from_text_and_from_a_mapping_are_the_same() -> None:
    expected = {"range": "km", "azimuth": "deg", "time": "ms"}
    assert parse_units("range=km,azimuth=deg,time=ms") == expected
    assert parse_units(" R = km , Az=deg, t=ms,") == expected
    assert parse_units({"range": "km", "az": "deg", "time": "ms"}) == expected
    assert parse_units(None) == parse_units("") == {}


def test_columns_from_text_and_from_a_mapping_are_the_same() -> None:
    assert parse_columns("time=T0, R=Slant Range") == {"time": "T0", "range": "Slant Range"}
    assert parse_columns({"t": "T0", "range": "Slant Range"}) == {"time": "T0", "range": "Slant Range"}


@pytest.mark.parametrize(
    ("parse", "text", "sentence"),
    [
        (parse_units, "range=ell", '--units: "ell" is not a unit of range; understood are m, km, ft, nmi, nm'),
        (
            parse_units,
            "azimuth=dge",
            'cdeg, turn, bam16, arcmin, arcsec; did you mean "deg',
        ),
        (parse_units, "azimuth=m", '--units: "m" is not a unit of azimuth'),
        (
            parse_units,
            "azimth=deg",
            '; did you mean "azimuth"?',
        ),
        (parse_units, "km", '--units: "km" is not QUANTITY=NAME, as in range=km,azimuth=deg'),
        (parse_units, "range=", '--units: "range=" is not QUANTITY=NAME'),
        (parse_units, "range=km,R=m", "--units names range twice"),
        (parse_columns, "T0", '--columns: "T0" is not QUANTITY=NAME, as in time=T0,range=RNG'),
        (
            parse_columns,
            "speed=V",
            '"speed" is not a quantity of a log; expected time, range, azimuth, elevation',
        ),
        (parse_columns, "range=X,azimuth=X", '--columns: column "X" cannot be both range and azimuth'),
        (parse_columns, "time=A,t=B", "--columns names time twice"),
        (parse_columns, "time=none", "--columns: a log must have a time"),
    ],
)
def test_the_fault_of_an_option_is_named(parse: Callable[[str], object], text: str, sentence: str) -> None:
    with pytest.raises(UsageError) as caught:
        parse(text)
    assert sentence in str(caught.value)


def test_units_may_be_spelt_out() -> None:
    assert parse_units("range=Kilometres,az=degrees,time=milliseconds") == {
        "range": "km",
        "azimuth": "deg",
        "time": "ms",
    }


def test_conditions_on_rows_and_widths() -> None:
    assert parse_where(("quality >= 5", "mode=auto", "a b!=x")) == (
        Condition("quality", ">=", "5"),
        Condition("mode", "=", "auto"),
        Condition("a b", "!=", "x"),
    )
    assert parse_widths("8, 10,9") == parse_widths([8, 10, 9]) == (8, 10, 9)
    for text in ("quality", "quality>=", "=5"):
        with pytest.raises(UsageError, match="is not a condition such as quality>=5"):
            parse_where(text)
    for text in ("8,x", "0,5", "8,-1", "8,,9"):
        with pytest.raises(UsageError, match="is not a list of whole numbers above zero"):
            parse_widths(text)
