"""Is a trajectory consistent, suspect or unreliable, and why: every remark on a run, each with its level."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from ftproc.files.moments import Moments
from ftproc.quality import by_hand, consistency, faults

CONSISTENT, SUSPECT, UNRELIABLE = "consistent", "suspect", "unreliable"
LEVELS = (CONSISTENT, SUSPECT, UNRELIABLE)  # from good to bad
FEWEST_GOOD = 16  # readings of a component, for a test of its sigmas; of 12, one sound log in 16 is 5 sigma off
UNRELIABLE_RATIO = 2.0  # innovation ratio over its upper bound, from which the sigmas mean nothing
MANY_SIGMAS = 5.0  # of a network's correction, from which only an error of the instrument can be its reason
FEWEST_OVERLOOKED, OVERLOOKED = (
    5,
    0.5,
)  # outliers of the screening, and share of them, that a method without sigmas uses
MANY_REJECTED, TOO_MANY_REJECTED = 0.25, 0.5  # share of a component's readings. With a third of all readings outliers,
# one flight in five diverges, and nearly all of these have more than a quarter rejected.

FASTEST_MPS2, NEVER_MPS2 = 1e3, 1e4  # of acceleration: 100 g, of the hardest interceptors; ten times as much, of
# nothing that has left its barrel
CHANCE_RAD = 0.25  # of noise: readings at chance over half a turn have 0.9, over a quarter 0.45, no instrument 0.1
TOO_WIDE = 0.5  # innovation ratio below which the sigmas are far too large

_NO_FAULT = "residuals agree with the published sigmas, and no fault shows"
_NO_FAULT_BUT = "{} residuals are smaller than the published sigmas, which are cautious, and no fault shows"
#: Stands with every consistent run.
NOT_SHOWN = (
    "One log cannot show constant or slow biases, an offset of the clock, or a false target followed throughout."
)


class Remark(NamedTuple):
    """A sentence on a run. level: the best verdict that it allows."""

    level: str
    text: str


def remarks(s: Mapping[str, Any]) -> list[Remark]:
    """All remarks on a summary (see `RunStatistics.summary`)."""
    found = [*_observability(s), *_sigmas(s), *_no_flight(s), *_editing(s)]
    found += [Remark(SUSPECT, text) for text in faults.suspicious(s)]
    found += [Remark(CONSISTENT, text) for text in faults.allowed_for(s)]
    found += by_hand_remarks(s)
    correlation = max(part["noise_correlation"] for part in s["components"].values())
    if correlation > 0:
        text = f"the noise is correlated between samples (coefficient up to {correlation:.2f}); the sigmas allow for it"
        found.append(Remark(CONSISTENT, text))
    if s["time_stamp_sigma_s"] > 0:
        text = f"the time stamps are off by {1000 * s['time_stamp_sigma_s']:.3g} ms (1 sigma); the sigmas allow for it"
        found.append(Remark(CONSISTENT, text))
    if s["noise_drifts"]:
        found.append(Remark(CONSISTENT, "the variance of the noise changes along the log; the sigmas follow it"))
    if s.get("correction_lost_by_smoothing"):
        text = "the model corrects the filter only: the smoothed estimate is not corrected"
        found.append(Remark(CONSISTENT, text))
    if s.get("correction_missing"):
        found.append(Remark(CONSISTENT, f"the model corrects nothing: {s['correction_missing']}"))
    if s["correction_largest_m"] > 0:
        outside = f"none for the {100 * s['correction_outside_training']:.1f} % of samples outside its training data"
        size = f"up to {s['correction_largest_m']:.3g} m, {s['correction_largest_sigma']:.2g} sigma"
        kind = "linear" if s.get("correction_linear") else "network"
        if s["correction_largest_sigma"] > MANY_SIGMAS:
            text = f"{kind} correction {size}: more than noise explains; check that the model is of this instrument"
            found.append(Remark(SUSPECT, text))
        found.append(Remark(CONSISTENT, f"{kind} correction {size}; {outside}"))
    return found


def by_hand_remarks(s: Mapping[str, Any]) -> list[Remark]:
    """On the decisions by hand in a summary."""
    contradicted = [Remark(SUSPECT, text) for text in by_hand.contradicted(s)]
    return [*contradicted, *(Remark(CONSISTENT, text) for text in by_hand.in_words(s))]


def verdict(found: Sequence[Remark], too_wide: Sequence[str] = (), assumed: Sequence[str] = ()) -> dict[str, Any]:
    """The worst level among the remarks, with the remarks of that level as reasons, and of a consistent run what a
    single log cannot show, and which components (see `too_wide`) have too large sigmas; JSON-serialisable.

    assumed: what nothing states of the log, such as `the range is in m`. A consistent run is so only if that holds, and
    its verdict says it.
    """
    level = max((remark.level for remark in found), key=LEVELS.index, default=CONSISTENT)
    if level == CONSISTENT:
        cautious = {"cautious": list(too_wide)} if too_wide else {}
        named = f"{level} if {listed(assumed)}" if assumed else level
        return {"verdict": named, "reasons": [], **cautious, "not_shown": NOT_SHOWN}
    return {"verdict": level, "reasons": [remark.text for remark in found if remark.level == level]}


def level_of(trust: Mapping[str, Any]) -> str:
    """One of LEVELS (or what another program wrote), without what is assumed."""
    return str(trust.get("verdict", "")).partition(" if ")[0]


def sentence(trust: Mapping[str, Any]) -> str:
    """The verdict with its reasons."""
    cautious = trust.get("cautious")
    nothing = _NO_FAULT_BUT.format(listed(cautious)) if cautious else _NO_FAULT
    return f"{trust['verdict']}: {'; '.join(trust['reasons']) or nothing}"


def too_wide(s: Mapping[str, Any]) -> list[str]:
    """The components whose innovations are smaller than their predicted sigmas allow."""
    return [name for name, part in s["components"].items() if part["verdict"] == "cautious"]


def _observability(s: Mapping[str, Any]) -> Iterator[Remark]:
    absent, height = s["not_observable"], _height(s)
    if height:
        yield Remark(CONSISTENT, height)
    elif absent:
        seen = listed([name for name in s["components"] if name not in absent])
        text = f"{listed(absent)} missing throughout: position and velocity are not observable and left empty; the " \
               f"verdict is about the {seen}"  # fmt: skip
        yield Remark(CONSISTENT, text)
    yield from _intervals("the position", s["poorly_observable"], Moments.of_summary(s))
    for name, intervals in s["poorly_observable_readings"].items():
        yield from _intervals(f"the {name}", intervals, Moments.of_summary(s))


def _height(s: Mapping[str, Any]) -> str:
    """What stands for an elevation that is not measured, in a sentence; "" for nothing."""
    if "height_common_sigma_m" in s:
        off = s["height_common_sigma_m"]
        return (
            f"heights stand for the elevation; all of them may be off by {off:.3g} m (1 sigma): the sigmas allow for it"
        )
    if "height_m" not in s:
        return ""
    above = f"{s['height_m']:g} m above the station, 1 sigma {s['height_sigma_m']:g} m"
    if s["height_of"] != "specified":
        above = f"that of {s['height_of']}, {above} (--height states another)"
    return f"elevation missing throughout: the height is taken for {above}; z is that, and x and y allow for it"


def _intervals(what: str, intervals: Sequence[Mapping[str, float]], moments: Moments) -> Iterator[Remark]:
    """Where an estimate is poorly observable."""
    if not intervals:
        return
    (name,) = set(intervals[0]) - {"from_s", "to_s"}
    worst = max(intervals, key=lambda part: part[name])
    first, last = (moments.words(worst[end]) for end in ("from_s", "to_s"))
    when = f"at {first}" if first == last else f"from {first.removesuffix(' s')} to {last}"
    size = f"{worst[name]:.3g} m" if name == "sigma_m" else f"{1e3 * worst[name]:.3g} mrad"
    if len(intervals) == 1:
        yield Remark(SUSPECT, f"{what} is poorly observable {when}: 1 sigma up to {size}")
    else:
        yield Remark(
            SUSPECT, f"{what} is poorly observable in {len(intervals)} intervals: 1 sigma up to {size}, {when}"
        )


def listed(names: Sequence[str]) -> str:
    """range; range and azimuth; range, azimuth and elevation."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _sigmas(s: Mapping[str, Any]) -> Iterator[Remark]:
    if not s["sigmas_published"]:
        yield Remark(SUSPECT, "the method publishes no sigmas, so nothing tests its estimate")
    used, all_of_them = s["screened_out_but_used"], s["screened_out"]
    if used:
        level = UNRELIABLE if used >= FEWEST_OVERLOOKED and used > OVERLOOKED * all_of_them else SUSPECT
        text = f"screening calls {all_of_them} readings outliers, of which the method uses {used}"
        yield Remark(level, text)
    wide = too_wide(s)
    everything = len(wide) == len(s["components"]) - len(s["not_observable"])
    for name, part in s["components"].items():
        ratio, predicted = part["innovation_ratio"], part["predicted_sigma_ratio"]
        if name in wide:
            specified = name in s.get("specified_noise", ())
            why = "so is the specified noise" if specified else "noise and motion cannot be told apart at this rate"
            text = f"{name} innovations are {ratio:.2g} times their predicted sigma: the published sigmas are too large"
            far = not specified and (everything or ratio < TOO_WIDE)
            yield Remark(SUSPECT if far else CONSISTENT, f"{text}; {why}")
        if ratio is not None and part["verdict"] == "overconfident":
            level = UNRELIABLE if ratio > UNRELIABLE_RATIO * part["innovation_bounds"][1] else SUSPECT
            yield Remark(level, f"{name} innovations are {ratio:.3g} times their predicted sigma: the published sigmas "
                                "are too small")  # fmt: skip
        if name not in s["not_observable"] and part["good"] < FEWEST_GOOD:
            yield Remark(SUSPECT, f"too few good {name} readings ({part['good']}) to test the sigmas")
        if predicted is not None and predicted > consistency.POORLY_PREDICTED:
            yield Remark(SUSPECT, f"{name} is poorly observable: its predicted sigma is {predicted:.0f} times the "
                                  "measurement noise, so the gate detects only much larger outliers")  # fmt: skip
    if s["slow_noise_s"]:
        likelier = s["slow_noise_likelier"]
        better = "better than motion does, but cannot be separated from it" if likelier else "as well as motion does"
        text = f"noise that is correlated over {s['slow_noise_s']:.3g} s explains the log {better}: the sigmas allow " \
               "for both, the estimate follows the motion"  # fmt: skip
        wrong = UNRELIABLE if not s["not_observable"] else SUSPECT  # what stands in for a component is no motion
        yield Remark(wrong if likelier else CONSISTENT if s["slow_noise_separable"] else SUSPECT, text)


def too_fast(least_mps2: float) -> Iterator[Remark]:
    """An acceleration that was surely reached, and that almost nothing has."""
    if least_mps2 > FASTEST_MPS2:
        text = f"the readings ask for an acceleration of {least_mps2:.3g} m/s2, which almost nothing that flies reaches"
        yield Remark(SUSPECT if least_mps2 < NEVER_MPS2 else UNRELIABLE, text)


def _no_flight(s: Mapping[str, Any]) -> Iterator[Remark]:
    """What no flight explains."""
    yield from too_fast(s.get("acceleration_at_least_mps2", 0.0))
    yield from _left_behind(s)
    for name, part in s["components"].items():
        if (part.get("noise_rad") or 0.0) > CHANCE_RAD:
            text = f"the {name} noise of {part['noise_rad']:.2g} rad is nearly that of readings at chance"
            yield Remark(UNRELIABLE, f"{text}: check the columns and their units")


def _left_behind(s: Mapping[str, Any]) -> Iterator[Remark]:
    """Where the estimate leaves the bulk of the readings that it uses: the worst stretch of each component, of those
    whose sigmas are not too small throughout."""
    for name, part in s["components"].items():
        stretches = [each for each in s.get("left_behind", ()) if each["component"] == name]
        if not stretches or part["innovation_ratio"] > UNRELIABLE_RATIO * part["innovation_bounds"][1]:
            continue
        worst = max(stretches, key=lambda each: each["sigmas"])
        first, last = (Moments.of_summary(s).words(worst[end]) for end in ("from_s", "to_s"))
        text = f"from {first.removesuffix(' s')} to {last} most {name} readings lie {worst['sigmas']:.2g} sigmas or " \
               "more from the estimate: do not use it there"  # fmt: skip
        yield Remark(UNRELIABLE, text)


def _editing(s: Mapping[str, Any]) -> Iterator[Remark]:
    for name, part in s["components"].items():
        share = outlier_share(part)
        if share > MANY_REJECTED:
            level = UNRELIABLE if share > TOO_MANY_REJECTED else SUSPECT
            yield Remark(level, f"{100 * share:.0f} % of the {name} readings are rejected as outliers")
    if s["editing_converged"] is False:
        yield Remark(SUSPECT, "the outlier decisions did not converge: inspect the flagged readings")
    if s["editing_places_unexamined"]:
        yield cut_short(s["editing_places_unexamined"])
    if s["reacquired"]:
        often = {1: "once", 2: "twice"}.get(s["reacquired"], f"{s['reacquired']} times")
        yield Remark(SUSPECT, f"re-initialized {often} (track loss, or a gap too long to bridge)")


def cut_short(count: int) -> Remark:
    """That no work was left for so many places."""
    places = "1 place was" if count == 1 else f"{count} places were"
    return Remark(SUSPECT, f"the search for likelier outlier decisions was cut short: {places} not examined")


def outlier_share(part: Mapping[str, Any]) -> float:
    """Outliers among the readings that are not missing, of one component of a summary."""
    bad = part["isolated"] + part["patch"]
    return float(bad / max(bad + part["good"], 1))
