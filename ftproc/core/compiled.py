"""How the kernels are compiled, and the records that they work on.

A `kernel` is called from Python, and its machine code is kept on disk. A `part` is only called by kernels, into which
it is compiled; keeping it too would cost every process a look at the disk. numba does not see that a kernel in one
file is stale when a part in another has changed: `make` clears what was kept when anything here changes.

No Python errors inside; a product and a sum may become one operation, but sums keep their order, so that a kernel gives
the same digits wherever its parts stand.

A filter's state and all that its update needs lie in one record: the compiler knows where each array begins and how
large it is, and that no two overlap. With separate arrays the passes take twice as long.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any, TypeVar, cast, get_type_hints

import numba
import numpy as np
from numba import njit

COMPILING = "compiling the kernels once (about half a minute)..."

F = TypeVar("F", bound=Callable[..., Any])

NOT_COMPILED = bool(numba.config.DISABLE_JIT)  # type: ignore[attr-defined]

HOW: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}}


def kernel(function: F) -> F:
    """Compile a function that Python calls, while other threads go on; to a type checker it stays what it was."""
    compiled: Any = njit(cache=True, nogil=True, **HOW)(function)
    return cast(F, compiled)


def part(function: F) -> F:
    """Compile a function that kernels call."""
    compiled: Any = njit(**HOW)(function)
    return cast(F, compiled)


def record(kind: type) -> np.dtype[np.void]:
    """The memory layout of the records that `kind` describes: a class of numbers and float64 arrays, each annotated
    with its shape, such as `x: Annotated[FloatArray, 9]`."""
    hints = get_type_hints(kind, include_extras=True)
    return np.dtype([(name, np.float64, getattr(hint, "__metadata__", ())) for name, hint in hints.items()])


def zeros(layout: np.dtype[np.void], count: int = 1) -> Any:
    """`count` records in one array, all zero. For kernels fields are attributes; elsewhere `records["x"]` is the array
    (count, ...) of a field."""
    made = np.zeros(count, layout)
    return made.view(np.recarray) if NOT_COMPILED else made


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
