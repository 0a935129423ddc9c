"""The sliding window of the live editor, and what it carries along: decisions, noise, jerk profile and an anchor.

The buffer holds the readings that a new look at the whole situation needs (two-pass editing of all of it, now and
then). Its newest part, from `near` on, is where decisions are still open: a refresh smooths that part alone, from the
anchor (the filter's prediction at its first sample, which stands for everything before), decides again, lets the jerk
profile follow and brings the filter to the newest sample.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing import outlier_chain, patch_likelihood, two_pass
from ftproc.core.editing.predictive_chain import OPEN, chains_of, run_predictive, run_predictive_coloured
from ftproc.core.editing.screening import SHORTEST_STUCK, STUCK_ODDS
from ftproc.core.filtering.forward import Span
from ftproc.core.filtering.records import Model, Observations, Start, Uneven, between, empty_rows
from ftproc.core.filtering.smoother import SmootherRun, smooth_log
from ftproc.core.identification.profile import fit_profile, with_allowance
from ftproc.core.model.motion import Profile

FloatArray = NDArray[np.float64]

ROUNDS = 3  # of smoothing and deciding in a refresh
SHORT = 160  # samples: with fewer, nothing is said of how the noise of single readings differs
DOUBTED, DOUBT = 12, 0.4  # readings, and share of them: with fewer good ones the track is in doubt
MARGIN = 5.0  # by which the log-probability of other decisions must be better
JERK_STEPS = 2  # of the search for the jerk profile in a refresh


class Sizes(NamedTuple):
    """Samples of the buffer, and of its newest part, where decisions are open."""

    buffer: int
    near: int


class Repeats:
    """How often readings repeat the one before, component by component; see `screening.stuck`."""

    def __init__(self) -> None:
        self.last, self.run = np.full(3, np.nan), np.zeros(3, int)
        self.seen, self.ended = np.zeros(3, int), np.zeros(3, int)  # readings, and repeats in runs that are over

    def stuck(self, measurement: FloatArray) -> list[tuple[int, int, int]]:
        """Row, component and length so far of the runs of repeats among the next rows that chance does not explain."""
        found = []
        for c in range(3):
            seen = np.flatnonzero(np.isfinite(measurement[:, c]))
            values = np.r_[self.last[c], measurement[seen, c]]
            same = values[1:] == values[:-1]
            if not len(seen) or not (same.any() or self.run[c]):
                self.seen[c] += len(seen)
                self.last[c] = values[-1]
                continue
            for k, repeated in zip(seen.tolist(), same.tolist(), strict=True):
                self.seen[c] += 1
                if not repeated:
                    self.ended[c] += self.run[c]
                    self.run[c] = 0
                    continue
                self.run[c] += 1
                chance = self.ended[c] / self.seen[c]
                needed = math.log(STUCK_ODDS / self.seen[c]) / math.log(max(chance, 1e-300)) if chance < 1 else math.inf
                if self.run[c] >= max(needed, SHORTEST_STUCK - 1):
                    found.append((k, c, int(self.run[c])))
            self.last[c] = values[-1]
        return found


class Window:
    """A track and the readings it rests on."""

    def __init__(self, time_s: FloatArray, measurement: FloatArray, known: two_pass.Known, sizes: Sizes) -> None:
        self.known, self.sizes = known, sizes
        self.time_s, self.measurement = time_s, measurement
        self.rows = empty_rows(len(time_s))
        self.near, self.repeats = 0, Repeats()
        self.reacquired: list[int] = []  # samples at which a lost track was found again
        self.possible = np.isfinite(measurement) & (measurement[:, :1] > 0) | np.isfinite(measurement) & np.array([False, True, True])
        self._refuse_stuck(0)
        self.noise: FloatArray | None = None

    def __len__(self) -> int:
        return len(self.time_s)

    # -- a new look at all of the buffer ------------------------------------------------------------------------------

    def edit(self) -> None:
        """Decide on all of the buffer anew. Raises ValueError when a component has no reading that agrees."""
        readings = np.where(self.possible, self.measurement, np.nan)
        edited = two_pass.edit(self.time_s, readings, self.known, short=len(self) < SHORT)
        self.adopt(edited)

    def adopt(self, edited: two_pass.Edited) -> None:
        """Go on from decisions, noise and jerk of two-pass editing."""
        self.weight, self.rates = edited.weight.copy(), edited.decision.rates
        self.noise = edited.model.noise_variance
        self.uneven = edited.log.uneven or Uneven.none(len(self))
        self.near = max(len(self) - self.sizes.near, 0)
        starts = edited.starts
        model = edited.model
        self.anchor = self._ahead(starts, model, self.near)
        self.near = max(self.near, starts[0].sample)
        first = self._knot(self.time_s[self.near], self.time_s[0], model.knot_s)
        self.model = self.allowed = model._replace(jerk=model.jerk[min(first, len(model.jerk) - 1) :])
        self.refresh()

    def _knot(self, time_s: float, first_s: float, knot_s: float) -> int:
        return int((time_s - first_s) / knot_s) if math.isfinite(knot_s) else 0

    def _ahead(self, starts: list[Start], model: Model, sample: int) -> Start:
        """The prediction at a sample, from starts before it."""
        before = [start for start in starts if start.sample <= sample]
        if not before:
            return starts[0]._replace(sample=0)
        (start, _) = list(between(before, sample))[-1]
        span = slice(0, sample + 1)
        log = self.observed(span)
        log.weight[sample] = 0.0
        filters = model.filter(start)
        self._filter(log, Span(start.sample, sample + 1, start.sample), model, filters)
        return Start(0, filters["x"][0, :9].copy(), filters["p"][0, :9, :9].copy())

    def _filter(self, log: Observations, span: Span, model: Model, filters: Any, chains: Any = None, first_s: float | None = None) -> Any:
        """Rows of a span of a log, filtered from a state, which is changed."""
        rows = empty_rows(len(log.time_s))
        chains = chains_of(self.rates, model.reading_variance, self.known.gate) if chains is None else chains
        profile = model.profile(log.time_s) if first_s is None else Profile(model.jerk, model.knot_s, first_s)
        run = run_predictive_coloured if model.coloured else run_predictive
        run(span, log.samples(model.noise_variance), profile, filters, chains, rows)
        return rows

    def observed(self, span: slice) -> Observations:
        """Some samples with their decisions (copies)."""
        return Observations(self.time_s[span], self.measurement[span], self.weight[span].copy(), self.uneven.part(span))

    def _refuse_stuck(self, first: int) -> None:
        """No reading from `first` on that merely repeats the one before for too long is possible, nor those before it."""
        for k, c, run in self.repeats.stuck(self.measurement[first:]):
            seen = np.flatnonzero(np.isfinite(self.measurement[: first + k + 1, c]))[-run:]
            self.possible[seen, c] = False
            if first:
                self.weight[seen, c] = 0.0

    def in_doubt(self) -> bool:
        """Whether so few of a component's newest readings are used that it may be the track that is wrong."""
        return bool((self.used_lately(DOUBTED) < DOUBT).any())

    def used_lately(self, count: int) -> FloatArray:
        """(3,) share of each component's last `count` readings that is used."""
        found = np.ones(3)
        for c in range(3):
            seen = np.flatnonzero(np.isfinite(self.measurement[:, c]))[-count:]
            found[c] = (self.weight[seen, c] > 0).mean() if len(seen) else 0.0
        return found

    # -- sample by sample -----------------------------------------------------------------------------------------------

    def append(self, time_s: FloatArray, measurement: FloatArray) -> None:
        """Filter the next readings, each decided on when it comes."""
        n, m = len(self), len(time_s)
        self.time_s = np.concatenate([self.time_s, time_s])
        self.measurement = np.concatenate([self.measurement, measurement])
        possible = np.isfinite(measurement)
        possible[:, 0] &= measurement[:, 0] > 0
        self.possible = np.concatenate([self.possible, possible])
        self.weight = np.concatenate([self.weight, np.zeros((m, 3))])
        self._refuse_stuck(n)
        self.weight[n:][self.possible[n:]] = OPEN
        late, times = self.uneven.late, self.uneven.times
        self.uneven = Uneven(np.concatenate([times, np.repeat(np.median(times[-50:], 0)[None], m, 0)]), np.concatenate([late, np.repeat(late[-1:], m, 0)]))
        log = self.observed(slice(n - 1, n + m))
        rows = self._filter(log, Span(1, m + 1, 0), self.allowed, self.filters, self.chains, float(self.time_s[self.near]))
        self.weight[n:] = rows["weight"][1:]
        self.rows = np.concatenate([self.rows, rows[1:]])

    # -- refresh --------------------------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """Decide again on the newest part, let the jerk profile follow, and filter that part anew."""
        self._slide()
        near = slice(self.near, len(self))
        self._extend_profile()
        self._decide(near)
        if self._readmit(near):
            self._decide(near)
        log = self.observed(near)
        if self.known.jerk_psd is None:
            self.model = fit_profile(log, [self.anchor], self.model, JERK_STEPS)
        self.allowed = self._allowed(log)
        self.filters = self.allowed.filter(self.anchor)
        self.chains = chains_of(self.rates, self.model.reading_variance, self.known.gate)
        self.rows[near] = self._filter(log, Span(0, len(log.time_s), 0), self.allowed, self.filters, self.chains)

    def _decide(self, near: slice) -> None:
        """Smooth and decide in turn until the decisions stand still."""
        for _ in range(ROUNDS):
            log = self.observed(near)
            smoothed = smooth_log(log, self._allowed(log), [self.anchor], residuals_only=True)
            good = outlier_chain.classify(
                smoothed.residual, smoothed.residual_variance, self.model.reading_variance, self.rates.copy(), self.known.gate
            )
            decided = ((good > 0.5) & self.possible[near]).astype(float)
            self.weight[near] = decided
            if (decided == log.weight).all():
                break

    def _readmit(self, near: slice) -> bool:
        """Where the newest readings are rejected: whether the last of them are likelier good, and the track wrong."""
        runs = {c: run for c in range(3) if len(run := self._rejected(near, c)) >= patch_likelihood.SHORTEST_RUN}
        if not runs:
            return False
        weight = self.weight[near]
        longest = max(map(len, runs.values()))
        together = [list(runs), *([c] for c in runs)] if len(runs) > 1 else [list(runs)]
        tried = [weight]
        for components in together:
            for last in sorted({patch_likelihood.SHORTEST_RUN, longest // 2, longest}):
                other = weight.copy()
                for c in components:
                    other[runs[c][-last:], c] = 1.0
                tried.append(other)
        found = [self._likelihood(near, each) for each in tried]
        best = int(np.argmax(found))
        if found[best] <= found[0] + MARGIN:
            return False
        self.weight[near] = tried[best]
        return True

    def _rejected(self, near: slice, c: int) -> NDArray[np.int64]:
        """The samples of the newest part whose readings of a component are rejected, up to the last one that is good."""
        seen = np.flatnonzero(self.possible[near, c])
        good = np.flatnonzero(self.weight[near][seen, c] > 0)
        return seen[good[-1] + 1 if len(good) else 0 :]

    def _likelihood(self, near: slice, weight: FloatArray) -> float:
        """Log-probability of all readings of the newest part with these decisions."""
        log = self.observed(near)._replace(weight=weight)
        smoothed = smooth_log(log, self._allowed(log), [self.anchor], residuals_only=True)
        total, sigma = smoothed.log_likelihood, np.sqrt(self.model.reading_variance)
        for c in range(3):
            seen = np.flatnonzero(self.possible[near, c])
            total += patch_likelihood.log_probability(
                log.time_s[seen], smoothed.residual[seen, c], smoothed.residual_variance[seen, c], weight[seen, c],
                float(sigma[c]), self.rates[c],
            )  # fmt: skip
        return total

    def _allowed(self, log: Observations) -> Model:
        return self.model if self.known.jerk_psd is not None else with_allowance(log, self.model)

    def smoothed(self) -> SmootherRun:
        """The newest part, smoothed with the decisions as they are."""
        return smooth_log(self.observed(slice(self.near, len(self))), self.allowed, [self.anchor])

    def _extend_profile(self) -> None:
        """As many pieces as the newest part has; the last one goes on."""
        span_s = float(self.time_s[-1] - self.time_s[self.near])
        pieces = max(math.ceil(span_s / self.model.knot_s), 1)
        held = np.minimum(np.arange(pieces), len(self.model.jerk) - 1)
        self.model = self.model._replace(jerk=self.model.jerk[held])

    def _slide(self) -> None:
        """Move the newest part on by whole pieces of the profile, and forget what the buffer has too much of."""
        beyond = len(self) - self.near - self.sizes.near
        if beyond < self.sizes.near // 4:
            return
        knot_s, first_s = self.model.knot_s, float(self.time_s[self.near])
        target = self.near + beyond
        if math.isfinite(knot_s):
            knot = self._knot(float(self.time_s[target]), first_s, knot_s)
            target = int(np.searchsorted(self.time_s, first_s + knot * knot_s))
            target = min(max(target, self.near + 1), self.near + beyond)
            knot = self._knot(float(self.time_s[target]) + 1e-9, first_s, knot_s)
        else:
            knot = 0
        log = self.observed(slice(self.near, target + 1))
        log.weight[-1] = 0.0
        filters = self.allowed.filter(self.anchor)
        self._filter(log, Span(0, len(log.time_s), 0), self.allowed, filters)
        self.anchor = Start(0, filters["x"][0, :9].copy(), filters["p"][0, :9, :9].copy())
        self.near = target
        jerk = self.model.jerk
        self.model = self.model._replace(jerk=jerk[min(knot, len(jerk) - 1):])
        if len(self) > 5 * self.sizes.buffer // 4:
            self.trim()

    def trim(self) -> None:
        """Forget what the buffer has too much of."""
        drop = min(max(len(self) - self.sizes.buffer, 0), self.near)
        self.time_s, self.measurement, self.possible, self.weight, self.rows = (
            each[drop:].copy() for each in (self.time_s, self.measurement, self.possible, self.weight, self.rows)
        )
        self.uneven = self.uneven.part(slice(drop, None))
        self.near -= drop
        self.reacquired = [row - drop for row in self.reacquired if row >= drop]
