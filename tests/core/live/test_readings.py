"""What is kept of readings as they come."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ftproc.core.editing import screening
from ftproc.core.live.readings import LONGEST_ISOLATED, Columns, Labels, Repeats

CODES = arrays(np.int64, st.tuples(st.integers(1, 40), st.just(3)), elements=st.sampled_from([0, 0, 1, 1, 2]))


def of_codes(codes):
    """Decisions and readings from 0 rejected, 1 good, 2 missing."""
    return (codes == 1).astype(float), np.where(codes == 2, np.nan, 5.0)


def expected(codes):
    """Labels as a reading that is rejected has them when it comes."""
    found = np.zeros(codes.shape)
    for c in range(3):
        run = 0
        for k, code in enumerate(codes[:, c]):
            if code == 2:
                found[k, c] = 3
                continue
            run = 0 if code == 1 else run + 1
            found[k, c] = 0 if run == 0 else 1 if run <= LONGEST_ISOLATED else 2
    return found


@given(CODES, st.integers(0, 40))
def test_labels_are_counted_along_the_readings(codes, cut):
    used, measurement = of_codes(codes)
    labels = Labels()
    parts = [labels.add(used[:cut], measurement[:cut]), labels.add(used[cut:], measurement[cut:])]
    np.testing.assert_array_equal(np.concatenate(parts), expected(codes))


@given(CODES, CODES)
def test_labels_go_on_from_the_decisions_that_they_are_reset_to(before, after):
    labels = Labels()
    labels.run[:] = 7
    labels.reset(*of_codes(before))
    np.testing.assert_array_equal(
        labels.add(*of_codes(after)), expected(np.concatenate([before, after]))[len(before) :]
    )


@given(st.lists(st.tuples(st.sampled_from(["append", "forget"]), st.integers(0, 9)), max_size=30))
def test_columns_are_lists_of_rows(steps):
    columns, rows, fresh = Columns(a=np.zeros(0), b=np.zeros((0, 2))), [], iter(range(10_000))
    for step, amount in steps:
        if step == "forget":
            gone = min(amount, len(rows))
            columns.forget(gone)
            rows = rows[gone:]
            continue
        new = [float(next(fresh)) for _ in range(amount)]
        columns.append(a=np.array(new), b=np.array([[v, -v] for v in new]).reshape(-1, 2))
        rows += new
    assert len(columns) == len(rows)
    np.testing.assert_array_equal(columns["a"], rows)
    np.testing.assert_array_equal(columns["b"], np.array([[v, -v] for v in rows]).reshape(-1, 2))


@pytest.mark.parametrize("step", [1, 7, 200])
@pytest.mark.parametrize("rounding", [0.0, 0.5])
def test_runs_of_repeats_are_found_however_readings_come(rounding, step):
    """A stuck component, noise without repeats, and one whose rounding repeats values by chance."""
    rng = np.random.default_rng(1)
    z = rng.normal(size=(200, 3))
    z[120:140, 0] = z[119, 0]
    z[rng.random((200, 3)) < 0.1] = np.nan
    if rounding:
        z[:, 2] = rounding * np.round(z[:, 2] / rounding)
    repeats, found = Repeats(), []
    for low in range(0, 200, step):
        found += [(low + k, c, run) for k, c, run in repeats.stuck(z[low : low + step])]
    said = {c: [k for k, each, _ in found if each == c] for c in range(3)}
    whole = np.flatnonzero(screening.stuck(z[:, 0], 1.0))
    np.testing.assert_array_equal(said[0], whole[1:])  # a single repeat may be chance when it comes
    assert not said[1]
    assert not [k for k in said[2] if k > 20]  # before that it is not known how often chance repeats a value
    assert [run for _, c, run in found if c == 0] == list(range(2, len(whole) + 1))
