"""Whether to trust a trajectory, and why: every remark on a run, each with what it means for trust."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from ftproc.quality import consistency

TRUST, CAREFUL, NO = "trust", "be careful", "do not trust"
LEVELS = (TRUST, CAREFUL, NO)  # from good to bad
FEWEST_GOOD = 20  # readings of a component, for its sigmas to be judged at all
FAR_OFF = 2.0  # innovations so many times larger than the filter says: its sigmas mean nothing
MANY_REJECTED, TOO_MANY_REJECTED = 0.25, 0.5  # share of the readings of a component; of flights with a third of all
# readings wild a fifth goes astray, and hardly any of these shows fewer than a quarter

_OPENING = {TRUST: "Trust it", CAREFUL: "Be careful", NO: "Do not trust it"}
_ALL_WELL = "readings are no farther off than the sigmas say, and nothing else is in doubt"


class Remark(NamedTuple):
    """A sentence on a run. level: the most that a trajectory of which this is true deserves."""

    level: str
    text: str


def remarks(s: Mapping[str, Any]) -> list[Remark]:
    """All there is to say about the figures of a summary (see `summary.summarise`)."""
    found = [*_observability(s), *_sigmas(s), *_editing(s)]
    correlation = max(part["noise_correlation"] for part in s["components"].values())
    if correlation > 0:
        text = f"the noise is correlated from sample to sample (up to {correlation:.2f}); the sigmas allow for it"
        found.append(Remark(TRUST, text))
    if s.get("correction_lost_by_smoothing"):
        found.append(Remark(TRUST, "the model corrects the filter only: what was smoothed is not corrected"))
    if s["correction_largest_m"] > 0:
        outside = f"{100 * s['correction_outside_training']:.1f} % of samples outside its training got none"
        found.append(Remark(TRUST, f"network correction up to {s['correction_largest_m']:.3g} m; {outside}"))
    return found


def verdict(found: Sequence[Remark]) -> dict[str, Any]:
    """The worst level among the remarks, with the remarks of that level as reasons; JSON-serialisable."""
    level = max((remark.level for remark in found), key=LEVELS.index, default=TRUST)
    reasons = [] if level == TRUST else [remark.text for remark in found if remark.level == level]
    return {"verdict": level, "reasons": reasons}


def sentence(trust: Mapping[str, Any]) -> str:
    """The verdict in words, with what it rests on."""
    return f"{opening(trust)}: {'; '.join(trust['reasons']) or _ALL_WELL}."


def opening(trust: Mapping[str, Any]) -> str:
    """The verdict in a few words."""
    return _OPENING[trust["verdict"]]


def _observability(s: Mapping[str, Any]) -> Iterator[Remark]:
    if s["not_observable"]:
        names = " and ".join(s["not_observable"])
        text = f"{names} missing throughout: position and velocity are not observable and left empty"
        yield Remark(CAREFUL, text)
    blind = s["hardly_observable"]
    if blind:
        worst = max(blind, key=lambda part: part["sigma_m"])
        first, last = (f"{worst[end]:.6g}" for end in ("from_s", "to_s"))
        when = f"at {first} s" if first == last else f"from {first} to {last} s"
        text = f"the position is hardly observable: 1 sigma up to {worst['sigma_m']:.3g} m"
        many = f"in {len(blind)} stretches {text}, most of all {when}"
        yield Remark(CAREFUL, f"{when} {text}" if len(blind) == 1 else many)


def _sigmas(s: Mapping[str, Any]) -> Iterator[Remark]:
    for name, part in s["components"].items():
        ratio, vague = part["innovation_ratio"], part["prediction_vagueness"]
        if ratio is not None and part["verdict"] == "overconfident":
            level = NO if ratio > FAR_OFF * part["innovation_bounds"][1] else CAREFUL
            yield Remark(level, f"{name} readings are {ratio:.3g} times as far off as the filter says: its sigmas are "
                                "too small")  # fmt: skip
        if name not in s["not_observable"] and part["good"] < FEWEST_GOOD:
            yield Remark(CAREFUL, f"{part['good']} good readings of {name} are too few to judge the sigmas by")
        if vague is not None and vague > consistency.VAGUE:
            yield Remark(CAREFUL, f"the {name} gate can hardly fire: predictions are {vague:.0f} times vaguer than "
                                  "readings, so only far larger outliers are noticed")  # fmt: skip
    if s["slow_noise"] and not s["not_observable"]:
        yield Remark(NO, "the noise is correlated so slowly that it passes for motion: the sigmas are too small")


def _editing(s: Mapping[str, Any]) -> Iterator[Remark]:
    for name, part in s["components"].items():
        share = outlier_share(part)
        if share > MANY_REJECTED:
            level = NO if share > TOO_MANY_REJECTED else CAREFUL
            yield Remark(level, f"{100 * share:.0f} % of the {name} readings are called outliers")
    if s["editing_settled"] is False:
        yield Remark(CAREFUL, "the outlier decisions did not settle: look at the flagged stretches")
    if s["reacquired"]:
        often = "once" if s["reacquired"] == 1 else f"{s['reacquired']} times"
        times = f"{often} (lost, or a gap too long to bridge)"
        yield Remark(CAREFUL, f"the track was taken up anew {times}")


def outlier_share(part: Mapping[str, Any]) -> float:
    """Outliers among the readings that are there, of one component of a summary."""
    bad = part["isolated"] + part["patch"]
    return float(bad / max(bad + part["good"], 1))
