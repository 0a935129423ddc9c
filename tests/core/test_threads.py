"""Work in threads: the same results in the same order, and never much of it waiting."""

from __future__ import annotations

import threading
import time

import pytest

from ftproc.core import threads

NUMBERS = [1, 2, 5, None]


@pytest.fixture(params=NUMBERS, ids=str)
def number(request):
    threads.use(request.param)
    yield request.param or min(threads.available(), threads.MOST_THREADS)
    threads.use(None)


def squared(item):
    time.sleep(0.001 * (item % 3))  # later ones may be ready sooner
    return item * item


def test_results_come_in_the_items_order(number):
    assert list(threads.in_order(squared, range(40))) == [k * k for k in range(40)]
    assert list(threads.ahead(iter(range(40)))) == list(range(40))
    assert list(threads.in_order(squared, [])) == list(threads.ahead(iter([]))) == []


def test_no_more_items_are_taken_than_there_are_threads_and_one(number):
    taken = []
    results = threads.in_order(squared, (taken.append(k) or k for k in range(1000)))
    for used in range(1, 20):
        next(results)
        assert len(taken) <= used + number + 1
    results.close()


def test_what_goes_wrong_is_raised_where_its_result_would_come(number):
    def work(item):
        if item == 7:
            raise ValueError("seven")
        return item

    results = threads.in_order(work, range(20))
    assert [next(results) for _ in range(7)] == list(range(7))
    with pytest.raises(ValueError, match="seven"):
        next(results)


def test_so_many_run_at_once_and_no_more(number):
    lock, now, most = threading.Lock(), [0], [0]

    def work(item):
        with lock:
            now[0] += 1
            most[0] = max(most[0], now[0])
        time.sleep(0.005)
        with lock:
            now[0] -= 1

    list(threads.in_order(work, range(6 * number)))
    assert most[0] <= number
