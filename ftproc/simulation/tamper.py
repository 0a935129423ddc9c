"""Spoil readings as a specification says, and keep book of what was done."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ftproc.records import FlagArray, FloatArray
from ftproc.simulation.spec import Fault

#: Codes of the truth's `outlier_*` columns: what was injected.
SPIKE, OFFSET, RAMP, STUCK, BURST, START, ZERO = 1, 2, 3, 4, 5, 6, 7

_PATCHES = {"offset": OFFSET, "ramp": RAMP, "stuck": STUCK, "burst": BURST}
# Isolated outliers after the patches: they keep off them. Missing readings hide whatever there was.
_ORDER = ("round", "start", "offset", "ramp", "stuck", "burst", "patch", "zero", "isolated", "nan", "nanrun")
_UNITS = {"m": 1.0, "mrad": 1e-3}


@dataclass
class _Bench:
    """What the faults work on: (n, 3) readings and codes, (3,) size of a sigma, the dice."""

    reading: FloatArray
    code: FlagArray
    sigma: FloatArray
    rng: np.random.Generator

    def errors(self, fault: Fault, component: int, n: int) -> FloatArray:
        """(n,) signed sizes in m or rad, log-uniform in the fault's range."""
        low, high = np.log(fault.size)
        size = np.exp(self.rng.uniform(low, high, n)) * self.rng.choice([-1.0, 1.0], n)
        return np.asarray(size * _UNITS.get(fault.unit, self.sigma[component]))

    def untouched(self, group: tuple[int, ...]) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """(n,) True where no component of the group has been tampered with."""
        return np.asarray((self.code[:, group] == 0).all(axis=1))

    def window(self, fault: Fault, group: tuple[int, ...]) -> slice | None:
        """A random run of untouched samples with an untouched one on each side; None if there is no room.

        Never the first sample: a stuck reading needs one before it.
        """
        length = int(self.rng.integers(fault.length[0], fault.length[1] + 1))
        taken = np.concatenate([[0], np.cumsum(~self.untouched(group))])
        if length + 2 > len(self.code):
            return None
        free = np.flatnonzero(taken[length + 2 :] == taken[: -(length + 2)])
        if not len(free):
            return None
        first = int(self.rng.choice(free)) + 1
        return slice(first, first + length)


def tamper(
    reading: FloatArray, faults: tuple[Fault, ...], sigma: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FlagArray]:
    """Spoiled copy of (n, 3) readings (m, rad, rad) and the (n, 3) codes of what was injected.

    sigma: (3,) what a size of 1 sigma means. A patch for which the log has no room left is left out. Codes
    stay where a tampered reading was then made missing; a missing reading alone has no code.
    """
    bench = _Bench(reading.copy(), np.zeros(reading.shape, np.uint8), sigma, rng)
    for fault in sorted(faults, key=lambda f: _ORDER.index(f.kind)):
        groups = [fault.components] if fault.together else [(c,) for c in fault.components]
        for group in groups:
            _APPLY.get(fault.kind, _patches)(bench, fault, group)
    return bench.reading, bench.code


def _isolated(bench: _Bench, fault: Fault, group: tuple[int, ...]) -> None:
    hit = (bench.rng.random(len(bench.code)) < fault.rate) & bench.untouched(group)
    for c in group:
        bench.reading[hit, c] += bench.errors(fault, c, int(hit.sum()))
        bench.code[hit, c] = SPIKE


def _patches(bench: _Bench, fault: Fault, group: tuple[int, ...]) -> None:
    for _ in range(fault.count):
        where = bench.window(fault, group)
        kind = fault.kind if fault.kind != "patch" else str(bench.rng.choice(list(_PATCHES)))
        if where is None:
            continue
        for c in group:
            _patch(bench, fault, kind, c, where)
            bench.code[where, c] = _PATCHES[kind]


def _patch(bench: _Bench, fault: Fault, kind: str, component: int, where: slice) -> None:
    length = where.stop - where.start
    size = bench.errors(fault, component, 1)
    if kind == "stuck":
        bench.reading[where, component] = bench.reading[where.start - 1, component]
    elif kind == "ramp":
        bench.reading[where, component] += size * np.arange(1, length + 1) / length
    elif kind == "burst":
        bench.reading[where, component] += size * bench.rng.standard_normal(length)
    else:
        bench.reading[where, component] += size


def _start(bench: _Bench, fault: Fault, group: tuple[int, ...]) -> None:
    for c in group:
        bench.reading[: fault.count, c] += bench.errors(fault, c, 1)
        bench.code[: fault.count, c] = START


def _zero(bench: _Bench, fault: Fault, group: tuple[int, ...]) -> None:
    hit = (bench.rng.random(len(bench.code)) < fault.rate) & bench.untouched(group)
    for c in group:
        bench.reading[hit, c] = 0.0
        bench.code[hit, c] = ZERO


def _nan(bench: _Bench, fault: Fault, group: tuple[int, ...]) -> None:
    hit = bench.rng.random(len(bench.code)) < fault.rate
    for c in group:
        bench.reading[hit, c] = np.nan


def _nanrun(bench: _Bench, fault: Fault, group: tuple[int, ...]) -> None:
    for _ in range(fault.count):
        length = int(bench.rng.integers(fault.length[0], fault.length[1] + 1))
        first = int(bench.rng.integers(0, max(1, len(bench.code) - length + 1)))
        for c in group:
            bench.reading[first : first + length, c] = np.nan


def _round(bench: _Bench, fault: Fault, group: tuple[int, ...]) -> None:
    for c in group:
        step = abs(float(bench.errors(fault, c, 1)[0]))
        bench.reading[:, c] = step * np.round(bench.reading[:, c] / step)


_APPLY: dict[str, Callable[[_Bench, Fault, tuple[int, ...]], None]] = {
    "isolated": _isolated,
    "start": _start,
    "zero": _zero,
    "nan": _nan,
    "nanrun": _nanrun,
    "round": _round,
}
