"""`python -m ftproc.cli.warm` compiles all kernels, so that the first `ftproc filter` does not wait for them."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from typing import Any

from ftproc.core.compiled import announced


def warm() -> None:
    """Filter a small log in every way that has its own kernels; only the first estimates the noise."""
    from dataclasses import replace

    from ftproc import pipeline
    from ftproc.files.reading import logs
    from ftproc.methods import registry
    from ftproc.settings import FilterSettings
    from ftproc.simulation import simulate

    log = _as_read(simulate("manoeuvre", duration_s=20.0).log, logs.read)
    known = FilterSettings(noise=(5.0, 2e-4, 2e-4), jerk_psd_m2ps5=1.0, particles=90)
    paths: list[dict[str, Any]] = [
        {"editing": "forward"},
        {"editing": "forward", "gain_form": True},
        *({"method": m.name} for m in registry.METHODS.values() if registry.obstacle(m, False, None) is None),
    ]
    for settings in (FilterSettings(smooth=True), *(replace(known, **path) for path in paths)):
        pipeline.filter_log(log, settings)


def _as_read(log: Any, read: Callable[..., Any]) -> Any:
    """The log as read from a file: kernels are compiled for each memory layout of their arrays."""
    import pyarrow as pa

    names = ("time_s", "range_m", "azimuth_rad", "elevation_rad")
    measurement = log.measurement.copy()
    measurement[log.time_s < log.time_s[0] + 5.0] = math.nan  # the filter starts late; what is before is extrapolated
    return read(pa.table(dict(zip(names, (log.time_s, *measurement.T.copy()), strict=True))))


def main() -> None:
    """Fill numba's cache; messages go to standard error."""
    started = time.monotonic()
    with announced(lambda text: print(text, file=sys.stderr, flush=True)):
        warm()
    print(f"the kernels are ready ({time.monotonic() - started:.0f} s)", file=sys.stderr)


if __name__ == "__main__":
    main()
