"""Training of a stage: samples, initial weights, back-propagation with early stopping, hold-out verdict (Zuo et al.
2021, sections 2.1 and 2.2)."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ftproc.correction import network
from ftproc.correction.envelope import Envelope, Normaliser
from ftproc.correction.feature_sets import named
from ftproc.correction.features import APPLIED, Features
from ftproc.correction.model import Stage
from ftproc.correction.network import Shape
from ftproc.correction.training import Progress, descent, initial_weights, silent
from ftproc.correction.training.descent import OPTIMISERS, Problem
from ftproc.correction.training.genetic import GeneticSettings
from ftproc.correction.training.holdout import with_verdict
from ftproc.correction.training.samples import Flight, Samples, Split, overconfidence, samples, split
from ftproc.errors import InputError, UsageError
from ftproc.records import FloatArray
from ftproc.settings import TrainSettings

MOST_SAMPLES = 40_000  # for back-propagation
FEWEST_SAMPLES = 30
BOUND_SIGMA = 2.0  # bound on a correction where sigmas are consistent
LEAST_BEND = 0.05  # relative decrease of validation cost below which the hidden layer is left out


@dataclass(frozen=True)
class Prepared:
    """Data to train on. training, validation, test: normalised samples, the first two at most MOST_SAMPLES.
    fingerprint: SHA-256 of all samples."""

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
    tables = [samples(flights, pieces, features) for pieces in (parts.training, parts.validation, parts.test)]
    for name, table in zip(("training", "validation"), tables, strict=False):
        if len(table.inputs) < FEWEST_SAMPLES:
            raise InputError(
                f"too little to learn from: {len(table.inputs)} usable samples for {name}, at least {FEWEST_SAMPLES} "
                "are needed; a sample is usable with truth, and not while coasting or just after (re-)initialization"
            )
    inputs = Normaliser.fit(tables[0].inputs, features.floor)
    targets = Normaliser.fit(tables[0].targets, 1e-9)
    training, validation, test = (Samples(inputs.forward(x), targets.forward(t)) for x, t in tables)
    training, validation = (s.thinned(MOST_SAMPLES, thinning) for s in (training, validation))
    return Prepared(features, parts, inputs, targets, training, validation, test, _fingerprint(tables))


def train(flights: Sequence[Flight], settings: TrainSettings, progress: Progress = silent) -> Stage:
    """Learn the error of a stage from its flights with truth; the same seed and data give the same bytes.

    Where the sigmas of the training flights are too small, the bound on the correction is that many times wider.

    Raises InputError when there is too little data, UsageError for an unknown feature set, optimiser or start.
    """
    features = named(settings.features)
    if settings.optimiser not in OPTIMISERS or settings.start not in initial_weights.KINDS:
        kinds = ", ".join(initial_weights.KINDS)
        raise UsageError(f"optimiser is one of {', '.join(OPTIMISERS)}; start is one of {kinds}")
    data = prepare(flights, features, settings.seed)
    stage = Stage(
        features=features,
        weights=network.unpack(_fitted(data, settings, progress), data.shape(settings.hidden)),
        inputs=data.inputs,
        targets=data.targets,
        envelope=Envelope.fit(data.training.inputs, features.reach),
        gain=np.ones(APPLIED),
        bound_sigma=BOUND_SIGMA * overconfidence(flights, data.parts.training),
        fingerprint=data.fingerprint,
    )
    progress("validation", 0, 1)
    stage = with_verdict(stage, flights, data.parts, _streams(settings.seed)[4])
    progress("validation", 1, 1)
    return stage


def _fitted(data: Prepared, settings: TrainSettings, progress: Progress) -> FloatArray:
    """(size,) weights of the network."""
    searching, descending = _streams(settings.seed)[2:4]
    problem = Problem(data.shape(settings.hidden), data.training, data.validation)
    search = GeneticSettings(population=settings.population, generations=settings.generations)
    initial = initial_weights.initial_weights(
        settings.start, problem.shape, data.training, search, searching, partial(progress, "genetic search")
    )
    fit = descent.descend(
        settings.optimiser, initial, problem, settings.epochs, descending, partial(progress, "back-propagation")
    )
    if problem.shape.direct:  # a linear model needs less data and extrapolates better
        linear = initial_weights.linear(problem.shape, data.training)
        if fit.validation_cost > (1.0 - LEAST_BEND) * network.cost(linear, problem.shape, *data.validation):
            return linear
    return fit.vector


def _streams(seed: int) -> list[np.random.Generator]:
    """For splitting, thinning, searching, descending and validation, so that one does not depend on another."""
    return [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(5)]


def _fingerprint(tables: Sequence[Samples]) -> str:
    """SHA-256 over the arrays of all samples, in the order training, validation, test."""
    digest = hashlib.sha256()
    for arrays in tables:
        for array in arrays:
            digest.update(str(array.shape).encode())
            digest.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return digest.hexdigest()
