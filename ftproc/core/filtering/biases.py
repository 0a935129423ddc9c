"""Unknown constants of the measurements beside the smoother: Friedland's separate-bias form.

The biases b of the stations (range, azimuth, elevation, tilts, clock; of heights offset and scale) are few and
constant. The filter runs without them; what it would do otherwise is linear in them (Friedland 1969), so that only
columns are carried along: with design D = d(reading)/db and the whitened quantities of `smoother`,

    S <- Phi S       C = L^-1 (D + H S)     S <- S - U' C          forward: S = dx/db, C = -dy/db
    info += C' C     score += C' y                                 of the likelihood with the trajectory integrated out
    V = C - U l      l <- l + G' V          l <- Phi' l            backward
    S^s = S+ - P+ l+                                               of the smoothed state

Columns are directions of the space of biases, scaled so that the biases' covariance in them is the unit matrix. So S^s
S^s' is what they add to the covariance of the state; a leave-one-out residual u / M becomes u / (M - c c') where c is
its row of L^-T V. Scalars beside the readings (`beside`) are updates of their own, before them.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import empty, kernel, part, variant, zeros
from ftproc.core.filtering import backward, beside, smoother
from ftproc.core.filtering.filters import (
    FILTER,
    POSTERIOR,
    UPDATE,
    Filter,
    Filters,
    Posteriors,
    Update,
    Updates,
    retain_linearised,
)
from ftproc.core.filtering.forward import ESTIMATED, LEFT, Estimates, Residuals, Span, extrapolated
from ftproc.core.filtering.memory import scratch
from ftproc.core.filtering.records import Model, Observations, Sample, Start
from ftproc.core.filtering.smoother import SCORES, STATES, SmootherRun
from ftproc.core.model import forces
from ftproc.core.model.motion import Motion
from ftproc.core.signatures import Cube, Indices, Matrix, Vector

FloatArray = NDArray[np.float64]

PARAMETERS = 8  # of a station: range, azimuth, elevation, tilt about its x and about its y, clock; height and its scale
UNKNOWN = 5  # the first of those on which scalars beside the readings depend, see `beside`
BLOCK = 1024  # samples of which S and C are kept


class Directions(NamedTuple):
    """How the readings depend on the biases. design: (n, 3, 3) derivative of each component by the two tilts and the
    clock offset of its station, m or rad per rad and s; by its own bias it is one. columns: (PARAMETERS * stations, m)
    directions, each a set of biases. beside: (kinds, n, UNKNOWNS) derivative of each scalar beside the readings by the
    last of the biases."""

    design: FloatArray
    columns: FloatArray
    beside: FloatArray = np.zeros((0, 0, beside.UNKNOWNS))


class Memory(NamedTuple):
    """`smoother.Memory`, and for m columns: station (n,) of each sample; design (n, 3, 3), columns of `Directions`;
    by: the motion; state (9, m) S; adjoint (9, m) l; at_block (blocks, 9, m) S before each block; in_block
    (BLOCK, 9, m) S after each sample and white (BLOCK, 3, m) C; score (m,), info (m, m); spread (n, 9) the variance
    that biases add to the filter's state. scalars (kinds, n, WIDTH) beside the readings, and their white_beside
    (kinds * BLOCK, m) C."""

    filters: Filters
    before: Filters
    block: Updates
    after: Posteriors
    back: backward.Backwards
    estimates: Estimates
    residuals: Residuals
    station: Indices
    design: Cube
    columns: Matrix
    by: Motion
    state: Matrix
    adjoint: Matrix
    at_block: Cube
    in_block: Cube
    white: Cube
    score: Vector
    info: Matrix
    spread: Matrix
    scalars: Cube
    white_beside: Matrix


class Biased(NamedTuple):
    """A smoother run that allows for biases. run: of `smoother`; its sigmas and residuals include them. spread: (n, 9)
    the variance that they add to the filter's state, m2 and so on. score (m,), info (m, m): of the log-likelihood by
    the biases in the directions given. beside: (kinds, n, 2) leave-one-out residuals of the scalars beside the
    readings, and their variances."""

    run: SmootherRun
    spread: FloatArray
    score: FloatArray
    info: FloatArray
    beside: FloatArray = np.zeros((0, 0, 2))


@part
def _keep(memory: Any, b: int) -> None:
    memory.at_block[b] = memory.state


@part
def _recall(memory: Any, b: int) -> None:
    memory.state[:] = memory.at_block[b]


@part
def _derivative(memory: Any, k: int, i: int, c: int) -> float:
    """D of component i of a sample in direction c."""
    at, columns, design = PARAMETERS * memory.station[k], memory.columns, memory.design
    turning = design[k, i, 0] * columns[at + 3, c] + design[k, i, 1] * columns[at + 4, c]
    return float(columns[at + i, c] + turning + design[k, i, 2] * columns[at + 5, c])


# The innermost loops below go along the directions, which lie side by side in memory: there may be many.


@part
def _of_scalars(memory: Any, k: int) -> FloatArray:
    """(UNKNOWNS, m) the columns on which the scalars beside the readings of a sample depend."""
    at = PARAMETERS * memory.station[k] + UNKNOWN
    found: FloatArray = memory.columns[at : at + beside.UNKNOWNS]
    return found


@part
def _carry(memory: Any, f: Filter, k: int, interval: float, place: int) -> None:
    s, g, u, root, y, h = memory.state, f.g, f.u, f.root, f.y, 0.5 * interval * interval
    white, m = memory.white[max(place, 0)], s.shape[1]
    if memory.by.acts:
        forces.kick_columns(s, f, memory.by, max(k - 1, 0), interval)
    for i in range(3):
        for c in range(m):
            s[i, c] += interval * s[i + 3, c] + h * s[i + 6, c]
            s[i + 3, c] += interval * s[i + 6, c]
    if memory.by.acts:
        forces.kick_columns(s, f, memory.by, k, interval)
    for kind in range(len(memory.scalars)):
        row, at = memory.scalars[kind, k], kind * len(memory.white) + max(place, 0)
        beside.carry(s, row, _of_scalars(memory, k), memory.white_beside[at])
        if place >= 0:
            beside.count(row, memory.white_beside[at], memory.score, memory.info)
    for i in range(3):
        g0, g1, g2 = g[i, 0], g[i, 1], g[i, 2]
        for c in range(m):
            white[i, c] = g0 * s[0, c] + g1 * s[1, c] + g2 * s[2, c]
    for c in range(m):
        d0, d1, d2 = _derivative(memory, k, 0, c), _derivative(memory, k, 1, c), _derivative(memory, k, 2, c)
        white[0, c] += root[0, 0] * d0
        white[1, c] += root[1, 0] * d0 + root[1, 1] * d1
        white[2, c] += root[2, 0] * d0 + root[2, 1] * d1 + root[2, 2] * d2
    for i in range(9):
        u0, u1, u2 = u[0, i], u[1, i], u[2, i]
        for c in range(m):
            s[i, c] -= u0 * white[0, c] + u1 * white[1, c] + u2 * white[2, c]
    if place < 0:
        return
    retain_linearised(f, memory.after[place])
    for c in range(m):
        w0, w1, w2 = white[0, c], white[1, c], white[2, c]
        memory.score[c] += w0 * y[0] + w1 * y[1] + w2 * y[2]
        for e in range(c + 1):
            memory.info[c, e] += w0 * white[0, e] + w1 * white[1, e] + w2 * white[2, e]
    for i in range(9):
        total = 0.0
        for c in range(m):
            memory.in_block[place, i, c] = s[i, c]
            total += s[i, c] * s[i, c]
        memory.spread[k, i] = total


@part
def _widen_path(gradient: FloatArray, direction: FloatArray, row: Any) -> None:
    """Add what errors of the state in these directions (9, m) add to the sigmas of `kinematics`, to first order."""
    for i in range(6):
        variance = row.path_sigma[i] * row.path_sigma[i]
        for c in range(direction.shape[1]):
            moved = 0.0
            for a in range(3 if i < 4 else 6):
                moved += gradient[i, a] * direction[3 + a, c]
            variance += moved * moved
        row.path_sigma[i] = math.sqrt(variance)


@part
def _carry_back(memory: Any, update: Update, sample: Sample, k: int, interval: float, place: int, wanted: int) -> None:
    if wanted == SCORES:
        return
    a, white, s = memory.adjoint, memory.white[place], memory.in_block[place]
    smoothed, row, left = memory.state, memory.estimates[k], memory.residuals[k]
    g, u, root, m, h = update.g, update.u, update.root, len(memory.score), 0.5 * interval * interval
    p, seen = memory.after[place].p, memory.after[place].h
    for i in range(9):
        for c in range(m):
            smoothed[i, c] = s[i, c]
        for j in range(9):
            pij = p[i, j]
            for c in range(m):
                smoothed[i, c] -= pij * a[j, c]
        if wanted == STATES:
            added = 0.0
            for c in range(m):
                added += smoothed[i, c] * smoothed[i, c]
            row.sigma[i] = math.sqrt(row.sigma[i] * row.sigma[i] + added)
    if wanted == STATES:
        _widen_path(memory.back[0].path, smoothed, row)
    for i in range(3):
        for j in range(9):
            uij = u[i, j]
            for c in range(m):
                white[i, c] -= uij * a[j, c]
    for i in range(3):
        lost = 0.0
        for c in range(m):
            if update.used[i] > 0:
                share = root[0, i] * white[0, c] + root[1, i] * white[1, c] + root[2, i] * white[2, c]
            else:
                share = _derivative(memory, k, i, c) + seen[i, 0] * smoothed[0, c]
                share += seen[i, 1] * smoothed[1, c] + seen[i, 2] * smoothed[2, c]
            lost += share * share
        if not update.used[i] > 0:
            left.residual_variance[i] += lost
        else:
            known = 1 / (left.residual_variance[i] - sample.noise[i] * (1 - 1 / update.used[i]))
            rest = max(known - lost, beside.LEAST_LEFT * known)
            left.residual[i] *= known / rest
            left.residual_variance[i] = 1 / rest + sample.noise[i] * (1 - 1 / update.used[i])
    for i in range(3):
        g0, g1, g2 = g[0, i], g[1, i], g[2, i]
        for c in range(m):
            a[i, c] += g0 * white[0, c] + g1 * white[1, c] + g2 * white[2, c]
    for kind in range(len(memory.scalars) - 1, -1, -1):
        row, at = memory.scalars[kind, k], kind * len(memory.white) + place
        beside.carry_back(a, row, _of_scalars(memory, k), memory.white_beside[at], smoothed)
    if memory.by.acts:
        forces.kick_columns_back(a, memory.filters[0], memory.by, k, interval)
    for i in range(3):
        for c in range(m):
            a[i + 6, c] += interval * a[i + 3, c] + h * a[i, c]
            a[i + 3, c] += interval * a[i, c]
    if memory.by.acts:
        forces.kick_columns_back(a, memory.filters[0], memory.by, max(k - 1, 0), interval)


_sweep_biased = kernel(
    variant(
        smoother.swept_through,
        __name__,
        "_sweep_biased",
        memory=Memory,
        _keep=_keep,
        _recall=_recall,
        _carry=_carry,
        _carry_back=_carry_back,
    )
)


def smooth_biased(log: Observations, model: Model, start: Start, directions: Directions) -> Biased:
    """Smooth a log of several stations from a start, allowing for biases. Samples before it are extrapolated."""
    assert log.sites is not None
    n, m, first = len(log.time_s), directions.columns.shape[1], start.sample
    blocks, rows = -(-(n - first) // BLOCK), min(n - first, BLOCK)
    estimates, residuals = zeros(ESTIMATED, n), zeros(LEFT, n)
    samples, profile = log.samples(model.noise_variance), model.profile_of(log)
    kinds = len(profile.beside)
    if kinds:
        profile.beside[:, :, beside.UNKNOWN :] = directions.beside
    memory = Memory(
        model.filter(start), empty(FILTER, blocks), scratch(UPDATE, rows), scratch(POSTERIOR, rows),
        zeros(backward.BACKWARD), estimates, residuals,
        np.ascontiguousarray(log.sites.station), np.ascontiguousarray(directions.design),
        np.ascontiguousarray(directions.columns), model.motion,
        np.zeros((9, m)), np.zeros((9, m)), np.zeros((blocks, 9, m)), np.zeros((rows, 9, m)),
        np.zeros((rows, 3, m)), np.zeros(m), np.zeros((m, m)), np.zeros((n, 9)),
        profile.beside, np.zeros((kinds * rows, m)),
    )  # fmt: skip
    memory.back["paths"] = 1.0
    jerk = np.zeros((len(profile.jerk), 2, 3))
    likelihood = _sweep_biased(Span(first, n, first), samples, profile, memory, jerk, STATES)
    covariance = memory.back["cov"][0] + memory.state @ memory.state.T
    head = Start(first, memory.back["state"][0, :9].copy(), covariance)
    estimates[:first], residuals[:first] = extrapolated(log, model, head)
    fields = {name: estimates[name] for name in ESTIMATED.names or ()}
    fields |= {name: np.ascontiguousarray(residuals[name]) for name in LEFT.names or ()}
    run = SmootherRun(**fields, log_likelihood=likelihood, heads=(head,))
    info = memory.info + np.tril(memory.info, -1).T
    left = profile.beside[:, :, beside.RESIDUAL : beside.SPREAD + 1]
    left[:, :first] = np.nan
    return Biased(run, memory.spread, memory.score, info, left)
