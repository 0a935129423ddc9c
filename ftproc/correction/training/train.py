"""Train a correction: samples, first weights, back-propagation with early stopping, hold-out verdict
(Zuo et al. 2021, sections 2.1 and 2.2)."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ftproc.correction import network
from ftproc.correction.envelope import Envelope, Normaliser
from ftproc.correction.feature_sets import named
from ftproc.correction.features import APPLIED, Features
from ftproc.correction.model import Stage
from ftproc.correction.network import Shape
from ftproc.correction.training import descent, starts
from ftproc.correction.training.descent import Samples
from ftproc.correction.training.genetic import GeneticSettings
from ftproc.correction.training.judging import judge
from ftproc.correction.training.samples import Flight, Split, honesty, split, table
from ftproc.correction.training.starts import STARTS
from ftproc.errors import InputError, UsageError
from ftproc.records import FloatArray
from ftproc.settings import TrainSettings

Progress = Callable[[str, int, int], None]  # stage, steps done, steps in all (it may end before)

MOST_SAMPLES = 40_000  # that back-propagation looks at
FEWEST_SAMPLES = 30
BOUND_SIGMA = 2.0  # a correction never exceeds this many sigmas
BEND_WORTH = 0.05  # relative decrease of validation cost below which the hidden layer is left out

OPTIMISERS = ("l-bfgs", "momentum")


@dataclass(frozen=True)
class Prepared:
    """What a network learns from. training, validation, test: normalised samples, the former two at most
    MOST_SAMPLES."""

    features: Features
    parts: Split
    inputs: Normaliser
    targets: Normaliser
    training: Samples
    validation: Samples
    test: Samples
    fingerprint: str

    def shape(self, hidden: int) -> Shape:
        return Shape(self.features.input_size, hidden, self.features.output_size, self.features.direct)


def prepare(flights: Sequence[Flight], features: Features, seed: int) -> Prepared:
    """Split the flights and make samples of them. Raises InputError when there is too little data."""
    splitting, thinning = _streams(seed)[:2]
    parts = split(flights, splitting)
    tables = [table(flights, pieces, features) for pieces in (parts.training, parts.validation, parts.test)]
    _check_enough(tables)
    inputs = Normaliser.fit(tables[0][0], features.floor)
    targets = Normaliser.fit(tables[0][1], 1e-9)
    training, validation, test = (Samples(inputs.forward(x), targets.forward(t)) for x, t in tables)
    training, validation = (starts.thinned(s, MOST_SAMPLES, thinning) for s in (training, validation))
    return Prepared(features, parts, inputs, targets, training, validation, test, _fingerprint(tables))


def train(flights: Sequence[Flight], settings: TrainSettings, progress: Progress | None = None) -> Stage:
    """Learn the error of a stage from its flights with truth; the same seed and data give the same bytes.

    Where the training flights show that the stage's sigmas are too small, the bound on the correction is that many
    times wider. Raises InputError when there is too little data, UsageError for an unknown feature set, optimiser or
    start.
    """
    features = named(settings.features)
    _check_choices(settings)
    searching, descending, judging = _streams(settings.seed)[2:]
    data = prepare(flights, features, settings.seed)
    stage = Stage(
        features=features,
        weights=network.unpack(_weights(data, settings, searching, descending, progress), data.shape(settings.hidden)),
        inputs=data.inputs,
        targets=data.targets,
        envelope=Envelope.fit(data.training.inputs, features.reach),
        gain=np.ones(APPLIED),
        bound_sigma=BOUND_SIGMA * honesty(flights, data.parts.training),
        fingerprint=data.fingerprint,
    )
    if progress is not None:
        progress("judging", 0, 1)
    judged = judge(stage, flights, data.parts, judging)
    if progress is not None:
        progress("judging", 1, 1)
    return judged


def _weights(
    data: Prepared,
    settings: TrainSettings,
    searching: np.random.Generator,
    descending: np.random.Generator,
    progress: Progress | None,
) -> FloatArray:
    shape = data.shape(settings.hidden)
    search = GeneticSettings(population=settings.population, generations=settings.generations)
    vector = starts.first_weights(
        settings.start, shape, data.training, search, searching, _told(progress, "genetic search")
    )
    fit = _descended(vector, shape, data, settings, descending, _told(progress, "back-propagation"))
    if shape.direct:  # what is linear asks less of the data, and holds farther from them
        straight = starts.linear(shape, data.training)
        if fit.validation_cost > (1.0 - BEND_WORTH) * network.cost(straight, shape, *data.validation):
            return straight
    return fit.vector


def _descended(
    vector: FloatArray,
    shape: Shape,
    data: Prepared,
    settings: TrainSettings,
    rng: np.random.Generator,
    tell: starts.Tell | None,
) -> descent.Fit:
    given = (vector, shape, data.training, data.validation, settings.epochs)
    return descent.momentum(*given, rng, tell) if settings.optimiser == "momentum" else descent.lbfgs(*given, tell)


def _told(progress: Progress | None, stage: str) -> starts.Tell | None:
    return None if progress is None else lambda done, total: progress(stage, done, total)


def _streams(seed: int) -> list[np.random.Generator]:
    """Splitting, thinning, searching, descending, judging: one must not move another."""
    return [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(5)]


def _check_choices(settings: TrainSettings) -> None:
    if settings.optimiser not in OPTIMISERS or settings.start not in STARTS:
        raise UsageError(f"optimiser is one of {', '.join(OPTIMISERS)}; start is one of {', '.join(STARTS)}")


def _check_enough(tables: Sequence[tuple[FloatArray, FloatArray]]) -> None:
    for name, (x, _) in zip(("training", "validation"), tables, strict=False):
        if len(x) < FEWEST_SAMPLES:
            raise InputError(
                f"too little to learn from: {len(x)} usable samples for {name}, at least {FEWEST_SAMPLES} "
                "are needed; samples count when they have truth, and not while coasting or just after a start"
            )


def _fingerprint(tables: Sequence[tuple[FloatArray, FloatArray]]) -> str:
    """SHA-256 over the arrays of all samples, in the order training, validation, test."""
    digest = hashlib.sha256()
    for arrays in tables:
        for array in arrays:
            digest.update(str(array.shape).encode())
            digest.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return digest.hexdigest()
