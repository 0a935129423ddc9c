"""What a log says of unknown numbers, against the likelihood itself: its slope, its bend, and its value elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.beside import DISTANCE
from ftproc.core.filtering.columns import Columns, said_of
from ftproc.core.filtering.records import Scalars, Start
from ftproc.core.filtering.smoother import likelihood_of
from ftproc.core.model.frames import from_cartesian, wrap
from tests.core.tracks import SIGMA, matched

pytestmark = pytest.mark.compiled


def track(n=120, **how):
    return matched(3, n, dt=0.4, q=4.0, irregular=True, missing=0.2, distance=400_000.0, **how)


def curves(n):
    """An offset of the range for a while, one of the azimuth to the end, a slope of the elevation, one of all three."""
    design = np.zeros((n, 3, 4))
    begin, end = np.array([10, 20, 40, 70]), np.array([60, n, 90, n])
    design[10:60, 0, 0] = design[20:, 1, 1] = 1.0
    design[40:90, 2, 2] = np.linspace(-1, 1, 50)
    design[70:, :, 3] = SIGMA * np.random.default_rng(0).standard_normal((n - 70, 3))
    return Columns(design, begin, end, np.full(4, -1))


CENTRE = np.array([0.0, 0.0, -6.37e6])  # of the earth, m
SIZE = np.array([1.0, 1.0, 1.0, 1.0]) * [SIGMA[0], SIGMA[1], SIGMA[2], 1.0]


def test_score_and_information_are_slope_and_bend_of_the_likelihood():
    a = track()
    columns = curves(len(a.time))
    said = said_of(a.log, a.model, a.starts, columns)
    assert said.log_likelihood == pytest.approx(likelihood_of(a.log, a.model, a.starts), rel=1e-12)

    def likelihood(b):
        return likelihood_of(a.log._replace(measurement=a.z - columns.design @ b), a.model, a.starts)

    draw = np.random.default_rng(1)
    for _ in range(10):
        b = 3 * SIZE * draw.standard_normal(4)
        expected = said.log_likelihood + said.score @ b - 0.5 * b @ said.information @ b
        assert likelihood(b) == pytest.approx(expected, abs=2e-3 * (1 + b @ said.information @ b))


def test_columns_of_cells_share_their_derivatives():
    """Those of column c + 2 are those of column c, as if each had its own."""
    a = track()
    one = np.random.default_rng(2).standard_normal((len(a.time), 3, 2)) * SIGMA[:, None]
    begin, end = np.repeat([0, 30, 60], 2), np.repeat([30, 60, len(a.time)], 2)
    found, expected = (
        said_of(a.log, a.model, a.starts, Columns(np.tile(one, (1, 1, often)), begin, end, np.full(6, -1)))
        for often in (1, 3)
    )
    np.testing.assert_array_equal(found.score, expected.score)
    np.testing.assert_array_equal(found.information, expected.information)


def test_what_a_column_has_ceased_to_do_costs_nothing_and_changes_nothing():
    """A column that is followed no further says what one followed to the end says."""
    a = matched(5, 900, dt=0.2, q=4.0, distance=100_000.0)
    design = np.zeros((900, 3, 2))
    design[100:130, 0, 0] = design[500:530, 2, 1] = 1.0
    ends = np.array([100, 500]), np.array([130, 530])
    short = said_of(a.log, a.model, a.starts, Columns(design, *ends, np.full(2, -1)))
    whole = said_of(a.log, a.model, a.starts, Columns(design, ends[0], np.full(2, 900), np.full(2, -1)))
    np.testing.assert_array_less(np.abs(short.score - whole.score), 1e-3 * np.sqrt(np.diag(whole.information)))
    np.testing.assert_allclose(np.diag(short.information), np.diag(whole.information), rtol=1e-6)


def test_a_start_forgets_what_was_before_it():
    a = track()
    again = [*a.starts, Start(60, a.truth[60], a.starts[0].covariance)]
    whole = said_of(a.log, a.model, again, curves(len(a.time)))
    parts = [
        said_of(a.log.part(rows), a.model, [start._replace(sample=0)], _cut(curves(len(a.time)), rows))
        for rows, start in ((slice(0, 60), again[0]), (slice(60, None), again[1]))
    ]
    np.testing.assert_allclose(whole.score, sum(part.score for part in parts), rtol=1e-9)
    np.testing.assert_allclose(whole.information, sum(part.information for part in parts), rtol=1e-9)


def _cut(columns, rows):
    n = len(columns.design[rows])
    begin, end = (np.clip(each - rows.start, 0, n) for each in (columns.begin, columns.end))
    return Columns(np.ascontiguousarray(columns.design[rows]), begin, end, columns.jolt)


@pytest.mark.parametrize("element", range(9))
def test_a_jolt_is_a_step_of_the_state(element):
    """Its score is the slope of the likelihood by where a second start puts the state."""
    a = track()
    k, size = 50, (1.0, 0.5, 0.3)[element // 3]
    none = np.zeros((len(a.time), 3, 1))
    said = said_of(a.log, a.model, a.starts, Columns(none, np.array([k]), np.array([k]), np.array([element])))
    late = np.maximum(a.time - a.time[k - 1], 0)
    way = {0: np.ones_like(late), 1: late, 2: late**2 / 2}[element // 3] * (np.arange(len(late)) >= k) * size
    moved = a.truth[:, :3].copy()
    moved[:, element % 3] += way
    z = a.z - (from_cartesian(moved) - from_cartesian(a.truth[:, :3]))
    z[:, 1] = wrap(z[:, 1])
    there = likelihood_of(a.log._replace(measurement=z), a.model, a.starts)
    expected = said.score[0] * size - 0.5 * said.information[0, 0] * size**2
    assert there - said.log_likelihood == pytest.approx(expected, rel=0.05, abs=0.3)


def test_scalars_beside_the_readings_count():
    """Heights and range rates, some of them missing or rejected: likelihood, slope and bend as without columns."""
    a, draw = track(), np.random.default_rng(4)
    n, columns = len(a.time), curves(len(a.time))
    rate = (a.truth[:, :3] * a.truth[:, 3:6]).sum(1) / np.linalg.norm(a.truth[:, :3], axis=1)
    heights = np.linalg.norm(a.truth[:, :3] - CENTRE, axis=1)
    weight = (draw.random((2, n)) > 0.2).astype(float)
    scalars = (
        Scalars.rates(rate + draw.standard_normal(n), 1.0, weight[0]),
        Scalars(heights + 30 * draw.standard_normal(n), np.full(n, 900.0), weight[1], DISTANCE, CENTRE),
    )
    log = a.log._replace(beside=scalars)
    said = said_of(log, a.model, a.starts, columns)
    assert said.log_likelihood == pytest.approx(likelihood_of(log, a.model, a.starts), rel=1e-12)
    alone = said_of(a.log, a.model, a.starts, columns)
    assert (np.diag(said.information) > 1.001 * np.diag(alone.information)).any()
    for _ in range(10):
        b = 3 * SIZE * draw.standard_normal(4)
        expected = said.log_likelihood + said.score @ b - 0.5 * b @ said.information @ b
        moved = log._replace(measurement=a.z - columns.design @ b)
        likely = likelihood_of(moved, a.model, a.starts)
        assert likely == pytest.approx(expected, abs=2e-3 * (1 + b @ said.information @ b))
