"""Questions about columns that a log may mean, each with the option that answers it, to be typed as it stands."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

from ftproc.errors import InputError, nearest, quoted
from ftproc.files.layout import CANONICAL
from ftproc.files.options import ABSENT
from ftproc.files.reading.meaning.names import Name, taken_apart
from ftproc.files.units import UNITS, unit_named
from ftproc.files.words import ALIASES, EITHER_ANGLE, NOT_UNITS, OTHER_THINGS, QUANTITIES

#: Words of NOT_UNITS with which a column may still be the quantity.
_OF_THE_QUANTITY = frozenset(["true", "corr", "raw", "ref"])


class Proposal(NamedTuple):
    """answer: the options that say which column is which, as they were tried on the log; or "". seen: what each column
    holds."""

    answer: str = ""
    seen: str = ""


#: Free columns, and those of each quantity that is known -> which of the free ones may be which; see `proposal`.
Propose = Callable[[Sequence[int], Mapping[str, Sequence[int]]], Proposal]


def named(name: str, index: int) -> str:
    """A column as `--columns` takes it: by its name, or by its number where the name has marks of the option."""
    plain = name and not any(mark in name for mark in ",=+") and not name.isdecimal()
    return name if plain else str(index + 1)


def answer(names: Sequence[str], columns: Mapping[str, int], time: str = "", joined: Collection[int] = ()) -> str:
    """`--columns range=RNG,azimuth=3`, as a shell takes it. time: its columns, such as 1+2. joined: those of degrees
    with minutes and seconds in the two columns behind them."""
    behind = {index: range(index, index + 3 if index in joined else index + 1) for index in columns.values()}
    each = [f"time={time}"] if time else []
    each += (f"{q}={'+'.join(named(names[k], k) for k in behind[index])}" for q, index in columns.items())
    return f"--columns {quoted(','.join(each))}"


def listed(names: Sequence[str]) -> str:
    """The columns of a file for a message, at most twenty of them."""
    shown = ", ".join(names[:20])
    return f"{shown} and {len(names) - 20} more" if len(names) > 20 else shown


def refuse_twice(source: str, names: Sequence[str], name: str) -> None:
    if names.count(name) > 1:
        raise InputError(
            f'{source}: column "{name}" is there {names.count(name)} times; '
            f"rename or delete all but one. Its columns are: {listed(names)}."
        )


def refuse_unknown_unit(source: str, apart: Sequence[Name], free: Sequence[int], quantity: str) -> None:
    """A log without a range may be angles-only; one with `range_furlong` is not."""
    names = [name.text for name in apart]
    absent = "" if quantity == "time" else f", or --columns {quantity}={ABSENT} if it is something else"
    for index, unit in _units_unknown(apart, free, quantity):
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


def refuse_alike(source: str, apart: Sequence[Name], free: Sequence[int], quantity: str) -> None:
    """Ask about a column that may be the quantity, so that it is not left out without a word."""
    known = {alias for alias in ALIASES[quantity] if len(alias) > 1}
    other = NOT_UNITS - _OF_THE_QUANTITY
    for index in free if quantity != "time" else ():
        name = apart[index]
        words = {name.stem, *name.words}
        either = quantity != "range" and name.core() in EITHER_ANGLE
        another = words & OTHER_THINGS or name.is_zenith() or any(name.means(each) for each in QUANTITIES)
        alike = known & words or (name.is_in_a_unit_of(quantity) and not another)
        if not name.foreign and (either or (alike and not other & words)):
            say = answer([each.text for each in apart], {quantity: index})
            raise InputError(
                f'{source}: column "{name.text}" may be the {quantity}. Say {say}, or '
                f"--columns {quantity}={ABSENT} if it is something else."
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


def _units_unknown(apart: Sequence[Name], free: Sequence[int], quantity: str) -> Iterator[tuple[int, str]]:
    """Column and unit, where a name of the quantity has a unit that is none of its units."""
    for index in free:
        name = apart[index]
        if name.foreign or NOT_UNITS & {*name.words, name.unit.lower()}:
            continue
        known = any(unit_named(quantity, word) for word in name.unit.split())
        if name.unit and name.stem in ALIASES[quantity] and (len(name.stem) > 1 or known):
            yield index, name.unit
        elif not name.unit and len(name.words) == 2 and name.words[0] in ALIASES[quantity] and len(name.words[0]) > 1:
            yield index, name.words[1]


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
    say = f"{proposed.answer or none}{', which gives a target that moves like one' * (len(sought) > 1)}" \
        if proposed.answer else none  # fmt: skip
    if names and list(names) == [str(number) for number in range(1, len(names) + 1)]:
        none_moves = (
            "" if proposed.answer or not seen else " No choice of them gives a target that clearly moves like one."
        )
        raise InputError(
            f"{source}: there is no line of column names.{seen}{none_moves} Say which column is which by their "
            f"numbers, such as {say}."
        )
    others = [names[index] for index in free if not NOT_UNITS & {*taken_apart(names[index]).words}]
    hint = nearest(CANONICAL[wanted], others)
    similar = next((index for index in free if hint and f'"{names[index]}"' in hint), None)
    say = say if proposed.answer or similar is None else answer(names, {wanted: similar})
    raise InputError(
        f"{source}: {what} (expected {CANONICAL[wanted]} or {' or '.join(ALIASES[wanted][:2])}){hint or '.'} "
        f"Its columns are: {listed(names)}.{seen} Name the right ones with {say}."
    )


def nothing(free: Sequence[int], found: Mapping[str, Sequence[int]]) -> Proposal:
    """No proposal."""
    return Proposal()
