"""State of the process that all tests run in."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest
from hypothesis import settings

from ftproc.cli import progress

# Several processes share the processors; the examples are the same in every run, so that a failure is one of the code.
settings.register_profile("suite", deadline=None, derandomize=True)
settings.load_profile("suite")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "slow: takes long, or is much like another; left out unless FTPROC_SLOW is set")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not os.environ.get("FTPROC_SLOW"):
        slow = [item for item in items if item.get_closest_marker("slow")]
        config.hook.pytest_deselected(items=slow)
        items[:] = [item for item in items if not item.get_closest_marker("slow")]


@pytest.fixture(scope="session", autouse=True)
def _hears_interruptions() -> Iterator[None]:
    """A shell makes its background jobs deaf to Ctrl-C, nohup to a closed terminal, and so would be the programs that
    the tests start and stop."""
    heard = {signal.SIGINT: signal.default_int_handler, signal.SIGHUP: signal.SIG_DFL}
    before = {number: signal.signal(number, handler) for number, handler in heard.items()}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture(scope="session", autouse=True)
def _says_nothing_of_its_slowness() -> None:
    """A work of more than a minute says how far it is, which on a slow machine is no error of what it prints."""
    progress.LINE_S = 3600.0
