"""The outlier specification: what is written is read, what is wrong is refused in a plain sentence."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ftproc.errors import UsageError
from ftproc.records import COMPONENTS
from ftproc.simulation import GRAMMAR, Fault, OutlierSpec, contamination, parse_outliers, simulate
from tests.simulated import codes

numbers = st.floats(0.01, 500).map(lambda x: f"{x:.3g}").filter(lambda s: "e" not in s)


@st.composite
def ranges(draw: st.DrawFn, whole: bool = False) -> tuple[str, tuple[float, float]]:
    if whole:
        low, high = sorted(draw(st.tuples(st.integers(1, 50), st.integers(1, 50))))
        texts: tuple[str, str] = (str(low), str(high))
    else:
        a, b = sorted(draw(st.tuples(numbers, numbers)), key=float)
        texts = (a, b)
    if draw(st.booleans()):
        return texts[0], (float(texts[0]), float(texts[0]))
    return "-".join(texts), (float(texts[0]), float(texts[1]))


PREFIXES: dict[str, tuple[tuple[int, ...], bool, int]] = {
    "": ((0, 1, 2), False, 0),
    "all.": ((0, 1, 2), True, 0),
    "one.": ((0, 1, 2), True, 1),
    "two.": ((0, 1, 2), True, 2),
    "azimuth+elevation.": ((1, 2), True, 0),
    **{f"{name}.": ((c,), False, 0) for c, name in enumerate(COMPONENTS)},
}
RATED = ("isolated", "zero", "nan", "onesided", "held")
SIZED, COPIED = (*contamination.SHAPES, *contamination.DRAWN), contamination.COPIES


@st.composite
def items(draw: st.DrawFn) -> tuple[str, Fault]:
    prefix = draw(st.sampled_from(list(PREFIXES)))
    kind = draw(st.sampled_from([*RATED, *SIZED, *COPIED, "start", "step", "nanrun"]))
    text, fields = f"{prefix}{kind}=", dict[str, Any]()
    if kind in RATED:
        rate = draw(st.integers(0, 100)) / 100
        text, fields = text + f"{rate}", {"rate": rate}
    else:
        count = draw(st.integers(0, 20))
        text, fields = text + f"{count}", {"count": count}
    if kind in (*SIZED, *COPIED, "nanrun") and draw(st.booleans()):
        unit, place = draw(st.sampled_from(["", "s", "%"])), draw(st.sampled_from(["", "@start", "@end"]))
        length, bounds = draw(ranges(whole=not unit))
        text = f"{text}:{length}{unit}{place}"
        fields |= {"length": bounds, "length_unit": unit or "samples", "place": place[1:]}
    sized = kind in ("isolated", "onesided", "start", "step") or (kind in SIZED and "length" in fields)
    if sized and draw(st.booleans()):
        size, fields["size"] = draw(ranges())
        unit = draw(st.sampled_from({"range.": ["", "m"], "azimuth.": ["", "mrad"]}.get(prefix, [""])))
        text, fields["unit"] = f"{text}:{size}{unit}", unit or "sigma"
    return text, Fault(kind, *PREFIXES[prefix], **fields)


@given(st.lists(items(), min_size=1, max_size=6), st.booleans())
def test_a_written_specification_is_read_back(written: list[tuple[str, Fault]], spaced: bool) -> None:
    spec = parse_outliers((" , " if spaced else ",").join(text for text, _ in written))
    assert spec == OutlierSpec(faults=tuple(fault for _, fault in written))


def refusal(text: str) -> str | None:
    try:
        parse_outliers(text)
    except UsageError as error:
        return str(error)
    return None


@given(st.text(alphabet="isolatedngpr=:,.-0123456789m ", max_size=30))
def test_any_text_is_read_or_refused_in_a_plain_sentence(text: str) -> None:
    sentence = refusal(text)
    assert sentence is None or (sentence.startswith("Outlier specification: ") and sentence.endswith("."))


@settings(max_examples=40)
@given(st.lists(items(), min_size=1, max_size=4), st.integers(0, 1000), st.integers(2, 60))
def test_any_specification_contaminates_any_log(written: list[tuple[str, Fault]], seed: int, duration: int) -> None:
    """Readings without a code are clean or missing, and the truth is row for row."""
    spec = ",".join(text for text, _ in written)
    flight = simulate("zuo2021", seed=seed, duration_s=float(duration), outliers=spec)
    assert len(flight.log) == len(flight.truth) == duration + 1
    same = (flight.log.measurement == flight.clean) | np.isnan(flight.log.measurement)
    assert same[codes(flight) == 0].all()


def test_log_wide_items() -> None:
    spec = parse_outliers(
        "jitter=0.2,gap=2:5-15,gap=1:3,duplicates=10,correlation=1.5,tails=6,isolated=1e-2:5-2e1,"
        "clock=1:0.5,late=2:1-2,two.noise=1:33%:0-3,noise=1"
    )
    assert spec == OutlierSpec(
        faults=(Fault("isolated", rate=0.01, size=(5.0, 20.0)),),
        jitter=0.2,
        gaps=((2, (5.0, 15.0)), (1, (3.0, 3.0))),
        duplicates=10,
        correlation_s=1.5,
        tails_dof=6.0,
        clock=((1, (0.5, 0.5)),),
        late=((2, (1.0, 2.0)),),
        noise=(
            Fault("noise", (0, 1, 2), True, 2, count=1, length=(33, 33), length_unit="%", size=(0.0, 3.0)),
            Fault("noise", count=1, size=(10.0, 10.0)),
        ),
    )


def test_every_example_of_the_grammar_is_valid() -> None:
    examples = re.findall(r"(?:^|\s|\()((?:[a-z]+\.)?[a-z]+=[0-9](?:[0-9.:%@a-z-]*[0-9a-z%])?)", GRAMMAR)
    assert len(examples) == 24
    for example in examples:
        parse_outliers(example)


OUTLIER_ERRORS = [
    ("spikes=3", 'unknown item "spikes=3"; did you mean "sine"? It takes isolated, offset'),
    ("", "an item is empty. It takes isolated"),
    ("isolated=0.1,", "an item is empty"),
    ("none,isolated=0.1", '"none" stands alone; drop it or the other items.'),
    ("isolated", '"isolated" lacks its value; write isolated=0.05:8-100.'),
    ("gap", '"gap" lacks its value; write gap=3:5-15.'),
    ("gap=2", '"gap=2" has 1 values; write gap=3:5-15.'),
    ("stuck=2:4-9:8-20", '"stuck=2:4-9:8-20" has 3 values; write stuck=3:4-30.'),
    ("range.jitter=0.1", '"jitter" holds for the whole log; drop "range.".'),
    ("east.isolated=0.1", 'unknown component "east" in "east.isolated=0.1"; it takes range, azimuth,'),
    ("isolated=5", 'in "isolated=5" the rate is "5"; expected a share from 0 to 1, such as 0.05.'),
    ("isolated=0.1-0.2", 'the rate is "0.1-0.2"; expected a share'),
    ("isolated=-0.1", 'the rate is "-0.1"; expected a share'),
    ("isolated=nan", 'the rate is "nan"; expected a share'),
    ("isolated=0.1:200-20", 'the size is "200-20"; expected a number of sigmas or a range'),
    ("isolated=0.1:0", 'the size is "0"; expected'),
    ("isolated=0.1:1e999", 'the size is "1e999"; expected'),
    ("offset=1.5", 'the count is "1.5"; expected a whole number, such as 3.'),
    ("offset=1m", 'the count is "1m"; expected a whole number'),
    ("offset=1:0-3", 'the length is "0-3"; expected a whole number of samples or a range, or one of seconds'),
    ("offset=1:2.5", 'the length is "2.5"; expected a whole number of samples'),
    ("offset=1:5s@middle", 'the length is "5s@middle"; expected a whole number of samples'),
    ("isolated=0.1:20@end", 'the size is "20@end"; expected a number of sigmas'),
    ("range+height.step=1", 'unknown component "range+height" in "range+height.step=1"; it takes range, azimuth,'),
    ("noise=1:20:-1", 'the factor is "-1"; expected a factor from 0'),
    ("interpolated=0.5", 'the spacing is "0.5"; expected a number of samples from 1, such as 4.5.'),
    ("jitter=0.5", 'the fraction is "0.5"; expected a share of the sample interval from 0 to below 0.5'),
    ("gap=1:0", 'the seconds is "0"; expected a number of seconds or a range, such as 5-15.'),
    ("tails=2", 'the dof is "2"; expected a number of degrees of freedom above 2, such as 6.'),
    ("jitter=0.1,jitter=0.2", '"jitter" is given twice; keep one of them.'),
    ("isolated=0.1:20-200m", "the size is in m, which not every component has; write range.isolated=… or give sigmas."),
    ("azimuth.isolated=0.1:20m", "the size is in m, which not every component has; write range.isolated=…"),
    ("all.offset=1:4:2mrad", "the size is in mrad, which not every component has; write azimuth.offset=…"),
    ("range.isolated=0.1:2mrad", "a range cannot be off by mrad; use m or sigmas."),
]  # fmt: skip


@pytest.mark.parametrize(("text", "sentence"), OUTLIER_ERRORS)
def test_outlier_errors_name_the_item_and_the_cure(text: str, sentence: str) -> None:
    with pytest.raises(UsageError) as caught:
        simulate("zuo2021", outliers=text)
    assert str(caught.value).startswith("Outlier specification: ")
    assert sentence in str(caught.value)
