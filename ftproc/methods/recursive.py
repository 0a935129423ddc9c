"""The main method with recursive editing (Zuo et al. 2021 section 2.3), as a live system can do it, over logs of any
length: stretch by stretch, each continuing where the one before it ended."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing import gate, two_pass
from ftproc.core.editing.track import GatedRecursion, Track
from ftproc.core.filtering import initialization
from ftproc.core.filtering.forward import lead_in
from ftproc.core.filtering.records import FilterRun, Model, Start, empty_rows
from ftproc.core.model.motion import isotropic
from ftproc.methods import preparing
from ftproc.methods.estimate import SPAN, SPANS, Estimate, Part, Readings, Recording, typical_interval
from ftproc.methods.preparing import HEAD, Filtered
from ftproc.records import FloatArray
from ftproc.settings import FilterSettings

BLOCK = 1 << 15  # samples of a stretch
HISTORY = 256  # samples before it that go with it: the network looks back
AHEAD = 256  # samples after a gap that a new start is found from
DEFAULT_PATCH_S = 4.0
DEFAULT_PATCH_SAMPLES = 32  # the longest patch expected is the longer of the two


class Stretch(NamedTuple):
    """The filter over a stretch of a log: samples [low, high) of its readings, which begin at the log's sample `first`
    and continue after the run's end. starts: all that were made in it."""

    readings: Readings
    run: FilterRun
    starts: list[Start]
    first: int
    low: int
    high: int


def parts(record: Recording, settings: FilterSettings, block: int = BLOCK) -> Iterator[Part]:
    """The estimate of a log by stretches of `block` samples; whatever their length, it is the same.

    Raises ValueError when a component has no reading that agrees with its neighbours at the beginning.
    """
    model = _model(record, settings)
    done: int = 0
    again: list[int] = []
    for readings, run, starts, first, low, high in _stretches(record, settings, model, block):
        kept = _kept(run, settings)
        label = preparing.labels(kept, readings.measurement[:high])
        again += [first + start.sample for start in (starts if first + low else starts[1:])]
        end = high if first + high == len(record) else high - _unsure(kept, readings.measurement[:high])
        found = Estimate(run, label, model, reacquired=tuple(sample - first for sample in again))
        yield Part(found, first, done - first, end)
        done = first + end


def _unsure(kept: FloatArray, measurement: FloatArray) -> int:
    """How many samples at the end wait for the next stretch to tell how long a run of outliers is; both (n, 3)."""
    examined = min(HISTORY // 2, len(kept))
    sure = examined
    for used, reading in zip(kept[-examined:].T, measurement[-examined:].T, strict=True):
        good, bad = np.flatnonzero(used > 0), np.flatnonzero(np.isfinite(reading) & (used == 0))
        if good.size and bad.size and bad[-1] > good[-1]:
            sure = min(sure, int(good[-1]) + 1)
    return examined - sure


def estimate(readings: Readings, settings: FilterSettings) -> Estimate:
    """The same of a whole log, and smoothed if that was asked for. Errors as in `parts`."""
    record = Recording(*readings)
    model = _model(record, settings)
    (stretch,) = _stretches(record, settings, model, len(record))
    log = readings.weighted(_kept(stretch.run, settings))
    return preparing.finished(Filtered(log, stretch.run, model, stretch.starts), settings)


def _kept(run: FilterRun, settings: FilterSettings) -> FloatArray:
    """(n, 3) 1 for readings that are used, 0 for those that are called outliers."""
    return np.where(run.weight > gate.rejection_weight(settings.gate), 1.0, 0.0)


def _stretches(record: Recording, settings: FilterSettings, model: Model, block: int) -> Iterator[Stretch]:
    n = len(record)
    how = gate.GateSettings(settings.gate, _longest_patch_s(record, settings), settings.gain_form)
    weight, start = _beginning(record, settings, model)
    gaps = _Gaps(model, initialization.shortest_gap(typical_interval(record.time_s)))
    edges = [0, *range(max(block, start.sample + 1), n, block), n]
    track: Track | None = None
    history = empty_rows(0)
    for low, high in itertools.pairwise(edges):
        first = max(low - HISTORY, 0)
        readings = record.part(slice(first, min(high + AHEAD, n)))
        here, stop = low - first, high - first
        good, allowed = np.isfinite(readings.measurement), np.ones((stop, 3))
        if low == 0:
            good[: len(weight)] &= weight[: len(good)] > 0
            allowed[:HEAD] = weight[:HEAD]
        starts = gaps.starts(readings, good, here, stop)
        if low == 0:
            starts = [start, *(later for later in starts if later.sample > start.sample)]
        log = Readings(readings.time_s[:stop], readings.measurement[:stop], readings.assumed_sigma).weighted(allowed)
        rows = empty_rows(stop)
        rows[: len(history)] = history
        recursion = GatedRecursion(log, model, how, rows)
        track = recursion.run(track, here, starts)
        if low == 0:
            lead_in(log, model, start, rows)
        yield Stretch(
            readings, FilterRun.of(log.time_s, rows, recursion.log_likelihood), recursion.starts, first, here, stop
        )
        kept = min(HISTORY, stop)
        history = rows[stop - kept :].copy()
        track = track.shifted(stop - kept)


class _Gaps:
    """Where a log has gaps that are too long to bridge, stretch by stretch."""

    def __init__(self, model: Model, shortest_s: float) -> None:
        self.model, self.shortest_s = model, shortest_s
        self.last_good_s = np.full(3, np.nan)  # when each component was last seen before the stretch

    def starts(self, readings: Readings, good: NDArray[np.bool_], low: int, high: int) -> list[Start]:
        """Starts in samples [low, high) after such gaps; good (n, 3)."""
        time_s, measurement, _ = readings
        before = max(low - 1, 0)  # an interval may end with the first sample
        seen = good[before:].copy()
        seen[: low - before] = False
        gaps = initialization.gaps_of(time_s[before:], seen, self.shortest_s, self.last_good_s)
        ends = sorted(before + k for k in gaps)
        starts = []
        for k, following in itertools.pairwise([*ends, len(time_s)]):
            if k >= high:
                break
            window = slice(k, min(following, k + AHEAD))
            weight, _, _ = two_pass.screen(time_s[window], measurement[window])
            usable = (weight > 0) & good[window]
            if (usable.sum(0) < initialization.FEWEST_READINGS).any():
                continue
            jerk = float(self.model.jerk[0, 0])
            if initialization.too_long(gaps[k - before], measurement[window, 0][usable[:, 0]], jerk):
                around = np.zeros(measurement.shape)
                around[window] = usable
                log = readings.weighted(around)
                starts.append(initialization.first_state(log, self.model.noise_variance, k, window))
        for c in range(3):
            rows = np.flatnonzero(good[low:high, c])
            if rows.size:
                self.last_good_s[c] = time_s[low + rows[-1]]
        return starts


def _model(record: Recording, settings: FilterSettings) -> Model:
    """Noise and jerk level: as specified, else from spans of the log."""
    known = preparing.what_is_known(record, settings)
    if np.isfinite(known.sigma).all() and known.jerk_psd is not None:
        return Model(known.sigma**2, isotropic(known.jerk_psd))
    try:
        return preparing.prepare(_excerpt(record), settings)[0]
    except ValueError:  # a component has too few readings in the spans
        return preparing.prepare(record.whole(), settings)[0]


def _excerpt(record: Recording) -> Readings:
    """Spans spread evenly over a long log, else all of it."""
    if len(record) <= SPANS * SPAN:
        return record.whole()
    spans = [record.part(rows) for rows in record.spans()]
    time_s, measurement = (np.concatenate([span[k] for span in spans]) for k in (0, 1))
    return Readings(time_s, measurement, record.assumed_sigma)


def _longest_patch_s(record: Recording, settings: FilterSettings) -> float:
    if settings.max_patch_s is not None:
        return settings.max_patch_s
    return max(DEFAULT_PATCH_S, DEFAULT_PATCH_SAMPLES * typical_interval(record.time_s))


def _beginning(record: Recording, settings: FilterSettings, model: Model) -> tuple[FloatArray, Start]:
    """(m, 3) weights of the log's first samples, and its start. More samples are examined while these do not tell where
    the target is."""
    examined = HEAD
    while True:
        readings = record.part(slice(0, examined))
        weight = preparing.trusted(readings, settings).weight
        try:
            return weight, initialization.first_start(readings.weighted(weight), model.noise_variance)
        except ValueError:
            if examined >= len(record):
                raise
        examined *= 4
