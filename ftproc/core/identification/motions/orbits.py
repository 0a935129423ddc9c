"""Orbits: the motion of what nothing but gravity moves far above the air, as it is seen from the turning earth.

Of such a track white jerk takes what gravity does between two readings for noise: a satellite whose ranges are read
every few minutes to 4 m shows 1,400 m. With gravity the noise is fitted again, beside a single level of the jerk. How
the earth turns below the station is known by its site, or else by the latitude, and the north, with which the log is
likeliest; these also tell where the earth's centre is, up to 21 km from below the station.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core import odds
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import likelihood_of, score_log, smooth_log
from ftproc.core.identification import optimizer
from ftproc.core.identification.likelihood import RATIO_BOUND, of_level, shaped
from ftproc.core.identification.profile import median_level
from ftproc.core.model.earth import Geodetic, earth_centred, verticals
from ftproc.core.model.motion import EARTH_M, Motion
from ftproc.records import FloatArray

ABOVE_M = 100e3  # where the air ends
FARTHEST_TURN = 0.005  # rad, over which the motion goes on in one step
EARTH_RADPS = 7.292115e-5  # its rotation
AXIS_RADPS = np.array([0.0, 0.0, EARTH_RADPS])
LATITUDES, NORTHS = np.radians([-60, -30, 0, 30, 60]), np.radians(np.arange(0, 360, 45))
LESS_JERK = (1.0, 1e-2, 1e-4)  # times the jerk that stands in for the earth's rotation while it is not known
NEAR = 1e-4  # of the range: from a course farther away gravity is not followed (the first course of a satellite whose
# ranges are read in a later half of its pass is 5 to 20 % off)
STEPS, ROUNDS, TURNS = 12, 20, 16  # of the search for noise and jerk; of both searches; of that for the rotation
SETTLED = 0.1  # in log-likelihood, that both searches gain
NARROWER = 0.5  # times the angle of a turn, after one that leads nowhere
FARTHEST = 12.0, 25.0  # ln of times: less noise variance, and less jerk, than white jerk leaves


class Track(NamedTuple):
    """A log with its starts, (3,) which noise the user has specified, and (2, 3) the earth, None if it is unknown."""

    log: Observations
    starts: list[Start]
    known: NDArray[np.bool_]
    earth: FloatArray | None

    def likelihood(self, model: Model) -> float:
        """The log-likelihood; a model with which the filter diverges is impossible."""
        found = likelihood_of(self.log, model, self.starts)
        return found if math.isfinite(found) else -math.inf

    def about_its_own(self, model: Model) -> Model:
        """The model linearised about the track that it leads to."""
        return model._replace(motion=model.motion.about(smooth_log(self.log, model, self.starts).state))


def may_be(course: FloatArray) -> bool:
    """Whether most of a course (n, 9) is above the air."""
    height = np.sqrt((course[:, :2] ** 2).sum(1) + (course[:, 2] + EARTH_M) ** 2) - EARTH_M
    return bool(np.median(height) > ABOVE_M)


def fit(track: Track, model: Model, rival: float = -math.inf) -> tuple[Model, float]:
    """The likeliest noise, jerk and rotation of the earth, from the noise and the jerk of a model and the course about
    which it is linearised on, and the log-likelihood. rival: that of another motion; far from it no more is tried."""
    still = _settled(track, median_level(model)._replace(motion=Motion(acts=True).about(model.motion.course)))
    if (likelihood := track.likelihood(still)) < rival - odds.HOPELESS:
        return still, likelihood

    def turning(earth: FloatArray, times: float) -> Model:
        return still._replace(jerk=times * still.jerk, motion=still.motion._replace(earth=earth))

    if track.earth is not None:
        tried = [turning(track.earth, times) for times in LESS_JERK]
        best = max((_settled(track, _settled(track, each)) for each in tried), key=track.likelihood)
        return best, track.likelihood(best)
    earths = [earth_below(*each) for each in itertools.product(LATITUDES, NORTHS)]
    first = [max((turning(earth, times) for earth in earths), key=track.likelihood) for times in LESS_JERK]
    found = [still, *(_until_settled(track, each) for each in first)]
    best = max(found, key=track.likelihood)
    return best, track.likelihood(best)


def _until_settled(track: Track, model: Model) -> Model:
    """The likeliest noise, jerk and rotation: of each in turn, while the log becomes likelier."""
    likelihood = -math.inf
    for _ in range(ROUNDS):
        model = _settled(track, _turned(track, model))
        likelihood, before = track.likelihood(model), likelihood
        if likelihood < before + SETTLED:
            break
    return model


def earth_below(latitude: float, north: float, height_m: float = 0.0) -> FloatArray:
    """(2, 3) the earth of a `Motion` below a station at a latitude (rad), with north at an angle from x (rad)."""
    site = math.degrees(latitude), 0.0, height_m
    sine, cosine = math.sin(north), math.cos(north)
    axes = np.array([[sine, -cosine, 0.0], [cosine, sine, 0.0], [0.0, 0.0, 1.0]])  # east, north and up
    found: FloatArray = np.array([AXIS_RADPS, -earth_centred(site)]) @ verticals(site).T @ axes
    return found


def earth_from(site: Geodetic, north: int) -> FloatArray:
    """(2, 3) the same below a site of which the axis `north` (0: x, 1: y) points there and the other one to the east.
    Of axes in the order of a left hand the rotation, an axial vector, is reversed."""
    found = earth_below(math.radians(site[0]), math.pi / 2 * north, site[2])
    found[0] *= 2 * north - 1
    return found


def _direction(earth: FloatArray) -> FloatArray:
    """The latitude and the north of `earth_below`, (2,)."""
    x, y, z = earth[0].tolist()
    return np.array([math.atan2(z, math.hypot(x, y)), math.atan2(y, x)])


def _settled(track: Track, model: Model) -> Model:
    """The likeliest noise and level of the jerk, linearised about its own track."""
    first = model.noise_variance[0] if model.noise_variance.ndim > 1 else model.noise_variance
    of_stations, log_noise, level = model.noise_variance / first, np.log(first), math.log(model.jerk[0, 0])
    less, lower_jerk = FARTHEST
    lower = np.r_[np.where(track.known, log_noise, log_noise - less), level - lower_jerk, -RATIO_BOUND]
    upper = np.r_[np.where(track.known, log_noise, log_noise + less), level + lower_jerk, RATIO_BOUND]

    def of(theta: FloatArray) -> Model:
        noise = np.exp(theta[:3]) * of_stations
        return model._replace(noise_variance=noise, jerk=shaped(theta[3:4], theta[4]))

    def cost(theta: FloatArray) -> optimizer.Point:
        found = score_log(track.log, of(theta), track.starts)
        jerk = of_level(found, theta[4])
        slope = np.r_[-found.noise.score, jerk.gradient]
        return optimizer.Point(jerk.value, slope, np.r_[found.noise.curvature, jerk.curvature])

    theta = np.r_[log_noise, level, math.log(model.jerk[0, 2] / model.jerk[0, 0])]
    return track.about_its_own(of(optimizer.minimise(cost, theta, lower, upper, STEPS, tolerance=0.05)))


def _turned(track: Track, model: Model) -> Model:
    """The model with a likelier rotation of the earth: turned by ever smaller angles, along each of the two."""
    best, likelihood = model, track.likelihood(model)
    angles = np.diff(LATITUDES)[0] * np.eye(2) / 2
    for _ in range(TURNS):
        here = _direction(best.motion.earth)
        tried = [
            best._replace(motion=best.motion._replace(earth=earth_below(*(here + side * angle))))
            for angle in angles
            for side in (1, -1)
        ]
        found = [track.likelihood(each) for each in tried]
        if max(found) > likelihood:
            likelihood = max(found)
            best = tried[found.index(likelihood)]
        else:
            angles = NARROWER * angles
    return track.about_its_own(best)
