"""Compiles the kernels when ftproc is installed: `pip install` (also -e) calls this, `python hatch_build.py` by hand.

numba compiles ahead of time what it compiles at run time otherwise, from the same sources, into a library beside them:
not for this processor, but for any of its kind. On x86-64 there is a second one for processors of the last ten years,
which takes four fifths of the time. Where that fails, for want of a C compiler say, the wheel asks for numba.

What numba.pycc leaves to be done: its functions would keep the interpreter's lock, and know no error model. There is no
public option; the flags are set where it makes them.
"""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent
CORE = ROOT / "ftproc" / "core"
GENERIC, MODERN = "generic", "x86-64-v3"  # processors, as LLVM names them
#: For no other processor; short loops, which P is full of, become vector instructions.
OPTIONS = {"NUMBA_CPU_FEATURES": "", "NUMBA_SLP_VECTORIZE": "1", "FTPROC_KERNELS": "jit"}
AT_RUN_TIME = "numba>=0.59"
ANYWHERE = "FTPROC_ANYWHERE"  # set: a wheel for every system and processor, whose kernels numba compiles when running

try:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface
except ImportError:  # called by hand
    BuildHookInterface = object


class CustomBuildHook(BuildHookInterface):  # type: ignore[misc, valid-type]
    """Puts the libraries of kernels into the wheel, or numba among its requirements."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if os.environ.get(ANYWHERE):
            build_data["dependencies"].append(AT_RUN_TIME)
            return
        done = subprocess.run([sys.executable, __file__], cwd=ROOT, capture_output=True, text=True)
        if done.returncode:
            self.app.display_warning(f"the kernels are not compiled: {(done.stderr.strip() or '?').splitlines()[-1]}")
            self.app.display_warning(f"the wheel asks for {AT_RUN_TIME} in their place")
            build_data["dependencies"].append(AT_RUN_TIME)
            return
        build_data["pure_python"] = False
        build_data["infer_tag"] = True
        build_data["artifacts"] += [Path(line).relative_to(ROOT).as_posix() for line in done.stdout.splitlines()]
        for notice in importlib.metadata.files("numba") or []:  # its runtime is a part of the library
            if notice.name.startswith("LICENSE"):
                build_data["force_include"][str(notice.locate())] = f"ftproc/core/numba-{notice.name}"


def libraries() -> list[Path]:
    """The libraries of kernels, made side by side if they are not there; those of other sources are removed."""
    from ftproc.core import compiled

    names = {GENERIC: compiled.GENERIC}
    if platform.machine().lower() in ("x86_64", "amd64"):
        names[MODERN] = compiled.MODERN
    wanted = {CORE / (name + sysconfig.get_config_var("EXT_SUFFIX")): cpu for cpu, name in names.items()}
    since = Path(__file__).stat().st_mtime
    making = [
        subprocess.Popen([sys.executable, __file__, cpu, str(made)], env=os.environ | OPTIONS | {"NUMBA_CPU_NAME": cpu})
        for made, cpu in wanted.items()
        if not made.exists() or made.stat().st_mtime < since
    ]
    codes = [process.wait() for process in making]
    if any(codes):
        sys.exit(1)
    for old in CORE.glob("_kernels_*"):
        if not old.name.startswith(compiled.GENERIC):  # that of another Python stays
            old.unlink()
    return list(wanted)


def compile_kernels(cpu: str, made: Path) -> None:
    """Compile all kernels for a processor into a library at this path."""
    import numba.pycc.compiler as inner
    from numba.core.typing import signature
    from numba.pycc import CC

    plain = inner.Flags

    def flags() -> Any:
        made = plain()
        made.error_model = compiled.HOW["error_model"]
        made.release_gil = True
        return made

    from ftproc.core import compiled, signatures

    load(CORE, "ftproc.core")
    inner.Flags = flags
    compiler = CC(made.name.partition(".")[0], source_module=compiled)
    compiler.target_cpu = cpu
    for name, function in compiled.KERNELS.items():
        takes, gives = signatures.signature(function)
        arguments = [numba_type(hint) for hint in takes.values()]
        compiler.export(name, signature(numba_type(gives), *arguments))(function)
    with tempfile.TemporaryDirectory(dir=CORE) as room:  # a reader never sees half a library
        compiler.output_dir = room
        compiler.compile()
        Path(room, compiler.output_file).rename(made)


def load(room: Path, name: str) -> None:
    """Import every module below a folder: each registers its kernels."""
    import importlib

    for path in sorted(room.iterdir()):
        if path.is_dir() and (path / "__init__.py").exists():
            load(path, f"{name}.{path.name}")
        elif path.suffix == ".py":
            importlib.import_module(f"{name}.{path.stem}".removesuffix(".__init__"))


def numba_type(hint: Any) -> Any:
    """The type by which numba knows what an annotation describes."""
    from typing import get_args, get_type_hints

    import numba
    from numba.core import types

    from ftproc.core import signatures

    plain = {float: types.float64, int: types.int64, bool: types.boolean, type(None): types.none}
    if (layout := signatures.layout_of(hint)) is not None:
        return types.Array(numba.from_dtype(layout.dtype), layout.ndim, "C")
    if signatures.is_record(hint):
        fields = get_type_hints(hint, include_extras=True).values()
        return types.NamedTuple([numba_type(field) for field in fields], hint)
    if hint in plain:
        return plain[hint]
    return types.Tuple([numba_type(member) for member in get_args(hint)])


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    if len(sys.argv) > 1:
        compile_kernels(sys.argv[1], Path(sys.argv[2]))
    else:
        os.environ.update(OPTIONS)
        print(*libraries(), sep="\n")
