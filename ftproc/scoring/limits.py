"""Limits on the errors of a trajectory: a TOML file, or one of the public standards that come with the program.

    [[require]]
    what = "position horizontal"    # a name of `named.errors`
    share = 0.95                    # of the rows, at least
    below_m = 50

A limit is one of: `share` with `below_UNIT`; `rms_below_UNIT`; `bias_below_UNIT`; `sigma_below_UNIT` (the standard
deviation); `share` with `inside_sigmas`, for position, velocity, acceleration and cleaned readings; and, of `estimate`,
the `share` of the truth's rows that have one. `where` and `source` are carried through to the output.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ftproc.errors import InputError, UsageError
from ftproc.records import FloatArray, Trajectory, Truth
from ftproc.scoring import named
from ftproc.scoring.matching import match

STANDARDS = Path(__file__).parent / "standards"
ESTIMATE, CLEANED = "estimate", "cleaned"
_SIZE = ("rms", "bias", "sigma")
_STATE_COLUMNS = {"position": slice(0, 3), "velocity": slice(3, 6), "acceleration": slice(6, 9)}
_WORDS = {"m": "m", "rad": "rad", "mps": "m/s", "mps2": "m/s2"}
_MOST_BYTES = 1 << 20


class Limit(NamedTuple):
    """kind: share, rms, bias, sigma, sigmas or estimate. below: the bound, in the unit of `what`. share: of rows."""

    what: str
    kind: str
    below: float
    share: float
    where: str = ""

    @property
    def words(self) -> str:
        """The limit as a sentence part, such as `95 % below 50 m`."""
        if self.kind == ESTIMATE:
            return f"{100 * self.share:g} % of the truth's rows"
        if self.kind == "sigmas":
            return f"{100 * self.share:g} % inside {self.below:g} sigmas"
        bound = f"{self.below:g} {_WORDS[named.unit(self.what)]}"
        return f"{100 * self.share:g} % below {bound}" if self.kind == "share" else f"{self.kind} below {bound}"


class Limits(NamedTuple):
    """title and source of the whole; its limits."""

    title: str
    source: str
    limits: tuple[Limit, ...]


class Result(NamedTuple):
    """found: the share, or the figure in the unit of what. passed: None where nothing could be measured."""

    limit: Limit
    found: float
    passed: bool | None

    @property
    def verdict(self) -> str:
        return "no data" if self.passed is None else "PASS" if self.passed else "FAIL"

    @property
    def words(self) -> str:
        """The figure that was found, in its unit."""
        if self.passed is None:
            return "-"
        if self.limit.kind in ("share", "sigmas", ESTIMATE):
            return f"{100 * self.found:.2f} %"
        return f"{self.found:.4g} {_WORDS[named.unit(self.limit.what)]}"


def standards() -> list[str]:
    """The names of the standards that come with the program."""
    return sorted(path.stem for path in STANDARDS.glob("*.toml"))


def load(name: str) -> Limits:
    """The limits of a file, or of a standard by its name, in capitals or not. Raises UsageError for what cannot be
    understood."""
    called = name if Path(name).exists() else name.lower()
    path = STANDARDS / f"{called}.toml" if called in standards() else Path(name)
    try:
        content = path.read_bytes()[: _MOST_BYTES + 1]
        if len(content) > _MOST_BYTES:
            raise UsageError(f"{name}: this is no file of limits: it is larger than {_MOST_BYTES >> 20} MB.")
        found = tomllib.loads(content.decode("utf-8-sig"))
    except OSError as error:
        known = ", ".join(standards())
        raise UsageError(
            f"{name}: there is no such file of limits ({(error.strerror or str(error)).lower()}), and no standard of "
            f"that name; there are {known}."
        ) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UsageError(f"{name}: this is not TOML: {error}.") from error
    lines = found.get("require")
    if not isinstance(lines, list) or not lines:
        raise UsageError(f"{name}: there is no limit in it; write [[require]], what = ..., share = ..., below_m = ...")
    limits = tuple(_limit(name, number, line) for number, line in enumerate(lines, 1))
    return Limits(str(found.get("title", Path(name).stem)), str(found.get("source", "")), limits)


def _limit(name: str, number: int, line: Any) -> Limit:
    """One [[require]]. Raises UsageError."""
    where = f"{name}: [[require]] number {number}"
    if not isinstance(line, Mapping) or not isinstance(line.get("what"), str):
        raise UsageError(f"{where}: it has no what = ..., such as {', '.join(named.names()[:1])} or range.")
    what = str(line["what"])
    allowed = [*named.names(), ESTIMATE, CLEANED]
    if what not in allowed:
        raise UsageError(f'{where}: what = "{what}" is none of {", ".join(allowed)}.')
    given = {key: line[key] for key in line if key not in ("what", "where", "source")}
    return Limit(what, *_bound(where, what, given), where=str(line.get("where", "")))


def _bound(where: str, what: str, given: Mapping[str, Any]) -> tuple[str, float, float]:
    """Kind, bound and share of a limit. Raises UsageError."""
    share = _number(where, given, "share", 1.0) if "share" in given else None
    if share is not None and share > 1:
        raise UsageError(f"{where}: share = {share:g} is above 1; write 0.95 for 95 %.")
    rest = [key for key in given if key != "share"]
    if what == ESTIMATE:
        if share is None or rest:
            raise UsageError(f"{where}: of the estimate write its share only, such as share = 0.97.")
        return ESTIMATE, math.inf, share
    units = "" if what == CLEANED else named.unit(what)
    forms = {"inside_sigmas": "sigmas"} if what in (*_STATE_COLUMNS, CLEANED) else {}
    if what != CLEANED:
        forms |= {f"below_{units}": "share"} | {f"{kind}_below_{units}": kind for kind in _SIZE}
    if len(rest) != 1 or rest[0] not in forms:
        raise UsageError(f"{where}: {what} takes one of {', '.join(forms)}, and has {', '.join(rest) or 'none'}.")
    kind, below = forms[rest[0]], _number(where, given, rest[0], math.inf)
    if (share is None) == (kind in ("share", "sigmas")):
        needs = f"{rest[0]} needs a share, such as share = 0.95" if share is None else f"{rest[0]} takes no share"
        raise UsageError(f"{where}: {needs}.")
    return kind, below, 1.0 if share is None else share


def _number(where: str, given: Mapping[str, Any], key: str, most: float) -> float:
    value = given[key]
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
        raise UsageError(f"{where}: {key} = {value!r} is not a number above zero.")
    return float(value)


def judge(trajectory: Trajectory, truth: Truth, limits: Sequence[Limit]) -> list[Result]:
    """Each limit against the errors of a trajectory. Raises InputError when the truth has none of its times."""
    known = match(trajectory.time_s, truth)
    there = np.isfinite(known.position_m).all(1)
    if not there.any():
        raise InputError(f"{truth.name}: its times do not overlap those of {trajectory.name}.")
    errors = named.errors(trajectory, known)
    present = {quantity: columns for quantity, columns in _STATE_COLUMNS.items() if quantity in errors}
    ratios = {q: named.in_sigmas(named.vector(errors, q), trajectory.sigma[:, c]) for q, c in present.items()}
    ratios[CLEANED] = named.of_readings(errors, trajectory)[1]
    estimated = float(np.isfinite(trajectory.state[there, :3]).all(1).mean())
    return [_judged(limit, errors, ratios, estimated) for limit in limits]


def _judged(
    limit: Limit, errors: Mapping[str, FloatArray], ratios: Mapping[str, FloatArray], estimated: float
) -> Result:
    if limit.kind == ESTIMATE:
        return Result(limit, estimated, estimated >= limit.share)
    if limit.kind == "sigmas":
        ratio = ratios.get(limit.what, np.empty((0, 1)))
        inside = np.abs(ratio[np.isfinite(ratio).all(1)]) <= limit.below
        return _at_least(limit, inside.all(1))
    error = errors.get(limit.what, np.empty(0))
    error = error[np.isfinite(error)]
    if not len(error):
        return Result(limit, math.nan, None)
    if limit.kind == "share":
        return _at_least(limit, np.abs(error) <= limit.below)
    spread = named.Spread.of(error)
    found = abs(getattr(spread, limit.kind))
    return Result(limit, found, found <= limit.below)


def _at_least(limit: Limit, inside: Any) -> Result:
    if not len(inside):
        return Result(limit, math.nan, None)
    share = float(inside.mean())
    return Result(limit, share, share >= limit.share)


def as_dicts(results: Sequence[Result]) -> list[dict[str, Any]]:
    """JSON-serialisable: what, the limit in words, the figure found, and whether it is met."""
    return [
        {
            "what": each.limit.what, "where": each.limit.where, "limit": each.limit.words, "found": each.found,
            "passed": each.passed,
        }
        for each in results
    ]  # fmt: skip


def text(name: str, limits: Limits, results: Sequence[Result]) -> str:
    """The results of a trajectory for people: a line each, PASS or FAIL in front; ends with a newline."""
    lines = [f"{name}: {limits.title}", *([f"  source: {limits.source}"] if limits.source else [])]
    rows = [(r.verdict, r.limit.what, r.limit.words, r.words, r.limit.where) for r in results]
    widths = [max(len(row[k]) for row in rows) for k in range(4)]
    for row in rows:
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=False))
        lines.append(f"  {'  '.join(cells)}  {row[4]}".rstrip())
    missed = sum(result.passed is not True for result in results)
    end = f"FAIL: {missed} of {len(results)} limits not met" if missed else f"PASS: all {len(results)} limits met"
    return "\n".join([*lines, f"  {end}"]) + "\n"


def passed(results: Sequence[Result]) -> bool:
    """Whether all limits are met; one that could not be measured is not."""
    return all(result.passed is True for result in results)
