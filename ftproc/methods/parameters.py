"""The parameters of the published methods: numbers that their papers leave to the engineer, by the papers' names. What
is not set follows from the log."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from ftproc.errors import UsageError, nearest
from ftproc.records import COMPONENTS
from ftproc.settings import FilterSettings, Parameters

#: The unit of a component in the name of a parameter, and its size in m or rad.
UNITS = {"range": ("m", 1.0), "azimuth": ("mrad", 1e-3), "elevation": ("mrad", 1e-3)}


class Parameter(NamedTuple):
    """A number from `low` to `high`. default: in words, when it is not set. whole: of no fraction."""

    name: str
    meaning: str
    default: str
    low: float = 0.0
    high: float = 1e9
    whole: bool = False

    @property
    def kind(self) -> str:
        """What is expected, for messages and help."""
        return f"a {'whole ' if self.whole else ''}number from {self.low:g} to {self.high:g}"

    def accepts(self, value: float) -> bool:
        return self.low <= value <= self.high and not (self.whole and value % 1)


def per_component(stem: str, meaning: str, default: str, power: int = 1) -> tuple[Parameter, ...]:
    """One parameter for each of range, azimuth and elevation, its unit (to a power) in its name."""
    return tuple(Parameter(_named(stem, c, power), meaning, default, 1e-9) for c in range(len(COMPONENTS)))


def _named(stem: str, c: int, power: int) -> str:
    return f"{stem}_{COMPONENTS[c]}_{UNITS[COMPONENTS[c]][0]}{power if power > 1 else ''}"


def of_component(settings: FilterSettings, stem: str, c: int, otherwise: float, power: int = 1) -> float:
    """The parameter for component c in m or rad (to a power), or `otherwise` when it is not set."""
    value = settings.parameter(_named(stem, c, power))
    return otherwise if value is None else value * UNITS[COMPONENTS[c]][1] ** power


def parse(texts: Iterable[str]) -> Parameters:
    """(name, value) pairs of texts such as `m=0.01,r=5`; of a name that is given again, the last. Raises UsageError."""
    found: dict[str, float] = {}
    for item in (item for text in texts for item in text.split(",")):
        name, equals, value = (part.strip() for part in item.partition("="))
        try:
            found[name] = float(value)
        except ValueError:
            equals = ""
        if not (name and equals):
            raise UsageError(f'--set {item.strip()}: expected NAME=VALUE with a number, such as "--set window=6".')
    return tuple(found.items())


def check(method: str, known: Sequence[Parameter], given: Parameters) -> None:
    """Raises UsageError for a parameter that the method (or all) does not have, or whose value makes no sense."""
    by_name = {parameter.name: parameter for parameter in known}
    for name, value in given:
        if name not in by_name:
            if not by_name:
                raise UsageError(f"--set {name}: {method} has no parameters; `ftproc filter -h` lists its options.")
            raise UsageError(
                f'--set: {method} has no parameter "{name}"{nearest(name, by_name) or "."} {_all(by_name)}'
            )
        if not by_name[name].accepts(value):
            raise UsageError(f"--set {name}={value:g}: {method} takes {by_name[name].kind} for it.")


def _all(names: Iterable[str]) -> str:
    return f"It has {', '.join(names)}."


def described(known: Sequence[Parameter]) -> list[str]:
    """Lines for the terminal: name, meaning, what it is when it is not set."""
    width = max(len(parameter.name) for parameter in known)
    return [f"  {p.name.ljust(width)}  {p.meaning}; {p.kind} [default: {p.default}]" for p in known]
