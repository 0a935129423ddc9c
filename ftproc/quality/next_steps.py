"""What to do next about a run that is not consistent: the place, the reason, the option to try, best first.

Most runs that are not consistent have been given something that does not hold: then the step is to leave that out. The
others need what one log and the program cannot know: the instrument's noise, another station, or the engineer's eye.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from ftproc.methods import registry
from ftproc.quality import verdict
from ftproc.settings import FilterSettings

Summary = Mapping[str, Any]
DECISIONS = "decisions.csv"
UNITS = {"range": "m", "azimuth": "rad", "elevation": "rad"}
MANY = 0.1  # share of a component's readings that are outliers, from which their decisions are checked first

#: A remark on how the log was read, with another way that may be right.
_DOUBT = re.compile(r"(.*): (if .*), say --([a-z-]+) ([\w=-]+)")

#: Setting -> option of the command line, where the names differ.
_OPTIONS = {"jerk_psd_m2ps5": "jerk", "max_patch_s": "max_patch", "lag_s": "lag", "gain_form": "weight_form",
            "parameters": "set"}  # fmt: skip
#: What only another method, or another way of editing, understands.
_OF_METHOD = ("method", "parameters", "particles", "seed")
_OF_EDITING = ("editing", "lag_s", "max_patch_s", "gain_form")


class Step(NamedTuple):
    """place: times, or "". reason, advice: in words. options: of the command line, by name, with their words; no words:
    the option is left out. settings: with which the program can try the step; None where it cannot. typed: a command
    in place of that of the run with these options, with LOG for its log."""

    advice: str
    reason: str
    options: Mapping[str, Sequence[str]]
    place: str = ""
    settings: FilterSettings | None = None
    model: bool = True
    typed: str = ""

    def as_dict(self) -> dict[str, Any]:
        """JSON-serialisable. command: filled in by the command line; outcome: the verdict where it has been tried."""
        found = {"advice": self.advice, "reason": self.reason, "place": self.place}
        return {**found, "command": None, "outcome": None}


def steps(s: Summary, settings: FilterSettings, model_doubtful: bool) -> list[Step]:
    """For a summary whose verdict is not consistent; model_doubtful: whether the network is one that
    the flight itself has not proven."""
    if verdict.level_of(s["trust"]) == verdict.CONSISTENT:
        return []
    found = [*_left_out(settings), *([_WITHOUT_MODEL] if model_doubtful and s["correction_largest_m"] > 0 else [])]
    found += _smoothed(settings)
    share = max(verdict.outlier_share(part) for part in s["components"].values())
    rules = (
        (_conventions, _clock, _outliers, *_RULES) if share > verdict.MANY_REJECTED else _RULES
    )  # many may be taken for noise
    every = [*found, *(step for rule in rules for step in rule(s))]
    return [step for k, step in enumerate(every) if step not in every[:k]]


def of_fused(s: Summary, smooth: bool) -> list[Step]:
    """For the summary of several stations."""
    if verdict.level_of(s["trust"]) == verdict.CONSISTENT:
        return []
    found = [] if smooth else [Step("add --smooth", _CAUSAL, {"smooth": ("--smooth",)})]
    stretches = sorted(s["stretches"], key=lambda each: float(each["from_s"] - each["to_s"]))[:1]
    where = [f"{each['station']}, {each['from_s']:.6g} to {each['to_s']:.6g} s" for each in stretches] or [""]
    return [*found, _DECIDE._replace(place=where[0])]


def added(s: Summary, found: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """A summary with these steps in its verdict, if there are any."""
    return {**s, "trust": {**s["trust"], "next_steps": list(found)}} if found else dict(s)


def _left_out(settings: FilterSettings) -> Iterator[Step]:
    """Without what was specified: all of it, and each alone."""
    usual = FilterSettings()
    groups: dict[str, tuple[str, ...]] = {
        "method": _OF_METHOD, "editing": _OF_EDITING, "noise": ("noise",), "jerk": ("jerk_psd_m2ps5",),
        "gate": ("gate",),
    }  # fmt: skip
    stated = {name: of for name, of in groups.items() if getattr(settings, of[0]) != getattr(usual, of[0])}
    tried = [tuple(stated), *((name,) for name in stated)] if len(stated) > 1 else [(name,) for name in stated]
    for names in tried:
        of = [setting for name in names for setting in groups[name]]
        changed = {setting: getattr(usual, setting) for setting in of}
        gone = [f"--{name}" for name in names]
        yield Step(
            f"leave {' and '.join(gone)} out",
            f"{' and '.join(names)} as specified may not fit this log",
            {_OPTIONS.get(setting, setting): () for setting in of},
            settings=replace(settings, **changed),
        )


def _smoothed(settings: FilterSettings) -> Iterator[Step]:
    """The smoother, of a method that has one."""
    if not settings.smooth and registry.named(settings.method).smooths:
        usual = FilterSettings()
        causal = settings.editing in ("live", "forward")
        whole = {name: getattr(usual, name) for name in _OF_EDITING} if causal else {}
        options = {_OPTIONS.get(name, name): () for name in whole}
        yield Step(
            f"add --smooth{', without --editing' if causal else ''}",
            _CAUSAL,
            {**options, "smooth": ("--smooth",)}, settings=replace(settings, smooth=True, **whole),
        )  # fmt: skip


_CAUSAL = "a filter knows only what came before a gap or a patch"
_DECIDE = Step(
    f"write the decisions, correct them in {DECISIONS}, and filter with --decisions {DECISIONS}",
    "which of two tracks, or of many outliers, is the target's shows only from outside the log",
    {"write_decisions": ("--write-decisions", DECISIONS)},
)
_FUSE = Step(
    "fuse with the log of another station: ftproc filter --fuse range.toml",
    "the readings there do not determine the position",
    {}, typed="ftproc filter --fuse --write-config LOG OTHER_LOG > range.toml",
)  # fmt: skip
_WITHOUT_MODEL = Step(
    "add --model none", "the model may be of another instrument", {"model": ("--model", "none")}, model=False
)


def _outliers(s: Summary) -> Iterator[Step]:
    """Where the decisions are in doubt, the engineer's eye."""
    outliers = {name: part["isolated"] + part["patch"] for name, part in s["components"].items()}
    many = any(count > MANY * (count + s["components"][name]["good"]) for name, count in outliers.items())
    doubtful = any(s[name] for name in ("editing_places_unexamined", "doubtful_steps", "rivals", "reacquired"))
    stretches = s["poorly_observable"] if any(outliers.values()) else []
    if many or doubtful or s["editing_converged"] is False or stretches:
        yield _DECIDE._replace(place=_worst([*stretches, *s["rivals"]], s["doubtful_steps"]))


def _worst(stretches: Sequence[Summary], steps: Sequence[Summary]) -> str:
    """The times of the stretch that is least determined, or of the first step that is in doubt."""
    if stretches:
        worst = max(stretches, key=lambda each: float(each.get("sigma_m", 0.0)))
        return f"{worst['from_s']:.6g} to {worst['to_s']:.6g} s"
    return f"{steps[0]['time_s']:.6g} s" if steps else ""


def _steps_that_stay(s: Summary) -> Iterator[Step]:
    for step in s["steps"][:1]:
        what = "clock jumps" if step["component"] == "clock" else f"{step['component']} steps"
        reason = f"the {what}, and one log does not tell which side is right"
        yield _FUSE._replace(reason=reason, place=f"{step['time_s']:.6g} s")


def _conventions(s: Summary) -> Iterator[Step]:
    """What was remarked when the log was read: another unit or convention than was taken."""
    for found in filter(None, map(_DOUBT.fullmatch, s["remarks"])):
        why, condition, option, value = found.groups()
        advice = f"add --{option} {value}, {condition}"
        yield Step(advice, why, {option.replace("-", "_"): (f"--{option}", value)})


def _clock(s: Summary) -> Iterator[Step]:
    if s["clock_set_back"]:
        row, last = s["clock_set_back"]["row"], s["rows_in_file"] - 1
        fewer = f"{row},{last}" if 2 * row >= last else f"0,{row - 1}"
        yield Step(
            f"reject the rows with the wrong clock, as all,{fewer},bad under "
            f"component,from_row,to_row,use, with --decisions {DECISIONS}",
            "rows before and after the clock was set back have the same times",
            {"write_decisions": ("--write-decisions", DECISIONS)}, f"row {row}",
        )  # fmt: skip


def _noise(s: Summary) -> Iterator[Step]:
    """Where noise and motion cannot be separated, the instrument's noise."""
    if any(part["verdict"] == "cautious" for part in s["components"].values()) and not s["slow_noise_s"]:
        found = [s["components"].get(name, {}).get(f"noise_{unit}") for name, unit in UNITS.items()]
        example = ",".join("auto" if sigma is None else f"{sigma:.2g}" for sigma in found)
        yield Step(
            "give the noise of the instrument (m, rad, rad; here are those found)",
            "noise and motion cannot be separated in readings so widely spaced",
            {"noise": ("--noise", example)},
        )  # fmt: skip


def _noise_like_motion(s: Summary) -> Iterator[Step]:
    """Where no number makes up for what one log lacks: with the noise given, white, it would only look consistent."""
    if s["slow_noise_s"]:
        yield _FUSE._replace(reason="noise that is correlated so long resembles motion in a single log")
    for one in s["one_sided_errors"][:1]:
        yield _FUSE._replace(reason=f"the {one['component']} errors lie on one side, and so does its estimate")
    few = [name for name, part in s["components"].items() if part["good"] < verdict.FEWEST_GOOD]
    if any(name not in s["not_observable"] for name in few):
        yield _FUSE._replace(reason=f"so few {verdict.listed(few)} readings test nothing")


def _geometry(s: Summary) -> Iterator[Step]:
    for each in s["poorly_observable"][:1]:
        yield _FUSE._replace(place=f"{each['from_s']:.6g} to {each['to_s']:.6g} s")


def _otherwise(s: Summary) -> Iterator[Step]:
    yield Step(
        "look at the residuals: --report page.html", "the reasons name no single cause",
        {"report": ("--report", "page.html")},
    )  # fmt: skip


_RULES: Sequence[Callable[[Summary], Iterator[Step]]] = (
    _conventions, _clock, _noise_like_motion, _noise, _outliers, _steps_that_stay, _geometry, _otherwise,
)  # fmt: skip


def in_words(step: Mapping[str, Any]) -> list[str]:
    """A step of a verdict as lines: what to do, where, what came of it, and the command to type."""
    place = f"at {step['place']}: " if step["place"] else ""
    outcome = f": then it is {step['outcome']}" if step["outcome"] else ""
    command = [step["command"]] if step["command"] else []
    return [f"{place}{step['advice']}{outcome}", *command]
