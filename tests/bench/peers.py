"""The same filter as users of other libraries would write it; those that are installed."""

from __future__ import annotations

import datetime as dt
import importlib.util
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.records import Model, Start

Array = NDArray[np.float64]
Run = Callable[[], Array]  # the last state (9,), in the order position, velocity, acceleration


def installed() -> dict[str, Callable[[Array, Array, Model, Start], Run]]:
    """By name: what prepares a run over time_s (n,) and measurement (n, 3) without gaps."""
    known = {"filterpy": _filterpy, "Stone Soup": _stone_soup, "dynamax (jit)": _dynamax}
    module = {"filterpy": "filterpy", "Stone Soup": "stonesoup", "dynamax (jit)": "dynamax"}
    return {name: prepare for name, prepare in known.items() if importlib.util.find_spec(module[name])}


def _transition(t: float) -> Array:
    return np.kron([[1, t, t * t / 2], [0, 1, t], [0, 0, 1]], np.eye(3))


def _noise(t: float, jerk: float) -> Array:
    q = [[t**5 / 20, t**4 / 8, t**3 / 6], [t**4 / 8, t**3 / 3, t * t / 2], [t**3 / 6, t * t / 2, t]]
    return jerk * np.kron(q, np.eye(3))


def _filterpy(time_s: Array, z: Array, model: Model, start: Start) -> Run:
    from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

    def move(x: Array, t: float) -> Array:
        return np.r_[x[:3] + t * x[3:6] + t * t / 2 * x[6:], x[3:6] + t * x[6:], x[6:]]

    def measure(x: Array) -> Array:
        ground = np.hypot(x[0], x[1])
        return np.array([np.hypot(ground, x[2]), np.arctan2(x[1], x[0]), np.arctan2(x[2], ground)])

    def run() -> Array:
        points = MerweScaledSigmaPoints(9, alpha=1.0, beta=0.0, kappa=0.0)
        ukf = UnscentedKalmanFilter(9, 3, 0.05, measure, move, points)
        ukf.x, ukf.P, ukf.R = start.state.copy(), start.covariance.copy(), np.diag(model.noise_variance)
        for k in range(len(time_s)):
            if k:
                t = time_s[k] - time_s[k - 1]
                ukf.Q = _noise(t, model.jerk[0, 0])
                ukf.predict(dt=t)
            ukf.update(z[k])
        return np.array(ukf.x)

    return run


def _stone_soup(time_s: Array, z: Array, model: Model, start: Start) -> Run:
    from stonesoup.models.measurement.nonlinear import CartesianToElevationBearingRange
    from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantAcceleration
    from stonesoup.predictor.kalman import UnscentedKalmanPredictor
    from stonesoup.types.array import StateVector
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import GaussianState
    from stonesoup.updater.kalman import UnscentedKalmanUpdater

    by_axis = np.arange(9).reshape(3, 3).T.ravel()  # x, vx, ax, y, ...
    motion = CombinedLinearGaussianTransitionModel([ConstantAcceleration(model.jerk[0, 0])] * 3)
    noise = np.diag(model.noise_variance[[2, 1, 0]])
    station = CartesianToElevationBearingRange(ndim_state=9, mapping=(0, 3, 6), noise_covar=noise)
    given = {"alpha": 1.0, "beta": 0.0, "kappa": 0.0}
    predictor, updater = UnscentedKalmanPredictor(motion, **given), UnscentedKalmanUpdater(station, **given)
    epoch = dt.datetime(2021, 1, 1)
    when = [epoch + dt.timedelta(seconds=float(t)) for t in time_s]

    def run() -> Array:
        state: Any = GaussianState(start.state[by_axis], start.covariance[np.ix_(by_axis, by_axis)], when[0])
        for k, moment in enumerate(when):
            state = predictor.predict(state, timestamp=moment)
            reading = Detection(StateVector(z[k, [2, 1, 0]]), timestamp=moment, measurement_model=station)
            state = updater.update(SingleHypothesis(state, reading))
        return np.asarray(state.state_vector, float).ravel()[np.argsort(by_axis)]

    return run


def _dynamax(time_s: Array, z: Array, model: Model, start: Start) -> Run:
    """For one interval; rows that are left out would shift it."""
    import jax

    jax.config.update("jax_enable_x64", True)
    import jax.numpy as jnp
    from dynamax.nonlinear_gaussian_ssm import ParamsNLGSSM, UKFHyperParams, unscented_kalman_filter

    step = float(np.median(np.diff(time_s)))
    phi = jnp.asarray(_transition(step))

    def measure(x: Any) -> Any:
        ground = jnp.hypot(x[0], x[1])
        return jnp.array([jnp.hypot(ground, x[2]), jnp.arctan2(x[1], x[0]), jnp.arctan2(x[2], ground)])

    parameters = ParamsNLGSSM(
        jnp.asarray(start.state), jnp.asarray(start.covariance), lambda x: phi @ x,
        jnp.asarray(_noise(step, model.jerk[0, 0])), measure, jnp.diag(jnp.asarray(model.noise_variance)),
    )  # fmt: skip
    hyper = UKFHyperParams(alpha=1.0, beta=0.0, kappa=0.0)
    compiled = jax.jit(lambda readings: unscented_kalman_filter(parameters, readings, hyper).filtered_means)
    return lambda: np.asarray(compiled(z))[-1]
