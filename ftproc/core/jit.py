"""How the kernels are compiled, once: cached on disk, no Python errors inside, sums in any order (but NaN stays NaN,
which stands for a missing reading)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F) -> F:
    """Compile a function of numbers and arrays; to a type checker it stays what it was."""
    compiled: Any = njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "arcp", "nsz"})(function)
    return cast(F, compiled)
