"""The filter under a fuzzer: bytes -> settings and a log of any readings at any times -> a trajectory that is judged.

With the just-in-time compiler off (NUMBA_DISABLE_JIT=1) a fuzzer sees the kernels' branches; with it on they are the
kernels that are used. The same bytes mean the same in both.
"""

from __future__ import annotations

import itertools
import random
import warnings
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

import numpy as np

from ftproc import pipeline
from ftproc.correction import model_file
from ftproc.methods import live
from ftproc.quality import sanity
from ftproc.records import MeasurementLog
from ftproc.settings import FilterSettings
from tests.trust import cases

_HEAD, _ROW, _MOST_ROWS = 6, 7, 40
_MISSING, _HUGE = -32768, 32767
_STRETCH = 7  # samples, of a recursion that goes from stretch to stretch


def check(path: Path) -> None:
    """Finite states, positive sigmas, known labels, and the same in stretches; or a sentence that refuses the log."""
    content = path.read_bytes()
    if (log := decoded(content, path.name)) is None:
        return
    settings = _settings(content)
    model = model_file.named("packaged") if content[0] & 8 else None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # where the compiler is off, of what numba does in silence
        found = pipeline.filter_log(log, settings, model)
        cases.judge_trajectory(found)
        assert set(np.unique(found.outlier)) <= {0, 1, 2, 3}, "labels that are none"
        assert ((found.outlier == 3) == np.isnan(log.measurement)).all(), "missing is not what is missing"
        with mock.patch.object(live.parts, "__defaults__", (_STRETCH,)):
            again = pipeline.filter_log(log, settings, model)
    for name in ("state", "sigma", "nis", "outlier", "correction"):
        one, other = getattr(found, name), getattr(again, name)
        assert np.array_equal(one, other, equal_nan=True), f"{name} is not the same in stretches"


def decoded(content: bytes, name: str) -> MeasurementLog | None:
    """Up to 40 rows: a byte of delay and three readings of two bytes each, in units that the head chooses."""
    n = min((len(content) - _HEAD) // _ROW, _MOST_ROWS)
    if n < 1:
        return None
    rows = np.frombuffer(content, np.uint8, n * _ROW, _HEAD).reshape(n, _ROW)
    steps = np.ascontiguousarray(rows[:, 1:]).view("<i2").astype(float)
    delay = rows[:, 0] * 10.0 ** (content[1] % 8 - 5)  # from 1e-5 to 25,500 s
    lengths = 5000.0 + steps[:, 0] * 10.0 ** (content[2] % 10 - 4)
    angles = steps[:, 1:] * np.pi / 2**15 * 10.0 ** -(content[3] % 6)
    measurement = np.column_stack([lengths, angles])
    measurement[steps == _MISSING] = np.nan
    measurement[steps == _HUGE] = 10.0 ** (content[4] % 200)
    if np.isnan(measurement).all():
        return None
    return MeasurementLog(name, np.cumsum(delay), measurement, np.arange(n))


_EDITING = [way for way in sanity.EDITING if way != "live"]  # which is never smoothed


def _settings(content: bytes) -> FilterSettings:
    flags, scale = content[0], content[5]
    return FilterSettings(
        smooth=bool(flags & 1),
        editing=_EDITING[flags // 16 % 3],
        noise=(10.0 ** (scale % 8 - 4), 10.0 ** -(scale % 6), 10.0 ** -(scale % 5)) if flags & 2 else None,
        jerk_psd_m2ps5=10.0 ** (scale // 16 - 6) if flags & 4 else None,
    )


def seeds() -> Iterator[bytes]:
    """A plain flight, a wild one and noise under each of the settings."""
    draw = random.Random(0)
    for flags, wild in itertools.product((0, 1, 3, 7, 15, 17, 23, 33), (0.0, 0.2, 1.0)):
        body = b""
        for k in range(12):
            steps = (40 * k, 30 * k, -20 * k)
            odd = [draw.randint(-32768, 32767) if draw.random() < wild else step for step in steps]
            body += bytes([100]) + np.array(odd, "<i2").tobytes()
        yield bytes([flags, 4, 4, 1, 12, 100]) + body
