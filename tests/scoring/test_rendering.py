"""Scores as table, JSON and CSV."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pytest

from ftproc.errors import UsageError
from ftproc.scoring import render, score
from tests.simulated import flown, trajectory_for


def test_json_has_the_agreed_keys_and_no_nan() -> None:
    truth = flown(outliers="none")
    t = trajectory_for(truth, outlier=np.zeros((len(truth), 3), np.uint8))
    text = render([score(t, truth)], "json")
    assert "NaN" not in text
    found = json.loads(text)
    assert set(found["average_gradient"]) == {"range_m", "azimuth_rad", "elevation_rad"}
    assert found["outliers"]["range"]["precision"] is None  # nothing was flagged
    assert found["outliers"]["elevation"]["false_alarm_rate"] == 0.0
    for key in ("samples", "rmse_seed_m", "rmse_3d_m", "rmse_x_m", "rmse_y_m", "rmse_z_m", "rmse_v_mps",
                "rmse_vx_mps", "max_error_m", "p95_error_m", "p99_error_m", "in_3sigma", "nees_position"):  # fmt: skip
        assert isinstance(found[key], int | float), key


def test_json_of_several_is_a_list_in_the_order_given() -> None:
    truth = flown()
    names = ["b.csv", "a.csv", "c.csv"]
    scores = [score(trajectory_for(truth, name=name), truth) for name in names]
    assert [entry["trajectory"] for entry in json.loads(render(scores, "json"))] == names


def test_csv_has_one_line_each_and_full_digits() -> None:
    truth = flown(outliers="isolated=0.2")
    scores = [score(trajectory_for(truth, name="plain, no truth")), score(trajectory_for(truth), truth)]
    rows = list(csv.DictReader(io.StringIO(render(scores, "csv"))))
    assert [row["trajectory"] for row in rows] == ["plain, no truth", "flight.trajectory.parquet"]
    assert rows[0]["rmse_3d_m"] == rows[0]["outliers.range.recall"] == ""
    assert scores[1].rmse_3d_m is not None
    assert float(rows[1]["rmse_3d_m"]) == scores[1].rmse_3d_m
    assert float(rows[1]["average_gradient.azimuth_rad"]) == scores[1].average_gradient.azimuth_rad
    assert scores[1].outliers is not None
    assert float(rows[1]["outliers.range.recall"]) == scores[1].outliers["range"].recall


@pytest.mark.parametrize("count", [1, 2, 5, 9])
def test_table_fits_100_columns_and_keeps_the_order(count: int) -> None:
    truth = flown(outliers="isolated=0.2")
    names = [f"out/flight_{chr(107 - i)}.trajectory.parquet" for i in range(count)]
    text = render([score(trajectory_for(truth, i, name=name), truth) for i, name in enumerate(names)])
    assert text.endswith("\n")
    assert all(len(line) <= 100 and line == line.rstrip() for line in text.splitlines())
    assert "\n\n\n" not in text
    heads = [word for line in text.splitlines() for word in line.split() if word.startswith("flight_")]
    assert heads == [f"flight_{chr(107 - i)}" for i in range(count)]
    for label in ("position RMSE (m)", "average gradient A (rad)", "largest position error (m)", "recall", "F1"):
        assert label in text


def test_table_shows_the_value_under_its_trajectory() -> None:
    truth = flown()
    scores = [score(trajectory_for(truth, name="a.csv"), truth), score(trajectory_for(truth, name="b.csv"))]
    lines = {line[:26].strip(): line for line in render(scores).splitlines()}
    assert lines["position RMSE (m)"].split()[-1] == f"{scores[0].rmse_3d_m:.4g}"
    assert lines["samples"].split() == ["samples", "201", "201"]
    assert lines["velocity RMSE (m/s)"].split()[-1] == f"{scores[0].rmse_v_mps:.4g}"


def test_table_tells_same_named_files_apart_and_shortens_long_names() -> None:
    truth = flown()
    names = [f"{folder}/flight.csv" for folder in ("ukf", "ekf")] + ["x" * 200 + "/" + "y" * 60 + ".csv"]
    text = render([score(trajectory_for(truth, name=name)) for name in names])
    assert "ukf/flight.csv" in text
    assert "ekf/flight.csv" in text
    assert all(len(line) <= 100 for line in text.splitlines())
    assert "…" in text


def test_render_errors() -> None:
    one = score(trajectory_for(flown()))
    with pytest.raises(UsageError, match=r'There is no score format "xml"; choose one of table, json, csv\.'):
        render([one], "xml")
    with pytest.raises(UsageError, match=r"There is nothing to score; name at least one trajectory\."):
        render([], "table")
