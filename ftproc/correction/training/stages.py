"""Which network for which stage: candidates are trained, held-out flights choose. In any number of workers, with the
same result to the last bit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace

from ftproc.correction.feature_sets import FEATURES, named
from ftproc.correction.model import FILTER, SMOOTHER, Model, Stage
from ftproc.correction.training.parallel import each
from ftproc.correction.training.samples import Flight
from ftproc.correction.training.train import Progress, train
from ftproc.settings import TrainSettings

AUTO = "auto"
CANDIDATES = {FILTER: ("window", "instrument"), SMOOTHER: ("instrument",)}


def train_model(
    flights: Mapping[str, Sequence[Flight]],
    settings: TrainSettings,
    progress: Progress | None = None,
    jobs: int = 1,
) -> Model:
    """A model from the flights of each stage (`filter`, `smoother`); of the smoother only what has a gain is kept.

    Raises InputError when there is too little data, UsageError for a wrong choice in the settings.
    """
    tasks = [
        (flights[stage], replace(settings, features=name)) for stage in flights for name in _wanted(stage, settings)
    ]
    done = each(train, tasks, jobs, progress)
    stages: dict[str, Stage] = {}
    for stage in flights:
        count = len(_wanted(stage, settings))
        trained, done = done[:count], done[count:]
        best = min(trained, key=_merit, default=None)
        if best is not None and (stage == FILTER or best.helps):
            stages[stage] = best
    return Model(stages, asdict(settings))


def _wanted(stage: str, settings: TrainSettings) -> tuple[str, ...]:
    if settings.features == AUTO:
        return CANDIDATES[stage]
    serves = stage == FILTER or named(settings.features).smoothed
    return (settings.features,) if serves else ()


def _merit(stage: Stage) -> float:
    """What the correction certainly leaves of the position error on validation data; 1 when it does nothing."""
    ratio = None if stage.verdict is None else stage.verdict.validated
    return ratio.high if stage.helps and ratio is not None else 1.0


def known() -> tuple[str, ...]:
    """The names that the settings' `features` may have."""
    return (AUTO, *FEATURES)
