"""Coverage-guided fuzzing of one target with atheris: `python -m tests.fuzz TARGET SECONDS [DIRECTORY]`.

DIRECTORY (out/fuzz) takes the inputs that reached something new, in TARGET/, and what is wrong, as TARGET-crash-*.
It goes on where it stopped. What is worth keeping belongs in corpus/TARGET/, which the tests replay.

With FTPROC_KERNELS=python the kernels run as Python: their branches guide the search, but one log takes seconds.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from pathlib import Path

import atheris

_HERE = Path(__file__).parent
_ROOT = _HERE.parents[1]
_KERNELS = [".".join(path.relative_to(_ROOT).with_suffix("").parts) for path in _ROOT.glob("ftproc/core/**/*.py")]


def main() -> None:
    """Ends the process: with 0 when the time is over and nothing was found."""
    name, seconds = sys.argv[1], sys.argv[2]
    out = Path(sys.argv[3] if len(sys.argv) > 3 else "out/fuzz")
    compiled = [] if os.environ.get("FTPROC_KERNELS") == "python" else _KERNELS
    with atheris.instrument_imports(include=["ftproc", "tomllib"], exclude=compiled):
        import tomllib  # noqa: F401

        from tests.fuzz import targets
    target = targets.all_targets()[name]
    found, seeds, kept = out / name, out / f"{name}-seeds", _HERE / "corpus" / name
    for directory in (found, seeds):
        directory.mkdir(parents=True, exist_ok=True)
    for content in targets.seeds(target):
        (seeds / hashlib.sha256(content).hexdigest()[:16]).write_bytes(content)
    options = [f"-max_total_time={seconds}", "-timeout=60", "-rss_limit_mb=3000", "-max_len=30000"]
    options.append(f"-artifact_prefix={out / name}-")
    corpora = [str(directory) for directory in (found, seeds, kept) if directory.exists()]
    with tempfile.TemporaryDirectory() as scratch:
        atheris.Setup([sys.argv[0], *options, *corpora], lambda content: targets.judge(target, content, Path(scratch)))
        atheris.Fuzz()


if __name__ == "__main__":
    main()
