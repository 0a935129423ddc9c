"""The paper's figures 2, 5, 6 and 7 as PNG files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tests.acceptance.reproduce.aligning import OUTLIER_TIMES_S, Run
from tests.acceptance.reproduce.drive import DT, HZ, drive, metres

if TYPE_CHECKING:
    from tests.acceptance.reproduce.alignment import Runs

ANGLES = ("pitch", "roll", "heading")
COLOURS = {"enkf": "tab:gray", "enpf": "tab:blue", "enpf-chi2": "tab:orange", "renpf": "tab:red"}
WIDTHS = {"enkf": 3}  # seen beside the thinner line of renpf


def draw(out: Path, runs: Runs, members: int, gate: float) -> None:
    """Write the four figures, of the runs with so many members, to the directory."""
    import matplotlib as mpl

    mpl.use("Agg")
    out.mkdir(parents=True, exist_ok=True)
    spoiled = {name: runs[name, members, True][0] for name in ("enpf", "enpf-chi2", "renpf")}
    clean = {name: np.mean([r.attitude for r in runs[name, members, False]], 0) for name in COLOURS}
    _drive(out / "alignment_drive.png")
    _attitude(
        out / "alignment_clean.png", clean, f"Mean of {len(runs['enkf', members, False])} runs, {members} members"
    )
    one = {name: run.attitude for name, run in spoiled.items()}
    _attitude(out / "alignment_outliers.png", one, f"One run with outliers, {members} members", OUTLIER_TIMES_S)
    _innovation(out / "alignment_innovation.png", spoiled, gate)


def _save(figure: Any, path: Path) -> None:
    import matplotlib.pyplot as plt

    figure.savefig(path, dpi=110)
    plt.close(figure)


def _drive(path: Path) -> None:
    import matplotlib.pyplot as plt

    driven = drive()
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    place = metres(driven.place[::HZ], driven.place[0]) / 1000
    left.plot(place[:, 0], place[:, 1])
    left.set(xlabel="east, km", ylabel="north, km", aspect="equal", title="The drive")
    right.plot(np.arange(len(driven.speed)) * DT, driven.speed)
    right.set(xlabel="time, s", ylabel="speed, m/s", title="Its speed")
    for axes in (left, right):
        axes.grid(alpha=0.3)
    _save(figure, path)


def _attitude(path: Path, errors: dict[str, np.ndarray], title: str, marks: tuple[int, ...] = ()) -> None:
    """errors: (n, 3) degrees by filter; the last half again in a finer scale."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(3, 2, figsize=(11, 8), sharex="col", layout="constrained")
    for i, angle in enumerate(ANGLES):
        for column, first in ((0, 0), (1, 300)):
            for name, error in errors.items():
                time = np.arange(1, len(error) + 1)
                axes[i, column].plot(
                    time[first:], error[first:, i], color=COLOURS[name], lw=WIDTHS.get(name, 1), label=name
                )
            for mark in marks:
                axes[i, column].axvline(mark, color="black", lw=0.5, ls=":")
            axes[i, column].grid(alpha=0.3)
        axes[i, 0].set_ylabel(f"{angle} error, degrees")
    for column in (0, 1):
        axes[2, column].set_xlabel("time, s")
    axes[0, 0].legend()
    figure.suptitle(title)
    _save(figure, path)


def _innovation(path: Path, runs: dict[str, Run], gate: float) -> None:
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(len(runs), 1, figsize=(10, 8), sharex=True, layout="constrained")
    for panel, (name, run) in zip(axes, runs.items(), strict=True):
        time = np.arange(1, len(run.rho) + 1)
        panel.semilogy(time, run.rho, color=COLOURS[name], lw=0.8)
        refused = run.gamma == 0
        panel.plot(time[refused], run.rho[refused], "k.", ms=4, label="not used")
        if name == "enpf-chi2":
            panel.axhline(gate, color="black", ls="--", lw=1, label="gate")
        panel.set_ylabel(f"{name}: normalised innovation")
        panel.grid(alpha=0.3)
        panel.legend(loc="upper left")
    axes[-1].set_xlabel("time, s")
    _save(figure, path)
