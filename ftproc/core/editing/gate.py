"""Recursive editing: the innovation gate that tells isolated outliers from patches, as a live system can do it.

Zuo et al. 2021 section 2.3 gates every component of the innovation, |e_i| <= C sigma_i with sigma_i = sqrt(S_ii)
(eqs 15-17; the paper's extra 1/(2n) under the root would divide the track's part of S twice), turns the gain down
by a weight m in [0, 1] for isolated outliers, and replaces patches by the prediction. What the paper leaves open is
filled in here:

* m(u) with u = |e_i| / sigma_i is the three-segment IGG-III weight: 1 up to k0, falling to 0 at k1. It acts as R/m
  (`gain_form` scales the gain instead, the paper's letter), per component: a bad range leaves A and E their weight.
* A patch begins with a jump of the raw reading (or far outside) and ends with a jump back; a smooth departure inside
  the outer gate is a manoeuvre. During a patch m = 0: the substitute is the prediction itself, and P stays honest.
* A component that stays outside for longer than the longest patch means that the track is lost, not the reading:
  the caller starts anew (`run_gated` stops there, see `track`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part
from ftproc.core.filtering import ukf
from ftproc.core.filtering.records import FilterRun
from ftproc.core.model import motion
from ftproc.core.model.measurement import innovate, line_of_sight_sigma, measure, wrap_angle

FloatArray = NDArray[np.float64]

FULL_AT = 0.625  # of the gate C: full weight up to k0 = 2.5 sigma at C = 4
ZERO_AT = 1.5  # of the gate C: no weight from k1 = 6 sigma on
JUMP = 4.0  # sigmas of a difference of two readings that make a jump
SETTLE = 2  # samples within the gate, after the jump back, that end a patch
FLOOR = 1e-3  # weights below it are zero
MAX_SPEED_MPS = 2e4
MAX_ACCELERATION_MPS2 = 2e3


class GateSettings(NamedTuple):
    """gate: C in sigmas. longest_patch_s: a component outside for longer means a lost track."""

    gate: float = 4.0
    longest_patch_s: float = 4.0
    gain_form: bool = False


@kernel
def igg3(u: float, full: float, zero: float) -> float:
    """Three-segment weight (IGG-III): 1 for u <= full, 0 for u >= zero, smoothly falling between."""
    if u <= full:
        return 1.0
    if u >= zero:
        return 0.0
    part = (zero - u) / (zero - full)
    return full / u * part * part


def rejection_weight(gate: float) -> float:
    """The weight at the gate itself: a reading with less is called an outlier."""
    return float(igg3(gate, FULL_AT * gate, ZERO_AT * gate))


@part
def _decide(
    k: int,
    time: FloatArray,
    e: FloatArray,
    c: FloatArray,
    noise: FloatArray,
    full: float,
    zero: float,
    allowed: FloatArray,
    track: FloatArray,
    used: FloatArray,
) -> bool:
    """Weights of one sample from its innovation; track (3, 5) is the memory of each component: in a patch (0/1),
    readings in it, readings back inside, last residual, time of its onset. False while any is in a patch."""
    inside = True
    for i in range(3):
        used[i] = 0.0
        if not math.isfinite(e[i]) or allowed[i] <= 0:
            continue
        u = abs(e[i]) / math.sqrt(c[i, i] + noise[i])
        step = e[i] - track[i, 3]
        if i == 1:
            step = wrap_angle(step)
        jumped = not abs(step) <= JUMP * math.sqrt(2 * noise[i])  # no residual yet (NaN) counts as a jump
        if track[i, 0] == 0:
            # A smooth departure within the outer gate is a manoeuvre; beyond it no tuned filter is left behind.
            used[i] = igg3(u, full, zero) if jumped or u >= zero else 1.0
            if used[i] < FLOOR:
                used[i] = 0.0
                track[i, 0], track[i, 1], track[i, 2], track[i, 4] = 1.0, 1.0, 0.0, time[k]
        else:
            track[i, 1] += 1
            if u < zero and (jumped != (track[i, 2] > 0)):
                track[i, 2] += 1
            else:
                track[i, 2] = 0
            settled = track[i, 2] >= SETTLE or (track[i, 2] >= 1 and u <= full and track[i, 1] <= 3)
            if settled:
                track[i, 0] = track[i, 1] = track[i, 2] = 0.0
                used[i] = max(igg3(u, full, zero), 0.1)
        inside = inside and track[i, 0] == 0
    return inside


@part
def _update_by_gain(
    x: FloatArray, p: FloatArray, pxz: FloatArray, c: FloatArray, e: FloatArray, noise: FloatArray, used: FloatArray,
    s: FloatArray, s_inv: FloatArray, gain: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """The paper's letter, K <- K m, with the covariance that any gain has: P - K Pxz' - Pxz K' + K S K'."""
    for i in range(3):
        for j in range(3):
            s[i, j] = c[i, j] + (noise[i] if i == j else 0.0)
    log_det = ukf.invert_used(s, used, s_inv)
    nis = 0.0
    for i in range(3):
        for j in range(3):
            if used[i] > 0 and used[j] > 0:
                nis += e[i] * s_inv[i, j] * e[j]
    for i in range(9):
        for j in range(3):
            full = pxz[i, 0] * s_inv[0, j] + pxz[i, 1] * s_inv[1, j] + pxz[i, 2] * s_inv[2, j]
            gain[i, j] = full * used[j]
            if used[j] > 0:
                x[i] += gain[i, j] * e[j]
    for i in range(9):
        for j in range(i + 1):
            v = p[i, j]
            for m in range(3):
                spread = gain[i, 0] * s[0, m] + gain[i, 1] * s[1, m] + gain[i, 2] * s[2, m]
                v += (spread - pxz[i, m]) * gain[j, m] - gain[i, m] * pxz[j, m]
            p[i, j] = v
            p[j, i] = v
    return nis, -0.5 * (log_det + nis)


@kernel
def run_gated(
    first: int,
    last: int,
    start: int,
    time: FloatArray,
    z: FloatArray,
    noise: FloatArray,
    jerk: FloatArray,
    knot_s: float,
    gate: float,
    longest_patch_s: float,
    gain_form: bool,
    retry: int,
    allowed: FloatArray,
    x: FloatArray,
    p: FloatArray,
    track: FloatArray,
    run: FilterRun,
) -> tuple[int, float]:
    """Filter and edit samples [first, last) (x, P in place; the track began at sample `start`).

    Returns the sample at which the track is lost, not before `retry`, or `last`; and the log-likelihood of what was
    used.
    """
    factor, b, h, c = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    z_hat, e, used = np.zeros(3), np.zeros(3), np.zeros(3)
    pxz, gain, s, s_inv = np.zeros((9, 3)), np.zeros((9, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    full, zero = FULL_AT * gate, ZERO_AT * gate
    state, covariance = x, p
    x, p = motion.own(state, covariance)
    likelihood, lost = 0.0, last
    for k in range(first, last):
        if k > start:
            piece = motion.knot_index(time[k], time[0], knot_s, jerk.shape[0])
            motion.predict(x, p, time[k] - time[k - 1], jerk[piece], c)
        for i in range(9):
            run.predicted[k, i] = x[i]
        ukf.linearise(x, p, factor, b, z_hat, h, c)
        innovate(z[k], z_hat, e)
        inside = _decide(k, time, e, c, noise, full, zero, allowed[k], track, used)
        any_used = False
        for i in range(3):
            run.innovation[k, i] = e[i]
            run.innovation_sigma[k, i] = math.sqrt(c[i, i] + noise[i])
            run.weight[k, i] = used[i]
            any_used = any_used or used[i] > 0
        if any_used:
            ukf.cross_covariance(p, h, pxz)
            if gain_form:
                nis, gained = _update_by_gain(x, p, pxz, c, e, noise, used, s, s_inv, gain)
            else:
                nis, gained = ukf.update(x, p, pxz, c, h, e, noise, used, s, s_inv, gain)
            run.nis[k] = nis
            likelihood += gained
        z_hat[0], z_hat[1], z_hat[2] = measure(x[0], x[1], x[2])
        innovate(z[k], z_hat, e)
        for i in range(3):
            if math.isfinite(e[i]) and allowed[k, i] > 0:
                track[i, 3] = e[i]
        for i in range(9):
            run.state[k, i] = x[i]
            run.sigma[k, i] = math.sqrt(max(p[i, i], 0.0))
        line_of_sight_sigma(x, p, run.los_sigma[k])
        run.since_start[k] = k - start
        if k >= retry and (_wild(x) or (not inside and _overdue(track, time[k], longest_patch_s))):
            lost = k
            break
    motion.hand_over(x, p, state, covariance)
    return lost, likelihood


@part
def _overdue(track: FloatArray, now: float, longest_patch_s: float) -> bool:
    late = False
    for i in range(3):
        late = late or (track[i, 0] > 0 and now - track[i, 4] > longest_patch_s)
    return late


@part
def _wild(x: FloatArray) -> bool:
    speed2 = x[3] * x[3] + x[4] * x[4] + x[5] * x[5]
    acceleration2 = x[6] * x[6] + x[7] * x[7] + x[8] * x[8]
    return not (speed2 < MAX_SPEED_MPS**2 and acceleration2 < MAX_ACCELERATION_MPS2**2)
