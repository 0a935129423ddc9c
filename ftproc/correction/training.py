"""Train a correction: samples, genetic start, back-propagation with early stopping, hold-out verdict
(Zuo et al. 2021, sections 2.1 and 2.2)."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import asdict

import numpy as np

from ftproc.correction import descent, genetic, network
from ftproc.correction.descent import Samples
from ftproc.correction.envelope import Envelope, Normaliser
from ftproc.correction.features import APPLIED, named
from ftproc.correction.judging import judge
from ftproc.correction.model import Model
from ftproc.correction.network import Shape
from ftproc.correction.samples import Flight, honesty, split, table
from ftproc.errors import InputError, UsageError
from ftproc.records import FloatArray
from ftproc.settings import TrainSettings

Progress = Callable[[str, int, int], None]  # stage, steps done, steps in all (it may end before)

GENETIC_SAMPLES = 600  # training samples that the genetic search looks at
MOST_SAMPLES = 40_000  # that back-propagation looks at
FEWEST_SAMPLES = 30
BOUND_SIGMA = 2.0  # a correction never exceeds this many sigmas

OPTIMISERS = ("l-bfgs", "momentum")
STARTS = ("genetic", "random")


def train(
    flights: Sequence[Flight],
    settings: TrainSettings,
    progress: Progress | None = None,
    *,
    optimiser: str = "l-bfgs",
    start: str = "genetic",
    widen: bool = False,
) -> Model:
    """Learn the error of the filter from flights with truth; the same seed and data give the same model.

    optimiser: `l-bfgs`, or `momentum` as in the paper. start: `genetic`, or `random` first weights.
    widen: where the training flights show that the filter's sigmas are too small, bound by what they should
    be. Raises InputError when there is too little data, UsageError for an unknown feature set, optimiser or
    start.
    """
    if optimiser not in OPTIMISERS or start not in STARTS:
        raise UsageError(f"optimiser is one of {', '.join(OPTIMISERS)}; start is one of {', '.join(STARTS)}")
    features = named(settings.features)
    streams = [np.random.default_rng(s) for s in np.random.SeedSequence(settings.seed).spawn(5)]
    splitting, thinning, searching, descending, judging = streams
    parts = split(flights, splitting)
    tables = [table(flights, pieces, features) for pieces in (parts.training, parts.validation, parts.test)]
    _check_enough(tables)
    inputs = Normaliser.fit(tables[0][0], features.floor)
    targets = Normaliser.fit(tables[0][1], 1e-9)
    training, validation = (
        _thinned(Samples(inputs.forward(x), targets.forward(t)), MOST_SAMPLES, thinning) for x, t in tables[:2]
    )
    shape = Shape(features.input_size, settings.hidden, features.output_size)
    vector = _first_weights(start, shape, training, settings, searching, progress)
    vector = _descended(optimiser, vector, shape, training, validation, settings, descending, progress)
    model = Model(
        features=features,
        weights=network.unpack(vector, shape),
        inputs=inputs,
        targets=targets,
        envelope=Envelope.fit(training.inputs),
        gain=np.ones(APPLIED),
        bound_sigma=BOUND_SIGMA * (honesty(flights, parts.training) if widen else np.ones(APPLIED)),
        fingerprint=_fingerprint(tables),
        settings={**asdict(settings), "optimiser": optimiser, "start": start, "widen": widen},
    )
    if progress is not None:
        progress("judging", 0, 1)
    judged = judge(model, flights, parts, judging)
    if progress is not None:
        progress("judging", 1, 1)
    return judged


def _check_enough(tables: Sequence[tuple[FloatArray, FloatArray]]) -> None:
    for name, (x, _) in zip(("training", "validation"), tables, strict=False):
        if len(x) < FEWEST_SAMPLES:
            raise InputError(
                f"too little to learn from: {len(x)} usable samples for {name}, at least {FEWEST_SAMPLES} "
                "are needed; samples count when they have truth, and not while coasting or just after a start"
            )


def _thinned(samples: Samples, most: int, rng: np.random.Generator) -> Samples:
    """At most so many of the samples, in their order."""
    if len(samples.inputs) <= most:
        return samples
    rows = np.sort(rng.choice(len(samples.inputs), most, replace=False))
    return Samples(samples.inputs[rows], samples.targets[rows])


def _first_weights(
    start: str,
    shape: Shape,
    training: Samples,
    settings: TrainSettings,
    rng: np.random.Generator,
    progress: Progress | None,
) -> FloatArray:
    """(size,) first weights: genes found by the genetic search, or drawn, each times its fan-in scale."""
    scale = network.scale(shape)
    if start == "random":
        return rng.uniform(-1.0, 1.0, shape.size) * scale
    few = _thinned(training, GENETIC_SAMPLES, rng)
    found = genetic.search(
        lambda genes: network.population_cost(genes * scale, shape, *few),
        shape.size,
        genetic.GeneticSettings(population=settings.population, generations=settings.generations),
        rng,
        None if progress is None else lambda done, total: progress("genetic search", done, total),
    )
    return found.best * scale


def _descended(
    optimiser: str,
    vector: FloatArray,
    shape: Shape,
    training: Samples,
    validation: Samples,
    settings: TrainSettings,
    rng: np.random.Generator,
    progress: Progress | None,
) -> FloatArray:
    tell = None if progress is None else lambda done, total: progress("back-propagation", done, total)
    if optimiser == "momentum":
        return descent.momentum(vector, shape, training, validation, settings.epochs, rng, tell).vector
    return descent.lbfgs(vector, shape, training, validation, settings.epochs, tell).vector


def _fingerprint(tables: Sequence[tuple[FloatArray, FloatArray]]) -> str:
    """SHA-256 over the arrays of all samples, in the order training, validation, test."""
    digest = hashlib.sha256()
    for arrays in tables:
        for array in arrays:
            digest.update(str(array.shape).encode())
            digest.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return digest.hexdigest()
