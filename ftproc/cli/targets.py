"""`ftproc filter` of a log that holds several targets: a trajectory of each."""

from __future__ import annotations

from typing import NamedTuple

from ftproc.config.recipe import Recipe
from ftproc.errors import UsageError, printable, quoted
from ftproc.files import remote
from ftproc.files.options import ABSENT, Extract, parse_where, parse_widths


class Targets(NamedTuple):
    """The targets of a log, as COLUMN=VALUE, none if it is one; and a sentence on them where the user has not asked for
    each."""

    named: tuple[str, ...] = ()
    said: str = ""


def of_log(log: str, recipe: Recipe) -> Targets:
    """The targets in a log if the option names a column, or names nothing and the standard of the file does. The value
    of a log that cannot be read is left out: reading it again gives the message. Raises UsageError."""
    from ftproc.files.reading import targets

    column = recipe.target
    if column == ABSENT or "=" in column or (column == "" and (log == "-" or remote.is_uri(log))):
        return Targets()
    if log == "-":
        raise UsageError("--target COLUMN reads a log twice, which standard input does not allow; name a file.")
    try:
        found = targets.targets(log, Extract(parse_widths(recipe.widths), parse_where(recipe.where), column))
    except Exception:  # of this log alone: reading it again gives the message
        return Targets((column,) if column else ())
    named = tuple(f"{found.column}={value}" for value in found.values)
    if column or not named:
        return Targets(named)
    said = f"{log}: it holds {found}: a trajectory of each. --target {quoted(named[0])} makes one"
    fused = f"; for one of all, ftproc filter --fuse --write-config {quoted(log)} prints a range file"
    return Targets(named, printable(f"{said}{fused if found.stations else ''}."))
