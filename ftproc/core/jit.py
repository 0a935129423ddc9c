"""How the kernels are compiled, once: no Python errors inside, sums in any order (but NaN stays NaN, which stands for
a missing reading).

A `kernel` is called from Python, and its machine code is kept on disk. A `part` is only called by kernels, into which
it is compiled; keeping it too would cost every process a look at the disk. numba does not see that a kernel in one
file is stale when a part in another has changed: `make` clears what was kept when anything here changes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

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
