"""What a user waits for: the first run after an installation, small logs, and a log that is nearly half outliers."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ftproc.files.writing import flights
from ftproc.simulation import simulate
from tests.bench import measuring
from tests.bench.scale import LIBRARIES, made

ROOT = Path(__file__).parents[2]
HEADER = ("what", "time", "ratio", "to", "bound")
ROUNDS = 9
WORST = "offset=18:8-40:8-200,ramp=5:10-30:20-200"  # 40 % of the readings of each component lie in patches
COMPILER = ("numba", "llvmlite")


def rows() -> Iterator[tuple[str, ...]]:
    """A new environment, then this one."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        small = folder / "61.csv"
        flights.write_log(simulate("zuo2021-outliers", seed=1).log, small)
        made(folder, 5000)
        yield from _installed(folder, small)
        reference = [sys.executable, "-c", LIBRARIES]
        for rows_in_log, log in (("61", small), ("5,000", folder / "5000.csv")):
            command = [sys.executable, "-m", "ftproc", "filter", str(log), "-o", str(folder / "o.parquet")]
            taken = measuring.processes({"ours": command, "libraries": reference}, ROUNDS)
            ours, theirs = taken["ours"].seconds, taken["libraries"].seconds
            bound = "<= 2.5" if log is small else "<= 3"
            yield f"{rows_in_log} rows, warm", f"{ours:.3g} s", f"{ours / theirs:.2f}", f"`{LIBRARIES}`", bound
        worst = folder / "worst.csv"
        flights.write_log(simulate("manoeuvre", seed=1, duration_s=60.0, outliers=WORST).log, worst)
        command = [sys.executable, "-m", "ftproc", "filter", str(worst), "-o", str(folder / "o.parquet")]
        seconds = measuring.processes({"worst": command}, 3)["worst"].seconds
        yield "1,200 rows, 40 % in patches", f"{seconds:.3g} s", "", "", "<= 2 s"


def _installed(folder: Path, log: Path) -> Iterator[tuple[str, ...]]:
    """The first runs in a new environment, with nothing kept of earlier ones."""
    python = folder / "new" / "bin" / "python"
    subprocess.run([sys.executable, "-m", "venv", folder / "new"], check=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", ROOT], check=True)
    for what, more, bound in (("first run after `pip install .`", (), "<= 3 s"),
                              ("first run of another method", ("--method", "imm-ukf"), "<= 2 s")):  # fmt: skip
        command = [str(python), "-m", "ftproc", "filter", str(log), "-o", str(folder / "o.parquet"), *more]
        yield what, f"{measuring.processes({what: command}, 0)[what].seconds:.3g} s", "", "", bound
    listed = subprocess.run([python, "-m", "pip", "list"], check=True, capture_output=True, text=True).stdout
    found = [name for name in COMPILER if name in listed.split()]
    yield f"{' and '.join(COMPILER)} installed for it", " ".join(found) or "none", "", "", "none"
