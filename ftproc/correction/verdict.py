"""The hold-out verdict on a correction: numbers with their intervals, and plain sentences."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Ratio:
    """Root-mean-square error with the correction over that without, and its 90 % interval."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.value:.3f} ({self.low:.3f} to {self.high:.3f})"

    @property
    def conclusion(self) -> str:
        """What the interval allows to conclude."""
        if self.high < 1.0:
            return "better"
        return "worse: do not use this model" if self.low > 1.0 else "no significant difference"


@dataclass(frozen=True)
class ComponentVerdict:
    """One applied output. gain: in [0, 1]. proof: lower bound of the relative decrease of squared error on the
    validation data, with the gain before insignificant gains are set to zero. test: on the untouched test data, None
    without any."""

    name: str
    gain: float
    proof: float
    test: Ratio | None

    def __str__(self) -> str:
        if self.gain <= 0.0:
            return f"{self.name}: gain 0, no significant improvement"
        test = "" if self.test is None else f", test error ratio {self.test}"
        return f"{self.name}: gain {self.gain:.2f}{test}"


@dataclass(frozen=True)
class Verdict:
    """by: "flight" or "block", the unit that is held out. training, validation, test: numbers of these. validated:
    position on the validation data, by which feature sets are compared. position, velocity: on the untouched test
    data. in_turn: the validation is by the training flights, each left out once."""

    by: str
    training: int
    validation: int
    test: int
    components: tuple[ComponentVerdict, ...]
    validated: Ratio | None
    position: Ratio | None
    velocity: Ratio | None
    in_turn: bool = False

    @property
    def helps(self) -> bool:
        """Whether any gain is significant."""
        return any(c.gain > 0.0 for c in self.components)

    def sentences(self) -> list[str]:
        """The verdict in plain sentences, one per line."""
        unit = "flights" if self.by == "flight" else "blocks of at least 30 s"
        by = "each validated by what the others taught" if self.in_turn else f"validated on {self.validation}"
        lines = [f"Trained on {self.training} {unit}, {by}, tested on {self.test}."]
        if not self.helps:
            return [*lines, f"No significant improvement on the held-out {unit}: the correction is zero."]
        lines += [f"  {component}." for component in self.components]
        for name, ratio in (("Position", self.position), ("Velocity", self.velocity)):
            if ratio is not None:
                lines.append(
                    f"{name} error on the test {unit}, corrected over uncorrected: {ratio}, {ratio.conclusion}."
                )
        return lines

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Verdict:
        """The inverse of `to_dict`. Raises KeyError or TypeError on anything else."""
        fields = dict(content)
        parts = [{**c, "test": _ratio(c["test"])} for c in fields["components"]]
        fields["components"] = tuple(ComponentVerdict(**c) for c in parts)
        for name in ("validated", "position", "velocity"):
            fields[name] = _ratio(fields[name])
        return cls(**fields)


def _ratio(content: Mapping[str, float] | None) -> Ratio | None:
    return None if content is None else Ratio(**content)
