"""First weights of a network, before back-propagation.

`genetic` is the paper's: all weights are genes (Zuo et al. 2021, section 2.1). `genetic-solved` searches only the
weights into the hidden layer, solves for the others by least squares, and judges them on other flights than they were
solved on. `random` and `solved` are the same without the search. None is better than another where it was measured
(`ftproc train --compare-starts`); training takes the paper's.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ftproc.correction import network
from ftproc.correction.network import Shape
from ftproc.correction.training import genetic
from ftproc.correction.training.descent import DECAY, Samples
from ftproc.correction.training.genetic import GeneticSettings
from ftproc.records import FloatArray

STARTS = ("genetic", "genetic-solved", "random", "solved")
SEARCH_SAMPLES = 600  # that the genetic search looks at, and as many to judge by

Tell = Callable[[int, int], None]


def first_weights(
    start: str,
    shape: Shape,
    training: Samples,
    settings: GeneticSettings,
    rng: np.random.Generator,
    tell: Tell | None = None,
) -> FloatArray:
    """(size,) first weights; `start` is one of STARTS."""
    scale = network.scale(shape)
    if start == "random":
        return rng.uniform(-1.0, 1.0, shape.size) * scale
    inner = scale[: shape.searched]
    if start == "solved":
        return network.solved(rng.uniform(-1.0, 1.0, shape.searched) * inner, shape, *training, DECAY)
    if start == "genetic":
        few = thinned(training, SEARCH_SAMPLES, rng)
        found = genetic.search(
            lambda genes: network.population_cost(genes * scale, shape, *few), shape.size, settings, rng, tell
        )
        return found.best * scale
    half = len(training.inputs) // 2  # samples are in the order of their flights
    own = thinned(Samples(training.inputs[:half], training.targets[:half]), SEARCH_SAMPLES, rng)
    other = thinned(Samples(training.inputs[half:], training.targets[half:]), SEARCH_SAMPLES, rng)

    def cost(genes: FloatArray) -> FloatArray:
        vectors = [network.solved(g, shape, *own, DECAY) for g in genes * inner]
        return network.population_cost(np.array(vectors), shape, *other)

    found = genetic.search(cost, shape.searched, settings, rng, tell)
    return network.solved(found.best * inner, shape, *training, DECAY)


def linear(shape: Shape, training: Samples) -> FloatArray:
    """(size,) the network without its hidden layer: linear regression by the direct connections."""
    return network.solved(np.zeros(shape.searched), shape, *training, DECAY)


def thinned(samples: Samples, most: int, rng: np.random.Generator) -> Samples:
    """At most so many of the samples, in their order."""
    if len(samples.inputs) <= most:
        return samples
    rows = np.sort(rng.choice(len(samples.inputs), most, replace=False))
    return Samples(samples.inputs[rows], samples.targets[rows])
