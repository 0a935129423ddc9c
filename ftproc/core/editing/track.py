"""The gated recursion over a log: where a track begins, goes on from one stretch to the next, and is taken up anew."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing import gate, screening
from ftproc.core.filtering.forward import lead_in
from ftproc.core.filtering.initialization import first_state
from ftproc.core.filtering.records import FilterRun, Model, Start, empty_run

FloatArray = NDArray[np.float64]

REACQUIRE_SAMPLES = 15
INLIERS = 0.8  # share of them that must fit a parabola in every component
RETRY_SAMPLES = 3


def filter_and_edit(
    time_s: FloatArray,
    measurement: FloatArray,
    allowed: FloatArray,
    model: Model,
    starts: list[Start],
    settings: gate.GateSettings,
) -> tuple[FilterRun, list[Start]]:
    """The recursive filter with recursive editing over a whole log, and every start it made.

    time_s (n,), measurement (n, 3); allowed (n, 3): zero bars a reading from the outset (those that the first state
    was found to contradict); starts: at the beginning and after gaps; samples before the first are extrapolated.
    """
    run = empty_run(time_s)
    _, begun, likelihood = go_on(None, 0, len(time_s), time_s, measurement, allowed, model, starts, settings, run)
    lead_in(measurement, model, starts[0], run)
    return run._replace(log_likelihood=likelihood), begun


class Track(NamedTuple):
    """The recursion between two samples; its arrays are changed in place.

    start: the sample at which it began. retry: the first at which it may be called lost. state (9,), covariance (9, 9).
    memory: (3, 5) of each component, see `gate`.
    """

    start: int
    retry: int
    state: FloatArray
    covariance: FloatArray
    memory: FloatArray

    @classmethod
    def at(cls, start: Start, retry: int) -> Track:
        """A track that begins."""
        memory = np.zeros((3, 5))
        memory[:, 3] = np.nan
        return cls(start.sample, retry, start.state.copy(), start.covariance.copy(), memory)

    def shifted(self, samples: int) -> Track:
        """The track with samples counted from a later one."""
        return self._replace(start=self.start - samples, retry=self.retry - samples)


def go_on(
    track: Track | None,
    first: int,
    stop: int,
    time_s: FloatArray,
    measurement: FloatArray,
    allowed: FloatArray,
    model: Model,
    starts: list[Start],
    settings: gate.GateSettings,
    run: FilterRun,
) -> tuple[Track, list[Start], float]:
    """Filter samples [first, stop), going on with a track (None: the first start makes one) and beginning anew at each
    start; fills the run. Returns the track at the end, the starts made, and the log-likelihood."""
    likelihood = 0.0
    begun: list[Start] = []
    for start, low, high in _stretches(track, starts, first, stop):
        if start is not None:
            begun.append(start)
            track = Track.at(start, start.sample)
        assert track is not None
        track, gained = _follow(track, low, high, time_s, measurement, allowed, model, settings, run, begun)
        likelihood += gained
    assert track is not None
    return track, begun, likelihood


def _stretches(track: Track | None, starts: list[Start], first: int, stop: int) -> list[tuple[Start | None, int, int]]:
    """Where each track goes: the start that it begins with, or None for the one that goes on, and its samples."""
    begins = [(start, start.sample) for start in starts]
    going = [(None, first)] if track is not None else []
    edges = [*going, *begins]
    return [(s, low, high) for (s, low), high in zip(edges, [e[1] for e in edges[1:]] + [stop], strict=True)]


def _follow(
    track: Track,
    first: int,
    stop: int,
    time_s: FloatArray,
    measurement: FloatArray,
    allowed: FloatArray,
    model: Model,
    settings: gate.GateSettings,
    run: FilterRun,
    begun: list[Start],
) -> tuple[Track, float]:
    """Filter [first, stop), re-acquiring when the track is lost; the track at the end and the log-likelihood."""
    likelihood = 0.0
    while first < stop:
        lost, gained = gate.run_gated(
            first, stop, track.start, time_s, measurement, model.noise_variance, model.jerk, model.knot_s,
            settings.gate, settings.longest_patch_s, settings.gain_form, track.retry, allowed, track.state,
            track.covariance, track.memory, run,
        )  # fmt: skip
        likelihood += gained
        if lost == stop:
            break
        first = lost + 1
        again = reacquire(time_s, measurement, model.noise_variance, lost)
        if again is None:
            track = track._replace(retry=lost + RETRY_SAMPLES)
        else:
            begun.append(again)
            track = Track.at(again, lost + RETRY_SAMPLES)
            first = lost  # the sample is filtered again, from the new state
    return track, likelihood


def reacquire(time_s: FloatArray, measurement: FloatArray, noise_variance: FloatArray, sample: int) -> Start | None:
    """A new start at `sample` from the raw readings just before it, if each component's agree with each other."""
    low = max(0, sample + 1 - REACQUIRE_SAMPLES)
    weight = np.zeros_like(measurement)
    for c in range(3):
        channel = np.ascontiguousarray(measurement[low : sample + 1, c])
        seen = np.isfinite(channel)
        votes, scales = screening.screen_component(time_s[low : sample + 1], channel, REACQUIRE_SAMPLES, c == 1)
        fits = seen & (votes <= 0.5)
        if seen.sum() < 5 or fits.sum() < INLIERS * seen.sum() or scales.min() > 3 * np.sqrt(noise_variance[c]):
            return None
        weight[low : sample + 1, c] = fits
    return first_state(time_s, measurement, weight, noise_variance, sample, low, sample + 1)
