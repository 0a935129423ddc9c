"""Start-up time of the commands that run kernels. Only a process of our own may do this, never the library."""

from __future__ import annotations

import sys


def spare_blas() -> None:
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
