"""Tests of the suite that count in the table of `make trust`, each group in its own process."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from typing import NamedTuple

from ftproc.core import threads

#: What happens to a run from outside: also to the workers and the scheduler of a cluster, and code beside its logs.
FAULTS = ("tests/faults", "tests/batch", "tests/files/writing", "tests/trust/test_foreign_code.py")

#: Kernels against plain Python and against each other; those that take minutes without the compiler are left out there.
PLAIN = ("tests/core",)


#: Tests of a file may need what those before them have made.
PARALLEL = ("--dist", "loadfile", "-n", str(threads.available()))


class Count(NamedTuple):
    """Of some tests."""

    passed: int
    failed: int
    failures: str

    @property
    def all_passed(self) -> bool:
        """And there were some."""
        return self.passed > 0 and self.failed == 0


def run(*files: str, **environment: str) -> Count:
    """Run the tests of these files; a run that breaks off counts as one failure more."""
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *PARALLEL, *files],
        check=False, capture_output=True, text=True, env={**os.environ, **environment},
    )  # fmt: skip
    last = done.stdout.strip().rpartition("\n")[2]
    passed, failed, errors = (
        sum(map(int, re.findall(rf"(\d+) {word}", last))) for word in ("passed", "failed", "error")
    )
    broken = done.returncode != 0 and failed + errors == 0
    return Count(passed, failed + errors + broken, "" if done.returncode == 0 else done.stdout + done.stderr)
