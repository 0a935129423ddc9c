"""The main method with recursive editing (Zuo et al. 2021 section 2.3), as a live system can do it, over logs of any
length: a stretch after the other, each going on where the one before it ended."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing import gate, track, two_pass
from ftproc.core.filtering import initialization
from ftproc.core.filtering.forward import lead_in
from ftproc.core.filtering.records import FilterRun, Model, Start, empty_run
from ftproc.core.model.motion import isotropic
from ftproc.methods import preparing
from ftproc.methods.estimate import SPAN, SPANS, Estimate, Part, Readings, Recording, typical_interval
from ftproc.methods.preparing import HEAD
from ftproc.records import FloatArray
from ftproc.settings import FilterSettings

BLOCK = 1 << 15  # samples of a stretch
HISTORY = 256  # samples before it that go with it: the network looks back
AHEAD = 256  # samples after a gap that a new start is found from
DEFAULT_PATCH_S = 4.0
DEFAULT_PATCH_SAMPLES = 32  # the longest patch expected is the longer of the two


class Stretch(NamedTuple):
    """The filter over a stretch of a log: samples [low, high) of its readings, which begin at the log's sample `first`
    and go on after the run's end. begun: where the filter began anew, and at first."""

    readings: Readings
    run: FilterRun
    begun: list[Start]
    first: int
    low: int
    high: int


def parts(record: Recording, settings: FilterSettings, block: int = BLOCK) -> Iterator[Part]:
    """The estimate of a log by stretches of `block` samples; whatever their length, it is the same.

    Raises ValueError when a component has no reading that agrees with its neighbours at the beginning.
    """
    model = _model(record, settings)
    done, anew = 0, []
    for readings, run, begun, first, low, high in _stretches(record, settings, model, block):
        kept = _kept(run, settings)
        label = preparing.labels(kept, readings.measurement[:high])
        anew += [first + start.sample for start in (begun if first + low else begun[1:])]
        end = high if first + high == len(record) else high - _unsure(kept, readings.measurement[:high])
        found = Estimate(run, label, model, reacquired=tuple(sample - first for sample in anew))
        yield Part(found, first, done - first, end)
        done = first + end


def _unsure(kept: FloatArray, measurement: FloatArray) -> int:
    """How many samples at the end wait for the next stretch to tell how long a run of outliers is; both (n, 3)."""
    looked_at = min(HISTORY // 2, len(kept))
    sure = looked_at
    for used, reading in zip(kept[-looked_at:].T, measurement[-looked_at:].T, strict=True):
        good, bad = np.flatnonzero(used > 0), np.flatnonzero(np.isfinite(reading) & (used == 0))
        if good.size and bad.size and bad[-1] > good[-1]:
            sure = min(sure, int(good[-1]) + 1)
    return looked_at - sure


def estimate(readings: Readings, settings: FilterSettings) -> Estimate:
    """The same of a whole log, and smoothed if that was asked for. Errors as in `parts`."""
    record = Recording(*readings)
    model = _model(record, settings)
    (stretch,) = _stretches(record, settings, model, len(record))
    kept = _kept(stretch.run, settings)
    return preparing.finished(readings, settings, stretch.run, kept, kept, model, stretch.begun)


def _kept(run: FilterRun, settings: FilterSettings) -> FloatArray:
    """(n, 3) 1 for readings that are used, 0 for those that are called outliers."""
    return np.where(run.weight > gate.rejection_weight(settings.gate), 1.0, 0.0)


def _stretches(record: Recording, settings: FilterSettings, model: Model, block: int) -> Iterator[Stretch]:
    n = len(record)
    how = gate.GateSettings(settings.gate, _longest_patch_s(record, settings), settings.gain_form)
    longest_s = initialization.longest_without(typical_interval(record.time_s))
    weight, begin = _beginning(record, settings, model)
    edges = [0, *range(max(block, begin.sample + 1), n, block), n]
    going: track.Track | None = None
    last_good_s = np.full(3, np.nan)
    history = empty_run(np.empty(0))
    for low, high in itertools.pairwise(edges):
        first = max(low - HISTORY, 0)
        readings = record.part(slice(first, min(high + AHEAD, n)))
        here, stop = low - first, high - first
        good, allowed = np.isfinite(readings.measurement), np.ones((stop, 3))
        if low == 0:
            good[: len(weight)] &= weight[: len(good)] > 0
            allowed[:HEAD] = weight[:HEAD]
        starts = _after_gaps(readings, good, here, stop, model, longest_s, last_good_s)
        if low == 0:
            starts = [begin, *(anew for anew in starts if anew.sample > begin.sample)]
        run = _prolonged(history, readings.time_s[:stop])
        going, begun, _ = track.go_on(going, here, stop, *readings[:2], allowed, model, starts, how, run)
        if low == 0:
            lead_in(readings.measurement, model, begin, run)
        yield Stretch(readings, run, begun, first, here, stop)
        last_good_s = _last_good_s(readings.time_s, good, here, stop, last_good_s)
        kept = min(HISTORY, stop)
        history = FilterRun._make([*(each[stop - kept :].copy() for each in run[:-1]), 0.0])
        going = going.shifted(stop - kept)


def _prolonged(history: FilterRun, time_s: FloatArray) -> FilterRun:
    """An empty run of these times but for its first rows."""
    run = empty_run(time_s)
    for filled, known in zip(run[:-1], history[:-1], strict=True):
        filled[: len(known)] = known
    return run


def _last_good_s(time_s: FloatArray, good: NDArray[np.bool_], low: int, high: int, before_s: FloatArray) -> FloatArray:
    """(3,) when each component was last seen before sample `high`; NaN for never."""
    last_s = before_s.copy()
    for c in range(3):
        seen = np.flatnonzero(good[low:high, c])
        if seen.size:
            last_s[c] = time_s[low + seen[-1]]
    return last_s


def _after_gaps(
    readings: Readings,
    good: NDArray[np.bool_],
    low: int,
    high: int,
    model: Model,
    longest_s: float,
    last_good_s: FloatArray,
) -> list[Start]:
    """Starts in samples [low, high) after gaps that are too long to bridge; good (n, 3)."""
    time_s, measurement, _ = readings
    before = max(low - 1, 0)  # an interval may end with the first sample
    seen = good[before:].copy()
    seen[: low - before] = False
    gaps = initialization.gaps_of(time_s[before:], seen, longest_s, last_good_s)
    begins = sorted(before + k for k in gaps)
    starts = []
    for k, following in itertools.pairwise([*begins, len(time_s)]):
        if k >= high:
            break
        window = slice(k, min(following, k + AHEAD))
        weight, _ = two_pass.screen(time_s[window], measurement[window])
        usable = (weight > 0) & good[window]
        if (usable.sum(0) < initialization.FEWEST_READINGS).any():
            continue
        if initialization.too_long(gaps[k - before], measurement[window, 0][usable[:, 0]], float(model.jerk[0, 0])):
            around = np.zeros(measurement.shape)
            around[window] = usable
            starts.append(
                initialization.first_state(time_s, measurement, around, model.noise_variance, k, k, window.stop)
            )
    return starts


def _model(record: Recording, settings: FilterSettings) -> Model:
    """Noise and jerk level: as given, else from spans of the log."""
    given = preparing.given_sigma(record, settings)
    jerk = settings.jerk_psd_m2ps5
    if np.isfinite(given).all() and jerk is not None:
        return Model(given**2, isotropic(jerk))
    try:
        return preparing.prepare(_excerpt(record), settings)[0]
    except ValueError:  # a component says nothing in the spans
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
    """(m, 3) weights of the log's first samples, and its start. More samples are looked at while they do not say where
    the target is."""
    looked_at = HEAD
    while True:
        readings = record.part(slice(0, looked_at))
        weight, _ = preparing.trusted(readings, settings)
        try:
            return weight, initialization.begin(*readings[:2], weight, model.noise_variance)
        except ValueError:
            if looked_at >= len(record):
                raise
        looked_at *= 4
