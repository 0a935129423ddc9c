"""The process noise of a fused flight: one level of the jerk at first, then a profile."""

from __future__ import annotations

import math

import numpy as np

from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import score_log
from ftproc.core.identification import optimizer
from ftproc.core.identification.likelihood import jerk_bounds, of_level, shaped
from ftproc.core.identification.profile import knot_length
from ftproc.core.identification.scales import scales_of
from ftproc.records import FloatArray

OTHER_KNOTS = 1.5  # times the distance of the knots of the jerk profile, before they are laid out again
LEVEL_STEPS = 4


def on_knots(log: Observations, model: Model) -> Model:
    """The model with as many knots as its profile needs over the events, whose span the clocks move; farther apart or
    closer together where the jerk has become another than the one that they were laid out for."""
    if not math.isfinite(model.knot_s):
        return model
    scales = scales_of(log, model.noise_variance)
    knot_s = knot_length(scales, float(np.median(model.jerk[:, 0])))
    if model.knot_s / OTHER_KNOTS < knot_s < model.knot_s * OTHER_KNOTS:
        knot_s = model.knot_s
    middle_s = (np.arange(max(math.ceil(scales.span_s / knot_s), 1)) + 0.5) * knot_s
    before = np.minimum((middle_s / model.knot_s).astype(int), len(model.jerk) - 1)
    return model._replace(jerk=model.jerk[before], knot_s=knot_s)


def level(log: Observations, starts: list[Start], model: Model) -> Model:
    """The likeliest single jerk level, from the model's."""
    scales = scales_of(log, model.noise_variance)
    lower, upper = jerk_bounds(scales)

    def cost(theta: FloatArray) -> optimizer.Point:
        return of_level(score_log(log, model._replace(jerk=shaped(theta[:1], theta[1])), starts), theta[1])

    jerk = np.median(model.jerk, 0)
    theta = np.clip(np.array([math.log(jerk[0]), math.log(jerk[2] / jerk[0])]), lower, upper)
    theta = optimizer.minimise(cost, theta, lower, upper, LEVEL_STEPS, tolerance=0.1)
    return model._replace(jerk=shaped(theta[:1], theta[1]), knot_s=math.inf)
