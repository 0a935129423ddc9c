"""The 15 errors of a strapdown system that is aligned while it moves, and how they grow (Shao et al. 2020 eqs 22-25).

x = attitude phi (rotation vector, rad), velocity m/s, position m, gyro bias rad/s, accelerometer bias m/s2. With C the
true attitude, V the true velocity, the computer believes exp(phi) C and V + x[3:6]; its sensors show too much by the
biases. phi may be large: nothing is linearised but what is tiny in one second (the turn of the local axes, the
biases). Left out is what is below 1e-6 m/s2: the Coriolis force of an error of the turn of the local axes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ftproc.core.comparators.ensemble import FloatArray, Sensor
from tests.acceptance.reproduce.drive import DT, EARTH_RATE, SEMI_MAJOR, G

DEGREE = np.pi / 180
DEGREE_PER_HOUR = DEGREE / 3600
INTERVAL_S = 1.0
ATTITUDE, VELOCITY, POSITION, GYRO, PUSH = (slice(3 * i, 3 * i + 3) for i in range(5))

# Table 1 of the paper, and the initial errors of its section 3.2.
GYRO_BIAS, GYRO_NOISE = 0.02 * DEGREE_PER_HOUR, 1.0 * DEGREE_PER_HOUR  # rad/s; the noise is that of one sample
PUSH_BIAS, PUSH_NOISE = 1e-4 * G, 1e-4 * G  # m/s2, likewise
GPS_POSITION_M, GPS_VELOCITY_MPS = np.array([3.0, 3.0, 8.0]), np.array([0.05, 0.05, 0.1])
FIRST_ATTITUDE = np.array([10.0, -10.0, 30.0]) * DEGREE  # pitch, roll, heading
FIRST_VELOCITY_MPS, FIRST_POSITION_M = np.full(3, 0.1), np.array([1.0, 1.0, 3.0])

FIRST_SIGMA = np.concatenate(
    [np.abs(FIRST_ATTITUDE), FIRST_VELOCITY_MPS, FIRST_POSITION_M, np.full(3, GYRO_BIAS), np.full(3, PUSH_BIAS)]
)
# Random walks of angle and velocity over one interval, from the white noise of the samples.
GROWTH_SIGMA = np.zeros(15)
GROWTH_SIGMA[ATTITUDE] = GYRO_NOISE * np.sqrt(DT * INTERVAL_S)
GROWTH_SIGMA[VELOCITY] = PUSH_NOISE * np.sqrt(DT * INTERVAL_S)

GPS = Sensor(
    measure=lambda members: np.hstack([members[:, VELOCITY], members[:, POSITION]]),
    subtract=np.subtract,
    noise=np.diag(np.concatenate([GPS_VELOCITY_MPS, GPS_POSITION_M]) ** 2),
)


class Second(NamedTuple):
    """What the computer knows of one second: lever (3, 3) its attitude integrated, gained (3,) m/s in local axes, its
    velocity (3,) and latitude."""

    lever: FloatArray
    gained: FloatArray
    velocity: FloatArray
    latitude: float


def grown(members: FloatArray, second: Second) -> FloatArray:
    """f: the errors (n, 15) one second later, without noise."""
    t, phi, velocity = INTERVAL_S, members[:, ATTITUDE], members[:, VELOCITY]
    s, c = np.sin(second.latitude), np.cos(second.latitude)
    earth = EARTH_RATE * np.array([0.0, c, s])

    def moving(v: FloatArray) -> FloatArray:
        return np.stack([-v[..., 1], v[..., 0], v[..., 0] * (s / c)], -1) / SEMI_MAJOR

    believed = earth + moving(second.velocity)
    turned = turn(phi, believed - moving(velocity))  # the turn of the true local axes, in the computer's
    small = (turned - believed) * t + members[:, GYRO] @ second.lever.T
    after = members.copy()
    after[:, ATTITUDE] += small - 0.5 * cross(phi, small) + _bend(phi) * cross(phi, cross(phi, small))
    middle = 0.5 * (phi + after[:, ATTITUDE])
    true = turn(-middle, second.gained - members[:, PUSH] @ second.lever.T)
    gain = second.gained - true
    after[:, VELOCITY] += gain - t * cross(believed + earth, velocity + gain / 2)
    after[:, 5] += 2 * G / SEMI_MAJOR * members[:, 8] * t
    after[:, POSITION] += 0.5 * t * (velocity + after[:, VELOCITY])
    return after


def taken_off(members: FloatArray, errors: FloatArray) -> FloatArray:
    """The members' errors (n, 15) once the computer has corrected itself by `errors` (15,): exp(-errors) exp(phi)."""
    after = members - errors
    after[:, ATTITUDE] = composed(-errors[ATTITUDE], members[:, ATTITUDE])
    return after


def turn(phi: FloatArray, vectors: FloatArray) -> FloatArray:
    """(n, 3) exp(phi) v: vectors (n, 3) or (3,) turned by rotation vectors (n, 3) (Rodrigues)."""
    angle = np.linalg.norm(phi, axis=1)[:, None]
    half = np.sinc(angle / (2 * np.pi))  # sin(angle / 2) / (angle / 2)
    crossed = cross(phi, vectors)
    turned: FloatArray = vectors + np.sinc(angle / np.pi) * crossed + 0.5 * half**2 * cross(phi, crossed)
    return turned


def composed(first: FloatArray, phi: FloatArray) -> FloatArray:
    """(n, 3) rotation vectors of exp(first) exp(phi), by quaternions; first (3,), phi (n, 3)."""
    a, b = np.linalg.norm(first) / 2, np.linalg.norm(phi, axis=1)[:, None] / 2
    u, v = first / 2 * np.sinc(a / np.pi), phi / 2 * np.sinc(b / np.pi)
    scalar = np.cos(a) * np.cos(b) - (v @ u)[:, None]
    vector = np.cos(a) * v + np.cos(b) * u + cross(u, v)
    sine = np.linalg.norm(vector, axis=1)[:, None]
    angle = 2 * np.arctan2(sine, scalar)
    angle -= 2 * np.pi * (angle > np.pi)
    return vector * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0)


def _bend(phi: FloatArray) -> FloatArray:
    """(n, 1) 1/angle^2 - (1 + cos) / (2 angle sin), 1/12 at zero: how a small turn adds to a large rotation vector."""
    angle = np.maximum(np.linalg.norm(phi, axis=1)[:, None], 1e-3)
    bend: FloatArray = 1 / angle**2 - 1 / (2 * angle * np.tan(angle / 2))
    return bend


def matrix(phi: FloatArray) -> FloatArray:
    """(3, 3) exp of a rotation vector (3,)."""
    return turn(np.tile(phi, (3, 1)), np.eye(3)).T


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """a x b of (..., 3); on few vectors several times quicker than NumPy's."""
    shape = np.broadcast_shapes(a.shape, b.shape)
    (a0, a1, a2), (b0, b1, b2) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    out = np.empty(shape)
    out[..., 0], out[..., 1], out[..., 2] = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    return out
