"""A drive of 600 s, what its inertial sensors and GPS receiver would say, and the navigation computer on board.

Local axes are east, north, up; body axes right, forward, up. Attitude is C, which turns body into local axes. The
computer's steps (100 Hz) are first-order but for rotations, which are exact; the sensors' increments are found by
solving the very same steps for them, so that without sensor errors the computer reproduces the drive.
"""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit

HZ = 100
DT = 1 / HZ
DURATION_S = 600
G, EARTH_RATE, SEMI_MAJOR, FLATTENING = 9.80665, 7.2921151467e-5, 6378137.0, 1 / 298.257223563
STANDING = (math.radians(40.0), math.radians(116.0), 50.0)  # latitude, longitude rad, height m at the beginning

# From these times on: the acceleration along the path in m/s2 (at most 2 in size; the speed reaches 30 m/s).
ACCELERATIONS = [
    (0, 0.0), (10, 1.0), (30, 0.0), (90, -1.0), (100, 0.0), (140, 2.0), (150, 0.0), (240, -2.0), (250, 0.0),
    (300, 1.0), (320, 0.0), (410, -2.0), (420, 0.0), (460, 2.0), (470, 0.0), (560, -1.0), (580, 0.0),
]  # fmt: skip
# Small S-shaped turns: beginning and end in s, size of the swing in rad; each is one period of a sine.
SWINGS = [(45, 75, 0.35), (170, 200, 0.3), (205, 235, -0.3), (340, 370, 0.3), (490, 520, -0.35), (525, 555, 0.35)]
HEADING = math.radians(45.0)  # clockwise from north


class Drive(NamedTuple):
    """speed (n + 1,); attitude (n + 1, 3, 3), velocity (n + 1, 3) m/s, place (n + 1, 3) latitude, longitude rad and
    height m; turn, push (n, 3): increments of angle rad and velocity m/s in body axes that the sensors would see."""

    speed: np.ndarray
    attitude: np.ndarray
    velocity: np.ndarray
    place: np.ndarray
    turn: np.ndarray
    push: np.ndarray


@njit(error_model="numpy")
def cross(a, b, out):
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(error_model="numpy")
def rotation(v, out):
    """exp of the rotation vector (3,), a matrix (3, 3)."""
    angle2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    angle = math.sqrt(angle2)
    s = math.sin(angle) / angle if angle > 1e-8 else 1 - angle2 / 6
    c = (1 - math.cos(angle)) / angle2 if angle > 1e-4 else 0.5 - angle2 / 24
    for i in range(3):
        for j in range(3):
            out[i, j] = c * v[i] * v[j]
        out[i, i] += math.cos(angle)
    out[0, 1] -= s * v[2]
    out[1, 0] += s * v[2]
    out[0, 2] += s * v[1]
    out[2, 0] -= s * v[1]
    out[1, 2] -= s * v[0]
    out[2, 1] += s * v[0]


@njit(error_model="numpy")
def multiply(a, b, out):
    """out (3, 3) = a b."""
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@njit(error_model="numpy")
def surroundings(velocity, place, frame, slowing, radii):
    """For the next step: the turn of the local axes in rad, gravity and Coriolis in m/s; the radii of curvature along
    the meridian and across it in m."""
    s, c = math.sin(place[0]), math.cos(place[0])
    squash = 1 - FLATTENING * (2 - FLATTENING) * s * s
    radii[0] = SEMI_MAJOR * (1 - FLATTENING) ** 2 / squash**1.5 + place[2]
    radii[1] = SEMI_MAJOR / math.sqrt(squash) + place[2]
    frame[0], frame[1], frame[2] = -velocity[1] / radii[0], velocity[0] / radii[1], velocity[0] * s / c / radii[1]
    turning = (frame[0], frame[1] + 2 * EARTH_RATE * c, frame[2] + 2 * EARTH_RATE * s)
    cross(velocity, turning, slowing)
    slowing[2] -= G * (1 - 2 * place[2] / SEMI_MAJOR)
    frame[1] += EARTH_RATE * c
    frame[2] += EARTH_RATE * s
    for i in range(3):
        frame[i] *= DT
        slowing[i] *= DT


@njit(error_model="numpy")
def travel(before, after, radii, place):
    """Move a place by the mean of the velocities before and after one step."""
    latitude = place[0]
    place[0] += DT * 0.5 * (before[1] + after[1]) / radii[0]
    place[1] += DT * 0.5 * (before[0] + after[0]) / (radii[1] * math.cos(latitude))
    place[2] += DT * 0.5 * (before[2] + after[2])


@njit(cache=True, error_model="numpy")
def navigate(turn, push, gyro_bias, push_bias, attitude, velocity, place, lever, gained):
    """The computer's steps through increments (n, 3), less the biases it knows (rad/s, m/s2); attitude, velocity and
    place in place. Fills lever (3, 3), the integral of the attitude in s, and gained (3,), the pushes in local axes.
    """
    frame, slowing, radii, bent, before = np.zeros(3), np.zeros(3), np.zeros(2), np.zeros(3), np.zeros(3)
    angle, felt = np.zeros(3), np.zeros(3)
    back, on, half = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    for i in range(3):
        gained[i] = 0.0
        for j in range(3):
            lever[i, j] = 0.0
    for k in range(turn.shape[0]):
        surroundings(velocity, place, frame, slowing, radii)
        for i in range(3):
            angle[i] = turn[k, i] - gyro_bias[i] * DT
            felt[i] = push[k, i] - push_bias[i] * DT
        cross(angle, felt, bent)
        for i in range(3):
            before[i] = velocity[i]
            gain = 0.0
            for j in range(3):
                gain += attitude[i, j] * (felt[j] + 0.5 * bent[j])
                lever[i, j] += attitude[i, j] * DT
            gained[i] += gain
            velocity[i] += gain + slowing[i]
            frame[i] = -frame[i]
        travel(before, velocity, radii, place)
        rotation(frame, back)
        rotation(angle, on)
        multiply(attitude, on, half)
        multiply(back, half, attitude)


@njit(cache=True, error_model="numpy")
def sense(attitude, velocity, place, turn, push):
    """The increments (n, 3) by which `navigate` goes through attitudes (n + 1, 3, 3) and velocities (n + 1, 3), and
    the places (n + 1, 3) that it passes; place[0] is given."""
    frame, slowing, radii, bent = np.zeros(3), np.zeros(3), np.zeros(2), np.zeros(3)
    on, half, step, wanted = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3)
    for k in range(turn.shape[0]):
        surroundings(velocity[k], place[k], frame, slowing, radii)
        rotation(frame, on)
        multiply(on, attitude[k + 1], half)
        multiply(attitude[k].T, half, step)
        for i in range(3):
            turn[k, i] = 0.5 * (step[i - 1, i - 2] - step[i - 2, i - 1])  # the axis, as long as the angle's sine
        sine = math.sqrt(turn[k, 0] ** 2 + turn[k, 1] ** 2 + turn[k, 2] ** 2)
        for i in range(3):
            turn[k, i] *= math.asin(sine) / sine
            wanted[i] = 0.0
            for j in range(3):
                wanted[i] += attitude[k, j, i] * (velocity[k + 1, j] - velocity[k, j] - slowing[j])
            push[k, i] = wanted[i]
        for _ in range(5):  # wanted = push + turn x push / 2; the turn is tiny
            cross(turn[k], push[k], bent)
            for i in range(3):
                push[k, i] = wanted[i] - 0.5 * bent[i]
        for i in range(3):
            place[k + 1, i] = place[k, i]
        travel(velocity[k], velocity[k + 1], radii, place[k + 1])


@cache
def drive(duration_s: int = DURATION_S) -> Drive:
    """The drive of the experiment, or its first seconds."""
    n = duration_s * HZ
    time = np.arange(n + 1) * DT
    starts, levels = np.array(ACCELERATIONS).T
    speed = np.r_[0.0, np.cumsum(levels[np.searchsorted(starts, time[:-1] + DT / 2) - 1]) * DT]
    heading = np.full(n + 1, HEADING)
    for begin, end, size in SWINGS:
        inside = (time > begin) & (time < end)
        heading[inside] += size * np.sin(2 * np.pi * (time[inside] - begin) / (end - begin))
    s, c, zero = np.sin(heading), np.cos(heading), np.zeros(n + 1)
    attitude = np.moveaxis(np.array([[c, s, zero], [-s, c, zero], [zero, zero, zero + 1]]), -1, 0).copy()
    velocity = speed[:, None] * attitude[:, :, 1]
    place, turn, push = np.zeros((n + 1, 3)), np.zeros((n, 3)), np.zeros((n, 3))
    place[0] = STANDING
    sense(attitude, velocity, place, turn, push)
    return Drive(speed, attitude, velocity, place, turn, push)


def angles(attitude: np.ndarray) -> np.ndarray:
    """(..., 3) pitch, roll, heading in rad."""
    a = attitude
    pitch = np.arcsin(np.clip(a[..., 2, 1], -1, 1))
    return np.stack([pitch, np.arctan2(-a[..., 2, 0], a[..., 2, 2]), np.arctan2(a[..., 0, 1], a[..., 1, 1])], -1)


def attitude_of(pitch: float, roll: float, heading: float) -> np.ndarray:
    """(3, 3) from the three angles in rad."""
    (sp, cp), (sr, cr), (sh, ch) = ((math.sin(v), math.cos(v)) for v in (pitch, roll, heading))
    about_up = np.array([[ch, sh, 0], [-sh, ch, 0], [0, 0, 1]])
    about_right = np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]])
    about_forward = np.array([[cr, 0, sr], [0, 1, 0], [-sr, 0, cr]])
    return about_up @ about_right @ about_forward


def metres(place: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """(..., 3) east, north, up in m between two places that are close to each other."""
    s2 = math.sin(float(np.ravel(origin)[0])) ** 2
    squash = 1 - FLATTENING * (2 - FLATTENING) * s2
    across, along = SEMI_MAJOR / math.sqrt(squash), SEMI_MAJOR * (1 - FLATTENING) ** 2 / squash**1.5
    d = place - origin
    height = np.ravel(origin)[2]
    east = d[..., 1] * (across + height) * np.cos(origin[..., 0])
    return np.stack([east, d[..., 0] * (along + height), d[..., 2]], -1)


def moved(place: np.ndarray, metres_: np.ndarray) -> np.ndarray:
    """(3,) the place so many metres east, north, up of another."""
    unit = metres(place + np.array([1e-6, 1e-6, 1.0]), place)
    return place + np.array([1e-6, 1e-6, 1.0]) * np.array([metres_[1] / unit[1], metres_[0] / unit[0], metres_[2]])
