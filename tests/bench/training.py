"""Training the network, medians of interleaved repetitions: its parts against the matrix products that cannot be done
without, and a whole training with the genetic start against one without it."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ftproc.correction import network
from ftproc.correction.network import Shape
from ftproc.correction.training.train import train
from ftproc.records import FloatArray
from ftproc.settings import TrainSettings
from tests.bench import measuring
from tests.bench.correction import CASES, FIRST_SEED, flights

HEADER = ("what", "time", "ratio", "to")
SHAPE = Shape(9, 12, 9)  # the paper's
SAMPLES, POPULATION = 20_000, 40
PRODUCTS = "its matrix products alone"


def rows() -> Iterator[tuple[str, ...]]:
    """The parts of the training, then all of it."""
    rng = np.random.default_rng(0)
    inputs, targets = rng.standard_normal((SAMPLES, SHAPE.inputs)), rng.standard_normal((SAMPLES, SHAPE.outputs))
    vector = rng.uniform(-1, 1, SHAPE.size)
    few = (inputs[:600], targets[:600])
    population = rng.uniform(-1, 1, (POPULATION, SHAPE.size))
    yield from _compared(
        f"gradient of 237 weights, {SAMPLES:,} samples",
        lambda: network.cost_and_gradient(vector, SHAPE, inputs, targets, 1e-4),
        lambda: _products(vector, inputs, targets, backward=True),
    )
    yield from _compared(
        f"one generation: {POPULATION} networks, 600 samples",
        lambda: network.population_cost(population, SHAPE, *few),
        lambda: [_products(each, *few, backward=False) for each in population],
    )
    yield from _whole()


def _compared(name: str, ours: Callable[[], object], floor: Callable[[], object]) -> Iterator[tuple[str, ...]]:
    taken = measuring.calls({name: ours, PRODUCTS: floor}, 9)
    ratio = taken[name].seconds / taken[PRODUCTS].seconds
    yield name, f"{1e3 * taken[name].seconds:.3g} ms", f"{ratio:.2f}", PRODUCTS


def _products(vector: FloatArray, inputs: FloatArray, targets: FloatArray, backward: bool) -> None:
    """A pass through the network without its tanh, in the same blocks."""
    weights = network.unpack(vector, SHAPE)
    for rows in network.blocks(len(inputs), weights.w1.size):
        hidden = inputs[rows] @ weights.w1.T
        output = hidden @ weights.w2.T
        if backward:
            _ = output.T @ hidden, (targets[rows] @ weights.w2).T @ inputs[rows]


def _whole() -> Iterator[tuple[str, ...]]:
    """The filter's network of one case, with the genetic start and without it."""
    case = CASES["manoeuvre"]
    known = flights(case, range(FIRST_SEED, FIRST_SEED + case.training))["filter"]
    ways = {"genetic": "training, genetic start", "random": "training, random start"}
    calls = {
        name: lambda start=start: train(known, TrainSettings(features="instrument", start=start))
        for start, name in ways.items()
    }
    taken = measuring.calls(calls, 1)  # type: ignore[arg-type]
    genetic, random = (taken[name].seconds for name in ways.values())
    yield ways["genetic"], f"{genetic:.3g} s", f"{genetic / random:.2f}", ways["random"]
