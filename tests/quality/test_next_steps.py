"""What is said of what to do next, and whether it helps: each first step that the program tries is run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from ftproc import pipeline
from ftproc.batch import trying
from ftproc.core.editing import two_pass
from ftproc.files.reading import logs
from ftproc.long_records import joined
from ftproc.quality import next_steps, summary
from ftproc.quality.verdict import LEVELS
from ftproc.records import MeasurementLog
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate
from ftproc.simulation.simulation import Simulation
from tests.trust import next_steps as table_of_steps

SMOOTH = FilterSettings(smooth=True)


def flight(seed: int, outliers: str | None = None, duration_s: float = 60) -> Simulation:
    return simulate("manoeuvre", seed=seed, dt_s=0.1, duration_s=duration_s, outliers=outliers)


def found(log: MeasurementLog, settings: FilterSettings) -> tuple[pipeline.Filtering, np.ndarray]:
    filtering = pipeline.Filtering(log, settings, None)
    return filtering, joined(list(filtering.parts())).state[:, :3]


def level(filtering: pipeline.Filtering) -> int:
    return LEVELS.index(filtering.metadata["summary"]["trust"]["verdict"])


def first_step(filtering: pipeline.Filtering) -> tuple[next_steps.Step, dict]:
    """The first of the steps after trying, as it was tried, and as it is said."""
    said = trying.steps(filtering, filtering.metadata["summary"], lambda changed: f"ftproc filter LOG {changed}")[0]
    return next(step for step in filtering.next_steps if step.advice == said["advice"]), said


#: What was specified that does not hold -> the advice.
TOLD = {
    "noise too small": (8, replace(SMOOTH, noise=(0.5, 2e-5, 2e-5)), "leave --noise out"),
    "jerk too small": (8, replace(SMOOTH, jerk_psd_m2ps5=1e-4), "leave --jerk out"),
    "jerk too large": (8, replace(SMOOTH, jerk_psd_m2ps5=1e7), "leave --jerk out"),
    "gate too small": (9, replace(SMOOTH, gate=1.5), "leave --gate out"),
    "no editing": (10, replace(SMOOTH, editing="none"), "leave --editing out"),
    "no editor": (14, replace(SMOOTH, method="ukf"), "leave --method out"),
    "weights alone": (15, replace(SMOOTH, method="huber-ukf"), "leave --method out"),
    "channels alone": (14, FilterSettings(method="gate"), "leave --method out"),
    "two of them": (7, replace(SMOOTH, noise=(0.5, 2e-5, 2e-5), gate=2.0), "leave --noise and --gate out"),
    "recursive": (12, FilterSettings(editing="forward"), "leave --editing out"),
}


DEAR = "two of them", "jerk too large"


@pytest.mark.parametrize(
    "case", [pytest.param(case, marks=pytest.mark.slow) if case in DEAR else case for case in TOLD]
)
def test_what_was_specified_and_does_not_hold_is_left_out_first(case: str) -> None:
    """The step makes the errors smaller, and the verdict no worse."""
    seed, settings, advice = TOLD[case]
    patches = "patch=4:10-40:30-200" if case in ("weights alone", "recursive") else None
    this = flight(seed, patches, 60 if settings.noise is None else 30)  # what seems an outlier takes its time
    before, state = found(this.log, settings)
    assert level(before) > 0
    step, said = first_step(before)
    assert step.advice == said["advice"]
    assert said["advice"] == advice or (case == "recursive" and said["advice"] == "add --smooth, without --editing")
    assert step.settings is not None
    after, better = found(this.log, step.settings)
    assert level(after) <= level(before)
    assert said["outcome"] in (None, LEVELS[level(after)])
    known = np.isfinite(state).all(1)
    errors = [float(np.sqrt(((each - this.truth.position_m) ** 2).sum(1)[known].mean())) for each in (state, better)]
    assert errors[1] < 0.9 * errors[0]


def test_the_engineer_is_asked_where_only_he_knows() -> None:
    """Two tracks: the place, and a command that writes what was decided."""
    filtering, _ = found(flight(3, "all.offset=3:30-50:40-400,isolated=0.01").log, SMOOTH)
    step, said = first_step(filtering)
    assert step.options == {"write_decisions": ("--write-decisions", "decisions.csv")}
    if intervals := filtering.metadata["summary"]["poorly_observable"]:
        worst = max(intervals, key=lambda each: each["sigma_m"])
        assert said["place"] == f"{worst['from_s']:.6g} to {worst['to_s']:.6g} s"


def test_a_step_that_stays_needs_another_station() -> None:
    log = simulate("manoeuvre-clean", seed=16, dt_s=0.1, duration_s=60).log
    log.measurement[350:, 0] += 60.0
    _, said = first_step(found(log, SMOOTH)[0])
    assert said["command"].startswith("ftproc filter --fuse --write-config ")
    assert said["place"] == "35 s"


def test_a_clock_that_was_set_back_names_its_rows() -> None:
    log = simulate("cruise", seed=3, duration_s=60.0, outliers="none").log
    names = ("range_m", "azimuth_rad", "elevation_rad")
    table = pd.DataFrame({"time_s": log.time_s, **dict(zip(names, log.measurement.T, strict=True))})
    table.loc[300:, "time_s"] -= 5.0
    filtering, _ = found(logs.read(table), SMOOTH)
    _, said = first_step(filtering)
    assert "all,300,600,bad" in said["advice"]


def test_of_a_clock_that_was_set_back_the_side_with_fewer_rows_is_left_out() -> None:
    s = {"clock_set_back": {"row": 100, "by_s": -5.0}, "rows_in_file": 601}
    (step,) = next_steps._clock(s)
    assert "all,0,99,bad" in step.advice


def test_another_convention_that_was_remarked_on_comes_first() -> None:
    """Zenith angles under a name that does not say so."""
    log = flight(21, "isolated=0.4:6-60").log
    table = pd.DataFrame({"time_s": log.time_s, "range_m": log.measurement[:, 0], "azimuth_rad": log.measurement[:, 1]})
    table["elevation_rad"] = np.pi / 2 - log.measurement[:, 2]
    filtering, _ = found(logs.read(table), SMOOTH)
    assert level(filtering) > 0
    step, said = first_step(filtering)
    assert step.options == {"elevation_from": ("--elevation-from", "zenith")}
    assert said["advice"] == "add --elevation-from zenith, if they are zenith angles"


def test_what_one_log_lacks_another_station_has() -> None:
    done = table_of_steps.outcome("13 readings")
    assert done.step.startswith("fuse with the log of another station")
    assert done.helps
    assert not done.deceives


def test_noise_that_looks_like_motion_is_not_made_consistent_by_giving_it() -> None:
    """It would be white, and the run consistent with an estimate far outside its sigmas."""
    flown, settings = table_of_steps.CASES["noise correlated over seconds"]()
    filtering, _ = found(flown.log, settings)
    assert filtering.metadata["summary"]["slow_noise_s"] > 0
    assert not [step for step in filtering.next_steps if "noise" in step.options]
    assert first_step(filtering)[0].reason.startswith("noise that is correlated so long")


def test_nothing_is_said_of_a_consistent_run_and_nothing_tried_in_a_long_log(monkeypatch: pytest.MonkeyPatch) -> None:
    filtering, _ = found(flight(5).log, SMOOTH)
    assert filtering.next_steps == []
    monkeypatch.setattr(trying, "MOST_ROWS", 100)
    bad, _ = found(flight(6).log, replace(SMOOTH, jerk_psd_m2ps5=1e-4))
    assert {each["outcome"] for each in trying.steps(bad, bad.metadata["summary"], str)} == {None}


def test_a_log_is_edited_once_to_be_smoothed_too(monkeypatch: pytest.MonkeyPatch) -> None:
    edited, edit = list[int](), two_pass.edit

    def counted(time_s: np.ndarray, *of: object) -> two_pass.Edited:
        edited.append(len(time_s))
        return edit(time_s, *of)  # type: ignore[arg-type]

    monkeypatch.setattr(two_pass, "edit", counted)
    log = flight(12, "isolated=0.4:20-300").log
    filtering, _ = found(log, FilterSettings())
    steps = [step for step in filtering.next_steps if step.settings is not None]
    assert [step.advice for step in steps] == ["add --smooth"]
    after = pipeline.Filtering(log, replace(steps[0].settings), None, filtering)
    again = joined(list(after.parts()))
    assert len(edited) == 1
    fresh, state = found(log, SMOOTH)
    np.testing.assert_array_equal(again.state[:, :3], state)
    assert after.metadata["summary"] == fresh.metadata["summary"]
    assert pipeline.Filtering(log, replace(SMOOTH, gate=5.0), None, filtering).record.edited is None


def test_what_would_be_better_is_what_the_smoother_publishes() -> None:
    this = simulate("manoeuvre", seed=3)
    here, smooth = (pipeline.filter_log(this.log, FilterSettings(smooth=on)) for on in (False, True))
    s = here.metadata["summary"]
    for trajectory, name in ((here, "median_sigma_m"), (smooth, "median_sigma_smoothed_m")):
        assert s[name] == pytest.approx(
            np.median(np.sqrt((trajectory.sigma[:, :3] ** 2).sum(1))), rel=0.07
        )  # which then allows for unseen motion
    last = summary.text(here.metadata).splitlines()[-1]
    assert last.startswith(f"  better     1 sigma of {s['median_sigma_smoothed_m']:.3g} m, not ")
    assert "better" not in summary.text(smooth.metadata)


@pytest.mark.parametrize("settings", [FilterSettings(), SMOOTH, replace(SMOOTH, jerk_psd_m2ps5=1e-4)])
def test_figures_that_nobody_can_use_are_not_in_the_text(settings: FilterSettings) -> None:
    text = summary.text(pipeline.filter_log(flight(5).log, settings).metadata)
    assert "NIS" not in text
    assert "network" not in text
