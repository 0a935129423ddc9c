"""One run of the in-motion alignment: the drive's sensors with their errors, the computer, and a filter that corrects
it once a second (closed loop)."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from ftproc.core.comparators import ensemble
from ftproc.core.comparators.ensemble import Analysis, FloatArray, Forecast
from tests.acceptance.reproduce import misalignment as errors
from tests.acceptance.reproduce.drive import DT, HZ, Drive, angles, attitude_of, metres, moved, navigate

OUTLIER_TIMES_S = (400, 500, 600)
OUTLIER = np.concatenate([np.full(3, 0.5), np.full(3, 15.0)])  # m/s, m

Update = Callable[[Forecast, Generator], Analysis]


class Run(NamedTuple):
    """attitude (n, 3): error of pitch, roll, heading in degrees after each second. rho, gamma (n,): the normalised
    innovation, and how far it was used. seconds: of the filter's work, per epoch."""

    attitude: FloatArray
    rho: FloatArray
    gamma: FloatArray
    seconds: float


def align(drive: Drive, update: Update, members: int, seed: int, outliers: bool) -> Run:
    """Drive with the errors of the paper's table 1, aligned by a filter; the noises depend on the seed only."""
    noise, rng = np.random.default_rng([seed, 0]), np.random.default_rng([seed, 1])
    epochs = len(drive.turn) // HZ
    turn = drive.turn + DT * (errors.GYRO_BIAS + errors.GYRO_NOISE * noise.standard_normal(drive.turn.shape))
    push = drive.push + DT * (errors.PUSH_BIAS + errors.PUSH_NOISE * noise.standard_normal(drive.push.shape))
    gps_noise = np.linalg.cholesky(errors.GPS.noise) @ noise.standard_normal((6, epochs))
    attitude = attitude_of(*(angles(drive.attitude[0]) + errors.FIRST_ATTITUDE))
    velocity = drive.velocity[0] + errors.FIRST_VELOCITY_MPS
    place = moved(drive.place[0], errors.FIRST_POSITION_M)
    gyro_bias, push_bias, lever, gained = np.zeros(3), np.zeros(3), np.zeros((3, 3)), np.zeros(3)
    cloud = ensemble.draw(np.zeros(15), np.diag(errors.FIRST_SIGMA**2), members, rng)
    run = Run(np.empty((epochs, 3)), np.empty(epochs), np.empty(epochs), 0.0)
    spent = 0.0
    for k in range(epochs):
        now, then = (k + 1) * HZ, k * HZ
        before = velocity.copy()
        navigate(turn[then:now], push[then:now], gyro_bias, push_bias, attitude, velocity, place, lever, gained)
        reading = np.concatenate([velocity - drive.velocity[now], metres(place, drive.place[now])]) - gps_noise[:, k]
        if outliers and k + 1 in OUTLIER_TIMES_S:
            reading -= OUTLIER  # GPS says too much, so the computer seems to say too little
        began = time.perf_counter()
        cloud = errors.grown(cloud, errors.Second(lever, gained, (before + velocity) / 2, place[0]))
        cloud += errors.GROWTH_SIGMA * rng.standard_normal(cloud.shape)
        known = ensemble.forecast(cloud, reading, errors.GPS)
        assert known is not None
        cloud, found, gamma = update(known, rng)
        cloud = errors.taken_off(cloud, found)
        spent += time.perf_counter() - began
        attitude[:] = errors.matrix(-found[errors.ATTITUDE]) @ attitude
        velocity -= found[errors.VELOCITY]
        place[:] = moved(place, -found[errors.POSITION])
        gyro_bias += found[errors.GYRO]
        push_bias += found[errors.PUSH]
        off = angles(attitude) - angles(drive.attitude[now])
        run.attitude[k] = np.rad2deg(np.mod(off + np.pi, 2 * np.pi) - np.pi)
        run.rho[k], run.gamma[k] = known.rho, gamma
    return run._replace(seconds=spent / epochs)
