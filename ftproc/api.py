"""The Python interface: what the command line does, on pandas DataFrames, pyarrow Tables or files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ftproc import pipeline
from ftproc.config.reading import load
from ftproc.config.recipe import Recipe
from ftproc.correction import model_file
from ftproc.derived.columns import with_columns
from ftproc.errors import UsageError
from ftproc.files.decisions import Decisions
from ftproc.files.decisions import read as read_decisions
from ftproc.live.live import Live
from ftproc.records import VIEWS, MeasurementLog, Trajectory, Truth
from ftproc.settings import PACKAGED, FilterSettings, Station, TrainSettings

__all__ = ["FilterSettings", "Live", "Station", "TrainSettings"]

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
    import pyarrow as pa

    from ftproc.correction.model import Model
    from ftproc.scoring import Score
    from ftproc.simulation import Simulation


def read_log(source: Any, *, config: str | Path | None = None, **options: Any) -> MeasurementLog:
    """A log from a file of any kind that `ftproc filter` reads, a pandas DataFrame or a pyarrow Table.

    config: a station file. options: units, columns, azimuth_from, keep_columns, station (see
    `ftproc.files.reading.logs.read`), widths, where, target (as on the command line); they win over it. signal: read
    the strength of the signal too, for a model that learned from it. The log's
    `understood` says how the file was understood. Raises InputError, UsageError.
    """
    from ftproc.files.reading import logs

    extracting = {name: options.pop(name) for name in ("widths", "where", "target") if name in options}
    recipe = replace(_recipe(config), **extracting)
    return logs.read(source, **{**recipe.reading(options.pop("signal", False)), **options})


def filter_log(
    log: Any,
    settings: FilterSettings | None = None,
    *,
    model: Model | str | None = PACKAGED,
    config: str | Path | None = None,
    azimuth_from: str | None = None,
    site: tuple[float, float, float] | None = None,
    decisions: Decisions | str | Path | None = None,
) -> Trajectory:
    """The trajectory of a log (a MeasurementLog, or anything `read_log` takes).

    settings: those of `FilterSettings`; left out, those of the station file, or the defaults.

    model: the packaged correction, another one (or its file), or None for none.
    config: a station file: how the log is read (unless it is a MeasurementLog), and the settings and the model where
    they are not specified here.
    azimuth_from: `x` or `north`, unless the log is a MeasurementLog, which was read already. site: latitude deg,
    longitude deg and height m of the station; with one, here or in the settings, the trajectory has `lat_deg`,
    `lon_deg` and `height_m`. decisions: by hand, on its readings (or their file).
    Raises InputError, UsageError.
    """
    recipe = _recipe(config)
    settings = settings or recipe.settings
    if site is not None:
        settings = replace(settings, site=site)
    reading: dict[str, Any] = {} if azimuth_from is None else {"azimuth_from": azimuth_from}
    if reading and isinstance(log, MeasurementLog):
        raise UsageError("azimuth_from is for reading a log, and this one was read already; give it to read_log.")
    if isinstance(model, str):
        model = model_file.named(recipe.model if model == PACKAGED else model)
    reading["signal"] = model is not None and model.hears
    read = log if isinstance(log, MeasurementLog) else read_log(log, config=config, **reading)
    if decisions is not None:
        by_hand = decisions if isinstance(decisions, Decisions) else read_decisions(decisions)
        read = by_hand.applied(read)
    return with_columns(pipeline.filter_log(read, settings, model), settings, read)


def train(
    pairs: Sequence[tuple[Any, Any]], settings: TrainSettings | None = None, filtering: FilterSettings | None = None
) -> Model:
    """A correction learnt from (log, truth) pairs: records, files or tables; truth None: the smoother is the teacher.

    filtering: the settings of the filter that it is made for. Raises InputError, UsageError.
    """
    from ftproc.correction import feature_sets
    from ftproc.correction.training.flights import train_flights

    settings = settings or TrainSettings()
    signal = feature_sets.hears(settings.features)
    read = [
        (
            log if isinstance(log, MeasurementLog) else read_log(log, signal=signal),
            None if truth is None else _truth(truth),
        )
        for log, truth in pairs
    ]
    return train_flights(read, settings, filtering)


def simulate(scenario: str, **options: Any) -> Simulation:
    """A simulated flight: its `log` and its `truth`. Options as in `ftproc.simulation.simulate`."""
    from ftproc import simulation

    return simulation.simulate(scenario, **options)


def score(trajectory: Any, truth: Any = None) -> Score:
    """The smoothness of a trajectory, and its errors against a truth (records or files); `.as_dict()` has the figures.
    Raises InputError."""
    from ftproc import scoring

    return scoring.score(_trajectory(trajectory), None if truth is None else _truth(truth))


def write_report(trajectory: Any, target: str | Path, truth: Any = None) -> None:
    """Write a page that shows a trajectory, and with a truth its errors (records or files): HTML, or a PDF by its name.

    A trajectory from `filter_log` is shown with its raw readings. Raises InputError, OutputError, UsageError (no
    plotly; no browser for a PDF).
    """
    from ftproc import report

    report.write(_trajectory(trajectory), target, None if truth is None else _truth(truth))


def plot(trajectory: Any, what: str = "track") -> go.Figure:
    """One figure of the report, for a notebook (a trajectory or its file).

    what: track, ground, readings, residuals, nis, sigmas, motion or correction. Raises UsageError for another name,
    when plotly is missing, or when there is nothing to draw.
    """
    from ftproc import report

    return report.plot(_trajectory(trajectory), what)


def to_table(trajectory: Trajectory) -> pa.Table:
    """The trajectory as a pyarrow Table, with the columns and the metadata of its Parquet file."""
    from ftproc.files.writing import trajectories

    return trajectories.to_table(trajectory)


def to_pandas(trajectory: Trajectory) -> pd.DataFrame:
    """The trajectory as a pandas DataFrame, with the columns of its file."""
    frame: pd.DataFrame = to_table(trajectory).to_pandas()
    return frame


def _as_html(trajectory: Trajectory) -> str:
    from ftproc.report import notebook

    return notebook.as_html(trajectory)


VIEWS |= {"to_pandas": to_pandas, "to_table": to_table, "_repr_html_": _as_html}


def _recipe(config: str | Path | None) -> Recipe:
    return Recipe() if config is None else Recipe.of(load(config))


def _truth(source: Any) -> Truth:
    from ftproc.files.reading import truth

    return source if isinstance(source, Truth) else truth.read(source)


def _trajectory(source: Any) -> Trajectory:
    from ftproc.files.reading import trajectories

    return source if isinstance(source, Trajectory) else trajectories.read(source)
