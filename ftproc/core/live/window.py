"""The sliding window of the live editor, and what it carries along: decisions, noise, jerk profile and an anchor.

The window holds the readings that a new decision on the whole situation needs: two-pass editing of all of it, now and
then. Its newest part, from `near` on, is where decisions are still open. A refresh smooths that part alone from the
anchor, the filter's prediction at its first sample, which stands for everything before; decides again; lets the jerk
profile follow; and brings the filter to the newest sample.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from ftproc.core.editing import two_pass
from ftproc.core.filtering.beside import OPEN as RATE_OPEN
from ftproc.core.filtering.forward import Span
from ftproc.core.filtering.records import Model, Observations, Start, Uneven
from ftproc.core.filtering.smoother import PATHS, SmootherRun, smooth_log
from ftproc.core.identification.profile import fit_profile, with_allowance
from ftproc.core.identification.scales import Scales, scales_of
from ftproc.core.live import beside
from ftproc.core.live.kept import Kept
from ftproc.core.live.newest import levels
from ftproc.core.live.newest.deciding import Deciding
from ftproc.core.live.newest.readmission import KEPT, Open
from ftproc.core.live.pieces import BLOCK, Flown, Sizes, filtered, later, may_be_anywhere, piece, predicted, stretched
from ftproc.core.live.predictive_chain import OPEN, chains_of
from ftproc.core.live.readings import Labels, Repeats, labelled, typical, used_lately
from ftproc.core.live.turning import Case, Turning
from ftproc.core.live.whole import Whole
from ftproc.records import FloatArray, IntArray

SHORT = 160  # samples: with fewer, nothing is said of how the noise of single readings differs
YOUNG, JUMPY = 40, 1.5  # samples with which a track is young, and intervals that its filter must remember
DOUBTED, DOUBT = 12, 0.4  # readings, and share of them: with fewer good ones the track is in doubt
JERK_STEPS = 2  # of the search for the jerk profile in a refresh
SLIDES = 0.25  # of the newest part that it is longer before it is cut


class Window:
    """A track and the readings it rests on. white: whether its noise is taken for white and even. refresh_every: so
    many times less often than usual. stand_ins: components whose readings are constants. Readings come as (n, 4), the
    last column being range rates."""

    white, refresh_every = False, 1

    def __init__(
        self, time_s: FloatArray, measurement: FloatArray, known: two_pass.Known, sizes: Sizes,
        stand_ins: tuple[int, ...] = (),
    ) -> None:  # fmt: skip
        self.known, self.sizes, self.stand_ins, self.near = known, sizes, stand_ins, 0
        self.repeats, self.labels, self.flown = Repeats(), Labels(), Flown()
        self.next_times, self.next_late = np.ones(3), np.zeros(3)  # how the noise of the next readings differs
        # Samples of re-acquisition; how many left before their lag, are kept no more, came before the track's start.
        self.reacquired, self.left, self.forgotten, self.begun = list[int](), 0, 0, -1
        self.fresh = 0  # samples that no refresh has seen
        self.under_way: Whole | None = None
        self.turning, self.deciding = Turning(acts=not known.white_jerk), Deciding()
        self.kept, self.side = Kept.nothing(), beside.Rates()
        self._bar(self._take(time_s, measurement))

    def __len__(self) -> int:
        return len(self.kept)

    @property
    def time_s(self) -> FloatArray:
        """(n,) of the samples kept."""
        return self.kept["time_s"]  # type: ignore[no-any-return]

    @property
    def measurement(self) -> FloatArray:
        """(n, 3) their readings, without what is taken out of them."""
        return self.kept["measurement"]  # type: ignore[no-any-return]

    @property
    def came(self) -> FloatArray:
        """(n, 4) these as they came, with the range rates."""
        return self.kept.came

    @property
    def learns(self) -> bool:
        """Whether noise or process noise are yet to be found, or decisions to be made again."""
        return True

    def shown(self, low: int, high: int) -> tuple[Any, FloatArray]:
        """See `Kept.shown`."""
        return self.kept.shown(low, high)

    def smoothed(self) -> SmootherRun:
        """The newest part, smoothed with the decisions as they are."""
        log = self.kept.observed(slice(self.near, len(self)), self.side)
        found = self.turning.smoothed(log, self.anchor, smooth_log(log, self.allowed, [self.anchor], PATHS))
        levels.widen(found, self.kept["level"][self.near :], self.kept["level_sigma"][self.near :])
        return found

    def used_lately(self, count: int) -> FloatArray:
        return used_lately(self.measurement, self.kept["weight"], count)

    def in_doubt(self) -> bool:
        """Whether so few of a component's newest readings are used that it may be the track that is wrong."""
        return bool((self.used_lately(DOUBTED) < DOUBT).any())

    # -- all of the window ------------------------------------------------------------------------------------------

    def edit(self) -> None:
        """Decide on all of the window again. Raises ValueError when a component has no reading that agrees, or the few
        readings that there are lie on a track that only a filter without memory could follow."""
        self.begin()
        self.go_on(math.inf)

    def begin(self) -> None:
        """Begin to decide on all of the window again; `under_way` is None if that was all."""
        readings, short = np.where(self.kept["possible"], self.measurement, np.nan), self.white or len(self) < SHORT
        edit = partial(two_pass.edit, self.time_s.copy(), readings, self.known, live=True, short=short)
        self.under_way = Whole(edit, len(self))

    def go_on(self, samples: float) -> None:
        """Go on with what is under way, for the work of filtering so many samples. Errors as of `edit`."""
        assert self.under_way is not None
        whole, self.under_way = self.under_way, None
        if whole.go_on(samples):
            self._adopt(whole.found, whole.samples)
        else:
            self.under_way = whole

    def _adopt(self, found: two_pass.Edited, samples: IntArray) -> None:
        """Take over the decisions, noise and process noise of an edit, and where it leads; samples: those it knew."""
        scales = scales_of(found.log, found.model.noise_variance)
        if len(self) < YOUNG and scales.memory_samples(float(found.model.jerk[:, 0].max())) < JUMPY:
            raise ValueError("the readings jump too much for the track of anything that flies")
        kept, self.rates = self.kept, found.decision.rates
        uneven = found.log.uneven or Uneven.none(len(samples))
        new = np.delete(np.arange(len(self)), samples)
        kept["weight"][samples] = found.weight
        kept["weight"][new], kept["times"][new], kept["late"][new] = OPEN, *typical(*uneven)
        kept["times"][samples], kept["late"][samples] = uneven
        kept["weight"][~kept["possible"]] = 0.0
        kept["weight"][self.known.accepted.of(self.time_s, self.measurement)] = 1.0
        kept["rate_weight"][new], rate = RATE_OPEN, kept["rate"][samples]
        self.side, kept["rate_weight"][samples] = beside.learned(found.log, found.model, found.starts, rate)
        starts = [start._replace(sample=int(samples[start.sample])) for start in found.starts]
        if len(new):
            log, start = self.kept.observed(slice(0, len(self)), self.side), starts[-1]
            span = Span(start.sample, len(self), start.sample)
            rows, left = self._filtered(log, span, found.model, found.model.filter(start))
            kept["weight"][new], kept["rate_weight"][new] = rows["weight"][new], left[new]
        model = found.model
        self.near = max(min(len(self) - self.sizes.near, self._waiting()), starts[0].sample, 0)
        self._count_from(starts)
        self.anchor = self._ahead(starts, model, self.near)
        passed = piece(float(self.time_s[self.near] - self.time_s[0]), model)
        self.model = self.allowed = model._replace(jerk=later(model.jerk, passed))
        self.turning.anew()
        self.refresh()

    def _count_from(self, starts: list[Start]) -> None:
        """The age of the track counts from the last of these starts that is not after the newest part; from the first
        one it counts on, if the track was there before."""
        start = [s for s in starts if s.sample <= self.near][-1]
        begun = self.forgotten + start.sample
        self.begun = begun if self.begun < 0 or start is not starts[0] else min(self.begun, begun)

    def _ahead(self, starts: list[Start], model: Model, sample: int) -> Start:
        """The prediction at a sample, from the last start that is not after it."""
        start = [s for s in starts if s.sample <= sample][-1]
        log, filters = beside.without(self.kept.observed(slice(0, sample + 1), self.side), sample), model.filter(start)
        self._filtered(log, Span(start.sample, sample + 1, start.sample), model, filters)
        return predicted(filters)

    def trim(self) -> int:
        """Forget what is more than the window's size, but nothing that waits for its lag; how many samples."""
        drop = max(min(len(self) - self.sizes.window, self.near, self._waiting()), 0)
        self.kept.forget(drop)
        self.forgotten += drop
        self.near, self.left = self.near - drop, max(self.left - drop, 0)
        self.reacquired = [sample - drop for sample in self.reacquired if sample >= drop]
        return drop

    def _waiting(self) -> int:
        """The first sample that may wait for its lag to pass."""
        return max(int(np.searchsorted(self.time_s + self.sizes.lag_s, self.time_s[-1])), self.left)

    # -- sample by sample -------------------------------------------------------------------------------------------

    def append(self, time_s: FloatArray, measurement: FloatArray) -> None:
        """Filter the next readings, each decided on when it comes."""
        n, self.fresh = len(self), self.fresh + len(time_s)
        stuck = self._take(time_s, measurement)
        first_s, span = float(self.time_s[self.near]), Span(1, 1 + len(time_s), 0)
        log = self.kept.observed(slice(n - 1, n + len(time_s)), self.side)
        rows, left = self._filtered(log, span, self.allowed, self.filters, self.chains, first_s)
        self.turning.append(log, span, rows, first_s)
        rows["since_start"] += self.kept["rows"]["since_start"][n - 1]
        used, kept = np.column_stack([rows["weight"], left])[1:], self.kept
        kept["weight"][n:], kept["rate_weight"][n:], kept["rows"][n:] = used[:, :-1], used[:, -1], rows[1:]
        kept["label"][n:] = self.labels.add(used, self.came[n:])
        self._bar(stuck)

    def expect_gap(self, next_s: float) -> bool:
        """The next reading comes after a gap; whether that is too long to be bridged."""
        if self.known.jerk_psd is None:
            self.allowed = self.flown.unseen(self.allowed, np.append(self.time_s[self.near :], next_s))
        return may_be_anywhere(self.filters["x"][0, :3], self.allowed, next_s - float(self.time_s[-1]))

    def _take(self, time_s: FloatArray, measurement: FloatArray) -> list[tuple[IntArray, int]]:
        """Keep the next readings, undecided where they may be good at all: no target is at the station, or behind it,
        and none stands still to the last digit. Samples and component of the readings that were repeated so."""
        n, m = len(self), len(time_s)
        measurement, rate = np.split(beside.widened(measurement), [beside.RATE], axis=1)
        accepted, possible = self.known.accepted.of(time_s, measurement), np.isfinite(measurement)
        possible[:, 0] &= measurement[:, 0] > 0
        self.kept.take(
            measurement, accepted, time_s=time_s, possible=possible, times=np.tile(self.next_times, (m, 1)),
            late=np.tile(self.next_late, (m, 1)), rate=rate[:, 0], rate_weight=np.full(m, RATE_OPEN),
        )  # fmt: skip
        moving = measurement.copy()
        moving[:, self.stand_ins] = np.nan
        stuck, repeated = self.repeats.runs(moving, self.measurement)
        for k, c in stuck:
            self.kept["possible"][n + k, c] = False
        self.kept["weight"][n:][self.kept["possible"][n:]] = OPEN
        self.kept["weight"][n:][accepted] = 1.0
        return repeated

    def _bar(self, repeated: list[tuple[IntArray, int]]) -> None:
        """Readings that turn out to be repeated are not possible either, from the next refresh on."""
        for samples, c in repeated:
            self.kept["possible"][samples, c] = self.kept["weight"][samples, c] = 0

    def _filtered(
        self, log: Observations, span: Span, model: Model, filters: Any, chains: Any = None, first_s: float = math.nan
    ) -> tuple[Any, FloatArray]:
        return filtered(log, span, model, filters, self._chains(model) if chains is None else chains, first_s)

    # -- the newest part --------------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """Decide again on the newest part, let the jerk profile follow, and filter that part again."""
        self._slide()
        near = slice(self.near, len(self))
        self.model = stretched(self.model, float(self.time_s[-1] - self.time_s[self.near]))
        log, gate = self.kept.observed(near, self.side), self.known.gate
        scales = scales_of(log, self.model.noise_variance)
        self.allowed = self._with_allowance(log, scales)
        by_hand, kept = self.known.accepted.of(log.time_s, log.measurement), self.kept
        before = Open(log, self.allowed, self.anchor, self.rates, by_hand, *(kept[name][near] for name in KEPT))
        jumps, free = self.forgotten + self.near > self.begun and not self.white, self.known.jerk_psd is None
        case, self.model = self.deciding.decided(before, gate, self.model, scales if free else None, jumps, self.fresh)
        if case.level is not before.level:
            self.under_way, self.anchor = None, case.start  # an edit of all knows nothing of it
            for name in KEPT:
                kept[name][near] = getattr(case, name)
            kept["measurement"][near] = case.log.measurement
        log = beside.decided(case.log, self.allowed, self.anchor)
        kept["weight"][near] = log.weight
        if free:
            self.model = fit_profile(log, [self.anchor], self.model, JERK_STEPS, scales)
            self.allowed = self._with_allowance(log, scales)
        self.filters, self.chains = self.allowed.filter(self.anchor), self._chains(self.allowed)
        rows, left = self._filtered(log, Span(0, len(log.time_s), 0), self.allowed, self.filters, self.chains)
        self.turning.refresh(Case(log, self.allowed, self.anchor, scales), rows)
        rows["since_start"] += self.forgotten + self.near - self.begun
        kept["rows"][near], kept["rate_weight"][near] = rows, left
        used, came = np.column_stack([log.weight, left]), self.came[near]
        kept["label"][near] = labelled(used, came)
        self.labels.reset(used, came)
        self.fresh = 0
        self.next_times, self.next_late = typical(kept["times"], kept["late"])

    def _chains(self, model: Model) -> Any:
        return chains_of(self.rates, model.reading_variance, self.known.gate)

    def _with_allowance(self, log: Observations, scales: Scales) -> Model:
        if self.known.jerk_psd is not None:
            return self.model
        return self.flown.unseen(with_allowance(log, self.model, scales), log.time_s)

    def _slide(self) -> None:
        """Move the newest part on, by whole pieces of its jerk profile, unless that leaves it far too long."""
        beyond = len(self) - self.near - self.sizes.near
        if beyond < SLIDES * self.sizes.near:
            return
        times, first_s = self.time_s, float(self.time_s[self.near])
        ahead = min(self.near + beyond, self._waiting())
        if math.isfinite(self.model.knot_s) and beyond < BLOCK:
            pieces = piece(float(times[ahead]) - first_s, self.model)
            ahead = min(ahead, int(np.searchsorted(times, first_s + pieces * self.model.knot_s)))
        if ahead <= self.near:
            return
        log = beside.without(self.kept.observed(slice(self.near, ahead + 1), self.side), -1)
        filters = self.allowed.filter(self.anchor)
        self._filtered(log, Span(0, len(log.time_s), 0), self.allowed, filters)
        self.anchor, self.near = predicted(filters), ahead
        passed = piece(float(times[ahead]) - first_s, self.model)
        self.flown = self.flown.with_pieces(self.model, passed)
        self.model = self.model._replace(jerk=later(self.model.jerk, passed))
        self.turning.passed(passed)
