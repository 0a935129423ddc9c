"""`ftproc train`: a correction model from past flights, with truth or without."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import click

from ftproc.cli import options
from ftproc.cli.command import Command, refuse_with, stated
from ftproc.settings import EPOCHS, PACKAGED, TrainSettings

_EXAMPLES = """
ftproc train --scenario radar --flights 4 --population 10 --generations 5 --epochs 30 -o radar.safetensors
ftproc train --show radar.safetensors
"""


def _number(name: str, least: int, default: int, text: str) -> Callable[[options.F], options.F]:
    kind = click.IntRange(min=least)
    return click.option(f"--{name}", type=kind, default=default, metavar="N", help=text)


@click.command(cls=Command, short_help="A correction model from past flights.", examples=_EXAMPLES)
@click.option(
    "--log", "logs", multiple=True, type=options.FILE, metavar="LOG", help="A log to train on, once for each."
)
@options.truth("The truth of the --log at the same position. Without any, the smoother is the teacher of the filter.")
@click.option("--config", type=options.FILE, metavar="FILE", help="The station file of the logs.")
@click.option(
    "--site",
    type=options.site,
    metavar="LAT,LON,HEIGHT",
    help="The station's position, for a truth in latitude, longitude and height. [default: that of --config]",
)
@options.scenario(False, "Train on simulated flights instead; the names are in `ftproc simulate -h`.")
@_number("flights", 1, TrainSettings.flights, "Number of simulated flights.")
@options.output("The model file to write (safetensors).", "MODEL")
@options.seed("Seed of the network, the search and the simulated flights")
@click.option(
    "--features",
    metavar="NAME",
    default=TrainSettings.features,
    help="Input of the network: motion (what the target does: corrects the lag of the filter in manoeuvres, where the "
    "smoother of the same flight proves it), window (the last innovations: corrects a wrong noise or jerk PSD, of any "
    "tracker), instrument (the target's position: corrects the repeatable errors of one tracker, which smoothing "
    "leaves), mount (position and motion: servo lag, circles and range walk too), echo (that and the strength of the "
    "signal, in dB), correction (as in Zuo et al. 2021), or auto: of the first three the best one on held-out flights.",
)
@click.option(
    "--hidden",
    type=click.IntRange(min=1),
    metavar="N",
    help="Hidden units of the network. [default: 64 (motion) or 12]",
)
@_number("population", 2, TrainSettings.population, "Individuals in the genetic search for the first weights.")
@_number("generations", 0, TrainSettings.generations, "Generations of the genetic search.")
@click.option(
    "--optimiser",
    type=click.Choice(list(EPOCHS)),
    default=TrainSettings.optimiser,
    help="Back-propagation by L-BFGS, or by gradient descent with momentum, as Zuo et al. 2021 train.",
)
@click.option(
    "--epochs",
    type=click.IntRange(min=0),
    metavar="N",
    help="Most epochs of back-propagation; it stops when held-out samples no longer improve. "
    f"[default: {' or '.join(f'{epochs} ({name})' for name, epochs in EPOCHS.items())}]",
)
@click.option(
    "--method",
    metavar="NAME",
    default=TrainSettings.method,
    help="The filter to correct; bpnn-ekf is trained from random first weights, without the genetic search.",
)
@options.tuned
@options.units("Units of the logs' columns whose names state none, such as range=km. [default: s, m, rad]")
@click.option("--columns", metavar="NAME=COLUMN,...", help="Names of columns of the logs, such as time=T0,range=RNG.")
@_number("jobs", 1, 1, "Worker processes; the model is bit for bit the same for any number.")
@click.option("--show", type=options.FILE, metavar="MODEL", help="Print the card of a model file, or of packaged.")
@click.option(
    "--compare-starts",
    is_flag=True,
    help="Compare the genetic search with random first weights at equal cost, and write no model.",
)
def command(show: str | None, **options: Any) -> None:
    """Train the network that corrects the filter, from past logs, with truth or without, or simulated flights.

    Prints the model's card: its effect on flights that it was not trained on, which may be none. Filter with the same
    --editing, --noise and --jerk as here.
    """
    ctx = click.get_current_context()
    if show is not None:
        from ftproc.correction import model, model_file

        found = model_file.named(PACKAGED) if show == PACKAGED else model_file.load(show)
        assert found is not None
        click.echo(model.card(found))
        return
    _check(options)
    _refuse_idle(ctx)
    from ftproc.cli import training

    training.run(training.Request(**options))


def _refuse_idle(ctx: click.Context) -> None:
    """Raises UsageError for options on the command line that have no effect."""
    from ftproc.methods import registry
    from ftproc.settings import FilterSettings

    simulated = ctx.params["scenario"] is not None
    refuse_with(ctx, *(("--scenario", ("units", "columns")) if simulated else ("--log", ("flights",))))
    method = registry.named(ctx.params["method"])
    asked = ["--editing"] if "editing" in stated(ctx) else []
    registry.refuse_idle(asked, [method], FilterSettings(editing=ctx.params["editing"]))
    if method.own_model:
        refuse_with(ctx, f"{method.name}, which starts from random weights", ("population", "generations"))


def _check(options: Mapping[str, Any]) -> None:
    """Raises UsageError for options that exclude each other."""
    logs, truths, simulated = len(options["logs"]), len(options["truths"]), options["scenario"] is not None
    comparing = options["compare_starts"]
    if options["output"] is None and not comparing:
        why = "-o MODEL is missing: name the model file to write."
    elif options["output"] is not None and comparing:
        why = "--compare-starts writes no model; leave out -o."
    elif simulated == bool(logs or truths):
        why = "Learn either from --log LOG [--truth TRUTH] or from --scenario NAME."
    elif simulated and options["config"] is not None:
        why = "--config says how to read a --log; --scenario has none."
    elif truths and logs != truths:
        why = f"--log is given {logs} times and --truth {truths} times; give them in pairs, or no --truth."
    else:
        return
    raise click.UsageError(why, click.get_current_context())
