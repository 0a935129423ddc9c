"""Abrupt changes of the acceleration: a motor is lit or burns out, a store is let go, a canopy opens.

A jerk profile follows one with a peak, which blurs the track for as long as its knots last. So where it has a peak, a
change within a single interval between samples is its rival, with the profile as it is beside the peak. One sweep says
how likely it is in each interval, as the readings are linear in it (see `filtering.columns`); its variance is shared
out among the intervals by how likely it is there. What explains the readings around a peak better stays.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ftproc.core import odds
from ftproc.core.filtering.columns import Columns, said_of
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import likelihood_of, smooth_log
from ftproc.core.identification.nearby import start_of_part
from ftproc.core.identification.profile import ALLOWANCE, climbed, fit_profile, of_part, roughness, with_allowance
from ftproc.core.identification.scales import scales_of
from ftproc.core.model.motion import NO_JOLTS, Jolts
from ftproc.records import FloatArray, IntArray

LONGEST_PEAK, HEIGHT = 5, 30.0  # knots, and times the jerk beside it: a peak of the profile that may be a change
BESIDE_KNOTS = 5  # of the profile on each side of a peak, in which the two are compared
VARIANCES = 10.0 ** np.arange(-2, 9)  # m2/s4 of a change, along each axis
PLACES = 24  # of a change that are tried in a peak
LEAST_SHARE = 0.01  # of its variance, that an interval has
MOST_CHANGES = 3  # at a peak: a motor that is lit and burns out
STEPS = 3  # of the search for a profile


def told(log: Observations, starts: list[Start], model: Model) -> Model | None:
    """The model with the abrupt changes that its log tells, and the profile that is likeliest with them; None if it
    tells none. model: with white jerk, whose profile has its allowance."""
    if not math.isfinite(model.knot_s) or model.coloured or model.motion.acts:
        return None
    likeliest = model._replace(jerk=model.jerk / ALLOWANCE)
    quiet, peaks = without_peaks(likeliest.jerk[:, 0])
    run, found = None, likeliest
    for first, last in peaks:
        edges = np.array([first - 1, last + 1, first - BESIDE_KNOTS, last + BESIDE_KNOTS]) * model.knot_s
        low, high, begin, end = np.searchsorted(log.time_s, log.time_s[0] + edges)
        inside = np.arange(max(low, begin + 2), min(high, end - 2))
        inside = inside[log.time_s[inside] > log.time_s[inside - 1]]
        if len(inside) == 0 or any(begin < start.sample < end for start in starts) or begin < starts[0].sample:
            continue
        run = run or smooth_log(log, model, starts)
        start = start_of_part(run.state[begin], run.sigma[begin])
        jerk = found.jerk.copy()
        jerk[first:last] *= (quiet[first:last] / jerk[first:last, 0])[:, None]
        part, since_s = log.part(slice(begin, end)), log.time_s[begin:end] - log.time_s[0]
        peaked, level = (of_part(likeliest._replace(jerk=each), since_s) for each in (likeliest.jerk, jerk))
        changes = _at_peak(part, start, peaked, level, inside[:: max(len(inside) // PLACES, 1)] - begin)
        if len(changes.time_s):
            found = found._replace(jerk=jerk, jolts=found.jolts + changes)
    if found is likeliest:
        return None
    return with_allowance(log, fit_profile(log, starts, found, STEPS))


def without_peaks(jerk: FloatArray) -> tuple[FloatArray, list[tuple[int, int]]]:
    """A profile (m,) without its peaks (by a morphological opening), and the knots [first, last) of each."""
    level = np.log(jerk)
    around = sliding_window_view(np.pad(level, 2 * (LONGEST_PEAK // 2 + 1), "edge"), LONGEST_PEAK + 2)
    quiet = np.minimum(sliding_window_view(around.min(1), LONGEST_PEAK + 2).max(1), level)
    edges = np.flatnonzero(np.diff(level > quiet + math.log(HEIGHT), prepend=False, append=False))
    return np.exp(quiet), list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _at_peak(log: Observations, start: Start, peaked: Model, level: Model, places: IntArray) -> Jolts:
    """The changes in the intervals before some of these samples that explain the part of a log better than a peak."""
    scales, found, least = scales_of(log, level.noise_variance), NO_JOLTS, _likelihood(log, start, peaked)
    change, gain = _likeliest(log, start, level, places)
    if _likelihood(log, start, level) + gain < least:
        return found
    least = climbed(log, [start], peaked, STEPS, scales)[1]
    for _ in range(MOST_CHANGES):
        likelihood = climbed(log, [start], level._replace(jolts=found + change), STEPS, scales)[1] - odds.SURE
        if likelihood < least:
            break
        found, least = found + change, likelihood
        change, _ = _likeliest(log, start, level._replace(jolts=found), places)
    return found


def _likelihood(log: Observations, start: Start, model: Model) -> float:
    return likelihood_of(log, model, [start]) - roughness(model)


def _likeliest(log: Observations, start: Start, model: Model, places: IntArray) -> tuple[Jolts, float]:
    """A change in one of the intervals before these samples, and by how much likelier the log is with it."""
    begin = np.repeat(places, 3)
    acceleration = np.tile(np.arange(6, 9), len(places))
    said = said_of(log, model, [start], Columns(np.zeros((len(log.time_s), 3, 3)), begin, begin, acceleration))
    own = 3 * np.arange(len(places))[:, None] + np.arange(3)
    strength, axes = np.linalg.eigh(said.information[own[:, :, None], own[:, None, :]])
    strength, pull = np.maximum(strength, 0.0)[:, :, None], np.einsum("pia,pi->pa", axes, said.score[own])[:, :, None]
    gain = 0.5 * (pull**2 / (strength + 1 / VARIANCES) - np.log1p(strength * VARIANCES)).sum(1)
    odds = np.exp(gain - gain.max())
    share = odds.sum(1) / odds.sum()
    kept = share > LEAST_SHARE
    variance = (odds * VARIANCES).sum(1) / odds.sum()
    return Jolts(log.time_s[places[kept]], variance[kept]), float(gain.max() + math.log(odds.mean()))
