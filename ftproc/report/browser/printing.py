"""A page to its file: as it is, or as a PDF, which Chromium or a browser made of it prints without a window."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from ftproc.errors import OutputError, UsageError, encodable
from ftproc.files.layout import Target
from ftproc.files.writing import atomic

#: Names on the PATH, the first that is there prints.
BROWSERS = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"),
    *("microsoft-edge", "microsoft-edge-stable", "msedge"),
)
PATIENCE_S = 300.0  # for a page, which takes some seconds on an idle machine

_OPTIONS = (
    "--headless", "--no-pdf-header-footer", "--no-first-run", "--no-default-browser-check", "--disable-extensions",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage",
    "--enable-unsafe-swiftshader",  # draws the track in space without a graphics card
)  # fmt: skip
_HTML, _PAPER = '<html lang="en">', '<html lang="en" data-paper="A4">'
_HEAD, _SIZE = "</head>", "<style>@page { size: A4; }</style></head>"


def is_pdf(target: Target) -> bool:
    """Whether a page of this name is printed."""
    return str(target).lower().endswith(".pdf") and not Path(target).is_dir()


def require_browser(target: Target) -> str:
    """The program that prints the page `target`. Raises UsageError when none is on the PATH."""
    found = next((path for name in BROWSERS if (path := _installed(name)) is not None), None)
    if found is None:
        raise UsageError(
            f"{target}: a PDF is printed by Chromium, Google Chrome or Microsoft Edge, and none of them is on the "
            "PATH; install one (Debian: apt-get install chromium), or end the name in .html."
        )
    return found


def _installed(name: str) -> str | None:
    """The program of that name on the PATH, but never one in the current directory, where logs lie: a PATH may name
    it, and Windows looks there first."""
    found = shutil.which(name)
    return None if found is None or Path(found).parent.resolve() == Path.cwd() else found


def write(text: str, target: Target) -> None:
    """Write a page (HTML text), whole or not at all; printed on A4 where the name ends in .pdf.

    Raises OutputError, also for a browser that fails; UsageError when there is none.
    """
    data = encodable(text).encode()
    if is_pdf(target):
        atomic.check_target(target)
        data = _printed(data, target, require_browser(target))
    with atomic.replacing(target) as stream:
        stream.write(data)


def on_paper(page: bytes) -> bytes:
    """A page that draws itself for A4 at once, not for a window."""
    return page.replace(_HTML.encode(), _PAPER.encode(), 1).replace(_HEAD.encode(), _SIZE.encode(), 1)


def _printed(page: bytes, target: Target, browser: str) -> bytes:
    """The page as a PDF. The browser has a profile of its own, which it leaves behind nowhere."""
    with tempfile.TemporaryDirectory(prefix="ftproc-", ignore_cleanup_errors=True) as scratch:
        source, result = Path(scratch, "page.html"), Path(scratch, "page.pdf")
        source.write_bytes(on_paper(page))
        own = [f"--user-data-dir={Path(scratch, 'profile')}", f"--print-to-pdf={result}"]
        as_root = hasattr(os, "geteuid") and os.geteuid() == 0
        sandbox = ["--no-sandbox"] if as_root else []
        why = _fault([browser, *_OPTIONS, *sandbox, *own, source.as_uri()])
        data = result.read_bytes() if result.is_file() else b""
    if not (data.startswith(b"%PDF-") and b"%%EOF" in data[-32:]):
        raise OutputError(
            f"{target}: {Path(browser).name} did not print the page ({why or 'it wrote no PDF'}); end the name in "
            ".html, open the page in a browser, and print it there."
        )
    return data


def _fault(command: Sequence[str]) -> str:
    """Run a browser to its end; what went wrong, or an empty string."""
    with tempfile.TemporaryFile() as said:
        try:
            process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=said, start_new_session=True
            )
        except OSError as error:
            return f"it cannot be started: {(error.strerror or str(error)).lower()}"
        try:
            code = process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            return f"it took more than {PATIENCE_S:g} s"
        finally:
            _end(process)
        said.seek(0)
        if b"No usable sandbox" in said.read():
            return "it has no usable sandbox here"
    return f"exit code {code}" if code else ""


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a browser that still runs, with the processes that it started."""
    if process.poll() is not None:
        return
    with contextlib.suppress(ProcessLookupError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()
    process.wait()
