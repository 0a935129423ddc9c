"""The program: help, versions, and a plain sentence for every kind of error."""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import click
import pytest
from click.shell_completion import BashComplete

from ftproc import __version__
from ftproc.cli.main import COMMANDS, cli
from ftproc.errors import failure
from tests.cli.conftest import BIN
from tests.docs.pages import PAGES
from tests.docs.shell import ROOT


def commands() -> list[click.Command]:
    context = click.Context(cli)
    return [cli, *(cli.get_command(context, name) for name in COMMANDS)]


def test_version(run):
    assert run("--version").out == f"ftproc {__version__}\n"


@pytest.mark.parametrize("name", ["", *COMMANDS])
@pytest.mark.parametrize("flag", ["-h", "--help"])
def test_help_ends_with_examples(run, name, flag):
    result = run(*[name] * bool(name), flag)
    assert result.code == 0
    assert result.err == ""
    examples = result.out.partition("\nExamples:\n")[2].splitlines()
    assert 2 <= len(examples) <= 3
    assert all(line.startswith("  ftproc ") for line in examples)


@pytest.mark.parametrize("command", commands(), ids=["ftproc", *COMMANDS])
def test_every_command_and_option_has_help(command):
    assert command.help
    assert command.get_short_help_str(limit=55).endswith(".")
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            assert parameter.help, f"{command.name} {parameter.name}"
            assert parameter.help.endswith((".", "]")), parameter.help


@pytest.mark.parametrize("name", ["", *COMMANDS])
def test_examples_run(run, here, name):
    text = run(*[name] * bool(name), "-h").out
    for line in text.partition("\nExamples:\n")[2].splitlines():
        program, *args = shlex.split(line)
        result = run(*args)
        assert (program, result.code) == ("ftproc", 0), result.err


@pytest.mark.parametrize("name", ["", *COMMANDS])
def test_help_is_cheap(name):
    """Nothing heavy is loaded to show a help (but simulate's, which lists its scenarios)."""
    script = (
        "import sys\nfrom ftproc.cli.main import cli\n"
        f"try: cli.main({[*[name] * bool(name), '-h']!r})\nexcept SystemExit: pass\n"
        "print([m for m in ('numpy', 'numba', 'pandas', 'pyarrow', 'scipy') if m in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stderr.strip() == ("['numpy']" if name == "simulate" else "[]")


def test_no_command_shows_the_help(run):
    result = run()
    assert (result.code, result.out) == (2, "")
    assert "Commands:" in result.err


@pytest.mark.parametrize(
    ("args", "sentence"),
    [
        (["fliter"], 'ftproc: There is no command "fliter"; did you mean "filter". See ftproc -h.'),
        (["ftlr", "-h"], 'ftproc: There is no command "ftlr"; did you mean "filter". See ftproc -h.'),
        (["zzz"], 'ftproc: There is no command "zzz". See ftproc -h.'),
        (["filter", "x.csv", "--units", "range=mm2"], '.*understood are m, km, ft, .*; did you mean "mm".'),
        (["filter", "x.csv", "--units", "az=dge"], '.*did you mean "deg".'),
        (["filter", "x.csv", "--units", "el=gradd"], '.*did you mean "grad".'),
        (["filter", "x.csv", "--units", "el=gom"], '.*did you mean "gon".'),
        (["filter", "x.csv", "--columns", "elevaton=EL"], '.*is not a quantity of a log.*did you mean "elevation".'),
        (["filter", "x.csv", "--method", "ufk"], ".*there is no method 'ufk'; did you mean 'ukf'.*"),
        (["simulate", "--scenario", "rader", "-o", "x.csv"], '.*no scenario "rader"; did you mean "radar". Choose.*'),
        (["simulate", "--scenario", "radar", "-o", "x.csv", "--outliers", "isolatd=1"], '.*did you mean "isolated".*'),
        (["filter", "x.csv", "--smoth"], 'ftproc filter: There is no option --smoth; did you mean "--smooth"?.*'),
        (["filter", "x.csv", "--azimut-from", "north"], '.*no option --azimut-from; did you mean "--azimuth-from"?.*'),
        (["filter", "x.csv", "--verbose"], "ftproc filter: There is no option --verbose. See ftproc filter -h."),
        (["filter", "x.csv", "-o", "a.csv", "-o", "b.kml"], ".*-o is given 2 times.*a.csv, b.kml.*once for each.*"),
        (["filter", "x.csv", "--editing", "maybe"], "ftproc filter: Invalid value for '--editing'.*two-pass.*"),
        (["filter", "--jobs", "0", "x.csv"], "ftproc filter: Invalid value for '--jobs'.*"),
        (["simulate", "--scenario", "radar"], "ftproc simulate: Missing option '-o'.*"),
    ],
)
def test_wrong_usage(run, here, args, sentence):
    result = run(*args)
    assert (result.code, result.out) == (2, "")
    assert len(result.err.splitlines()) == 1
    assert re.fullmatch(sentence, result.err.strip())


def test_an_error_is_a_sentence_and_debug_shows_its_origin(run, here):
    plain = run("score", "none.csv")
    assert plain.err == "ftproc: none.csv: there is no such file.\n"
    for args in (["--debug", "train", "--show", "none.st"], ["train", "--show", "none.st", "--debug"]):
        shown = run(*args)
        assert shown.code == 1
        assert "Traceback" in shown.err
        assert shown.err.splitlines()[-1].startswith("ftproc: none.st: there is no such file")


def test_an_unexpected_error_is_a_sentence_too(run, here, monkeypatch):
    def broken(*args, **kwargs):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("ftproc.scoring.render", broken)
    monkeypatch.setattr("ftproc.files.reading.trajectories.read", lambda name: None)
    monkeypatch.setattr("ftproc.scoring.score", lambda trajectory, truth: None)
    result = run("score", "x.csv")
    assert result.code == 1
    assert result.err == (
        "ftproc: internal error (ZeroDivisionError: division by zero); run again with --debug and report it.\n"
    )


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (MemoryError(), "log.csv: there is not enough memory for it. Use fewer --jobs, or split the log."),
        (OSError(28, "No space left on device"), "log.csv: no space left on device."),
        (PermissionError(13, "Permission denied", "/there"), "/there: permission denied."),
        (
            RuntimeError("cannot cache function 'f': no locator available for file 'x'"),
            "the compiled kernels cannot be kept anywhere. Set NUMBA_CACHE_DIR to a directory that can be written to.",
        ),
    ],
)
def test_errors_of_the_system(error, sentence):
    assert failure(error, "log.csv").message == sentence


@pytest.mark.parametrize("inside_a_kernel", [False, True])
@pytest.mark.parametrize(
    ("stop", "code", "message"), [(KeyboardInterrupt(), 130, "ftproc: interrupted"), (SystemExit(143), 143, "")]
)
def test_interrupted(run, here, monkeypatch, inside_a_kernel, stop, code, message):
    def interrupt(*args, **kwargs):
        if inside_a_kernel:
            raise SystemError("CPUDispatcher returned a result with an exception set") from stop
        raise stop

    monkeypatch.setattr("ftproc.files.reading.trajectories.read", interrupt)
    result = run("score", "x.csv")
    assert result.code == code
    assert result.err.strip() == message


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_leaves_no_partial_output(tmp_path, number, code):
    """Two minutes of work, stopped after two seconds: only whole files are there."""
    command = [BIN / "ftproc", "train", "--scenario", "manoeuvre", "--flights", "500", "-o", "model.safetensors"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        time.sleep(2.0)
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    assert process.returncode == code
    assert out == ""
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []


def test_a_reader_that_leaves_early_is_no_error(shell):
    result = shell("ftproc simulate --scenario zuo2021 --duration 50000 -o - | head -n 1")
    assert result.out == "time_s,range_m,azimuth_rad,elevation_rad\n"
    assert result.err == ""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="only Linux has a disk that is always full")
def test_a_full_disk_behind_stdout(shell):
    result = shell("ftproc simulate --scenario zuo2021 -o - > /dev/full")
    assert (result.code, result.err) == (
        1,
        "ftproc: standard output: no space left on device, so the result is lost; send it elsewhere.\n",
    )


def test_pipes(shell):
    result = shell(
        "ftproc simulate --scenario zuo2021-outliers -o - | ftproc filter - -o - --summary none"
        " | ftproc score - --format json"
    )
    assert result.code == 0, result.err
    assert result.err == ""
    assert '"samples": 61' in result.out


def test_environment_is_the_one_tested():
    assert os.access(BIN / "ftproc", os.X_OK)


def test_as_a_module(shell):
    result = shell(f"{sys.executable} -m ftproc --version")
    assert (result.code, result.out) == (0, f"ftproc {__version__}\n")


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("ftproc fil", ["plain,filter"]),
        ("ftproc filter --editing t", ["plain,two-pass"]),
        ("ftproc filter --method uk", ["plain,ukf"]),
        ("ftproc filter --conf", ["plain,--config"]),
        ("ftproc filter --config s", ["file,s"]),
        ("ftproc filter fl", ["file,fl"]),
        ("ftproc score --truth t", ["file,t"]),
        ("ftproc simulate --scenario man", ["plain,manoeuvre", "plain,manoeuvre-clean"]),
    ],
)
def test_completion(monkeypatch, words, expected):
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split()) - 1))
    assert BashComplete(cli, {}, "ftproc", "_FTPROC_COMPLETE").complete().splitlines() == expected


def test_the_shell_s_part_of_completion(shell):
    assert "_FTPROC_COMPLETE=bash_complete" in shell("ftproc", _FTPROC_COMPLETE="bash_source").out
    asked = {"COMP_WORDS": "ftproc fil", "COMP_CWORD": "1", "_FTPROC_COMPLETE": "bash_complete"}
    assert shell("ftproc", **asked).out == "plain,filter\n"


#: Options of systemctl and dask that a page names.
OTHERS = {"--now", "--port", "--nthreads", "--nworkers"}


def test_the_pages_name_only_options_that_there_are():
    """In the README, in the guide, and in the station files' comments."""
    known = {name for command in commands() for p in command.params for name in (*p.opts, *p.secondary_opts)}
    for page in (*PAGES, *(ROOT / "sample_data").glob("*.toml")):
        named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", page.read_text()))
        assert named - known - {"--help"} - OTHERS == set(), page


def test_a_log_in_place_of_a_command_gets_the_command(run, here):
    (here / "my log.csv").write_text("t,R\n0,1\n")
    result = run("my log.csv")
    assert result.code == 2
    assert result.err == (
        "ftproc: There is no command \"my log.csv\". To filter that log: ftproc filter 'my log.csv'. See ftproc -h.\n"
    )
    assert "ftproc filter 'my log.csv' --smooth --report 'my log.html'" in run("filter").err


def test_a_range_file_and_a_log_of_the_wrong_command_get_the_right_one(run, flight):
    (flight.parent / "range.toml").write_text("[station.radar]\nlog = 'radar.csv'\n")
    assert run("filter", "range.toml").err.endswith("of several stations: ftproc filter --fuse range.toml.\n")
    assert run("score", flight).err == f"ftproc: {flight}: this is a log, no trajectory: ftproc filter {flight}.\n"
