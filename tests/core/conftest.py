"""Tests that take minutes where the kernels run as plain Python."""

from __future__ import annotations

from ftproc.core.compiled import WAY


def pytest_configure(config):
    config.addinivalue_line("markers", "compiled: left out where the kernels are not compiled (FTPROC_KERNELS=python)")


def pytest_collection_modifyitems(config, items):
    if WAY != "python":
        return
    slow = [item for item in items if item.get_closest_marker("compiled")]
    items[:] = [item for item in items if item not in slow]
    config.hook.pytest_deselected(items=slow)
