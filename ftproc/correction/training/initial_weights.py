"""Initial weights of a network, before back-propagation.

`genetic` is the paper's: all weights are genes (Zuo et al. 2021, section 2.1). `genetic-solved` searches only the
weights into the hidden layer, solves for the others by least squares, and evaluates the cost on other flights than
these. `random` and `solved` are the same without the search. No kind is better than another where it was measured
(`ftproc train --compare-starts`); training uses the paper's by default, or the weights of the packaged network where
it learns what that has learned (`train`).
"""

from __future__ import annotations

import numpy as np

from ftproc.correction import network
from ftproc.correction.network import Shape
from ftproc.correction.training import Steps, genetic, silent
from ftproc.correction.training.descent import DECAY
from ftproc.correction.training.genetic import GeneticSettings
from ftproc.correction.training.samples import Samples
from ftproc.records import FloatArray

PACKAGED, GENETIC = "packaged", "genetic"  # the former those of the packaged network, or genetic if it is another one
KINDS = (PACKAGED, GENETIC, "genetic-solved", "random", "solved")
SEARCH_SAMPLES = 600  # on which the genetic search evaluates the cost; `genetic-solved` solves on as many others


def initial_weights(
    kind: str,
    shape: Shape,
    training: Samples,
    settings: GeneticSettings,
    rng: np.random.Generator,
    progress: Steps = silent,
) -> FloatArray:
    """(size,) initial weights of one of KINDS."""
    scale = network.scale(shape)
    if kind == "random":
        return rng.uniform(-1.0, 1.0, shape.size) * scale
    inner = scale[: shape.inner]
    if kind == "solved":
        return network.least_squares(rng.uniform(-1.0, 1.0, shape.inner) * inner, shape, *training, DECAY)
    if kind in (PACKAGED, GENETIC):
        few = training.thinned(SEARCH_SAMPLES, rng)
        found = genetic.search(
            lambda genes: network.population_cost(genes * scale, shape, *few), shape.size, settings, rng, progress
        )
        return found.best * scale
    half = len(training.inputs) // 2  # samples are in the order of their flights
    solving = training.rows(slice(None, half)).thinned(SEARCH_SAMPLES, rng)
    evaluating = training.rows(slice(half, None)).thinned(SEARCH_SAMPLES, rng)

    def cost(genes: FloatArray) -> FloatArray:
        vectors = [network.least_squares(g, shape, *solving, DECAY) for g in genes * inner]
        return network.population_cost(np.array(vectors), shape, *evaluating)

    found = genetic.search(cost, shape.inner, settings, rng, progress)
    return network.least_squares(found.best * inner, shape, *training, DECAY)


def linear(shape: Shape, training: Samples) -> FloatArray:
    """(size,) linear regression by the direct connections; the hidden layer is zero."""
    return network.least_squares(np.zeros(shape.inner), shape, *training, DECAY)
