"""The plain UKF run in C (`ukf.c`), compiled on the spot when gcc is there."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.records import FilterRun, Model, Observations, Start

SOURCE = Path(__file__).with_name("ukf.c")
Filter = Callable[[Observations, Model, Start], FilterRun]
WIDTHS = (9, 9, 9, 3, 3, 3)  # state, predicted, sigma, innovation, innovation_sigma, weight


def compiled(folder: Path) -> Filter | None:
    """`forward.filter_log` for one jerk level and one start at the first sample, or None without gcc."""
    gcc = shutil.which("gcc")
    if gcc is None:
        return None
    library = folder / "ukf.so"
    subprocess.run([gcc, "-O3", "-march=native", "-shared", "-fPIC", "-o", library, SOURCE, "-lm"], check=True)
    function = ctypes.CDLL(str(library)).run
    function.restype = ctypes.c_double

    def run(log: Observations, model: Model, start: Start) -> FilterRun:
        n = len(log.time_s)
        taken = (*log[:3], model.noise_variance, model.jerk, start.state.copy(), start.covariance.copy())
        filled: list[NDArray[Any]] = [np.empty((n, width)) for width in WIDTHS]
        filled += [np.full(n, np.nan), np.empty((n, 6)), np.empty(n, np.int64)]  # nis, los_sigma, since_start
        assert all(array.flags.c_contiguous for array in (*taken, *filled))
        pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in (*taken, *filled)]
        likelihood = function(ctypes.c_int64(n), *pointers)
        filled.insert(-1, np.full((n, 6), np.nan))  # path_sigma
        return FilterRun._make([log.time_s, *filled, likelihood])

    return run
