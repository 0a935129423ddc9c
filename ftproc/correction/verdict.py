"""What held-out flights say about a correction: numbers with their intervals, and plain sentences."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Ratio:
    """Error with the correction over error without (root mean square), and its 90 % interval."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.value:.3f} ({self.low:.3f} to {self.high:.3f})"


@dataclass(frozen=True)
class ComponentVerdict:
    """One applied output. gain: in [0, 1]. proof: lower bound of the relative decrease of squared error on
    the validation data, before unproven gains are set to zero. test: on the untouched data, None if there was
    none."""

    name: str
    gain: float
    proof: float
    test: Ratio | None


@dataclass(frozen=True)
class Verdict:
    """by: "flight" or "block", what was held out. training, validation, test: how many of these. validated: position on
    the validation data, by which feature sets are compared; position, velocity: on the untouched test data."""

    by: str
    training: int
    validation: int
    test: int
    components: tuple[ComponentVerdict, ...]
    validated: Ratio | None
    position: Ratio | None
    velocity: Ratio | None

    @property
    def helps(self) -> bool:
        """Whether any gain was proven."""
        return any(c.gain > 0.0 for c in self.components)

    def sentences(self) -> list[str]:
        """The verdict in plain sentences, one per line."""
        unit = "flights" if self.by == "flight" else "blocks of at least 30 s"
        told = [f"Trained on {self.training}, judged on {self.validation} and tested on {self.test} held-out {unit}."]
        if not self.helps:
            return [*told, f"The correction brings nothing on held-out {unit}: its gain is zero."]
        told += [self._component(c) for c in self.components]
        for name, ratio in (("position", self.position), ("velocity", self.velocity)):
            if ratio is not None:
                told.append(f"Error in {name} on the test {unit}, with over without: {ratio}{_remark(ratio)}.")
        return told

    def _component(self, c: ComponentVerdict) -> str:
        if c.gain <= 0.0:
            return f"  {c.name}: gain 0, nothing proven."
        tail = "" if c.test is None else f"; test error with over without {c.test}"
        return f"  {c.name}: gain {c.gain:.2f}{tail}."

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


def _remark(ratio: Ratio) -> str:
    if ratio.high < 1.0:
        return ", it helps"
    if ratio.low > 1.0:
        return ", it HARMS there: do not use this model"
    return ", no difference proven"
