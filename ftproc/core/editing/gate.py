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
  `run_gated` stops there, and `track` re-acquires.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part, record, zeros
from ftproc.core.filtering import ukf, unscented
from ftproc.core.filtering.filters import Filter
from ftproc.core.filtering.forward import recursion
from ftproc.core.filtering.records import Row, Sample
from ftproc.core.model.measurement import moves, wrap_angle, wrapped
from ftproc.core.signatures import Layout

FloatArray = NDArray[np.float64]

FULL_AT = 0.625  # of the gate C: full weight up to k0 = 2.5 sigma at C = 4
ZERO_AT = 1.5  # of the gate C: no weight from k1 = 6 sigma on
JUMP = 4.0  # sigmas of a difference of two readings that make a jump
SETTLE = 2  # samples within the gate, after the jump back, that end a patch
FLOOR = 1e-3  # weights below it are zero
BY_HAND = 2.0  # the weight in the log of a reading that is used whatever the gate says
DIVERGED = 100.0  # ranges that the target would fly within the longest patch


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


class Gate(Protocol):
    """The record of a gate: its settings, and what it remembers of each component (range, azimuth, elevation).

    full, zero: sigmas at which the weight begins to fall and is zero. longest_patch_s, gain_form: see `GateSettings`.
    wait: samples to come before the track may be called lost. in_patch: 1 within a patch. rejected: readings of the
    patch so far. inside: the last of these that are within the gate. residual: of the last reading, NaN before any.
    onset_s: when the patch began.
    """

    full: float
    zero: float
    longest_patch_s: float
    gain_form: float
    wait: float
    in_patch: Annotated[FloatArray, 3]
    rejected: Annotated[FloatArray, 3]
    inside: Annotated[FloatArray, 3]
    residual: Annotated[FloatArray, 3]
    onset_s: Annotated[FloatArray, 3]


GATE = record(Gate)
Gates = Annotated[Any, Layout(GATE)]


def gate_of(settings: GateSettings) -> Any:
    """An array of one `Gate` that has seen nothing."""
    gates = zeros(GATE)
    gates["full"], gates["zero"] = FULL_AT * settings.gate, ZERO_AT * settings.gate
    gates["longest_patch_s"], gates["gain_form"] = settings.longest_patch_s, settings.gain_form
    gates["residual"] = np.nan
    return gates


@part
def _decide(f: Filter, sample: Sample, gate: Gate, sigma: FloatArray) -> bool:
    """Weights of a sample from its innovation, of this 1-sigma (3,); False while any component is in a patch."""
    e, used = f.e, f.used
    all_inside = True
    for i in range(3):
        used[i] = 0.0
        if not math.isfinite(e[i]) or sample.weight[i] <= 0:
            continue
        if sample.weight[i] == BY_HAND:
            used[i] = 1.0
            gate.in_patch[i] = gate.rejected[i] = gate.inside[i] = 0.0
            continue
        u = abs(e[i]) / sigma[i]
        step = e[i] - gate.residual[i]
        if i == 1:
            step = wrap_angle(step)
        jumped = not step * step <= 2 * JUMP * JUMP * f.noise[i]  # no residual yet (NaN) counts as a jump
        if gate.in_patch[i] == 0:
            # A smooth departure within the outer gate is a manoeuvre; beyond it no tuned filter is left behind.
            used[i] = igg3(u, gate.full, gate.zero) if jumped or u >= gate.zero else 1.0
            if used[i] < FLOOR:
                used[i] = 0.0
                gate.in_patch[i], gate.rejected[i], gate.inside[i] = 1.0, 1.0, 0.0
                gate.onset_s[i] = sample.time_s
        else:
            gate.rejected[i] += 1
            if u < gate.zero and (jumped != (gate.inside[i] > 0)):
                gate.inside[i] += 1
            else:
                gate.inside[i] = 0
            if gate.inside[i] >= SETTLE or (gate.inside[i] >= 1 and u <= gate.full and gate.rejected[i] <= 3):
                gate.in_patch[i] = gate.rejected[i] = gate.inside[i] = 0.0
                used[i] = max(igg3(u, gate.full, gate.zero), 0.1)
        all_inside = all_inside and gate.in_patch[i] == 0
    return all_inside


@part
def _update_by_gain(f: Filter) -> tuple[float, float]:
    """The paper's letter, K <- K m, with the covariance that any gain has: P - K Pxz' - Pxz K' + K S K'."""
    x, p, e, used, s, pxz, gain = f.x, f.p, f.e, f.used, f.s, f.pxz, f.gain
    for i in range(3):
        for j in range(3):
            s[i, j] = f.c[i, j] + (f.noise[i] if i == j else 0.0)
    ukf.cross_covariance(f.p, f.h, f.pxz)
    nis, log_det = ukf.whiten(f)
    ukf.gain_of(f)
    for i in range(9):
        for j in range(3):
            gain[i, j] *= used[j]
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


@part
def _overdue(gate: Gate, now_s: float) -> bool:
    """Whether a component has been outside for longer than the longest patch."""
    late = False
    for i in range(3):
        late = late or (gate.in_patch[i] > 0 and now_s - gate.onset_s[i] > gate.longest_patch_s)
    return late


@part
def _diverged(f: Filter, range_m: float, longest_patch_s: float) -> bool:
    """Whether speed or acceleration are those of nothing that is where it was measured to be (range_m, or NaN)."""
    speed2 = f.x[3] * f.x[3] + f.x[4] * f.x[4] + f.x[5] * f.x[5]
    acceleration2 = f.x[6] * f.x[6] + f.x[7] * f.x[7] + f.x[8] * f.x[8]
    most = DIVERGED * abs(range_m) / longest_patch_s
    return speed2 > most * most or acceleration2 > (most / longest_patch_s) ** 2 or not math.isfinite(f.x[0])


@part
def _gated(f: Filter, sample: Sample, gates: Gates, row: Row) -> tuple[float, bool]:
    """The update of a sample through the gate; a component whose weight is zero in the log is barred, and one of
    weight BY_HAND is used."""
    gate = gates[0]
    unscented.linearise(f)
    ukf.innovate(sample, f)
    for i in range(3):
        row.innovation_sigma[i] = math.sqrt(f.c[i, i] + f.noise[i] + f.late[i] * f.late[i])
    all_inside = _decide(f, sample, gate, row.innovation_sigma)
    for i in range(3):
        row.innovation[i], row.weight[i] = f.e[i], f.used[i]
    gained = 0.0
    if f.used[0] > 0 or f.used[1] > 0 or f.used[2] > 0:
        row.nis, gained = _update_by_gain(f) if gate.gain_form > 0 else ukf.update(f)
    moved = moves(row.predicted, f.x)
    for i in range(3):
        if math.isfinite(f.e[i]) and sample.weight[i] > 0:
            gate.residual[i] = wrapped(f.e[i] + f.bend[i] - moved[i], i == 1)
    diverged = _diverged(f, sample.measurement[0], gate.longest_patch_s)
    lost = gate.wait <= 0 and (diverged or (not all_inside and _overdue(gate, sample.time_s)))
    gate.wait -= 1
    return gained, lost


run_gated = recursion(_gated, Gates)
