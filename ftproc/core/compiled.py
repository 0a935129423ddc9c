"""How the kernels are compiled, once: no Python errors inside, sums in any order (but NaN stays NaN, which stands for
a missing reading).

A `kernel` is called from Python, and its machine code is kept on disk. A `part` is only called by kernels, into which
it is compiled; keeping it too would cost every process a look at the disk. numba does not see that a kernel in one
file is stale when a part in another has changed: `make` clears what was kept when anything here changes.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any, TypeVar, cast

from numba import njit

COMPILING = "compiling the kernels once (about half a minute)..."

F = TypeVar("F", bound=Callable[..., Any])

HOW: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "reassoc", "arcp", "nsz"}}


def kernel(function: F) -> F:
    """Compile a function that Python calls, while other threads go on; to a type checker it stays what it was."""
    compiled: Any = njit(cache=True, nogil=True, **HOW)(function)
    return cast(F, compiled)


def part(function: F) -> F:
    """Compile a function that kernels call."""
    compiled: Any = njit(**HOW)(function)
    return cast(F, compiled)


@contextlib.contextmanager
def announced(say: Callable[[str], None] | None) -> Iterator[None]:
    """Inside the block, `say` is called once with a line for the user if a kernel of ftproc has to be compiled.

    numba itself is listened to: no other sign knows for sure which kernels its cache holds for these sources,
    this processor and this version, or where it keeps them when the installation is read-only.
    """
    if say is None:
        yield
        return
    tell = say
    from numba.core import event

    class Listener(event.Listener):
        def __init__(self) -> None:
            self.said = False

        def on_start(self, started: Any) -> None:
            function = started.data["dispatcher"].py_func
            if not self.said and str(function.__module__).startswith("ftproc."):
                self.said = True
                tell(COMPILING)

        def on_end(self, ended: Any) -> None:
            pass

    with event.install_listener("numba:compile", Listener()):
        yield
