"""The samples that a stage is trained on, from its flights."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ftproc.correction.envelope import Normaliser
from ftproc.correction.features import Features
from ftproc.correction.model import Stage
from ftproc.correction.network import Shape
from ftproc.correction.training.samples import MOST_SAMPLES, Flight, Samples, Split, samples, split
from ftproc.errors import InputError

FEWEST_SAMPLES = 30


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

    def normalised(self, table: Samples) -> Samples:
        return Samples(self.inputs.forward(table.inputs), self.targets.forward(table.targets))

    def shape(self, hidden: int | None) -> Shape:
        return Shape(
            self.features.input_size, hidden or self.features.hidden, self.features.output_size, self.features.direct
        )


def prepare(flights: Sequence[Flight], features: Features, seed: int, known: Stage | None = None) -> Prepared:
    """Split the flights and make samples of them, normalised as those of a known network, if there is one. Raises
    InputError when there is too little data."""
    splitting, thinning = streams(seed)[:2]
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


def streams(seed: int) -> list[np.random.Generator]:
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
