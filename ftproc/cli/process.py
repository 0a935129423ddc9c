"""What the process is given by its parent: standard streams that may be closed, and signals that end it."""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import sys

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
    """Occupy the descriptors of standard streams that are closed, so that no file that is opened later gets one, and
    receives what belongs to the stream.

    Messages to a closed standard error are dropped. Reading a closed input and writing a closed output fail with EBADF.
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


def empty_stdout() -> None:
    """Discard what a standard output that is full or closed did not take: Python would try again at exit, and fail."""
    try:
        sys.stdout.flush()
    except OSError:
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def leave_memory() -> None:
    """What is still held at the end goes back to the system anyway. Python would first look through all of it for
    cycles, which takes a tenth of the time of a small log."""
    gc.freeze()
