"""Readings in the order of their times, for an editor that takes them in no other: late ones wait to be put in their
place, and where the editor has gone past that, it goes back to a copy of itself and on again."""

from __future__ import annotations

import bisect
import copy
import math
from collections import deque
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ftproc.core.live.editor import LiveEditor
from ftproc.core.live.rows import Published
from ftproc.records import FloatArray

COPY_EVERY = 256  # readings between copies, or as many as wait for their lag
REPEATED = 4096  # readings that may be taken again, beside as many as have been taken: so work is bounded
MORE = 2.0  # times the largest lateness seen lately: so long readings are held back
LATELY = 2000  # readings


class _Copy(NamedTuple):
    """An editor that had taken so many readings, the last of them at this time."""

    editor: LiveEditor
    taken: int
    newest_s: float


class Order:
    """An editor and what is held back before it. The editor counts times from the first one.

    hold_s: seconds of the clock that a reading is held back, since others have come so late. left: what has left the
    editor, row by row, and has not been taken from here.
    """

    def __init__(self, editor: LiveEditor, late_s: float) -> None:
        """late_s: by how much less than this a reading may come late."""
        self.editor, self.late_s, self.hold_s = editor, late_s, 0.0
        self.left = deque[Published]()
        self.taken = self.known = 0  # rows that have been taken from `left`, and all that have left
        self.newest_s, self.begins_s = -math.inf, 0.0
        self._held: tuple[list[float], list[FloatArray], list[float]] = [], [], []  # times, readings, arrivals
        self._fed: tuple[list[float], list[FloatArray]] = [], []  # since the oldest copy
        self._copies = deque([_Copy(copy.deepcopy(editor), 0, -math.inf)] if late_s > 0 else [])
        self._count, self._credit = 0, REPEATED  # readings fed, and that may be fed again
        self._latest = [0.0, 0.0]  # largest lateness among the last readings, and among those before
        self._seen = 0

    @property
    def fed_s(self) -> float:
        """The time of the newest reading that the editor has taken."""
        return self._fed_s if self._count else -math.inf

    @property
    def held(self) -> int:
        """How many readings are held back."""
        return len(self._held[0])

    @property
    def held_until_s(self) -> float:
        """The time of the clock at which the first of them is due."""
        return self._held[2][0] + self.hold_s if self.held else math.inf

    def push(self, time_s: FloatArray, measurement: FloatArray, now_s: float) -> None:
        """Take readings whose times never decrease, and none before the newest; now_s: when they came."""
        self._note(len(time_s), 0.0)
        self.newest_s = float(time_s[-1])
        if self.held or self.hold_s > 0:
            times, readings, arrivals = self._held
            times.extend(time_s.tolist())
            readings.extend(measurement)
            arrivals.extend([now_s] * len(time_s))
            self.settle(now_s if now_s < math.inf else -math.inf)
        else:
            self._feed(time_s, measurement)

    def insert(self, time_s: float, measurement: FloatArray, now_s: float) -> bool:
        """Take a reading (3,) that comes after newer ones; whether that is possible."""
        late_s = self.newest_s - time_s
        if late_s >= self.late_s:
            return False
        if time_s < self.fed_s:
            if not self._again(time_s, measurement):
                return False
        else:
            times, readings, arrivals = self._held
            index = bisect.bisect_right(times, time_s)
            arrivals.insert(index, arrivals[index] if index < len(times) else now_s)
            times.insert(index, time_s)
            readings.insert(index, measurement)
        self._note(1, late_s)
        return True

    def settle(self, now_s: float, through_s: float = -math.inf) -> None:
        """Give the editor what need not be held back any more: what is late_s before the newest, has waited its time by
        the clock, or is not after a time of the editor; and what is too much."""
        times, _, arrivals = self._held
        count = max(
            bisect.bisect_left(times, self.newest_s - self.late_s),
            bisect.bisect_right(times, through_s, key=lambda time_s: time_s - self.begins_s),
            bisect.bisect_right(arrivals, now_s, key=lambda came_s: came_s + self.hold_s),
            len(times) - self.editor.pace.sizes.most_waiting,
        )
        if count > 0:
            readings = np.array(times[:count]), np.array(self._held[1][:count])
            for kept in self._held:
                del kept[:count]
            self._feed(*readings)

    def let_leave(self, time_s: float, now_s: float) -> None:
        """Let the rows up to a time leave, without any reading later than that and the lag; see `LiveEditor.tick`."""
        through_s = time_s - self.begins_s + self.editor.lag_s
        self.settle(now_s, through_s)
        self._leave(self.editor.tick(math.nextafter(through_s, math.inf)))

    def finish(self) -> None:
        """Let all leave, when no more readings come."""
        self.settle(math.inf)
        self._leave(self.editor.finish())

    def take(self, count: int) -> Iterator[Published]:
        """The first rows that have left, so many of them."""
        self.taken += count
        while count > 0:
            rows = self.left.popleft()
            if len(rows.rows) > count:
                self.left.appendleft(rows.part(slice(count, None)))
                rows = rows.part(slice(0, count))
            yield rows
            count -= len(rows.rows)

    def _note(self, count: int, late_s: float) -> None:
        self._latest[0] = max(self._latest[0], late_s)
        self._seen += count
        if self._seen >= LATELY:
            self._seen, self._latest = 0, [0.0, self._latest[0]]
        self.hold_s = min(MORE * max(self._latest), self.late_s)

    def _feed(self, time_s: FloatArray, measurement: FloatArray) -> None:
        """The same to the last bit, however many come at once."""
        if not self._copies:
            self._push(time_s, measurement)
            return
        low = 0
        while low < len(time_s):
            due = self._copies[-1].taken + max(COPY_EVERY, self.editor.count - self.editor.published)
            high = low + max(due - self._count, 1)
            self._push(time_s[low:high], measurement[low:high])
            self._fed[0].extend(time_s[low:high].tolist())
            self._fed[1].extend(measurement[low:high])
            if self._count >= due:
                self._copy()
            low = high

    def _push(self, time_s: FloatArray, measurement: FloatArray) -> None:
        if not self._count:
            self.begins_s = float(time_s[0])
        self._leave(self.editor.push(time_s - self.begins_s, measurement))
        self._count, self._fed_s = self._count + len(time_s), float(time_s[-1])
        self._credit += len(time_s)

    def _copy(self) -> None:
        """Keep a copy, and none that no reading can need any more."""
        self._copies.append(_Copy(copy.deepcopy(self.editor), self._count, self._fed_s))
        while len(self._copies) > 1 and self._copies[1].newest_s <= self.newest_s - self.late_s:
            self._copies.popleft()
        beyond = len(self._fed[0]) - (self._count - self._copies[0].taken)
        for kept in self._fed:
            del kept[:beyond]

    def _again(self, time_s: float, measurement: FloatArray) -> bool:
        """Go back to a copy from before a time, and on with that reading in its place; whether that is possible."""
        found = next((each for each in reversed(self._copies) if each.newest_s <= time_s), None)
        if found is None or self._count - found.taken > self._credit:
            return False
        while self._copies[-1] is not found:
            self._copies.pop()
        low = len(self._fed[0]) - (self._count - found.taken)
        times, readings = self._fed[0][low:], self._fed[1][low:]
        for kept in self._fed:
            del kept[low:]
        index = bisect.bisect_right(times, time_s)
        times.insert(index, time_s)
        readings.insert(index, measurement)
        self._credit -= 2 * len(times)  # to which they add when they are taken again
        self.editor, self._count = copy.deepcopy(found.editor), found.taken
        self._forget(found.editor.published)
        self._feed(np.array(times), np.array(readings))
        self.editor.published = max(self.editor.published, self.known)
        return True

    def _forget(self, published: int) -> None:
        """The rows from this one on have not left the editor yet."""
        self.known = max(published, self.taken)
        while self.left and self.left[-1].first >= published:
            self.left.pop()
        if self.left and published < self.left[-1].first + len(self.left[-1].rows):
            rows = self.left.pop()
            self.left.append(rows.part(slice(0, published - rows.first)))

    def _leave(self, found: list[Published]) -> None:
        """Keep what has not left before: the editor may have gone back."""
        for rows in found:
            known = self.known - rows.first
            if len(rows.rows) > known:
                self.left.append(rows.part(slice(known, None)))
                self.known = rows.first + len(rows.rows)
