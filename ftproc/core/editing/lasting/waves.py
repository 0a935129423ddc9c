"""A wave: a component, or both angles, that swing to and fro, as a mount does that hunts, or that has just locked on.

A curve of many terms may be a wave, but each term costs as much as a fault. A wave of one rate has two, and may die
away. Its rate, and where it begins and ends, are sought in turn, in one sweep each, with the usual process noise.

What swings, and what else was followed, may as well be the target. As far as that shows in no other component, it
moves along, across or above the line of sight, by metres, where an instrument does by angles: as the range changes, the
readings say which of the two it is, and where they do not, it is the target unless nothing moves like that.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ftproc.core import odds
from ftproc.core.editing.lasting import scan
from ftproc.core.editing.lasting.curves import Curve, swing
from ftproc.core.editing.lasting.weighing import Scene, Weighed, as_it_is
from ftproc.core.filtering.columns import Columns, said_of
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import likelihood_of, smooth_log
from ftproc.core.identification.profile import pieces, roughness
from ftproc.core.model.frames import line_of_sight_axes, to_cartesian, unwrap
from ftproc.records import FloatArray, IntArray

MOST_CYCLES, STEP = 24.0, 0.5  # of a stretch, and from one rate that is tried to the next
ABOUT = np.linspace(-3.0, 3.0, 7)  # about the likeliest rate and decay, steps first of one radian in a stretch
NEARER, CLOSER = 3, 0.3  # times that they are sharpened, and their steps from one to the next
QUIET = 12.0  # times the usual process noise: the most with which a wave is sought
DECAYS = (0.0, 2.0, 4.0, 6.0)  # in a stretch, as powers of e
AT_FIRST = 0.4  # of the gain that a wave needs, where its ends are not sought yet
LEVELS = np.geomspace(0.1, 1e6, 15)  # times the process noise in all directions, where a target moves in one
MOST_MPS2 = 50.0  # root mean square of its acceleration: turns of 7 g to and fro
CELLS, PER_CYCLE = 48, 6.0  # of a scan of where it begins and ends, at least, and to a cycle


class Swing(NamedTuple):
    """From sample `begin` to `end` some channels swing at a rate, rad/s, and die away, 1/s. gain: of log-likelihood."""

    begin: int
    end: int
    rate_radps: float
    decay_per_s: float
    gain: float = -math.inf


class _Quiet(NamedTuple):
    """A part of a log as it would be with the usual process noise where components swing."""

    part: Scene
    components: Sequence[int]
    log: Observations
    model: Model
    starts: list[Start]


def likeliest_wave(part: Scene, curves: Sequence[Curve]) -> list[Curve] | None:
    """The likeliest wave of the components of curves, about where these begin and end; None if the part of a log is no
    likelier with it and less process noise there."""
    if part.own is None:
        return None
    quiet = _quiet(part, curves)
    begin, end = min(curve.begin for curve in curves), max(curve.end for curve in curves)
    decays = DECAYS if len(curves) > 1 else DECAYS[:1]
    own = likelihood_of(quiet.log, part.own, quiet.starts) - roughness(part.own)
    usual = likelihood_of(quiet.log, quiet.model, quiet.starts) - roughness(quiet.model)
    least = own - usual + odds.ONE_END  # of a gain
    about = max((_about(quiet, begin, end, decay) for decay in decays), key=lambda each: each.gain)
    if about.gain < AT_FIRST * least:
        return None
    best = _with_ends(quiet, about)
    return _curves(quiet, best) if best.gain > least else None


def sharper_wave(part: Scene, found: Weighed) -> list[Curve]:
    """A wave that was weighed, at the likeliest rate and decay near its own by the process noise that was found."""
    quiet = _as_weighed(part, found)
    return _curves(quiet, _sharper(quiet, _swing_of(found)))


def is_of_the_target(part: Scene, found: Weighed) -> bool:
    """Whether a wave that was weighed is one of the target, which is likelier unless the readings say else. Both angles
    that come to rest from the beginning of the log on are no target's, but those of a mount that has just locked on."""
    quiet, wave = _as_weighed(part, found), _swing_of(found)
    rate, decay = (each * float(quiet.log.time_s[wave.end - 1] - quiet.log.time_s[0]) for each in wave[2:4])
    if wave.begin == 0 and len(quiet.components) > 1 and rate > 2 * math.pi and decay > DECAYS[1]:
        return False
    return _of_the_target(quiet, wave) > _sharper(quiet, wave).gain - odds.MOTION


def moved(part: Scene, found: Weighed) -> float:
    """Log-probability of a part of a log in which the target itself moves along, across or upward where the curves that
    were found act on its range, azimuth or elevation, and else as it does with them; -inf where it would need more
    acceleration than targets have."""
    own, best = part.own, -math.inf
    if own is None or own.motion.acts:
        return best
    raised, time_s = sorted({curve.component for curve in found.curves}), part.log.time_s
    rows = slice(min(curve.begin for curve in found.curves), max(curve.end for curve in found.curves))
    towards = float(np.nanmedian(unwrap(part.log.measurement[rows, 1])))
    turned = part._replace(log=part.log._replace(measurement=part.log.measurement - [0.0, towards, 0.0]))
    knots_s = time_s[0] + own.knot_s * np.arange(len(own.jerk)) if len(own.jerk) > 1 else time_s[:1]
    quiet = found.model.jerk[pieces(np.append(time_s[0], knots_s), found.model)[1:]]
    inside = np.ix_(np.unique(pieces(time_s, own)[rows]), np.array(raised))
    for level in LEVELS:
        jerk = quiet.copy()
        jerk[inside] = level * own.jerk[inside]
        model = own._replace(jerk=jerk)
        rough = roughness(model._replace(jerk=jerk[:, raised])) - roughness(model)
        likely = as_it_is(turned, found.weight, model).log_probability - rough
        if likely > best and _swung_mps2(turned, found.weight, model, rows, raised) < MOST_MPS2:
            best = likely
    return best


def _swung_mps2(part: Scene, weight: FloatArray, model: Model, rows: slice, axes: list[int]) -> float:
    """Root mean square of the acceleration along axes."""
    log = part.log._replace(weight=weight)
    acceleration_mps2 = smooth_log(log, model, part.starts(log, model)).state[rows, 6:9][:, axes]
    return math.sqrt(float((acceleration_mps2**2).sum(1).mean()))


def _quiet(part: Scene, curves: Sequence[Curve]) -> _Quiet:
    assert part.own is not None
    knot, jerk = pieces(part.log.time_s, part.own), part.own.jerk.copy()
    inside = np.unique(np.concatenate([knot[curve.rows] for curve in curves]))
    jerk[inside] = np.minimum(jerk[inside], QUIET * part.at_median.jerk)
    return _Quiet(part, [c.component for c in curves], part.log, part.own._replace(jerk=jerk), part.starts(part.log))


def _as_weighed(part: Scene, found: Weighed) -> _Quiet:
    log = part.log._replace(weight=found.weight)
    return _Quiet(part, [curve.component for curve in found.curves], log, found.model, part.starts(log, found.model))


def _curves(quiet: _Quiet, wave: Swing) -> list[Curve]:
    return [Curve(c, wave.begin, wave.end, (0.0, 0.0), wave=wave[2:4]) for c in quiet.components]


def _swing_of(found: Weighed) -> Swing:
    (begin, end), wave = found.curves[0][1:3], found.curves[0].wave
    assert wave is not None
    return Swing(begin, end, *wave)


def _about(quiet: _Quiet, begin: int, end: int, decay: float) -> Swing:
    """The likeliest wave from there to there, of a decay as powers of e."""
    lasts_s = float(quiet.log.time_s[end - 1] - quiet.log.time_s[begin])
    rates = 2 * math.pi / lasts_s * np.arange(STEP, _cycles(begin, end) + STEP, STEP)
    return _best_of(quiet, Swing(begin, end, 0.0, 0.0), rates, np.full(len(rates), decay / lasts_s))


def _cycles(begin: int, end: int) -> float:
    return min(MOST_CYCLES, (end - begin) / PER_CYCLE)


def _with_ends(quiet: _Quiet, about: Swing) -> Swing:
    """The likeliest wave about there."""
    found, (begin, end), n = _sharper(quiet, about), about[:2], len(quiet.log.time_s)
    reach, cycles = (end - begin) // 2, _cycles(begin, end)
    low, high = max(begin - reach, min(begin, 1)), min(end + reach, max(end, n - 1))
    width = max(min((high - low) // CELLS, int((end - begin) / PER_CYCLE / cycles)), 1)
    found = _sharper(quiet, _between(quiet, found, np.arange(low, high, width)))
    ends = [np.arange(edge - width, edge + width + 1) for edge in (found.begin, found.end)]
    return _sharper(quiet, _between(quiet, found, np.clip(np.concatenate(ends), low, high)))


def _sharper(quiet: _Quiet, found: Swing) -> Swing:
    """A wave at the likeliest rate near its own, and with the likeliest decay if it dies away."""
    time_s = quiet.log.time_s
    step = 1 / float(time_s[found.end - 1] - time_s[found.begin])
    for _ in range(NEARER):
        decays = found.decay_per_s + step * ABOUT if found.decay_per_s > 0 else np.zeros(1)
        rates, decays = np.meshgrid(found.rate_radps + step * ABOUT, decays)
        found = _best_of(quiet, found, np.maximum(rates.ravel(), 0.1 * step), np.maximum(decays.ravel(), 0.0))
        step *= CLOSER
    return found


def _best_of(quiet: _Quiet, found: Swing, rates: FloatArray, decays: FloatArray) -> Swing:
    """A wave at the likeliest of these rates and decays (m,)."""
    gain = np.sum([_gains_at(quiet, found, rates, decays, c) for c in quiet.components], 0)
    k = int(gain.argmax())
    return found._replace(rate_radps=float(rates[k]), decay_per_s=float(decays[k]), gain=float(gain[k]))


def _gains_at(quiet: _Quiet, found: Swing, rates: FloatArray, decays: FloatArray, component: int) -> FloatArray:
    """(m,) gains by a wave of a component at each of the rates and decays (m,)."""
    rows, time_s = slice(found.begin, found.end), quiet.log.time_s
    since_s, pairs = time_s[rows] - time_s[found.begin], zip(rates, decays, strict=True)
    design = np.zeros((len(time_s), 3, 2 * len(rates)))
    design[rows, component] = np.concatenate([swing(rate, decay, since_s) for rate, decay in pairs], 1)
    return _gains(quiet, found, design)


def _gains(quiet: _Quiet, found: Swing, design: FloatArray) -> FloatArray:
    """(m,) gains by each two of the columns (n, 3, 2 m)."""
    m = design.shape[2]
    columns = Columns(design, np.full(m, found.begin), np.full(m, found.end), np.full(m, -1))
    said = said_of(quiet.log, quiet.model, quiet.starts, columns)
    return np.array([_gain(said.score[k : k + 2], said.information[k : k + 2, k : k + 2]) for k in range(0, m, 2)])


def _gain(score: FloatArray, information: FloatArray) -> float:
    """By the likeliest sizes."""
    return 0.5 * float(score @ _sizes(score, information))


def _sizes(score: FloatArray, information: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.lstsq(information, score, rcond=None)[0], float)


def _between(quiet: _Quiet, found: Swing, edges: IntArray) -> Swing:
    """A wave between the likeliest two of these edges."""
    edges, since_s = np.unique([*edges, found.begin, found.end]), quiet.log.time_s - quiet.log.time_s[found.begin]
    terms = swing(found.rate_radps, found.decay_per_s, since_s)
    where = quiet.log, quiet.model, quiet.starts, quiet.part.setting
    gain = np.sum([scan.gains_by(*where, (c, 0), edges, terms)[1] for c in quiet.components], 0)
    i, j = (int(k) for k in np.unravel_index(int(gain.argmax()), gain.shape))
    if edges[j] - edges[i] < PER_CYCLE:
        return found
    return found._replace(begin=int(edges[i]), end=int(edges[j]), gain=float(gain[i, j]))


def _of_the_target(quiet: _Quiet, found: Swing) -> float:
    """The gain if the target swings about so, in any direction, by as many metres as it did at first or by fewer, and
    as far as targets can."""
    rows, time_s = slice(found.begin, found.end), quiet.log.time_s
    along, since_s = _by_metres(quiet.log.measurement[rows]), time_s[rows] - time_s[found.begin]
    best = 0.0
    for rate, decay in itertools.product(np.maximum(found.rate_radps + ABOUT / since_s[-1], 0.0), DECAYS):
        terms = swing(rate, decay / since_s[-1], since_s)
        design = np.zeros((len(time_s), 3, 6))
        design[rows] = (along[:, :, :, None] * terms[:, None, None, :]).reshape(-1, 3, 6)
        columns = Columns(design, np.full(6, found.begin), np.full(6, found.end), np.full(6, -1))
        said = said_of(quiet.log, quiet.model, quiet.starts, columns)
        if rate**2 * np.linalg.norm(_sizes(said.score, said.information)) < math.sqrt(2) * MOST_MPS2:
            best = max(best, _gain(said.score, said.information))
    return best


def _by_metres(measurement: FloatArray) -> FloatArray:
    """(m, 3, 3) by how much readings (m, 3) of range, azimuth and elevation grow with each metre of the target along,
    across and up from the line of sight halfway."""
    axes, scale = _by_a_metre(measurement)
    found: FloatArray = scale[:, :, None] * (axes @ axes[len(axes) // 2].T)
    return found


def _by_a_metre(measurement: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The axes (m, 3, 3) along, across and up from the lines of sight of readings (m, 3), and by how much these grow
    with each metre along its own (m, 3)."""
    at = np.arange(len(measurement))
    whole = np.column_stack([measurement[:, 0], unwrap(measurement[:, 1]), measurement[:, 2]])
    for c in range(3):
        seen = np.isfinite(whole[:, c])
        whole[:, c] = np.interp(at, at[seen], whole[seen, c])
    slant = np.maximum(np.abs(whole[:, 0]), 1e-9)
    scale = np.stack([np.ones(len(at)), 1 / (slant * np.maximum(np.cos(whole[:, 2]), 1e-3)), 1 / slant], 1)
    return line_of_sight_axes(to_cartesian(whole)), scale
