"""`ftproc train`."""

from __future__ import annotations

import pytest

from tests.cli.conftest import Result

SMALL = ("--population", 6, "--generations", 2, "--epochs", 5, "--hidden", 4)


def simulate(run, number):
    names = f"{number}.parquet", f"{number}.truth.csv"
    args = ("--duration", 30, "--dt", 0.1, "--seed", number)
    assert run("simulate", "--scenario", "manoeuvre", *args, "-o", names[0], "--truth", names[1]).code == 0
    return ["--log", names[0], "--truth", names[1]]


def test_from_logs_with_truth(run, here):
    pairs = [part for number in range(4) for part in simulate(run, number)]
    trained = run("train", *pairs, *SMALL, "-o", "model.safetensors")
    assert trained.code == 0, trained.err
    assert trained.out.startswith("Correction model, schema 1, feature set 'window', network ")
    assert run("train", "--show", "model.safetensors") == Result(0, trained.out, "")
    assert run("filter", "0.parquet", "--model", "model.safetensors", "-o", "clean.csv").code == 0


def test_from_a_scenario_the_same_seed_gives_the_same_bytes(run, here):
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        args = ("--scenario", "radar", "--flights", 3, *SMALL, "--seed", seed, "-o", f"{name}.safetensors")
        assert run("train", *args).code == 0
    a, b, c = ((here / f"{name}.safetensors").read_bytes() for name in "abc")
    assert a == b != c


@pytest.mark.parametrize(
    ("args", "sentence"),
    [
        ([], "-o MODEL is missing"),
        (["-o", "m"], "Learn either from --log LOG --truth TRUTH pairs or from --scenario NAME."),
        (["-o", "m", "--scenario", "radar", "--log", "a", "--truth", "b"], "Learn either from"),
        (["-o", "m", "--log", "a"], "--log is given 1 times and --truth 0 times; give them in pairs."),
        (["-o", "m", "--scenario", "moon"], 'There is no scenario "moon"'),
        (["-o", "-", "--scenario", "radar"], "a model is not written to standard output"),
        (["-o", "m", "--scenario", "zuo2021", "--flights", "2", "--features", "magic"], "magic"),
    ],
)
def test_wrong_usage(run, here, args, sentence):
    result = run("train", *args)
    assert (result.code, result.out) == (2, "")
    assert sentence in result.err
    assert list(here.iterdir()) == []


def test_never_writes_over_an_input(run, here):
    pair = simulate(run, 1)
    before = (here / "1.parquet").read_bytes()
    result = run("train", *pair, "-o", "1.parquet")
    assert (result.code, result.out) == (1, "")
    assert "this is the input 1.parquet, which is never overwritten" in result.err
    assert (here / "1.parquet").read_bytes() == before


def test_inputs_that_are_none(run, here):
    simulate(run, 1)
    missing = run("train", "--log", "none.csv", "--truth", "1.truth.csv", "-o", "m")
    assert (missing.code, missing.err) == (1, "ftproc: none.csv: there is no such file.\n")
    (here / "text").write_text("nothing")
    shown = run("train", "--show", "text")
    assert (shown.code, shown.out) == (1, "")
    assert shown.err == "ftproc: text: not a correction model; `ftproc train` writes one\n"
    assert run("train", "--scenario", "radar", "-o", "no/m").err.startswith("ftproc: no/m: there is no directory no")


def test_too_little_to_learn_from(run, here):
    pair = simulate(run, 1)
    result = run("train", *pair, "-o", "m.safetensors")
    assert result.code == 1
    assert "too little to learn from" in result.err
    assert not (here / "m.safetensors").exists()
