"""The jerk profile that goes on where a window does."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.records import Model
from ftproc.core.identification.profile import MAX_KNOTS
from ftproc.core.live.pieces import piece, stretched

KNOT_S = 2.5


def profile(pieces):
    return Model(np.ones(3), np.arange(6.0 * pieces).reshape(pieces, 6), KNOT_S)


@pytest.mark.parametrize("span_s", [0.0, 1.0, 2.5, 5.0, 6.0, 23.0])
@pytest.mark.parametrize("pieces", [1, 2, 9])
def test_every_time_of_a_span_has_a_piece_and_the_last_one_goes_on(pieces, span_s):
    model = profile(pieces)
    found = stretched(model, span_s)
    for after_s in np.linspace(0, span_s, 50, endpoint=False):
        here = piece(after_s, model)
        np.testing.assert_array_equal(found.jerk[here], model.jerk[min(here, pieces - 1)])


def test_a_level_is_one_piece_for_ever():
    level = Model(np.ones(3), np.ones((1, 6)))
    assert piece(1e9, level) == 0
    assert len(stretched(level, 1e9).jerk) == 1


@pytest.mark.parametrize("span_s", [1e5, 1e9, 1e11])
def test_a_span_of_years_has_longer_pieces_not_more_of_them(span_s):
    model = profile(9)
    found = stretched(model, span_s)
    assert len(found.jerk) <= MAX_KNOTS + 1
    for after_s in (0.0, 0.3 * found.knot_s, 2.5 * found.knot_s, 0.99 * span_s):
        begins_s = piece(after_s, found) * found.knot_s
        expected = model.jerk[min(int(begins_s / KNOT_S + 1e-9), 8)]
        np.testing.assert_array_equal(found.jerk[piece(after_s, found)], expected)
