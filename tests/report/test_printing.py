"""A report as a PDF: printed by the browser that is there, or one sentence that says what to do."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest

from ftproc import report
from ftproc.errors import OutputError, UsageError
from ftproc.report.browser import printing
from tests.cli.conftest import flight, here, run
from tests.report import flights
from tests.report.browser import NEEDED
from tests.report.flights import filtered, hostile

__all__ = ["flight", "here", "run"]

GOOD = b"%PDF-1.4\nwhatever\n%%EOF\n"
CURE = "end the name in .html, open the page in a browser, and print it there."


@pytest.fixture
def browser(tmp_path, monkeypatch):
    """browser("shell commands"): the only one on the PATH, a script; `$pdf` is what it shall write."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", f"{folder}:/usr/bin:/bin")
    monkeypatch.setattr(printing, "BROWSERS", ("no-such-browser", "acme-browser"))

    def made(commands):
        script = folder / "acme-browser"
        find = 'for a in "$@"; do case "$a" in --print-to-pdf=*) pdf="${a#*=}";; esac; page="${a#file://}"; done'
        script.write_text(f"#!/bin/sh\n{find}\n{commands}\n")
        script.chmod(0o755)

    return made


@pytest.fixture
def scratch(tmp_path, monkeypatch):
    """Where temporary files go."""
    folder = tmp_path / "scratch"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    return folder


@NEEDED
def test_the_page_is_printed(tmp_path, scratch):
    target = tmp_path / "flight.pdf"
    report.write(filtered(), target, flights.flight().truth)
    data = target.read_bytes()
    pages = re.findall(rb"/MediaBox\s*\[\s*0 0 ([\d.]+) ([\d.]+)\s*\]", data)
    assert 4 <= len(pages) <= 10
    for width, height in pages:
        assert (float(width), float(height)) == pytest.approx((595, 842), abs=1)  # A4
    name = Path(filtered().metadata["log"]).name
    assert re.findall(rb"/Title\s*\((.*?)\)", data)[0] == name.encode()
    assert b"file:" not in data
    assert str(tmp_path).encode() not in data
    assert list(scratch.iterdir()) == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ["flight.pdf", "scratch"]


@NEEDED
@pytest.mark.slow
def test_hostile_names_are_printed(tmp_path):
    report.write(hostile(), tmp_path / "flight.pdf")
    assert (tmp_path / "flight.pdf").read_bytes().startswith(b"%PDF-")


def test_the_page_goes_to_the_browser_and_its_pdf_to_the_target(browser, tmp_path, scratch):
    keep = f'cp "$page" {tmp_path}/seen.html; printf "%s" "$*" > {tmp_path}/options'
    browser(f'{keep}; printf "%s" "{GOOD.decode()}" > "$pdf"')
    printing.write('<!DOCTYPE html>\n<html lang="en">\n<head></head>é', tmp_path / "Flight.PDF")
    assert (tmp_path / "Flight.PDF").read_bytes() == GOOD
    seen = (tmp_path / "seen.html").read_text(encoding="utf-8")
    assert 'data-paper="A4"' in seen
    assert "size: A4" in seen
    assert seen.endswith("é")
    options = (tmp_path / "options").read_text()
    assert "--headless" in options
    assert f"--user-data-dir={scratch}" in options
    assert list(scratch.iterdir()) == []


@pytest.mark.parametrize(
    ("commands", "why"),
    [
        ("exit 3", "exit code 3"),
        ("exit 0", "it wrote no PDF"),
        ('echo "not a PDF" > "$pdf"', "it wrote no PDF"),
        ('printf "%%PDF-1.4 cut off" > "$pdf"', "it wrote no PDF"),
        ("echo 'FATAL: No usable sandbox! Update your kernel' >&2; exit 1", "it has no usable sandbox here"),
        ("kill -9 $$", "exit code -9"),
    ],
)
def test_a_browser_that_fails_leaves_the_earlier_file(browser, tmp_path, scratch, commands, why):
    browser(commands)
    target = tmp_path / "flight.pdf"
    target.write_bytes(b"earlier")
    with pytest.raises(OutputError) as caught:
        printing.write("<html>", target)
    assert str(caught.value) == f"{target}: acme-browser did not print the page ({why}); {CURE}"
    assert target.read_bytes() == b"earlier"
    assert list(scratch.iterdir()) == []


def test_a_browser_that_hangs_is_ended_with_all_that_it_started(browser, tmp_path, monkeypatch):
    monkeypatch.setattr(printing, "PATIENCE_S", 0.5)
    browser(f"(sleep 2.5; touch {tmp_path}/survived) & sleep 60")
    with pytest.raises(OutputError, match=r"acme-browser did not print the page \(it took more than 0.5 s\)"):
        printing.write("<html>", tmp_path / "flight.pdf")
    time.sleep(3)
    assert not (tmp_path / "survived").exists()


def test_a_browser_that_cannot_be_started(browser, tmp_path):
    browser("")
    (tmp_path / "bin" / "acme-browser").write_text("#!/no/such/interpreter\n")
    with pytest.raises(OutputError, match="it cannot be started: no such file or directory"):
        printing.write("<html>", tmp_path / "flight.pdf")


def test_a_directory_of_such_a_name_is_no_pdf(tmp_path):
    (tmp_path / "pages.pdf").mkdir()
    assert not printing.is_pdf(tmp_path / "pages.pdf")
    assert printing.is_pdf("s3://bucket/flight.PDF")
    assert not printing.is_pdf("flight.pdf.html")


def test_without_a_browser_nothing_is_started(run, flight, monkeypatch):
    empty = flight.parent / "empty"
    empty.mkdir()
    monkeypatch.setenv("PATH", str(empty))
    before = sorted(flight.parent.iterdir())
    sentence = (
        "ftproc: page.pdf: a PDF is printed by Chromium, Google Chrome or Microsoft Edge, and none of them is on the "
        "PATH; install one (Debian: apt-get install chromium), or end the name in .html.\n"
    )
    for command in (["filter", flight], ["score", "flight.truth.csv"]):
        result = run(*command, "--report", "page.pdf")
        assert (result.code, result.out, result.err) == (2, "", sentence)
    assert sorted(flight.parent.iterdir()) == before
    with pytest.raises(UsageError, match=r"none of them is on the PATH"):
        report.write(filtered(), "page.pdf")


def test_a_pdf_that_cannot_be_printed_leaves_the_trajectory(run, flight, browser):
    browser("exit 1")
    result = run("filter", flight, "--report", "page.pdf")
    assert result.code == 1
    assert result.err == f"ftproc: page.pdf: acme-browser did not print the page (exit code 1); {CURE}\n"
    assert (flight.parent / "flight.trajectory.csv").exists()
    assert not (flight.parent / "page.pdf").exists()


def test_filter_and_score_print(run, flight, browser):
    browser(f'printf "%s" "{GOOD.decode()}" > "$pdf"')
    result = run("filter", flight, "--report", "page.pdf")
    assert (result.code, result.err) == (0, "")
    assert result.out.endswith("\n  -> flight.trajectory.csv\n  -> page.pdf\n")
    assert run("score", "flight.trajectory.csv", "--truth", "flight.truth.csv", "--report", "score.pdf").code == 0
    for name in ("page.pdf", "score.pdf"):
        assert (flight.parent / name).read_bytes() == GOOD
