"""Zuo et al. 2021: GA-BPNN-UKF against BPNN-EKF on a simulated flight, and against its rival on a theodolite's log."""

from __future__ import annotations

from functools import cache

import numpy as np

from ftproc.core.model.frames import from_cartesian, unwrap
from ftproc.records import COMPONENTS, Trajectory
from ftproc.scoring.figures import Gradient, average_gradient
from ftproc.simulation import Simulation, simulate
from tests.acceptance import zuo2021
from tests.acceptance.reproduce.page import Page, conclusions, table
from tests.acceptance.zuo2021 import PAPER, TRIALS, UNTUNED, WAYS, WITHOUT_NETWORK, errors

ORDER = 1

ANGLES_RAD = (2e-4, 1e-3, 1e-2, 1e-1)
NOTHING = 0.005  # change of the error by a network that has learned nothing
PAPER_GRADIENT = {"algorithm 1": (4.0753, 0.524, 0.0019), "algorithm 2": (1.0552, 0.521, 0.0013)}
THEODOLITE = {"scenario": "manoeuvre", "seed": 7, "duration_s": 75.0}
UNEDITED = ("ekf", "bpnn-ekf", "ukf")  # for these, forward and two-pass are the same
SHORT = {"untuned, forward": "untuned", "from the log, forward": "forward", "from the log, two-pass": "two-pass"}
RIVALS = ("wavelet-akf", "bpnn-ekf")  # of the theodolite's log, and the main method in both ways

_TEXT = """## Zuo et al. 2021: GA-BPNN-UKF

The networks are trained as in the paper's sections 2.1 and 2.2 (input: update minus prediction; target: truth minus
estimate; gradient descent with momentum) on {flights} other flights of constant acceleration: BPNN-EKF's from random
first weights, GA-BPNN-UKF's after the genetic search. Held-out flights decide how much of a network's answer is
applied, output by output. None of them is the flight that it is tried on: its noise alone would be new. All methods
are averaged over the same samples, those from which every filter has an estimate.

The paper does not say what noise and process noise its filters assume. Rows `untuned`: 3.16 m, {angle:g} rad,
{angle:g} rad and a jerk PSD of {jerk:g} m²/s⁵, as of someone who knows the range's noise only, for the paper adds none
to the angles. Other rows: found from the log. `forward` is the paper's editing, a recursive gate whose weight m scales
the gain and which puts the prediction in place of patches; `two-pass` is the program's own. Filters without editing are
the same in both.

What departs: `forward` knows what has come so far, also of the noise and of the first state, and has no estimate before
the readings agree on a track. Filters without editing have these from the whole log, and err less on the clean flight.
"""


def _label(method: str, way: str) -> str:
    return f"{method}, {SHORT[way]}"


def _ways(method: str) -> list[str]:
    return [way for way in WAYS if not (method in UNEDITED and way == "from the log, two-pass")]


@cache
def run(method: str, way: str, scenario: str, seed: int, duration_s: float | None = None) -> Trajectory:
    """The method on a flight, with a network of its own kind where it has one."""
    few = {"flights": 6, "duration_s": duration_s} if duration_s else {}
    network = zuo2021.model(method, scenario, way, **few) if "bpnn" in method else None
    return zuo2021.filtered(method, simulate(scenario, seed=seed, duration_s=duration_s), way, network)


def _trials(scenario: str) -> str:
    """Mean errors of the methods, trial by trial, the paper's beside them on the clean flight."""
    rows: list[list[object]] = []
    if scenario == "zuo2021":
        rows += [[f"{name}, the paper", *figures, float(np.mean(figures)), "-"] for name, figures in PAPER.items()]
    for way in WAYS:
        for method in ("ekf", "bpnn-ekf", "ukf", "ga-bpnn-ukf"):
            if way not in _ways(method):
                continue
            found = errors(method, scenario, way, method in PAPER)
            learned = _learned(method, scenario, way) if method in PAPER else "-"
            rows.append([_label(method, way), *found, float(np.mean(found)), learned])
            if method == "ga-bpnn-ukf":
                plain = errors(method, scenario, way, corrected=False)
                rows.append([f"{_label(method, way)}, its filter alone", *plain, float(np.mean(plain)), "-"])
    return table(("", *(f"trial {i}" for i in TRIALS), "mean", "the network"), rows)


def _change(method: str, scenario: str, way: str) -> float:
    """Mean error with the network over that without."""
    with_network, without = (np.mean(errors(method, scenario, way, corrected)) for corrected in (True, False))
    return float(with_network / without)


def _learned(method: str, scenario: str, way: str) -> str:
    change = _change(method, scenario, way)
    return "has nothing to learn" if abs(change - 1) < NOTHING else f"takes the error to {100 * change:.0f} %"


def _sweep() -> str:
    """Mean errors by the noise of the angles that is specified, the paper's beside them."""
    rows: list[list[object]] = [
        [f"{angle:g} rad", *(zuo2021.specified(method, angle) for method in PAPER)] for angle in ANGLES_RAD
    ]
    rows.append(["the paper", *(float(np.mean(figures)) for figures in PAPER.values())])
    return table(("specified", *(f"filter of {method}" for method in PAPER)), rows)


def claims() -> list[tuple[str, str, bool]]:
    """(claim of the paper, what came out here, whether it holds)."""
    found = []
    for way in WAYS:
        rival = way if way in _ways("bpnn-ekf") else "from the log, forward"
        own, other = errors("ga-bpnn-ukf", "zuo2021", way), errors("bpnn-ekf", "zuo2021", rival)
        below = sum(a < b for a, b in zip(own, other, strict=True))
        found.append((f"table 1: GA-BPNN-UKF is more accurate than BPNN-EKF ({way})", f"in {below} of 4 trials; means "
                      f"{np.mean(own):.2f} and {np.mean(other):.2f} m", below == 4))  # fmt: skip
    for method in PAPER:
        for way in _ways(method):
            change = _change(method, "zuo2021", way)
            plain = WITHOUT_NETWORK[method].removeprefix("ga-bpnn-")
            found.append((f"section 2.2: the network corrects the {plain.upper()} ({way})",
                          _learned(method, "zuo2021", way), change < 1 - NOTHING))  # fmt: skip
    for way in WAYS:
        clean, dirty = (float(np.mean(errors("ga-bpnn-ukf", s, way))) for s in ("zuo2021", "zuo2021-outliers"))
        found.append((f"section 3.2: outliers do little harm to it ({way})", f"{dirty:.2f} m, clean {clean:.2f} m",
                      dirty < 1.5 * clean))  # fmt: skip
    for method in ("ukf", "bpnn-ekf"):
        way = "from the log, forward"
        clean, dirty = (
            float(np.mean(errors(method, s, way, method in PAPER))) for s in ("zuo2021", "zuo2021-outliers")
        )
        found.append((f"section 3.2: {method} cannot reject them", f"{dirty:.2f} m, clean {clean:.2f} m",
                      dirty > 5 * clean))  # fmt: skip
    f = {name: g for name, (g, _) in gradients().items()}
    rival, truth = f["wavelet-akf"], f["the truth"]
    for way in ("forward", "two-pass"):
        own = f[f"ga-bpnn-ukf, {way}"]
        found.append((f"table 2: its average gradient is smaller ({way})",
                      f"R {own.range_m:.4g} and {rival.range_m:.4g} m; the truth's {truth.range_m:.4g}",
                      _smaller(own, rival)))  # fmt: skip
        three = zip(*map(_values, (own, rival, truth)), strict=True)
        nearer = [name for name, (a, b, c) in zip("RAE", three, strict=True) if abs(a - c) <= abs(b - c)]
        found.append((f"... and nearer to the truth's, which F should be ({way})", f"in {', '.join(nearer) or 'none'}",
                      len(nearer) == 3))  # fmt: skip
    return found


def _values(gradient: Gradient) -> tuple[float, float, float]:
    return gradient.range_m, gradient.azimuth_rad, gradient.elevation_rad


def _smaller(one: Gradient, other: Gradient) -> bool:
    return all(a < b for a, b in zip(_values(one), _values(other), strict=True))


def _ranges(page: Page, scenario: str, methods: tuple[tuple[str, str], ...], figures: tuple[int, int]) -> str:
    flight = simulate(scenario, seed=TRIALS[0])
    time, truth = flight.log.time_s, np.linalg.norm(flight.truth.position_m, axis=1)
    found = {_label(*m): run(*m, scenario, TRIALS[0]).measurement[:, 0] for m in methods}

    def estimates(axis):
        axis.plot(time, flight.log.measurement[:, 0], ".", color="0.6", label="readings")
        axis.plot(time, truth, "k-", lw=0.8, label="truth")
        for name, values in found.items():
            axis.plot(time, values, "-", lw=1, label=name)
        axis.set(xlabel="time (s)", ylabel="range (m)")

    def deviations(axis):
        for name, values in found.items():
            axis.plot(time, values - truth, "-", lw=1, label=name)
        axis.set(xlabel="time (s)", ylabel="range error (m)")

    drawn = ("range", estimates), ("error of the range", deviations)
    return "\n".join(
        page.plot(f"zuo2021_{number}", f"Figure {number}: {what}", draw)
        for number, (what, draw) in zip(figures, drawn, strict=True)
    )


def _on_theodolite() -> dict[str, Trajectory]:
    """What the methods make of the theodolite's log."""
    scenario, seed, duration_s = THEODOLITE.values()
    found = {name: run(name, "from the log, forward", scenario, seed, duration_s) for name in RIVALS}
    for way in ("from the log, forward", "from the log, two-pass"):
        found[_label("ga-bpnn-ukf", way)] = run("ga-bpnn-ukf", way, scenario, seed, duration_s)
    return found


def _theodolite_flight() -> Simulation:
    return simulate(**THEODOLITE)


def gradients() -> dict[str, tuple[Gradient, float | None]]:
    """Average gradients (eq. 18) and mean position errors, m, of the methods, of the truth and of the readings."""
    flight = _theodolite_flight()
    found: dict[str, tuple[Gradient, float | None]] = {
        name: (average_gradient(t.measurement), zuo2021.error(t, flight)) for name, t in _on_theodolite().items()
    }
    found["the truth"] = average_gradient(from_cartesian(flight.truth.position_m)), None
    found["the readings"] = average_gradient(flight.log.measurement), None
    return found


def _theodolite(page: Page) -> str:
    rows: list[list[object]] = [[f"{name}, the paper's log", *f, "-"] for name, f in PAPER_GRADIENT.items()]
    rows += [[f"{name}, here", *_values(g), "-" if e is None else e] for name, (g, e) in gradients().items()]
    parts = [table(("", "F of R (m)", "F of A (rad)", "F of E (rad)", "mean position error (m)"), rows)]
    flight, found = _theodolite_flight(), _on_theodolite()
    for number, c, names in ((8, 0, ()), (9, 0, tuple(found)), (10, 1, tuple(found)), (11, 2, tuple(found))):

        def draw(axis, c=c, names=names):
            straight = unwrap if c == 1 else np.asarray
            axis.plot(
                flight.log.time_s, straight(flight.log.measurement[:, c]), ".", ms=2, color="0.7", label="readings"
            )
            for name in names:
                axis.plot(flight.log.time_s, straight(found[name].measurement[:, c]), "-", lw=1, label=name)
            axis.set(xlabel="time (s)", ylabel=f"{COMPONENTS[c]} ({'m' if c == 0 else 'rad'})")

        what = "readings" if number == 8 else "filtered"
        parts.append(page.plot(f"zuo2021_{number}", f"Figure {number}: {COMPONENTS[c]}, {what}", draw))
    return "\n".join(parts)


_RANGES = """### Section 3.1, table 1 and figures 4 and 5: constant acceleration, 60 s at 1 Hz, range variance 10 m²

Mean length of the position error (the paper's "RMSE", eqs 20 and 21) in metres; the angles have the noise of a good
theodolite, 0.2 mrad.
"""
_SWEEP = """The paper does not say what noise of the angles its filters assume. That of 0.1 rad was chosen here because
errors are then of the paper's size, so that they are confirms nothing.
"""
_LOG = """### Section 3.3, table 2 and figures 8 to 11: a theodolite's log

The paper's log is its own; here a fighter is tracked at 20 Hz, with outliers and patches in every component. F is the
average gradient (eq. 18), which measures motion as well as noise. The paper's algorithm 1 is its ref. 12 (adaptive
Kalman filter and wavelets), whose formulas it does not give: `wavelet-akf` is our reconstruction of it.
Algorithm 2 is the GA-BPNN anti-outlier UKF.
"""


def section(page: Page) -> str:
    assert UNTUNED.noise is not None
    own = [("ga-bpnn-ukf", way) for way in WAYS]
    return "\n".join(
        [
            _TEXT.format(flights=zuo2021.FLIGHTS, angle=UNTUNED.noise[1], jerk=UNTUNED.jerk_psd_m2ps5),
            _RANGES,
            _trials("zuo2021"),
            _SWEEP,
            _sweep(),
            _ranges(page, "zuo2021", (("bpnn-ekf", "untuned, forward"), *own), (4, 5)),
            "### Section 3.2, figures 6 and 7: the same flight with outliers in range\n",
            _trials("zuo2021-outliers"),
            _ranges(page, "zuo2021-outliers", (("ukf", "from the log, forward"), *own), (6, 7)),
            _LOG,
            _theodolite(page),
            "### What the paper concludes\n",
            conclusions(claims()),
        ]
    )
