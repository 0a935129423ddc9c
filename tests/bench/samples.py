"""Accuracy on the logs of `sample_data`, which `make run` filters, against their truths."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import ftproc
from ftproc.records import COMPONENTS
from ftproc.settings import FilterSettings

FOLDER = Path(__file__).parents[2] / "sample_data"
LOGS = ("zuo2021-outliers.csv", "radar.csv", "theodolite.parquet", "total_station.csv")
HEADER = ("log", "", "position RMSE m", "velocity RMSE m/s", "in 3 sigma %", "found % of R, A, E",
          "false alarms % of R, A, E")  # fmt: skip


def rows() -> Iterator[tuple[str, ...]]:
    """Two rows per log: filtered and smoothed."""
    for name in LOGS:
        log = FOLDER / name
        station, truth = log.with_suffix(".toml"), next(FOLDER.glob(f"{log.stem}.truth.*"))
        for smooth in (False, True):
            trajectory = ftproc.filter_log(
                log, FilterSettings(smooth=smooth), config=station if station.exists() else None
            )
            found = ftproc.score(trajectory, truth).as_dict()
            yield (
                log.stem,
                "`--smooth`" if smooth else "filter",
                f"{found['rmse_3d_m']:.4g}",
                f"{found['rmse_v_mps']:.4g}",
                f"{100 * found['in_3sigma']:.1f}",
                _shares(found, "recall"),
                _shares(found, "false_alarm_rate"),
            )


def _shares(found: dict[str, Any], what: str) -> str:
    """Of each component, %; - where it has no outliers."""
    shares = [found["outliers"][name][what] for name in COMPONENTS]
    return ", ".join("-" if share is None else f"{100 * share:.4g}" for share in shares)
