"""How the kernels come to run: the library, what happens without it, and what it makes of wrong arguments."""

from __future__ import annotations

import importlib
import os
import pkgutil
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import ftproc.core
from ftproc.core import compiled, signatures
from ftproc.core.comparators.particles import log_kernel_sum
from ftproc.core.comparators.walks import Walk, outlier_kalman
from ftproc.core.editing.outlier_chain import label_runs
from ftproc.core.filtering.forward import Span, filter_log, run_weighted
from ftproc.core.filtering.records import FilterRun, Observations, empty_rows
from ftproc.core.filtering.smoother import Memory
from ftproc.core.model.motion import Profile
from tests.core.tracks import matched

only_compiled = pytest.mark.skipif(compiled.WAY != "compiled", reason="the library is not what runs")
needs_library = pytest.mark.skipif(not any(compiled.ROOM.glob("_kernels_*")), reason="there is no library")

#: Runs one kernel, and tells how it ran and what was announced.
SCRIPT = """
import numpy as np
from ftproc.core import compiled
from ftproc.core.editing.outlier_chain import label_runs
with compiled.announced(lambda text: print("announced:", text)):
    print(compiled.WAY, label_runs(np.zeros((2, 3)), np.zeros((2, 3)), 1)[0].tolist())
"""


@pytest.fixture
def copy(tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """copy(code, FTPROC_KERNELS=...) runs Python with a copy of the package in tmp_path, which can be changed."""
    shutil.copytree(compiled.ROOM.parent, tmp_path / "ftproc", ignore=shutil.ignore_patterns("__pycache__"))
    clean = {name: value for name, value in os.environ.items() if name not in ("FTPROC_KERNELS", "NUMBA_CACHE_DIR")}

    def execute(code: str = SCRIPT, **more: str) -> subprocess.CompletedProcess[str]:
        environment = clean | {"PYTHONPATH": str(tmp_path), **more}
        return subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True
        )

    return execute


@needs_library
def test_the_library_runs_where_nothing_is_said(copy):
    done = copy()
    assert (done.returncode, done.stderr, done.stdout) == (0, "", "compiled [2.0, 2.0, 2.0]\n")


@needs_library
def test_a_library_of_other_sources_never_runs(copy, tmp_path):
    source = tmp_path / "ftproc" / "core" / "model" / "motion.py"
    source.write_text(source.read_text() + "\n# changed\n")
    refused = copy(FTPROC_KERNELS="compiled")
    assert refused.returncode == 1
    assert "are not of these sources, not for this Python, or damaged" in refused.stderr.splitlines()[-1]
    assert "Install a C compiler" in refused.stderr.splitlines()[-1]
    for said in (1, 0):  # numba keeps what it has compiled
        done = copy()
        assert done.stderr == ""
        assert done.stdout.splitlines()[-1] == "jit [2.0, 2.0, 2.0]"
        assert done.stdout.count("announced: ") == said


@needs_library
def test_a_file_that_is_no_library_is_refused(copy, tmp_path):
    for library in (tmp_path / "ftproc" / "core").glob("_kernels_*"):
        library.write_bytes(b"no library")
    refused = copy(FTPROC_KERNELS="compiled")
    assert refused.returncode == 1
    assert "not for this Python, or damaged. Install" in refused.stderr.splitlines()[-1]


def test_what_numba_keeps_belongs_to_the_sources(copy, tmp_path):
    """A kernel is compiled again when a part in another file has changed."""
    announced = []
    for change in ("", "\n# changed\n"):
        source = tmp_path / "ftproc" / "core" / "model" / "motion.py"
        source.write_text(source.read_text() + change)
        announced.append([copy(FTPROC_KERNELS="jit").stdout.count("announced: ") for _ in range(2)])
    assert announced == [[1, 0], [1, 0]]


def test_without_library_and_numba(copy, tmp_path):
    for library in (tmp_path / "ftproc" / "core").glob("_kernels_*"):
        library.unlink()
    hidden = (
        "import importlib.util as u\n"
        "find = u.find_spec\n"
        "u.find_spec = lambda name, *more: None if name == 'numba' else find(name, *more)\n"
    )
    done = copy(hidden + SCRIPT)
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert "there are no compiled kernels in" in last
    asked = copy(hidden + SCRIPT, FTPROC_KERNELS="jit").stderr.splitlines()[-1]
    assert "FTPROC_KERNELS is jit, and there is no numba. Install a C compiler" in asked
    assert "and there is no numba. Install a C compiler and then ftproc again" in last


@only_compiled
def test_any_processor_has_a_library(monkeypatch):
    """Those that know no AVX2 or FMA take the other one."""
    monkeypatch.setattr(compiled, "_is_modern", lambda: False)
    assert compiled._fastest().__name__ == f"ftproc.core.{compiled.GENERIC}"


@only_compiled
@pytest.mark.parametrize("name", [compiled.GENERIC, compiled.MODERN])
def test_every_library_computes_the_same(name):
    """To the last digit: more than that nobody can ask of another processor."""
    if name == compiled.MODERN and not compiled._is_modern():
        pytest.skip("not for this processor")
    library = importlib.import_module(f"ftproc.core.{name}")
    a = matched(1, 400, dt=0.2, missing=0.1, irregular=True, pieces=3)
    rows, samples, profile = empty_rows(400), a.log.samples(a.model.noise_variance), a.model.profile(a.time)
    run = Span(0, 400, 0), samples, profile, a.model.filter(a.starts[0]), False, rows
    ended, likelihood = library.filtering_forward__weighted(*run)
    found, expected = FilterRun.of(a.time, rows, likelihood), filter_log(a.log, a.model, a.starts)
    assert ended == 400
    assert likelihood == expected.log_likelihood
    for name in ("state", "sigma", "innovation_sigma", "nis", "los_sigma", "path_sigma"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)


def test_plain_python(copy):
    assert copy(FTPROC_KERNELS="python").stdout == "python [2.0, 2.0, 2.0]\n"


def test_another_way_is_refused(copy):
    done = copy("from ftproc.cli.main import main\nmain()", FTPROC_KERNELS="fast")
    assert done.returncode in (0, 2)  # a help needs no kernel
    done = copy(
        "import sys\nsys.argv += ['filter', 'a.csv']\nfrom ftproc.cli.main import main\nmain()", FTPROC_KERNELS="fast"
    )
    assert done.returncode == 1
    assert done.stderr.endswith('FTPROC_KERNELS is "fast"; it is one of compiled, jit, python, or not set.\n')
    assert "Traceback" not in done.stderr


@only_compiled
@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ((np.zeros((2, 3)), np.zeros((2, 3))), "label_runs takes 3 arguments, not 2"),
        ((np.zeros((2, 3), np.float32), np.zeros((2, 3)), 1), "weight must be a 2-dimensional array of float64"),
        ((np.zeros((2, 3)), np.zeros(3), 1), "measurement must be a 2-dimensional array of float64, not a 1"),
        ((np.zeros((2, 3)), np.zeros((3, 2)).T, 1), "measurement must be an array in C order"),
        ((np.zeros((2, 3)), [[0.0] * 3] * 2, 1), "measurement must be a 2-dimensional array of float64, not list"),
        ((np.zeros((2, 3)), np.zeros((2, 3)), 1.5), "longest_isolated must be an integer, not float"),
    ],
)  # fmt: skip
def test_wrong_arguments(arguments, sentence):
    with pytest.raises(TypeError, match=sentence):
        label_runs(*arguments)


@only_compiled
def test_wrong_records():
    none, one = np.zeros(3, np.int64), np.ones(3, np.int64)
    z, walk = np.zeros((4, 3)), Walk(none, *np.zeros((4, 3)), none, one, 16, 1.0)
    with pytest.raises(TypeError, match="model must be a Walk, not tuple"):
        outlier_kalman(np.arange(4.0), z, tuple(walk), 3.0, 0.1, True)
    with pytest.raises(TypeError, match=r"model\.x0 must be a 1-dimensional array of float64, not a 2-dim"):
        outlier_kalman(np.arange(4.0), z, walk._replace(x0=z), 3.0, 0.1, True)
    samples = Observations(np.arange(4.0), z, z).samples(np.ones(3))
    with pytest.raises(TypeError, match="filters must be a 1-dimensional array of records of x, p, noise"):
        run_weighted(Span(0, 4, 0), samples, Profile(np.zeros((1, 6)), 1.0, 0.0), samples, False, empty_rows(4))


def test_every_kernel_says_what_it_takes():
    for module in pkgutil.walk_packages(ftproc.core.__path__, "ftproc.core."):
        if not module.name.rpartition(".")[2].startswith("_"):
            importlib.import_module(module.name)
    for function in compiled.KERNELS.values():
        hints, returned = signatures.signature(function)
        assert returned is not None
        for name, hint in hints.items():
            known = signatures.layout_of(hint) is not None or signatures.is_record(hint) or hint in (int, float, bool)
            assert known, f"{function.__qualname__}: {name}"
    assert len(compiled.KERNELS) > 20
    assert signatures.is_record(Memory)


@pytest.mark.compiled
def test_kernels_leave_the_interpreter_to_others():
    rng = np.random.default_rng(1)
    points, centres = rng.normal(size=(3000, 3)), rng.normal(size=(3, 3000))
    log_kernel_sum(points[:2].copy(), centres)
    worker = threading.Thread(target=log_kernel_sum, args=(points, centres))
    worker.start()
    turns = 0
    while worker.is_alive():
        time.sleep(0)
        turns += 1
    worker.join()
    assert turns > 20
