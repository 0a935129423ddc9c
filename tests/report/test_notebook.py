"""A trajectory in a notebook."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np

import ftproc
from ftproc.report import notebook
from tests.report.flights import HOSTILE, angles_only, filtered, flight, hostile, position_only


def test_it_shows_the_summary_and_its_track():
    text = filtered()._repr_html_()
    assert "verdict    consistent" in text
    root = ElementTree.fromstring(text)
    path = root.find(".//path").attrib["d"]
    assert path.startswith("M")
    points = np.array([pair[1:].split(",") for pair in path.split()], float)
    assert len(points) > 100
    assert (points >= 0).all()
    assert (points[:, 0] <= notebook.WIDTH).all()
    assert (points[:, 1] <= notebook.HEIGHT).all()
    assert len(text) < 20_000


def test_scales_are_equal_and_up_is_up():
    path = ElementTree.fromstring(notebook.picture(filtered())).find(".//path").attrib["d"]
    points = np.array([pair[1:].split(",") for pair in path.split()], float)
    shape = np.ptp(points, axis=0) / np.ptp(filtered().state[:, :2], axis=0)
    np.testing.assert_allclose(shape[0], shape[1], rtol=0.01)
    rising = np.corrcoef(points[[0, -1], 1], filtered().state[[0, -1], 1])[0, 1]
    assert rising < 0  # y of SVG points down


def test_without_positions_or_metadata_there_is_still_something():
    assert "<svg" not in angles_only()._repr_html_()
    assert "rows" in position_only()._repr_html_()


def test_names_from_files_are_escaped():
    assert HOSTILE not in hostile()._repr_html_()


def test_a_track_with_a_hole_is_broken():
    state = filtered().state.copy()
    state[200:300] = np.nan
    assert notebook.picture(replace(filtered(), state=state)).count("M") == notebook.picture(filtered()).count("M") + 1


def test_one_line_reprs():
    for record in (
        flight().log,
        flight().truth,
        filtered(),
        filtered().diagnostics,
        ftproc.score(filtered(), flight().truth),
    ):
        assert "\n" not in repr(record)
        assert len(repr(record)) < 160
    assert repr(filtered()).endswith("rows, 40 s, filtered by ga-bpnn-ukf, consistent>".replace("rows", "rows"))
    assert "position RMSE" in repr(ftproc.score(filtered(), flight().truth))


def test_tables_of_a_trajectory():
    assert filtered().to_pandas().columns.tolist() == ftproc.to_table(filtered()).column_names
    assert filtered().to_table().num_rows == len(filtered())
