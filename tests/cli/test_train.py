"""`ftproc train`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas
import pytest

from ftproc import api
from ftproc.correction.training import descent, study
from ftproc.settings import TrainSettings
from tests.cli.conftest import Result, on_the_earth

PROJECT = Path(__file__).parents[2]
SMALL = ("--population", 6, "--generations", 2, "--epochs", 5, "--hidden", 4)


def simulate(run, number):
    names = f"{number}.parquet", f"{number}.truth.csv"
    args = ("--duration", 20, "--dt", 0.1, "--seed", number)
    assert run("simulate", "--scenario", "manoeuvre", *args, "-o", names[0], "--truth", names[1]).code == 0
    return ["--log", names[0], "--truth", names[1]]


def test_from_logs_with_truth(run, here):
    pairs = [part for number in range(3) for part in simulate(run, number)]
    trained = run("train", *pairs, *SMALL, "-o", "model.safetensors")
    assert trained.code == 0, trained.err
    assert trained.out.startswith("Correction model, schema 2\ntraining: editing two-pass, epochs 5, features auto, ")
    assert run("train", "--show", "model.safetensors") == Result(0, trained.out, "")
    assert run("filter", "0.parquet", "--model", "model.safetensors", "-o", "clean.csv").code == 0


def test_a_truth_on_the_earth_needs_the_site(run, here):
    pairs = [part for number in range(3) for part in simulate(run, number)]
    earth = [on_the_earth(part, (48.0, 11.0, 500.0)) if part.endswith("truth.csv") else part for part in pairs]
    refused = run("train", *earth, *SMALL, "-o", "model.safetensors")
    assert refused.code == 1
    assert "say --site LAT,LON,HEIGHT" in refused.err
    trained = run("train", *earth, *SMALL, "--site", "48,11,500", "-o", "model.safetensors")
    assert trained.code == 0, trained.err


def test_from_past_logs_without_truth(run, here):
    logs = [part for number in range(3) for part in simulate(run, number)[:2]]
    trained = run("train", *logs, *SMALL, "-o", "model.safetensors")
    assert trained.code == 0, trained.err
    assert "teacher smoother" in trained.out
    assert "smoother: no network" in trained.out


def test_from_a_scenario_the_same_seed_gives_the_same_bytes(run, here):
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        args = ("--scenario", "radar", "--flights", 3, *SMALL, "--seed", seed, "-o", f"{name}.safetensors")
        assert run("train", *args).code == 0
    a, b, c = ((here / f"{name}.safetensors").read_bytes() for name in "abc")
    assert a == b != c


def test_two_workers_write_the_same_bytes_as_one(run, here):
    for jobs in (1, 2):
        args = ("--scenario", "radar", "--flights", 4, *SMALL, "--jobs", jobs, "-o", f"{jobs}.safetensors")
        assert run("train", *args).code == 0
    assert (here / "1.safetensors").read_bytes() == (here / "2.safetensors").read_bytes()


def test_the_filter_s_settings_are_trained_for_and_kept(run, here):
    args = ("--scenario", "radar", "--flights", 3, *SMALL, "--jerk", "0.01", "--editing", "none")
    trained = run("train", *args, "-o", "specified.safetensors")
    assert "editing none" in trained.out
    assert "jerk 0.01" in trained.out
    run("train", *args[:-4], "-o", "auto.safetensors")
    assert "jerk auto" in run("train", "--show", "auto.safetensors").out
    assert (here / "specified.safetensors").read_bytes() != (here / "auto.safetensors").read_bytes()


def test_logs_with_columns_and_units_of_their_own(run, here):
    pair = simulate(run, 0)
    frame = pandas.read_parquet("0.parquet").rename(columns={"range_m": "RNG"})
    frame["RNG"] /= 1000.0
    frame.to_csv("odd.csv", index=False)
    args = ("--features", "window", *SMALL, "-o", "m")
    odd = run(
        "train", *["--log", "odd.csv", "--truth", pair[3]] * 4, *args, "--columns", "range=RNG", "--units", "range=km"
    )
    assert odd.code == 0, odd.err
    assert (
        "there is no column"
        in run("train", *["--log", "odd.csv", "--truth", pair[3]] * 4, *args, "--columns", "range=X").err
    )


def test_a_linear_model_says_so_on_its_card_and_in_the_summary(run, here):
    circle = PROJECT / "sample_data" / "calibration" / "circle.parquet"
    pair = ("--log", circle, "--truth", circle.with_name("circle.truth.parquet"))
    made = run("train", *pair, "--features", "instrument", *SMALL, "-o", "linear.safetensors")
    assert made.code == 0, made.err
    assert made.out.count("feature set 'instrument', linear, 7 inputs to 3 outputs (held-out samples did not need") == 2
    assert "network" not in made.out
    for smooth in ("--smooth", "--no-smooth"):
        used = run("filter", circle, "--model", "linear.safetensors", smooth, "-o", "t.csv")
        assert "linear correction up to" in used.out
        assert "network correction" not in used.out


def test_the_strength_of_the_signal_tells_how_a_range_walks(run, here):
    names = [(f"{k}.csv", f"{k}.truth.csv") for k in range(9)]
    faulty = ("--duration", 60, "--dt", 0.1, "--instrument", "range_walk_m=6,range_walk_at_m=9000,echo_db=6")
    for k, (log, truth) in enumerate(names):
        made = run("simulate", "--scenario", "manoeuvre-clean", "--seed", k, *faulty, "-o", log, "--truth", truth)
        assert made.code == 0, made.err
    past = [part for log, truth in names[:-1] for part in ("--log", log, "--truth", truth)]
    trained = run("train", *past, *SMALL, "--features", "echo", "-o", "echo.safetensors")
    assert trained.code == 0, trained.err
    left = {}
    for model in ("none", "echo.safetensors"):
        used = run("filter", names[-1][0], "--smooth", "--model", model, "-o", "t.csv")
        assert ("correction up to" in used.out) == (model != "none")
        axes = ["x_m", "y_m", "z_m"]
        off = pandas.read_csv("t.csv")[axes].to_numpy() - pandas.read_csv(names[-1][1])[axes].to_numpy()
        left[model] = np.sqrt(np.mean(off**2))
    assert left["echo.safetensors"] < 0.5 * left["none"]
    bare = pandas.read_csv(names[-1][0]).drop(columns="signal_db")
    bare.to_csv("bare.csv", index=False)
    used = run("filter", "bare.csv", "--model", "echo.safetensors", "-o", "t.csv")
    assert "the model corrects nothing: the log has no strength of the signal in dB" in used.out
    refused = run("train", "--log", "bare.csv", "--features", "echo", "-o", "m")
    assert "needs the strength of the signal in dB, in a column of every log" in refused.err
    trained = api.train(names[:-1], TrainSettings(features="echo", population=6, generations=2, epochs=5))
    assert trained.hears
    assert api.filter_log(names[-1][0], model=trained).correction.any()
    assert not api.filter_log(api.read_log(names[-1][0]), model=trained).correction.any()
    assert api.filter_log(api.read_log(names[-1][0], signal=True), model=trained).correction.any()


@pytest.mark.parametrize(("optimiser", "epochs"), [("momentum", 1000), ("l-bfgs", 400)])
def test_the_optimiser_and_its_epochs_are_on_the_card(run, here, monkeypatch, optimiser, epochs):
    """Where the user says nothing of the epochs, an optimiser gets its own."""
    asked = []
    real = descent.descend
    monkeypatch.setattr(
        descent, "descend", lambda name, a, b, most, *rest: asked.append((name, most)) or real(name, a, b, 2, *rest)
    )
    args = ("--scenario", "radar", "--flights", 3, "--hidden", 2, "--population", 4, "--generations", 1)
    result = run("train", *args, "--features", "correction", "--optimiser", optimiser, "-o", "m")
    assert result.code == 0, result.err
    assert f"epochs {epochs}" in result.out
    assert f"optimiser {optimiser}" in result.out
    assert asked == [(optimiser, epochs)]


def test_the_study_of_first_weights(run, here):
    args = ("--scenario", "radar", "--flights", 3, *SMALL, "--compare-starts")
    one, two = run("train", *args), run("train", *args, "--jobs", 2)
    assert one.code == 0, one.err
    assert one.out == two.out
    assert "Initial weights of the network 'window' at equal cost" in one.out
    for name in study.CONTENDERS:
        assert name in one.out
    assert list(here.iterdir()) == []


def test_ctrl_c_leaves_no_file(run, here, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("ftproc.correction.training.train.with_verdict", interrupt)
    result = run("train", "--scenario", "radar", "--flights", 3, *SMALL, "-o", "m.safetensors")
    assert result.code != 0
    assert list(here.iterdir()) == []


@pytest.mark.parametrize(
    ("args", "sentence"),
    [
        ([], "-o MODEL is missing"),
        (["-o", "m"], "Learn either from --log LOG [--truth TRUTH] or from --scenario NAME."),
        (["-o", "m", "--scenario", "radar", "--log", "a", "--truth", "b"], "Learn either from"),
        (
            ["-o", "m", "--log", "a", "--log", "b", "--truth", "c"],
            "--log is given 2 times and --truth 1 times; give them in",
        ),
        (["-o", "m", "--scenario", "moon"], 'There is no scenario "moon"'),
        (["-o", "m", "--scenario", "radar", "--compare-starts"], "--compare-starts writes no model; leave out -o."),
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
    assert run("train", "--show", "packaged").out.startswith("Correction model, ")
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
