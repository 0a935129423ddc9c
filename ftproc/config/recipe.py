"""What is done with every log of a run: how it is read, the settings, the model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

from ftproc.settings import PACKAGED, Air, FilterSettings, Station

if TYPE_CHECKING:
    from ftproc.correction.model import Model


#: Options whose names on the command line are shorter than those of the settings.
_SETTINGS = {"jerk": "jerk_psd_m2ps5", "max_patch": "max_patch_s"}


@dataclass(frozen=True)
class Recipe:
    """What is done with every log. model: `packaged`, `none`, a path, or one that was loaded; the rest as
    `files.logs.read` takes it."""

    settings: FilterSettings = field(default_factory=FilterSettings)
    model: str | Model = PACKAGED
    units: str | Mapping[str, str] | None = None
    columns: str | Mapping[str, str] | None = None
    station: Station = field(default_factory=Station)
    keep_columns: bool = False

    @classmethod
    def of(cls, options: Mapping[str, Any]) -> Recipe:
        """What to do with a log, from options as `reading.load` gives them; what they do not say is as usual."""
        said = {_SETTINGS.get(name, name): value for name, value in options.items() if value is not None}
        said["gain_form"] = said.pop("weight_form", "noise") == "gain"
        air = {name: said[name] for name in ("temperature_c", "pressure_hpa") if name in said}
        said["refraction"] = Air(**air) if said.pop("refraction", False) else None
        said["settings"], said["station"] = _picked(FilterSettings, said), _picked(Station, said)
        found: Recipe = _picked(cls, said)
        return found

    def reading(self) -> dict[str, Any]:
        """What `files.logs.read` is told."""
        return {name: getattr(self, name) for name in ("units", "columns", "station", "keep_columns")}


def _picked(kind: type[Any], said: Mapping[str, Any]) -> Any:
    """A dataclass of those values that it has fields for."""
    return kind(**{field.name: said[field.name] for field in fields(kind) if field.name in said})
