"""Start-up time of the commands that run kernels. Only a process of our own may do this, never the library."""

from __future__ import annotations

import gc
import sys


def hasten() -> None:
    """Do what makes the first result of a process come sooner; before numba is loaded."""
    gc.set_threshold(100_000, 50, 50)  # loading modules makes many objects and hardly any garbage
    _spare_blas()


def _spare_blas() -> None:
    """Keep numba from looking for SciPy's BLAS, which loads much of SciPy: no kernel here multiplies matrices by it.

    numba asks once, when its array functions are first needed, and takes "not there" for an answer.
    """
    name = "scipy.linalg.cython_blas"
    if name in sys.modules or "numba" in sys.modules:
        return
    sys.modules[name] = None  # type: ignore[assignment]
    try:
        import numba.np.arraymath  # noqa: F401
    finally:
        del sys.modules[name]
