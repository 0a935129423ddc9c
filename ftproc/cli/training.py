"""The work of `ftproc train`: flights with truth, then a model with its card, or the study of first weights."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import click
import numpy as np

from ftproc import api
from ftproc.cli import process
from ftproc.cli.progress import Progress
from ftproc.config.reading import load
from ftproc.config.recipe import Recipe
from ftproc.core import compiled
from ftproc.correction import feature_sets, model, model_file
from ftproc.correction.training import stages, study
from ftproc.correction.training.flights import filtered_flights, train_flights
from ftproc.correction.training.initial_weights import GENETIC
from ftproc.errors import UsageError
from ftproc.files.reading import truth as truth_files
from ftproc.files.writing import atomic, outputs
from ftproc.files.writing.outputs import Output
from ftproc.records import MeasurementLog, Truth
from ftproc.settings import EPOCHS, FilterSettings, Noise, TrainSettings
from ftproc.simulation import simulate


class Request(NamedTuple):
    """The options of `train`, by their names on the command line."""

    logs: Sequence[str]
    truths: Sequence[str]
    config: str | None
    site: tuple[float, float, float] | None
    scenario: str | None
    output: str | None
    compare_starts: bool
    features: str
    hidden: int | None
    population: int
    generations: int
    optimiser: str
    epochs: int | None
    flights: int
    seed: int
    method: str
    editing: str
    noise: Noise | None
    jerk: float | None
    units: str | None
    columns: str | None
    jobs: int

    @property
    def settings(self) -> TrainSettings:
        return TrainSettings(
            features=self.features, hidden=self.hidden, population=self.population, generations=self.generations,
            epochs=EPOCHS[self.optimiser] if self.epochs is None else self.epochs, optimiser=self.optimiser,
            flights=len(self.logs) or self.flights, seed=self.seed, method=self.method,
            start=TrainSettings.start if self.scenario is None else GENETIC,
        )  # fmt: skip

    @property
    def filtering(self) -> FilterSettings:
        return FilterSettings(
            method=self.method, editing=self.editing, noise=self.noise, jerk_psd_m2ps5=self.jerk
        )  # fmt: skip


def run(request: Request) -> None:
    """Train and print the model's card, or compare first weights and print the result. Raises FtprocError."""
    output, settings = request.output, request.settings
    if output == "-":
        raise UsageError("-o -: a model is not written to standard output; name a file.")
    if settings.features not in (choices := stages.feature_choices()):
        raise UsageError(f"there is no feature set {settings.features!r}; choose one of {', '.join(choices)}")
    inputs = [*request.logs, *request.truths, *([request.config] if request.config else [])]
    outputs.check([Output(output)] if output is not None else [], inputs)
    with Progress() as progress, compiled.announced(lambda text: click.echo(f"ftproc: {text}", err=True)):
        pairs = _read(request) if request.scenario is None else _simulated(request.scenario, settings, progress)
        if output is None:  # --compare-starts
            flights = filtered_flights(pairs, request.filtering, progress)
            text = study.compare(flights["filter"], settings, progress, request.jobs).text()
        else:
            trained = train_flights(pairs, settings, request.filtering, progress, request.jobs)
            with atomic.guarding(inputs):
                model_file.save(trained, output)
            text = model.card(model_file.load(output))  # of the file, as a reader gets it
    try:
        click.echo(text)
    except OSError as error:
        raise process.unsaid(error, [] if output is None else [output], "model's card") from error


def _read(request: Request) -> list[tuple[MeasurementLog, Truth | None]]:
    """The logs with their truths, or with None where none are given."""
    stated = {name: text for name in ("units", "columns") if (text := getattr(request, name)) is not None}
    signal = feature_sets.hears(request.features)
    logs = [api.read_log(log, config=request.config, signal=signal, **stated) for log in request.logs]
    site = request.site or (Recipe.of(load(request.config)).settings.site if request.config else None)
    truths: list[Truth | None] = [None] * len(logs)
    for k, (name, log) in enumerate(zip(request.truths, logs, strict=False)):
        frame = None if site is None else truth_files.Frame(site, log.frame == "north-east-up")
        truths[k] = truth_files.read(name, frame)
    return list(zip(logs, truths, strict=True))


def _simulated(scenario: str, settings: TrainSettings, progress: Progress) -> list[tuple[MeasurementLog, Truth | None]]:
    """Flights whose seeds are not small, so that those of `ftproc simulate` stay fit for testing."""
    seeds = np.random.SeedSequence(settings.seed).generate_state(settings.flights, np.uint64)
    pairs: list[tuple[MeasurementLog, Truth | None]] = []
    for number, seed in enumerate(seeds):
        progress("simulating", number, len(seeds))
        flight = simulate(scenario, seed=int(seed))
        pairs.append((flight.log, flight.truth))
    return pairs
