"""Adaptive Kalman filter and wavelet denoising, channel by channel (after Wu and Ran 2021, with whom Zuo et al. 2021
compare; reconstructed, for the paper's own formulas are not published in the comparison).

The filter yields to outliers and learns its noise; VisuShrink (Donoho and Johnstone 1994) then denoises its output,
sample by sample as if they were even, with a threshold for each level because that output's noise is coloured. The
wavelets see the whole record, so this is no causal method.
"""

from __future__ import annotations

import itertools

import numpy as np

from ftproc.core.comparators.adaptive import Channel, adaptive_kalman
from ftproc.core.model.frames import unwrap
from ftproc.methods import channels
from ftproc.methods.channels import AZIMUTH, Cleaned
from ftproc.methods.estimate import Estimate, Readings
from ftproc.records import FloatArray
from ftproc.settings import FilterSettings

WAVELET, LEVELS = "db4", 4
EDGES = "antireflect"  # a mirror without the kink that a slope would get, which would pass for detail
GAP_INTERVALS = 5.0  # a longer pause ends the stretch that is denoised as one
FIRST = 10  # readings that the first state comes from
UNKNOWN = 1e3  # times the noise, per second: 1-sigma of rates about which nothing is known
GAUSSIAN = 0.6745  # median of |x| of a normal distribution
DECADES = np.arange(-6.0, 8.1, 0.5)  # of jerk density over noise variance, s^-5: among which the likeliest is sought


def estimate(readings: Readings, settings: FilterSettings) -> Estimate:
    """Filter, then denoise. The rates are the filter's."""
    log = channels.prepare(readings, settings, blindly=True)
    parts = [_component(readings, log, c) for c in range(3)]
    value, rate, innovation, sigma, weight = (np.stack(part, 1) for part in zip(*parts, strict=True))
    return channels.estimate(readings, log, Cleaned(value, weight, innovation, sigma, rate=rate))


def _component(readings: Readings, log: channels.Log, c: int) -> tuple[FloatArray, ...]:
    """Values, rates, innovations, their sigmas and weights (n,) of one component."""
    time_s, z = readings.time_s, np.ascontiguousarray(readings.measurement[:, c])
    trusted = np.ascontiguousarray(log.trusted[:, c])
    noise, angular = float(log.sigma[c]) ** 2, c == AZIMUTH
    begin, x0, p0 = _start(time_s, trusted if np.isfinite(trusted).any() else z, float(log.sigma[c]), angular)
    levels = noise * 10.0**DECADES
    models = [Channel(begin, x0, p0, noise, float(q), angular) for q in levels]
    likelihood = [adaptive_kalman(time_s, trusted, model, False)[-1] for model in models]
    state, _, innovation, sigma, weight, _ = adaptive_kalman(time_s, z, models[np.argmax(likelihood)], True)
    weight[:begin] = 1.0
    value = state[:, 0].copy()
    for low, high in _stretches(time_s, begin, log.interval_s):
        value[low:high] = denoise(value[low:high])
    weight = np.where(np.isfinite(z), weight, 0.0)
    return value, state[:, 1], innovation, sigma, weight


def _start(time_s: FloatArray, z: FloatArray, sigma: float, angular: bool) -> tuple[int, FloatArray, FloatArray]:
    """Sample, state and covariance at the first of the readings (n,) that are there, from a parabola through FIRST."""
    rows = np.flatnonzero(np.isfinite(z))[:FIRST]
    t, v = time_s[rows] - time_s[rows[0]], unwrap(z[rows]) if angular else z[rows]
    span = float(t[-1])
    if span <= 0:
        return int(rows[0]), np.array([v[0], 0.0, 0.0]), np.diag([sigma, UNKNOWN * sigma, UNKNOWN * sigma]) ** 2
    fitted = np.polynomial.Polynomial.fit(t, v, min(2, len(np.unique(t)) - 1)).convert().coef
    value, rate, half = np.r_[fitted, 0.0, 0.0][:3]
    return int(rows[0]), np.array([value, rate, 2 * half]), np.diag([2, 15 / span, 60 / span**2]) ** 2 * sigma**2


def _stretches(time_s: FloatArray, begin: int, interval_s: float) -> list[tuple[int, int]]:
    """First and one past the last sample between gaps."""
    after = np.flatnonzero(np.diff(time_s[begin:]) > GAP_INTERVALS * interval_s) + begin + 1
    return list(itertools.pairwise([begin, *(int(k) for k in after), len(time_s)]))


def denoise(values: FloatArray) -> FloatArray:
    """(n,) values with soft thresholds s_j sqrt(2 ln n) on the details of each level j, s_j from their median."""
    import pywt  # an extra: the registry has seen that it is there

    n = len(values)
    level = min(LEVELS, pywt.dwt_max_level(n, pywt.Wavelet(WAVELET).dec_len))
    if level < 1:
        return values
    coarse, *details = pywt.wavedec(values, WAVELET, mode=EDGES, level=level)
    bound = np.sqrt(2 * np.log(n)) / GAUSSIAN
    shrunk = [np.sign(d) * np.maximum(np.abs(d) - bound * np.median(np.abs(d)), 0.0) for d in details]
    restored: FloatArray = np.asarray(pywt.waverec([coarse, *shrunk], WAVELET, mode=EDGES))[:n]
    return restored
