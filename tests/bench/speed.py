"""Speed per sample on one log, medians of interleaved repetitions: our kernels, the same in C, and other libraries."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from ftproc import pipeline
from ftproc.core.editing import gate, track
from ftproc.core.filtering import forward
from ftproc.core.filtering.records import FilterRun, Model, Observations, Start
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.model import motion
from ftproc.settings import FilterSettings
from ftproc.simulation import Simulation, simulate
from tests.bench import c_kernel, measuring, peers

HEADER = ("what", "per sample", "ratio", "to", "bound")
PLAIN, GATED, SMOOTHED = "UKF forward pass", "forward pass with gate and editing", "forward pass and smoother"
C = "the same UKF in C (gcc -O3 -march=native)"
JERK = 10.0  # m^2/s^5
ROUNDS = 9
PEER_SAMPLES = 400


def rows() -> Iterator[tuple[str, ...]]:
    """Kernels to C, then other libraries to filterpy."""
    flight = simulate("manoeuvre", seed=1, duration_s=2500.0)
    model, start = known(flight)
    log = _without_gaps(flight)
    kernels: dict[str, Callable[[], object]] = {
        PLAIN: lambda: forward.filter_log(log, model, [start]),
        GATED: lambda: track.filter_and_edit(log, model, [start], gate.GateSettings()),
        SMOOTHED: lambda: smooth_log(log, model, [start]),
    }
    with tempfile.TemporaryDirectory() as folder:
        in_c = c_kernel.compiled(Path(folder))
        if in_c is not None:
            _compare(in_c(log, model, start), forward.filter_log(log, model, [start]))
            kernels = {C: lambda: in_c(log, model, start), **kernels}
        taken = {name: each.seconds / len(log.time_s) for name, each in measuring.calls(kernels, ROUNDS).items()}
    bounds = {PLAIN: "<= 0.8", GATED: "<= 1.2", SMOOTHED: "<= 2.5"}
    for name, each in taken.items():
        ratio = f"{each / taken[C]:.2f}" if C in taken else "-"
        yield name, _us(each), ratio, "C", bounds.get(name, "")
    yield from _peers(log, model, start, flight)


def known(flight: Simulation) -> tuple[Model, Start]:
    """The true noise and start of a flight, and one jerk level."""
    assert flight.truth.velocity_mps is not None
    state = np.r_[flight.truth.position_m[0], flight.truth.velocity_mps[0], np.zeros(3)]
    start = Start(0, state, np.diag([25.0] * 3 + [4.0] * 3 + [25.0] * 3))
    return Model(np.array(flight.sigma) ** 2, motion.isotropic(JERK)), start


def _without_gaps(flight: Simulation) -> Observations:
    """The log with missing readings interpolated: not every library can do without one."""
    time_s, z = flight.log.time_s, flight.log.measurement
    filled = np.column_stack([np.interp(time_s, time_s[ok], c[ok]) for c in z.T for ok in [np.isfinite(c)]])
    return Observations(time_s - time_s[0], filled, np.ones_like(filled))


def _compare(one: FilterRun, other: FilterRun) -> None:
    """Two runs that are compared in speed must do the same."""
    for name, left, right in zip(one._fields, one, other, strict=True):
        np.testing.assert_allclose(left, right, rtol=1e-9, atol=1e-9, err_msg=name)


def _peers(log: Observations, model: Model, start: Start, flight: Simulation) -> Iterator[tuple[str, ...]]:
    """Against filterpy, also with all the computing of a command: screening, tuning, editing, network. The bound on the
    kernel with its gate is not met by a whole command; both are shown."""
    head = log.part(slice(PEER_SAMPLES))
    ours: dict[str, tuple[Callable[[], object], int]] = {
        PLAIN: (lambda: forward.filter_log(log, model, [start]), len(log.time_s)),
        GATED: (lambda: track.filter_and_edit(log, model, [start], gate.GateSettings()), len(log.time_s)),
    }
    for name, settings in (
        ("`--editing forward --noise --jerk`, computing", FilterSettings(
            editing="forward", noise=flight.sigma, jerk_psd_m2ps5=JERK)),
        ("`filter`, computing", FilterSettings()),
        ("`filter --smooth`, computing", FilterSettings(smooth=True)),
    ):  # fmt: skip
        ours[name] = (lambda settings=settings: pipeline.filter_log(flight.log, settings), len(flight.log))  # type: ignore[misc]
    expected = forward.filter_log(head, model, [start]).state[-1, :3]
    calls = {name: call for name, (call, _) in ours.items()}
    samples = {name: count for name, (_, count) in ours.items()}
    for name, prepare in peers.installed().items():
        calls[name] = prepare(head.time_s, head.measurement, model, start)
        samples[name] = PEER_SAMPLES
        assert np.linalg.norm(calls[name]()[:3] - expected) < 1.0, f"{name} filters something else"
    taken = {name: each.seconds / samples[name] for name, each in measuring.calls(calls, 3).items()}
    if "filterpy" not in taken:
        return
    for name, each in taken.items():
        faster = taken["filterpy"] / each
        yield name, _us(each), f"{faster:.3g} x faster", "filterpy UKF", ">= 300 x" if name == GATED else ""


def _us(seconds: float) -> str:
    return f"{1e6 * seconds:.3g} us"
