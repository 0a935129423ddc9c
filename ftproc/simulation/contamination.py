"""Injection of outliers into readings, with a code of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ftproc.records import FlagArray, FloatArray
from ftproc.simulation.outlier_spec import Fault

#: Codes of the truth's `outlier_*` columns.
SPIKE, OFFSET, RAMP, STUCK, BURST, START, ZERO = 1, 2, 3, 4, 5, 6, 7

_PATCHES = {"offset": OFFSET, "ramp": RAMP, "stuck": STUCK, "burst": BURST}
_UNITS = {"m": 1.0, "mrad": 1e-3}


@dataclass
class _Log:
    """(n, 3) readings and codes, which the faults change; (3,) 1-sigma; random numbers."""

    reading: FloatArray
    code: FlagArray
    sigma: FloatArray
    rng: np.random.Generator

    def errors(self, fault: Fault, component: int, n: int) -> FloatArray:
        """(n,) signed sizes in m or rad, log-uniform in the fault's range."""
        low, high = np.log(fault.size)
        size = np.exp(self.rng.uniform(low, high, n)) * self.rng.choice([-1.0, 1.0], n)
        return np.asarray(size * _UNITS.get(fault.unit, self.sigma[component]))

    def uncontaminated(self, group: tuple[int, ...]) -> NDArray[np.bool_]:
        """(n,) True where no component of the group has an outlier yet."""
        return np.asarray((self.code[:, group] == 0).all(axis=1))

    def window(self, fault: Fault, group: tuple[int, ...]) -> slice | None:
        """A random run of samples without outliers, nor on either side; None if there is no room.

        Never the first sample: a stuck reading repeats the one before.
        """
        length = int(self.rng.integers(fault.length[0], fault.length[1] + 1))
        taken = np.concatenate([[0], np.cumsum(~self.uncontaminated(group))])
        if length + 2 > len(self.code):
            return None
        free = np.flatnonzero(taken[length + 2 :] == taken[: -(length + 2)])
        if not len(free):
            return None
        first = int(self.rng.choice(free)) + 1
        return slice(first, first + length)


def contaminate(
    reading: FloatArray, faults: tuple[Fault, ...], sigma: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FlagArray]:
    """Contaminated copy of (n, 3) readings (m, rad, rad) and the (n, 3) codes of the outliers.

    sigma: (3,) unit of sizes in sigmas. A patch for which the log has no room left is left out. An outlier that is then
    made missing keeps its code; a missing reading alone has none.
    """
    log = _Log(reading.copy(), np.zeros(reading.shape, np.uint8), sigma, rng)
    for fault in sorted(faults, key=lambda f: list(_INJECT).index(f.kind)):
        groups = [fault.components] if fault.together else [(c,) for c in fault.components]
        for group in groups:
            _INJECT[fault.kind](log, fault, group)
    return log.reading, log.code


def _isolated(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    hit = (log.rng.random(len(log.code)) < fault.rate) & log.uncontaminated(group)
    for c in group:
        log.reading[hit, c] += log.errors(fault, c, int(hit.sum()))
        log.code[hit, c] = SPIKE


def _patches(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    for _ in range(fault.count):
        where = log.window(fault, group)
        kind = fault.kind if fault.kind != "patch" else str(log.rng.choice(list(_PATCHES)))
        if where is None:
            continue
        for c in group:
            _patch(log, fault, kind, c, where)
            log.code[where, c] = _PATCHES[kind]


def _patch(log: _Log, fault: Fault, kind: str, component: int, where: slice) -> None:
    length = where.stop - where.start
    size = log.errors(fault, component, 1)
    if kind == "stuck":
        log.reading[where, component] = log.reading[where.start - 1, component]
    elif kind == "ramp":
        log.reading[where, component] += size * np.arange(1, length + 1) / length
    elif kind == "burst":
        log.reading[where, component] += size * log.rng.standard_normal(length)
    else:
        log.reading[where, component] += size


def _start(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    for c in group:
        log.reading[: fault.count, c] += log.errors(fault, c, 1)
        log.code[: fault.count, c] = START


def _zero(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    hit = (log.rng.random(len(log.code)) < fault.rate) & log.uncontaminated(group)
    for c in group:
        log.reading[hit, c] = 0.0
        log.code[hit, c] = ZERO


def _nan(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    hit = log.rng.random(len(log.code)) < fault.rate
    for c in group:
        log.reading[hit, c] = np.nan


def _nanrun(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    for _ in range(fault.count):
        length = int(log.rng.integers(fault.length[0], fault.length[1] + 1))
        first = int(log.rng.integers(0, max(1, len(log.code) - length + 1)))
        for c in group:
            log.reading[first : first + length, c] = np.nan


def _round(log: _Log, fault: Fault, group: tuple[int, ...]) -> None:
    for c in group:
        step = abs(float(log.errors(fault, c, 1)[0]))
        log.reading[:, c] = step * np.round(log.reading[:, c] / step)


#: In this order: isolated outliers avoid the samples of patches, and missing readings hide all others.
_INJECT: dict[str, Callable[[_Log, Fault, tuple[int, ...]], None]] = {
    "round": _round,
    "start": _start,
    **dict.fromkeys((*_PATCHES, "patch"), _patches),
    "zero": _zero,
    "isolated": _isolated,
    "nan": _nan,
    "nanrun": _nanrun,
}
