"""Two-pass editing: decide which readings are outliers with the whole record in view.

Screening (no model) -> first state -> noise and jerk by maximum likelihood -> smoother -> Markov indicators on its
leave-one-out residuals -> again, until the decisions stand still; then a jerk profile that follows the flight.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core import bridges, coloured, indicators, runs, screening, swaps, tuning
from ftproc.core.forward import Model, Start
from ftproc.core.geometry import unwrap
from ftproc.core.motion import isotropic
from ftproc.core.smoother import SmootherRun, smooth_log
from ftproc.core.start import begin_all

FloatArray = NDArray[np.float64]

SHORT_WINDOW = 11  # samples: sees jumps, and hardly anything else
WINDOWS = (31, 75)  # samples: the short one follows manoeuvres, the long one sees through patches
MAX_ROUNDS = 8
TUNING_ROUNDS = 3
READMITTED = 0.8  # probability of being good from which a rejected reading is used again, after these: else some
# swing to and fro, each time changing what the smoother says of themselves
FIRST_JERK = 1.0  # m^2/s^5, where the search begins
SECOND_LOOKS = 6
LOOK_STEPS, FINAL_STEPS = 3, 4  # of the search for the jerk profile
STANDS_OUT = 8.0  # times the median of the jerk profile
FEWEST_TRUSTED = 0.65  # share of a component that screening must leave, to be believed
FEWEST_KEPT = 0.5  # share of what screening trusts that must survive the decisions, in each component
START_INFLATION = 2.0  # on the covariance of a smoothed state that starts a filter over the same record


class Edited(NamedTuple):
    """The decisions and what they rest on.

    weight: (n, 3) 1 good, 0 rejected or missing. model: noise and jerk profile. starts: for the next pass.
    smoothed: the smoother's run with these. rates: (3, 3) learnt outlier rates per component.
    rounds: how many passes it took; settled: whether the decisions stood still. slow_noise: the noise is correlated,
    but so slowly that it cannot be told from motion; the sigmas are then too small.
    """

    weight: FloatArray
    model: Model
    starts: list[Start]
    smoothed: SmootherRun
    rates: FloatArray
    rounds: int
    settled: bool
    slow_noise: bool


def screen(time_s: FloatArray, measurement: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n, 3) weights after the first look at each component by itself, and (3,) noise 1-sigma."""
    weight = np.isfinite(measurement).astype(float)
    sigma = tuning.NOISE_FLOOR.copy()
    for c in range(3):
        channel = np.ascontiguousarray(measurement[:, c])
        weight[:, c], scale = _screen_channel(time_s, channel, c == 1)
        sigma[c] = max(scale, sigma[c])
    return weight, sigma


def _screen_channel(time_s: FloatArray, channel: FloatArray, angular: bool) -> tuple[FloatArray, float]:
    """(n,) weights and the noise 1-sigma of one component."""
    seen = np.isfinite(channel).astype(float)
    near, scales = screening.screen_component(time_s, channel, SHORT_WINDOW, angular)
    weight, sigma = seen.copy(), 0.0
    for window in WINDOWS:
        votes, scales = screening.screen_component(time_s, channel, window, angular)
        screening.bar_runs(channel, votes, near, weight)
        if window == WINDOWS[0] and len(scales):
            sigma = float(np.median(scales))
    weight[bridges.bridged(time_s, unwrap(channel) if angular else channel, weight, sigma) > 0] = 0.0
    # A component that swings too fast for parabolas loses half of itself: then only the short window is believed.
    for alternative in (np.where(near > 0.5, 0.0, seen), seen):
        if weight.sum() < FEWEST_TRUSTED * seen.sum():
            weight = alternative
    return weight, sigma


def stuck_readings(measurement: FloatArray, sigma: FloatArray) -> NDArray[np.bool_]:
    """(n, 3) readings that merely repeat the one before; see `screening.stuck`."""
    return np.stack([screening.stuck(measurement[:, c], float(sigma[c])) for c in range(3)], 1)


class _Record(NamedTuple):
    """What stays the same while the decisions are made: the log, the readings that may be good at all (n, 3), what
    screening trusts (n, 3) and the noise 1-sigma (3,) that it saw, which noises are given (3,), whether the jerk is,
    and the gate in sigmas."""

    time_s: FloatArray
    measurement: FloatArray
    possible: NDArray[np.bool_]
    screened: FloatArray
    sigma: FloatArray
    known: NDArray[np.bool_]
    fix_jerk: bool
    gate: float


class _Decision(NamedTuple):
    """Weights (n, 3), the model and starts they were made with, and the rest as in Edited."""

    weight: FloatArray
    model: Model
    starts: list[Start]
    rates: FloatArray
    rounds: int = 0
    settled: bool = False
    slow_noise: bool = False


def edit(
    time_s: FloatArray, measurement: FloatArray, given_sigma: FloatArray, jerk_psd: float | None, gate: float
) -> Edited:
    """Edit a whole log. time_s (n,), measurement (n, 3).

    given_sigma: (3,) noise 1-sigma m, rad, rad, NaN where it is to be found; jerk_psd m^2/s^5 likewise None.
    gate: sigmas beyond which a lone reading is called an outlier.
    Raises ValueError when a component has no reading that agrees with its neighbours.
    """
    screened, sigma = screen(time_s, measurement)
    possible = np.isfinite(measurement) & ~stuck_readings(measurement, sigma)
    known = np.isfinite(given_sigma)
    record = _Record(time_s, measurement, possible, screened * possible, sigma, known, jerk_psd is not None, gate)
    first_jerk = FIRST_JERK if jerk_psd is None else jerk_psd
    model = Model(np.where(known, given_sigma, sigma) ** 2, isotropic(first_jerk))
    rates = np.tile(np.array(indicators.START_RATES), (3, 1))
    starts = begin_all(time_s, measurement, record.screened, model.noise_variance, jerk_psd)
    decision = _decide(record, _Decision(record.screened, model, starts, rates), tune_first=True)
    if jerk_psd is None:
        decision = _follow_flight(record, decision)
    smoothed = smooth_log(time_s, measurement, decision.weight, decision.model, decision.starts)
    d = decision
    return Edited(d.weight, d.model, d.starts, smoothed, d.rates, d.rounds, d.settled, d.slow_noise)


def _decide(record: _Record, begun: _Decision, tune_first: bool) -> _Decision:
    """Tune, smooth and classify by turns until the decisions stand still."""
    time_s, measurement = record[:2]
    weight, model, starts, rates = begun.weight, begun.model, begun.starts, begun.rates.copy()
    rounds, settled, asked, is_coloured, slow_noise = 0, False, False, False, begun.slow_noise
    while rounds < MAX_ROUNDS and not settled:
        tuning_round = rounds < TUNING_ROUNDS and (tune_first or rounds > 0) and not model.correlation.any()
        if is_coloured and not model.correlation.any():
            model = coloured.fit_coloured(time_s, measurement, weight, starts, model, record.known, record.fix_jerk)
            is_coloured = False  # once is enough; the decisions go on with it
            slow_noise = not model.correlation.any()
        elif tuning_round:
            model = tuning.fit_level(
                time_s, measurement, weight, starts, model, record.known, record.fix_jerk, record.sigma
            )
        smoothed = smooth_log(time_s, measurement, weight, model, starts, residuals_only=True)
        variance = smoothed.residual_variance - model.noise_variance + model.reading_variance
        good = indicators.classify(smoothed.residual, variance, model.reading_variance, rates, record.gate)
        sure = np.where((weight > 0) | (rounds < TUNING_ROUNDS), 0.5, READMITTED)
        decided = _keep_most(((good > sure) & record.possible).astype(float), record.screened)
        settled = bool((decided == weight).all()) and (rounds > 0 or not tune_first)
        weight = decided
        rounds += 1
        if (settled or rounds == TUNING_ROUNDS) and not (asked or model.correlation.any()):
            asked = True
            correlation = coloured.moments(smoothed, weight, model.noise_variance)[1]
            is_coloured = coloured.is_correlated(correlation, weight)
            settled = settled and not is_coloured
        starts = begin_all(time_s, measurement, weight, model.noise_variance, float(model.jerk[0, 0]))
    return _Decision(weight, model, starts, rates, begun.rounds + rounds, settled, slow_noise)


def _follow_flight(record: _Record, decision: _Decision) -> _Decision:
    """Give the model a jerk profile, and look again at what made it jump.

    A patch that escaped makes the level too high for all, so that it goes on escaping. Where the profile stands out,
    or runs are off together, or the opposite of a decision is likelier, the decisions are made once more from the
    profile's median on, which no single event can move.
    """
    log = record[:2]
    for _ in range(SECOND_LOOKS):
        profile = tuning.fit_profile(*log, decision.weight, decision.starts, decision.model, LOOK_STEPS)
        if profile.correlation.any():
            break  # the level was found from thinned readings, which no patch dominates
        level = float(np.median(profile.jerk[:, 0]))
        calm = profile._replace(jerk=level * profile.jerk[:1] / profile.jerk[0, 0], knot_s=np.inf)
        suspects = _suspects(log, decision, calm, profile)
        whole = swaps.Neighbourhood(*log, record.possible, calm, decision.rates, record.gate)
        weight = swaps.try_opposites(whole, np.where(suspects, 0.0, decision.weight))
        if profile.jerk[:, 0].max() < STANDS_OUT * level and (weight == decision.weight).all():
            break  # nothing stands out
        again = _decide(record, decision._replace(weight=weight, model=calm), tune_first=False)
        if (again.weight == decision.weight).all():
            break
        decision = again
    else:
        profile = tuning.fit_profile(*log, decision.weight, decision.starts, decision.model, LOOK_STEPS)
    profile = tuning.fit_profile(*log, decision.weight, decision.starts, profile, FINAL_STEPS)
    return decision._replace(model=tuning.with_allowance(profile))


def _suspects(
    log: tuple[FloatArray, FloatArray], decision: _Decision, calm: Model, profile: Model
) -> NDArray[np.bool_]:
    """(n, 3) readings that are good so far, in runs that are off together if the flight is calm, and off at once at
    both ends even if it is not."""
    weight, starts = decision.weight, decision.starts
    smoothed = smooth_log(*log, weight, calm, starts, residuals_only=True)
    suspects = runs.suspicious(log[0], smoothed.residual, smoothed.residual_variance, weight)
    if suspects.any():
        without = smooth_log(*log, np.where(suspects, 0.0, weight), profile, starts, residuals_only=True)
        suspects = runs.confirmed(suspects, without.residual, without.residual_variance)
    return suspects


def _keep_most(decided: FloatArray, screened: FloatArray) -> FloatArray:
    """The decisions (n, 3), but for a component of which hardly anything would be left: a filter that has gone
    astray calls everything bad, and screening knows better."""
    lost = decided.sum(0) < FEWEST_KEPT * screened.sum(0)
    return np.where(lost, screened, decided)


def smoothed_starts(smoothed: SmootherRun) -> list[Start]:
    """Where the recursive filter begins over a record that has been smoothed: at the smoothed states.

    Their covariances are inflated, because the filter will see the same readings once more.
    """
    return [head._replace(covariance=START_INFLATION * head.covariance) for head in smoothed.heads]
