"""The units, lines and recipes of the page on batches do what the page says: they are run as they stand there, in
another directory and with this program."""

from __future__ import annotations

import configparser
import os
import re
import shlex
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ftproc.files.writing import flights
from ftproc.simulation import simulate
from tests.docs.shell import ROOT

PAGE = (ROOT / "ftproc" / "batch" / "README.md").read_text(encoding="utf-8")
FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
TIMEOUT_S = 300


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """Three short logs in `flights`, and a program in `bin` that is this one."""
    (tmp_path / "flights").mkdir()
    for number in range(3):
        flights.write_log(simulate("zuo2021-outliers", seed=number).log, tmp_path / "flights" / f"{number}.csv")
    program = tmp_path / "bin" / "ftproc"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nPYTHONPATH={ROOT} exec {sys.executable} -P -m ftproc "$@"\n')
    program.chmod(0o755)
    return tmp_path


def block(section: str, kind: str, number: int = 0) -> str:
    """A fenced block below a heading of the page."""
    below = PAGE.partition(f"\n## {section}\n")[2].partition("\n## ")[0]
    return [text for found, text in FENCED.findall(below) if found == kind][number]


def here(text: str, place: Path) -> str:
    return text.replace("/srv/range", str(place)).replace("/opt/ftproc", str(place))


def run(command: str | list[str], place: Path, shell: bool = False) -> subprocess.CompletedProcess[str]:
    path = f"{place}/bin:/usr/bin:/bin"
    return subprocess.run(
        command, cwd=place, env={"PATH": path}, shell=shell, capture_output=True, text=True, timeout=TIMEOUT_S
    )


def done(place: Path) -> list[str]:
    return sorted(path.name for path in (place / "clean").glob("*.trajectory.csv"))


ALL = [f"{number}.trajectory.csv" for number in range(3)]


def test_the_unit(place: Path) -> None:
    """systemd starts no shell, so nothing replaces the pattern before the program."""
    unit = configparser.ConfigParser(interpolation=None)
    unit.optionxform = str  # type: ignore[method-assign,assignment]
    unit.read_string(here(block("Every night: systemd", "ini"), place))
    assert unit["Service"]["WorkingDirectory"] == str(place)
    command = shlex.split(unit["Service"]["ExecStart"])
    result = run(command, place)
    assert (result.returncode, result.stderr) == (0, "")
    assert done(place) == ALL
    assert (place / "clean" / "night.html").exists()
    assert "3 finished before" in run(command, place).stdout
    assert "0.trajectory" not in "".join(line for line in result.stdout.splitlines() if not line.startswith("flights/"))


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="there is no systemd")
def test_systemd_accepts_unit_and_timer(place: Path) -> None:
    for number, kind in enumerate(("service", "timer")):
        text = here(block("Every night: systemd", "ini", number), place).replace("User=range\n", "")
        (place / f"ftproc-night.{kind}").write_text(text)
    for kind in ("service", "timer"):
        result = run(["systemd-analyze", "verify", "--man=no", f"./ftproc-night.{kind}"], place)
        assert "ftproc-night" not in result.stderr, result.stderr


def test_the_cron_line(place: Path) -> None:
    (line,) = block("Every night: cron", "").splitlines()
    command = line.split(maxsplit=5)[5]
    assert "%" not in command  # which cron takes for the end of a line
    assert run(here(command, place), place, shell=True).returncode == 0
    assert done(place) == ALL
    assert "3 logs: " in (place / "night.log").read_text()


def test_the_makefile(place: Path) -> None:
    (place / "Makefile").write_text(block("When files change: make", "make"))
    assert run(["make"], place).returncode == 0
    assert done(place) == ALL
    assert "is up to date" in run(["make"], place).stdout
    later = time.time() + 5
    flights.write_log(simulate("zuo2021-outliers", seed=9).log, place / "flights" / "1.csv")
    os.utime(place / "flights" / "1.csv", (later, later))
    assert "; 2 finished before" in run(["make"], place).stdout


def test_the_cluster(place: Path) -> None:
    pytest.importorskip("distributed")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    text = block("On many machines: Dask", "").replace("10.0.0.1:8786", f"127.0.0.1:{port}").replace("8786", str(port))
    scheduler, worker, batch = text.replace("/shared/", "").replace("--nworkers 4", "--nworkers 1").splitlines()
    (place / "bin" / "dask").write_text(f'#!/bin/sh\nPYTHONPATH={ROOT} exec {sys.executable} -P -m dask "$@"\n')
    (place / "bin" / "dask").chmod(0o755)
    environment = {"PATH": f"{place}/bin:/usr/bin:/bin"}
    quiet = {"cwd": place, "env": environment, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    started = [
        subprocess.Popen(["sh", "-c", f"exec env {command}"], **quiet)  # type: ignore[call-overload]
        for command in (f"{scheduler} --host 127.0.0.1 --no-dashboard", f"{worker} --no-dashboard")
    ]
    try:
        until = time.monotonic() + 60
        while (result := run(batch, place, shell=True)).returncode == 2 and time.monotonic() < until:
            time.sleep(0.5)  # no scheduler or no worker answers yet
    finally:
        for process in started:
            process.terminate()
            process.wait()
    assert (result.returncode, result.stderr) == (0, "")
    assert done(place) == ALL
    assert "flights/0.csv: 61 rows" in result.stdout


def test_workers_need_the_memory_that_the_page_says(place: Path) -> None:
    """The largest worker after several logs of 10,000 rows each."""
    for number in range(4):
        log = simulate("manoeuvre", seed=number, duration_s=500.0).log
        flights.write_log(log, place / "flights" / f"long{number}.csv")
    script = (
        "import resource, sys\nfrom ftproc.cli.main import main\n"
        "if __name__ == '__main__':\n"
        "    try:\n        main()\n"
        "    finally:\n"
        "        print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, file=sys.stderr)\n"
    )
    (place / "measured.py").write_text(script)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "measured.py", "filter", "flights/*.csv", "-o", "clean/", "--jobs", "2"]
    result = subprocess.run(command, cwd=place, env=environment, capture_output=True, text=True, timeout=TIMEOUT_S)
    stated = int(re.findall(r"\| 10,000 \| (\d+) MB \|", PAGE)[0])
    assert result.returncode == 0, result.stderr
    assert int(result.stderr.splitlines()[-1]) / 1024 < stated
