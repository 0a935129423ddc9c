"""`make reproduce`: every claim that it marks, and the page itself."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.acceptance.reproduce import __main__ as reproduce
from tests.acceptance.reproduce import pressure, range_test
from tests.acceptance.reproduce.page import Page, table


@pytest.mark.parametrize(("claim", "here", "holds"), range_test.claims(), ids=lambda value: str(value)[:40])
def test_claims_of_the_range_test(claim, here, holds):
    assert holds, here


def test_an_outlier_smaller_than_the_grown_gate_is_let_in_at_the_sixth():
    """The limit that the page states: 4 sqrt(P + 6 Q + R), with P the steady variance."""
    p = range_test.P0
    for _ in range(50):
        s = p + range_test.Q + range_test.R
        p = (p + range_test.Q) * range_test.R / s
    limit = range_test.SIGMAS * np.sqrt(p + 6 * range_test.Q + range_test.R)
    for size, survives in ((limit + 0.08, True), (limit - 0.08, False)):
        z = range_test.readings(range(30, 36), by=np.full(2, -size))
        assert (range_test.worst(range_test.kalman(z, True)) < range_test.NEAR) == survives


#: What our experiment does not bear out, and the page says so.
NOT_BORNE_OUT = (
    "they drag it along for nearly 200 readings", "RKF is 74.5 % nearer to them than EKF",
    "and therefore the most accurate",
)  # fmt: skip


@pytest.mark.parametrize(("claim", "here", "holds"), pressure.claims(), ids=lambda value: str(value)[:40])
def test_claims_of_the_pressure_gauge(claim, here, holds):
    assert holds == (claim not in NOT_BORNE_OUT), here


def test_pressure_gauge_is_near_the_papers_numbers():
    """Whatever the noise: with outliers the numbers are the outliers', without them those of the gauge's noise."""
    found = pressure.filters()
    for index, paper in enumerate(pressure.PAPER["KF, outliers left in"]):
        assert found["KF, outliers left in"].figures()[index] == pytest.approx(paper, rel=0.02)
    assert pressure.broken().var(ddof=1) == pytest.approx(pressure.PAPER_VARIANCE[0], rel=0.02)
    assert found["KF, outliers repaired"].figures()[2] == pytest.approx(3.98, rel=0.25)
    assert found["RKF"].figures()[2] == pytest.approx(0.71, rel=0.6)
    assert found["RKF to the letter"].figures() == (0.0, 0.0, 0.0)
    assert pressure.fit(pressure.curve())[:3] == pytest.approx((pressure.MEAN, pressure.COSINE, pressure.SINE))
    assert pressure.clean()[0] == pressure.FIRST


def test_page_has_a_section_and_plots_for_each_experiment(tmp_path, capsys):
    assert list(reproduce.experiments())[:2] == ["zuo2021", "range_test"]
    reproduce.main(["range_test"], tmp_path)
    assert capsys.readouterr().out == f"-> {tmp_path / 'reproduce.md'}\n"
    text = (tmp_path / "reproduce.md").read_text()
    plots = re.findall(r"\]\((\w+\.png)\)", text)
    assert len(plots) == 3
    for plot in plots:
        assert (tmp_path / plot).read_bytes().startswith(b"\x89PNG")
    assert "| holds |" in text
    assert "**does not hold**" not in text


def test_an_experiment_leaves_the_other_sections_of_the_page(tmp_path, monkeypatch):
    class Quick:
        def __init__(self, text):
            self.section = lambda page: text

    monkeypatch.setattr(reproduce, "experiments", lambda: {"one": Quick("first"), "two": Quick("second")})
    reproduce.main([], tmp_path)
    monkeypatch.setattr(reproduce, "experiments", lambda: {"one": Quick("first"), "two": Quick("again")})
    reproduce.main(["two"], tmp_path)
    assert (tmp_path / "reproduce.md").read_text().endswith("first\nagain")


def test_unknown_experiment_is_a_sentence(tmp_path):
    with pytest.raises(SystemExit, match=r"^there is no experiment alchemy; there are zuo2021, range_test"):
        reproduce.main(["alchemy"], tmp_path)


def test_markdown_table():
    assert table(("a", "b"), [(1.23456, True), ("x", False)]) == (
        "| a | b |\n| --- | --- |\n| 1.235 | holds |\n| x | **does not hold** |\n"
    )


def test_page_directory_is_used(tmp_path):
    shown = Page(tmp_path).plot("one", "One", lambda axis: axis.plot([0, 1], label="line"))
    assert shown == "![One](one.png)\n\n*One*\n"
    assert (tmp_path / "one.png").exists()
