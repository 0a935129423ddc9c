"""Reading a file in a process of its own first: a library in C may never come back from a damaged one, or end the
process that calls it."""

from __future__ import annotations

import contextlib
import faulthandler
import os
import signal
import time
import warnings
from collections.abc import Callable
from pathlib import Path

from ftproc.errors import InputError
from ftproc.files.reading.formats import content

_LONGEST_S, _BYTES_A_SECOND = 5.0, 10 << 20  # for any file, and for a large one in addition
#: What ends the copy, and nobody hears; Windows, where there is no copy, has not all of them.
_SIGNALS = ("SIGINT", "SIGTERM", "SIGSEGV", "SIGABRT", "SIGBUS", "SIGFPE", "SIGILL")
_FIRST_POLL_S, _LONGEST_POLL_S = 2e-4, 0.002


def rehearse(path: Path, room_name: str, kind: str, read: Callable[[], object]) -> None:
    """Call `read` in a copy of this process. Raises InputError if that is ended by a signal or takes too long; an
    exception there comes again when the file is read here."""
    if not hasattr(os, "fork"):
        return
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of other threads, which the copy does not have and does not need
        child = os.fork()
    if not child:
        _read_and_end(read)
    status = None
    try:
        status = _ended(child, time.monotonic() + _LONGEST_S + content.size(path) / _BYTES_A_SECOND)
    finally:
        if status is None:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
    if status != 0:
        why = "it comes to no end" if status is None else f"its reader ends with {os.waitstatus_to_exitcode(status)}"
        raise InputError(f"{room_name}: not {kind}, or a damaged one ({why}); copy it again.")


def _read_and_end(read: Callable[[], object]) -> None:
    with contextlib.suppress(BaseException):
        for name in _SIGNALS:
            signal.signal(getattr(signal, name), signal.SIG_DFL)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # the library's last words, and ours about them
        faulthandler.disable()
        read()
    os._exit(0)


def _ended(child: int, until: float) -> int | None:
    """The status of a process; None if it has not ended in time."""
    pause_s = _FIRST_POLL_S
    while time.monotonic() < until:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return status
        time.sleep(pause_s)
        pause_s = min(2 * pause_s, _LONGEST_POLL_S)
    return None
