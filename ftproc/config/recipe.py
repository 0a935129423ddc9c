"""The recipe of a run: how its logs are read, the settings, the model."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, NamedTuple

from ftproc.files import decisions
from ftproc.files.decisions import Decisions
from ftproc.files.options import Extract, parse_where, parse_widths
from ftproc.methods import parameters
from ftproc.settings import PACKAGED, Air, FilterSettings, Station

if TYPE_CHECKING:
    from ftproc.correction.model import Model


#: Option -> setting, where the names differ.
_SETTINGS = {"jerk": "jerk_psd_m2ps5", "max_patch": "max_patch_s", "lag": "lag_s"}
#: Options that become parts of a setting.
_PARTS = ("set", "weight_form", "refraction", "temperature_c", "pressure_hpa")


class Origin(NamedTuple):
    """Where a recipe comes from. typed: the words of each option on the command line, by its name. options: those and
    the station file's, by name, for the metadata. before: the metadata of the run that is run again, if one is."""

    typed: Mapping[str, Sequence[str]] = {}
    options: Mapping[str, Any] = {}
    before: Mapping[str, Any] = {}

    def stating(self, own: Mapping[str, str]) -> Origin:
        """The same with options of one trajectory alone, by name."""
        typed = {name: [f"--{name}", value] for name, value in own.items()}
        return self._replace(typed={**self.typed, **typed}, options={**self.options, **own})

    def command(self, log: str, changed: Mapping[str, Sequence[str]] | None = None) -> str:
        """The command line that filters a log so. changed: words of options that are to be others."""
        words = {**self.typed, **(changed or {})}
        return shlex.join(["ftproc", "filter", log, *(word for each in words.values() for word in each)])


@dataclass(frozen=True)
class Recipe:
    """What is done with every log. model: `packaged`, `none`, a path or a loaded model. units, columns, station,
    keep_columns: as in `files.reading.logs.read`. widths, where, target: as the options of these names. decisions: on
    readings, by hand. origin: for the metadata."""

    settings: FilterSettings = field(default_factory=FilterSettings)
    model: str | Model = PACKAGED
    units: str | Mapping[str, str] | None = None
    columns: str | Mapping[str, str] | None = None
    station: Station = field(default_factory=Station)
    keep_columns: bool = False
    widths: str | Sequence[int] | None = None
    where: Sequence[str] = ()
    target: str = ""
    decisions: Decisions | None = None
    origin: Origin = field(default_factory=Origin)

    @classmethod
    def of(cls, options: Mapping[str, Any]) -> Recipe:
        """The recipe from options as `config.reading.load` returns them, with the defaults for the rest."""
        known = {_SETTINGS.get(name, name): value for name, value in options.items() if value is not None}
        known["parameters"] = parameters.parse([known["set"]]) if known.get("set") else ()
        known["gain_form"] = known.pop("weight_form", "noise") == "gain"
        air = {name: known[name] for name in ("temperature_c", "pressure_hpa") if name in known}
        known["refraction"] = Air(**air) if known.pop("refraction", False) else None
        if isinstance(known.get("decisions"), str):
            known["decisions"] = decisions.read(known["decisions"])
        known["settings"], known["station"] = _picked(FilterSettings, known), _picked(Station, known)
        found: Recipe = _picked(cls, known)
        return found

    def reading(self, signal: bool = False) -> dict[str, Any]:
        """The arguments for `files.reading.logs.read`. signal: with the strength of the signal."""
        plain = {name: getattr(self, name) for name in ("units", "columns", "station", "keep_columns")}
        extract = Extract(parse_widths(self.widths), parse_where(self.where), self.target, signal)
        return {**plain, "extract": extract}


def relevant(options: Mapping[str, Any]) -> dict[str, Any]:
    """The options that a trajectory depends on, as `Recipe.of` takes them."""
    known = {each.name for kind in (FilterSettings, Station, Recipe) for each in fields(kind)}
    names = (known - set(_SETTINGS.values())) | {*_SETTINGS, *_PARTS}
    return {name: value for name, value in sorted(options.items()) if name in names and value not in (None, ())}


def _picked(kind: type[Any], known: Mapping[str, Any]) -> Any:
    """A dataclass of the values that it has fields for."""
    return kind(**{field.name: known[field.name] for field in fields(kind) if field.name in known})
