"""The methods by name: what each is, where it comes from, and the function that runs it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ftproc.errors import UsageError
from ftproc.settings import FilterSettings

if TYPE_CHECKING:
    from ftproc.methods.estimate import Estimate, Readings

Run = Callable[["Readings", FilterSettings], "Estimate"]


@dataclass(frozen=True)
class Method:
    """causal: the estimate of a sample needs no later one, once noise and start are set (two-pass editing, the
    default of the main method, looks at the whole record to decide what is an outlier). corrected: the network
    works on its output."""

    name: str
    title: str
    source: str
    causal: bool
    handles_outliers: bool
    corrected: bool
    run: Run
    random: bool = False  # draws random numbers, so that --particles and --seed matter


def _anti_outlier(readings: Readings, settings: FilterSettings) -> Estimate:
    from ftproc.methods import anti_outlier

    return anti_outlier.estimate(readings, settings)


def _ukf(readings: Readings, settings: FilterSettings) -> Estimate:
    from ftproc.methods import anti_outlier

    return anti_outlier.unedited(readings, settings)


def _ekf(readings: Readings, settings: FilterSettings) -> Estimate:
    from ftproc.methods import anti_outlier

    return anti_outlier.unedited(readings, settings, extended=True)


def _ensemble(name: str) -> Run:
    def run(readings: Readings, settings: FilterSettings) -> Estimate:
        from ftproc.methods import ensemble

        return ensemble.estimate(readings, settings, name)

    return run


METHODS: dict[str, Method] = {
    m.name: m
    for m in (
        Method("ga-bpnn-ukf", "anti-outlier UKF with network correction", "Zuo et al. 2021, section 2.3",
               True, True, True, _anti_outlier),
        Method("ga-bpnn-ukf-plain", "UKF with network correction, no editing", "Zuo et al. 2021, section 2.2",
               True, False, True, _ukf),
        Method("ukf", "unscented Kalman filter", "Julier and Uhlmann 2004", True, False, False, _ukf),
        Method("ekf", "extended Kalman filter", "Zuo et al. 2021, eq. 4", True, False, False, _ekf),
        Method("enkf", "ensemble Kalman filter", "Evensen 1994",
               True, False, False, _ensemble("enkf"), random=True),
        Method("enpf", "particle filter with an EnKF for its proposals", "Shao et al. 2020",
               True, False, False, _ensemble("enpf"), random=True),
        Method("enpf-chi2", "the same behind a chi-square gate", "Shao et al. 2020",
               True, True, False, _ensemble("enpf-chi2"), random=True),
        Method("renpf", "particle filter with fuzzy weights and Markov chains", "Shao et al. 2020",
               True, True, False, _ensemble("renpf"), random=True),
    )
}  # fmt: skip


def named(name: str) -> Method:
    """The method of that name. Raises UsageError for any other, with the nearest."""
    if name in METHODS:
        return METHODS[name]
    import difflib

    nearest = difflib.get_close_matches(name, METHODS, n=1)
    hint = f"; did you mean {nearest[0]!r}?" if nearest else ""
    raise UsageError(f"there is no method {name!r}{hint} (`ftproc filter --list-methods` lists them)")


def list_methods() -> str:
    """A table of the methods for the terminal."""
    rows = [("name", "what it is", "source", "causal", "outliers", "needs a model")]
    yes = {True: "yes", False: "no"}
    rows += [
        (m.name, m.title, m.source, yes[m.causal], yes[m.handles_outliers], yes[m.corrected]) for m in METHODS.values()
    ]
    widths = [max(len(r[i]) for r in rows) for i in range(6)]
    return "\n".join("  ".join(c.ljust(w) for c, w in zip(r, widths, strict=True)).rstrip() for r in rows)
