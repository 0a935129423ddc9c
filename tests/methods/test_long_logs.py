"""Long logs in stretches: the same as in one piece, exactly where the filter is recursive, and elsewhere within a share
of its own sigma."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.core import threads
from ftproc.correction import model_file
from ftproc.methods import anti_outlier, live
from ftproc.methods.estimate import Recording
from ftproc.records import MISSING
from ftproc.settings import FilterSettings
from tests.simulated import simulate

UNKNOWN = np.full(3, np.nan)
GIVEN = {"noise": (5.0, 1e-4, 1e-4), "jerk_psd_m2ps5": 10.0}
SPEC = "isolated=0.03:6-300,offset=4:8-30:8-200,nan=0.01,gap=3:4-20"


@pytest.fixture(scope="module")
def flight():
    return simulate("manoeuvre", seed=3, duration_s=420.0, dt_s=0.1, outliers=SPEC)


def start_of(log, rows):
    """Its first rows, to be changed."""
    return replace(log, time_s=log.time_s[:rows], measurement=log.measurement[:rows].copy(), row=log.row[:rows])


def record(log):
    return Recording(log.time_s, log.measurement, UNKNOWN)


def kept(parts):
    found = [p.estimate.rows(p.low, p.high) for p in parts]
    return {
        **{name: np.concatenate([getattr(e.run, name) for e in found]) for name in found[0].run._fields[:-1]},
        "label": np.concatenate([e.label for e in found]),
    }


@pytest.mark.parametrize(
    ("given", "blocks", "rows", "missing"),
    [({}, (300,), 1500, slice(600, 1300)), (GIVEN, (300, 1000), 2400, slice(1000, 2100))],
    ids=["found", "specified"],
)
def test_recursion_in_blocks_is_the_recursion_bit_for_bit(flight, given, blocks, rows, missing):
    settings = FilterSettings(editing="forward", **given)
    log = start_of(flight.log, rows)
    log.measurement[missing, 2] = np.nan  # longer than a block, and than what is remembered
    whole = list(live.parts(record(log), settings, len(log)))
    one = kept(whole)
    for block in blocks:
        parts = list(live.parts(record(log), settings, block))
        assert len(parts) == -(-len(log) // block)
        many = kept(parts)
        for name, values in one.items():
            np.testing.assert_array_equal(many[name], values, err_msg=f"{name} {block}")
        again = [p.first + k for p in parts for k in p.estimate.reacquired if p.low <= k < p.high]
        assert again == list(whole[0].estimate.reacquired)
        assert again


def test_run_of_outliers_over_a_seam_has_one_label_also_where_another_component_is_missing(flight):
    log = replace(flight.log, measurement=flight.log.measurement.copy())
    log.measurement[1000:, 2] = np.nan
    # Two lie before the seam, and what makes it a patch behind it.
    log.measurement[1198:1205, 0] += [800, -900, 1200, -700, 1000, -800, 900]
    settings = FilterSettings(editing="forward", **GIVEN)
    one = kept(live.parts(record(log), settings, len(log)))
    many = kept(live.parts(record(log), settings, 300))
    np.testing.assert_array_equal(many["label"], one["label"])
    assert (one["label"][1200:1203, 0] == 2).all()  # of the first two nobody can know it yet


def test_start_later_than_the_first_block(flight):
    log = replace(flight.log, measurement=flight.log.measurement.copy())
    log.measurement[:900, 0] = np.nan
    settings = FilterSettings(editing="forward", **GIVEN)
    one = kept(live.parts(record(log), settings, len(log)))
    many = kept(live.parts(record(log), settings, 300))
    np.testing.assert_array_equal(many["state"], one["state"])


@pytest.fixture
def in_segments(monkeypatch):
    """Segments so short that a log of some thousand samples has several."""

    def use(longest, size, margin):
        monkeypatch.setattr(anti_outlier, "LONGEST_WHOLE", longest)
        monkeypatch.setattr(anti_outlier, "KEPT", size)
        monkeypatch.setattr(anti_outlier, "KEPT_MARGINS", 1)
        monkeypatch.setattr(anti_outlier, "LEAST_MARGIN", margin)
        monkeypatch.setattr(anti_outlier, "MOST_MARGIN", margin)

    return use


@pytest.mark.parametrize(("editing", "longest"), [("two-pass", 500), ("none", 100)])
def test_a_short_log_is_edited_as_a_whole_and_a_long_one_filtered_so_without_editing(in_segments, editing, longest):
    in_segments(longest, 100, 50)
    log = record(start_of(simulate("manoeuvre", seed=3, duration_s=60.0).log, 400))
    settings = FilterSettings(editing=editing)
    (part,) = anti_outlier.parts(log, settings)
    assert (part.first, part.low, part.high) == (0, 0, len(log))
    np.testing.assert_array_equal(part.estimate.run.state, anti_outlier.estimate(log.whole(), settings).run.state)


def test_each_segment_proves_its_correction(in_segments):
    in_segments(1000, 1000, 300)
    flight = simulate("manoeuvre-clean", seed=1, duration_s=120.0)
    found = pipeline.filter_log(flight.log, model=model_file.named("packaged"))
    assert found.metadata["summary"]["median_sigma_smoothed_m"] is None  # of the whole log it is not known
    plain, better = (
        np.sqrt(np.mean((state[:, :3] - flight.truth.position_m) ** 2))
        for state in (found.state[:, :6] - found.correction, found.state)
    )
    assert all(part.any() for part in np.array_split(found.correction, 4))
    assert better < 0.97 * plain


@pytest.mark.parametrize("smooth", [pytest.param(False, marks=pytest.mark.slow), True])
def test_segments_agree_with_the_whole(in_segments, smooth):
    """Half of all samples within 0.15 of their sigma, 99 % within 1, also at the seams, and as accurate. (Decisions
    that hang in the balance, of a patch in a turn, may come out otherwise.)"""
    flight = simulate("manoeuvre", seed=3, duration_s=700.0, dt_s=0.1, outliers="isolated=0.05:8-300,nan=0.01")
    settings = FilterSettings(smooth=smooth)
    whole = pipeline.filter_log(flight.log, settings)
    in_segments(3000, 2000, 600)
    cut = pipeline.filter_log(flight.log, settings)
    assert cut.metadata["segments"] == len(anti_outlier.segments(record(flight.log))) >= 3
    away = np.abs(cut.state[:, :3] - whole.state[:, :3]) / whole.sigma[:, :3]
    assert np.median(away) < 0.15
    assert np.quantile(away, 0.99) < 1.0
    assert (cut.outlier != whole.outlier).mean() < 0.003
    for low, _ in anti_outlier.segments(record(flight.log))[1:]:
        assert away[low - 20 : low + 20].max() < 1.5
    known = np.isin(flight.truth.time_s, flight.log.time_s)
    error = [np.sqrt(((t.state[:, :3] - flight.truth.position_m[known]) ** 2).mean()) for t in (whole, cut)]
    assert error[1] < 1.05 * error[0]


def test_segments_are_the_same_in_any_number_of_threads(in_segments):
    in_segments(1500, 800, 200)
    log = simulate("manoeuvre", seed=3, duration_s=300.0, dt_s=0.1, outliers="isolated=0.03:6-300,nan=0.01").log
    found = []
    for count in (1, 3):
        threads.use(count)
        found.append(pipeline.filter_log(log))
    threads.use(None)
    one, three = found
    assert one.metadata["segments"] >= 3
    np.testing.assert_array_equal(one.state, three.state)
    assert one.metadata == three.metadata


def test_segment_without_a_component_looks_farther(flight, in_segments):
    """The elevation is missing throughout a segment and its margins: the neighbours' readings carry it through, and
    those behind it alone are not enough."""
    log = start_of(flight.log, 1800)
    log.measurement[300:1060, 2] = np.nan
    settings = FilterSettings(**GIVEN)
    whole = pipeline.filter_log(log, settings)
    in_segments(700, 300, 50)
    cut = pipeline.filter_log(log, settings)
    assert np.isfinite(cut.state).all()
    good = np.r_[0:250, 1160 : len(log)]
    away = np.abs(cut.state[good, :3] - whole.state[good, :3]) / whole.sigma[good, :3]
    assert np.median(away) < 0.3
    inside = (600, 900)
    assert inside in anti_outlier.segments(record(log))
    part = anti_outlier._segment(record(log), settings, None, inside)
    assert part.first < 300
    assert (part.estimate.run.since_start[part.low : part.high] > 0).all()


def test_specified_noise_is_taken(in_segments):
    in_segments(1500, 1000, 200)
    log = simulate("cruise", seed=0, duration_s=200.0, dt_s=0.1).log
    cut = pipeline.filter_log(log, FilterSettings(noise=(7.0, None, None), jerk_psd_m2ps5=5.0))
    settings = cut.metadata["settings"]
    assert settings["noise_range_m"] == pytest.approx(7.0)
    assert cut.metadata["summary"]["jerk_psd_m2ps5"]["median"] == pytest.approx(5.0)


def test_correlated_noise_is_found_for_all_segments(in_segments):
    flight = simulate("cruise", seed=0, duration_s=450.0, outliers="correlation=0.5")
    in_segments(1500, 1250, 200)
    cut = pipeline.filter_log(flight.log)
    assert cut.metadata["settings"]["noise_correlation"][0] == pytest.approx(np.exp(-0.2), abs=0.1)
    known = np.isin(flight.truth.time_s, flight.log.time_s)
    error = np.abs(cut.state[:, :3] - flight.truth.position_m[known]) / cut.sigma[:, :3]
    assert (error < 3).mean() > 0.97


@pytest.mark.parametrize(("length", "count"), [(1, 1), (499, 1), (740, 2), (1_400, 2), (1_510, 4), (5_100, 10)])
def test_segments_share_a_log_evenly(in_segments, length, count):
    """One after the other, from first sample to last, as near to their size as an even number can be; one at least."""
    in_segments(100, 500, 50)
    log = Recording(0.1 * np.arange(length), np.zeros((length, 3)), UNKNOWN)
    found = anti_outlier.segments(log)
    assert len(found) == count
    assert [low for low, _ in found] == [0, *(high for _, high in found[:-1])]
    assert found[-1][1] == length
    sizes = [high - low for low, high in found]
    assert max(sizes) - min(sizes) <= 1


def test_every_stretch_of_a_log_with_range_rates_has_their_labels(flight):
    """Also one in which the instrument measures none any more; a log of such stretches could not be written."""
    log = start_of(flight.log, 600)
    rate = np.where(np.arange(600) < 200, np.linspace(100, 50, 600), np.nan)
    parts = list(live.parts(replace(record(log), range_rate=rate), FilterSettings(editing="live"), 100))
    labels = [part.estimate.rows(part.low, part.high).range_rate.label for part in parts]
    assert (np.concatenate(labels)[-400:] == MISSING).all()


def test_rows_before_the_first_elevation_have_the_prior_of_any_target_live(flight):
    """They had an elevation of zero as if it were read, kilometres off."""
    log = start_of(flight.log, 600)
    log.measurement[:300, 2] = np.nan
    for block in (600, 100):
        parts = list(live.parts(record(log), FilterSettings(editing="live"), block))
        absent = np.concatenate([np.full(part.high - part.low, 2 in part.estimate.absent) for part in parts])
        assert absent[:300].all()
        assert not absent[330:].any()
    found = pipeline.filter_log(log, FilterSettings(editing="live"))
    cut = pipeline.filter_log(start_of(log, 250), FilterSettings(editing="live"))
    np.testing.assert_array_equal(found.state[:250], cut.state)  # a log that ends before knows no more
    assert (found.sigma[50:300, 2] == 6000).all()
    assert (found.sigma[350:, 2] < 1000).all()


@pytest.mark.parametrize("rows", [301, 305, 320])
def test_a_log_that_ends_with_the_first_elevations_has_a_summary_live(flight, rows):
    """No track is confirmed with them by then, so there was no process noise to tell of."""
    log = start_of(flight.log, rows)
    log.measurement[:300, 2] = np.nan
    found = pipeline.filter_log(log, FilterSettings(editing="live"))
    assert found.metadata["summary"]["jerk_psd_m2ps5"]["median"] > 0
    assert (found.sigma[50:300, 2] == 6000).all()
