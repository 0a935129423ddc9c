"""The hold-out judgement: a gain for each output from validation data, zero unless a block bootstrap proves it, and a
report from the untouched test data. Non-negative stacking with one candidate; it bounds harm on data like the
validation data, not on a new kind of sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ftproc.correction.apply import answer, bounded
from ftproc.correction.features import APPLIED, Place
from ftproc.correction.model import Stage
from ftproc.correction.training.bootstrap import Blocks
from ftproc.correction.training.samples import Flight, Piece, Split
from ftproc.correction.verdict import ComponentVerdict, Ratio, Verdict
from ftproc.records import FloatArray

DOUBT = 0.05  # chance that any one of the six outputs passes by luck
MATERIAL = 1e-3  # relative decrease of squared error that is worth a gain
FEWEST_BLOCKS = 4  # a bootstrap over fewer proves nothing


@dataclass(frozen=True)
class _Evidence:
    """Held-out samples the network could speak about. output: (n, 6) its answer in its own units, error: (n, 6) truth
    minus estimate in x y z."""

    place: Place
    output: FloatArray
    error: FloatArray
    blocks: Blocks


def _gather(stage: Stage, flights: Sequence[Flight], pieces: Sequence[Piece]) -> _Evidence:
    position, sigma, output, error = [np.empty((0, 3))], [np.empty((0, 6))], [np.empty((0, 6))], [np.empty((0, 6))]
    times = []
    for piece in pieces:
        flight, rows = flights[piece.flight], slice(piece.start, piece.stop)
        said = answer(flight.run, stage, piece.start, piece.stop)
        wanted = flight.error[rows, :APPLIED]
        keep = said.usable & np.all(np.isfinite(wanted), axis=1)
        position.append(flight.run.state[rows, :3][keep])
        sigma.append(flight.run.los_sigma[rows][keep])
        output.append(said.output[keep])
        error.append(wanted[keep])
        times.append(flight.run.time_s[rows][keep])
    place = Place(np.concatenate(position), np.concatenate(sigma))
    return _Evidence(place, np.concatenate(output), np.concatenate(error), Blocks.of(times))


def _best_gain(stage: Stage, evidence: _Evidence) -> FloatArray:
    """(6,) g = clip(sum B d / sum B^2, 0, 1) of output B and wanted output d."""
    wanted = stage.features.from_cartesian(evidence.place, evidence.error)
    power = np.sum(evidence.output**2, axis=0)
    product = np.sum(evidence.output * wanted, axis=0)
    gain: FloatArray = np.divide(product, power, out=np.zeros_like(power), where=power > 0.0)
    return gain.clip(0.0, 1.0)


def _proof(stage: Stage, evidence: _Evidence, gain: FloatArray, rng: np.random.Generator) -> FloatArray:
    """(6,) lower bound of the relative decrease of squared error, of the whole path with gain and bound.

    The 5 % quantile of the bootstrap, shared among the six outputs. Taken in the output's units and in metres,
    whichever is worse: an average in sigmas can fall while that in metres rises.
    """
    features = stage.features
    before = features.from_cartesian(evidence.place, evidence.error)
    applied = bounded(evidence.place, stage, evidence.output * gain)
    after = features.from_cartesian(evidence.place, evidence.error - applied)
    worst = np.full(APPLIED, np.inf)
    for unit in (np.ones_like(before), features.unit(evidence.place)):
        old = (before * unit) ** 2
        decrease = evidence.blocks.totals(evidence.blocks.sums(old - (after * unit) ** 2), rng)
        total = np.maximum(old.sum(axis=0), np.finfo(float).tiny)
        worst = np.minimum(worst, np.quantile(decrease, DOUBT / APPLIED, axis=0) / total)
    return worst


def _proven_gain(stage: Stage, evidence: _Evidence, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Gains (6,) with the unproven ones zero, and the proof (6,) of each while it still had its gain."""
    if len(evidence.blocks) < FEWEST_BLOCKS:
        return np.zeros(APPLIED), np.zeros(APPLIED)
    gain = _best_gain(stage, evidence)
    proof = np.zeros(APPLIED)
    while gain.any():
        # Each output is bounded together with the others, so those that stay are asked again.
        alive = gain > 0.0
        proof = np.where(alive, _proof(stage, evidence, gain, rng), proof)
        if np.all(proof[alive] > MATERIAL):
            break
        gain = np.where(proof > MATERIAL, gain, 0.0)
    return gain, proof


def _ratio(evidence: _Evidence, before: FloatArray, after: FloatArray, rng: np.random.Generator) -> Ratio | None:
    """Root-mean-square ratio of errors (n, c), all columns together, with its 90 % bootstrap interval."""
    if len(evidence.blocks) == 0 or not before.any():
        return None
    squares = np.stack([np.sum(after**2, axis=1), np.sum(before**2, axis=1)], axis=1)
    drawn = evidence.blocks.totals(evidence.blocks.sums(squares), rng)
    ratio = np.sqrt(drawn[:, 0] / np.maximum(drawn[:, 1], np.finfo(float).tiny))
    total = squares.sum(axis=0)
    low, high = np.quantile(ratio, [0.05, 0.95])
    return Ratio(float(np.sqrt(total[0] / total[1])), float(low), float(high))


def judge(stage: Stage, flights: Sequence[Flight], parts: Split, rng: np.random.Generator) -> Stage:
    """The stage with its gain and verdict, from the held-out parts of `flights`."""
    validation = _gather(stage, flights, parts.validation)
    gain, proof = _proven_gain(stage, validation, rng)
    judged = replace(stage, gain=gain)
    before, after = _errors(judged, validation)
    validated = _ratio(validation, before[:, :3], after[:, :3], rng)
    test = _gather(stage, flights, parts.test)
    before, after = _errors(judged, test)
    components = tuple(
        ComponentVerdict(name, float(gain[c]), float(proof[c]), _ratio(test, before[:, [c]], after[:, [c]], rng))
        for c, name in enumerate(stage.features.applied)
    )
    verdict = Verdict(
        parts.by, len(parts.training), len(parts.validation), len(parts.test), components, validated,
        _ratio(test, before[:, :3], after[:, :3], rng), _ratio(test, before[:, 3:], after[:, 3:], rng),
    )  # fmt: skip
    return replace(judged, verdict=verdict)


def _errors(stage: Stage, evidence: _Evidence) -> tuple[FloatArray, FloatArray]:
    """(n, 6) errors without and with the correction, m and m/s along the axes of its outputs."""
    features, place = stage.features, evidence.place
    unit = features.unit(place)
    left = evidence.error - bounded(place, stage, evidence.output * stage.gain)
    return features.from_cartesian(place, evidence.error) * unit, features.from_cartesian(place, left) * unit
