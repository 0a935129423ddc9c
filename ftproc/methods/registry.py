"""The methods by name: what each is, where it comes from, and the function that runs it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, NamedTuple

from ftproc.errors import UsageError
from ftproc.records import EDITED, LAGGED, PAST, WHOLE
from ftproc.settings import AUTO, FilterSettings

if TYPE_CHECKING:
    from ftproc.methods.estimate import Estimate, Part, Readings, Recording
    from ftproc.methods.parameters import Parameter

Run = Callable[["Readings", FilterSettings], "Estimate"]
Parts = Callable[["Recording", FilterSettings], Iterator["Part"]]

MAIN = FilterSettings.method
EVERY = "all"  # --method all


@dataclass(frozen=True)
class Method:
    """causal: the estimate of a sample needs no later one, once noise and start are set (two-pass editing, the default
    of the main method, uses the whole record to decide what is an outlier). corrected: the network works on its
    output; own_model: only one trained for this very method. smooths: --smooth can be had. needs: a module that must
    be installed, and the extra that brings it. random: it draws random numbers, so --particles and --seed matter.
    in_parts: how a log of any length is filtered in stretches; without, it is filtered as a whole. settable: where
    its parameters are listed, MODULE.NAME in this package."""

    name: str
    title: str
    source: str
    causal: bool
    handles_outliers: bool
    corrected: bool
    run: Run
    own_model: bool = False
    smooths: bool = True
    needs: tuple[str, str] | None = None
    random: bool = False
    in_parts: Parts | None = None
    settable: str | None = None

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The numbers that its paper leaves to the engineer."""
        if self.settable is None:
            return ()
        module, _, name = self.settable.rpartition(".")
        found: tuple[Parameter, ...] = getattr(import_module(f"ftproc.methods.{module}"), name)
        return found

    def parts(self, record: Recording, settings: FilterSettings) -> Iterator[Part]:
        """The estimate of a log, in stretches one behind the other. Raises ValueError as `run`."""
        if self.in_parts is not None:
            return self.in_parts(record, settings)
        return _all_at_once(self.run, record, settings)

    def editing(self, settings: FilterSettings) -> str:
        """How outliers are found: the settings' way in the main method, else by the method's own means or not."""
        if self.name == MAIN:
            return settings.editing
        return "its own" if self.handles_outliers else "none"

    def suits(self, made_for: str) -> bool:
        """Whether a model that was trained for the method `made_for` corrects this one."""
        return made_for == (self.name if self.own_model else MAIN)

    def sees(self, settings: FilterSettings) -> str:
        """What an estimate rests on."""
        if settings.smooth or not self.causal:
            return WHOLE
        if self.editing(settings) == "live" and settings.lag_s > 0:
            return LAGGED.format(settings.lag_s)
        return EDITED if self.editing(settings) == "two-pass" else PAST


def _from(module: str, function: str = "estimate", **how: Any) -> Run:
    """A function of a module in this package, which is imported when it is first run."""

    def run(readings: Readings, settings: FilterSettings) -> Estimate:
        found: Run = partial(getattr(import_module(f"ftproc.methods.{module}"), function), **how)
        return found(readings, settings)

    return run


def _all_at_once(run: Run, record: Recording, settings: FilterSettings) -> Iterator[Part]:
    from ftproc.methods.estimate import Part

    yield Part(run(record.whole(), settings), 0, 0, len(record))


def _in_parts(record: Recording, settings: FilterSettings) -> Iterator[Part]:
    from ftproc.methods import anti_outlier

    return anti_outlier.parts(record, settings)


METHODS: dict[str, Method] = {
    m.name: m
    for m in (
        Method("ga-bpnn-ukf", "anti-outlier UKF with network correction", "Zuo et al. 2021, section 2.3",
               True, True, True, _from("anti_outlier"), in_parts=_in_parts),
        Method("ga-bpnn-ukf-plain", "UKF with network correction, no editing", "Zuo et al. 2021, section 2.2",
               True, False, True, _from("preparing", "unedited")),
        Method("ukf", "unscented Kalman filter", "Julier and Uhlmann 2004",
               True, False, False, _from("preparing", "unedited")),
        Method("ekf", "extended Kalman filter", "Zuo et al. 2021, eq. 4",
               True, False, False, _from("preparing", "unedited", extended=True)),
        Method("bpnn-ekf", "EKF with a network trained from a random start", "Feng, Xu and Shi 2017",
               True, False, True, _from("preparing", "unedited", extended=True), own_model=True),
        Method("kf", "linear Kalman filter on converted measurements", "Lerro and Bar-Shalom 1993",
               True, False, False, _from("papers.kalman", "converted"), smooths=False),
        Method("imm-ukf", "interacting models of steady flight and manoeuvres", "Zhang, Li and He 2012",
               True, False, False, _from("papers.kalman", "multiple"), smooths=False,
               settable="papers.kalman.IMM_PARAMETERS"),
        Method("huber-ukf", "UKF with Huber's weights", "Karlgaard and Schaub 2007",
               True, True, False, _from("papers.robust", "huber"),
               settable="papers.robust.HUBER_PARAMETERS"),
        Method("student-t-ukf", "UKF with Student's t weights", "Agamennoni et al. 2012",
               True, True, False, _from("papers.robust", "student"),
               settable="papers.robust.STUDENT_PARAMETERS"),
        Method("mcc-ukf", "UKF by maximum correntropy", "Chen et al. 2017",
               True, True, False, _from("papers.robust", "correntropy"),
               settable="papers.robust.CORRENTROPY_PARAMETERS"),
        Method("gate", "readings that jump are dropped", "Yu et al., range tests",
               True, True, False, _from("papers.range_test", "gate"), smooths=False,
               settable="papers.range_test.GATE_PARAMETERS"),
        Method("gate-improved", "the same, with the first reading checked", "Yu et al., range tests",
               True, True, False, _from("papers.range_test", "gate", check_first=True), smooths=False,
               settable="papers.range_test.GATE_PARAMETERS"),
        Method("ls4", "readings off the line through the last four replaced", "Yu et al., range tests",
               True, True, False, _from("papers.range_test", "least_squares"), smooths=False,
               settable="papers.range_test.LINE_PARAMETERS"),
        Method("outlier-kf", "anti-outlier Kalman filter, channel by channel", "Yu et al., range tests",
               True, True, False, _from("papers.range_test", "outlier_kalman"), smooths=False,
               settable="papers.range_test.KALMAN_PARAMETERS"),
        Method("outlier-kf-improved", "the same, first reading checked, gains apart", "Yu et al., range tests",
               True, True, False, _from("papers.range_test", "outlier_kalman", improved=True), smooths=False,
               settable="papers.range_test.KALMAN_PARAMETERS"),
        Method("ls-window-kf", "outliers repaired by a line, Kalman filter", "Zhang and Zhang, reliable KF",
               True, True, False, _from("papers.reliable", "window_kalman"), smooths=False,
               settable="papers.reliable.WALK_PARAMETERS"),
        Method("rkf", "the same, with noises that adapt (regularised)", "Zhang and Zhang, reliable KF",
               True, True, False, _from("papers.reliable", "reliable"), smooths=False,
               settable="papers.reliable.RELIABLE_PARAMETERS"),
        Method("rkf-literal", "the same to the letter: gives back its input", "Zhang and Zhang, reliable KF",
               True, True, False, _from("papers.reliable", "reliable", literal=True), smooths=False,
               settable="papers.reliable.REPAIR_PARAMETERS"),
        Method("wavelet-akf", "adaptive Kalman filter, then wavelets", "Wu and Ran 2021",
               False, True, False, _from("papers.wavelet"), smooths=False, needs=("pywt", "PyWavelets>=1.5")),
        Method("enkf", "ensemble Kalman filter", "Evensen 1994",
               True, False, False, _from("papers.ensemble", method="enkf"), smooths=False, random=True),
        Method("enpf", "particle filter with an EnKF for its proposals", "Shao et al. 2020",
               True, False, False, _from("papers.ensemble", method="enpf"), smooths=False, random=True,
               settable="papers.ensemble.JITTER_PARAMETERS"),
        Method("enpf-chi2", "the same behind a chi-square gate", "Shao et al. 2020",
               True, True, False, _from("papers.ensemble", method="enpf-chi2"), smooths=False, random=True,
               settable="papers.ensemble.GATED_PARAMETERS"),
        Method("renpf", "particle filter with fuzzy weights and Markov chains", "Shao et al. 2020",
               True, True, False, _from("papers.ensemble", method="renpf"), smooths=False, random=True,
               settable="papers.ensemble.CHAINS_PARAMETERS"),
    )
}  # fmt: skip


class Use(NamedTuple):
    """Where an option has an effect: a test, and the same in words."""

    by: Callable[[Method, FilterSettings], bool]
    words: str


def _recursive(method: Method, settings: FilterSettings) -> bool:
    return method.name == MAIN and settings.editing == "forward"


def _edited_twice(method: Method, settings: FilterSettings) -> bool:
    return method.name == MAIN and settings.editing == "two-pass"


def _live(method: Method, settings: FilterSettings) -> bool:
    return method.name == MAIN and settings.editing == "live"


_ENSEMBLES = "it is for the methods enkf, enpf, enpf-chi2 and renpf"

#: The options that only some ways of filtering use, by their names on the command line.
USES = {
    "--editing": Use(lambda m, s: m.name == MAIN, f"it is for {MAIN}; the others have editing of their own, or none"),
    "--motion": Use(
        lambda m, s: _edited_twice(m, s) or ((_live(m, s) or _recursive(m, s)) and s.motion in (AUTO, "white-jerk")),
        f"it is for {MAIN} with --editing two-pass; with live and forward, white-jerk leaves the turning force out",
    ),
    "--lag": Use(_live, f"it is for {MAIN} with --editing live"),
    "--max-patch": Use(
        lambda m, s: _recursive(m, s) or (m.random and m.handles_outliers),
        f"it is for {MAIN} with --editing forward, for enpf-chi2 and for renpf",
    ),
    "--model": Use(lambda m, s: m.corrected, f"a network corrects {MAIN}, ga-bpnn-ukf-plain and bpnn-ekf"),
    "--particles": Use(lambda m, s: m.random, _ENSEMBLES),
    "--seed": Use(lambda m, s: m.random, _ENSEMBLES),
    "--weight-form": Use(_recursive, f"it is for {MAIN} with --editing forward"),
}


def refuse_idle(stated: Iterable[str], methods: Sequence[Method], settings: FilterSettings) -> None:
    """Raise UsageError for the first of the options stated that none of the methods uses with these settings."""
    for option in stated:
        if option in USES and not any(USES[option].by(method, settings) for method in methods):
            with_what = f"{methods[0].name} here" if len(methods) == 1 else "these methods"
            raise UsageError(f"{option} does nothing with {with_what}: {USES[option].words}. Leave it out.")


def named(name: str) -> Method:
    """The method of that name. Raises UsageError for any other, with the nearest."""
    if name in METHODS:
        return METHODS[name]
    import difflib

    nearest = difflib.get_close_matches(name, METHODS, n=1)
    hint = f"; did you mean {nearest[0]!r}?" if nearest else ""
    raise UsageError(f"there is no method {name!r}{hint} (`ftproc filter --list-methods` lists them)")


def obstacle(method: Method, smooth: bool, made_for: str | None) -> str | None:
    """Why the method cannot be run so, as a sentence; None if it can. made_for: the method that the model, if there is
    one, was trained for."""
    if method.needs is not None and find_spec(method.needs[0]) is None:
        package = method.needs[1]
        return f'{method.name} needs {package.split(">")[0]}, which is not installed: pip install "{package}".'
    if smooth and not method.smooths:
        return f"{method.name} has no smoother; leave --smooth out."
    if method.own_model and (made_for is None or not method.suits(made_for)):
        train = f"ftproc train --method {method.name} --scenario manoeuvre -o M.safetensors"
        return f"{method.name} needs a model trained for it: {train}, then --model M.safetensors."
    if method.corrected and made_for is not None and not method.suits(made_for):
        return f"{method.name} cannot use a model that was trained for {made_for}; give another with --model, or none."
    return None


def with_own_parameters(settings: FilterSettings, name: str) -> FilterSettings:
    """The settings for the method of that name, without the parameters that only others have."""
    own = {parameter.name for parameter in named(name).parameters}
    return replace(settings, method=name, parameters=tuple(each for each in settings.parameters if each[0] in own))


def check_parameters(settings: FilterSettings) -> None:
    """Raises UsageError for parameters that the settings' method (or, of all, any) does not have, or whose values make
    no sense."""
    from ftproc.methods import parameters

    if settings.parameters:
        methods = METHODS.values() if settings.method == EVERY else [named(settings.method)]
        known = {parameter.name: parameter for method in methods for parameter in method.parameters}
        parameters.check(settings.method, list(known.values()), settings.parameters)


def describe(name: str) -> str:
    """What a method is, and its parameters, for the terminal. Raises UsageError for an unknown name."""
    from ftproc.methods.parameters import described

    method = named(name)
    lines = [f"{method.name}: {method.title} ({method.source})"]
    if method.parameters:
        lines += ["Parameters, for --set NAME=VALUE:", *described(method.parameters)]
    else:
        lines += ["It has no parameters of its own; the options of `ftproc filter -h` set what it needs."]
    return "\n".join(lines)


def list_methods() -> str:
    """A table of the methods for the terminal."""
    rows = [("name", "what it is", "source", "causal", "outliers", "needs a model")]
    yes = {True: "yes", False: "no"}
    rows += [
        (
            m.name,
            m.title,
            m.source,
            yes[m.causal],
            yes[m.handles_outliers],
            "its own" if m.own_model else yes[m.corrected],
        )
        for m in METHODS.values()
    ]
    widths = [max(len(r[i]) for r in rows) for i in range(6)]
    return "\n".join("  ".join(c.ljust(w) for c, w in zip(r, widths, strict=True)).rstrip() for r in rows)
