"""The main method as a live system can run it: live editing, which publishes each row when its lag has passed, and the
recursive editing of Zuo et al. 2021 section 2.3, which decides on every reading once, when it comes."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ftproc.core.beside import Channel
from ftproc.core.by_hand import NOTHING, Accepted
from ftproc.core.editing.two_pass import Known
from ftproc.core.filtering.initialization import find_starts, first_state
from ftproc.core.filtering.records import FilterRun, Model, Scalars
from ftproc.core.filtering.smoother import PATHS, smooth_log
from ftproc.core.identification.likelihood import Fixed, first_jerk, fit_level
from ftproc.core.live import beside
from ftproc.core.live.editor import LiveEditor
from ftproc.core.live.recursive import GatedWindow, Gating
from ftproc.core.live.rows import Published
from ftproc.core.model.motion import isotropic
from ftproc.long_records import chunks
from ftproc.methods import preparing
from ftproc.methods.estimate import Estimate, Part, Readings, Recording
from ftproc.records import GOOD, MISSING, FlagArray, FloatArray
from ftproc.settings import FilterSettings

BLOCK = 4096  # samples that are taken at once
NOT_USED = "the range rates are not used by now: too few, or they contradict the readings, are late, or add nothing"
OF_PAPER = "the range rates are not used: the paper's recursive editing has none; leave --editing forward out"
HISTORY = 256  # samples before a stretch that go with it: the network uses samples before


def editor(settings: FilterSettings, accepted: Accepted = NOTHING) -> LiveEditor:
    """An editor that has seen nothing, with these settings. accepted: see `Known`."""
    sigma = np.array(settings.noise or (None, None, None), float)  # None becomes NaN
    white_jerk = "turning-force" not in preparing.motions(settings, None).names
    known = Known(sigma, settings.jerk_psd_m2ps5, settings.gate, accepted, white_jerk=white_jerk)
    if settings.editing == "forward":
        return LiveEditor(known, window=Gating(settings.gate, settings.max_patch_s, settings.gain_form).window)
    return LiveEditor(known, settings.lag_s)


def parts(record: Recording, settings: FilterSettings, block: int = BLOCK) -> Iterator[Part]:
    """The estimate of a log by stretches; whatever their length, it is the same. Samples before the track is confirmed
    have none. Raises ValueError when it never is."""
    live, history = editor(settings, record.accepted), list[Published]()
    for left in _left(live, record, block):
        for new in _alike(left):
            first, count = new[0].first, sum(len(each.rows) for each in new)
            low = sum(len(each.rows) for each in history)
            both = [*history, *new]
            times = record.part(slice(first - low, first + count)).time_s
            yield Part(estimate(live, both, times, record.range_rate is not None), first - low, low, low + count)
            history = [_last(both, HISTORY)]


def _alike(left: Sequence[Published]) -> list[list[Published]]:
    """Those one after the other before which the same components were never seen, or that have no estimate at all."""
    found, absent = list[list[Published]](), None
    for each in left:
        here = each.absent if each.known.any() else absent
        if not found or (absent is not None and here != absent):
            found.append([])
        found[-1].append(each)
        absent = here
    return found


def _left(live: LiveEditor, record: Recording, block: int) -> Iterator[list[Published]]:
    """The rows of a log that leave an editor, which takes so many at once. Errors as in `parts`."""
    record = replace(record, absent=())  # whether a component is missing throughout shows only at the end
    for rows in chunks(len(record), block):
        readings = record.part(rows)
        came = readings.measurement
        if readings.range_rate is not None:
            came = np.column_stack([came, readings.range_rate])
        found = live.push(readings.time_s, came)
        if rows.stop == len(record):
            found += live.finish()
            if not live.confirmed_once:
                raise ValueError(
                    "the readings are too few, or agree too little, for a track to be confirmed; use --editing two-pass"
                )
        yield found


def estimate(live: LiveEditor, found: Sequence[Published], time_s: FloatArray, rates: bool = False) -> Estimate:
    """The rows that have left the editor, one after the other, with their times (n,). rates: whether the log has range
    rates, also where these rows have none."""
    rows = np.concatenate([each.rows for each in found])
    labels = np.concatenate([each.label for each in found]).astype(np.uint8)
    label, of_rates = np.ascontiguousarray(labels[:, : beside.RATE]), labels[:, beside.RATE]
    known = np.concatenate([each.known for each in found])
    again = np.concatenate([each.reacquired for each in found])
    run, lost = FilterRun.of(time_s, rows, 0.0), tuple(np.flatnonzero(again).tolist())
    rate = _rates(live, of_rates) if rates or (of_rates != MISSING).any() else None
    return Estimate(run, label, live.model, reacquired=lost, known=known, absent=_last_absent(found), range_rate=rate)


def _last_absent(found: Sequence[Published]) -> tuple[int, ...]:
    return next((each.absent for each in reversed(found) if each.known.any()), ())


def _rates(live: LiveEditor, label: FlagArray) -> Channel:
    """What is known of the range rates by now, of rows with these labels (n,)."""
    side = beside.Rates() if live.window is None else live.window.side
    n = len(label)
    rates = Scalars.rates(np.full(n, np.nan), side.sigma_mps**2, np.zeros(n))
    why = "" if side.used else OF_PAPER if isinstance(live.window, GatedWindow) else NOT_USED
    unknown = np.full((2, n), np.nan)
    return Channel(rates, np.ascontiguousarray(label), side.sign < 0, why=why, innovation=unknown[0], sigma=unknown[1])


def _last(found: Sequence[Published], count: int) -> Published:
    """The last rows of several."""
    rows, label, known, again = (np.concatenate(each)[-count:] for each in list(zip(*found, strict=True))[1:-1])
    return Published(0, rows, label, known, again)


def whole(readings: Readings, settings: FilterSettings) -> Estimate:
    """The estimate of a whole log. Errors as in `parts`."""
    record = Recording(*readings[:3], accepted=readings.accepted, range_rate=readings.range_rate)
    live = editor(settings, record.accepted)
    (left,) = _left(live, record, len(record))
    return estimate(live, left, record.part(slice(0, len(record))).time_s, record.range_rate is not None)


def smoothed(readings: Readings, settings: FilterSettings) -> Estimate:
    """A whole log with the decisions of recursive editing, smoothed. Samples before the track was confirmed are
    screened. Errors as in `parts`."""
    found, screened = whole(readings, settings), preparing.trusted(readings, settings)
    assert found.known is not None
    kept = np.where(found.known[:, None], found.label == GOOD, screened.weight > 0).astype(float)
    known = preparing.what_is_known(readings, settings)
    log, noise = readings.weighted(kept), screened.sigma**2
    jerk_psd = known.jerk_psd or first_jerk(log, noise)
    starts = find_starts(log, noise, jerk_psd)
    for sample in found.reacquired:
        with contextlib.suppress(ValueError):  # a component has no good reading from there on
            starts.append(first_state(log, noise, sample, slice(sample, len(kept))))
    starts.sort(key=lambda start: start.sample)
    fixed = Fixed(np.isfinite(known.sigma), known.jerk_psd is not None)
    model = fit_level(log, starts, Model(noise, isotropic(jerk_psd)), fixed)
    label = preparing.labels(kept, readings.measurement)
    return found._replace(label=label, model=model, smoothed=smooth_log(log, model, starts, PATHS), known=None)
