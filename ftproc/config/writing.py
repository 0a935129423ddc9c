"""A station file out: every key with its meaning; those with their default value as comments."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ftproc.config.keys import KEYS, SECTIONS, Key
from ftproc.settings import NO_MODEL

_HEAD = """\
# A station file of ftproc: ftproc filter LOG --config THIS. Options on the command line win over it.
# A key with a unit may end in any unit that a column may have: bias_m, bias_ft, zero_deg, sigma_mrad, sigma_arcsec, ...
"""
_COLUMN = 28  # of the comments


def dump(options: Mapping[str, Any]) -> str:
    """The text of a station file that `parse` turns into the same options. options: as `load` returns them."""
    parts = [_HEAD]
    for section, keys in KEYS.items():
        about = f"# {SECTIONS[section]}\n" if SECTIONS[section] else ""
        lines = (_line(name, key, _value(options, key)) for name, key in keys.items())
        parts.append(f"\n{about}[{section}]\n{''.join(lines)}")
    return "".join(parts)


def _value(options: Mapping[str, Any], key: Key) -> Any:
    """The value that the options have for a key, or None."""
    whole = options.get(key.option)
    if key.part is None or whole is None:
        return whole
    return whole.get(key.part) if isinstance(whole, Mapping) else whole[key.part]


def _line(name: str, key: Key, value: Any) -> str:
    is_set = value is not None and value != key.default
    spelt = f"{name}_{key.units[0] if is_set else key.example_unit}" if key.example_unit else name
    if key.option == "model" and is_set and value != NO_MODEL:
        value = str(Path(value).resolve())
    setting = f"{'' if is_set else '# '}{spelt} = {_toml(value if is_set else key.example)}"
    return f"{setting.ljust(_COLUMN)}  # {key.meaning}\n"


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, tuple):
        return json.dumps(",".join(map(repr, value)))
    return str(value) if isinstance(value, int) else repr(float(value))
