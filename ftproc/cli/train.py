"""`ftproc train`: a correction model from flights whose truth is known."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import click

from ftproc.cli import options
from ftproc.cli.command import Command
from ftproc.settings import TrainSettings

if TYPE_CHECKING:
    from ftproc.records import MeasurementLog, Truth

_EXAMPLES = """
ftproc train --scenario radar --flights 4 --population 10 --generations 5 --epochs 30 -o radar.safetensors
ftproc train --show radar.safetensors
"""


@click.command(cls=Command, short_help="A correction model from flights with truth.", examples=_EXAMPLES)
@click.option(
    "--log",
    "logs",
    multiple=True,
    type=options.FILE,
    metavar="LOG",
    help="A log to learn from; give --log and --truth in pairs.",
)
@click.option(
    "--truth",
    "truths",
    multiple=True,
    type=options.FILE,
    metavar="TRUTH",
    help="The truth of the --log at the same place.",
)
@click.option("--config", type=options.FILE, metavar="FILE", help="The station file that tells how to read the logs.")
@options.scenario(False, "Learn from simulated flights instead; the names are in `ftproc simulate -h`.")
@click.option(
    "--flights",
    type=click.IntRange(min=1),
    default=TrainSettings.flights,
    metavar="N",
    help="How many flights to simulate.",
)
@click.option("-o", "--output", type=options.FILE, metavar="MODEL", help="The model file to write (safetensors).")
@options.seed("Another network, search and set of simulated flights for each")
@click.option(
    "--features",
    metavar="NAME",
    default=TrainSettings.features,
    help="What the network sees: window (normalised innovations and geometry; serves any tracker), instrument (also "
    "the azimuth, for one tracker's own errors) or correction (as in Zuo et al. 2021).",
)
@click.option(
    "--hidden",
    type=click.IntRange(min=1),
    default=TrainSettings.hidden,
    metavar="N",
    help="Hidden units of the network.",
)
@click.option(
    "--population",
    type=click.IntRange(min=2),
    default=TrainSettings.population,
    metavar="N",
    help="Individuals in the genetic search for the first weights.",
)
@click.option(
    "--generations",
    type=click.IntRange(min=0),
    default=TrainSettings.generations,
    metavar="N",
    help="Generations of the genetic search.",
)
@click.option(
    "--epochs",
    type=click.IntRange(min=0),
    default=TrainSettings.epochs,
    metavar="N",
    help="Epochs of back-propagation at most; it stops when held-out samples no longer gain.",
)
@click.option(
    "--method",
    metavar="NAME",
    default=TrainSettings.method,
    help="The filter whose error is learnt; bpnn-ekf is trained from random first weights, without the genetic search.",
)
@click.option("--show", type=options.FILE, metavar="MODEL", help="Print the card of a model file, and train nothing.")
def command(
    logs: tuple[str, ...],
    truths: tuple[str, ...],
    config: str | None,
    scenario: str | None,
    flights: int,
    output: str | None,
    seed: int,
    features: str,
    hidden: int,
    population: int,
    generations: int,
    epochs: int,
    method: str,
    show: str | None,
) -> None:
    """Teach the network what the filter gets wrong, from logs with truth or simulated flights.

    The model's card is printed: what it brings on flights it has not seen, which may be nothing.
    """
    if show is not None:
        from ftproc.correction import model

        click.echo(model.card(model.load(show)))
        return
    _check(logs, truths, config, scenario, output)
    settings = TrainSettings(features, hidden, population, generations, epochs, len(logs) or flights, seed, method)
    _train(logs, truths, config, scenario, str(output), settings)


def _check(
    logs: tuple[str, ...], truths: tuple[str, ...], config: str | None, scenario: str | None, output: str | None
) -> None:
    if output is None:
        raise click.UsageError("-o MODEL is missing: where shall the model go?", click.get_current_context())
    if (scenario is None) == (not logs and not truths):
        raise click.UsageError(
            "Learn either from --log LOG --truth TRUTH pairs or from --scenario NAME.", click.get_current_context()
        )
    if config is not None and scenario is not None:
        raise click.UsageError("--config tells how to read a --log; --scenario has none.", click.get_current_context())
    if len(logs) != len(truths):
        raise click.UsageError(
            f"--log is given {len(logs)} times and --truth {len(truths)} times; give them in pairs.",
            click.get_current_context(),
        )


def _train(
    logs: tuple[str, ...],
    truths: tuple[str, ...],
    config: str | None,
    scenario: str | None,
    output: str,
    settings: TrainSettings,
) -> None:
    from ftproc import warm
    from ftproc.cli.progress import Progress
    from ftproc.correction import model
    from ftproc.errors import UsageError
    from ftproc.files import atomic
    from ftproc.pipeline import train_flights

    if output == "-":
        raise UsageError("-o -: a model is not written to standard output; name a file.")
    atomic.refuse_overwriting(output, [*logs, *truths, *([config] if config else [])])
    atomic.check_target(output)
    with Progress() as progress, warm.announced(lambda text: click.echo(f"ftproc: {text}", err=True)):
        pairs = _read(logs, truths, config) if scenario is None else _simulated(scenario, settings, progress)
        trained = train_flights(pairs, settings, progress)
    model.save(trained, output)
    click.echo(model.card(model.load(output)))  # as whoever uses the file will see it


def _read(logs: tuple[str, ...], truths: tuple[str, ...], config: str | None) -> list[tuple[MeasurementLog, Truth]]:
    from ftproc import api
    from ftproc.files import truth as truth_files

    return [
        (api.read_log(log, config=config), truth_files.read(truth)) for log, truth in zip(logs, truths, strict=True)
    ]


def _simulated(
    scenario: str, settings: TrainSettings, progress: Callable[[str, int, int], None]
) -> list[tuple[MeasurementLog, Truth]]:
    """Flights that no small seed of `ftproc simulate` makes, so that those stay fit for testing."""
    import numpy as np

    from ftproc.simulation import simulate

    seeds = np.random.SeedSequence(settings.seed).generate_state(settings.flights, np.uint64)
    pairs = []
    for number, seed in enumerate(seeds):
        progress("simulating", number, len(seeds))
        flight = simulate(scenario, seed=int(seed))
        pairs.append((flight.log, flight.truth))
    return pairs
