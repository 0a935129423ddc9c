"""What a kernel takes and returns, as its annotations say it.

They are the one place: the library of kernels is compiled from them, and they are what its arguments are held against,
because machine code looks at nothing. A number is `float`, `int` or `bool`; an array is `Vector`, `Matrix` or another
`Annotated[..., Layout]`, always in C order; what travels together is a NamedTuple of these.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, NamedTuple, get_type_hints

import numpy as np
from numpy.typing import NDArray


class Layout(NamedTuple):
    """The type of an array's numbers or records, and its number of dimensions."""

    dtype: np.dtype[Any]
    ndim: int = 1


Vector = Annotated[NDArray[np.float64], Layout(np.dtype(np.float64), 1)]
Matrix = Annotated[NDArray[np.float64], Layout(np.dtype(np.float64), 2)]
Cube = Annotated[NDArray[np.float64], Layout(np.dtype(np.float64), 3)]
Flags = Annotated[NDArray[np.bool_], Layout(np.dtype(np.bool_), 1)]
FlagMatrix = Annotated[NDArray[np.bool_], Layout(np.dtype(np.bool_), 2)]
Indices = Annotated[NDArray[np.int64], Layout(np.dtype(np.int64), 1)]


def layout_of(hint: Any) -> Layout | None:
    """The layout that an annotation gives, or None for what is no array."""
    return next((each for each in getattr(hint, "__metadata__", ()) if isinstance(each, Layout)), None)


def is_record(hint: Any) -> bool:
    """Whether an annotation is a NamedTuple."""
    return isinstance(hint, type) and issubclass(hint, tuple) and hasattr(hint, "_fields")


def signature(function: Callable[..., Any]) -> tuple[dict[str, Any], Any]:
    """The annotations of the parameters by name, and of what is returned."""
    hints = get_type_hints(function, include_extras=True)
    returned = hints.pop("return")
    return hints, returned


class Check:
    """Holds arguments against a signature, at a fraction of a microsecond each."""

    def __init__(self, function: Callable[..., Any]) -> None:
        hints, _ = signature(function)
        self.name, self.names = function.__qualname__, tuple(hints)
        self.arrays: list[tuple[int, int | None, str, Layout]] = []
        self.records: list[tuple[int, type]] = []
        self.integers = [position for position, hint in enumerate(hints.values()) if hint is int]
        for position, (name, hint) in enumerate(hints.items()):
            if (layout := layout_of(hint)) is not None:
                self.arrays.append((position, None, name, layout))
            elif is_record(hint):
                self.records.append((position, hint))
                for number, (part, inner) in enumerate(get_type_hints(hint, include_extras=True).items()):
                    if (layout := layout_of(inner)) is not None:
                        self.arrays.append((position, number, f"{name}.{part}", layout))

    def __call__(self, arguments: tuple[Any, ...]) -> None:
        """Raises TypeError with the first argument that is not what the signature says."""
        if len(arguments) != len(self.names):
            raise TypeError(f"{self.name} takes {len(self.names)} arguments, not {len(arguments)}")
        for position, kind in self.records:
            if type(arguments[position]) is not kind:
                self._refuse(self.names[position], f"a {kind.__name__}", arguments[position])
        for position in self.integers:
            if not isinstance(arguments[position], (int, np.integer)):
                self._refuse(self.names[position], "an integer", arguments[position])
        for position, number, name, (dtype, ndim) in self.arrays:
            array = arguments[position] if number is None else arguments[position][number]
            if type(array) is not np.ndarray or array.ndim != ndim or array.dtype != dtype:
                self._refuse(name, f"a {ndim}-dimensional array of {_named(dtype)}", array)
            if not array.flags.c_contiguous:
                self._refuse(name, "an array in C order", array)

    def _refuse(self, name: str, expected: str, value: Any) -> None:
        found = type(value).__name__
        if isinstance(value, np.ndarray):
            order = "" if value.flags.c_contiguous else " not in C order"
            found = f"a {value.ndim}-dimensional array of {_named(value.dtype)}{order}"
        raise TypeError(f"{self.name}: {name} must be {expected}, not {found}")


def _named(dtype: np.dtype[Any]) -> str:
    return f"records of {', '.join(dtype.names)}" if dtype.names else str(dtype)
