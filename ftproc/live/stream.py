"""What comes of a stream: bytes in, rows of one track or of several out. The same bytes at the same times of its clock
give the same rows, so what a run that was killed has done is done again from what it kept."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from ftproc.config.recipe import Recipe
from ftproc.errors import InputError, UsageError
from ftproc.files.options import ABSENT
from ftproc.live.columns import Reader
from ftproc.live.lines import forms
from ftproc.live.lines.growing import LINES, Block, Lines, Say, SeveralTargets
from ftproc.live.lines.plots import Plots, is_asterix
from ftproc.live.live import Live
from ftproc.live.sources import cannot_be_corrected, is_network
from ftproc.live.stop import Stop
from ftproc.live.times import Pause, Rows, Times, Verdict
from ftproc.records import FloatArray, IntArray, Trajectory
from ftproc.settings import Station

AT_ONCE_S = 0.1  # that a push of some rows may take, about, so that a stop is heard between two
LATE = 100  # rows that came too late, after which it is said
SAID = 3  # lines that are not understood, after which no more of them are named
MOST_TARGETS = 256


class Stream:
    """A log that is followed. tracks: by the target; one, of no name, where nobody asked for a target.

    taken, timed, untimed: rows that have been read, that are used, and that have no time. bad: lines that were not
    understood. wrong: rows whose time is. others: rows of more targets than are followed. unused: rows that had been
    read when a stop was overdue. fault: the row for which nothing more is read.
    """

    #: Of what is kept for a crash.
    kept_apart = ("source", "recipe", "target", "coast_s", "fault", "_say", "_reader", "_only")

    def __init__(self, source: str, recipe: Recipe, say: Say, coast_s: float = 0.0) -> None:
        """coast_s: how long a track goes on in a pause. Raises UsageError."""
        if recipe.station.refraction is not None:
            raise UsageError(
                "--follow corrects no refraction, which needs the ranges around each reading; leave it out."
            )
        self.source, self.recipe, self.coast_s, self._say = source, recipe, coast_s, say
        self.target, _, self._only = ("" if recipe.target == ABSENT else recipe.target).partition("=")
        self.tracks = dict[str, Live]()
        self.taken = self.timed = self.bad = self.others = self.unused = self.untimed = self.wrong = 0
        self._times, self._late_before = dict[str, Times](), 0
        self.fault: InputError | None = None
        self._pauses = dict[str, Pause]()
        self._lines: Lines | Plots = Lines(source)
        self._form = forms.Form()
        self._reader, self._head = Reader(source, recipe, say), list[str]()
        self._begun, self._at_once, self._said_late = False, 1, False

    @property
    def station(self) -> Station:
        """The conventions of the log, with what its names say once they are known."""
        return self._reader.station

    @property
    def late(self) -> int:
        """Rows that came too late to be used."""
        return self._late_before + sum(track.late for track in self.tracks.values())

    def understand_again(self) -> None:
        """When the rest is as it was kept: the table, from its first lines."""
        if isinstance(self._lines, Plots):
            self._of_plots(self._lines)
        said, self._reader._say = self._reader._say, lambda _: None
        self._reader.read(Block(1, self._head))
        self._reader._say = said

    def _of_plots(self, plots: Plots) -> None:
        """What comes are plots, whose standard says where azimuths count from."""
        self._lines, station = plots, replace(self.recipe.station, azimuth_from="north")
        self.recipe = replace(self.recipe, station=station)
        self._reader = Reader(self.source, self.recipe, self._say)

    def begin_again(self, news: str) -> None:
        """The content is another one."""
        cut = self._lines.begin_again()
        then = "goes on" if is_network(self.source) else "is read on from the beginning of its new content"
        left_out = " The last line of the old content was not complete, and is left out." if cut else ""
        self._say(f"{self.source}: {news}, and {then}.{left_out}")

    def take(self, data: bytes, now_s: float, stop: Stop) -> Iterator[Trajectory]:
        """The rows that are published when these bytes come, at a time of the clock. Raises InputError."""
        if not self._begun and not self._lines.number and is_asterix(data):
            self._of_plots(Plots())
        for block in self._lines.blocks(data):
            if stop.overdue or self.fault is not None:
                return
            yield from self._rows(block, now_s, stop)

    def tick(self, now_s: float, stop: Stop) -> Iterator[Trajectory]:
        """The rows that are published when nothing comes until a time of the clock."""
        for name, track in self.tracks.items():
            if self._confirmed_s(name) <= now_s:
                yield from self._sorted(name, self._times[name].rest(), now_s, stop)
            if track.due_s <= now_s:
                yield from self._named(name, track.due(now_s))
            if self._pauses[name].due_s(track, self.coast_s) <= now_s:
                yield from self._named(name, self._pauses[name].coast(track))

    def work(self) -> bool:
        """Do now what the next rows of a track would have to wait for; whether there was anything."""
        return any(track.work() for track in self.tracks.values())  # of the first that has something to do

    @property
    def due_s(self) -> float:
        """When there is something to do, by the clock."""
        return min(
            (min(track.due_s, self._pauses[name].due_s(track, self.coast_s), self._confirmed_s(name))
             for name, track in self.tracks.items()), default=math.inf
        )  # fmt: skip

    def _confirmed_s(self, name: str) -> float:
        """When a row far ahead has waited for the next one for long enough."""
        times = self._times[name]
        return self._pauses[name].came_s + times.wait_s if times.waiting else math.inf

    def finish(self, stop: Stop) -> Iterator[Trajectory]:
        """The rows that wait, when nothing more comes. Raises InputError, when they are out, for a row that was not
        understood, and when no row came."""
        try:
            if self.fault is None:
                if self.source == "-" and not stop.asked:
                    for block in self._lines.last():
                        yield from self._rows(block, math.inf, stop)
                self._reader.finish()
                self._say_what_is_left_out()
        except InputError as error:
            self.fault = self.fault or error
        if self.unused:
            self._say(f"{self.source}: stopped before {self.unused} rows that had been read were used.")
        for name in self.tracks:
            yield from self._sorted(name, self._times[name].rest(), math.inf, stop)
            yield from self._named(name, self.tracks[name].finish())
        if self.fault is not None:
            raise self.fault

    def _say_what_is_left_out(self) -> None:
        if not self.timed and self._only and self.taken > self.untimed:
            raise InputError(f"{self.source}: no row meets {self.target}={self._only}; check the column and the value.")
        if not self.timed:
            raise InputError(f"{self.source}: no row has a time, so nothing is written; fill the times in.")
        for count, what in (
            (self.untimed, "rows have no time, and are left out"),
            (self.bad, "lines were not understood, and are left out"),
            (self.wrong, "rows have times far ahead of those around them, and are left out"),
            (self._form.damaged, "sentences have a wrong checksum, and are left out"),
            (self.others, f"rows are of other targets than the first {MOST_TARGETS}, and are left out"),
        ):
            if count:
                self._say(f"{self.source}: {count} {what}.")

    # -- lines, readings, tracks ------------------------------------------------------------------------------------

    def _rows(self, block: Block, now_s: float, stop: Stop) -> Iterator[Trajectory]:
        """What is published of some lines."""
        if not self._begun:
            found = (forms.of(line) for line in block.texts if not line.lstrip().startswith("#"))
            self._form = next(filter(None, found), self._form)
        for readings, fault, line in self._read(block):
            yield from self._take(readings, line, now_s, stop)
            if fault is not None:
                self._leave_out(fault)
            if self.fault is not None:
                return

    def _read(self, block: Block) -> Iterator[tuple[FloatArray, InputError | None, str]]:
        """The readings of some lines, the error of the row after them, and the last of the lines. One by one where
        lines become rows of a table, rows are distinguished by a target, or one from the network is damaged. Raises
        InputError."""
        one_by_one = bool(self.target) or type(self._form) is not forms.Form
        if not one_by_one:
            readings, fault, _ = self._understood(block)
            one_by_one = fault is not None and cannot_be_corrected(self.source)
            one_by_one &= not isinstance(fault, SeveralTargets)
            if not one_by_one:
                yield readings, fault, ""
        if one_by_one:
            for k, line in enumerate(block.texts, block.first):
                yield self._understood(Block(k, [line]))

    def _understood(self, block: Block) -> tuple[FloatArray, InputError | None, str]:
        try:
            table = self._form.table(self.source, block)
            if not self._begun:
                self._head += table.texts
            readings, fault = self._reader.read(table)
        except InputError as error:
            if not self._begun:
                raise
            return np.empty((0, 5)), error, ""
        self._begun |= len(readings) > 0
        return readings, fault, table.texts[-1]

    def _leave_out(self, fault: InputError) -> None:
        """A line of the network or of a serial line may be damaged; a log that has a bad one is corrected first."""
        if not cannot_be_corrected(self.source) or isinstance(fault, SeveralTargets):
            self.fault = fault
            return
        self.bad += 1
        if self.bad <= SAID:
            self._say(f"{fault}{' No more of them are named.' if self.bad == SAID else ''}")

    def _take(self, readings: FloatArray, line: str, now_s: float, stop: Stop) -> Iterator[Trajectory]:
        timed = np.flatnonzero(np.isfinite(readings[:, 0]))
        numbers, self.taken = self.taken + timed, self.taken + len(readings)
        self.untimed += len(readings) - len(timed)
        if not len(timed):
            return
        name = (self._reader.cell(line, self.target) or "") if self.target else ""
        if self._only and name != self._only:
            return
        self.timed += len(timed)
        if name not in self.tracks:
            if len(self.tracks) >= MOST_TARGETS:
                self.others += len(timed)
                return
            self.tracks[name], self._times[name] = self._new_track(), Times()
        self._pauses[name] = Pause(now_s)
        times = self._times[name]
        if not math.isfinite(times.interval_s):
            times.interval_s = self.tracks[name].interval_s
        yield from self._sorted(name, times.sorted(readings[timed], numbers, self.tracks[name].late_s), now_s, stop)

    def _new_track(self) -> Live:
        beside = self._reader.beside
        return Live(
            self.recipe.settings, None, beside.rate is not None, beside.barometric, self.recipe.model, beside.prior
        )

    def _sorted(
        self, name: str, found: Iterable[tuple[Verdict, Rows]], now_s: float, stop: Stop
    ) -> Iterator[Trajectory]:
        """What is published of rows whose times are judged."""
        for verdict, (readings, numbers) in found:
            if verdict == Verdict.WRONG:
                self.wrong += 1
                if self.wrong <= SAID:
                    more = " No more of them are named." if self.wrong == SAID else ""
                    self._say(
                        f"{self.source}: row {numbers[0]} has the time {readings[0, 0]:.10g} s, far ahead of the rows "
                        f"around it, and is left out.{more}"
                    )
                continue
            if verdict == Verdict.NEW:
                before, track = self.tracks[name], self._new_track()
                self._say(
                    f"{self.source}: the times go back from {before.newest_s:.10g} to {readings[0, 0]:.10g} s and on "
                    "from there; a new track begins."
                )
                yield from self._named(name, before.finish())
                self._late_before, self.tracks[name] = self._late_before + before.late, track
            for part in self._push(self.tracks[name], readings, numbers, now_s, stop):
                yield from self._named(name, part)

    def _push(
        self, track: Live, readings: FloatArray, numbers: IntArray, now_s: float, stop: Stop
    ) -> Iterator[Trajectory]:
        """Push as few rows at once as keep a stop from waiting for long; what is published does not depend on it."""
        low = 0
        while low < len(readings) and not stop.overdue:
            began_s, high = time.monotonic(), low + self._at_once
            time_s, range_m, azimuth_rad, elevation_rad, rate_mps = readings[low:high].T
            number = numbers[low:high]
            yield track.push(time_s, range_m, azimuth_rad, elevation_rad, number, now_s, range_rate_mps=rate_mps)
            slow = time.monotonic() - began_s > AT_ONCE_S
            self._at_once = max(self._at_once // 2, 1) if slow else min(2 * self._at_once, LINES)
            low = high
        self.unused += max(len(readings) - low, 0)
        if self.late >= LATE and not self._said_late:
            self._said_late = True
            self._say(
                f"{self.source}: {LATE} rows came too late to be used: the time of a row before them is "
                f"{track.newest_s:g} s. If that is wrong, correct it, and follow the log again."
            )

    def _named(self, name: str, part: Trajectory) -> Iterator[Trajectory]:
        """The rows, if there are any, with a column that names their target."""
        if len(part):
            if self.target and not self._only:
                import pyarrow as pa

                names = pa.array([name] * len(part))
                both = pa.table({self.target: names})
                if part.extra is not None:
                    both = part.extra.append_column(self.target, names)
                part = replace(part, extra=both)
            yield part
