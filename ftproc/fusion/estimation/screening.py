"""What is accepted of a station's readings before there is a fused track: what each component says alone, and then
what a first track does not contradict."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing import screened
from ftproc.core.filtering.records import Model
from ftproc.core.model import stations as geometry
from ftproc.fusion.estimation import alternatives, intervals
from ftproc.fusion.estimation.events import CLOCK, Events, Seen
from ftproc.fusion.estimation.first_track import Track
from ftproc.records import FloatArray

LEAST_NOISE = (1e-4, 1e-8, 1e-8)  # m, rad, rad
FEWEST = 20  # readings, for the noise or the median of a component
FEWEST_KEPT = 0.5  # of a component: a track that contradicts more is wrong itself
GROSS, GROSS_TRACK = 20.0, 8.0  # times what is not known of a component, and of the track, that a median may be off
OFF, OFF_SIGMAS, OFF_CLOCKS = 8.0, 3.0, 2.0  # of the first track: median deviations, sigmas, clock priors


class Screened(NamedTuple):
    """possible, trusted: (rows, 3) readings of a station that may be good, and that screening trusts; sigma (3,)."""

    possible: FloatArray
    trusted: FloatArray
    sigma: FloatArray


def screen(station: Seen, banned: NDArray[np.bool_]) -> Screened:
    """A station alone. banned: (rows, 3) readings of patches."""
    z = np.where(banned, np.nan, station.measurement)
    weight, sigma, least = np.isfinite(z).astype(float), np.ones(3), screened.rounding_sigma(z)
    for c in station.components:
        channel = np.ascontiguousarray(z[:, c])
        weight[:, c], _, sigma[c] = screened.screen_channel(
            station.time_s, channel, c == 1, math.sqrt(2) * float(least[c])
        )
    sigma = np.where(np.isfinite(station.known), station.known, np.maximum(sigma, LEAST_NOISE))
    possible = np.isfinite(z) & ~screened.stuck_readings(z, sigma)
    possible[:, 0] &= z[:, 0] > 0
    possible |= station.accepted
    return Screened(possible.astype(float), np.where(station.accepted, 1.0, weight * possible), sigma)


def agreeing(station: Seen, screened: Screened, track: Track) -> FloatArray:
    """(rows, 3) readings that the screening trusts and the first track does not contradict, about their own median."""
    weight = screened.trusted.copy()
    state = track.at(station.time_s)
    expected = geometry.measured(state[:, :3], station.place, station.axes)
    n = len(state)
    rate = np.abs(geometry.design(state, np.tile(station.place, (n, 1)), np.tile(station.axes, (n, 1, 1)))[:, :, 2])
    off = geometry.innovation(station.measurement, expected)
    inside = (station.time_s >= track.time_s[0]) & (station.time_s <= track.time_s[-1])
    for c in station.components:
        known = (weight[:, c] > 0) & inside
        if known.sum() < FEWEST:
            continue
        middle = np.median(off[known, c])
        track_sigma = np.median(track.sigma) / (1.0 if c == 0 else max(float(np.median(expected[known, 0])), 1.0))
        unknown = station.prior[c] + station.prior[CLOCK] * float(np.median(rate[known, c])) + screened.sigma[c]
        if abs(middle) > GROSS * unknown + GROSS_TRACK * track_sigma:
            weight[:, c] = 0.0  # a wrong place, convention or clock: no bias explains it
            continue
        scatter = 1.4826 * np.median(np.abs(off[known, c] - middle))
        limit = OFF * scatter + OFF_SIGMAS * screened.sigma[c] + OFF_CLOCKS * station.prior[CLOCK] * rate[:, c]
        wrong = inside & (np.abs(off[:, c] - middle) > limit)
        if wrong[known].mean() < FEWEST_KEPT:
            weight[wrong, c] = 0.0
    return weight


def with_biases(events: Events, stations: list[Seen], state: FloatArray, sigma: FloatArray) -> FloatArray:
    """(m, 3) how far readings may be off, with the biases and clocks that are yet unknown."""
    rate = np.abs(design(events, state)[:, :, 2])
    wide = sigma.copy()
    for s, station in enumerate(stations):
        clock = station.prior[CLOCK] * np.median(rate[events.station == s], 0)
        wide[s] = np.sqrt(sigma[s] ** 2 + station.prior[:3] ** 2 + clock**2)
    return wide


def first_decisions(whole: alternatives.Neighbourhood) -> tuple[Model, FloatArray]:
    """The likeliest model and decisions (n, 3) of a whole flight, from the weights of its log."""
    search = intervals.Search(0)
    ends = [(alternatives.Steps(whole, model, search).settled(whole.log.weight), model) for model in whole.levels]
    best, model = max(ends, key=lambda each: each[0].likelihood)
    return model, best.weight


def interval(stations: list[Seen]) -> float:
    """Of the densest station, s."""
    return min(_typical(np.diff(s.time_s)) for s in stations if len(s.time_s) > 1)


def _typical(steps: FloatArray) -> float:
    """The median of some intervals (n,), or of those that are not zero, where most are."""
    middle = float(np.median(steps))
    if middle > 0:
        return middle
    return float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0


def design(events: Events, state: FloatArray) -> FloatArray:
    """(n, 3, 3) of the events, see `core.model.stations`."""
    sites = events.sites
    return geometry.design(state, sites.place[sites.station], sites.axes[sites.station])
