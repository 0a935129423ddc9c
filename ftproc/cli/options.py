"""Each option that several commands share, and the kinds of value, once."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

import click

from ftproc.settings import FilterSettings

F = TypeVar("F", bound=Callable[..., Any])

AUTO = "auto"
_NOISE_FORM = "three numbers, R,A,E in m, rad, rad, such as 5,0.0002,0.0002"
_SITE_FORM = "three numbers, LAT,LON,HEIGHT in degrees, degrees and m, such as 48.0812,11.2803,612"


def number(text: Any) -> float:
    """A finite number above zero."""
    value = _finite(text)
    if value is None or value <= 0:
        raise click.BadParameter(f'"{text}" is not a number above zero.')
    return value


def number_or_auto(text: Any) -> float | None:
    """`auto` is None: find it from the log."""
    return None if _is_auto(text) else number(text)


def noise_sigmas(text: Any) -> tuple[float, float, float]:
    """1-sigma of range m, azimuth rad, elevation rad; zero or more."""
    values = _triple(text)
    if values is None or min(values) < 0:
        raise click.BadParameter(f'"{text}" is not {_NOISE_FORM}.')
    return values


def noise_or_auto(text: Any) -> tuple[float, float, float] | None:
    """The same above zero, or `auto`."""
    if _is_auto(text):
        return None
    values = noise_sigmas(text)
    if min(values) <= 0:
        raise click.BadParameter(f'"{text}": a sigma of zero would mean that no reading is ever off; give what it is.')
    return values


def site(text: Any) -> tuple[float, float, float]:
    """Latitude deg, longitude deg, height m."""
    values = _triple(text)
    if values is None:
        raise click.BadParameter(f'"{text}" is not {_SITE_FORM}.')
    if abs(values[0]) > 90 or abs(values[1]) > 360:
        raise click.BadParameter(f'"{text}": a latitude lies in -90..90 and a longitude in -180..360 degrees.')
    return values


def _is_auto(text: Any) -> bool:
    return str(text).strip().lower() == AUTO


def _finite(text: Any) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _triple(text: Any) -> tuple[float, float, float] | None:
    values = [_finite(part) for part in str(text).split(",")]
    if len(values) != 3 or values[0] is None or values[1] is None or values[2] is None:
        return None
    return (values[0], values[1], values[2])


def seed(what: str) -> Callable[[F], F]:
    kind = click.IntRange(min=0)
    return click.option(
        "--seed", type=kind, default=0, metavar="N", help=f"{what}; the same seed gives the same bytes."
    )


def scenario(required: bool, text: str) -> Callable[[F], F]:
    return click.option("--scenario", metavar="NAME", required=required, help=text)


def noise(kind: Callable[[Any], Any], default: str | None, text: str) -> Callable[[F], F]:
    what = "1-sigma of range m, azimuth rad, elevation rad, such as 5,0.0002,0.0002"
    return click.option("--noise", type=kind, default=default, metavar="R,A,E", help=f"{what}{text}")


def units(text: str) -> Callable[[F], F]:
    return click.option("--units", metavar="NAME=UNIT,...", help=text)


def azimuth_from(text: str) -> Callable[[F], F]:
    return click.option("--azimuth-from", type=click.Choice(["x", "north"]), default="x", help=text)


def tracker(function: F) -> F:
    """What the filter does: method, editing, tuning, smoothing."""
    return _with(_TRACKER, function)


def tuned(function: F) -> F:
    """Editing, noise and jerk level: what a correction depends on."""
    return _with(_TUNED, function)


def _with(options: tuple[Callable[[Any], Any], ...], function: F) -> F:
    for option in reversed(options):
        function = option(function)
    return function


_TUNED: tuple[Callable[[Any], Any], ...] = (
    click.option(
        "--editing", type=click.Choice(["two-pass", "forward", "none"]), default=FilterSettings.editing,
        help="How outliers are found: with the whole log in view, recursively as a live system must, or not at all.",
    ),
    noise(noise_or_auto, AUTO, "; auto: from the log."),
    click.option(
        "--jerk", type=number_or_auto, default=AUTO, metavar="S",
        help="How hard the target manoeuvres: spectral density of white jerk in m2/s5, such as 1 for gentle "
        "turns and 100 for a fighter; auto: from the log.",
    ),
)  # fmt: skip

_TRACKER: tuple[Callable[[Any], Any], ...] = (
    click.option(
        "--method", metavar="NAME", default=FilterSettings.method,
        help="How to filter; see --list-methods. `all` runs every method, with -o DIRECTORY.",
    ),
    click.option(
        "--model", metavar="MODEL|none", default="packaged",
        help="The network that corrects the filter: a file that `ftproc train` wrote, `none`, or the packaged one.",
    ),
    click.option("--smooth", is_flag=True, help="Add the fixed-interval smoother: the best estimate of trajectory."),
    *_TUNED,
    click.option(
        "--gate", type=number, default=FilterSettings.gate, metavar="C",
        help="A reading so many sigmas off is suspected of being an outlier.",
    ),
    click.option(
        "--max-patch", type=number, metavar="SECONDS",
        help="The longest patch of outliers expected, such as 5; forward editing takes a longer one for a lost track. "
        "[default: 4 s or 32 samples]",
    ),
    click.option(
        "--weight-form", type=click.Choice(["noise", "gain"]), default="noise",
        help="In forward editing the outlier weight divides the measurement noise, or scales the gain as Zuo et al. "
        "2021 write it.",
    ),
)  # fmt: skip
