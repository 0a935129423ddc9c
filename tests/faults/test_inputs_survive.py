"""No output of a run replaces one of its inputs, whatever names them, nor a file that no run has written."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from ftproc.batch import plan
from ftproc.report import index
from tests.faults import batches
from tests.faults.batches import PROGRAM
from tests.fusion.conftest import folder, simulated, written

__all__ = ["folder", "simulated", "written"]


def ran(place: Path, *command: str, **more: object) -> subprocess.CompletedProcess[str]:
    return batches.run(place, [PROGRAM, *command], **more)


def contents(place: Path) -> dict[str, str]:
    """Every file of a directory, and the place of every link."""
    found = {}
    for path in sorted(place.rglob("*")):
        name = str(path.relative_to(place))
        if path.is_symlink():
            found[name] = f"-> {path.readlink()}"
        elif path.is_file():
            found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def refused(place: Path, *command: str, stdout: object = subprocess.PIPE) -> str:
    """Run a command that must be refused before anything is computed: no file comes to be, none is changed."""
    before = contents(place)
    began = time.monotonic()
    done = subprocess.run([PROGRAM, *command], check=False, cwd=place, stdout=stdout, stderr=subprocess.PIPE, text=True)  # type: ignore[call-overload]
    assert done.returncode in (1, 2), (done.stdout, done.stderr)
    assert contents(place) == before
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert done.stderr.startswith("ftproc: ")
    assert "internal error" not in done.stderr
    assert time.monotonic() - began < 30
    return str(done.stderr)


def log_of_radar(place: Path, name: str, text: str = "") -> None:
    """The radar's log moves to another name in the range file, as what it is or with another text."""
    target = place / name
    target.parent.mkdir(parents=True, exist_ok=True)
    if name.endswith(".parquet"):
        import pandas as pd

        pd.read_csv(place / "radar.csv").to_parquet(target)
        (place / "radar.csv").unlink()
    else:
        (place / "radar.csv").rename(target)
    path = place / "range.toml"
    path.write_text(path.read_text().replace('log = "radar.csv"', f'log = "{text or name}"'))


@pytest.mark.parametrize("output", ["best.parquet", "./best.csv", "best.kml"])
def test_the_biases_spare_a_log_of_their_name(folder: Path, output: str) -> None:
    log_of_radar(folder, "best.biases.csv")
    said = refused(folder, "filter", "--fuse", "range.toml", "-o", output)
    assert "best.biases.csv: this is the input best.biases.csv, which is never overwritten. Give another name" in said


@pytest.mark.parametrize("link", [False, True])
def test_the_edited_logs_spare_a_log_among_them(folder: Path, link: bool) -> None:
    log_of_radar(folder, "best.edited/radar.parquet")
    if link:
        (folder / "range.toml").write_text((folder / "range.toml").read_text().replace("best.edited", "other"))
        (folder / "other").symlink_to("best.edited")
    said = refused(folder, "filter", "--fuse", "range.toml", "-o", "best.parquet")
    assert "best.edited/radar.parquet: this is the input " in said


@pytest.mark.parametrize("case", ["config", "range", "log", "hard link", "symbolic link"])
def test_the_calibration_spares_all_that_is_read(folder: Path, case: str) -> None:
    text = (folder / "range.toml").read_text()
    (folder / "radar.toml").write_text('[azimuth]\nfrom = "x"\n')
    (folder / "mine.toml").write_text('[azimuth]\nfrom = "x"\n')
    name = "range.toml"
    if case == "config":
        (folder / name).write_text(text.replace('log = "radar.csv"', 'log = "radar.csv"\nconfig = "radar.toml"'))
    elif case == "range":
        (folder / "radar.toml").unlink()
        (folder / name).rename(folder / "radar.toml")
        name = "radar.toml"
    elif case == "log":
        (folder / "radar.toml").unlink()
        log_of_radar(folder, "radar.toml")
    else:
        (folder / "radar.toml").unlink()
        make = Path.hardlink_to if case == "hard link" else Path.symlink_to
        make(folder / "radar.toml", folder / "mine.toml")
        (folder / name).write_text(text.replace('log = "radar.csv"', 'log = "radar.csv"\nconfig = "mine.toml"'))
    said = refused(folder, "filter", "--fuse", name, "-o", "best.parquet", "--write-calibration", ".")
    assert "radar.toml: this is the input " in said
    assert "which is never overwritten. Give another name with --write-calibration." in said


def test_a_second_calibration_replaces_the_first_but_no_file_of_the_user(folder: Path) -> None:
    command = ("filter", "--fuse", "range.toml", "-o", "best.parquet", "--write-calibration", "next")
    for _ in range(2):
        assert ran(folder, *command).returncode == 0
    (folder / "next" / "radar.toml").write_text("mine = 1\n")
    assert "next/radar.toml: this file would be replaced, and is none that an earlier run" in refused(folder, *command)
    (folder / "next" / "radar.toml").unlink()
    (folder / "best.biases.csv").write_text("mine,1\n")
    assert "best.biases.csv: this file would be replaced" in refused(folder, *command)


@pytest.mark.parametrize("to", ["elsewhere", "nothing", "loop"])
def test_the_directory_of_edited_logs_is_no_link(folder: Path, to: str) -> None:
    (folder / "elsewhere").mkdir()
    (folder / "best.edited").symlink_to({"loop": "best.edited"}.get(to, to))
    said = refused(folder, "filter", "--fuse", "range.toml", "-o", "best.parquet")
    assert (
        "best.edited: this is a symbolic link, and the edited logs go into a directory of that name. Delete it" in said
    )


@pytest.mark.parametrize("kind", ["file", "link", "fifo"])
def test_what_stands_where_an_edited_log_goes(folder: Path, kind: str) -> None:
    (folder / "best.edited").mkdir()
    place = folder / "best.edited" / "radar.parquet"
    (folder / "mine.parquet").write_bytes(b"PAR1 mine")
    if kind == "file":
        place.write_bytes(b"mine")
    elif kind == "link":
        place.symlink_to("../mine.parquet")
    else:
        os.mkfifo(place)
    assert "best.edited/radar.parquet: this " in refused(folder, "filter", "--fuse", "range.toml", "-o", "best.parquet")


def test_a_name_that_no_file_can_have_is_found_first(folder: Path) -> None:
    text = (folder / "range.toml").read_text()
    (folder / "range.toml").write_text(text.replace("[station.radar]", f"[station.{'r' * 300}]"))
    said = refused(folder, "filter", "--fuse", "range.toml", "-o", "best.parquet")
    assert "r.parquet: the name is too long for the file system; give a shorter one." in said
    assert not (folder / "best.edited").exists()


@pytest.mark.parametrize("again", ["radar.csv", "./radar.csv", "hard.csv", "soft.csv", "radar.csv#x", "hard.csv#y"])
def test_the_same_log_twice_in_a_range_file(folder: Path, again: str) -> None:
    (folder / "hard.csv").hardlink_to(folder / "radar.csv")
    (folder / "soft.csv").symlink_to("radar.csv")
    path = folder / "range.toml"
    other = next(each for each in path.read_text().split('log = "')[1:] if not each.startswith("radar")).partition('"')[
        0
    ]
    path.write_text(path.read_text().replace(f'log = "{other}"', f'log = "{again}"'))
    assert "have the same log, " in refused(folder, "filter", "--fuse", "range.toml", "-o", "best.parquet")


@pytest.mark.parametrize(
    "uri", ["local://{0}/a.csv", "file://{0}/a.csv", "local://{0}/./a.csv", "LOCAL://{0}/hard.csv"]
)
def test_a_uri_of_the_log(tmp_path: Path, uri: str) -> None:
    batches.fill(tmp_path, 1)
    (tmp_path / "0.csv").rename(tmp_path / "a.csv")
    (tmp_path / "hard.csv").hardlink_to(tmp_path / "a.csv")
    name = uri.format(tmp_path)
    assert "this is the input a.csv, which is never overwritten" in refused(tmp_path, "filter", "a.csv", "-o", name)
    assert "never overwritten" in refused(tmp_path, "filter", name, "-o", "a.csv")
    assert "never overwritten" in refused(tmp_path, "filter", f"{name}#part", "-o", "a.csv")


def test_an_archive_that_holds_the_log(tmp_path: Path) -> None:
    batches.fill(tmp_path, 1)
    shutil.make_archive(str(tmp_path / "a"), "zip", tmp_path, "0.csv")
    (tmp_path / "a.zip").rename(tmp_path / "a.csv")
    said = refused(tmp_path, "filter", f"zip://0.csv::{tmp_path}/a.csv", "-o", "a.csv")
    assert "a.csv: this is the input zip://0.csv::" in said


def test_standard_streams_are_files_too(tmp_path: Path) -> None:
    batches.fill(tmp_path, 1)
    with (tmp_path / "0.csv").open("ab") as log:
        for output in ("-", "out.csv"):
            said = refused(tmp_path, "filter", "0.csv", "-o", output, stdout=log)
            assert "standard output is the input 0.csv, which is never overwritten. Send it elsewhere." in said
    before = contents(tmp_path)
    with (tmp_path / "0.csv").open("rb") as log:
        done = ran(tmp_path, "filter", "-", "-o", "0.csv", stdin=log)
    assert "0.csv: this is the input -, which is never overwritten" in done.stderr
    assert contents(tmp_path) == before


@pytest.mark.parametrize("target", ["nothing.json", "mine.json", "/dev/null"])
def test_a_sidecar_goes_through_no_link(tmp_path: Path, target: str) -> None:
    batches.fill(tmp_path, 1)
    (tmp_path / "mine.json").write_text("{}")
    (tmp_path / "out.json").symlink_to(target)
    for name in ("out.csv", "out.csv.gz"):
        said = refused(tmp_path, "filter", "0.csv", "-o", name)
        assert "out.json: this is a symbolic link, and a file would be written through it. Move it, or give" in said


def test_an_index_replaces_only_an_index(tmp_path: Path) -> None:
    batches.fill(tmp_path, 2)
    (tmp_path / "pages").mkdir()
    page = tmp_path / "pages" / "index.html"
    command = ("filter", "0.csv", "1.csv", "-o", "out/", "--report", "pages/")
    page.write_text("<!DOCTYPE html>\n<title>My home</title>")
    assert "pages/index.html: this file would be replaced" in refused(tmp_path, *command)
    index.write([], page)
    assert all(part in page.read_bytes() for part in plan.INDEX_BEGINS)
    assert ran(tmp_path, *command).returncode == 0


@pytest.mark.parametrize("truth", ["flight.csv", "./flight.csv", "link.csv"])
def test_two_outputs_are_two_files(tmp_path: Path, truth: str) -> None:
    (tmp_path / "flight.csv").write_text("")
    (tmp_path / "link.csv").symlink_to("flight.csv")
    command = ("simulate", "--scenario", "zuo2021", "-o", "flight.csv", "--truth", truth)
    assert "-o and --truth are both " in refused(tmp_path, *command)


def test_a_simulated_range_and_its_truth_are_several_files(tmp_path: Path) -> None:
    command = ("simulate", "--scenario", "range-radar", "-o", "flight/", "--truth", "flight/radar.csv")
    (tmp_path / "flight").mkdir()
    assert "-o and --truth are both flight/radar.csv" in refused(tmp_path, *command)


def test_a_summary_is_not_sent_to_the_trajectory(tmp_path: Path) -> None:
    batches.fill(tmp_path, 1)
    with (tmp_path / "out.csv").open("wb") as stream:
        said = refused(tmp_path, "filter", "0.csv", "-o", "out.csv", stdout=stream)
    assert "-o and standard output are both out.csv; give one another name." in said


def test_outputs_of_one_content_may_be_linked(tmp_path: Path) -> None:
    """As programs that save room do."""
    batches.fill(tmp_path, 2)
    command = ("filter", "0.csv", "1.csv", "-o", "out/", "--redo")
    assert ran(tmp_path, *command).returncode == 0
    (tmp_path / "out" / "1.trajectory.csv").unlink()
    (tmp_path / "out" / "1.trajectory.csv").hardlink_to(tmp_path / "out" / "0.trajectory.csv")
    assert ran(tmp_path, *command).returncode == 0
    assert not (tmp_path / "out" / "0.trajectory.csv").samefile(tmp_path / "out" / "1.trajectory.csv")


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        pytest.param(kind, name, marks=[] if (kind == "soft") == (name == "out.json") else pytest.mark.slow)
        for kind in ("hard", "soft", "moved")
        for name in ("out.csv", "out.json")
    ],
)
def test_an_output_that_comes_to_name_the_log(tmp_path: Path, name: str, kind: str) -> None:
    """While the log is followed."""
    batches.fill(tmp_path, 1)
    log = tmp_path / "0.csv"
    before = log.read_bytes()
    command = [PROGRAM, "filter", "0.csv", "--follow", "-o", "out.csv"]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as process:
        try:
            time.sleep(2.5)
            target = tmp_path / name
            target.unlink(missing_ok=True)
            if kind == "hard":
                target.hardlink_to(log)
            elif kind == "soft":
                target.symlink_to(log.name)
            else:
                log.rename(target)
            time.sleep(0.3)
            process.terminate()
            err = process.communicate(timeout=60)[1]
        finally:
            process.kill()
    where = tmp_path / name if kind == "moved" else log
    assert where.read_bytes() == before
    assert "Traceback" not in err
    assert process.returncode == (0 if kind == "soft" and name == "out.json" else 1), err
    assert (tmp_path / "out.csv").is_file()  # it grows
