"""Every default a user may change, once. Frozen dataclasses; units in the names or the comment beside them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FilterSettings:
    """What a user may ask of `filter`; None means: find it from the log."""

    method: str = "ga-bpnn-ukf"
    editing: str = "two-pass"  # two-pass | forward | none
    smooth: bool = False
    noise: tuple[float, float, float] | None = None  # 1-sigma of range m, azimuth rad, elevation rad
    jerk_psd_m2ps5: float | None = None  # spectral density of white jerk
    gate: float = 4.0  # sigmas
    max_patch_s: float | None = None  # longest patch of outliers expected, for the recursive gate
    gain_form: bool = False  # forward editing scales the gain by m (the paper's letter) instead of R by 1/m
    site: tuple[float, float, float] | None = None  # latitude deg, longitude deg, height m


@dataclass(frozen=True)
class TrainSettings:
    """GA-BPNN training: network size, genetic search, back-propagation, hold-out verdict."""

    features: str = "auto"  # what held-out flights choose, or one of ftproc.correction.feature_sets
    hidden: int = 12
    population: int = 40
    generations: int = 60
    epochs: int = 400
    flights: int = 24  # simulated flights when training on a scenario
    seed: int = 0
    optimiser: str = "l-bfgs"  # or momentum, as in the paper
    start: str = "genetic"  # first weights, see ftproc.correction.starts
