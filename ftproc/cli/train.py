"""`ftproc train`: a correction model from flights whose truth is known."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from ftproc.cli import options
from ftproc.cli.command import Command
from ftproc.settings import TrainSettings

_EXAMPLES = """
ftproc train --scenario radar --flights 4 --population 10 --generations 5 --epochs 30 -o radar.safetensors
ftproc train --show radar.safetensors
"""


def _number(name: str, least: int, default: int, text: str) -> Callable[[options.F], options.F]:
    kind = click.IntRange(min=least)
    return click.option(f"--{name}", type=kind, default=default, metavar="N", help=text)


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
@_number("flights", 1, TrainSettings.flights, "How many flights to simulate.")
@options.output("The model file to write (safetensors).", "MODEL")
@options.seed("Another network, search and set of simulated flights for each")
@click.option(
    "--features",
    metavar="NAME",
    default=TrainSettings.features,
    help="What the network sees: window (the last innovations: what a wrong noise or jerk level does, for any "
    "tracker), instrument (where the target is: one tracker's own repeatable errors, which smoothing leaves), "
    "correction (as in Zuo et al. 2021), or auto: whichever of the former two held-out flights prefer.",
)
@_number("hidden", 1, TrainSettings.hidden, "Hidden units of the network.")
@_number("population", 2, TrainSettings.population, "Individuals in the genetic search for the first weights.")
@_number("generations", 0, TrainSettings.generations, "Generations of the genetic search.")
@_number(
    "epochs",
    0,
    TrainSettings.epochs,
    "Epochs of back-propagation at most; it stops when held-out samples no longer gain.",
)
@click.option(
    "--method",
    metavar="NAME",
    default=TrainSettings.method,
    help="The filter whose error is learnt; bpnn-ekf is trained from random first weights, without the genetic search.",
)
@options.tuned
@options.units("Units of the logs' columns whose names state none, such as range=km. [default: s, m, rad]")
@click.option("--columns", metavar="NAME=COLUMN,...", help="Names of columns of the logs, such as time=T0,range=RNG.")
@_number("jobs", 1, 1, "Worker processes; the model is the same, to the last bit, for any number.")
@click.option("--show", type=options.FILE, metavar="MODEL", help="Print the card of a model file, and train nothing.")
@click.option(
    "--compare-starts",
    is_flag=True,
    help="Print what the genetic search is worth against random first weights at equal cost, and train nothing.",
)
def command(show: str | None, **given: Any) -> None:
    """Teach the network what the filter gets wrong, from logs with truth or simulated flights.

    The model's card is printed: what it brings on flights it has not seen, which may be nothing. Filter with the
    same --editing, --noise and --jerk as here.
    """
    if show is not None:
        from ftproc.correction import model, model_file

        click.echo(model.card(model_file.load(show)))
        return
    _check(**given)
    from ftproc.cli import training

    training.run(**given)


def _check(
    logs: tuple[str, ...], truths: tuple[str, ...], config: str | None, scenario: str | None, output: str | None,
    compare_starts: bool, **_: Any,
) -> None:  # fmt: skip
    context = click.get_current_context()
    if output is None and not compare_starts:
        raise click.UsageError("-o MODEL is missing: where shall the model go?", context)
    if output is not None and compare_starts:
        raise click.UsageError("--compare-starts writes no model; leave out -o.", context)
    if (scenario is None) == (not logs and not truths):
        raise click.UsageError("Learn either from --log LOG --truth TRUTH pairs or from --scenario NAME.", context)
    if config is not None and scenario is not None:
        raise click.UsageError("--config tells how to read a --log; --scenario has none.", context)
    if len(logs) != len(truths):
        raise click.UsageError(
            f"--log is given {len(logs)} times and --truth {len(truths)} times; give them in pairs.", context
        )
