"""The options that several commands share, and the kinds of value."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

import click

from ftproc.settings import EDITING, MOTIONS, FilterSettings, Noise

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


def seconds(text: Any) -> float:
    """A number of seconds, zero or more."""
    value = _finite(text)
    if value is None or value < 0:
        raise click.BadParameter(f'"{text}" is not a number of seconds, zero or more.')
    return value


def noise_sigmas(text: Any) -> tuple[float, float, float]:
    """1-sigma of range m, azimuth rad, elevation rad; zero or more."""
    values = _triple(text)
    if values is None or min(values) < 0:
        raise click.BadParameter(f'"{text}" is not {_NOISE_FORM}.')
    return values


def noise_or_auto(text: Any) -> Noise | None:
    """The same above zero, or `auto` for all or any of them: None, estimated from the log."""
    if _is_auto(text):
        return None
    parts = str(text).split(",")
    values = _triple(",".join("1" if _is_auto(part) else part for part in parts))
    if values is None:
        raise click.BadParameter(f'"{text}" is not {_NOISE_FORM}.')
    if min(values) <= 0:
        raise click.BadParameter(f'"{text}": a sigma of zero means readings without error; sigmas are above zero.')
    first, second, third = (None if _is_auto(part) else value for part, value in zip(parts, values, strict=True))
    return first, second, third


def height(text: Any) -> tuple[float, float]:
    """Height m and its 1-sigma m."""
    from ftproc.config.kinds import prior

    try:
        return prior(text)
    except ValueError as error:
        raise click.BadParameter(f'"{text}" is not {error}.') from error


def site(text: Any) -> tuple[float, float, float]:
    """Latitude deg, longitude deg, height m."""
    values = _triple(text)
    if values is None:
        raise click.BadParameter(f'"{text}" is not {_SITE_FORM}.')
    if not (-90 <= values[0] <= 90 and -180 <= values[1] <= 360):
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


class _File(click.Path):
    def convert(self, value: Any, parameter: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not value:
            self.fail("the name of a file is empty.", parameter, ctx)
        return super().convert(value, parameter, ctx)


#: The name of a file, which shells complete. Whether it may be read shows when it is: of many, the others are done.
FILE = _File(readable=False)
#: The same, or nothing.
RANGE = click.Path(readable=False)


def _starting(names: Iterable[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]


def _complete_method(ctx: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    from ftproc.methods import registry

    return _starting([*registry.METHODS, "all"], incomplete)


def _complete_scenario(ctx: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    from ftproc.simulation import list_scenarios

    return _starting(list_scenarios(), incomplete)


def seed(what: str) -> Callable[[F], F]:
    kind = click.IntRange(min=0)
    return click.option(
        "--seed", type=kind, default=0, metavar="N", help=f"{what}; the same seed gives the same bytes."
    )


def scenario(required: bool, text: str) -> Callable[[F], F]:
    return click.option("--scenario", metavar="NAME", shell_complete=_complete_scenario, required=required, help=text)


def truth(text: str) -> Callable[[F], F]:
    return click.option("--truth", "truths", multiple=True, type=FILE, metavar="TRUTH", help=text)


def noise(kind: Callable[[Any], Any], default: str | None, text: str) -> Callable[[F], F]:
    what = "1-sigma of range m, azimuth rad, elevation rad, such as 5,0.0002,0.0002"
    return click.option("--noise", type=kind, default=default, metavar="R,A,E", help=f"{what}{text}")


def output(what: str, metavar: str, required: bool = False) -> Callable[[F], F]:
    """`-o`, which names one file or directory: a second one is refused, not preferred to the first."""

    def only(ctx: click.Context, parameter: click.Parameter, names: tuple[str, ...]) -> str | None:
        if len(names) > 1:
            raise click.UsageError(
                f"-o is given {len(names)} times ({', '.join(names)}), and a run writes one kind of file; "
                "run it once for each.",
                ctx,
            )
        return names[0] if names else None

    return click.option(
        "-o", "--output", type=FILE, multiple=True, callback=only, metavar=metavar, required=required, help=what
    )


def report(what: str) -> Callable[[F], F]:
    text = (
        f"Write a page that shows {what}. FILE.html: it opens in any browser, without a network; FILE.pdf: printed by "
        "Chromium, Chrome or Edge, one of which must be there; a directory: an HTML page of each, and an index.html "
        'that lists them. Needs plotly: pip install "plotly>=6.0".'
    )
    return click.option("--report", type=FILE, metavar="FILE.html|FILE.pdf|DIR", help=text)


def units(text: str) -> Callable[[F], F]:
    return click.option("--units", metavar="NAME=UNIT,...", help=text)


def azimuth_from(text: str, default: str | None = None) -> Callable[[F], F]:
    return click.option("--azimuth-from", type=click.Choice(["x", "north"]), default=default, help=text)


def tracker(function: F) -> F:
    """Options of the filter: method, model, smoothing, editing, noise, process noise."""
    return _with(_TRACKER, function)


def tuned(function: F) -> F:
    """Options that a correction depends on: editing, noise, process noise."""
    return _with(_TUNED, function)


def _joined(ctx: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> str | None:
    return ",".join(texts) or None


def _with(options: tuple[Callable[[Any], Any], ...], function: F) -> F:
    for option in reversed(options):
        function = option(function)
    return function


def by_hand(function: F) -> F:
    """Options of the engineer's decisions, and of a run that is made again."""
    return _with(_BY_HAND, function)


_BY_HAND: tuple[Callable[[Any], Any], ...] = (
    click.option(
        "--decisions", type=FILE, metavar="FILE.csv",
        help="Decisions on readings by hand: component,from_s,to_s,use (or from_row,to_row), where use is bad (never "
        "used), good (used whatever the editor thinks) or auto. Columns reason and station may follow.",
    ),
    click.option(
        "--write-decisions", type=FILE, metavar="FILE.csv",
        help="Write the outliers that were found as decisions, to be edited and given to --decisions.",
    ),
    click.option(
        "--again", type=FILE, metavar="RUN.json|TRAJECTORY",
        help="Run again what a trajectory, or the JSON beside it, says of how it was made, with its log or another; "
        "what differs is reported. Options on the command line win over it.",
    ),
)  # fmt: skip


_TUNED: tuple[Callable[[Any], Any], ...] = (
    click.option(
        "--editing", type=click.Choice(EDITING), default=FilterSettings.editing,
        help="How outliers are found: from the whole log (two-pass), from a window of the readings so far, as a live "
        "system can (live), recursively (forward), or not at all.",
    ),
    noise(noise_or_auto, AUTO, "; auto, for all or for one: estimated from the log."),
    click.option(
        "--jerk", type=lambda text: None if _is_auto(text) else number(text), default=AUTO, metavar="S",
        help="Process noise: the spectral density (PSD) of white jerk in m2/s5, such as 1 for gentle turns and 100 for "
        "a fighter; auto: estimated from the log.",
    ),
)  # fmt: skip

_TRACKER: tuple[Callable[[Any], Any], ...] = (
    click.option(
        "--method", metavar="NAME", default=FilterSettings.method, shell_complete=_complete_method,
        help="The filter; see --list-methods. `all` runs every method, with -o DIRECTORY.",
    ),
    click.option(
        "--model", type=FILE, metavar="MODEL|none", default="packaged",
        help="The network that corrects the filter: a file that `ftproc train` wrote, `none`, or the packaged one.",
    ),
    click.option("--smooth/--no-smooth", help="Add the fixed-interval smoother: the best estimate of trajectory."),
    *_TUNED,
    click.option(
        "--motion", type=click.Choice(MOTIONS), default=FilterSettings.motion,
        help="How the target moves: driven by white jerk alone (white-jerk), or with a force that turns with the "
        "velocity, as that of an aircraft does (turning-force), or also grows with the pressure of the air, as on a "
        "bomb or a shell (ballistic), or by gravity alone (orbital); auto: the likeliest by the log's readings.",
    ),
    click.option(
        "--height", type=height, metavar="M[,SIGMA]",
        help="Of a log without elevations: the height of the target above the station and its 1-sigma in m, such as "
        "0,20 for ships. [SIGMA: 100; default: the log's heights or flight levels, else what the summary says]",
    ),
    click.option(
        "--lag", type=seconds, metavar="S", default=FilterSettings.lag_s,
        help="In live editing: the estimate at t rests on readings up to t + S seconds, and no later one.",
    ),
    click.option(
        "--gate", type=number, default=FilterSettings.gate, metavar="C",
        help="The gate in sigmas: a reading whose innovation is larger is suspected of being an outlier.",
    ),
    click.option(
        "--max-patch", type=number, metavar="SECONDS",
        help="The longest patch of outliers expected, such as 5; in forward editing a longer one is track loss. "
        "[default: 1.5 s or 12 samples, the longer of the two]",
    ),
    click.option(
        "--set", multiple=True, callback=_joined, metavar="NAME=VALUE",
        help="A parameter of the method, such as --set window=6, or several: --set F_range_m=60,window=6; "
        "--list-methods NAME explains those of a method.",
    ),
    click.option(
        "--particles", type=click.IntRange(min=20), default=FilterSettings.particles, metavar="N",
        help="Members of the ensemble and particle filters.",
    ),
    seed("Seed of these filters"),
    click.option(
        "--weight-form", type=click.Choice(["noise", "gain"]), default="noise",
        help="In forward editing the outlier weight divides the measurement noise, or scales the gain as Zuo et al. "
        "2021 write it.",
    ),
)  # fmt: skip
