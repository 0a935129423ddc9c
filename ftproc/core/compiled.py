"""How the kernels come to run, and the records that they work on.

A `kernel` is called from Python, a `part` only by kernels, into which it is compiled. FTPROC_KERNELS says how they run:

* `compiled`: from a library that was made of them when ftproc was installed (`hatch_build.py`): one for any processor
  of the kind, one that is faster for those of the last ten years. It bears the digest of its sources in its name, so
  that it never runs for others.
* `jit`: numba compiles each when it is first called, and keeps the machine code, under the same digest.
* `python`: as plain Python, a hundred times slower, for tests and fuzzers that follow every branch.

Without the variable it is the library where there is one, else numba.

No Python errors inside. No product and sum become one operation, and sums keep their order, so that a kernel gives the
same digits from every library and from numba, and wherever its parts stand.

A filter's state and all that its update needs lie in one record: the compiler knows where each array begins and how
large it is, and that no two overlap. With separate arrays the passes take twice as long.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib
import importlib.util
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar, cast, get_type_hints

import numpy as np
from numpy.typing import NDArray

from ftproc.core import signatures
from ftproc.errors import InstallationError

F = TypeVar("F", bound=Callable[..., Any])

HOW: dict[str, Any] = {"error_model": "numpy"}
_IMPORTED = re.compile(rb"^from ftproc\.core\.([\w.]+) import (.*)", re.MULTILINE)
WAYS = ("compiled", "jit", "python")
ROOM = Path(__file__).parent
CURE = (
    "Install a C compiler and then ftproc again (pip install --force-reinstall), or numba, which compiles when running."
)


def digest(room: Path = ROOM) -> str:
    """Of all sources in which kernels are written, and of those in the room that they import."""
    found = (Path(folder, name) for folder, _, names in os.walk(room) for name in names if name.endswith(".py"))
    sources = {path.relative_to(room).as_posix(): path.read_bytes() for path in found}
    to_read = [name for name, content in sources.items() if b"core.compiled import" in content]
    wanted: set[str] = set()
    while to_read:
        name = to_read.pop()
        if name in sources and name not in wanted:
            wanted.add(name)
            for module, names in _IMPORTED.findall(sources[name]):
                folder = module.decode().replace(".", "/")
                to_read += [f"{folder}.py", *(f"{folder}/{each.strip()}.py" for each in names.decode().split(","))]
    return hashlib.blake2b(b"".join(sources[name] for name in sorted(wanted)), digest_size=8).hexdigest()


DIGEST = digest()
GENERIC = f"_kernels_{DIGEST}"  # the name, as a module, of the library for any processor of the kind
MODERN = f"{GENERIC}_v3"  # and of that for those of the level x86-64-v3, which know AVX2 and FMA


def _is_modern() -> bool:
    """Whether this processor is of that level, as far as numpy knows."""
    try:
        has = importlib.import_module("numpy._core._multiarray_umath").__cpu_features__
    except (ImportError, AttributeError):  # numpy keeps it to itself
        return False
    return bool(has["X86_V3"] if "X86_V3" in has else has.get("AVX2") and has.get("FMA3"))  # before numpy 2.4


def _fastest() -> Any:
    """The fastest library that belongs to these sources and runs on this processor, or None."""
    for name in (MODERN, GENERIC) if _is_modern() else (GENERIC,):
        with contextlib.suppress(ImportError):  # not there, or not one that can be loaded
            return importlib.import_module(f"ftproc.core.{name}")
    return None


def _choose(wanted: str) -> tuple[str, Any]:
    """How the kernels run, and the library if they run from it."""
    if wanted not in ("", *WAYS):
        raise InstallationError(f'FTPROC_KERNELS is "{wanted}"; it is one of {", ".join(WAYS)}, or not set.')
    library = _fastest() if wanted in ("", "compiled") else None
    if library is not None:
        return "compiled", library
    if wanted == "compiled":
        raise InstallationError(f"FTPROC_KERNELS asks for compiled kernels, but {_missing()}. {CURE}")
    if wanted != "python" and importlib.util.find_spec("numba") is None:
        raise InstallationError(f"{'FTPROC_KERNELS is jit' if wanted else _missing()}, and there is no numba. {CURE}")
    return wanted or "jit", None


def _missing() -> str:
    """Why the library cannot be used."""
    if any(ROOM.glob("_kernels_*")):
        return f"the compiled kernels in {ROOM} are not of these sources, not for this Python, or damaged"
    return f"there are no compiled kernels in {ROOM}"


_WANTED = os.environ.get("FTPROC_KERNELS", "")
WAY, _LIBRARY = _choose(_WANTED)

#: The line for the user before numba compiles.
COMPILING = f"{'FTPROC_KERNELS is jit' if _WANTED else _missing()}: numba compiles what is needed, once (a minute)..."

#: All kernels, by the name under which the library exports them, as Python functions.
KERNELS: dict[str, Callable[..., Any]] = {}


@functools.cache
def _numba() -> Any:
    """numba, without the settings that it reads from a file in the current directory: they would name the place of its
    cache, which holds code. Those of the environment count."""
    numba = importlib.import_module("numba")
    settings: Any = importlib.import_module("numba.core.config")
    settings._config_fname = os.devnull
    settings.reload_config()
    return numba


def kernel(function: F) -> F:
    """Compile a function that Python calls, while other threads go on; to a type checker it stays what it was."""
    name = f"{function.__module__}.{function.__name__}".removeprefix("ftproc.core.").replace(".", "_")
    KERNELS[name] = function
    if WAY == "compiled":
        return cast(F, _checked(function, getattr(_LIBRARY, name)))
    if WAY == "jit":
        function.__qualname__ += f"_{DIGEST}"  # part of the name under which numba keeps the machine code
        return cast(F, _numba().njit(cache=True, nogil=True, **HOW)(function))
    return function


def _checked(function: Callable[..., Any], compiled: Callable[..., Any]) -> Callable[..., Any]:
    check: signatures.Check | None = None

    @functools.wraps(function)
    def call(*arguments: Any) -> Any:
        nonlocal check
        if check is None:
            check = signatures.Check(function)
        check(arguments)
        return compiled(*arguments)

    return call


def part(function: F) -> F:
    """Compile a function that kernels call."""
    if WAY == "jit":
        return cast(F, _numba().njit(**HOW)(function))
    return function


def variant(function: Callable[..., Any], module: str, name: str, **different: Any) -> Callable[..., Any]:
    """A function of the same code with some annotations different, or other globals (`_...`), for a kernel of its own.
    (A closure would say the same, but numba keeps no machine code of closures.)"""
    names = {key: value for key, value in different.items() if key.startswith("_")}
    made = FunctionType(function.__code__, {**function.__globals__, **names}, name)
    made.__module__, made.__qualname__ = module, name
    made.__annotations__ = {**function.__annotations__, **{k: v for k, v in different.items() if k not in names}}
    return made


def record(kind: type) -> np.dtype[np.void]:
    """The memory layout of the records that `kind` describes: a class of numbers and float64 arrays, each annotated
    with its shape, such as `x: Annotated[FloatArray, 9]`."""
    hints = get_type_hints(kind, include_extras=True)
    return np.dtype([(name, np.float64, getattr(hint, "__metadata__", ())) for name, hint in hints.items()])


def zeros(layout: np.dtype[np.void], count: int = 1) -> Any:
    """`count` records in one array, all zero. For kernels fields are attributes; elsewhere `records["x"]` is the array
    (count, ...) of a field."""
    return _for_kernels(np.zeros(count, layout))


def empty(layout: np.dtype[np.void], count: int) -> Any:
    """The same, with whatever the memory holds."""
    return _for_kernels(np.empty(count, layout))


def _for_kernels(made: NDArray[np.void]) -> Any:
    return made.view(np.recarray) if WAY == "python" else made


@contextlib.contextmanager
def announced(say: Callable[[str], None] | None) -> Iterator[None]:
    """Inside the block, `say` is called once with a line for the user if a kernel of ftproc has to be compiled.

    numba itself is listened to: no other sign knows for sure which kernels its cache holds for these sources,
    this processor and this version, or where it keeps them when the installation is read-only.
    """
    if say is None or WAY != "jit":
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
