"""The Python face: the five things the command line does, on pandas DataFrames, pyarrow Tables or files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ftproc import pipeline
from ftproc.records import MeasurementLog, Trajectory, Truth
from ftproc.settings import FilterSettings, TrainSettings

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

    from ftproc.correction.model import Model
    from ftproc.scoring import Score
    from ftproc.simulation import Simulation


def read_log(source: Any, **options: Any) -> MeasurementLog:
    """A log from a file (.csv, .csv.gz, .parquet), a pandas DataFrame or a pyarrow Table.

    options: units, columns, azimuth_from, keep_columns; see `ftproc.files.logs.read`. Raises InputError.
    """
    from ftproc.files import logs

    return logs.read(source, **options)


def filter_log(
    log: Any, settings: FilterSettings | None = None, *, model: Model | str | None = "packaged"
) -> Trajectory:
    """The trajectory of a log (a MeasurementLog, or anything `read_log` takes).

    model: the packaged correction, another one, or None for none. Raises InputError, UsageError.
    """
    chosen = pipeline.default_model() if isinstance(model, str) else model
    return pipeline.filter_log(log if isinstance(log, MeasurementLog) else read_log(log), settings, chosen)


def train(
    pairs: Sequence[tuple[Any, Any]], settings: TrainSettings | None = None, filtering: FilterSettings | None = None
) -> Model:
    """A correction learnt from (log, truth) pairs: records, files or tables.

    filtering: the settings of the filter that it is made for. Raises InputError, UsageError.
    """
    from ftproc.files import truth as truths

    read = [
        (
            log if isinstance(log, MeasurementLog) else read_log(log),
            truth if isinstance(truth, Truth) else truths.read(truth),
        )
        for log, truth in pairs
    ]
    return pipeline.train_flights(read, settings or TrainSettings(), filtering=filtering)


def simulate(scenario: str, **options: Any) -> Simulation:
    """A simulated flight: its `log` and its `truth`. Options as in `ftproc.simulation.simulate`."""
    from ftproc import simulation

    return simulation.simulate(scenario, **options)


def score(trajectory: Any, truth: Any = None) -> Score:
    """How good a trajectory is, by itself and against a truth (records or files). `.as_dict()` gives the figures."""
    from ftproc import scoring
    from ftproc.files import trajectories
    from ftproc.files import truth as truths

    found = trajectory if isinstance(trajectory, Trajectory) else trajectories.read(trajectory)
    known = truth if truth is None or isinstance(truth, Truth) else truths.read(truth)
    return scoring.score(found, known)


def to_table(trajectory: Trajectory) -> pa.Table:
    """The trajectory as a pyarrow Table, with the columns and the metadata of its Parquet file."""
    from ftproc.files import trajectories

    return trajectories.to_table(trajectory)


def to_pandas(trajectory: Trajectory) -> pd.DataFrame:
    """The trajectory as a pandas DataFrame, with the columns of its file."""
    frame: pd.DataFrame = to_table(trajectory).to_pandas()
    return frame
