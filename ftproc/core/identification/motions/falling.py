"""The motion of what nobody steers: bombs, shells, rockets that have burnt out. Its jerk may be far less than the
changes of its acceleration, which gravity and drag explain. The drag depends on the wind, which the log shows.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import likelihood_of, smooth_log
from ftproc.core.identification import optimizer
from ftproc.core.identification.profile import ALLOWANCE, climbed, median_level
from ftproc.core.identification.scales import Scales
from ftproc.core.model.forces import AT_REST_MPS, GRAVITY
from ftproc.records import FloatArray

LIFT, SHARE = 0.5, 0.3  # gravities of lift, and the share of a flight with less of it, that may be ballistic
JERK_SHARES = 10.0 ** -np.arange(8)  # of the jerk of white jerk: where the search begins
STEPS = 10  # of the search for a profile, which falls by powers of ten once a motor is out
ROUNDS = 2  # of the searches for the profile and for the course about which the motion is linearised
WIND_MPS = 10.0  # 1-sigma of each component beforehand, as by day some hundred metres and more above the ground
DRIFT = 0.03  # of the force, over a log, that the law of drag and one wind do not foresee
TRIED, MOST = 0.2, 5.0  # sigmas: of a step for its derivatives, and of the strongest wind


class Logged(NamedTuple):
    """A log with its starts and its scales."""

    log: Observations
    starts: list[Start]
    scales: Scales


def falls(course: FloatArray) -> bool:
    """Whether a good part of a course (n, 9) has almost no lift: that of a bomb, or of a rocket; or an aircraft dropped
    what is followed."""
    v, force = course[:, 3:6], _force(course)
    along = (force * v).sum(1) / np.maximum((v * v).sum(1), AT_REST_MPS**2)
    lift = np.sqrt(((force - along[:, None] * v) ** 2).sum(1))
    return bool((lift < LIFT * GRAVITY).mean() > SHARE)


def _force(course: FloatArray) -> FloatArray:
    """(n, 3) m/s2, without gravity."""
    found: FloatArray = course[:, 6:] + np.array([0.0, 0.0, GRAVITY])
    return found


def fit(short: Logged, model: Model) -> tuple[Model, float]:
    """The likeliest jerk profile with its allowance, and wind, and the log-likelihood with what is known beforehand of
    both: from the likeliest of smaller profiles, and of levels, on, about the track that each leads to."""
    log, starts, scales = short
    found = list[tuple[Model, float]]()
    for shape in (model, median_level(model)):
        tried = [shape._replace(jerk=times * shape.jerk) for times in JERK_SHARES]
        likeliest = max(tried, key=lambda each: finite(likelihood_of(log, each, starts)))
        found.append(_climbed(short, likeliest, ROUNDS))
    best, likelihood = max(found, key=lambda each: finite(each[1]))
    for _ in range(ROUNDS):
        best, doubt = _blown(short, best)
        best, likelihood = _climbed(short, best, 1)
        likelihood -= doubt
    force2 = float(np.median((_force(best.motion.course) ** 2).sum(1)))
    least = max(DRIFT**2 * force2 / scales.span_s, scales.jerk_psd(scales.span_s))
    return best._replace(jerk=np.maximum(ALLOWANCE * best.jerk, least)), likelihood


def _climbed(short: Logged, model: Model, rounds: int) -> tuple[Model, float]:
    """The likeliest profile from this one on, about the track that it leads to, and the log-likelihood."""
    log, starts, scales = short
    likelihood = -math.inf
    for _ in range(rounds):
        model, likelihood = climbed(log, starts, model, STEPS, scales)
        model = model._replace(motion=model.motion.about(smooth_log(log, model, starts).state))
    return model, likelihood


def _blown(short: Logged, model: Model) -> tuple[Model, float]:
    """The model with the likeliest wind along x and y, and by how much more likely the log is with this wind than with
    any, as it is known beforehand and after (Laplace)."""
    log, starts, _ = short
    aside = TRIED * np.eye(2)

    def at(wind: FloatArray) -> Model:
        return model._replace(motion=model.motion._replace(wind=np.append(WIND_MPS * wind, 0.0)))

    def unlikely(wind: FloatArray) -> float:
        return 0.5 * float(wind @ wind) - finite(likelihood_of(log, at(wind), starts))

    def cost(wind: FloatArray) -> optimizer.Point:
        value = unlikely(wind)
        after, before = (np.array([unlikely(wind + side * each) for each in aside]) for side in (1, -1))
        if not np.isfinite([value, *after, *before]).all():
            return optimizer.Point(math.inf, np.zeros(2), np.ones(2))
        return optimizer.Point(value, (after - before) / (2 * TRIED), (after + before - 2 * value) / TRIED**2)

    most = np.full(2, MOST)
    found = optimizer.minimise(cost, model.motion.wind[:2] / WIND_MPS, -most, most, STEPS, tolerance=0.1)
    firm = np.maximum(cost(found).curvature, 1.0)
    return at(found), 0.5 * float(found @ found + np.log(firm).sum())


def finite(likelihood: float) -> float:
    """That of a model with which the filter diverges is minus infinity."""
    return likelihood if math.isfinite(likelihood) else -math.inf
