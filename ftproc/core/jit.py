"""How the kernels are compiled, once: cached on disk, no Python errors inside, sums in any order (but NaN stays NaN,
which stands for a missing reading)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])

kernel: Callable[[F], F] = njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "arcp", "nsz"})
