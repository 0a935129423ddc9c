"""The process noise of a fused flight: one level of the jerk at first, then a profile."""

from __future__ import annotations

import math

import numpy as np

from ftproc.core.filtering.records import Model, Observations
from ftproc.core.identification.profile import knot_length
from ftproc.core.identification.scales import scales_of

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
