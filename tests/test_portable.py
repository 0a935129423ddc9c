"""What Windows lacks: signals, descriptors and modules of POSIX. Where they are taken away, every module can still be
imported, and the commands work. (No machine with Windows runs these tests.)"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

WITHOUT = """
import asyncio, multiprocessing.util, os, signal, subprocess, sys, tempfile  # Linux' own need what goes now
for module in ("fcntl", "resource", "pwd", "grp", "termios"):
    sys.modules[module] = None
for name in ("SIGHUP", "SIGQUIT", "SIGXCPU", "SIGBUS", "SIGKILL", "SIGUSR1", "SIGPIPE", "pthread_sigmask",
             "pthread_kill", "SIG_BLOCK", "SIG_SETMASK", "SIG_UNBLOCK", "alarm"):
    delattr(signal, name)
for name in ("fork", "geteuid", "getuid", "killpg", "O_NONBLOCK", "O_NOFOLLOW", "O_DIRECTORY", "mkfifo", "getpgid",
             "sched_getaffinity", "WNOHANG", "statvfs"):
    if hasattr(os, name):
        delattr(os, name)
"""
IMPORT_ALL = """
import importlib, pathlib
import ftproc
room = pathlib.Path(ftproc.__file__).parent
for path in sorted(room.rglob("*.py")):
    name = ".".join(path.relative_to(room.parent).with_suffix("").parts).removesuffix(".__init__")
    if name != "ftproc.__main__":
        importlib.import_module(name)
"""
COMMAND = "from ftproc.cli.main import main\nsys.argv = ['ftproc', *sys.argv[1:]]\nmain()"


def run(code: str, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-P", "-c", WITHOUT + code, *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)


def test_every_module_can_be_imported(tmp_path: Path) -> None:
    done = run(IMPORT_ALL, tmp_path)
    assert done.returncode == 0, done.stderr


def test_the_commands_work(tmp_path: Path) -> None:
    made = run(COMMAND, tmp_path, "simulate", "--scenario", "zuo2021", "-o", "flight.csv", "--truth", "truth.csv")
    assert made.returncode == 0, made.stderr
    options = ("--smooth", "--derived", "-o", "out.parquet", "--report", "a.html")
    done = run(COMMAND, tmp_path, "filter", "flight.csv", *options)
    assert done.returncode == 0, done.stderr
    assert "verdict" in done.stdout
    scored = run(COMMAND, tmp_path, "score", "out.parquet", "--truth", "truth.csv")
    assert "position RMSE" in scored.stdout, scored.stderr
