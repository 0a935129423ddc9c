"""Injection of outliers into readings, with a code of each: shapes of patches, and where they lie."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ftproc.records import FlagArray, FloatArray
from ftproc.simulation.outlier_spec import Fault
from ftproc.simulation.sampling import one_side

_UNITS = {"m": 1.0, "mrad": 1e-3}

Draw = np.random.Generator

#: Shape of a patch -> its (n,) errors, from its size and its samples 1 to n.
SHAPES: dict[str, Callable[[float, FloatArray, Draw], FloatArray]] = {
    "offset": lambda size, k, rng: np.full(len(k), size),
    "ramp": lambda size, k, rng: size * k / len(k),
    "burst": lambda size, k, rng: size * rng.standard_normal(len(k)),
    "walkoff": lambda size, k, rng: size * (k / len(k)) ** 2,
    "sine": lambda size, k, rng: size * np.sin(2 * np.pi * rng.integers(2, 7) * k / len(k)),
    "sidelobe": lambda size, k, rng: size * rng.choice([-2.0, -1.0, 1.0, 2.0], 3)[(3 * k - 3).astype(int) // len(k)],
    "other": lambda size, k, rng: size * np.polyval([*rng.standard_normal(2), 1.0], k / len(k)),
}
#: Patch -> its (n,) readings from those before it, (at least 1,), and its own (n,).
COPIES: dict[str, Callable[[FloatArray, FloatArray], FloatArray]] = {
    "stuck": lambda before, own: np.full_like(own, before[-1]),
    "mirror": lambda before, own: 2 * before[-1] - own,
    "replay": lambda before, own: np.resize(before[-len(own) :], len(own)),
    "swap": lambda before, own: np.roll(own, len(own) // 2),
}
#: Kinds of patch of which one is drawn.
DRAWN = {
    "patch": ("offset", "ramp", "stuck", "burst"),
    "mixed": ("offset", "ramp", "walkoff", "sine", "stuck", "mirror", "sidelobe"),
}
#: Codes of the truth's `outlier_*` columns.
CODES = {
    name: code
    for code, name in enumerate(
        ("isolated", "offset", "ramp", "stuck", "burst", "start", "zero", "other", "step", "walkoff", "sine",
         "sidelobe", "mirror", "replay", "swap", "onesided", "held", "interpolated"),
        start=1,
    )
}  # fmt: skip


@dataclass
class _Log:
    """(n, 3) readings and codes, which the faults change; (3,) 1-sigma; s between samples; random numbers."""

    reading: FloatArray
    code: FlagArray
    sigma: FloatArray
    dt_s: float
    rng: Draw

    def errors(self, fault: Fault, component: int, n: int) -> FloatArray:
        """(n,) signed sizes in m or rad, log-uniform in the fault's range."""
        low, high = np.log(fault.size)
        size = np.exp(self.rng.uniform(low, high, n)) * self.rng.choice([-1.0, 1.0], n)
        return np.asarray(size * _UNITS.get(fault.unit, self.sigma[component]))

    def uncontaminated(self, group: tuple[int, ...]) -> NDArray[np.bool_]:
        """(n,) True where no component of the group has an outlier yet."""
        return np.asarray((self.code[:, group] == 0).all(axis=1))

    def groups(self, fault: Fault) -> Iterator[tuple[int, ...]]:
        """The components that are hit at the same samples, for each time that the fault occurs."""
        for group in [fault.components] if fault.together else [(c,) for c in fault.components]:
            for _ in range(fault.times):
                drawn = self.rng.choice(group, fault.drawn, replace=False) if fault.drawn else group
                yield tuple(int(c) for c in drawn)

    def length(self, fault: Fault) -> int:
        """Samples, uniform in the fault's range, which may be in seconds or a share of the log."""
        scale = {"samples": 1.0, "s": 1 / self.dt_s, "%": 0.01 * len(self.code)}[fault.length_unit]
        low, high = (max(1, round(scale * bound)) for bound in fault.length)
        return int(self.rng.integers(low, high + 1))

    def window(self, fault: Fault, group: tuple[int, ...]) -> slice | None:
        """The run of samples at the fault's place, or a random one without outliers, nor on either side; None if there
        is no room.

        Never the first sample: a stuck reading repeats the one before.
        """
        length, n = self.length(fault), len(self.code)
        if fault.place or (length >= n and fault.length_unit == "%"):
            length = min(length, n)
            return slice(n - length, n) if fault.place == "end" else slice(0, length)
        taken = np.concatenate([[0], np.cumsum(~self.uncontaminated(group))])
        if length + 2 > n:
            return None
        free = np.flatnonzero(taken[length + 2 :] == taken[: -(length + 2)])
        if not len(free):
            return None
        first = int(self.rng.choice(free)) + 1
        return slice(first, first + length)


def contaminate(
    reading: FloatArray, faults: tuple[Fault, ...], sigma: FloatArray, dt_s: float, rng: Draw
) -> tuple[FloatArray, FlagArray]:
    """Contaminated copy of (n, 3) readings (m, rad, rad) and the (n, 3) codes of the outliers.

    sigma: (3,) unit of sizes in sigmas. dt_s: interval of the samples. A patch for which the log has no room left is
    left out. An outlier that is then made missing keeps its code; a missing reading alone has none.
    """
    log = _Log(reading.copy(), np.zeros(reading.shape, np.uint8), sigma, dt_s, rng)
    for fault in sorted(faults, key=lambda f: list(_INJECT).index(f.kind)):
        for group in log.groups(fault):
            _INJECT[fault.kind](log, fault, group)
    return log.reading, log.code


def _isolated(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    hit = (log.rng.random(len(log.code)) < fault.rate) & log.uncontaminated(group)
    for c in group:
        log.reading[hit, c] += log.errors(fault, c, int(hit.sum()))
        log.code[hit, c] = CODES["isolated"]


def _patch(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    where = log.window(fault, group)
    kind = str(log.rng.choice(DRAWN[fault.kind])) if fault.kind in DRAWN else fault.kind
    if where is None:
        return
    for c in group:
        size, own = float(log.errors(fault, c, 1)[0]), log.reading[where, c]
        if kind in SHAPES:
            log.reading[where, c] += SHAPES[kind](size, np.arange(1.0, len(own) + 1), log.rng)
        else:
            log.reading[where, c] = COPIES[kind](log.reading[: max(where.start, 1), c], own)
        log.code[where, c] = CODES[kind]


def _start(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    for c in group:
        log.reading[: fault.count, c] += log.errors(fault, c, 1)
        log.code[: fault.count, c] = CODES["start"]


def _step(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    where = one_side(len(log.code), log.rng)
    for c in group:
        code = log.code[where, c]
        log.reading[where, c] += np.where(code == CODES["zero"], 0.0, log.errors(fault, c, 1))
        code[code == 0] = CODES["step"]


def _onesided(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    hit = (log.rng.random(len(log.code)) < fault.rate) & log.uncontaminated(group)
    for c in group:
        log.reading[hit, c] += log.errors(fault, c, 1) * log.rng.exponential(size=int(hit.sum()))
        log.code[hit, c] = CODES["onesided"]


def _zero(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    hit = (log.rng.random(len(log.code)) < fault.rate) & log.uncontaminated(group)
    for c in group:
        log.reading[hit, c] = 0.0
        log.code[hit, c] = CODES["zero"]


def _held(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    fresh = log.rng.random(len(log.code)) >= fault.rate
    fresh[0] = True
    source = np.maximum.accumulate(np.where(fresh, np.arange(len(fresh)), 0))
    for c in group:
        log.reading[:, c] = log.reading[source, c]
        log.code[:, c] = np.where(fresh, log.code[:, c], CODES["held"])


def _interpolated(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    sample = np.arange(len(log.code))
    knots = np.arange(0.0, len(sample), fault.size[0])
    between = np.isin(sample, knots, invert=True) & (sample < knots[-1])
    for c in group:
        values = np.unwrap(log.reading[:, c]) if c == 1 else log.reading[:, c]
        found = np.interp(sample, knots, np.interp(knots, sample, values))
        log.reading[between, c], log.code[between, c] = found[between], CODES["interpolated"]


def _noise(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    where = log.window(fault, group)
    if where is not None:
        log.reading[where, group] *= log.rng.uniform(*fault.size)


def _nan(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    hit = log.rng.random(len(log.code)) < fault.rate
    for c in group:
        log.reading[hit, c] = np.nan


def _nanrun(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    length = log.length(fault)
    first = int(log.rng.integers(0, max(1, len(log.code) - length + 1)))
    for c in group:
        log.reading[first : first + length, c] = np.nan


def _round(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    for c in group:
        step = abs(float(log.errors(fault, c, 1)[0]))
        log.reading[:, c] = step * np.round(log.reading[:, c] / step)


#: In this order: isolated outliers avoid the samples of patches, and missing readings hide all others.
_INJECT: dict[str, Callable[[_Log, Fault, tuple[int, ...]], None]] = {
    "noise": _noise,
    "round": _round,
    "start": _start,
    **dict.fromkeys((*sorted(SHAPES | COPIES, key=lambda kind: CODES[kind]), *DRAWN), _patch),
    "zero": _zero,
    "isolated": _isolated,
    "onesided": _onesided,
    "step": _step,
    "held": _held,
    "interpolated": _interpolated,
    "nan": _nan,
    "nanrun": _nanrun,
}
