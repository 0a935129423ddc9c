"""Readings as they are kept in a window: columns that grow at the end and are cut at the beginning, and which of the
readings merely repeat the one before."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing import outlier_chain
from ftproc.core.editing.screening import SHORTEST_STUCK, STUCK_ODDS
from ftproc.order_statistics import medians
from ftproc.records import FloatArray

LONGEST_ISOLATED = 2  # readings rejected in a row; more make a patch
RECENT = 50  # samples whose noise the next ones are taken to have
ROOM = 2  # times what is kept: so rarely is it copied


class Columns:
    """Arrays (n, ...) of the same length, by name."""

    def __init__(self, **arrays: Any) -> None:
        self._arrays = {name: array.copy() for name, array in arrays.items()}
        self._count = len(next(iter(arrays.values())))

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, name: str) -> Any:
        return self._arrays[name][: self._count]

    def append(self, **new: Any) -> None:
        """Add rows to each."""
        count = self._count + len(next(iter(new.values())))
        for name, more in new.items():
            array = self._arrays[name]
            if count > len(array):
                grown = np.zeros((ROOM * count, *array.shape[1:]), array.dtype)
                grown[: self._count] = array[: self._count]
                self._arrays[name] = array = grown
            array[self._count : count] = more
        self._count = count

    def forget(self, rows: int) -> None:
        """Remove the first rows of each."""
        for array in self._arrays.values():
            array[: self._count - rows] = array[rows : self._count].copy()
        self._count -= rows


class Labels:
    """Good, isolated, patch or missing (0 to 3) for each reading as it comes, from the decisions so far."""

    def __init__(self) -> None:
        self.run = np.zeros(4, int)  # of rejected readings, up to the newest, of three components and range rates

    def add(self, used: FloatArray, measurement: FloatArray) -> FloatArray:
        """(n, c) of the next readings; used (n, c) above zero for those that are good."""
        label = np.full(used.shape, 3.0)
        for c in range(used.shape[1]):
            there = np.flatnonzero(np.isfinite(measurement[:, c]))
            good = used[there, c] > 0
            rejected = np.cumsum(~good) + self.run[c]  # up to each reading, less those up to the last good one
            run = rejected - np.maximum.accumulate(np.where(good, rejected, 0))
            label[there, c] = np.where(good, 0.0, np.where(run > LONGEST_ISOLATED, 2.0, 1.0))
            self.run[c] = run[-1] if len(run) else self.run[c]
        return label

    def reset(self, used: FloatArray, measurement: FloatArray) -> None:
        """Count again from the decisions (n, c) on the readings so far."""
        for c in range(used.shape[1]):
            good = used[np.isfinite(measurement[:, c]), c] > 0
            last = np.flatnonzero(good)
            self.run[c] = len(good) - 1 - last[-1] if len(last) else len(good)


def labelled(used: FloatArray, measurement: FloatArray) -> FloatArray:
    """(n, 4) labels of readings and range rates from the decisions (n, 4) on them."""
    of_all = [
        (np.ascontiguousarray(used[:, of]), np.ascontiguousarray(measurement[:, of])) for of in ([0, 1, 2], [3, 3, 3])
    ]
    first, rates = (outlier_chain.label_runs(weight, z, LONGEST_ISOLATED) for weight, z in of_all)
    return np.column_stack([first, rates[:, 0]])


class Repeats:
    """How often readings repeat the one before, component by component, as in `screening.stuck`, but as they come."""

    def __init__(self) -> None:
        self.last, self.run = np.full(3, np.nan), np.zeros(3, int)
        self.seen, self.ended = np.zeros(3, int), np.zeros(3, int)  # readings, and repeats in runs that are over

    def stuck(self, measurement: FloatArray) -> list[tuple[int, int, int]]:
        """Row, component and length so far of the runs of repeats among the next rows (n, 3) that chance does not
        explain."""
        found = []
        for c in range(3):
            rows = np.flatnonzero(np.isfinite(measurement[:, c]))
            if not len(rows):
                continue
            values = np.concatenate([self.last[c : c + 1], measurement[rows, c]])
            same = values[1:] == values[:-1]
            self.last[c] = values[-1]
            if not same.any() and not self.run[c]:
                self.seen[c] += len(rows)
                continue
            for k, repeated in zip(rows.tolist(), same.tolist(), strict=True):
                self.seen[c] += 1
                if not repeated:
                    self.ended[c] += self.run[c]
                    self.run[c] = 0
                    continue
                self.run[c] += 1
                if self.run[c] >= self._unlikely(c):
                    found.append((k, c, int(self.run[c])))
        return found

    def runs(
        self, new: FloatArray, measurement: FloatArray
    ) -> tuple[list[tuple[int, int]], list[tuple[NDArray[np.int64], int]]]:
        """Row and component of such repeats among the next rows (n, 3); and the samples of their runs, with those
        before, among all readings (m, 3), and component."""
        found, n = self.stuck(new), len(measurement) - len(new)
        repeated = []
        for (k, c, run), after in itertools.zip_longest(found, found[1:]):
            if after is None or after[1:] != (c, run + 1):  # the run ends here, and holds those before
                repeated.append((np.flatnonzero(np.isfinite(measurement[: n + k + 1, c]))[-run:], c))
        return [each[:2] for each in found], repeated

    def _unlikely(self, c: int) -> float:
        """Repeats in a row that chance does not make, where so many of the earlier readings were repeats."""
        chance = self.ended[c] / self.seen[c]
        if chance >= 1:
            return math.inf
        return max(math.log(STUCK_ODDS / self.seen[c]) / math.log(max(chance, 1e-300)), SHORTEST_STUCK - 1)


def used_lately(measurement: FloatArray, weight: FloatArray, count: int) -> FloatArray:
    """(3,) share of each component's last `count` readings (n, 3) that is used, by their weights (n, 3)."""
    found = np.zeros(3)
    for c in range(3):
        seen = np.flatnonzero(np.isfinite(measurement[:, c]))[-count:]
        found[c] = (weight[seen, c] > 0).mean() if len(seen) else 0.0
    return found


def typical(times: FloatArray, late: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How the noise of the readings after some others differs, see `Uneven`: (3,) each."""
    return medians(times[-RECENT:]), late[-1].copy()
