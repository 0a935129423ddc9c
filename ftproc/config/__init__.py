"""Station files: what is known of an instrument and its site, and how its logs are filtered, in one TOML file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from ftproc.batch import Recipe
from ftproc.config.reading import load, parse
from ftproc.config.writing import dump
from ftproc.settings import Air, FilterSettings, Station

__all__ = ["dump", "load", "parse", "recipe"]

#: Options whose names on the command line are shorter than those of the settings.
_SETTINGS = {"jerk": "jerk_psd_m2ps5", "max_patch": "max_patch_s"}


def recipe(options: Mapping[str, Any]) -> Recipe:
    """What to do with a log, from options as `load` gives them; what they do not say is as usual."""
    said = {_SETTINGS.get(name, name): value for name, value in options.items() if value is not None}
    said["gain_form"] = said.pop("weight_form", "noise") == "gain"
    air = {name: said[name] for name in ("temperature_c", "pressure_hpa") if name in said}
    said["refraction"] = Air(**air) if said.pop("refraction", False) else None
    said["settings"], said["station"] = _picked(FilterSettings, said), _picked(Station, said)
    found: Recipe = _picked(Recipe, said)
    return found


def _picked(kind: type[Any], said: Mapping[str, Any]) -> Any:
    """A dataclass of those values that it has fields for."""
    return kind(**{field.name: said[field.name] for field in fields(kind) if field.name in said})
