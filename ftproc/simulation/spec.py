"""The outlier specification: one line of text that says how a log is spoiled. Grammar in `GRAMMAR`."""

from __future__ import annotations

import re
from dataclasses import dataclass

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
_EXPECTED = {  # field -> what it is, an example
    "rate": ("a share from 0 to 1", "0.05"),
    "count": ("a whole number", "3"),
    "length": ("a whole number of samples or a range", "4-30"),
    "size": ("a number of sigmas or a range, with the suffix m or mrad if absolute", "8-100"),
    "fraction": ("a share of the sample interval from 0 to below 0.5", "0.2"),
    "seconds": ("a number of seconds or a range", "5-15"),
    "dof": ("a number of degrees of freedom above 2", "6"),
}
_NUMBER = r"(\d+(?:\.\d*)?(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)"
_RANGE = re.compile(rf"{_NUMBER}(?:-{_NUMBER})?(m|mrad)?")


@dataclass(frozen=True)
class Fault:
    """One item that spoils readings of its components: at the same samples when `together`, else each by
    itself.

    rate: share of samples. count: times. length: samples, from and to. size: from and to, in `unit`: sigma,
    m, mrad.
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
    """How a log is spoiled: readings by `faults`; the rest holds for the whole log (see `GRAMMAR`).

    jitter: share of the sample interval. gaps: pairs of count and range of seconds. correlation_s:
    correlation time of the noise, 0 for white. tails_dof: degrees of freedom of Student-t noise, None for
    Gaussian.
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
        prefix, kind, fields = _split(item)
        if kind in _FORMS:
            faults.append(_fault(item, prefix, kind, fields))
        elif kind == "gap":
            gaps.append((int(fields["count"][0]), fields["seconds"][:2]))
        elif kind in once:
            raise UsageError(f'Outlier specification: "{kind}" is given twice; keep one of them.')
        else:
            once[kind] = next(iter(fields.values()))[0]
    return OutlierSpec(
        faults=tuple(faults),
        jitter=once.get("jitter", 0.0),
        gaps=tuple(gaps),
        duplicates=int(once.get("duplicates", 0)),
        correlation_s=once.get("correlation", 0.0),
        tails_dof=once.get("tails"),
    )


def _split(item: str) -> tuple[str, str, dict[str, tuple[float, float, str]]]:
    """`prefix.kind=field:field` as prefix, kind and its fields by name, each low, high, unit."""
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
    if not equals:
        raise UsageError(f'Outlier specification: "{item}" lacks its value; write {kind}={_example(forms[kind])}.')
    if dot and kind in _LOG_FORMS:
        raise UsageError(f'Outlier specification: "{kind}" holds for the whole log; drop "{prefix}.".')
    if dot and prefix not in (*COMPONENTS, "all"):
        raise UsageError(
            f'Outlier specification: unknown component "{prefix}" in "{item}"; it takes {", ".join(COMPONENTS)} or all.'
        )
    values = rest.split(":")
    form = forms[kind]
    if len(values) > len(form) or (kind == "gap" and len(values) != 2):
        raise UsageError(f'Outlier specification: "{item}" has {len(values)} values; write {kind}={_example(form)}.')
    return prefix, kind, {f: _field(item, f, v) for f, v in zip(form, values, strict=False)}


def _example(form: tuple[str, ...]) -> str:
    return ":".join(_EXPECTED[field][1] for field in form)


def _field(item: str, field: str, text: str) -> tuple[float, float, str]:
    """Low, high and unit of one value, checked."""
    match = _RANGE.fullmatch(text.strip())
    if match:
        low = float(match[1])
        high = low if match[2] is None else float(match[2])
        unit = match[3] or "sigma"
        ranged = match[2] is not None
        if _valid(field, low, high, unit, ranged):
            return low, high, unit
    what, example = _EXPECTED[field]
    raise UsageError(f'Outlier specification: in "{item}" the {field} is "{text}"; expected {what}, such as {example}.')


def _valid(field: str, low: float, high: float, unit: str, ranged: bool) -> bool:
    if not low <= high < float("inf") or (unit != "sigma" and field != "size"):
        return False
    whole = low.is_integer() and high.is_integer()
    if field in ("rate", "fraction", "count", "dof") and ranged:
        return False
    checks = {
        "rate": high <= 1.0,
        "count": whole and high <= 1e6,
        "length": whole and low >= 1 and high <= 1e6,
        "size": low > 0,
        "fraction": high < 0.5,
        "seconds": low > 0,
        "dof": low > 2,
    }
    return checks[field]


def _fault(item: str, prefix: str, kind: str, fields: dict[str, tuple[float, float, str]]) -> Fault:
    components = (COMPONENTS.index(prefix),) if prefix in COMPONENTS else (0, 1, 2)
    default = Fault(kind)
    low, high, unit = fields.get("size", (*default.size, "sigma"))
    if unit != "sigma" and components != ((0,) if unit == "m" else (components[0],)):
        raise UsageError(
            f'Outlier specification: in "{item}" the size is in {unit}, which not every component has; '
            f"write {'range' if unit == 'm' else 'azimuth'}.{kind}=… or give sigmas."
        )
    if unit == "mrad" and components == (0,):
        raise UsageError(f'Outlier specification: in "{item}" a range cannot be off by mrad; use m or sigmas.')
    length = fields.get("length", (*default.length, ""))
    return Fault(
        kind=kind,
        components=components,
        together=prefix == "all",
        rate=fields.get("rate", (0.0, 0.0, ""))[0],
        count=int(fields.get("count", (0.0, 0.0, ""))[0]),
        length=(int(length[0]), int(length[1])),
        size=(low, high),
        unit=unit,
    )
