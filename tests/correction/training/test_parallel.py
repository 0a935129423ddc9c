"""Independent work in one process or several: the same results, the same errors, nothing left running."""

from __future__ import annotations

import multiprocessing
import os

import pytest

from ftproc.correction.training import silent
from ftproc.correction.training.parallel import each
from ftproc.errors import FtprocError, InputError


def square(number, progress=silent):
    progress("squaring", number, 9)
    return number**2


def refuse(number, progress=silent):
    raise InputError(f"flight {number} is none")


def die(number, progress=silent):
    os._exit(1)


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_in_the_order_of_the_tasks(jobs):
    steps = []
    assert each(square, [(n,) for n in range(4)], jobs, lambda *step: steps.append(step)) == [0, 1, 4, 9]
    assert len(steps) == 4
    assert each(square, [], jobs) == []


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_reaches_the_caller_and_ends_the_work(jobs):
    with pytest.raises(InputError, match="flight 0 is none"):
        each(refuse, [(0,), (0,)], jobs)
    assert not multiprocessing.active_children()


def test_a_process_that_dies_is_an_error():
    with pytest.raises(FtprocError, match=r"a worker process died .* use fewer --jobs"):
        each(die, [(0,), (0,)], 2)


def test_an_interrupt_ends_the_workers():
    def interrupt(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        each(square, [(0,), (0,)], 2, interrupt)
    assert not multiprocessing.active_children()
