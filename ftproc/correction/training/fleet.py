"""What past flights of a fleet make of the packaged network. They are too few for one of their own: its weights are
held near those of the packaged one, and that stays where flights which were left out in turn do not prefer theirs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ftproc.correction import network
from ftproc.correction.envelope import Envelope
from ftproc.correction.features import APPLIED
from ftproc.correction.model import Stage
from ftproc.correction.network import Weights
from ftproc.correction.training import Progress, descent, silent
from ftproc.correction.training.descent import Problem
from ftproc.correction.training.holdout import with_verdict
from ftproc.correction.training.prepared import Prepared, streams
from ftproc.correction.training.samples import BOUND_SIGMA, Flight, Piece, Samples, overconfidence, samples
from ftproc.settings import TrainSettings

MOST_EPOCHS = 100  # of weights that are held near known ones
#: Fits, by which flights are left out in turn; of more flights several at once. Of twelve flights of manoeuvre-clean
#: the squares of those left out are .980 of the packaged network's, of unseen ones .968; of a third held out at once
#: .984 to 1.04 in six draws, as the others teach less.
MOST_FITS = 12


def taught(
    known: Stage, flights: Sequence[Flight], data: Prepared, settings: TrainSettings, progress: Progress = silent
) -> Stage:
    """The stage that flights make of a known one. Those that were left out decide between the weights, and the gain;
    then it learns from all, and the verdict is on those that had not taken part."""
    left_out, better = _left_out(known, flights, data, settings, progress)
    stage = replace(known, gain=np.ones(APPLIED), fingerprint=data.fingerprint)
    if better:
        stage = replace(
            stage,
            weights=_near(known, data.training.and_(data.validation), len(left_out), settings, progress),
            envelope=Envelope.fit(data.training.inputs, known.features.reach),
            bound_sigma=BOUND_SIGMA * overconfidence(flights, data.parts.training, known.features.share),
        )
    progress("validation", 0, 1)
    stage = with_verdict(stage, flights, data.parts, streams(settings.seed)[4], left_out)
    progress("validation", 1, 1)
    if better:
        learned = data.training.and_(data.validation).and_(data.test)
        stage = replace(stage, weights=_near(known, learned, data.parts.count, settings, progress))
    return stage


def _left_out(
    known: Stage, flights: Sequence[Flight], data: Prepared, settings: TrainSettings, progress: Progress
) -> tuple[dict[Piece, Weights], bool]:
    """For each piece that is not for the test the weights that the other flights prefer, and true; or the known ones,
    and false, where they are better by the samples that were left out."""
    pieces = (*data.parts.training, *data.parts.validation)
    each = [data.normalised(samples(flights, [piece], data.features, len(pieces))) for piece in pieces]
    together = list(dict.fromkeys(piece.flight for piece in pieces))
    places = [together.index(piece.flight) if len(together) > 1 else k for k, piece in enumerate(pieces)]
    found: dict[Piece, Weights] = {}
    own = usual = 0.0
    for fit in range(min(MOST_FITS, len(set(places)))):
        out = [k for k, place in enumerate(places) if place % MOST_FITS == fit]
        others = [k for k in range(len(pieces)) if k not in out]
        weights = _near(known, Samples.of([each[k] for k in others]), len(others), settings, progress)
        held = Samples.of([each[k] for k in out])
        own += float(network.squares(weights, *held).sum())
        usual += float(network.squares(known.weights, *held).sum())
        found |= {pieces[k]: weights for k in out}
    return (found, True) if own < usual else (dict.fromkeys(pieces, known.weights), False)


def _near(known: Stage, learned: Samples, flights: int, settings: TrainSettings, progress: Progress) -> Weights:
    """The weights that samples of some flights prefer, held near those of a known network: so they are fitted to the
    end."""
    vector = network.pack(known.weights)
    problem = Problem(known.shape, learned, learned, vector, 1.0 / flights)
    descending, steps = streams(settings.seed)[3], partial(progress, "back-propagation")
    epochs = min(settings.epochs, MOST_EPOCHS)
    fit = descent.descend(settings.optimiser, vector, problem, epochs, descending, steps)
    return network.unpack(fit.vector, known.shape)
