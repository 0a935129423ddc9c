"""Training of a stage: samples, initial weights, back-propagation with early stopping, hold-out verdict (Zuo et al.
2021, sections 2.1 and 2.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ftproc.correction import model_file, network
from ftproc.correction.envelope import Envelope
from ftproc.correction.feature_sets import named
from ftproc.correction.features import APPLIED, BoolArray, Features
from ftproc.correction.model import Stage
from ftproc.correction.network import Weights
from ftproc.correction.training import Progress, descent, fleet, initial_weights, silent
from ftproc.correction.training.descent import OPTIMISERS, Fit, Problem
from ftproc.correction.training.genetic import GeneticSettings
from ftproc.correction.training.holdout import with_verdict
from ftproc.correction.training.prepared import Prepared, prepare, streams
from ftproc.correction.training.samples import BOUND_SIGMA, Flight, overconfidence
from ftproc.errors import UsageError
from ftproc.settings import PACKAGED, TrainSettings

LEAST_BEND = 0.05  # relative decrease of validation cost below which the hidden layer is left out


def train(flights: Sequence[Flight], settings: TrainSettings, progress: Progress = silent) -> Stage:
    """Learn the error of a stage from its flights with truth; the same seed and data give the same bytes.

    Where the sigmas of the training flights are too small, the bound on the correction is that many times wider.

    Raises InputError when there is too little data, UsageError for an unknown feature set, optimiser or start.
    """
    features = named(settings.features)
    if settings.optimiser not in OPTIMISERS or settings.start not in initial_weights.KINDS:
        kinds = ", ".join(initial_weights.KINDS)
        raise UsageError(f"optimiser is one of {', '.join(OPTIMISERS)}; start is one of {kinds}")
    known = known_network(features, settings)
    data = prepare(flights, features, settings.seed, known)
    if known is not None:
        return fleet.taught(known, flights, data, settings, progress)
    bent, line = _fitted(data, settings, progress)
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
    stage = with_verdict(stage, flights, data.parts, streams(settings.seed)[4])
    unproven = (stage.gain[: len(bent.b2)] == 0.0) & bent.w2[:APPLIED].any(axis=1)
    if line is not None and unproven.any():
        stage = replace(stage, weights=_mixed(bent, line, ~unproven))
        stage = with_verdict(stage, flights, data.parts, streams(settings.seed)[4])
    progress("validation", 1, 1)
    return stage


def known_network(features: Features, settings: TrainSettings) -> Stage | None:
    """The packaged network, if the training begins with it: it has the same inputs, outputs and hidden units."""
    packaged = model_file.named(PACKAGED) if settings.start == initial_weights.PACKAGED else None
    if packaged is None or packaged.filter.features.name != features.name:
        return None
    return packaged.filter if settings.hidden in (None, packaged.filter.shape.hidden) else None


def _fitted(data: Prepared, settings: TrainSettings, progress: Progress) -> tuple[Weights, Weights | None]:
    """The weights of the network, and those of the linear fit where it has direct connections.

    A linear output needs less data and extrapolates better: all are linear where the hidden layer does not decrease the
    validation cost, and so is each whose own it does not decrease.
    """
    searching, descending = streams(settings.seed)[2:4]
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
