"""The comparison of methods on one flight."""

from __future__ import annotations

import numpy as np

from ftproc.records import EDITED, PAST, WHOLE
from ftproc.scoring import comparison, render, score
from tests.simulated import flown, trajectory_for

TRUTH = flown(outliers="isolated=0.2")


def scored(method, error_m, sees=PAST, smooth=False, truth=TRUTH, **changes):
    metadata = {"method": method, "sees": sees, "settings": {"smooth": smooth}}
    return score(trajectory_for(truth, error_m=error_m, metadata=metadata, **changes), truth)


def test_sorted_by_error_and_grouped_by_the_readings_used():
    scores = [
        scored("ukf", 9.0), scored("wavelet-akf", 3.0, WHOLE), scored("gate", 5.0),
        scored("ukf", 2.0, WHOLE, smooth=True), scored("ga-bpnn-ukf", 4.0, EDITED),
    ]  # fmt: skip
    text = render(scores)
    assert text.endswith("\n")
    lines = text.splitlines()
    assert [line.strip().split("  ")[0] for line in lines[1:-1]] == [
        "from past readings", "gate", "ukf", "from past readings, edited with the whole record", "ga-bpnn-ukf",
        "from the whole record", "ukf --smooth", "wavelet-akf",
    ]  # fmt: skip
    assert f"{scores[2].rmse_3d_m:.3g}" in lines[2].split()


def test_figures_of_a_line():
    one = scored("gate", 5.0)
    line = comparison.table([one, scored("ukf", 9.0)]).splitlines()[2].split()
    flags = one.outliers.values()
    found = 100 * sum(d.true_positives for d in flags) / sum(d.true_positives + d.false_negatives for d in flags)
    false = 100 * sum(d.false_positives for d in flags) / sum(d.false_positives + d.true_negatives for d in flags)
    figures = (one.rmse_3d_m, one.rmse_seed_m, one.p95_error_m, one.max_error_m, one.rmse_v_mps, one.in_3sigma)
    assert line == ["gate", *(f"{v:.3g}" for v in figures), str(one.without_estimate), f"{found:.3g}", f"{false:.3g}"]
    assert one.without_estimate > 0


def test_blank_where_nothing_is_known_and_last_without_position():
    n = len(TRUTH)
    blank = scored("gate", 1.0, state=np.full((n, 9), np.nan))
    truth = flown(outliers="none")
    lines = comparison.table([blank, scored("ukf", 9.0)]).splitlines()
    assert [line.split()[0] for line in lines[2:4]] == ["ukf", "gate"]
    assert lines[3].split()[1:7] == ["-"] * 6
    bare = scored("ukf", 1.0, truth=truth, outlier=np.zeros((n, 3), np.uint8))
    assert comparison.table([bare]).splitlines()[2].split()[-2:] == ["-", "0"]


def test_columns_unless_methods_are_compared_with_one_truth():
    ukf, gate = scored("ukf", 9.0), scored("gate", 5.0)
    assert comparison.applies([ukf, gate])
    assert comparison.applies([ukf, scored("ukf", 1.0, WHOLE, smooth=True)])
    assert not comparison.applies([ukf])
    assert not comparison.applies([ukf, ukf])
    assert not comparison.applies([ukf, scored("gate", 5.0, sees=None)])
    assert not comparison.applies([ukf, score(trajectory_for(TRUTH))])
    assert "position RMSE (m)" in render([ukf, ukf])
    assert "position RMSE (m)" not in render([ukf, gate])
