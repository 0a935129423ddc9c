"""The errors a user may see. Every message names the file, the row and the column where there is one, says what
was expected, and how to cure it."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass


def printable(text: str) -> str:
    """`text` with control characters, and bytes of file names that are no UTF-8, written out as `\\x1b`.

    Names come from files that others made: they must not move the cursor, change colours or reverse the line.
    """
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


_BEGINNING, _END = 700, 400  # letters of a sentence that are shown when it has more
_LONGEST_NAME = 200  # in such a sentence; an escaped control character counts as four or more


def _shortened(sentence: str) -> str:
    """At most 1105 letters. A name in a file may be as long as the file: it loses its middle before anything else does,
    for where it is, what is wrong and the cure stand around it."""
    if len(sentence) <= _BEGINNING + _END:
        return sentence
    sentence = re.sub(r'"[^"]+"|\S+', _clipped, sentence)
    if len(sentence) <= _BEGINNING + _END:
        return sentence
    return f"{sentence[:_BEGINNING]} ... {sentence[-_END:]}"


def _clipped(name: re.Match[str]) -> str:
    half = _LONGEST_NAME // 2
    return name[0] if len(name[0]) <= _LONGEST_NAME else f"{name[0][:half]}...{name[0][-half:]}"


class FtprocError(Exception):
    """Root of all errors that carry a plain sentence for the user.

    `exit_code` is what the command line returns: 1 for input that cannot be processed.
    """

    exit_code = 1

    def __init__(self, sentence: str) -> None:
        super().__init__(_shortened(printable(sentence)))


class FtprocWarning(UserWarning):
    """Something the user should know that does not stop the work."""


class InputError(FtprocError):
    """A log, truth, trajectory or other input cannot be processed."""


class ModelError(InputError):
    """A file is not a correction model, or is one made for something else."""


class OutputError(FtprocError):
    """A result cannot be written where it was asked for."""


class UsageError(FtprocError):
    """Options that contradict each other or name something unknown."""

    exit_code = 2


def nearest(word: str, known: Iterable[str], alike: float = 0.6) -> str:
    """`; did you mean "..."?` for the known word most like `word`, or an empty string when none is.

    alike: the least likeness (difflib's ratio) that counts.
    """
    import difflib

    by_lower = {name.lower(): name for name in known}
    close = difflib.get_close_matches(word.lower(), by_lower, n=1, cutoff=alike)
    return f'; did you mean "{by_lower[close[0]]}"?' if close else ""


def interruption(error: BaseException) -> BaseException | None:
    """The KeyboardInterrupt or SystemExit that an error stands for, if it does.

    A signal that arrives while a compiled kernel hands back its result comes out of it as a SystemError, which names
    the interruption as its cause.
    """
    cause: BaseException | None = error
    while isinstance(cause, Exception):
        cause = cause.__cause__
    return cause


@dataclass(frozen=True)
class Failure:
    """Why something was not done: a sentence for the user, the exit code it deserves, and the traceback."""

    message: str
    exit_code: int
    trace: str


def failure(error: BaseException, source: str | None = None) -> Failure:
    """An error in a plain sentence or two, naming `source` where the error does not do so itself."""
    import traceback

    if isinstance(error, MemoryError):
        traceback.clear_frames(error.__traceback__)  # what filled the memory, or the next log would find no room either
    trace = "".join(traceback.format_exception(error))
    about = f"{source}: " if source else ""
    if isinstance(error, FtprocError):
        return Failure(str(error), error.exit_code, trace)
    if isinstance(error, MemoryError) or "Resource temporarily unavailable" in str(error):
        return Failure(f"{about}there is not enough memory for it. Use fewer --jobs, or split the log.", 1, trace)
    if isinstance(error, RuntimeError) and "no locator available" in str(error):
        cure = "Set NUMBA_CACHE_DIR to a directory that can be written to."
        return Failure(f"the compiled kernels cannot be kept anywhere. {cure}", 1, trace)
    if isinstance(error, OSError) and error.strerror:
        place = error.filename or source or "standard output"
        return Failure(f"{place}: {error.strerror.lower()}.", 1, trace)
    kind = f"{type(error).__name__}: {error}".splitlines()[0][:200]
    return Failure(f"{about}internal error ({kind}); run again with --debug and report it.", 1, trace)
