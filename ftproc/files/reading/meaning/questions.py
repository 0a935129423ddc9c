"""Questions about columns that a log may mean, each with the option that answers it, to be typed as it stands."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

from ftproc.errors import InputError, nearest, quoted
from ftproc.files.layout import CANONICAL
from ftproc.files.options import ABSENT
from ftproc.files.reading.meaning.names import Name, taken_apart, units_unknown
from ftproc.files.reading.meaning.wording import HORIZONTAL, counts_from, says_north
from ftproc.files.units import LIGHT_MPS, UNITS, unit_named
from ftproc.files.words import (
    ALIASES,
    COUNTS,
    COURSES,
    EITHER_ANGLE,
    FRAMES,
    FURTHER_ALIASES,
    NOT_UNITS,
    OTHER_THINGS,
    QUANTITIES,
    SPEEDS,
    WEAK_ALIASES,
)

_FLIGHTS = frozenset(("tof", "timeofflight", "flighttime", "roundtriptime", "rtt", "laufzeit"))
_GATES = re.compile(r"(?:range)?(?:gate|bin|cell)s?(?:no|nr|num|number|index)?")  # whole stems
_BESIDE_V = {"range": "s", "azimuth": "h"}  # the slope distance and the horizontal angle of surveyors
_MOST_WORDS = 6  # of a name that may number its target
#: Words of NOT_UNITS with which a column may still be the quantity.
_OF_THE_QUANTITY = frozenset(["true", "corr", "raw", "ref"])


class Proposal(NamedTuple):
    """answer: the options that say which column is which, as they were tried on the log; or "". seen: what each column
    holds. columns: of the quantities in the answer. idle: free columns that stay or count."""

    answer: str = ""
    seen: str = ""
    columns: Mapping[str, int] = {}
    idle: Collection[int] = ()


#: Free columns, and those of each quantity that is known -> which of the free ones may be which; see `proposal`.
Propose = Callable[[Sequence[int], Mapping[str, Sequence[int]]], Proposal]


def named(name: str, index: int) -> str:
    """A column as `--columns` takes it: by its name, or by its number where the name has marks of the option."""
    plain = name and not any(mark in name for mark in ",=+") and not name.isdecimal()
    return name if plain else str(index + 1)


def answer(names: Sequence[str], columns: Mapping[str, int], time: str = "", joined: Mapping[int, int] = {}) -> str:
    """`--columns range=RNG,azimuth=3`, as a shell takes it. time: its columns, such as 1+2. joined: how many columns
    behind hold the rest of a number, such as minutes."""
    called = [named(name, k) if names.count(name) == 1 else str(k + 1) for k, name in enumerate(names)]
    each = [f"time={time}"] if time else []
    each += (f"{q}={'+'.join(called[index : index + 1 + joined.get(index, 0)])}" for q, index in columns.items())
    return f"--columns {quoted(','.join(each))}"


def listed(names: Sequence[str]) -> str:
    """The columns of a file for a message, at most twenty of them."""
    shown = ", ".join(names[:20])
    return f"{shown} and {len(names) - 20} more" if len(names) > 20 else shown


def refuse_twice(source: str, names: Sequence[str], name: str) -> None:
    if names.count(name) > 1:
        numbers = [str(index + 1) for index, each in enumerate(names) if each == name]
        raise InputError(
            f'{source}: column "{name}" is there {len(numbers)} times; rename or delete all but one, or say with '
            f"--columns which columns are meant by their numbers (here {' or '.join(numbers)}). "
            f"Its columns are: {listed(names)}."
        )


def refuse_side_by_side(source: str, apart: Sequence[Name], stated: Collection[str]) -> None:
    """Ask which of several targets or stations is meant whose readings stand side by side in each row."""
    groups: dict[str, dict[str, int]] = {}
    for index, name in enumerate(apart):
        for quantity in QUANTITIES[1:]:
            if (mark := _mark(name, quantity)) is not None:
                groups.setdefault(mark, {}).setdefault(quantity, index)
    shared = [columns for columns in groups.values() if len(columns) > 1]
    if len(shared) < 2 or set(shared[0]) <= set(stated):
        return
    names = [name.text for name in apart]
    ways = " or ".join(answer(names, columns) for columns in shared[:6])
    raise InputError(
        f"{source}: the readings of {len(shared)} targets or stations stand side by side in each row. Say which one is "
        f"meant: {ways}."
    )


def refuse_positions(source: str, apart: Sequence[Name]) -> None:
    """Raise InputError for the track of a receiver on board."""
    words = {word for name in apart for word in (name.stem, *name.words)}
    if words & {"lat", "latitude"} and words & {"lon", "lng", "long", "longitude"}:
        raise InputError(
            f"{source}: positions by latitude and longitude, not readings of an instrument that tracks a target. As "
            'one station of a range file they are used with kind = "position"; as --truth, by score and train.'
        )


def _mark(name: Name, quantity: str) -> str | None:
    """What distinguishes a column of a quantity from others of the same, such as T1 or 2; None of other columns."""
    known = {*ALIASES[quantity], *WEAK_ALIASES[quantity]} - {""}
    if len(name.words) > _MOST_WORDS or name.foreign or NOT_UNITS & {*name.words}:
        return None
    if name.unit and unit_named(quantity, name.unit) is None:
        return None
    for k, word in enumerate(name.words):
        rest = "".join((*name.words[:k], *name.words[k + 1 :]))
        if rest in known and re.fullmatch(r"[a-z]*\d+|[a-z]", word) and word not in known:
            return word
    found = re.fullmatch(r"(\D+)(\d+)", name.stem)
    return found[2] if found and found[1] in known else None


def refuse_unknown_unit(source: str, apart: Sequence[Name], free: Sequence[int], quantity: str) -> None:
    """A log without a range may be angles-only; one with `range_furlong` is not."""
    names = [name.text for name in apart]
    absent = "" if quantity == "time" else f", or --columns {quantity}={ABSENT} if it is something else"
    for index, unit in units_unknown(apart, free, quantity):
        raise InputError(
            f'{source}: "{unit}" in column "{names[index]}" is not a unit of {quantity}; understood are '
            f"{', '.join(UNITS[quantity])}. Convert the column and rename it, "
            f"or say {answer(names, {quantity: index})} --units {quantity}=UNIT (with a factor: '{quantity}=100 "
            f"{next(iter(UNITS[quantity]))}'){absent}."
        )


def refuse_hours(source: str, name: Name, quantity: str) -> None:
    """Angles whose name says that they are hours, minutes and seconds."""
    if quantity != "time" and name.notation.startswith("h"):
        raise InputError(
            f'{source}: column "{name.text}" is in hours ({name.notation}), which are read as times only. '
            "Convert it to degrees (15 to the hour) and rename it; "
            f"if it is in degrees, minutes and seconds, say --units {quantity}=deg."
        )


def counts_frames(name: Name) -> bool:
    """Whether a column counts frames or samples: `Frame No.`, `sample_25Hz`."""
    words = [word for word in name.words if not re.fullmatch(r"\d+(?:fps|hz)", word)]
    return bool(words) and FRAMES.issuperset(words) and not name.unit


def refuse_frames(source: str, names: Sequence[str], index: int, units: Sequence[str] = ()) -> None:
    """Ask how many frames or samples there are in a second. units: of the time, as several lines state them."""
    say = answer(names, {"time": index})
    ways = " or ".join(f"{say} --units {quoted(f'time={unit}')}" for unit in units)
    raise InputError(
        f'{source}: "{names[index]}" counts frames or samples, and '
        f"{'several rates are stated' if units else 'nothing says how many there are in a second'}. Say "
        f"{ways or f'{say} --units time=UNIT, where UNIT is such as {chr(39)}1/25 s{chr(39)} for 25 in a second'}."
    )


def refuse_course(source: str, apart: Sequence[Name], roles: Mapping[str, int]) -> None:
    """Ask whose course stands beside azimuths from the head of the carrier, if a speed does too."""
    if "added" not in roles or not COURSES & {*apart[roles["added"]].words}:
        return
    if any(SPEEDS & {*name.words} for name in apart):
        (mine, azimuth), (course, added) = ((apart[roles[role]].text, roles[role]) for role in ("azimuth", "added"))
        names = [name.text for name in apart]
        both = quoted(f"azimuth={named(mine, azimuth)}+{named(course, added)}")
        raise InputError(
            f'{source}: "{mine}" counts from the head of the carrier, and "{course}" may be its heading or the course '
            f"of the target. Say --columns {both} if it is the heading, or {answer(names, {'azimuth': azimuth})} if "
            "the head of the carrier stays where it is."
        )


def refuse_left_out(source: str, names: Sequence[str], proposed: Proposal) -> None:
    """Ask about columns with names that say nothing, which make a target that moves like one with those that are
    known."""
    if proposed.columns:
        (one, first), *others = ((quantity, names[index]) for quantity, index in proposed.columns.items())
        which = "".join([f'"{first}" may be the {one}', *(f' and "{name}" the {other}' for other, name in others)])
        none = ",".join(f"{quantity}={ABSENT}" for quantity in proposed.columns)
        raise InputError(
            f"{source}: by the values, {which}. Say {proposed.answer}, which gives a target that moves like one, or "
            f"--columns {none} if not."
        )


def refuse_alike(
    source: str, apart: Sequence[Name], free: Sequence[int], quantity: str, doubtful: bool = False
) -> None:  # fmt: skip
    """Ask about a column that may be the quantity, so that it is not left out without a word. doubtful: the other angle
    has a name that this one may have too, so any column with a name that is not known may be it."""
    known = {alias for alias in ALIASES[quantity] if len(alias) > 1}
    surveyors = any(each.stem == "v" and index not in free for index, each in enumerate(apart))
    for index in free if quantity != "time" else ():
        name = apart[index]
        words = {name.stem, *name.words}
        _refuse_scale(source, apart, index, quantity)
        either = quantity != "range" and name.core() in EITHER_ANGLE
        if quantity == "elevation" and unit_named("height", name.unit):
            continue
        bearing = quantity == "elevation" and (counts_from(name) or says_north(name.text))
        another = words & OTHER_THINGS or bearing or name.is_zenith() or any(map(name.means, QUANTITIES))
        alike = known & words or (name.is_in_a_unit_of(quantity) and not another)
        bare = (quantity == "range" and name.stem == "d") or (surveyors and name.stem == _BESIDE_V.get(quantity))
        unknown = doubtful and not another and not any(name.stem in stems for stems in FURTHER_ALIASES.values())
        if not name.foreign and (either or bare or ((alike or unknown) and not NOT_UNITS - _OF_THE_QUANTITY & words)):
            say = answer([each.text for each in apart], {quantity: index})
            turns = counts_from(name) if quantity == "azimuth" else ""
            only = f" if {turns}, from which it counts, stays where it is" if turns else ""
            raise InputError(
                f'{source}: column "{name.text}" may be the {quantity}. Say {say}{only}, or '
                f"--columns {quantity}={ABSENT} if it is something else."
            )


def _refuse_scale(source: str, apart: Sequence[Name], index: int, quantity: str) -> None:
    """Ask for the scale of readings that are counts of an encoder, numbers of range gates, or times of flight."""
    name, names, unit = apart[index], [each.text for each in apart], unit_named("time", apart[index].unit)
    words = {name.stem, *name.words, *re.findall(r"[^\W\d_]+", name.text.lower())}
    if quantity == "range" and any(map(HORIZONTAL.fullmatch, words)):
        raise InputError(
            f'{source}: column "{name.text}" is a horizontal distance, and ranges are slant ones. Divide it by the '
            f"cosine of the elevation and name it a slant range, or say --columns range={ABSENT} to leave it out."
        )
    if quantity == "range" and (words & _FLIGHTS or (unit and words & {*ALIASES["range"]})):
        once = LIGHT_MPS * (unit.multiply / unit.divide if unit else 1.0)
        there_and_back = f"'range={once / 2:.9g} m' (there and back; one way it is {once:.9g} m)"
        scale = f"'range={once:.9g} m'" if {"one", "oneway"} & words else there_and_back
        what = f"times of flight{'' if unit else ' in a unit that its name does not state'}"
    elif quantity != "range" and words & COUNTS and words & {each for each in ALIASES[quantity] if len(each) > 1}:
        scale, what = f"'{quantity}=16 bit', or as many bits as it has", "counts of an encoder"
    elif quantity == "range" and _GATES.fullmatch(name.stem) and not name.unit:
        scale, what = "range=UNIT, where UNIT is the length of one, such as '15 m'", "numbers of range gates"
    else:
        return
    raise InputError(
        f'{source}: column "{name.text}" may be the {quantity} as {what}. Say {answer(names, {quantity: index})} '
        f"--units {scale}, or --columns {quantity}={ABSENT} if it is something else."
    )


def refuse_either(source: str, apart: Sequence[Name], free: Sequence[int]) -> None:
    """Ask which of two angles is the azimuth where their names, such as theta and phi, leave it open."""
    indices = [index for index in free if apart[index].core() in EITHER_ANGLE][:2]
    if len(indices) > 1:
        names = [name.text for name in apart]
        one, other = (answer(names, {"azimuth": a, "elevation": e}) for a, e in (indices, indices[::-1]))
        raise InputError(
            f'{source}: "{names[indices[0]]}" and "{names[indices[1]]}" are the azimuth and the other angle, in an '
            f"order that the names leave open. Say {one} or {other}; add --elevation-from zenith if the other angle "
            "counts from the vertical."
        )


def check_complete(source: str, names: Sequence[str], found: Mapping[str, tuple[int, ...]], propose: Propose) -> None:
    """Raise InputError, a question, if the time or every component is missing. found: positions of each quantity."""
    if "time" in found and len(found) > 1:
        return
    taken = {index for indices in found.values() for index in indices}
    free = [index for index in range(len(names)) if index not in taken]
    sought = [quantity for quantity in QUANTITIES if quantity not in found and ("time" in found or len(found) == 0)]
    sought = sought or ["time"]
    wanted = "time" if "time" not in found else "range"
    what = "no time column" if wanted == "time" else "neither range nor azimuth nor elevation"
    if {"x_m", "y_m", "z_m"} <= set(names):
        raise InputError(
            f"{source}: x_m, y_m, z_m are columns of a truth, for `ftproc score TRAJECTORY --truth {source}`, not of a "
            f"log: it has {what}. Its columns are: {listed(names)}."
        )
    proposed = propose(free, found)
    seen = f" Its columns hold, in two rows: {proposed.seen}." if proposed.seen else ""
    none = f"--columns {','.join(f'{quantity}=NAME' for quantity in sought)}"
    moves = ", which gives a target that moves like one" * (len(sought) > 1)
    say = f"{proposed.answer}{moves}" if proposed.answer else none
    if names and list(names) == [str(number) for number in range(1, len(names) + 1)]:
        no_answer = bool(seen and not proposed.answer)
        none_moves = " No choice of them gives a target that clearly moves like one." * no_answer
        raise InputError(
            f"{source}: there is no line of column names.{seen}{none_moves} Say which column is which by their "
            f"numbers, such as {say}."
        )
    hint = nearest(CANONICAL[wanted], [names[k] for k in free if not NOT_UNITS & {*taken_apart(names[k]).words}])
    similar = next((index for index in free if hint and f'"{names[index]}"' in hint), None)
    say = say if proposed.answer or similar is None else answer(names, {wanted: similar})
    raise InputError(
        f"{source}: {what} (expected {CANONICAL[wanted]} or {' or '.join(ALIASES[wanted][:2])}){hint or '.'} "
        f"Its columns are: {listed(names)}.{seen} Name the right ones with {say}."
    )


def nothing(free: Sequence[int], found: Mapping[str, Sequence[int]]) -> Proposal:
    """No proposal."""
    return Proposal()
