"""Yu, Feng, Li and Guo: outliers of a range's secondary radar, edited in real time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ftproc.core.comparators import channels, walks
from tests.acceptance.reproduce.page import Page, conclusions

ORDER = 2

GATE, LINE = 0.06, 0.6  # degrees: JDFilter = WDFilter, and D
Q, R, P0, SIGMAS, SMALL_GAIN = 0.006, 0.002, 0.01, 4.0, 0.002
TRUE_START, WRONG_START = np.array([110.712, 33.917]), np.array([109.99, 32.95])  # longitude, latitude
SCANS = 60
TIME = np.arange(float(SCANS))
STEP, NOISE = np.array([0.006, -0.004]), 0.004  # degrees per scan (an airliner seen every 4 s), degrees
JUMPS = (12, 20, 21, 33, 41, 42)  # scans on the second track
LARGE = np.array([-1.5, -1.5])  # degrees
NEAR = 0.15  # degrees: a value so near to the truth is right

_TEXT = """## Yu, Feng, Li and Guo: real-time editing of a range radar

The paper shows a secondary radar's track (transponder code 6206) that jumps to a second one now and then. Here an
aircraft flies straight from the paper's true start (110.712, 33.917) with {noise} degrees of noise, and the second
track lies where the paper's wrong start (109.99, 32.95) is, {away:.2f} and {up:.2f} degrees away. All thresholds and
matrices are the paper's: gate 0.06 degrees, D = 0.6, Q = 0.006, R = 0.002, P0 = 0.01, r = 4, m = 0.002. The paper
prints its results as plots only; its claims are in words.
"""


class Result(NamedTuple):
    """value (n, 2) degrees, NaN where a reading was dropped; kept (n,) whether it was accepted in both; variance (n,)
    of the Kalman filter's longitude."""

    value: np.ndarray
    kept: np.ndarray
    variance: np.ndarray = np.empty(0)


def truth():
    return TRUE_START + np.outer(TIME, STEP)


def readings(bad=(), by=WRONG_START - TRUE_START, seed=6206):
    """(n, 2) with the scans `bad` on the second track, or off by so many degrees."""
    z = truth() + NOISE * np.random.default_rng(seed).standard_normal((SCANS, 2))
    z[list(bad)] += by
    return z


def held(threshold, order=0, window=1, longest=SCANS):
    """The paper's rules: against the value before, or the line through the last four."""
    return channels.Predictor(order, window, threshold, longest, 1.0, False)


def gate(z, check_first=False):
    """Both coordinates must pass, as the paper has it: a scan is dropped whole."""
    weight = np.stack([channels.gate(TIME, z[:, c].copy(), held(GATE), check_first) for c in range(2)], 1)
    kept = weight.all(1)
    return Result(np.where(kept[:, None], z, np.nan), kept)


def line(z):
    found = [channels.least_squares(TIME, z[:, c].copy(), held(LINE, 1, 4, 3)) for c in range(2)]
    return Result(np.stack([f[0] for f in found], 1), np.stack([f[1] for f in found], 1).all(1))


def kalman(z, improved=False, start=WRONG_START):
    """improved: begin at the first pair that agrees, and turn down the gain of the bad coordinate only."""
    begin, x0 = np.zeros(2, np.int64), start
    if improved:
        begin[:] = int(gate(z, check_first=True).kept.argmax())
        x0 = z[begin[0]]
    variances = (np.full(2, v) for v in (P0, R, Q))
    plain = np.zeros(2, np.int64), np.ones(2, np.int64)
    model = walks.Walk(begin, np.array(x0, float), *variances, *plain, SCANS, 1.0)
    value, variance, _, _, weight = walks.outlier_kalman(TIME, z, model, SIGMAS, SMALL_GAIN, improved)
    return Result(value, weight.all(1), variance[:, 0])


def error(result):
    """(n,) degrees, NaN where there is no value."""
    return np.linalg.norm(result.value - truth(), axis=1)


def worst(result, first=0):
    return float(np.nanmax(error(result)[first:], initial=0.0))


def claims() -> list[tuple[str, str, bool]]:
    """(claim of the paper, what came out here, whether it holds)."""
    jumps, first = readings(bad=JUMPS), readings(bad=(0,))
    head, alternating = readings(bad=(0, 2, 4, 6)), readings(bad=range(11, 40, 2))
    three, six = readings(bad=(30, 31, 32)), readings(bad=range(30, 36), by=LARGE)
    opened = int(kalman(readings()).kept.argmax()) + 1
    locked, lost = int(gate(first).kept[1:].argmax()), 4 - int(gate(head, True).kept[1:8:2].sum())
    wide = SIGMAS * np.sqrt(kalman(readings()).variance[20] + 6 * Q + R)
    found = [
        ("fig. 3: the improved gate removes the jumps", f"largest error {worst(gate(jumps, True)):.3f} degrees",
         worst(gate(jumps, True)) < NEAR),
        ("fig. 4: so does the line through four points, and puts values in their place",
         f"largest error {worst(line(jumps)):.3f} degrees; {int(np.isfinite(error(line(jumps))).sum())} of {SCANS} "
         f"scans have a value ({int(gate(jumps, True).kept.sum())} with the gate)", worst(line(jumps)) < NEAR),
        ("a wrong first reading makes the simple gate drop the good ones",
         f"the next {locked} are dropped, until the threshold, which here grows with the gap, lets them in",
         locked > 9),
        ("the improved gate checks the first reading",
         f"{int(gate(first, True).kept[1:].sum())} of {SCANS - 1} good scans kept", gate(first, True).kept[2:].all()),
        ("but drops good readings when outliers alternate with them",
         f"every second of the first eight bad: {lost} of the 4 good ones dropped", lost == 4),
        ("the line survives a wrong first reading and alternating outliers",
         f"largest error after the first scans {worst(line(first), 8):.3f} and {worst(line(alternating)):.3f} degrees",
         max(worst(line(first), 8), worst(line(alternating))) < NEAR),
        ("fig. 5: the anti-outlier Kalman filter finds the track from a wrong start after some recursions",
         f"its gate opens at recursion {opened}; error after 20: {error(kalman(readings()))[20]:.3f} degrees",
         1 < opened < 20 and worst(kalman(readings()), 20) < NEAR),
        ("fig. 6: the improved one finds it at once",
         f"largest error {worst(kalman(readings(), True)):.3f} degrees", worst(kalman(readings(), True)) < NEAR),
        ("fig. 7: three outliers in a row defeat the line", f"largest error {worst(line(three)):.3f} degrees",
         worst(line(three)) > LINE),
        ("fig. 8: six in a row do not defeat the improved Kalman filter",
         f"largest error {worst(kalman(six, True)):.3f} degrees with outliers of {-LARGE[0]:g} degrees; they must be "
         f"larger than the gate has become by the sixth, r sqrt(P + 6 Q + R) or some {wide:.2f} degrees",
         worst(kalman(six, True)) < NEAR),
    ]  # fmt: skip
    return [(claim, here, bool(holds)) for claim, here, holds in found]


def section(page: Page) -> str:
    away = WRONG_START - TRUE_START
    parts = [_TEXT.format(noise=NOISE, away=away[0], up=away[1])]
    parts.append(conclusions(claims()))
    jumps, three, six = readings(bad=JUMPS), readings(bad=(30, 31, 32)), readings(bad=range(30, 36), by=LARGE)
    shown = {
        "range_test_2_to_4": ("Figures 2 to 4: raw, improved gate, line through four points", jumps,
                              {"improved gate": gate(jumps, True), "line through four": line(jumps)}),
        "range_test_5_and_6": ("Figures 5 and 6: from a wrong start", readings(),
                               {"anti-outlier KF": kalman(readings()), "improved": kalman(readings(), True)}),
        "range_test_7_and_8": ("Figures 7 and 8: three outliers in a row for the line, six for the Kalman filter", six,
                               {"line, three outliers": line(three), "improved KF, six": kalman(six, True)}),
    }  # fmt: skip
    for name, (caption, z, results) in shown.items():
        parts.append(page.plot(name, caption, lambda axes, z=z, results=results: _draw(axes, z, results), panels=2))
    return "\n".join(parts)


def _draw(axes, z, results):
    for c, (axis, label) in enumerate(zip(axes, ("longitude (deg)", "latitude (deg)"), strict=True)):
        axis.plot(TIME, truth()[:, c], "k-", lw=0.8, label="truth")
        axis.plot(TIME, z[:, c], ".", color="0.6", label="readings")
        for name, result in results.items():
            axis.plot(TIME, result.value[:, c], "-", marker=".", ms=3, lw=1, label=name)
        axis.set_ylabel(label)
    axes[-1].set_xlabel("scan")
