"""Where `ftproc filter` writes, and what it never writes over."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from ftproc.batch import plan
from ftproc.errors import OutputError, UsageError
from ftproc.files.writing import outputs

WRITTEN = ".trajectory"


def wanted(*logs: str) -> list[plan.Wanted]:
    return [plan.Wanted(log) for log in logs]


def where(*logs: str, output: str | None = None) -> list[str]:
    return [task.output for task in plan.tasks(wanted(*logs), output)]


def prepare(log: str, output: str) -> None:
    """As `filter` does before it reads a log."""
    outputs.check(plan.written(plan.tasks(wanted(log), output), output, None), [log])


@pytest.mark.parametrize(
    ("log", "output", "expected"),
    [
        ("in/a.csv", None, "a.trajectory.csv"),
        ("in/a.csv.gz", None, "a.trajectory.csv"),
        ("in/a.b.parquet", None, "a.b.trajectory.parquet"),
        ("in/A.CSV", None, "A.trajectory.csv"),
        ("-", None, "-"),
        ("-", "-", "-"),
        ("-", "b.parquet", "b.parquet"),
        ("in/a.csv", "b.csv.gz", "b.csv.gz"),
        ("in/a.csv", "there", "there/a.trajectory.csv"),
        ("in/a.csv", "there.csv", "there.csv/a.trajectory.csv"),
        ("in/a.csv", "new", "new/a.trajectory.csv"),
        ("in/a.csv", "new/deep", "new/deep/a.trajectory.csv"),
        ("in/a.csv", "v1.2/", "v1.2/a.trajectory.csv"),
        ("-", "new", "new/stdin.trajectory.csv"),
    ],
)
def test_one_log(here, log, output, expected):
    (here / "there").mkdir()
    (here / "there.csv").mkdir()
    assert where(log, output=output) == [expected]
    outputs.check(plan.written(plan.tasks(wanted(log), output), output, None), [log])
    assert Path(expected).parent.is_dir()


def test_several_logs(here):
    assert where("a.csv", "b/c.parquet", output="new") == ["new/a.trajectory.csv", "new/c.trajectory.parquet"]
    assert where("a.csv", "b.csv") == ["a.trajectory.csv", "b.trajectory.csv"]
    parts = [plan.Wanted("a.csv", parts=(part, "ukf")) for part in ("7", "8 b")]
    assert [t.output for t in plan.tasks(parts, "d")] == ["d/a.7.ukf.trajectory.csv", "d/a.8_b.ukf.trajectory.csv"]


@pytest.mark.parametrize(
    ("logs", "output", "sentence"),
    [
        (["a.csv", "b.csv"], "c.csv", "-o c.csv: there are several trajectories to write; name a directory"),
        (["a.csv", "b.csv"], "-", "-o -: there are several"),
        (["a.csv", "b.csv"], "d/*", "-o d/*: end the name in .csv,"),
        (["a.csv", "-"], "d", "- stands for one log on standard input"),
        (
            ["a.csv"],
            "c.xlsx",
            ".csv, .csv.gz, .parquet, .feather, .kml, .geojson, .czml, or in / if",
        ),
        (["x/a.csv", "y/a.csv"], "d", "x/a.csv and y/a.csv would both be written to d/a.trajectory.csv"),
        (["a.csv", "a.csv"], None, "a.csv and a.csv would both be written to a.trajectory.csv"),
    ],
)
def test_wrong_usage(here, logs, output, sentence):
    with pytest.raises(UsageError, match=r".*") as caught:
        plan.tasks(wanted(*logs), output)
    assert sentence in str(caught.value)
    assert list(here.iterdir()) == []


def test_all_methods_need_a_directory(run, flight):
    for output in ((), ("-o", "a.csv"), ("-o", "-")):
        result = run("filter", flight, "--method", "all", *output)
        assert result.code == 2
        assert "name a directory" in result.err


def test_a_place_that_cannot_be(here):
    (here / "file").write_text("")
    for output, sentence in {
        "file": "file: this is a file, not a directory",
        "file/deeper": "file/deeper: the directory cannot be made \\(not a directory\\)",
        "none/a.csv": "none/a.csv: there is no directory none; create it first",
    }.items():
        with pytest.raises(OutputError, match=sentence):
            prepare("log.csv", output)


@pytest.mark.parametrize("output", ["flight.csv", "./flight.csv", "symbolic.csv", "hard.csv"])
def test_never_writes_over_an_input(run, flight, output):
    Path("symbolic.csv").symlink_to("flight.csv")
    Path("hard.csv").hardlink_to(flight)
    before = flight.read_bytes()
    result = run("filter", "flight.csv", "-o", output)
    assert (result.code, result.out) == (1, "")
    assert "this is the input flight.csv, which is never overwritten" in result.err
    assert flight.read_bytes() == before


def test_never_writes_over_another_log_or_the_model(run, flight):
    shutil.copy(flight, "clean-x.csv")
    shutil.copy(flight, "x.csv")
    before = flight.read_bytes()
    result = run("filter", "x.csv", "clean-x.csv", "-o", "clean-*.csv")
    assert (result.code, result.out) == (1, "")
    assert Path("clean-x.csv").read_bytes() == before
    Path("model.parquet").write_bytes(b"precious")
    assert "which is never overwritten" in run("filter", "x.csv", "--model", "model.parquet", "-o", "model.parquet").err
    assert Path("model.parquet").read_bytes() == b"precious"


def test_the_sidecar_spares_inputs_too(run, flight):
    """`-o model.csv` would also write model.json."""
    Path("model.json").write_bytes(b"precious")
    assert "which is never overwritten" in run("filter", flight, "--model", "model.json", "-o", "model.csv").err
    assert Path("model.json").read_bytes() == b"precious"


def test_a_failed_log_leaves_an_earlier_result_as_it_was(run, flight):
    assert run("filter", flight, "-o", "a.parquet").code == 0
    before = Path("a.parquet").read_bytes()
    flight.write_text("time_s,range_m\n0,wrong\n")
    assert run("filter", flight, "-o", "a.parquet").code == 1
    assert Path("a.parquet").read_bytes() == before
    assert not list(Path().glob(".*"))


def test_a_directory_without_permission(shell, flight):
    (flight.parent / "closed").mkdir(mode=0o555)
    result = shell("ftproc filter flight.csv -o closed/a.csv")
    if result.code == 0:  # for root nothing is closed
        assert (flight.parent / "closed/a.csv").exists()
    else:
        assert result.err.startswith("ftproc: closed/a.csv: no permission to write in closed")


@pytest.mark.parametrize("kind", ["kml", "geojson", "czml"])
def test_maps(run, flight, kind):
    name = f"there.{kind}"
    result = run("filter", flight, "-o", name)
    assert (result.code, result.out) == (2, "")
    cure = "give --site LAT,LON,HEIGHT, or [site] in the --config file."
    assert result.err == f"ftproc: {name}: a .{kind} map needs the station: {cure}\n"
    assert not Path(name).exists()
    assert run("filter", flight, "-o", name, "--site", "48,11,600").code == 0
    assert "48.00" in Path(name).read_text()
    assert '"method": "ga-bpnn-ukf"' in Path("there.json").read_text()


def test_feather_in_feather_out(run, here):
    assert run("simulate", "--scenario", "zuo2021", "-o", "a.feather", "--truth", "a.truth.feather").code == 0
    assert run("filter", "a.feather").out.endswith("\n  -> a.trajectory.feather\n")
    assert "position RMSE" in run("score", "a.trajectory.feather", "--truth", "a.truth.feather").out


def test_a_sidecar_replaces_only_a_sidecar(here: Path) -> None:
    (here / "flight.json").write_text('[{"time_s": 0, "range_m": 1}]')
    with pytest.raises(
        OutputError, match=r"flight.json: this file would be replaced, and is none that an earlier run has written"
    ):
        prepare("a.csv", "flight.csv")
    prepare("a.csv", "flight.parquet")
    (here / "flight.json").write_text('{\n  "frame": "local",\n  "program": "ftproc",\n  "version": "0.1.0"\n}\n')
    prepare("a.csv", "flight.csv")
    (here / "flight.json").unlink()
    (here / "flight.json").mkdir()
    with pytest.raises(OutputError, match=r"flight.json"):
        prepare("a.csv", "flight.csv")
