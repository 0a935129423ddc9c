"""The parts of the pages that commands write, by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from tests.docs.shell import Shell

TIMED = "  time "  # the line of a summary that is another at every run
CUT = "..."


class Block(NamedTuple):
    """commands: those whose outputs the block shows, as a reader types them. shown: makes the Markdown of commands and
    outputs. before: commands that make the files they need. slow: takes minutes, and is made only when asked for.
    needs: variable of the environment without which it is made only when named."""

    commands: tuple[str, ...]
    shown: Callable[[Sequence[str], Sequence[str]], str]
    before: tuple[str, ...] = ()
    slow: bool = False
    needs: str = ""

    def text(self, name: str, shell: Shell) -> str:
        """The Markdown that the commands make now. Raises RuntimeError when one of them fails."""
        for command in self.before:
            shell.output(command)
        outputs = [shell.slow_output(c, name) if self.slow else shell.output(c) for c in self.commands]
        return self.shown(self.commands, outputs)


def _session(only: tuple[str, ...], commands: Sequence[str], outputs: Sequence[str]) -> str:
    """What stands in a terminal. only: how the lines of the last output begin that are shown; empty for all."""
    lines = ["```text"]
    for command, output in zip(commands, outputs, strict=True):
        lines += [f"$ {command}", *_cut(output, only if command == commands[-1] else ())]
    return "\n".join([*lines, "```\n"])


def _cut(output: str, only: tuple[str, ...]) -> list[str]:
    """The lines of an output without the time it took. Where others are left out, also those without a figure, stands
    CUT."""
    found: list[str] = []
    for line in output.rstrip().splitlines():
        kept = not only or (line.strip().startswith(only) and not line.endswith(" -"))
        if not line.startswith(TIMED) and (kept or found[-1:] != [CUT]):
            found.append(line.rstrip() if kept else CUT)
    return found


def _table(note: str, without: str, commands: Sequence[str], outputs: Sequence[str]) -> str:
    """The one Markdown table in the output, but for one column, and the command that printed it."""
    (command,), (output,) = commands, outputs
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in output.splitlines() if line[:1] == "|"]
    columns = [k for k, title in enumerate(rows[0]) if title != without]
    lines = ["| " + " | ".join(row[k] for k in columns) + " |" for row in rows]
    return "\n".join([*lines, "", f"Printed by `{command}`{note}.\n"])


def _as_it_is(commands: Sequence[str], outputs: Sequence[str]) -> str:
    """Markdown already."""
    return "\n".join(outputs)


def session(*commands: str, only: tuple[str, ...] = (), before: tuple[str, ...] = (), slow: bool = False) -> Block:
    """Commands as they are typed, with what they print."""
    return Block(commands, partial(_session, only), before, slow)


def table(command: str, slow: bool = True, note: str = "", without: str = "", needs: str = "") -> Block:
    """A table that a command prints."""
    return Block((command,), partial(_table, note, without), slow=slow, needs=needs)


SIMULATE = "ftproc simulate --scenario zuo2021-outliers --seed 3 -o flight.csv --truth flight.truth.csv"
FILTER = "ftproc filter flight.csv --smooth"
SCORE = "ftproc score flight.trajectory.csv --truth flight.truth.csv"
ERRORS = (
    "azimuth_zero_mrad=0.3,elevation_zero_mrad=-0.2,mislevel_mrad=0.6,mislevel_azimuth_rad=0.7,"
    "collimation_mrad=0.4,refraction=2.8e-4"
)
FLY, NEXT = (
    f"ftproc simulate --scenario calibration --seed {seed} --duration {duration_s} \\\n"
    f"    -o {name}.csv --truth {name}.gps.csv --instrument \\\n    {ERRORS}"
    for name, seed, duration_s in (("circle", 1, 600), ("next", 2, 200))
)
TRAIN = "ftproc train --log circle.csv --truth circle.gps.csv -o theodolite.safetensors"
RANGE = "ftproc simulate --scenario range-radar --seed 7 --duration 60 -o range --truth range/truth.parquet"
FUSE = "ftproc filter --fuse range/range.toml --smooth -o best.parquet"
FLIGHTS = tuple(
    f"mkdir -p flights && ftproc simulate --scenario {scenario} --seed 3 -o flights/{name}.csv"
    for name, scenario in (("aerobatics", "manoeuvre"), ("climb", "zuo2021-outliers"), ("transit", "cruise"))
)
NIGHT = "ftproc filter 'flights/*.csv' -o clean/ --summary line"
STUDY = "ftproc train --scenario manoeuvre-clean --jerk 0.1 --editing none --compare-starts"
TIMES = "; times vary from machine to machine"
COUNTS = "; how many files are mutated in its time varies from machine to machine"
DIGITS = "; the last digits vary from machine to machine"

BLOCKS = {
    "simulate": session(SIMULATE, "head -n 4 flight.csv"),
    "filter": session(FILTER, before=(SIMULATE,)),
    "score": session(
        SCORE, before=(SIMULATE, FILTER),
        only=("flight", "position RMSE", "position along", "velocity RMSE", "position in", "velocity in", "the sigmas"),
    ),
    "limits": session(f"{SCORE} --require ed-117", before=(SIMULATE, FILTER), only=("PASS", "FAIL", "source")),
    "two-runs": session(
        "ftproc filter flight.csv -o first.csv --summary none",
        "ftproc filter flight.csv --noise 2,1e-4,1e-4 -o second.csv --summary none",
        "ftproc score first.csv second.csv", before=(SIMULATE,),
        only=("second.csv against", "position   ", "differs", "decisions", "settings"),
    ),
    "fuse-score": session(RANGE, FUSE, "ftproc score best.parquet --truth range/truth.parquet"),
    "train": session(FLY, TRAIN, only=("filter:", "smoother:", "Position error")),
    "train-use": session(
        "ftproc filter next.csv --smooth --model none -o plain.csv --summary none",
        "ftproc filter next.csv --smooth --model theodolite.safetensors -o corrected.csv --summary none",
        "ftproc score plain.csv corrected.csv --truth next.gps.csv",
        before=(FLY, TRAIN, NEXT), only=("plain", "mean position", "position RMSE", "velocity RMSE", "95 %"),
    ),
    "night": session(NIGHT, before=FLIGHTS),
    "again": session(f"{NIGHT} --table night.csv", before=(*FLIGHTS, NIGHT)),
    "list-methods": session("ftproc filter --list-methods"),
    "all-methods": session(
        "ftproc filter flight.csv --method all -o methods --summary none",
        "ftproc score methods/*.csv --truth flight.truth.csv",
        before=(SIMULATE,),
    ),
    "samples": table("python -m tests.bench samples", slow=False),
    "accuracy": table("python -m tests.bench accuracy"),
    "sigmas": table("python -m tests.bench sigmas"),
    "motions": table("python -m tests.bench motions"),
    "tracks": table('python -m tests.bench.tracks "$TRACKS"', needs="TRACKS"),
    "instruments": table("python -m tests.bench instruments"),
    "zuo2021": table("python -m tests.acceptance.zuo2021"),
    "correction": table("python -m tests.bench correction", note=DIGITS),
    "network": table("python -m tests.bench network", note=DIGITS),
    "starts": session(STUDY, slow=True),
    "speed": table("python -m tests.bench speed", note=TIMES, without="bound"),
    "start": table("python -m tests.bench start", note=TIMES, without="bound"),
    "scale": table("FTPROC_BENCH_ROWS=1e7 python -m tests.bench scale", note=TIMES, without="bound"),
    "live": table("FTPROC_BENCH_ROWS=1e6 python -m tests.bench live", note=TIMES, without="bound"),
    "security": table("python -m tests.trust security", note=COUNTS),
    "verdicts": table("python -m tests.trust.verdicts 0-19", without="seconds"),
    "hard": table("python -m tests.trust.hard 0-4", without="seconds"),
    "fused-faults": table("python -m tests.trust.fused_faults 0-0", without="seconds"),
    "reference": Block(("python -m tests.docs.reference",), _as_it_is),
}  # fmt: skip
