"""What the process is given by its parent: standard streams that may be closed, and signals that end it."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from ftproc.errors import OutputError, UsageError, stdout_fault
from ftproc.files.writing import streams

#: Each ends the program through every `finally`, so that no partial output remains.
_ENDING = ("SIGTERM", "SIGHUP", "SIGQUIT", "SIGXCPU")


def end_by_signals() -> None:
    """End with 128 + the signal's number, as a shell reports it. A signal that the parent ignores stays ignored, as
    `nohup` wants."""
    for name in _ENDING:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _ended)


def _ended(signum: int, frame: object) -> None:
    sys.exit(128 + signum)


def open_streams() -> None:
    """Streams that write all that they are given, at once, or fail; messages that standard error does not take are
    dropped. Nothing is left for Python to write at exit.

    The descriptors of streams that are closed are occupied, so that no file that is opened later gets one, and receives
    what belongs to the stream. Reading a closed input and writing a closed output fail with EBADF.
    """
    for descriptor, mode in ((0, os.O_WRONLY), (1, os.O_RDONLY), (2, os.O_WRONLY)):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, mode)  # the lowest descriptor that is free
    if sys.stdin is None:
        sys.stdin = open(0, closefd=False)  # noqa: SIM115
    if sys.stdout is None:
        sys.stdout = open(1, "w", closefd=False)  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(2, "w", closefd=False)  # noqa: SIM115
    sys.stdout, sys.stderr = streams.text(sys.stdout), streams.text(sys.stderr, lost=True)


def check_directory() -> None:
    """Raise UsageError if the current directory is there no more: names that are relative to it mean nothing, and the
    system blames whatever file is sought."""
    try:
        Path.cwd()
    except OSError as error:
        raise UsageError(
            "the current directory is there no more (deleted, or moved away); change to another one with cd, and run "
            "again."
        ) from error


def unsaid(error: OSError, whole: Sequence[str], what: str = "summary") -> Exception:
    """The error for what could not be printed about files that are whole; that of a reader that has left stays."""
    if isinstance(error, BrokenPipeError) or not whole:
        return error
    kept = f"{whole[0]} is whole" if len(whole) == 1 else f"the {len(whole)} files written before are whole"
    return OutputError(stdout_fault(error, f"only the {what} is lost, and {kept}"))


def leave_memory() -> None:
    """What is still held at the end goes back to the system anyway. Python would first search all of it for
    cycles, which takes a tenth of the time of a small log."""
    gc.freeze()
