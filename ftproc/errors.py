"""The errors that a user may see. Every message names the file, row and column where there is one, what was expected,
and the cure."""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass


def printable(text: str) -> str:
    """`text` with control characters, and bytes of file names that are not UTF-8, escaped as `\\x1b`.

    Names come from foreign files: they must not move the cursor, change colours or reverse the line.
    """
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def encodable(text: str) -> str:
    """`text` with bytes of file names that are not UTF-8 escaped as `\\udcff`, so that any file can hold it."""
    return text.encode("utf-8", "backslashreplace").decode()


_HEAD, _TAIL = 700, 400  # characters that are shown of a longer sentence
_MAX_NAME = 200  # characters of a name in such a sentence; an escaped one counts as four or more


def _shortened(sentence: str) -> str:
    """At most 1105 characters. A name may be as long as its file: its middle is cut first, because the place, the fault
    and the cure stand around it."""
    if len(sentence) <= _HEAD + _TAIL:
        return sentence
    sentence = re.sub(r'"[^"]+"|\S+', _clipped, sentence)
    if len(sentence) <= _HEAD + _TAIL:
        return sentence
    return f"{sentence[:_HEAD]} ... {sentence[-_TAIL:]}"


def _clipped(name: re.Match[str]) -> str:
    half = _MAX_NAME // 2
    return name[0] if len(name[0]) <= _MAX_NAME else f"{name[0][:half]}...{name[0][-half:]}"


class FtprocError(Exception):
    """Base of all errors with a message for the user.

    `exit_code` is that of the command line: 1 for input that cannot be processed.
    """

    exit_code = 1

    def __init__(self, sentence: str) -> None:
        super().__init__(_shortened(printable(sentence)))


class FtprocWarning(UserWarning):
    """A remark for the user that does not stop the work."""


class InputError(FtprocError):
    """A log, truth, trajectory or other input cannot be processed."""


class InstallationError(FtprocError):
    """The installation lacks something that this run needs."""


class ModelError(InputError):
    """A file is not a correction model, or is a model for another method or other features."""


class OutputError(FtprocError):
    """A result cannot be written to its target."""


class UsageError(FtprocError):
    """Options that contradict each other or name something unknown."""

    exit_code = 2


def nearest(word: str, known: Iterable[str], alike: float = 0.6) -> str:
    """`; did you mean "..."?` for the known word most similar to `word`, or an empty string.

    alike: the smallest similarity (difflib's ratio) that counts.
    """
    import difflib

    by_lower = {name.lower(): name for name in known}
    close = difflib.get_close_matches(word.lower(), by_lower, n=1, cutoff=alike)
    return f'; did you mean "{by_lower[close[0]]}"?' if close else ""


def quoted(text: str) -> str:
    """As a shell takes it."""
    import shlex

    return shlex.quote(text)


def row_named(row: int) -> str:
    """A row of a file for messages, by the 0-based number that the `row` column of a trajectory has."""
    return f"row {row} (the first data row is 0)"


def first_line(error: BaseException) -> str:
    """What an error of another library says, short enough for a sentence; its kind if it says nothing."""
    lines = str(error).split("\n")
    return next((line[:200] for line in lines if line.strip()), type(error).__name__)


def interruption(error: BaseException) -> BaseException | None:
    """The KeyboardInterrupt or SystemExit that an error is or is caused by, or None.

    A signal that arrives while a compiled kernel returns is raised as a SystemError with the interruption as its cause.
    """
    return next((cause for cause in _causes(error) if isinstance(cause, KeyboardInterrupt | SystemExit)), None)


_NO_MEMORY = (
    *("annot allocate memory", "bad_alloc", "malloc of size", "realloc of size"),
    "failed to map segment",  # of a library that is loaded
)
_NUMBA_CACHE = "numba/core/caching.py"  # where numba reads and writes it, in a traceback
_NO_PROCESS = ("Resource temporarily unavailable", "can't start new thread")


def _causes(error: BaseException) -> Iterator[BaseException]:
    """An error, and those that it was raised from; an error may be raised from itself."""
    cause: BaseException | None = error
    found: list[BaseException] = []
    while cause is not None and cause not in found:
        found.append(cause)
        yield cause
        cause = cause.__cause__


def _short_of_memory(error: BaseException) -> bool:
    """Whether memory is at the bottom of an error, whatever it says itself; or there are no more processes."""
    return any(words in str(error) for words in _NO_PROCESS) or any(
        isinstance(cause, MemoryError)
        or (not isinstance(cause, FtprocError) and any(words in str(cause) for words in _NO_MEMORY))
        for cause in _causes(error)
    )


def stdout_fault(error: OSError, lost: str = "the result is lost") -> str:
    """The sentence for a standard output that takes nothing more. lost: what is, and what is not."""
    if error.errno == errno.ETIMEDOUT:
        return f"standard output: its reader takes nothing, so {lost}; read it, or send it to a file."
    if error.errno == errno.EBADF:
        return f"standard output is closed, so {lost}; leave it open, or send it to a file."
    return f"standard output: {(error.strerror or str(error)).lower()}, so {lost}; send it elsewhere."


def _has_directory() -> bool:
    """Whether the directory that the program was started in is still there."""
    try:
        return bool(os.getcwd())  # noqa: PTH109
    except FileNotFoundError:
        return False


@dataclass(frozen=True)
class Failure:
    """Why something was not done: a message for the user, the exit code, and the traceback."""

    message: str
    exit_code: int
    trace: str


def failure(error: BaseException, source: str | None = None) -> Failure:
    """The message for any error; it names `source` unless the error names it."""
    import traceback

    short = _short_of_memory(error)
    if short:
        traceback.clear_frames(error.__traceback__)  # frees the memory for the next log
    trace = "".join(traceback.format_exception(error))
    about = f"{source}: " if source else ""
    if short:
        return Failure(f"{about}there is not enough memory for it. Use fewer --jobs, or split the log.", 1, trace)
    if isinstance(error, FtprocError):
        return Failure(str(error), error.exit_code, trace)
    if isinstance(error, RuntimeError) and "no locator available" in str(error):
        cure = "Set NUMBA_CACHE_DIR to a directory that can be written to."
        return Failure(f"the compiled kernels cannot be kept anywhere. {cure}", 1, trace)
    if _NUMBA_CACHE in trace.replace("\\", "/"):
        cure = "Delete its .nbi and .nbc files, or set NUMBA_CACHE_DIR to another directory."
        reason = first_line(error)
        return Failure(f"numba's cache of kernels is damaged, or cannot be kept ({reason}). {cure}", 1, trace)
    if isinstance(error, OSError) and error.errno in (errno.EMFILE, errno.ENFILE):
        return Failure("too many files are open. Raise the limit (ulimit -n), or use fewer --jobs.", 1, trace)
    if isinstance(error, FileNotFoundError) and not _has_directory():
        return Failure("the working directory was deleted; change to one that is there.", 1, trace)
    if isinstance(error, OSError) and error.strerror:
        where = error.filename or source
        return Failure(f"{where}: {error.strerror.lower()}." if where else stdout_fault(error), 1, trace)
    kind = f"{type(error).__name__}: {error}".splitlines()[0][:200]
    return Failure(f"{about}internal error ({kind}); run again with --debug and report it.", 1, trace)
