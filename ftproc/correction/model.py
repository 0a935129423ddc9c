"""The trained correction: a network for the filter's output, one for the smoother's where it pays, and all that keeps
them harmless. Its file is in `model_file`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ftproc.correction.envelope import Envelope, Normaliser
from ftproc.correction.features import Features
from ftproc.correction.network import Shape, Weights
from ftproc.correction.verdict import Verdict
from ftproc.records import FloatArray
from ftproc.settings import TrainSettings

SCHEMA = 2
FILTER, SMOOTHER = "filter", "smoother"
STAGES = (FILTER, SMOOTHER)


@dataclass(frozen=True)
class Stage:
    """A network ready to apply to what one stage gives out.

    features: the feature set. weights: network on normalised inputs and targets. gain: (6,) in [0, 1] per
    applied output, zero where held-out data did not prove it. bound_sigma: (6,) a correction never exceeds so
    many of the stage's own sigmas along each line-of-sight axis. fingerprint: SHA-256 of the training,
    validation and test arrays.
    """

    features: Features
    weights: Weights
    inputs: Normaliser
    targets: Normaliser
    envelope: Envelope
    gain: FloatArray
    bound_sigma: FloatArray
    fingerprint: str
    verdict: Verdict | None = None

    @property
    def shape(self) -> Shape:
        hidden, inputs = self.weights.w1.shape
        return Shape(inputs, hidden, len(self.weights.b2), self.weights.direct.size > 0)

    @property
    def helps(self) -> bool:
        """Whether it does anything at all."""
        return bool(self.gain.any())


@dataclass(frozen=True)
class Model:
    """What `train` leaves behind. stages: by name, `filter` always, `smoother` where there is one. settings: how it
    was trained (JSON-serialisable)."""

    stages: Mapping[str, Stage]
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def made_for(self) -> str:
        """The method whose error it learnt."""
        return str(self.settings.get("method", TrainSettings.method))

    @property
    def filter(self) -> Stage:
        return self.stages[FILTER]

    @property
    def smoother(self) -> Stage | None:
        return self.stages.get(SMOOTHER)


def card(model: Model) -> str:
    """The model's card: what it is, how it was trained, and what it brings on held-out flights."""
    settings = ", ".join(f"{key} {value}" for key, value in model.settings.items())
    lines = [f"Correction model, schema {SCHEMA}", f"training: {settings or 'not recorded'}"]
    for name, stage in model.stages.items():
        lines += ["", *_stage_card(name, stage)]
    if model.smoother is None:
        lines += ["", "smoother: no network; --smooth is not corrected"]
    return "\n".join(lines)


def _stage_card(name: str, stage: Stage) -> list[str]:
    d, h, o, direct = stage.shape
    network = f"network {d}-{h}-{o}{' and direct connections' if direct else ''}"
    verdict = ["no verdict on held-out data"] if stage.verdict is None else stage.verdict.sentences()
    return [
        f"{name}: feature set {stage.features.name!r}, {network}",
        f"data: sha256 {stage.fingerprint}",
        f"bounded to {_range(stage.bound_sigma)} sigma; zero while coasting, in the first samples after a "
        "start and outside the range of the training data",
        *verdict,
    ]


def _range(values: FloatArray) -> str:
    low, high = f"{values.min():.3g}", f"{values.max():.3g}"
    return low if low == high else f"{low} to {high}"
