"""The Python face: the five things the command line does, on pandas DataFrames, pyarrow Tables or files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ftproc import pipeline
from ftproc.config.reading import load
from ftproc.config.recipe import Recipe
from ftproc.correction import model_file
from ftproc.files.writing import geodesy
from ftproc.records import MeasurementLog, Trajectory, Truth
from ftproc.settings import PACKAGED, FilterSettings, TrainSettings

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
    import pyarrow as pa

    from ftproc.correction.model import Model
    from ftproc.scoring import Score
    from ftproc.simulation import Simulation


def read_log(source: Any, *, config: str | Path | None = None, **options: Any) -> MeasurementLog:
    """A log from a file (.csv, .csv.gz, .parquet, .feather), a pandas DataFrame or a pyarrow Table.

    config: what `--config` takes. options: units, columns, azimuth_from, keep_columns, station; they win over
    it; see `ftproc.files.reading.logs.read`. Raises InputError, UsageError.
    """
    from ftproc.files.reading import logs

    return logs.read(source, **{**_recipe(config).reading(), **options})


def filter_log(
    log: Any,
    settings: FilterSettings | None = None,
    *,
    model: Model | str | None = PACKAGED,
    config: str | Path | None = None,
) -> Trajectory:
    """The trajectory of a log (a MeasurementLog, or anything `read_log` takes).

    model: the packaged correction, another one (or its file), or None for none.
    config: what `--config` takes: how the log is read (one that was read already stays as it is), and the
    settings and the model where they are not given here. With a site in the settings the trajectory has its
    `lat_deg`, `lon_deg`, `height_m` too. Raises InputError, UsageError.
    """
    usual = _recipe(config)
    settings = settings or usual.settings
    if isinstance(model, str):
        model = model_file.named(usual.model if model == PACKAGED else model)
    read = log if isinstance(log, MeasurementLog) else read_log(log, config=config)
    return geodesy.located(pipeline.filter_log(read, settings, model), settings)


def _recipe(config: str | Path | None) -> Recipe:
    return Recipe() if config is None else Recipe.of(load(config))


def train(
    pairs: Sequence[tuple[Any, Any]], settings: TrainSettings | None = None, filtering: FilterSettings | None = None
) -> Model:
    """A correction learnt from (log, truth) pairs: records, files or tables.

    filtering: the settings of the filter that it is made for. Raises InputError, UsageError.
    """
    from ftproc.correction.training.flights import train_flights
    from ftproc.files.reading import truth as truths

    read = [
        (
            log if isinstance(log, MeasurementLog) else read_log(log),
            truth if isinstance(truth, Truth) else truths.read(truth),
        )
        for log, truth in pairs
    ]
    return train_flights(read, settings or TrainSettings(), filtering)


def simulate(scenario: str, **options: Any) -> Simulation:
    """A simulated flight: its `log` and its `truth`. Options as in `ftproc.simulation.simulate`."""
    from ftproc import simulation

    return simulation.simulate(scenario, **options)


def score(trajectory: Any, truth: Any = None) -> Score:
    """How good a trajectory is, by itself and against a truth (records or files). `.as_dict()` gives the figures."""
    from ftproc import scoring
    from ftproc.files.reading import trajectories
    from ftproc.files.reading import truth as truths

    found = trajectory if isinstance(trajectory, Trajectory) else trajectories.read(trajectory)
    known = truth if truth is None or isinstance(truth, Truth) else truths.read(truth)
    return scoring.score(found, known)


def write_report(trajectory: Any, target: str | Path, truth: Any = None) -> None:
    """Write an HTML page that shows a trajectory, and with a truth its errors (records or files).

    A trajectory from `filter_log` is shown with its raw readings. Raises OutputError, UsageError (no plotly).
    """
    from ftproc import report
    from ftproc.files.reading import trajectories
    from ftproc.files.reading import truth as truths

    found = trajectory if isinstance(trajectory, Trajectory) else trajectories.read(trajectory)
    report.write(found, target, truth if truth is None or isinstance(truth, Truth) else truths.read(truth))


def plot(trajectory: Any, what: str = "track") -> go.Figure:
    """One figure of the report, for a notebook (a trajectory or its file).

    what: track, ground, readings, residuals, nis, sigmas, motion or correction. Raises UsageError for another name,
    when plotly is missing, or when there is nothing to draw.
    """
    from ftproc import report
    from ftproc.files.reading import trajectories

    found = trajectory if isinstance(trajectory, Trajectory) else trajectories.read(trajectory)
    return report.plot(found, what)


def to_table(trajectory: Trajectory) -> pa.Table:
    """The trajectory as a pyarrow Table, with the columns and the metadata of its Parquet file."""
    from ftproc.files.writing import trajectories

    return trajectories.to_table(trajectory)


def to_pandas(trajectory: Trajectory) -> pd.DataFrame:
    """The trajectory as a pandas DataFrame, with the columns of its file."""
    frame: pd.DataFrame = to_table(trajectory).to_pandas()
    return frame
