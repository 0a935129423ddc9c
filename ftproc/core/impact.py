"""Where a body that falls comes down after the last reading, or how high it gets.

The last state moves on as the filter's would, without readings: by gravity and by drag that grows with the pressure of
the air, with the process noise of the flight's last seconds. At the time t at which g(state) = 0 (the height over the
ground, or at the apogee the climb rate), an error e of the state there moves that time and the place by

    dt = -grad g . e / g'        dp = e_p + v dt

so that the covariance of the place has no part along the vertical at an impact. What the drag coefficient does with the
Mach number no log tells beforehand: the prediction is made again with more drag, and allows for what that moves.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.forward import Span, filter_log, run_weighted
from ftproc.core.filtering.records import Model, Observations, Start, empty_rows
from ftproc.core.identification.motions.falling import falls
from ftproc.core.model.forces import GRAVITY
from ftproc.core.model.motion import EARTH_M

FloatArray = NDArray[np.float64]

# 1-sigma of the drag, as a share of it: a projectile's doubles from Mach 0.8 to 1 (G1: 0.21 to 0.48). Of own bombs and
# shells the share that explains the time of impact is 0.42 (root mean square) near the speed of sound, else 0.09.
DRAG, NEAR_SOUND, SOUND_MPS, TRIED = 0.1, 0.4, (290.0, 410.0), 0.02
DRIFT = 0.05  # of the drag, over a log, that the law of drag does not foresee: 0.03 to 0.1 in own flights in wind
LONGEST_S, STEP_S = 60.0, 0.05  # after the last reading
SURE = 3.0  # sigmas by which the target is above the ground
STATION, LOWEST = "the height of the station", "the lowest height of the flight"
IMPACT, APOGEE = "impact", "apogee"


def heights(position: FloatArray) -> FloatArray:
    """(n,) m over the height of the origin of positions (n, 3); the earth is round."""
    found: FloatArray = np.sqrt((position[:, :2] ** 2).sum(1) + (position[:, 2] + EARTH_M) ** 2) - EARTH_M
    return found


def last_state(log: Observations, model: Model, starts: list[Start]) -> Start:
    """State and covariance that the filter has after the last sample of a log; correlated noise counts as white."""
    model = model._replace(noise_variance=model.reading_variance, markov_variance=np.zeros(3)).causal
    start, filters, n = starts[-1], model.filter(starts[-1]), len(log.time_s)
    samples, profile = log.samples(model.noise_variance), model.profile_of(log)
    run_weighted(Span(start.sample, n, start.sample), samples, profile, filters, False, empty_rows(n))
    return Start(n - 1, filters["x"][0, :9].copy(), filters["p"][0, :9, :9].copy())


def end_of(log: Observations, model: Model, starts: list[Start], state: FloatArray, sigma: FloatArray) -> Start:
    """The same of a ballistic motion whose last state and sigmas (9,) are published: with so much jerk at least that
    the drag may change by DRAG of it over the log, and with no sigma smaller than the published one."""
    force, span_s = state[6:] + GRAVITY * vertical(state), float(log.time_s[-1] - log.time_s[starts[-1].sample])
    least = DRIFT**2 * float(force @ force) / max(span_s, STEP_S)
    found = last_state(log, model._replace(jerk=np.maximum(model.jerk, least)), starts)
    times = np.maximum(1.0, sigma / np.sqrt(np.diag(found.covariance)))
    return found._replace(covariance=times[:, None] * found.covariance * times)


class Ground(NamedTuple):
    """height_m: over the station's, along the vertical of each place of a round earth. what: STATION or LOWEST."""

    height_m: float
    what: str

    @classmethod
    def below(cls, lowest_m: float) -> Ground:
        """That of a flight which was never lower than this: the station's height, if the flight was not below it."""
        return cls(lowest_m, LOWEST) if lowest_m < 0 else cls(0.0, STATION)


class Predicted(NamedTuple):
    """kind: IMPACT or APOGEE. after_s: the last reading; time_sigma_s: 1-sigma. state: (9,) there. covariance: (3, 3)
    of the place, m2. ground: on which it falls. near_sound: whether its speed is near that of sound on its way."""

    kind: str
    after_s: float
    time_sigma_s: float
    state: FloatArray
    covariance: FloatArray
    ground: Ground
    near_sound: bool


def predict(last: Start, model: Model, lowest_m: float) -> Predicted | None:
    """Where the body comes down, else its apogee, of a last state and its covariance; None of a flight that does not
    end in a fall, or reaches neither within LONGEST_S. lowest_m: of the flight."""
    up = vertical(last.state)
    sigma = math.sqrt(max(float(up @ last.covariance[:3, :3] @ up), 0.0))
    ground = Ground.below(lowest_m)
    above_m = float(heights(last.state[None, :3])[0]) - ground.height_m
    if not falls(last.state[None]) or not above_m > SURE * sigma:
        return None
    start, noise = last._replace(sample=0), np.ones(3)  # of readings, of which there are none
    model = Model(noise, model.jerk[-1:], motion=model.motion.causal)
    found = _reached(start, model, ground)
    return None if found is None else _with_doubtful_drag(found, start, model)


def _reached(start: Start, model: Model, ground: Ground) -> Predicted | None:
    time_s = np.linspace(0.0, LONGEST_S, round(LONGEST_S / STEP_S) + 1)
    state = filter_log(_unread(time_s), model, [start]).state
    radial = state[:, :3] + np.array([0.0, 0.0, EARTH_M])
    ends = {IMPACT: heights(state[:, :3]) - ground.height_m, APOGEE: (radial * state[:, 3:6]).sum(1)}
    for kind, value in ends.items():
        if (after_s := falls_to_zero(time_s, value)) is not None:
            speed = np.sqrt((state[time_s <= after_s, 3:6] ** 2).sum(1))
            near_sound = bool(((speed > SOUND_MPS[0]) & (speed < SOUND_MPS[1])).any())
            return _there(start, model, after_s, Predicted(kind, 0.0, 0.0, state[0], state[:3, :3], ground, near_sound))
    return None


def _with_doubtful_drag(found: Predicted, start: Start, model: Model) -> Predicted:
    """A prediction that allows for drag which changes on the way."""
    state = start.state.copy()
    state[6:] += TRIED * (state[6:] + GRAVITY * vertical(state))
    other = _reached(start._replace(state=state), model, found.ground)
    if other is None or other.kind != found.kind:
        return found
    times = (NEAR_SOUND if found.near_sound else DRAG) / TRIED
    shift, late = times * (other.state[:3] - found.state[:3]), times * (other.after_s - found.after_s)
    covariance = found.covariance + np.outer(shift, shift)
    return found._replace(time_sigma_s=math.hypot(found.time_sigma_s, late), covariance=covariance)


def _unread(time_s: FloatArray) -> Observations:
    """Samples without readings."""
    n = len(time_s)
    return Observations(time_s, np.full((n, 3), np.nan), np.zeros((n, 3)))


def falls_to_zero(time_s: FloatArray, value: FloatArray) -> float | None:
    """The time at which a value (n,) that is positive at first becomes zero."""
    below = np.flatnonzero(~(value > 0))
    if not below.size or below[0] == 0 or not np.isfinite(value[: below[0] + 1]).all():
        return None
    k = int(below[0])
    return float(time_s[k - 1] + (time_s[k] - time_s[k - 1]) * value[k - 1] / (value[k - 1] - value[k]))


def _there(start: Start, model: Model, after_s: float, ends: Predicted) -> Predicted:
    """The end that is reached after so many seconds."""
    time_s = np.append(np.arange(0.0, after_s, STEP_S), after_s)
    _, state, covariance = last_state(_unread(time_s), model, [start])
    up, at = vertical(state), slice(0, 3) if ends.kind == IMPACT else slice(3, 6)
    rate = float(up @ state[at.start + 3 : at.stop + 3])
    moved = np.zeros((4, 9))  # of the place and of the time, by the state there
    moved[:3, :3] = np.eye(3)
    moved[3, at] = -up / rate
    moved[:3] += np.outer(state[3:6], moved[3])
    found = moved @ covariance @ moved.T
    time_sigma_s = math.sqrt(max(float(found[3, 3]), 0.0))
    return ends._replace(after_s=after_s, time_sigma_s=time_sigma_s, state=state, covariance=found[:3, :3])


def vertical(state: FloatArray) -> FloatArray:
    """(3,) upward at a state (9,)."""
    radial = state[:3] + np.array([0.0, 0.0, EARTH_M])
    found: FloatArray = radial / np.sqrt(radial @ radial)
    return found
