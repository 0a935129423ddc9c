"""The networks of all stages: candidates are trained, in any number of processes with the same result to the last bit,
and held-out flights choose among them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace

from ftproc.correction.feature_sets import FEATURES, named
from ftproc.correction.model import FILTER, SMOOTHER, Model, Stage
from ftproc.correction.training import Progress, silent
from ftproc.correction.training.initial_weights import GENETIC, PACKAGED
from ftproc.correction.training.parallel import each
from ftproc.correction.training.samples import Flight
from ftproc.correction.training.train import known_network, train
from ftproc.errors import UsageError
from ftproc.settings import TrainSettings

AUTO = "auto"
CANDIDATES = {FILTER: ("window", "motion", "instrument"), SMOOTHER: ("instrument",)}


def train_model(
    flights: Mapping[str, Sequence[Flight]], settings: TrainSettings, progress: Progress = silent, jobs: int = 1
) -> Model:
    """A model from the flights of each stage (`filter`, `smoother`); a smoother's network without a gain is left out.

    Raises InputError when there is too little data, UsageError for a wrong choice in the settings.
    """
    wanted = [(stage, name) for stage in flights for name in _candidates(stage, flights[stage], settings)]
    tasks = [(flights[stage], replace(settings, features=name)) for stage, name in wanted]
    trained = each(train, tasks, jobs, progress)
    stages: dict[str, Stage] = {}
    for (stage, _), candidate in zip(wanted, trained, strict=True):
        if stage not in stages or _remaining_error(candidate) < _remaining_error(stages[stage]):
            stages[stage] = candidate
    kept = {name: AUTO if value is None else value for name, value in asdict(settings).items()}
    if settings.start == PACKAGED and known_network(stages[FILTER].features, settings) is None:
        kept["start"] = GENETIC
    return Model({k: v for k, v in stages.items() if k == FILTER or v.helps}, kept)


def _candidates(stage: str, flights: Sequence[Flight], settings: TrainSettings) -> tuple[str, ...]:
    """Names of the feature sets to try. Raises UsageError for one that these flights cannot prove."""
    provable = all(flight.smoothed is not None for flight in flights)
    if settings.features == AUTO:
        return tuple(name for name in CANDIDATES[stage] if provable or not named(name).proven)
    features = named(settings.features)
    if features.heard and any(flight.signal_db is None for flight in flights):
        raise UsageError(
            f"the feature set {features.name!r} needs the strength of the signal in dB, in a column of every log: its "
            "name says so (snr_db), or --columns signal=NAME --units signal=dB"
        )
    if stage == FILTER and features.proven and not provable:
        raise UsageError(
            f"the feature set {features.name!r} needs ga-bpnn-ukf with --editing two-pass, whose smoother proves it"
        )
    return (settings.features,) if stage == FILTER or features.smoothed else ()


def _remaining_error(stage: Stage) -> float:
    """Upper bound of the position error ratio on validation data; 1 for a network without a gain."""
    ratio = None if stage.verdict is None else stage.verdict.validated
    return ratio.high if stage.helps and ratio is not None else 1.0


def feature_choices() -> tuple[str, ...]:
    """The values of the settings' `features`."""
    return (AUTO, *FEATURES)
