"""Training of a stage: samples, initial weights, back-propagation with early stopping, hold-out verdict (Zuo et al.
2021, sections 2.1 and 2.2)."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ftproc.correction import model_file, network
from ftproc.correction.envelope import Envelope, Normaliser
from ftproc.correction.feature_sets import named
from ftproc.correction.features import APPLIED, BoolArray, Features
from ftproc.correction.model import Stage
from ftproc.correction.network import Shape, Weights
from ftproc.correction.training import Progress, descent, initial_weights, silent
from ftproc.correction.training.descent import OPTIMISERS, Fit, Problem
from ftproc.correction.training.genetic import GeneticSettings
from ftproc.correction.training.holdout import with_verdict
from ftproc.correction.training.samples import MOST_SAMPLES, Flight, Samples, Split, overconfidence, samples, split
from ftproc.errors import InputError, UsageError
from ftproc.settings import PACKAGED, TrainSettings

FEWEST_SAMPLES = 30
BOUND_SIGMA = 2.0  # bound on a correction where sigmas are consistent
MOST_EPOCHS = 100  # of weights that are held near known ones
LEAST_BEND = 0.05  # relative decrease of validation cost below which the hidden layer is left out


@dataclass(frozen=True)
class Prepared:
    """Data to train on. training, validation, test: normalised samples, the first two at most MOST_SAMPLES of a
    feature set that does not limit those of a flight.
    fingerprint: SHA-256 of all samples."""

    features: Features
    parts: Split
    inputs: Normaliser
    targets: Normaliser
    training: Samples
    validation: Samples
    test: Samples
    fingerprint: str

    def shape(self, hidden: int | None) -> Shape:
        return Shape(
            self.features.input_size, hidden or self.features.hidden, self.features.output_size, self.features.direct
        )


def prepare(flights: Sequence[Flight], features: Features, seed: int, known: Stage | None = None) -> Prepared:
    """Split the flights and make samples of them, normalised as those of a known network, if there is one. Raises
    InputError when there is too little data."""
    splitting, thinning = _streams(seed)[:2]
    parts = split(flights, splitting)
    tables = [samples(flights, pieces, features) for pieces in (parts.training, parts.validation, parts.test)]
    for name, table in zip(("training", "validation"), tables, strict=False):
        if len(table.inputs) < FEWEST_SAMPLES:
            raise InputError(
                f"too little to learn from: {len(table.inputs)} usable samples for {name}, at least {FEWEST_SAMPLES} "
                "are needed; a sample is usable with truth, and not while coasting or just after (re-)initialization"
            )
    inputs = Normaliser.fit(tables[0].inputs, features.floor) if known is None else known.inputs
    targets = Normaliser.fit(tables[0].targets, 1e-9) if known is None else known.targets
    training, validation, test = (Samples(inputs.forward(x), targets.forward(t)) for x, t in tables)
    if features.most is None:
        training, validation = (s.thinned(MOST_SAMPLES, thinning) for s in (training, validation))
    return Prepared(features, parts, inputs, targets, training, validation, test, _fingerprint(tables))


def train(flights: Sequence[Flight], settings: TrainSettings, progress: Progress = silent) -> Stage:
    """Learn the error of a stage from its flights with truth; the same seed and data give the same bytes.

    Where the sigmas of the training flights are too small, the bound on the correction is that many times wider. What
    begins with the packaged network stays that, unless validation flights prefer the other. Then it learns from all
    flights, and the verdict is on the one that had not.

    Raises InputError when there is too little data, UsageError for an unknown feature set, optimiser or start.
    """
    features = named(settings.features)
    if settings.optimiser not in OPTIMISERS or settings.start not in initial_weights.KINDS:
        kinds = ", ".join(initial_weights.KINDS)
        raise UsageError(f"optimiser is one of {', '.join(OPTIMISERS)}; start is one of {kinds}")
    known = known_network(features, settings)
    data = prepare(flights, features, settings.seed, known)
    if known is None:
        bent, line = _fitted(data, settings, progress)
    else:
        bent, line = _near(known, data.training, len(data.parts.training), settings, progress), None
        if network.squares(bent, *data.validation).sum() >= network.squares(known.weights, *data.validation).sum():
            bent = known.weights
    stage = Stage(
        features=features,
        weights=bent,
        inputs=data.inputs,
        targets=data.targets,
        envelope=Envelope.fit(data.training.inputs, features.reach),
        gain=np.ones(APPLIED),
        bound_sigma=BOUND_SIGMA * overconfidence(flights, data.parts.training, features.share),
        fingerprint=data.fingerprint,
    )
    progress("validation", 0, 1)
    stage = with_verdict(stage, flights, data.parts, _streams(settings.seed)[4])
    unproven = (stage.gain[: len(bent.b2)] == 0.0) & bent.w2[:APPLIED].any(axis=1)
    if line is not None and unproven.any():
        stage = replace(stage, weights=_mixed(bent, line, ~unproven))
        stage = with_verdict(stage, flights, data.parts, _streams(settings.seed)[4])
    progress("validation", 1, 1)
    if known is not None and bent is not known.weights:
        learned = data.training.and_(data.validation).and_(data.test)
        stage = replace(stage, weights=_near(known, learned, data.parts.count, settings, progress))
    return stage


def known_network(features: Features, settings: TrainSettings) -> Stage | None:
    """The packaged network, if the training begins with it: it has the same inputs, outputs and hidden units."""
    packaged = model_file.named(PACKAGED) if settings.start == initial_weights.PACKAGED else None
    if packaged is None or packaged.filter.features.name != features.name:
        return None
    return packaged.filter if settings.hidden in (None, packaged.filter.shape.hidden) else None


def _near(
    known: Stage, learned: Samples, flights: int, settings: TrainSettings, progress: Progress = silent
) -> Weights:
    """The weights that samples of some flights prefer, held near those of a known network: so they are fitted to the
    end."""
    vector = network.pack(known.weights)
    problem = Problem(known.shape, learned, learned, vector, 1.0 / flights)
    descending, steps = _streams(settings.seed)[3], partial(progress, "back-propagation")
    epochs = min(settings.epochs, MOST_EPOCHS)
    fit = descent.descend(settings.optimiser, vector, problem, epochs, descending, steps)
    return network.unpack(fit.vector, known.shape)


def _fitted(data: Prepared, settings: TrainSettings, progress: Progress) -> tuple[Weights, Weights | None]:
    """The weights of the network, and those of the linear fit where it has direct connections.

    A linear output needs less data and extrapolates better: all are linear where the hidden layer does not decrease the
    validation cost, and so is each whose own it does not decrease.
    """
    searching, descending = _streams(settings.seed)[2:4]
    problem = Problem(data.shape(settings.hidden), data.training, data.validation)
    search = GeneticSettings(population=settings.population, generations=settings.generations)
    best: Fit | None = None
    for _ in range(data.features.restarts):
        initial = initial_weights.initial_weights(
            settings.start, problem.shape, data.training, search, searching, partial(progress, "genetic search")
        )
        fit = descent.descend(
            settings.optimiser, initial, problem, settings.epochs, descending, partial(progress, "back-propagation")
        )
        best = fit if best is None or fit.validation_cost < best.validation_cost else best
    assert best is not None
    bent = network.unpack(best.vector, problem.shape)
    if not problem.shape.direct:
        return bent, None
    line = network.unpack(initial_weights.linear(problem.shape, data.training), problem.shape)
    left, straight = (network.squares(weights, *data.validation) for weights in (bent, line))
    better = left <= (1.0 - LEAST_BEND) * straight
    return _mixed(bent, line, better & (left.sum() <= (1.0 - LEAST_BEND) * straight.sum())), line


def _mixed(bent: Weights, line: Weights, which: BoolArray) -> Weights:
    """The weights of one network for the outputs of a mask (o,), those of the linear fit for the others."""
    if not which.any():
        return line
    pairs = ((bent.w2, line.w2), (bent.b2, line.b2), (bent.direct, line.direct))
    w2, b2, direct = (np.where(which.reshape(-1, *[1] * (one.ndim - 1)), one, other) for one, other in pairs)
    return Weights(bent.w1, bent.b1, w2, b2, direct)


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
