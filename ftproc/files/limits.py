"""What a file may be: how much its content may grow, how many columns it may have, and how long their names may be."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from ftproc.errors import InputError

#: Limit of growth, against files made to fill the memory: real readings shrink to a half, not to a hundredth.
MAX_GROWTH = 100
MOST_COLUMNS = 5000
LONGEST_NAME = 1000  # characters
WITHOUT_END = 4 << 30  # bytes of standard input, or of a storage that does not say its size
ROW = 400  # bytes that a row takes until it is a row of a trajectory

_MIN_ROOM = 64 << 20  # bytes that any file may unpack to


class Room(NamedTuple):
    """How large the content of a file may become in memory.

    name: of the file, for messages. packed: its bytes as the user has it, before anything is unpacked.
    """

    name: str
    packed: int

    @property
    def limit(self) -> int:
        return max(_MIN_ROOM, MAX_GROWTH * self.packed)

    def check(self, size: int, rows: int = 0) -> None:
        """Raise InputError where content of `size` bytes, or of `rows` rows, is larger."""
        if max(size, ROW * rows) > self.limit:
            raise InputError(
                f"{self.name}: these {self.packed} bytes unpack to more than {self.limit >> 20} MiB, which no log "
                "does. If it is one, unpack it first, or save its columns as plain CSV."
            )


def short_name(name: str) -> str:
    """A name for a copy of a file, whose own may be too long or odd for this disk, with the endings that it has."""
    ending = re.search(r"(?:\.[A-Za-z0-9]{1,8}){1,4}$", name)
    return f"log{ending[0] if ending else ''}"


def check_names(source: str, names: Sequence[str]) -> None:
    """Raise InputError for too many columns, and for a name that is too long."""
    if len(names) > MOST_COLUMNS:
        raise too_many_columns(source)
    for number, name in enumerate(names, 1):
        if len(name) > LONGEST_NAME:
            raise name_too_long(source, f"column {number}")


def too_many_columns(source: str) -> InputError:
    return InputError(
        f"{source}: it has more than {MOST_COLUMNS} columns, which no log has; delete those that are not needed."
    )


def name_too_long(source: str, what: str) -> InputError:
    return InputError(
        f"{source}: the name of {what} has more than {LONGEST_NAME} characters; write a line of column names."
    )
