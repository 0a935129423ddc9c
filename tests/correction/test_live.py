"""A correction of live rows: it does not come and go with the refreshes of the window."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.records import FilterRun
from ftproc.correction.apply import correct
from ftproc.methods import live
from ftproc.settings import FilterSettings
from tests.correction.test_apply import constant
from tests.simulated import simulate

SECONDS = {20.0: 30.0, 50.0: 16.0, 200.0: 6.0}  # Hz: of the flight


@pytest.mark.parametrize("lag_s", [0.0, 0.5])
@pytest.mark.parametrize("rate", SECONDS)
def test_a_constant_correction_is_constant(rate: float, lag_s: float) -> None:
    """In units of the sigmas it is the same for all rows, from the one on with which the track has settled."""
    log = simulate("manoeuvre", seed=5, duration_s=SECONDS[rate], dt_s=1 / rate).log
    editor, found = live.editor(FilterSettings(editing="live", lag_s=lag_s)), []
    for low in range(0, len(log), 7):
        found += editor.push(log.time_s[low : low + 7], log.measurement[low : low + 7])
    found += editor.finish()
    run = FilterRun.of(log.time_s, np.concatenate([each.rows for each in found]), 0.0)
    applied = np.linalg.norm(correct(run, constant("window", 1.0)).values, axis=1)
    settled = np.flatnonzero(applied)
    assert settled[0] < 60
    used = np.flatnonzero((run.weight > 0).any(1))
    np.testing.assert_array_equal(settled, used[used >= settled[0]])
    np.testing.assert_array_equal(np.diff(run.since_start[settled[0] :]), 1)
    in_sigmas = applied[settled] / np.linalg.norm(run.los_sigma[settled, :6], axis=1)
    assert np.ptp(in_sigmas) < 1e-9
