"""The compiled kernels: saying so when they are being compiled, and compiling them all beforehand.

`python -m ftproc.warm` does the latter, so that the first `ftproc filter` does not stand still.
"""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

COMPILING = "compiling the kernels once (about half a minute)..."


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


def warm() -> None:
    """Run a small log through every path that has kernels of its own."""
    from dataclasses import replace

    from ftproc import pipeline
    from ftproc.files import logs
    from ftproc.settings import FilterSettings
    from ftproc.simulation import simulate

    log = _as_read(simulate("manoeuvre", duration_s=20.0).log, logs.read)
    paths = (
        {"smooth": True},
        {"editing": "forward"},
        {"editing": "forward", "gain_form": True},
        {"editing": "none"},
        {"method": "ekf"},
        {"method": "renpf"},
    )
    for path in paths:
        pipeline.filter_log(log, replace(FilterSettings(), **path))


def _as_read(log: Any, read: Callable[..., Any]) -> Any:
    """The log as it comes from a file: kernels are compiled for each memory layout of their arrays."""
    import pyarrow as pa

    names = ("time_s", "range_m", "azimuth_rad", "elevation_rad")
    return read(pa.table(dict(zip(names, (log.time_s, *log.measurement.T.copy()), strict=True))))


def main() -> None:
    """Fill numba's cache, telling on standard error."""
    began = time.monotonic()
    with announced(lambda text: print(text, file=sys.stderr, flush=True)):
        warm()
    print(f"the kernels are ready ({time.monotonic() - began:.0f} s)", file=sys.stderr)


if __name__ == "__main__":
    main()
