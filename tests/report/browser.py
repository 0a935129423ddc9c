"""Debian's Chromium without a window and without a network, and what it found in a page."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
NEEDED = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed (apt-get install chromium)")

_OPTIONS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip
LAPTOP = {"width": 1366, "height": 768}
PATIENCE_MS = 60_000


@contextmanager
def browser(profile: Path) -> Iterator[Any]:
    """A browser with a fresh profile, offline."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        context = playwright.chromium.launch_persistent_context(
            profile, executable_path=CHROMIUM, args=list(_OPTIONS), viewport=LAPTOP, offline=True
        )  # fmt: skip
        try:
            yield context
        finally:
            context.close()


class Opened:
    """A page that was opened and has drawn its figures. complaints: errors on its console, and what it asked for."""

    def __init__(self, context: Any, file: Path) -> None:
        self.complaints: list[str] = []
        self.page = context.new_page()
        self.page.on("console", lambda message: message.type == "error" and self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("dialog", lambda dialog: (self.complaints.append(dialog.message), dialog.dismiss()))
        address = file.resolve().as_uri()
        self.page.on("request", lambda asked: asked.url.startswith(("data:", "blob:", address))
                     or self.complaints.append(asked.url))  # fmt: skip
        self.page.goto(address)
        self.page.wait_for_selector("body[data-drawn=yes]", timeout=PATIENCE_MS)
