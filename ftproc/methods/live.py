"""The main method with live editing: what a system can know of the track `lag_s` seconds after each reading."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ftproc.core.editing.two_pass import Known
from ftproc.core.filtering.records import FilterRun
from ftproc.core.live.editor import LiveEditor, Published
from ftproc.core.live.recursive import Gating
from ftproc.methods.estimate import Estimate, Part, Recording
from ftproc.records import chunks
from ftproc.settings import FilterSettings

BLOCK = 4096  # samples of a part


def editor(settings: FilterSettings) -> LiveEditor:
    """The live editor with these settings."""
    sigma = np.array(settings.noise or (None, None, None), float)  # None becomes NaN
    known = Known(sigma, settings.jerk_psd_m2ps5, settings.gate)
    if settings.editing == "forward":
        return LiveEditor(known, 0.0, Gating(settings.gate, settings.max_patch_s, settings.gain_form).window)
    return LiveEditor(known, settings.lag_s)


def parts(record: Recording, settings: FilterSettings) -> Iterator[Part]:
    """The estimate of a log by parts of about BLOCK samples. Samples before the track is confirmed have none."""
    record = replace(record, absent=())  # whether a component is missing throughout is not known until the end
    live = editor(settings)
    for rows in chunks(len(record), BLOCK):
        readings = record.part(rows)
        found = live.push(readings.time_s, readings.measurement)
        if rows.stop == len(record):
            found += live.finish()
            if not live.confirmed_once:
                raise ValueError("the readings are too few, or agree too little, for a track to be confirmed")
        if found:
            n = sum(len(each.rows) for each in found)
            first = found[0].first
            yield Part(estimate(live, found, record.part(slice(first, first + n)).time_s), first, 0, n)


def estimate(live: LiveEditor, found: Sequence[Published], time_s: np.ndarray) -> Estimate:
    """The rows that have left the editor one after the other, with their times."""
    rows = np.concatenate([each.rows for each in found])
    label = np.concatenate([each.label for each in found]).astype(np.uint8)
    known = np.concatenate([each.known for each in found])
    again = np.concatenate([each.reacquired for each in found])
    run, lost = FilterRun.of(time_s, rows, 0.0), tuple(np.flatnonzero(again).tolist())
    return Estimate(run, label, live.model, reacquired=lost, known=known, absent=live.absent)
