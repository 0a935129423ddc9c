"""The network against plain loops and finite differences."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ftproc.correction import network
from ftproc.correction.network import Shape

SHAPES = [Shape(9, 12, 9), Shape(1, 1, 1), Shape(32, 5, 6), Shape(2, 7, 3), Shape(7, 4, 3, direct=True)]


def problem(shape: Shape, n: int = 40) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    return (
        rng.normal(size=shape.size) * network.scale(shape),
        rng.normal(size=(n, shape.inputs)),
        rng.normal(size=(n, shape.outputs)),
    )


def test_the_papers_chromosome_has_237_genes() -> None:
    assert Shape(9, 12, 9).size == 237


@pytest.mark.parametrize("shape", SHAPES)
def test_pack_undoes_unpack(shape: Shape) -> None:
    vector = np.arange(float(shape.size))
    assert np.array_equal(network.pack(network.unpack(vector, shape)), vector)
    assert len(network.scale(shape)) == shape.size


@pytest.mark.parametrize("shape", SHAPES)
def test_forward_equals_the_formula_written_out(shape: Shape) -> None:
    vector, x, _ = problem(shape, n=4)
    w = network.unpack(vector, shape)
    output = network.forward(w, x)
    for k in range(len(x)):
        hidden = [
            math.tanh(sum(w.w1[j, i] * x[k, i] for i in range(shape.inputs)) + w.b1[j]) for j in range(shape.hidden)
        ]
        for o in range(shape.outputs):
            naive = sum(w.w2[o, j] * hidden[j] for j in range(shape.hidden)) + w.b2[o]
            if shape.direct:
                naive += sum(w.direct[o, i] * x[k, i] for i in range(shape.inputs))
            assert output[k, o] == pytest.approx(naive, abs=1e-12)


@pytest.mark.parametrize("decay", [0.0, 0.03])
@pytest.mark.parametrize("shape", SHAPES)
def test_gradient_equals_finite_differences(shape: Shape, decay: float) -> None:
    vector, x, t = problem(shape)
    _, gradient = network.cost_and_gradient(vector, shape, x, t, decay)
    step = 1e-5
    for i in range(shape.size):
        up, down = vector.copy(), vector.copy()
        up[i] += step
        down[i] -= step
        slope = network.cost_and_gradient(up, shape, x, t, decay)[0]
        slope -= network.cost_and_gradient(down, shape, x, t, decay)[0]
        assert gradient[i] == pytest.approx(slope / (2 * step), rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("shape", SHAPES)
def test_working_in_blocks_of_rows_changes_nothing(shape: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    vector, x, t = problem(shape, n=100)
    monkeypatch.setattr(network, "BLOCK_WORK", 10**9)
    value, gradient = network.cost_and_gradient(vector, shape, x, t, 0.01)
    output = network.forward(network.unpack(vector, shape), x)
    monkeypatch.setattr(network, "BLOCK_WORK", 1)  # blocks of 32 rows, the last one of 4
    again, gradient_again = network.cost_and_gradient(vector, shape, x, t, 0.01)
    assert again == pytest.approx(value, rel=1e-12)
    assert gradient_again == pytest.approx(gradient, rel=1e-9, abs=1e-12)
    assert network.forward(network.unpack(vector, shape), x) == pytest.approx(output, abs=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_population_costs_what_each_network_costs(shape: Shape) -> None:
    _, x, t = problem(shape)
    population = np.random.default_rng(1).normal(size=(6, shape.size))
    each = [network.cost(vector, shape, x, t) for vector in population]
    assert network.population_cost(population, shape, x, t) == pytest.approx(each, rel=1e-12)
    assert network.cost_and_gradient(population[0], shape, x, t, 0.0)[0] == pytest.approx(each[0], rel=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_no_outer_weights_do_better_than_the_least_squares_ones(shape: Shape) -> None:
    vector, x, t = problem(shape)
    inner = vector[: shape.inner]
    found = network.least_squares(inner, shape, x, t, 0.01)
    assert np.array_equal(found[: shape.inner], inner)
    value, gradient = network.cost_and_gradient(found, shape, x, t, 0.01)
    assert gradient[shape.inner :] == pytest.approx(np.zeros(shape.size - shape.inner), abs=1e-10)
    assert value <= network.cost_and_gradient(vector, shape, x, t, 0.01)[0]
