"""The gated recursion over a log: where a track starts, how it goes on from stretch to stretch, and how it is
re-acquired after it was lost."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ftproc.core.editing import gate, screening
from ftproc.core.filtering.forward import Span, lead_in
from ftproc.core.filtering.initialization import first_state
from ftproc.core.filtering.records import FilterRun, Model, Observations, Start, empty_rows
from ftproc.records import FloatArray

REACQUIRE_SAMPLES = 15
INLIERS = 0.8  # share of them that must fit a parabola in every component
RETRY_SAMPLES = 3


class Track(NamedTuple):
    """The recursion between two samples: the sample at which it started, its filter and its gate (arrays of one record,
    overwritten)."""

    start: int
    filters: Any
    gates: Any

    def shifted(self, samples: int) -> Track:
        """The track with samples counted from a later one."""
        return self._replace(start=self.start - samples)


class GatedRecursion:
    """The filter with recursive editing over a log, or a stretch of it.

    log: weights of zero bar a reading from the outset. rows: the `Row` records that it fills. Afterwards `starts` holds
    every start that was made, and `log_likelihood` that of what was used.
    """

    def __init__(self, log: Observations, model: Model, settings: gate.GateSettings, rows: Any) -> None:
        self.log, self.model, self.settings, self.rows = log, model, settings, rows
        self.samples, self.profile = log.samples(model.noise_variance), model.profile(log.time_s)
        self.starts: list[Start] = []
        self.log_likelihood = 0.0

    def run(self, track: Track | None, first: int, starts: list[Start]) -> Track:
        """Filter the samples from `first` on, with a track that goes on (None: the first start makes one), and
        re-initialize it at each of the starts. Returns the track at the end."""
        for start, low, high in self._stretches(track, first, starts):
            if start is not None:
                track = self._started(start)
            assert track is not None
            track = self._follow(track, low, high)
        assert track is not None
        return track

    def _stretches(
        self, track: Track | None, first: int, starts: list[Start]
    ) -> Iterator[tuple[Start | None, int, int]]:
        """Where each track goes: the start that makes it, or None for the one that goes on, and its samples."""
        edges = [*([(None, first)] if track is not None else []), *((start, start.sample) for start in starts)]
        ends = [low for _, low in edges[1:]] + [len(self.log.time_s)]
        for (start, low), high in zip(edges, ends, strict=True):
            yield start, low, high

    def _started(self, start: Start) -> Track:
        self.starts.append(start)
        return Track(start.sample, self.model.filter(start), gate.gate_of(self.settings))

    def _follow(self, track: Track, first: int, stop: int) -> Track:
        """Filter [first, stop), re-acquiring when the track is lost; the track at the end."""
        while first < stop:
            span = Span(first, stop, track.start)
            lost, gained = gate.run_gated(span, self.samples, self.profile, track.filters, track.gates, self.rows)
            self.log_likelihood += gained
            if lost == stop:
                break
            again = reacquire(self.log.time_s, self.log.measurement, self.model.noise_variance, lost)
            if again is None:
                first = lost + 1
                track.gates["wait"] = RETRY_SAMPLES - 1
            else:
                first = lost  # the sample is filtered again, from the new state
                track = self._started(again)
                track.gates["wait"] = RETRY_SAMPLES
        return track


def filter_and_edit(
    log: Observations, model: Model, starts: list[Start], settings: gate.GateSettings
) -> tuple[FilterRun, list[Start]]:
    """The recursive filter with recursive editing over a whole log, and every start it made.

    log: weights of zero bar a reading from the outset. starts: at the beginning and after gaps; samples before the
    first are extrapolated.
    """
    recursion = GatedRecursion(log, model, settings, empty_rows(len(log.time_s)))
    recursion.run(None, 0, starts)
    lead_in(log, model, starts[0], recursion.rows)
    return FilterRun.of(log.time_s, recursion.rows, recursion.log_likelihood), recursion.starts


def reacquire(time_s: FloatArray, measurement: FloatArray, noise_variance: FloatArray, sample: int) -> Start | None:
    """A new start at `sample` from the raw readings just before it, if each component's agree with each other."""
    low = max(0, sample + 1 - REACQUIRE_SAMPLES)
    time, near = time_s[low : sample + 1], measurement[low : sample + 1]
    weight = np.zeros_like(near)
    for c in range(3):
        channel = np.ascontiguousarray(near[:, c])
        seen = np.isfinite(channel)
        votes, scales = screening.screen_component(time, channel, REACQUIRE_SAMPLES, c == 1, 0.0)
        fits = seen & (votes <= 0.5)
        if seen.sum() < 5 or fits.sum() < INLIERS * seen.sum() or scales.min() > 3 * np.sqrt(noise_variance[c]):
            return None
        weight[:, c] = fits
    found = first_state(Observations(time, near, weight), noise_variance, sample - low, slice(0, len(time)))
    return found._replace(sample=sample)
