"""Clean trajectories, with honest uncertainties, from dirty theodolite and radar logs.

    import ftproc
    trajectory = ftproc.filter_log("flight.csv", ftproc.FilterSettings(smooth=True))
    frame = trajectory.to_pandas()

Modules are loaded when first used, so that the import is fast.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.3.0"

if TYPE_CHECKING:
    from ftproc.api import (
        FilterSettings,
        Live,
        Station,
        TrainSettings,
        filter_log,
        plot,
        read_log,
        score,
        simulate,
        to_pandas,
        to_table,
        train,
        write_report,
    )

__all__ = [
    "FilterSettings", "Live", "Station", "TrainSettings", "__version__", "filter_log", "plot", "read_log", "score",
    "simulate", "to_pandas", "to_table", "train", "write_report",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'ftproc' has no attribute {name!r}")
    from ftproc import api

    return getattr(api, name)


def __dir__() -> list[str]:
    """The public names, and nothing else."""
    return sorted(__all__)
