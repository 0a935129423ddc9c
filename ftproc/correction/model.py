"""The trained correction: a network for the filter's output, one for the smoother's where it improves that, and their
guards. Its file is in `model_file`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ftproc.correction.envelope import Envelope, Normaliser
from ftproc.correction.features import Features
from ftproc.correction.network import Shape, Weights
from ftproc.correction.verdict import Verdict
from ftproc.records import FloatArray
from ftproc.settings import TrainSettings

SCHEMA = 2
MOST_SIGMA = 50.0  # no correction is larger, whatever the file says
FILTER, SMOOTHER = "filter", "smoother"
STAGES = (FILTER, SMOOTHER)


@dataclass(frozen=True)
class Stage:
    """A network ready to apply to the output of one stage, the filter or the smoother.

    weights: network on normalised inputs and targets. gain: (6,) in [0, 1] per applied output, zero where held-out data
    show no significant improvement. bound_sigma: (6,) bound on the correction along each line-of-sight axis, in the
    stage's own sigmas, as trained; `bound` is the one that holds. fingerprint: SHA-256 of the training, validation and
    test arrays.
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
    def bound(self) -> FloatArray:
        """(6,) the bound in sigmas: of the training, at most the program's."""
        return np.minimum(self.bound_sigma, MOST_SIGMA)

    @property
    def helps(self) -> bool:
        """Whether any output has a gain."""
        return bool(self.gain.any())

    @property
    def lost_by_smoothing(self) -> bool:
        """Whether it takes out what smoothing leaves."""
        return self.helps and not self.features.proven

    @property
    def linear(self) -> bool:
        """Whether the hidden layer adds nothing: the output is linear in the inputs, by the direct connections."""
        return not (self.weights.w1.any() and self.weights.w2.any())


@dataclass(frozen=True)
class Model:
    """A trained correction. stages: by name, `filter` always, `smoother` where it has a gain. settings: of
    the training, JSON-serialisable."""

    stages: Mapping[str, Stage]
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def made_for(self) -> str:
        """The method whose error it corrects."""
        return str(self.settings.get("method", TrainSettings.method))

    @property
    def filter(self) -> Stage:
        return self.stages[FILTER]

    @property
    def hears(self) -> bool:
        """Whether it needs the strength of the signal."""
        return any(stage.helps and stage.features.heard for stage in self.stages.values())

    @property
    def smoother(self) -> Stage | None:
        return self.stages.get(SMOOTHER)


def card(model: Model) -> str:
    """The model's card: networks, training settings, guards, and the verdict on held-out flights."""
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
    if stage.linear:
        network = f"linear, {d} inputs to {o} outputs (held-out samples did not need the {h} hidden units)"
    verdict = ["no verdict on held-out data"] if stage.verdict is None else stage.verdict.sentences()
    return [
        f"{name}: feature set {stage.features.name!r}, {network}",
        f"data: sha256 {stage.fingerprint}",
        f"bounded to {_range(stage.bound)} sigma; zero while coasting, just after (re-)initialization (but live) and "
        "outside the range of the training data",
        *verdict,
    ]


def _range(values: FloatArray) -> str:
    low, high = f"{values.min():.3g}", f"{values.max():.3g}"
    return low if low == high else f"{low} to {high}"
