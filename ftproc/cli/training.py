"""The work of `ftproc train`: flights with truth, then a model with its card, or the study of first weights."""

from __future__ import annotations

from collections.abc import Sequence

import click
import numpy as np

from ftproc import api
from ftproc.cli.progress import Progress
from ftproc.core import compiled
from ftproc.correction import model, model_file
from ftproc.correction.training import stages, study
from ftproc.correction.training.flights import filtered_flights, train_flights
from ftproc.errors import UsageError
from ftproc.files.reading import truth as truth_files
from ftproc.files.writing import atomic
from ftproc.records import MeasurementLog, Truth
from ftproc.settings import FilterSettings, Noise, TrainSettings
from ftproc.simulation import simulate


def run(
    *,
    logs: Sequence[str],
    truths: Sequence[str],
    config: str | None,
    scenario: str | None,
    output: str | None,
    compare_starts: bool,
    features: str,
    hidden: int,
    population: int,
    generations: int,
    epochs: int,
    flights: int,
    seed: int,
    method: str,
    editing: str,
    noise: Noise | None,
    jerk: float | None,
    units: str | None,
    columns: str | None,
    jobs: int,
) -> None:
    """Train, or compare, and print what came of it. Raises FtprocError."""
    if output == "-":
        raise UsageError("-o -: a model is not written to standard output; name a file.")
    if features not in stages.known():
        raise UsageError(f"there is no feature set {features!r}; choose one of {', '.join(stages.known())}")
    if output is not None:
        atomic.refuse_overwriting(output, [*logs, *truths, *([config] if config else [])])
        atomic.check_target(output)
    settings = TrainSettings(features, hidden, population, generations, epochs, len(logs) or flights, seed, method)
    filtering = FilterSettings(method=method, editing=editing, noise=noise, jerk_psd_m2ps5=jerk)
    with Progress() as progress, compiled.announced(lambda text: click.echo(f"ftproc: {text}", err=True)):
        pairs = (
            _read(logs, truths, config, units, columns)
            if scenario is None
            else _simulated(scenario, settings, progress)
        )
        if compare_starts:
            known = filtered_flights(pairs, filtering, progress)
            text = study.compare(known["filter"], settings, progress, jobs).text()
        else:
            trained = train_flights(pairs, settings, filtering, progress, jobs)
    if output is not None:
        model_file.save(trained, output)
        text = model.card(model_file.load(output))  # as whoever uses the file will see it
    click.echo(text)


def _read(
    logs: Sequence[str], truths: Sequence[str], config: str | None, units: str | None, columns: str | None
) -> list[tuple[MeasurementLog, Truth]]:
    said = {name: value for name, value in (("units", units), ("columns", columns)) if value is not None}
    return [
        (api.read_log(log, config=config, **said), truth_files.read(truth))
        for log, truth in zip(logs, truths, strict=True)
    ]


def _simulated(scenario: str, settings: TrainSettings, progress: Progress) -> list[tuple[MeasurementLog, Truth]]:
    """Flights that no small seed of `ftproc simulate` makes, so that those stay fit for testing."""
    seeds = np.random.SeedSequence(settings.seed).generate_state(settings.flights, np.uint64)
    pairs = []
    for number, seed in enumerate(seeds):
        progress("simulating", number, len(seeds))
        flight = simulate(scenario, seed=int(seed))
        pairs.append((flight.log, flight.truth))
    return pairs
