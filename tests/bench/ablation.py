"""What each rule of two-pass editing is worth: smoothed position errors with the rule switched off over those with it,
on the logs of `tests.bench.logs` that have a truth and one station (above 1 the rule helps), the runs that are
confidently wrong, and the processor time. A rule without a log that it improves has no place."""

from __future__ import annotations

import contextlib
import importlib
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from typing import Any, NamedTuple

import numpy as np

from ftproc.core import threads
from ftproc.core.editing.lasting.ends import End
from ftproc.core.editing.lasting.screen import leaves_curves
from ftproc.core.editing.lasting.weighing import as_it_is, scene_of
from ftproc.core.filtering.initialization import find_starts
from ftproc.core.identification.profile import median_level
from ftproc.errors import FtprocError
from ftproc.methods import bridging
from ftproc.quality.verdict import CONSISTENT
from ftproc.settings import FilterSettings
from tests.bench import logs
from tests.trust.runs import is_far

EDITING, IDENTIFICATION = "ftproc.core.editing", "ftproc.core.identification"
REJECTED = f"{EDITING}.lasting.rejected"
SAME = 1e-9  # of an error: less has not changed
HEADER = ("rule off", "logs changed", "mean error ratio", "from", "to", "confidently wrong", "time")


class Off(NamedTuple):
    """How a rule is switched off: a name in a module, and what stands for it."""

    module: str
    name: str
    stands: Any


class Outcome(NamedTuple):
    """error_m: RMS of the smoothed positions; infinite where the log could not be processed."""

    error_m: float
    wrong: bool
    seconds: float


def _no_reading(measurement: Any, *_: Any) -> Any:
    return np.zeros(np.shape(measurement), bool)


def _as_read(time_s: Any, measurement: Any, *_: Any) -> Any:
    return measurement.copy(), np.zeros(measurement.shape, np.uint8)


def _in_sight(found: Any, work: Any) -> Any:
    return scene_of(found.record, found.decision, work)


def _at_typical_noise(part: Any, few: Any, most: Any, least: float) -> bool:
    return leaves_curves(part, most, least, as_it_is(part, part.log.weight, part.at_median))


def _by_the_median(log: Any, model: Any, at_median: Any = None) -> Any:
    typical = at_median or median_level(model)
    return find_starts(log, typical.noise_variance, float(typical.jerk[0, 0]))


def _no_wind(short: Any, model: Any) -> Any:
    return model, 0.0


def _same_screen(screen: Callable[..., Any], *arguments: Any) -> Any:
    found = screen(*arguments)
    return found._replace(jumps_only=found.weight)


def _second(first: Any, second: Any, *_: Any) -> Any:
    return second


def _pair(record: Any, decision: Any, *_: Any, **__: Any) -> Any:
    return record, decision


def _first(first: Any, *_: Any, **__: Any) -> Any:
    return first


def _nothing(*_: Any, **__: Any) -> Any:
    return None


def _empty(*_: Any, **__: Any) -> Any:
    return []


TWO_PASS = f"{EDITING}.two_pass"
RULES: dict[str, tuple[Off, ...]] = {
    "correlated noise": (Off(TWO_PASS, "allow_for_colour", _second),),
    "noise that drifts": (Off(TWO_PASS, "allow_for_drift", _pair),),
    "jumps that hide in noise that drifts": (Off(f"{EDITING}.lasting.settling", "_hidden_by_drift", _in_sight),),
    "tails": (Off(TWO_PASS, "allow_for_tails", _pair),),
    "late stamps": (Off(TWO_PASS, "late_stamps", _nothing),),
    "very late stamps": (Off(TWO_PASS, "allow_for_very_late_stamps", _pair),),
    "nothing screened": (Off(TWO_PASS, "rejects_runs", lambda *_: False),),
    "rejected runs": (Off(TWO_PASS, "reassess_rejected", lambda record, decision, work: (decision, ())),),
    "faults that last": (Off(f"{EDITING}.lasting.settling", "search", _empty),),
    "jumps that the part around them explains": (
        Off(f"{EDITING}.lasting.search", "left_of", lambda part, jump, *_: jump),
    ),
    "jumps by themselves": (
        Off(f"{EDITING}.lasting.search", "by_itself", lambda *_: End(None, -np.inf)),
        Off(f"{EDITING}.lasting.search", "instead_of", _nothing),
    ),
    "patches as often as they are rejected": (Off(f"{EDITING}.lasting.scanned", "_runs", lambda _: np.zeros(0)),),
    "the best of all rounds": (Off(f"{EDITING}.lasting.settling", "AGILE", np.inf),),
    "the likeliest fault alone": (Off(f"{EDITING}.lasting.settling", "_likeliest", _empty),),
    "rejected runs on a curve": (Off(f"{REJECTED}.rejected_runs", "_more_than_a_curve", lambda *_: np.inf),),
    "patches followed beside a rejected run": (Off(f"{REJECTED}.rejected_runs", "followed", _empty),),
    "runs of several components as one motion": (Off(f"{REJECTED}.joining", "_together", _empty),),
    "abrupt changes": (Off(f"{IDENTIFICATION}.motions.jolts", "told", _nothing),),
    "wind of what falls": (Off(f"{IDENTIFICATION}.motions.falling", "_blown", _no_wind),),
    "speeds that settle": (Off(f"{IDENTIFICATION}.motions.motion_models", "FADING", ()),),
    "patches of several that were joined": (
        Off(f"{EDITING}.lasting.search", "_joined", lambda seen, found, new: [*found, new]),
    ),
    "jumps that the process noise hides": (Off(f"{EDITING}.lasting.screen", "HIDDEN", np.inf),),
    "clocks that jump in a gap": (Off(f"{EDITING}.lasting.clock", "gaps", _empty),),
    "clocks that leave nothing of a gap": (Off(f"{EDITING}.lasting.clock", "leaves_gap", lambda *_: False),),
    "process noise beside gaps": (
        Off(f"{EDITING}.reassessment", "starts_of", _by_the_median),
        Off(f"{EDITING}.lasting.weighing", "starts_of", _by_the_median),
    ),
    "bends that outliers make": (Off(f"{EDITING}.copies", "BENDS", 10**9),),
    "noise of what is rejected": (Off(TWO_PASS, "_rejects_many", lambda *_: False),),
    "others that are as likely": (Off(TWO_PASS, "others", _empty),),
    "curves that leave too little to a patch": (
        Off(f"{EDITING}.lasting.between", "leaves_curves", lambda *_: True),
        Off(f"{EDITING}.lasting.between", "may_leave_curves", lambda *_: True),
    ),
    "what the process noise of the log leaves to a patch": (
        Off(f"{EDITING}.lasting.between", "may_leave_curves", _at_typical_noise),
    ),
    "patches that were followed": (Off(f"{EDITING}.lasting.search", "likeliest_followed", _nothing),),
    "waves that were followed": (Off(f"{EDITING}.lasting.between", "agile", _empty),),
    "waves of one rate": (Off(f"{EDITING}.lasting.between", "of_a_wave", _nothing),),
    "waves of the target": (Off(f"{EDITING}.lasting.between", "is_of_the_target", lambda *_: False),),
    "targets that move in one direction": (Off(f"{EDITING}.lasting.between", "moved", lambda *_: -np.inf),),
    "waves that other components do not show": (Off(f"{EDITING}.lasting.between", "others_as_usual", lambda *_: True),),
    "one-sided errors": (Off(TWO_PASS, "_one_sided", _empty),),
    "patches between jumps": (Off(f"{EDITING}.jump_patches", "find", lambda time_s, *_: np.zeros(len(time_s))),),
    "readings that were not measured": (Off(TWO_PASS, "without_copies", _as_read),),
    "stuck readings": (Off(TWO_PASS, "stuck_readings", _no_reading),),
    "repeated coarse readings": (Off(f"{IDENTIFICATION}.uneven_noise", "repeated", _nothing),),
    "runs that are off together": (
        Off(f"{EDITING}.reassessment", "_suspects", lambda record, *_: _no_reading(record.measurement)),
        Off(f"{EDITING}.reassessment", "suspicious", lambda time_s, residual, *_: _no_reading(residual)),
    ),
    "alternatives": (
        Off(f"{EDITING}.alternatives", "try_alternatives", lambda log, weight, search: weight.copy()),
        Off(f"{EDITING}.alternatives", "accepted_runs", _empty),
    ),
    "patches with one edge": (Off(f"{EDITING}.alternatives", "_at_edges", lambda log, weight, search: weight.copy()),),
    "alternatives as they are": (Off(f"{EDITING}.reassessment", "_or_as_they_are", _second),),
    "starts by the mean interval too": (Off(f"{IDENTIFICATION}.likelihood", "_bunched", lambda *_: 0.0),),
    "turns between the spans": (Off(TWO_PASS, "_may_miss_turns", lambda *_: False),),
    "another start": (Off(TWO_PASS, "_forgets", lambda *_: False),),
    "reassessment": (Off(TWO_PASS, "reassess", _second),),
    "turns taken for patches": (Off(TWO_PASS, "screen", _same_screen),),
    "decisions from all readings on": (Off(TWO_PASS, "rejects_runs", lambda *_: False),),
    "curves through long gaps": (Off("ftproc.methods.bridging", "bridged", bridging.none),),
    "far less noise": (Off(TWO_PASS, "with_less_noise", _first),),
    "less noise of slow readings": (Off(TWO_PASS, "finer_noise", _empty),),
    "allowance on the jerk": (Off(TWO_PASS, "with_allowance", _second),),
}


@contextlib.contextmanager
def without(rule: str | None) -> Iterator[None]:
    """Inside the block a rule is off. Raises AttributeError for a name that has moved."""
    saved = []
    try:
        for off in RULES[rule] if rule is not None else ():
            module = importlib.import_module(off.module)
            was = getattr(module, off.name)
            saved.append((module, off.name, was))
            setattr(module, off.name, partial(_same_screen, was) if off.stands is _same_screen else off.stands)
        yield
    finally:
        for module, name, was in saved:
            setattr(module, name, was)


def run(rule: str | None, name: str) -> Outcome:
    """A log smoothed with a rule off, or with all."""
    begun = time.process_time()
    with without(rule):
        try:
            found, position_m = logs.trajectory(name, FilterSettings(smooth=True))
        except FtprocError:
            return Outcome(np.inf, False, time.process_time() - begun)
    assert position_m is not None
    error = np.sqrt(np.nanmean(((found.state[:, :3] - position_m) ** 2).sum(1)))
    wrong = found.metadata["summary"]["trust"]["verdict"] == CONSISTENT and is_far(found, position_m)
    return Outcome(float(error), wrong, time.process_time() - begun)


def rows(chosen: list[str] | None = None) -> Iterator[tuple[str, ...]]:
    """One row for all rules together, then one per rule."""
    names = [name for name in logs.names() if not name.startswith(("sample", "range"))]
    rules = list(RULES) if chosen is None else chosen
    with ProcessPoolExecutor(threads.available(), get_context("spawn"), threads.use, (1,)) as pool:
        jobs = {rule: [pool.submit(run, rule, name) for name in names] for rule in (None, *rules)}
        base = [job.result() for job in jobs[None]]
        seconds = sum(each.seconds for each in base)
        yield "none", f"0 of {len(names)}", "1", "1", "1", str(sum(each.wrong for each in base)), "1"
        for rule in rules:
            off = [job.result() for job in jobs[rule]]
            ratio = np.array([a.error_m / b.error_m for a, b in zip(off, base, strict=True)])
            changed = np.abs(ratio - 1) > SAME
            mean = np.exp(np.log(ratio[np.isfinite(ratio)]).mean())
            took = sum(each.seconds for each in off) / seconds
            yield (
                rule, str(int(changed.sum())), f"{mean:.3f}", f"{ratio.min():.2f}", f"{ratio.max():.3g}",
                str(sum(each.wrong for each in off)), f"{took:.2f}",
            )  # fmt: skip
