"""The plain UKF run in C (`ukf.c`), compiled on the spot when gcc is there."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.records import FilterRun, Model, Start, empty_run

SOURCE = Path(__file__).with_name("ukf.c")
Array = NDArray[np.float64]
Filter = Callable[[Array, Array, Array, Model, Start], FilterRun]


def compiled(folder: Path) -> Filter | None:
    """`forward.filter_log` for one jerk level and one start at the first sample, or None without gcc."""
    gcc = shutil.which("gcc")
    if gcc is None:
        return None
    library = folder / "ukf.so"
    subprocess.run([gcc, "-O3", "-march=native", "-shared", "-fPIC", "-o", library, SOURCE, "-lm"], check=True)
    function = ctypes.CDLL(str(library)).run
    function.restype = ctypes.c_double

    def run(time_s: Array, measurement: Array, weight: Array, model: Model, start: Start) -> FilterRun:
        out = empty_run(time_s)
        given = (time_s, measurement, weight, model.noise_variance, model.jerk, start.state.copy())
        filled = (out.state, out.predicted, out.sigma, out.innovation, out.innovation_sigma, out.weight, out.nis)
        arrays = [*given, start.covariance.copy(), *filled, out.los_sigma, out.since_start]
        assert all(array.flags.c_contiguous for array in arrays)
        pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in arrays]
        return out._replace(log_likelihood=function(ctypes.c_int64(len(time_s)), *pointers))

    return run
