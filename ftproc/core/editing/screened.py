"""A log screened component by component, by windows of two lengths: what can be trusted before anything is known of the
motion, and the noise."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing import jump_patches, screening
from ftproc.core.editing.copies import rounding_step
from ftproc.core.filtering.records import Observations
from ftproc.core.identification.likelihood import without_noise
from ftproc.core.model.frames import unwrap
from ftproc.order_statistics import median
from ftproc.records import FloatArray

SHORT_WINDOW = 11  # samples: sees jumps, and little else
WINDOWS = (31, 75)  # samples: the short one follows manoeuvres, the long one sees through patches
OUTVOTED = 0.5  # share of a window's parabolas that a reading is off
FEWEST_TRUSTED = 0.65  # share of a component that screening must leave, to be accepted


class Screened(NamedTuple):
    """What screening each component alone finds: weights (n, 3), those of the short window alone, which sees jumps but
    through which turns pass (n, 3), the noise 1-sigma (3,), and which components show none (3,)."""

    weight: FloatArray
    jumps_only: FloatArray
    sigma: FloatArray
    exact: NDArray[np.bool_]


def screen(time_s: FloatArray, measurement: FloatArray, least: FloatArray) -> Screened:
    """Screen each component alone. least: (3,) 1-sigma that each has at least, by its rounding."""
    weight, sigma = np.isfinite(measurement).astype(float), np.zeros(3)
    jumps_only = weight.copy()
    for c in range(3):
        channel, floor = np.ascontiguousarray(measurement[:, c]), math.sqrt(2) * float(least[c])
        weight[:, c], jumps_only[:, c], sigma[c] = screen_channel(time_s, channel, c == 1, floor)
    exact, sigma = without_noise(Observations(time_s, measurement, weight), sigma)
    return Screened(weight, jumps_only, sigma, exact)


def rounding_sigma(measurement: FloatArray) -> FloatArray:
    """(3,) 1-sigma m, rad, rad that the rounding of the readings (n, 3) makes: step / sqrt(12)."""
    steps = [rounding_step(measurement[:, c]) for c in range(3)]
    return np.array(steps) / math.sqrt(12)


def screen_channel(
    time_s: FloatArray, channel: FloatArray, angular: bool, least_sigma: float
) -> tuple[FloatArray, FloatArray, float]:
    """(n,) weights, (n,) those of the short window, and the noise 1-sigma of one component."""
    seen = np.isfinite(channel).astype(float)
    near, scales = screening.screen_component(time_s, channel, SHORT_WINDOW, angular, least_sigma)
    jumps_only = np.where(near > OUTVOTED, 0.0, seen)
    weight, sigma = seen.copy(), least_sigma
    for window in WINDOWS:
        votes, scales = screening.screen_component(time_s, channel, window, angular, least_sigma)
        screening.bar_runs(channel, votes, near, weight)
        if window == WINDOWS[0] and len(scales):
            sigma = max(median(scales), least_sigma)
    weight[jump_patches.find(time_s, unwrap(channel) if angular else channel, weight, sigma) > 0] = 0.0
    # A component that swings too fast for parabolas loses half of itself: then only the short window is accepted.
    for alternative in (jumps_only, seen):
        if weight.sum() < FEWEST_TRUSTED * seen.sum():
            weight = alternative
    return weight, jumps_only, sigma


def stuck_readings(measurement: FloatArray, sigma: FloatArray) -> NDArray[np.bool_]:
    """(n, 3) readings that merely repeat the one before; see `screening.stuck`."""
    return np.stack([screening.stuck(measurement[:, c], float(sigma[c])) for c in range(3)], 1)
