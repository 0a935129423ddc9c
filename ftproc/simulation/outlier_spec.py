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
it, lengths, factors and seconds uniformly.

  isolated=RATE[:SIZE]            each sample is hit with this probability      isolated=0.05:20-200
  KIND=COUNT[:LENGTH[:SIZE]]      a patch: consecutive samples are off          ramp=2:10-30:8-40
  step=COUNT[:SIZE]               off from a random sample to the nearer end    azimuth.step=1:10-50
  start=COUNT[:SIZE]              the first COUNT samples are off               start=6:50
  onesided=RATE[:SIZE]            exponential errors to one side                range.onesided=0.5:4-14
  zero=RATE                       the reading is 0                              zero=0.005
  held=RATE                       the reading before is repeated                all.held=0.5
  interpolated=SAMPLES            linear between one reading in so many         all.interpolated=4.5
  nan=RATE                        the reading is missing                        nan=0.02
  nanrun=COUNT[:LENGTH]           missing over consecutive samples              nanrun=2:5-30
  round=SIZE                      readings rounded to multiples of SIZE         range.round=0.5m
  noise=COUNT[:LENGTH[:FACTOR]]   noise times FACTOR (10), without a flag       noise=1:33%:10

KIND of patch: `offset` constant error, `ramp` grows linearly and snaps back, `walkoff` grows with the square of
time, `sine` two to six periods, `burst` zero-mean noise, `sidelobe` hops between one and two SIZEs to both sides,
`other` another smooth track that begins SIZE away; `patch` one of offset, ramp, stuck, burst; `mixed` one of those
with any shape. Without a SIZE: `stuck` the reading before is repeated, `mirror` readings run backward from there,
`replay` the samples before come again, `swap` the two halves are exchanged.

RATE is a share of the samples (0 to 1), COUNT a number of times, LENGTH a RANGE of samples (default 4-30), with the
suffix s of seconds and % of the log, and with @start or @end at that end: offset=1:2-60s:8-60, ramp=1:5%@end.
SIZE is a RANGE in sigmas of the component's noise (default 5-100), with the suffix m in metres (range) or mrad in
milliradians (azimuth, elevation); its sign is random. Each component is hit on its own. A prefix confines an item to
one (range.isolated=0.1:20-200m, azimuth., elevation.) or hits several at the same samples: azimuth+elevation., all.
(all.other=1:20s), or of all `one.` or `two.` that are drawn each time (two.mixed=3:2-20s).

For the whole log, without a prefix:

  jitter=FRACTION                 times off the grid by up to this share of dt  jitter=0.2
  gap=COUNT:SECONDS               rows removed for a RANGE of seconds           gap=2:5-15
  clock=COUNT:SECONDS             time stamps off from a sample to the end      clock=1:0.2-2
  late=COUNT:SECONDS              the same, but the stamps stay even            late=1:0.2-2
  duplicates=COUNT                rows whose time appears twice                 duplicates=10
  correlation=SECONDS             noise correlated in time, exp(-t/SECONDS)     correlation=1.5
  tails=DOF                       Student-t noise of the same sigma             tails=6
"""

Range = tuple[float, float]


class _Value(NamedTuple):
    """A value as written: a range (one number: low = high), its unit, and the end of the log where it lies."""

    low: float
    high: float
    unit: str = ""
    place: str = ""


class _Field(NamedTuple):
    """Meaning and example of a field, the check of its range, whether a range is allowed at all, and suffixes."""

    meaning: str
    example: str
    valid: Callable[[float, float], bool]
    ranged: bool = False
    units: tuple[str, ...] = ()


_FIELDS = {
    "rate": _Field("a share from 0 to 1", "0.05", lambda _, high: high <= 1.0),
    "count": _Field("a whole number", "3", lambda low, high: low.is_integer() and high <= 1e6),
    "length": _Field(
        "a whole number of samples or a range, or one of seconds or percent with the suffix s or %", "4-30",
        lambda low, high: low > 0 and high <= 1e6, True, ("s", "%"),
    ),
    "size": _Field(
        "a number of sigmas or a range, with the suffix m or mrad if absolute", "8-100",
        lambda low, _: low > 0, True, ("m", "mrad"),
    ),
    "factor": _Field("a factor from 0 or a range", "10", lambda _, high: high <= 1e6, True),
    "spacing": _Field("a number of samples from 1", "4.5", lambda low, high: low >= 1 and high <= 1e6),
    "fraction": _Field("a share of the sample interval from 0 to below 0.5", "0.2", lambda _, high: high < 0.5),
    "seconds": _Field("a number of seconds or a range", "5-15", lambda low, _: low > 0, True),
    "dof": _Field("a number of degrees of freedom above 2", "6", lambda low, _: low > 2),
}  # fmt: skip
SHAPED = ("offset", "ramp", "walkoff", "sine", "burst", "sidelobe", "other", "patch", "mixed")
COPIED = ("stuck", "mirror", "replay", "swap")
_FORMS: dict[str, tuple[str, ...]] = {  # the first field is required
    "isolated": ("rate", "size"),
    **dict.fromkeys(SHAPED, ("count", "length", "size")),
    **dict.fromkeys(COPIED, ("count", "length")),
    "step": ("count", "size"),
    "start": ("count", "size"),
    "onesided": ("rate", "size"),
    "zero": ("rate",),
    "held": ("rate",),
    "interpolated": ("spacing",),
    "nan": ("rate",),
    "nanrun": ("count", "length"),
    "round": ("size",),
    "noise": ("count", "length", "factor"),
}
_LOG_FORMS: dict[str, tuple[str, ...]] = {
    "jitter": ("fraction",),
    "gap": ("count", "seconds"),
    "clock": ("count", "seconds"),
    "late": ("count", "seconds"),
    "duplicates": ("count",),
    "correlation": ("seconds",),
    "tails": ("dof",),
}
_SEVERAL = ("gap", "clock", "late")  # may be given more than once
#: Prefix -> components, whether they are hit at the same samples, and how many of them are drawn each time.
_PREFIXES: dict[str, tuple[tuple[int, ...], bool, int]] = {
    "": ((0, 1, 2), False, 0),
    "all": ((0, 1, 2), True, 0),
    "one": ((0, 1, 2), True, 1),
    "two": ((0, 1, 2), True, 2),
}
_FACTOR = 10.0, 10.0  # of noise
_NUMBER = r"(\d+(?:\.\d*)?(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)"
_RANGE = re.compile(rf"{_NUMBER}(?:-{_NUMBER})?(m|mrad|s|%)?(?:@(start|end))?")


@dataclass(frozen=True)
class Fault:
    """One item of the specification, for some components: at the same samples when `together`, else independently.

    drawn: of components hit together, how many are drawn each time, 0 for all. rate: share of samples. count: times,
    or samples of a start. length: from and to, in `length_unit`: samples, s, %. place: at the start or end of the log.
    size: from and to, in `unit`: sigma, m, mrad; a factor of noise; samples from one reading to the
    next interpolated one.
    """

    kind: str
    components: tuple[int, ...] = (0, 1, 2)
    together: bool = False
    drawn: int = 0
    rate: float = 0.0
    count: int = 0
    length: Range = (4, 30)
    length_unit: str = "samples"
    place: str = ""
    size: Range = (5.0, 100.0)
    unit: str = "sigma"

    @property
    def times(self) -> int:
        """How often it occurs: a rate, a grid and a start hold once."""
        return self.count if "count" in _FORMS[self.kind] and self.kind != "start" else 1


@dataclass(frozen=True)
class OutlierSpec:
    """The contamination of a log: `faults` of the readings, `noise` where it is louder or quieter; the rest holds for
    the whole log (see `GRAMMAR`).

    jitter: share of the sample interval. gaps, clock, late: pairs of count and range of seconds. correlation_s:
    correlation time of the noise, 0 for white. tails_dof: degrees of freedom of Student-t noise, None for Gaussian.
    """

    faults: tuple[Fault, ...] = ()
    noise: tuple[Fault, ...] = ()
    jitter: float = 0.0
    gaps: tuple[tuple[int, Range], ...] = ()
    clock: tuple[tuple[int, Range], ...] = ()
    late: tuple[tuple[int, Range], ...] = ()
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
    several: dict[str, list[tuple[int, Range]]] = {kind: [] for kind in _SEVERAL}
    once: dict[str, float] = {}
    for item in items:
        prefix, kind, values = _split(item)
        if kind in _FORMS:
            faults.append(_fault(item, prefix, kind, values))
        elif kind in several:
            several[kind].append((int(values["count"].low), values["seconds"][:2]))
        elif kind in once:
            raise UsageError(f'Outlier specification: "{kind}" is given twice; keep one of them.')
        else:
            once[kind] = next(iter(values.values())).low
    return OutlierSpec(
        faults=tuple(fault for fault in faults if fault.kind != "noise"),
        noise=tuple(fault for fault in faults if fault.kind == "noise"),
        jitter=once.get("jitter", 0.0),
        gaps=tuple(several["gap"]),
        clock=tuple(several["clock"]),
        late=tuple(several["late"]),
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
    if dot and prefix not in _PREFIXES and not set(prefix.split("+")) <= set(COMPONENTS):
        raise UsageError(
            f'Outlier specification: unknown component "{prefix}" in "{item}"; it takes {", ".join(COMPONENTS)}, '
            "several of them joined by +, all, one or two."
        )
    texts = rest.split(":")
    if len(texts) > len(form) or (kind in _SEVERAL and len(texts) != 2):
        raise UsageError(f'Outlier specification: "{item}" has {len(texts)} values; write {example}.')
    return prefix, kind, {field: _value(item, field, text) for field, text in zip(form, texts, strict=False)}


def _value(item: str, name: str, text: str) -> _Value:
    """The value of one field. Raises UsageError when it is not a valid one."""
    field = _FIELDS[name]
    if match := _RANGE.fullmatch(text.strip()):
        low, high, unit, place = float(match[1]), float(match[2] or match[1]), match[3] or "", match[4] or ""
        allowed = (field.ranged or match[2] is None) and unit in ("", *field.units) and (name == "length" or not place)
        whole = name != "length" or unit or (low.is_integer() and high.is_integer())
        if allowed and whole and low <= high < math.inf and field.valid(low, high):
            return _Value(low, high, unit, place)
    raise UsageError(
        f'Outlier specification: in "{item}" the {name} is "{text}"; expected {field.meaning}, such as {field.example}.'
    )


def _fault(item: str, prefix: str, kind: str, values: dict[str, _Value]) -> Fault:
    own = tuple(COMPONENTS.index(name) for name in prefix.split("+") if name in COMPONENTS)
    components, together, drawn = _PREFIXES.get(prefix, (own, len(own) > 1, 0))
    default = Fault(kind)
    usual = _Value(*(_FACTOR if kind == "noise" else default.size))
    size = next((values[field] for field in ("size", "factor", "spacing") if field in values), usual)
    _check_unit(item, kind, components, size.unit)
    length = values.get("length", _Value(*default.length))
    return Fault(
        kind=kind,
        components=components,
        together=together,
        drawn=drawn,
        rate=values["rate"].low if "rate" in values else default.rate,
        count=int(values["count"].low) if "count" in values else default.count,
        length=length[:2],
        length_unit=length.unit or default.length_unit,
        place=length.place,
        size=size[:2],
        unit=size.unit or default.unit,
    )


def _check_unit(item: str, kind: str, components: tuple[int, ...], unit: str) -> None:
    """Raises UsageError for sizes in a unit that the components do not have."""
    if unit and (len(components) > 1 or (unit == "m" and components != (0,))):
        raise UsageError(
            f'Outlier specification: in "{item}" the size is in {unit}, which not every component has; '
            f"write {'range' if unit == 'm' else 'azimuth'}.{kind}=… or give sigmas."
        )
    if unit == "mrad" and components == (0,):
        raise UsageError(f'Outlier specification: in "{item}" a range cannot be off by mrad; use m or sigmas.')
