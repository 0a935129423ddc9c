"""`ftproc simulate`: the log of a simulated flight, with outliers, and its truth."""

from __future__ import annotations

from typing import Any

import click

from ftproc.cli import options
from ftproc.cli.command import Command, refuse_with
from ftproc.errors import UsageError

_EXAMPLES = """
ftproc simulate --scenario zuo2021-outliers --seed 3 -o flight.csv --truth flight.truth.csv
ftproc simulate --scenario manoeuvre --duration 30 --outliers isolated=0.05:8-100,range.offset=1:20:60m -o hard.parquet
ftproc simulate --scenario range --seed 3 -o flight/ --truth flight/truth.parquet
"""
#: Options that a flight for several stations does not take.
_OF_ONE_LOG = ("dt_s", "noise", "outliers", "instrument_errors", "units", "azimuth_from")


def _scenarios_and_grammar() -> str:
    from ftproc.simulation import GRAMMAR, INSTRUMENT_GRAMMAR, RANGE_SCENARIOS, list_scenarios

    scenarios = list_scenarios()
    width = max(map(len, scenarios))
    scenarios = {**scenarios, **RANGE_SCENARIOS}
    names = "".join(f"  {name.ljust(width)}  {text}\n" for name, text in scenarios.items())
    instrument = f"Errors of the instrument (--instrument):\n{INSTRUMENT_GRAMMAR}"
    return f"Scenarios:\n{names}\nOutliers (--outliers):\n{GRAMMAR}\n{instrument}"


@click.command(cls=Command, examples=_EXAMPLES, more=_scenarios_and_grammar)
@options.scenario(True, "Which flight, sampling, noise and outliers; the names are below.")
@options.seed("Seed of the flight, noise and outliers")
@click.option(
    "--duration",
    "duration_s",
    type=options.number,
    metavar="S",
    help="Length of the record in s, such as 60. [default: scenario's]",
)
@click.option(
    "--dt",
    "dt_s",
    type=options.number,
    metavar="S",
    help="Sample interval in s, such as 0.05 for 20 Hz. [default: scenario's]",
)
@options.noise(options.noise_sigmas, None, ". [default: scenario's]")
@click.option(
    "--outliers", metavar="SPEC", help="Outliers and gaps of the log, or none; see below. [default: scenario's]"
)
@click.option(
    "--instrument",
    "--instrument-errors",
    "instrument_errors",
    metavar="SPEC",
    help="Errors of the instrument beside white noise, such as mislevel_mrad=0.6,stamp_jitter_s=0.005, or none; see "
    "below. [default: scenario's]",
)
@options.units("Units to write, such as range=km,azimuth=deg; they show in the column names. [default: m, rad, s]")
@options.azimuth_from(
    default="x",
    text="north: azimuth in the survey convention, clockwise from north, from 0 to a full turn. The truth's x is then "
    "north, y east and z up.",
)
@options.output(
    "The log to write: .csv, .csv.gz, .parquet, .feather, or - for CSV on stdout; of several stations (range...) the "
    "directory for the range file and the logs.",
    "LOG",
    required=True,
)
@click.option("--truth", type=options.FILE, metavar="TRUTH", help="The truth to write: states and outlier flags.")
def command(
    scenario: str, output: str, truth: str | None, units: str | None, azimuth_from: str,
    instrument_errors: str | None, **changes: Any,
) -> None:  # fmt: skip
    """Make a log as dirty as a real one, with its truth."""
    from ftproc.files.options import parse_units
    from ftproc.files.writing import flights, ranges
    from ftproc.simulation import RANGE_SCENARIOS, parse_instrument, simulate, simulate_range

    if scenario in RANGE_SCENARIOS:
        refuse_with(click.get_current_context(), f"--scenario {scenario}", _OF_ONE_LOG)
        ranges.write(simulate_range(scenario, changes["seed"], changes["duration_s"]), output, truth)
        return
    _check(output, truth)
    parse_units(units)  # errors are reported before any work
    instrument = None if instrument_errors is None else parse_instrument(instrument_errors)
    flight = simulate(scenario, instrument=instrument, **changes)
    if truth is not None:  # first, so that both are there when the log is
        flights.write_truth(flight.truth, truth)
    flights.write_log(flight.log, output, units, azimuth_from)


def _check(output: str, truth: str | None) -> None:
    """Raises UsageError or OutputError when the two cannot both be written."""
    from ftproc.files.writing import outputs, tables

    named = [(output, "-o"), *([(truth, "--truth")] if truth is not None else [])]
    for target, _ in named:
        tables.kind_of(target)
    if output == truth == outputs.STREAM:
        raise UsageError("-o and --truth are both -; give the truth another name.")
    outputs.check([outputs.Output(*each) for each in named], [])
