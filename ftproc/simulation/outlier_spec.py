"""The outlier specification: one line of text that says which outliers a log gets. Grammar in `GRAMMAR`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from ftproc.errors import UsageError, nearest
from ftproc.records import COMPONENTS

GRAMMAR = """\
Items separated by commas, or `none`. A RANGE is LOW-HIGH or one number; sizes are drawn log-uniformly from
it, lengths and seconds uniformly.

  isolated=RATE[:SIZE]            each sample is hit with this probability      isolated=0.05:20-200
  offset=COUNT[:LENGTH[:SIZE]]    constant error over consecutive samples       offset=2:4-30:8-60
  ramp=COUNT[:LENGTH[:SIZE]]      error grows linearly, then snaps back         ramp=1:10-30:8-40
  stuck=COUNT[:LENGTH]            the reading before is repeated                stuck=3:5-20
  burst=COUNT[:LENGTH[:SIZE]]     zero-mean noise of SIZE sigmas                burst=2:4-12:10-80
  patch=COUNT[:LENGTH[:SIZE]]     any of the four above                         patch=3:4-30:8-100
  start=COUNT[:SIZE]              the first COUNT samples are off               start=6:50
  zero=RATE                       the reading is 0                              zero=0.005
  nan=RATE                        the reading is missing                        nan=0.02
  nanrun=COUNT[:LENGTH]           missing over consecutive samples              nanrun=2:5-30
  round=SIZE                      readings rounded to multiples of SIZE         range.round=0.5m

RATE is a share of the samples (0 to 1), COUNT a number of times, LENGTH a RANGE of samples (default 4-30),
SIZE a RANGE in sigmas of the component's noise (default 5-100), with the suffix m in metres (range) or mrad
in milliradians (azimuth, elevation); its sign is random. Each component is hit on its own. A prefix
confines an item to one (range.isolated=0.1:20-200m, azimuth., elevation.) or hits all at the same samples
(all.offset=1).

For the whole log, without a prefix:

  jitter=FRACTION                 times off the grid by up to this share of dt  jitter=0.2
  gap=COUNT:SECONDS               rows removed for a RANGE of seconds           gap=2:5-15
  duplicates=COUNT                rows whose time appears twice                 duplicates=10
  correlation=SECONDS             noise correlated in time, exp(-t/SECONDS)     correlation=1.5
  tails=DOF                       Student-t noise of the same sigma             tails=6
"""

Range = tuple[float, float]


class _Value(NamedTuple):
    """A value as written: a range (one number: low = high) and its unit."""

    low: float
    high: float
    unit: str = "sigma"


class _Field(NamedTuple):
    """Meaning and example of a field, the check of its range, and whether a range is allowed at all."""

    meaning: str
    example: str
    valid: Callable[[float, float], bool]
    ranged: bool = False


_FIELDS = {
    "rate": _Field("a share from 0 to 1", "0.05", lambda _, high: high <= 1.0),
    "count": _Field("a whole number", "3", lambda low, high: low.is_integer() and high <= 1e6),
    "length": _Field(
        "a whole number of samples or a range", "4-30",
        lambda low, high: low.is_integer() and high.is_integer() and low >= 1 and high <= 1e6, ranged=True,
    ),
    "size": _Field(
        "a number of sigmas or a range, with the suffix m or mrad if absolute", "8-100",
        lambda low, _: low > 0, ranged=True,
    ),
    "fraction": _Field("a share of the sample interval from 0 to below 0.5", "0.2", lambda _, high: high < 0.5),
    "seconds": _Field("a number of seconds or a range", "5-15", lambda low, _: low > 0, ranged=True),
    "dof": _Field("a number of degrees of freedom above 2", "6", lambda low, _: low > 2),
}  # fmt: skip
_FORMS: dict[str, tuple[str, ...]] = {  # the first field is required
    "isolated": ("rate", "size"),
    "offset": ("count", "length", "size"),
    "ramp": ("count", "length", "size"),
    "stuck": ("count", "length"),
    "burst": ("count", "length", "size"),
    "patch": ("count", "length", "size"),
    "start": ("count", "size"),
    "zero": ("rate",),
    "nan": ("rate",),
    "nanrun": ("count", "length"),
    "round": ("size",),
}
_LOG_FORMS: dict[str, tuple[str, ...]] = {
    "jitter": ("fraction",),
    "gap": ("count", "seconds"),
    "duplicates": ("count",),
    "correlation": ("seconds",),
    "tails": ("dof",),
}
_NUMBER = r"(\d+(?:\.\d*)?(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)"
_RANGE = re.compile(rf"{_NUMBER}(?:-{_NUMBER})?(m|mrad)?")


@dataclass(frozen=True)
class Fault:
    """One item of the specification, for some components: at the same samples when `together`, else independently.

    rate: share of samples. count: times. length: samples, from and to. size: from and to, in `unit`: sigma, m, mrad.
    """

    kind: str
    components: tuple[int, ...] = (0, 1, 2)
    together: bool = False
    rate: float = 0.0
    count: int = 0
    length: tuple[int, int] = (4, 30)
    size: Range = (5.0, 100.0)
    unit: str = "sigma"


@dataclass(frozen=True)
class OutlierSpec:
    """The contamination of a log: `faults` of the readings; the rest holds for the whole log (see `GRAMMAR`).

    jitter: share of the sample interval. gaps: pairs of count and range of seconds. correlation_s: correlation time of
    the noise, 0 for white. tails_dof: degrees of freedom of Student-t noise, None for Gaussian.
    """

    faults: tuple[Fault, ...] = ()
    jitter: float = 0.0
    gaps: tuple[tuple[int, Range], ...] = ()
    duplicates: int = 0
    correlation_s: float = 0.0
    tails_dof: float | None = None


def parse_outliers(text: str) -> OutlierSpec:
    """Read an outlier specification (see `GRAMMAR`).

    Raises UsageError, naming the item, what was expected and a valid example.
    """
    items = [item.strip() for item in text.split(",")]
    if items == ["none"]:
        return OutlierSpec()
    faults: list[Fault] = []
    gaps: list[tuple[int, Range]] = []
    once: dict[str, float] = {}
    for item in items:
        prefix, kind, values = _split(item)
        if kind in _FORMS:
            faults.append(_fault(item, prefix, kind, values))
        elif kind == "gap":
            gaps.append((int(values["count"].low), values["seconds"][:2]))
        elif kind in once:
            raise UsageError(f'Outlier specification: "{kind}" is given twice; keep one of them.')
        else:
            once[kind] = next(iter(values.values())).low
    return OutlierSpec(
        faults=tuple(faults),
        jitter=once.get("jitter", 0.0),
        gaps=tuple(gaps),
        duplicates=int(once.get("duplicates", 0)),
        correlation_s=once.get("correlation", 0.0),
        tails_dof=once.get("tails"),
    )


def _split(item: str) -> tuple[str, str, dict[str, _Value]]:
    """`prefix.kind=value:value` as prefix, kind and its values by field."""
    name, equals, rest = item.partition("=")
    prefix, dot, kind = name.strip().rpartition(".")
    forms = {**_FORMS, **_LOG_FORMS}
    if kind == "none" and not equals:
        raise UsageError('Outlier specification: "none" stands alone; drop it or the other items.')
    if kind not in forms:
        what = f'unknown item "{item}"' if item else "an item is empty"
        raise UsageError(
            f"Outlier specification: {what}{nearest(kind, forms) or '.'} It takes {', '.join(forms)} or none."
        )
    form = forms[kind]
    example = f"{kind}={':'.join(_FIELDS[field].example for field in form)}"
    if not equals:
        raise UsageError(f'Outlier specification: "{item}" lacks its value; write {example}.')
    if dot and kind in _LOG_FORMS:
        raise UsageError(f'Outlier specification: "{kind}" holds for the whole log; drop "{prefix}.".')
    if dot and prefix not in (*COMPONENTS, "all"):
        raise UsageError(
            f'Outlier specification: unknown component "{prefix}" in "{item}"; it takes {", ".join(COMPONENTS)} or all.'
        )
    texts = rest.split(":")
    if len(texts) > len(form) or (kind == "gap" and len(texts) != 2):
        raise UsageError(f'Outlier specification: "{item}" has {len(texts)} values; write {example}.')
    return prefix, kind, {field: _value(item, field, text) for field, text in zip(form, texts, strict=False)}


def _value(item: str, name: str, text: str) -> _Value:
    """The value of one field. Raises UsageError when it is not a valid one."""
    field = _FIELDS[name]
    if match := _RANGE.fullmatch(text.strip()):
        low, high, unit = float(match[1]), float(match[2] or match[1]), match[3] or "sigma"
        allowed = (field.ranged or match[2] is None) and (name == "size" or unit == "sigma")
        if allowed and low <= high < math.inf and field.valid(low, high):
            return _Value(low, high, unit)
    raise UsageError(
        f'Outlier specification: in "{item}" the {name} is "{text}"; expected {field.meaning}, such as {field.example}.'
    )


def _fault(item: str, prefix: str, kind: str, values: dict[str, _Value]) -> Fault:
    components = (COMPONENTS.index(prefix),) if prefix in COMPONENTS else (0, 1, 2)
    default = Fault(kind)
    size = values.get("size", _Value(*default.size))
    if size.unit != "sigma" and (len(components) > 1 or (size.unit == "m" and components != (0,))):
        raise UsageError(
            f'Outlier specification: in "{item}" the size is in {size.unit}, which not every component has; '
            f"write {'range' if size.unit == 'm' else 'azimuth'}.{kind}=… or give sigmas."
        )
    if size.unit == "mrad" and components == (0,):
        raise UsageError(f'Outlier specification: in "{item}" a range cannot be off by mrad; use m or sigmas.')
    length = values.get("length", _Value(*default.length))
    return Fault(
        kind=kind,
        components=components,
        together=prefix == "all",
        rate=values["rate"].low if "rate" in values else default.rate,
        count=int(values["count"].low) if "count" in values else default.count,
        length=(int(length.low), int(length.high)),
        size=size[:2],
        unit=size.unit,
    )
