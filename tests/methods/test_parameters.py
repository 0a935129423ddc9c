"""The parameters of the published methods: what can be set, what cannot, and that each of them matters."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc import pipeline, scoring
from ftproc.errors import UsageError
from ftproc.methods import parameters, registry
from ftproc.methods.parameters import Parameter
from ftproc.settings import FilterSettings
from tests.simulated import simulate

SETTABLE = {name: method for name, method in registry.METHODS.items() if method.parameters}
EACH = [(name, p) for name, method in SETTABLE.items() for p in method.parameters]

#: A value of each parameter that is not its default, and matters on a log with outliers.
OTHER = {
    "order": 0, "window": 3, "longest": 2, "F": 2.0, "D": 2.0, "Q": 1e-4, "R": 400.0, "r": 1.5, "m": 0.9, "memory": 0.2,
    "least_noise": 5.0, "k": 0.3, "nu": 50.0, "b": 8.0, "ratio": 100.0, "sojourn_s": 0.1, "jitter": 2.0, "gate": 0.5,
    "moves": 1,
}  # fmt: skip


@pytest.fixture(scope="module")
def flight():
    return simulate("manoeuvre", seed=3, duration_s=20.0, outliers="isolated=0.1:3-60,offset=2:4-12:5-60")


def run(flight, name, *given):
    settings = FilterSettings(method=name, parameters=given, particles=100)
    return pipeline.filter_log(flight.log, settings)


@pytest.fixture(scope="module")
def plain(flight):
    return {name: run(flight, name) for name in SETTABLE}


@pytest.mark.parametrize(("name", "parameter"), EACH, ids=lambda v: getattr(v, "name", v))
def test_every_parameter_matters_and_is_kept_in_the_metadata(name, parameter, flight, plain):
    value = OTHER[parameter.name if parameter.name in OTHER else parameter.name.split("_")[0]]
    found = run(flight, name, (parameter.name, float(value)))
    assert found.metadata["settings"]["parameters"] == {parameter.name: value}
    different = ~np.isclose(found.measurement, plain[name].measurement, rtol=0, atol=1e-12, equal_nan=True)
    labels = found.outlier != plain[name].outlier
    if name == "rkf-literal":  # gives back its input
        assert labels.any()
        return
    assert different.any() or labels.any()
    component = {"range": 0, "azimuth": 1, "elevation": 2}.get("_".join(parameter.name.split("_")[1:2]))
    if component is not None and name != "outlier-kf":  # whose gain all components share
        others = [c for c in range(3) if c != component]
        assert not different[:, others].any()


@pytest.mark.parametrize(("name", "parameter"), EACH, ids=lambda v: getattr(v, "name", v))
def test_values_out_of_range_are_refused(name, parameter, flight):
    for value in (parameter.low - 1e-6 - 1, parameter.high * 2 + 1, np.nan):
        with pytest.raises(UsageError, match=f"--set {parameter.name}=.*: {name} takes a (whole )?number from "):
            run(flight, name, (parameter.name, value))
    if parameter.whole:
        with pytest.raises(UsageError, match="takes a whole number"):
            run(flight, name, (parameter.name, parameter.low + 0.5))


def test_thresholds_are_in_the_unit_of_their_name(flight):
    """A gate of 1000 mrad lets every azimuth in, one of 1e-6 mrad next to none."""
    for size, share in ((1000.0, 0.0), (1e-6, 0.5)):
        found = run(flight, "gate-improved", ("F_azimuth_mrad", size), ("order", 0.0))
        flagged = np.isin(found.outlier[:, 1], (1, 2)).mean()
        assert flagged >= share
        assert share or flagged == 0
    settings = FilterSettings(parameters=(("Q_azimuth_mrad2", 4.0), ("Q_range_m2", 9.0)))
    assert parameters.of_component(settings, "Q", 1, 7.0, 2) == pytest.approx(4e-6)
    assert parameters.of_component(settings, "Q", 0, 7.0, 2) == 9.0
    assert parameters.of_component(settings, "Q", 2, 7.0, 2) == 7.0


@pytest.mark.parametrize(
    ("texts", "pairs"),
    [
        (["m=0.01"], (("m", 0.01),)),
        ([" m = 1e-2 , r=5"], (("m", 0.01), ("r", 5.0))),
        (["m=1", "r=5", "m=2"], (("m", 2.0), ("r", 5.0))),
    ],
)
def test_texts_are_understood(texts, pairs):
    assert parameters.parse(texts) == pairs


@pytest.mark.parametrize("text", ["m", "m=", "=3", "m=x", "", "m=1,", "m=1=2"])
def test_what_is_no_parameter_is_a_sentence(text):
    with pytest.raises(UsageError, match=r"^--set .*: expected NAME=VALUE with a number, such as "):
        parameters.parse([text])


def test_unknown_names_are_sentences(flight):
    for name, given, sentence in (
        (
            "gate",
            "F_rnge_m",
            '--set: gate has no parameter "F_rnge_m"; did you mean "F_range_m"? It has order, window,',
        ),
        ("ukf", "m", "--set m: ukf has no parameters; `ftproc filter -h` lists its options."),
    ):
        with pytest.raises(UsageError) as caught:
            run(flight, name, (given, 1.0))
        assert str(caught.value).startswith(sentence)
    with pytest.raises(UsageError, match=r"^--set window=2: a polynomial of degree 2 needs more values\.$"):
        run(flight, "gate", ("order", 2.0), ("window", 2.0))


@pytest.mark.parametrize("name", list(registry.METHODS))
def test_help_names_every_parameter(name):
    text = registry.describe(name)
    assert text.startswith(f"{name}: ")
    for parameter in registry.METHODS[name].parameters:
        assert f"  {parameter.name} " in text
        assert parameter.kind in text
        assert f"[default: {parameter.default}]" in text
    assert ("no parameters of its own" in text) == (name not in SETTABLE)


def test_of_all_methods_each_gets_its_own():
    settings = FilterSettings(method="all", parameters=(("m", 0.01), ("moves", 3.0)))
    registry.check_parameters(settings)
    assert registry.with_own_parameters(settings, "renpf").parameters == (("moves", 3.0),)
    assert registry.with_own_parameters(settings, "ukf").parameters == ()
    with pytest.raises(UsageError, match='all has no parameter "mm"'):
        registry.check_parameters(FilterSettings(method="all", parameters=(("mm", 1.0),)))


def test_whole_numbers():
    count = Parameter("n", "of them", "3", 1, 9, True)
    assert [v for v in (0, 1, 1.5, 9, 10, np.nan, np.inf) if count.accepts(v)] == [1, 9]


RIVALS = {  # share of the outliers found, and m: at least and at most, medians over the flights
    "gate": (0.9, 6.0), "gate-improved": (0.9, 5.0), "ls-window-kf": (0.9, 6.0), "rkf": (0.85, 9.0),
    "outlier-kf": (0.6, 90.0), "outlier-kf-improved": (0.6, 90.0), "student-t-ukf": (0.95, 3.0), "mcc-ukf": (0.95, 3.0),
    "enpf-chi2": (0.95, 3.0), "renpf": (0.95, 3.0),
}  # fmt: skip


@pytest.mark.parametrize("name", RIVALS)
def test_rivals_find_outliers_of_a_flight_once_a_second(name):
    """Their own motion, 40 to 150 m from reading to reading, is no obstacle to them."""
    found = []
    for seed in range(100, 105):
        flight = simulate("zuo2021-outliers", seed=seed)
        trajectory = pipeline.filter_log(flight.log, FilterSettings(method=name))
        bad = flight.truth.outlier > 0
        flagged = np.isin(trajectory.outlier, (1, 2))
        found.append((flagged[bad].mean(), scoring.score(trajectory, flight.truth).rmse_3d_m))
    share, error = np.median(found, axis=0)
    assert share >= RIVALS[name][0]
    assert error <= RIVALS[name][1]
