"""The hold-out verdict: a gain for each output from validation data, zero unless a block bootstrap proves it, and error
ratios from the untouched test data. Non-negative stacking with one candidate: it bounds harm on data like the
validation data, not on a new kind of sensor.

Of a feature set that each flight proves again, every flight counts alike: one that was lost for a while has errors of
hundreds of sigmas, beside which the others would not be seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ftproc.correction.apply import bounded, network_output
from ftproc.correction.features import APPLIED, LineOfSight
from ftproc.correction.model import Stage
from ftproc.correction.network import Weights
from ftproc.correction.training.bootstrap import Blocks
from ftproc.correction.training.samples import Flight, Piece, Split
from ftproc.correction.verdict import ComponentVerdict, Ratio, Verdict
from ftproc.records import FloatArray

DOUBT = 0.05  # probability that any of the six outputs gets a gain by chance
MATERIAL = 1e-3  # relative decrease of squared error that is worth a gain
FEWEST_BLOCKS = 4  # a bootstrap over fewer proves nothing


@dataclass(frozen=True)
class _HeldOut:
    """The usable held-out samples. output: (n, 6) of the network, in its own units. error: (n, 6) truth minus estimate
    in x y z."""

    los: LineOfSight
    output: FloatArray
    error: FloatArray
    blocks: Blocks


def _held_out(
    stage: Stage, flights: Sequence[Flight], pieces: Sequence[Piece], left_out: Mapping[Piece, Weights]
) -> _HeldOut:
    position, sigma, output, error = [np.empty((0, 3))], [np.empty((0, 6))], [np.empty((0, 6))], [np.empty((0, 6))]
    times = []
    for piece in pieces:
        number, start, stop = piece
        flight, mine = flights[number], replace(stage, weights=left_out.get(piece, stage.weights))
        found = network_output(flight.run, mine, start, stop, flight.smoothed, signal_db=flight.signal_db)
        piece_error = flight.error[start:stop, :APPLIED]
        keep = found.usable & np.all(np.isfinite(piece_error), axis=1)
        position.append(flight.run.state[start:stop, :3][keep])
        sigma.append(flight.run.los_sigma[start:stop][keep])
        output.append(found.values[keep])
        error.append(piece_error[keep])
        times.append(flight.run.time_s[start:stop][keep])
    los = LineOfSight(np.concatenate(position), np.concatenate(sigma))
    return _HeldOut(los, np.concatenate(output), np.concatenate(error), Blocks.of(times))


def _best_gain(stage: Stage, data: _HeldOut) -> FloatArray:
    """(6,) g = clip(sum B d / sum B^2, 0, 1) of output B and desired output d; one where each flight has its own."""
    if stage.features.proven:
        return np.where(np.any(data.output != 0.0, axis=0), 1.0, 0.0)
    desired = stage.features.from_cartesian(data.los, data.error)
    power = np.sum(data.output**2, axis=0)
    product = np.sum(data.output * desired, axis=0)
    gain: FloatArray = np.divide(product, power, out=np.zeros_like(power), where=power > 0.0)
    return gain.clip(0.0, 1.0)


def _decrease(stage: Stage, data: _HeldOut, rng: np.random.Generator) -> FloatArray:
    """(6,) lower bound of the relative decrease of squared error, with the stage's gain and bound.

    The 5 % quantile of the bootstrap, shared among the six outputs. Taken in the output's units and in metres,
    whichever is smaller: the mean square in sigmas can fall while that in metres rises.
    """
    before, after = _errors(stage, data)
    unit = stage.features.unit(data.los)
    smallest = np.full(APPLIED, np.inf)
    for scale in (np.ones_like(unit), unit):
        old, new = _alike(stage, data.blocks, (before * scale) ** 2, (after * scale) ** 2)
        decrease = data.blocks.totals(data.blocks.sums(old - new), rng)
        total = np.maximum(old.sum(axis=0), np.finfo(float).tiny)
        smallest = np.minimum(smallest, np.quantile(decrease, DOUBT / APPLIED, axis=0) / total)
    return smallest


def _proven_gain(stage: Stage, data: _HeldOut, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Gains (6,) with the insignificant ones zero, and the proof (6,) of each while it still had its gain."""
    gain, proof = np.zeros(APPLIED), np.zeros(APPLIED)
    if len(data.blocks) < FEWEST_BLOCKS:
        return gain, proof
    gain = _best_gain(stage, data)
    while gain.any():
        # Outputs are bounded together, so the remaining ones are tested again when one is dropped.
        alive = gain > 0.0
        proof = np.where(alive, _decrease(replace(stage, gain=gain), data, rng), proof)
        if np.all(proof[alive] > MATERIAL):
            break
        gain = np.where(proof > MATERIAL, gain, 0.0)
    return gain, proof


def _errors(stage: Stage, data: _HeldOut) -> tuple[FloatArray, FloatArray]:
    """(n, 6) errors without and with the correction, in the units of its outputs."""
    remaining = data.error - bounded(data.los, stage, data.output * stage.gain)
    return stage.features.from_cartesian(data.los, data.error), stage.features.from_cartesian(data.los, remaining)


def _alike(stage: Stage, blocks: Blocks, old: FloatArray, new: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Squared errors (n, c) without and with the correction; where each flight proves its own, over those of its piece
    without."""
    if not stage.features.proven or len(blocks) == 0:
        return old, new
    piece = blocks.piece[blocks.block]
    total = np.zeros((int(blocks.piece[-1]) + 1, old.shape[1]))
    np.add.at(total, piece, old)
    each = np.maximum(total, np.finfo(float).tiny)[piece]
    return old / each, new / each


class _Ratios:
    """Error ratios of a stage on held-out data, in metres and m/s."""

    def __init__(self, stage: Stage, data: _HeldOut, rng: np.random.Generator) -> None:
        unit = stage.features.unit(data.los)
        self.before, self.after = (error * unit for error in _errors(stage, data))
        self.stage, self.blocks, self.rng = stage, data.blocks, rng

    def of(self, outputs: slice) -> Ratio | None:
        """Of the root mean square of some outputs together, with its 90 % bootstrap interval; None without data."""
        before, after = self.before[:, outputs], self.after[:, outputs]
        if len(self.blocks) == 0 or not before.any():
            return None
        old, new = _alike(self.stage, self.blocks, *(np.sum(e**2, axis=1, keepdims=True) for e in (before, after)))
        squares = np.concatenate([new, old], axis=1)
        drawn = self.blocks.totals(self.blocks.sums(squares), self.rng)
        ratio = np.sqrt(drawn[:, 0] / np.maximum(drawn[:, 1], np.finfo(float).tiny))
        total = squares.sum(axis=0)
        low, high = np.quantile(ratio, [0.05, 0.95])
        return Ratio(float(np.sqrt(total[0] / total[1])), float(low), float(high))


def with_verdict(
    stage: Stage, flights: Sequence[Flight], parts: Split, rng: np.random.Generator,
    left_out: Mapping[Piece, Weights] | None = None,
) -> Stage:  # fmt: skip
    """The stage with its gain and verdict, from the held-out parts of `flights`. left_out: the weights that were
    learned without each piece, if all but the test's are held out in turn."""
    left_out = left_out or {}
    validation = _held_out(stage, flights, [*left_out] or parts.validation, left_out)
    test = _held_out(stage, flights, parts.test, {})
    gain, proof = _proven_gain(stage, validation, rng)
    stage = replace(stage, gain=gain)
    validated = _Ratios(stage, validation, rng).of(slice(0, 3))
    ratios = _Ratios(stage, test, rng)
    components = tuple(
        ComponentVerdict(name, float(gain[c]), float(proof[c]), ratios.of(slice(c, c + 1)))
        for c, name in enumerate(stage.features.applied)
    )
    verdict = Verdict(
        by=parts.by,
        training=len(left_out or parts.training),
        validation=len(left_out or parts.validation),
        test=len(parts.test),
        in_turn=bool(left_out),
        components=components,
        validated=validated,
        position=ratios.of(slice(0, 3)),
        velocity=ratios.of(slice(3, 6)),
    )
    return replace(stage, verdict=verdict)
