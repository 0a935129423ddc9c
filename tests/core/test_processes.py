"""Worker processes: what was submitted is waited for, unless something goes wrong."""

from __future__ import annotations

import time

import pytest

from ftproc.core.processes import Workers


def late(value, seconds):
    time.sleep(seconds)
    return value


def broken(submitted):
    with Workers(1) as workers:
        submitted += [workers.submit(late, value, 600.0) for value in range(4)]
        raise KeyError


def test_the_context_ends_when_the_work_has():
    with Workers(1) as workers:
        found = [workers.submit(late, value, 0.1) for value in range(5)]
    assert all(future.done() for future in found)
    assert [future.result() for future in found] == list(range(5))


def test_an_exception_ends_the_work_in_the_middle():
    submitted = []
    with pytest.raises(KeyError):
        broken(submitted)
    assert all(future.done() for future in submitted)
    assert submitted[-1].cancelled()
