"""Each attack in a process of its own: `python -m tests.trust.attacks.running [SEED] [WORDS OF A NAME]`.

An attack is lost when the program takes more than MOST_S or MOST_MB, is ended by a signal, prints an internal error, a
traceback or a warning of a library, says nothing, or does other than the attack says.
"""

from __future__ import annotations

import os
import random
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from tests.trust.attacks import binaries, hdf5, standards, texts
from tests.trust.attacks.attack import Attack

MOST_S, MOST_MB = 10.0, 1500
_LONGEST_S = 60  # for a machine that does other things too
_ADDRESSES = 6 << 30  # bytes
_LARGEST = 1_000_000  # bytes of a file for which the limits hold


def all_attacks(seed: int = 0) -> Iterator[Attack]:
    """Every attack of every generator."""
    for generator in (*texts.ALL, *binaries.ALL, *hdf5.ALL, *standards.ALL):
        yield from generator(random.Random(f"{seed} {generator.__name__}"))


def lost(attack: Attack) -> str:
    """What is wrong with the program under an attack, or ""."""
    with tempfile.TemporaryDirectory() as directory:
        place = Path(directory)
        name = attack.make(place)
        small = all(path.stat().st_size <= _LARGEST for path in place.iterdir() if path.is_file())
        out = place / "out"
        out.mkdir()
        code, seconds, megabytes, said = _run(place, ["filter", name, "-o", "out/a.parquet", *attack.args])
        made = (out / "a.parquet").exists()
    for words in ("Traceback", "internal error", "Warning:", "not enough memory"):
        if words in said:
            return f"{words}: {said[-600:]}"
    if code not in (0, 1, 2):
        return f"ended with {code}: {said[-300:]}"
    if small and (seconds > MOST_S or megabytes > max(MOST_MB, own_mb())):
        return f"took {seconds:.1f} s and {megabytes} MB: {said[-300:]}"
    if (code == 0) != made or (code and not said.strip()):
        return f"exit code {code}, {'a' if made else 'no'} result: {said[-300:]}"
    if attack.reads is not None and attack.reads != (code == 0):
        return f"was {'refused' if code else 'read'}: {said[-300:]}"
    return "" if attack.says in said else f'does not say "{attack.says}": {said[-300:]}'


def own_mb() -> int:
    """The most memory of this process, which counts as a child's until that has begun."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10


def _run(place: Path, arguments: list[str]) -> tuple[int, float, int, str]:
    """Exit code, seconds of computing, megabytes, and what was printed."""
    log = place / "out" / "said"
    program = str(Path(sys.prefix) / "bin" / "ftproc")
    child = os.fork()
    if not child:
        os.chdir(place)
        resource.setrlimit(resource.RLIMIT_AS, (_ADDRESSES, _ADDRESSES))
        resource.setrlimit(resource.RLIMIT_CPU, (_LONGEST_S, _LONGEST_S))
        said = os.open(log, os.O_CREAT | os.O_WRONLY)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(said, 1)
        os.dup2(said, 2)
        os.execve(program, [program, *arguments], {**os.environ, "TMPDIR": str(place / "out"), "COLUMNS": "100"})
    until = time.monotonic() + 2 * _LONGEST_S
    while time.monotonic() < until:
        done, status, used = os.wait4(child, os.WNOHANG)
        if done:
            break
        time.sleep(0.02)
    else:  # it waits for something
        os.kill(child, signal.SIGKILL)
        _, status, used = os.wait4(child, 0)
    text = log.read_text(errors="replace") if log.exists() else ""
    return os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime, used.ru_maxrss >> 10, text


def run(seed: int = 0, words: str = "") -> tuple[int, list[str]]:
    """How many attacks were made, and a line for each that is lost."""
    count, lines = 0, []
    for attack in all_attacks(seed):
        if words in attack.name:
            count += 1
            if why := lost(attack):
                lines.append(f"attack {attack.name}: {why}")
    return count, lines


if __name__ == "__main__":
    tried, wrong = run(int(sys.argv[1]) if len(sys.argv) > 1 else 0, " ".join(sys.argv[2:]))
    print("\n".join([*wrong, f"{tried} attacks, {len(wrong)} lost"]))
    sys.exit(bool(wrong))
