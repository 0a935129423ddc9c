"""Long work that is done a little at a time: in a thread that waits at each sweep over its readings until it is given
more to do. How much is counted in samples that are filtered, not in seconds: results do not depend on the machine."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Generic, TypeVar

T = TypeVar("T")

PASS = 400  # samples that a sweep costs beyond those of its readings

_here = threading.local()


def spent() -> int:
    """Samples that this thread has swept through so far, with what sweeps cost beyond."""
    return getattr(_here, "spent", 0)


def swept(samples: int) -> None:
    """Says that so many samples are about to be swept through. Waits where the thread is paced and its credit used."""
    _here.spent = spent() + samples + PASS
    work: _Work | None = getattr(_here, "work", None)
    if work is not None:
        work.spend(samples + PASS)


class _GivenUp(BaseException):
    """Raised in the thread of work that nobody wants any more."""


class _Work:
    """What the thread and its owner share: credit in samples, whose turn it is, and the outcome."""

    def __init__(self) -> None:
        self.credit = 0.0
        self.done = self.given_up = False
        self.error: Exception | None = None
        self.turn, self.pause = threading.Semaphore(0), threading.Semaphore(0)

    def spend(self, samples: int) -> None:
        while self.credit <= 0 and not self.given_up:
            self.pause.release()
            self.turn.acquire()
        if self.given_up:
            raise _GivenUp
        self.credit -= samples


class Paced(Generic[T]):
    """Work that goes on as far as `go_on` lets it; its thread ends with it."""

    def __init__(self, work: Callable[[], T]) -> None:
        self._function, self._given = work, 0.0
        self._work, self._found = _Work(), list[T]()
        self._thread = threading.Thread(target=_run, args=(self._work, work, self._found), daemon=True)
        self._started = False

    def __getstate__(self) -> dict[str, Any]:
        """What a copy needs: it does again what was done so far, as soon as it goes on."""
        mine = ("_work", "_found", "_thread", "_started")
        return {name: value for name, value in self.__dict__.items() if name not in mine}

    def __setstate__(self, state: dict[str, Any]) -> None:
        Paced.__init__(self, state["_function"])
        self.__dict__.update(state)
        self._work.credit = self._given

    def go_on(self, samples: float) -> bool:
        """Work for so many more samples; whether it is done. What a sweep takes too much is taken from the next time.
        Raises what the work raises."""
        work = self._work
        work.credit += samples
        self._given += samples
        if not work.done and work.credit > 0:
            if self._started:
                work.turn.release()
            else:
                self._started = True
                self._thread.start()
            work.pause.acquire()
        if work.error is not None:
            raise work.error
        return work.done

    @property
    def found(self) -> T:
        """What the work returned, once it is done."""
        return self._found[0]

    def __del__(self) -> None:
        self._work.given_up = True
        self._work.turn.release()


def _run(work: _Work, function: Callable[[], T], found: list[T]) -> None:
    _here.work = work
    try:
        found.append(function())
    except _GivenUp:
        pass
    except Exception as error:
        work.error = error
    finally:
        work.done = True
        work.pause.release()
