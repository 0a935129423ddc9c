"""The lines of a log that still grows, from the bytes that come."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from ftproc.errors import InputError
from ftproc.files.reading.formats import layout, packing

MOST = 1 << 18  # bytes of a line
LINES = 4096  # that are taken at once, of those that are there

Say = Callable[[str], None]


class SeveralTargets(InputError):
    """The rows are of several targets, and nobody has said by which column they are told apart."""


class Block(NamedTuple):
    """Complete lines, without their ends, and the number of the first one in its file, from 1."""

    first: int
    texts: list[str]


class Lines:
    """Bytes in, complete lines out. number: of lines so far."""

    def __init__(self, source: str) -> None:
        self._source, self._rest, self.number = source, bytearray(), 0

    def begin_again(self) -> bool:
        """The content is another one; whether a line is left incomplete, which is dropped."""
        cut = bool(self._rest.strip())
        self._rest, self.number = bytearray(), 0
        return cut

    def blocks(self, data: bytes) -> Iterator[Block]:
        """The lines that are complete now. Raises InputError for what is no text in lines."""
        if not self.number and not self._rest:
            _refuse_other_kinds(self._source, data)
        end, *begun = data.split(b"\n")
        self._rest += end  # without a search of what came before: a line may come byte by byte
        whole = [bytes(self._rest), *begun[:-1]] if begun else []
        if begun:
            self._rest = bytearray(begun[-1])
        if len(self._rest) > MOST:
            raise InputError(
                f"{self._source}: line {self.number + len(whole) + 1} has no end within {MOST >> 10} KiB, which is no "
                "row of a log. Write text whose lines end in LF."
            )
        first, self.number = self.number + 1, self.number + len(whole)
        for low in range(0, len(whole), LINES):
            yield Block(first + low, [_text(line) for line in whole[low : low + LINES]])

    def last(self) -> Iterator[Block]:
        """The line that has no end, when no more comes."""
        if self._rest.strip():
            yield Block(self.number + 1, [_text(self._rest)])


def _text(line: bytes | bytearray) -> str:
    return line.decode("utf-8", "replace").strip("\r\ufeff")


def _refuse_other_kinds(source: str, data: bytes) -> None:
    """Raise InputError for a file that does not begin as a text in lines does."""
    packed = packing.ending(source, data[:8])
    if packed is not None:
        raise InputError(
            f"{source}: this is packed ({packing.KINDS[packed][1]}), and --follow reads plain text. Filter it without "
            "--follow, or unpack it into a pipe and follow -."
        )
    if b"\0" in data[:64]:
        raise InputError(
            f"{source}: --follow reads text in lines (UTF-8), such as CSV, and this is something else. Filter it "
            "without --follow when it is complete."
        )


def no_table(source: str, head: Sequence[str]) -> InputError:
    if not any(line.strip() for line in head):
        return InputError(f"{source}: there is no line; expected a line of names and rows.")
    filled = [line for line in head if line.strip() and not layout.is_comment(line)]
    if len(filled) < 2:
        return InputError(
            f"{source}: no row came after the line of names, so nothing is written. Follow it again when there are "
            "rows."
        )
    return no_row(source, head)


def no_row(source: str, head: Sequence[str]) -> InputError:
    return InputError(
        f"{source}: none of its first {len(head)} lines looks like a row of a log; expected a line of names, and below "
        "it rows of numbers that commas, semicolons, tabs or blanks separate."
    )
