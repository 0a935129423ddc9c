"""A station file in: TOML, every key checked -> options by their names on the command line."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ftproc.config.keys import KEYS, Key, every
from ftproc.errors import UsageError, nearest
from ftproc.files.reading.formats.content import is_ordinary
from ftproc.files.units import UNITS, si_unit
from ftproc.settings import NO_MODEL, PACKAGED

#: Options that consist of three parts -> the value of a part that the file does not set.
_NO_PARTS = {"site": None, "noise": None, "bias": 0.0}
_MAX_SIZE = 1 << 16  # bytes; a station file with every key has 4000
_MAX_LINE = 5000  # bytes; parsing takes time by the square of the number of dots in a name


def load(path: str | Path) -> dict[str, Any]:
    """The options that a station file sets, such as {"site": (48.1, 11.3, 612.0), "smooth": True}; lengths in m, angles
    in rad. Raises UsageError, naming file and key, for what cannot be read or is not understood."""
    options = parse(read_text(path, "station file", "--write-config"), str(path))
    if options.get("model", NO_MODEL) not in (PACKAGED, NO_MODEL):
        options["model"] = str(Path(path).parent / options["model"])
    return options


def read_text(path: str | Path, kind: str, maker: str) -> str:
    """The text of a small TOML file. kind: what it is called; maker: the options with which `ftproc filter` prints one.
    Raises UsageError."""
    try:
        return _bytes(Path(path), kind, maker).decode("utf-8-sig")
    except FileNotFoundError as error:
        raise UsageError(f"{path}: there is no such file. ftproc filter {maker} > {path} makes one.") from error
    except UnicodeDecodeError as error:
        raise UsageError(f"{path}: this is not UTF-8 text; save it as UTF-8.") from error
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise UsageError(f"{path}: cannot be read ({reason}); name a {kind}.") from error


def _bytes(path: Path, kind: str, maker: str) -> bytes:
    if not is_ordinary(path):
        raise UsageError(f"{path}: not an ordinary file (a pipe or a device); name a {kind}.")
    with path.open("rb") as stream:
        content = stream.read(_MAX_SIZE + 1)
    if len(content) > _MAX_SIZE:
        raise UsageError(f"{path}: far too large for a {kind}; ftproc filter {maker} prints one.")
    for number, line in enumerate(content.splitlines(), 1):
        if len(line) > _MAX_LINE:
            raise UsageError(f"{path}: line {number} is far too long for a {kind}; delete or split it.")
    return content


def parse(text: str, name: str) -> dict[str, Any]:
    """As `load`, from the text of a file called `name`."""
    return options_of(toml(text, name), name)


def toml(text: str, name: str) -> dict[str, Any]:
    """The tables of a TOML text. Raises UsageError."""
    import tomllib

    try:
        return tomllib.loads(text)
    except ValueError as error:  # also of numbers with thousands of digits
        raise UsageError(f"{name}: this is not TOML: {error}. Correct it there.") from error
    except RecursionError as error:
        raise UsageError(f"{name}: this TOML nests too deeply. Delete the nested part.") from error


def options_of(sections: Mapping[str, Any], name: str) -> dict[str, Any]:
    """As `load`, from the sections of a station file called `name`."""
    values: dict[tuple[str, str], Any] = {}
    for section, keys in sections.items():
        _check_section(name, section, keys)
        for key_name, value in values_of(f"{name}: [{section}]", KEYS[section], keys).items():
            values[section, key_name] = value
    return _options(name, values)


def values_of(where: str, known: Mapping[str, Key], written: Mapping[str, Any]) -> dict[str, Any]:
    """The values in SI units of what is written, by the names of the keys. where: in the file, for messages."""
    values: dict[str, Any] = {}
    for spelt, value in written.items():
        key_name, to_si = _key_of(where, known, spelt)
        if key_name in values:
            raise UsageError(f"{where} has {key_name} in two units; leave one out.")
        values[key_name] = _checked(f"{where} {spelt}", known[key_name], value, to_si)
    return values


def _check_section(name: str, section: str, keys: object) -> None:
    if section in KEYS and isinstance(keys, Mapping):
        return
    if section in KEYS:
        raise UsageError(f'{name}: "{section}" is a section: write [{section}], and its keys below it.')
    homes = [home for home, key_name, _ in every() if key_name == section]
    if homes and not isinstance(keys, Mapping):
        raise UsageError(f'{name}: "{section}" stands outside of its section; write it below [{"] or [".join(homes)}].')
    kind = "section" if isinstance(keys, Mapping) else "key"
    sections = ", ".join(f"[{known}]" for known in KEYS)
    hint = _of_option(section) or nearest(section, KEYS) or "."
    raise UsageError(f'{name}: there is no {kind} "{section}"{hint} The sections: {sections}.')


def _key_of(where: str, keys: Mapping[str, Key], written: str) -> tuple[str, Callable[[Any], Any]]:
    """The name of the key that is `written` with its unit, and the function that converts its value to SI."""
    stem, _, unit = written.rpartition("_")
    if written in keys and not keys[written].quantity:
        return written, lambda value: value
    key = keys.get(stem)
    if key is not None and key.quantity and unit in key.units:
        scale = UNITS[key.quantity][unit]
        return stem, lambda value: value * scale.multiply / scale.divide
    bare = keys.get(written) or key
    if bare is not None and bare.quantity:
        first = written if written in keys else stem
        raise UsageError(
            f'{where} "{written}" must end in its unit: {", ".join(_spelt(first, bare))}'
            f"{nearest(written, _spelt(first, bare))}"
        )
    all_names = [form for known, its in keys.items() for form in _spelt(known, its)]
    short = ", ".join(f"{known}_UNIT" if its.quantity else known for known, its in keys.items())
    hint = _of_option(written) or nearest(written, all_names) or "."
    raise UsageError(f'{where} has no key "{written}"{hint} Its keys are: {short}.')


def _of_option(name: str) -> str:
    """Where the keys stand that say what the option of this name says; "" of no option."""
    found = [f"{_spelt(key_name, key)[0]} under [{home}]" for home, key_name, key in every() if key.option == name]
    return f"; what --{name.replace('_', '-')} says is {', '.join(found)}." if found else ""


def _spelt(name: str, key: Key) -> list[str]:
    return [f"{name}_{unit}" for unit in key.units] or [name]


def _checked(where: str, key: Key, value: object, to_si: Callable[[Any], Any]) -> Any:
    try:
        found = to_si(key.kind(value))
        if isinstance(found, float) and key.quantity and not key.least <= found <= key.most:
            limit = f"at least {key.least:g}" if found < key.least else f"at most {key.most:g}"
            raise ValueError(f"{limit} {si_unit(key.quantity).name}")
        if isinstance(found, float) and math.isinf(found):
            raise ValueError("a smaller number")
        return found
    except ValueError as error:
        shown = f'"{value}"' if isinstance(value, str) else str(value).lower() if isinstance(value, bool) else value
        words = str(error).replace('"', "").split(" or ") if isinstance(value, str) else []
        raise UsageError(f"{where} = {shown}: expected {error}{nearest(str(value), words) or '.'}") from error


def _options(name: str, values: Mapping[tuple[str, str], Any]) -> dict[str, Any]:
    options: dict[str, Any] = {}
    for section, key_name, key in every():
        if (section, key_name) not in values:
            continue
        value = values[section, key_name]
        if key.part is None:
            options[key.option] = value
        elif isinstance(key.part, str):
            options.setdefault(key.option, {})[key.part] = value
        else:
            parts = list(options.get(key.option, (_NO_PARTS[key.option],) * 3))
            parts[key.part] = value
            options[key.option] = tuple(parts)
    if None in options.get("site", ()):
        raise UsageError(f"{name}: [site] needs all of lat_deg, lon_deg and height_m.")
    return options
