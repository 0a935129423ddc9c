"""Two-pass editing: decide which readings are outliers from the whole record.

Screening (no model) -> first state -> noise and jerk by maximum likelihood -> smoother -> Markov indicators on its
leave-one-out residuals -> again, until the decisions stand still; then a jerk profile that follows the flight.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core import odds
from ftproc.core.by_hand import NOTHING, Accepted
from ftproc.core.editing import outlier_chain
from ftproc.core.editing.copies import without_copies
from ftproc.core.editing.decisions import (
    IMPRECISE,
    Decision,
    Record,
    allow_for_colour,
    allow_for_drift,
    allow_for_late_stamps,
    allow_for_tails,
    allow_for_very_late_stamps,
    decide,
    late_stamps,
)
from ftproc.core.editing.lasting.curves import CLOCK
from ftproc.core.editing.lasting.faults import MOTION, STEP, Faults, Shift, others, refined
from ftproc.core.editing.lasting.rejected.rejected_runs import reassess_rejected
from ftproc.core.editing.lasting.settling import Understood, without_lasting
from ftproc.core.editing.reassessment import (
    finer_noise,
    likelier,
    log_probability,
    preferred,
    reassess,
    rejects_runs,
    with_less_noise,
)
from ftproc.core.editing.screened import rounding_sigma, screen, stuck_readings
from ftproc.core.filtering.initialization import find_starts
from ftproc.core.filtering.records import Model, Observations, Start, Uneven
from ftproc.core.filtering.smoother import PATHS, SmootherRun, smooth_log
from ftproc.core.identification import one_sided, uneven_noise
from ftproc.core.identification.likelihood import Fixed, first_jerk, is_long
from ftproc.core.identification.nearby import residuals_near, samples_around
from ftproc.core.identification.one_sided import OneSided
from ftproc.core.identification.profile import fit_profile, median_level, with_allowance
from ftproc.core.identification.scales import scales_of
from ftproc.core.model.measurement import NO_RANGE_M
from ftproc.core.model.motion import isotropic
from ftproc.core.work import WORK, Work, for_lasting_faults
from ftproc.records import FloatArray

STIFFER = 100.0  # times less jerk by the spans of a long log than at the start of the search, and than by the whole:
# they lie between its turns; from 170, where patches are left that motion would follow up to 30
COARSE = 0.5  # of a component's noise: rounding that makes so much of it decides how its readings repeat
FORGETS, REMEMBERED = 0.8, 5.0  # intervals that a filter remembers: with fewer it follows each reading; another start
STAMP_ROUNDS = 3  # of estimating how late each time stamp is
MOST_LATE = 0.08  # share of the readings, rejected, that stamps which are later by far may explain
MOST_REJECTED = 0.2  # of a component: where more is, it is not yet told what the noise is
REJECTED = 0.05  # of a component: where more is, noise may have grown
DRIFT_ROUNDS = 3  # of following the noise: where it grows, each finds readings that the next can follow
PROFILE_STEPS = 3  # of the search for the jerk profile, once the decisions are made


class Known(NamedTuple):
    """What the user has specified: noise 1-sigma (3,) m, rad, rad, NaN where it is to be found; jerk_psd m^2/s^5, None
    where it is to be found; the gate, in sigmas, beyond which a lone reading is called an outlier; the readings that
    are good by hand, or otherwise known to be; how the noise of single readings is known to differ; and whether nothing
    but white jerk moves the target, see `live.turning`."""

    sigma: FloatArray
    jerk_psd: float | None
    gate: float
    accepted: Accepted = NOTHING
    uneven: Uneven | None = None
    white_jerk: bool = False


class Edited(NamedTuple):
    """The decisions and what they rest on.

    log: with weights (n, 3), 1 good, 0 rejected or missing. model: noise and jerk profile. starts: for the next pass.
    decision: the last one, with the model that it was made with. faults: of the instrument, of which the log is free.
    others: the log as it would be by other understandings that are nearly as likely.
    """

    log: Observations
    model: Model
    starts: list[Start]
    decision: Decision
    faults: Faults
    others: tuple[Observations, ...] = ()

    @property
    def weight(self) -> FloatArray:
        """(n, 3) 1 good, 0 rejected or missing."""
        return self.log.weight

    def smoothed(self) -> SmootherRun:
        """What the whole record says of each sample, with these decisions."""
        return smooth_log(self.log, self.model, self.starts, PATHS)


@np.errstate(all="ignore")  # after a gap of years numbers overflow; what comes of it is unlikely, and is not followed
def edit(
    time_s: FloatArray,
    measurement: FloatArray,
    known: Known,
    segment_of: Model | None = None,
    live: bool = False,
    short: bool = False,
) -> Edited:
    """Edit a whole log, or a segment of a long one. time_s (n,), measurement (n, 3).

    segment_of: of a segment, the noise of the whole log, which is taken as it is, and its typical jerk, which counts
    where noise is correlated. live: of a window that moves on, in which faults that stay are not looked for. short: too
    short to tell whether the noise is uneven or correlated: it is taken for white.
    Raises ValueError when a component has no reading that agrees with its neighbours.
    """
    accepted = known.accepted.of(time_s, measurement)
    measurement, copied = without_copies(time_s, measurement, accepted)
    work = Work(len(time_s), 0 if live else WORK)  # a window that moves on is soon edited again
    decided = partial(_decided, time_s, known=known, segment_of=segment_of, work=work, white=short)
    for_lasting = for_lasting_faults(len(time_s))
    found = Understood(*decided(measurement, banned=np.zeros(measurement.shape, bool)))
    possible = found.record.possible
    if not live:
        found = without_lasting(found, measurement, decided, for_lasting)
    record, decision, steps, _, doubtful, rivals, scene, _, first = found
    if decision.stamp_s > 0:  # which explains a clock that seems to jump
        doubtful = [step for step in doubtful if step.component != CLOCK]
        rivals = [rival for rival in rivals if rival.component != CLOCK]
    if not record.fixed.jerk and not live:  # at the end of a window a patch may resemble motion
        decision, open_ = reassess_rejected(record, decision, for_lasting)
        rivals = [*rivals, *open_]
    decision = decision._replace(
        weight=np.where(accepted, 1.0, decision.weight), unexamined=decision.unexamined + for_lasting.passed_in_all
    )
    if segment_of is None and not short:
        decision = allow_for_colour(record, decision)
    log, first = record.weighted(decision.weight), decision.weight if first is None else first
    if known.jerk_psd is None:
        profile = fit_profile(log, decision.starts, decision.model, PROFILE_STEPS)
        decision = decision._replace(model=with_allowance(log, profile))
    shifts, read = tuple[Shift, ...](), log._replace(measurement=measurement)
    if scene is not None and steps:
        log, steps, shifts = refined(read, decision.model, scene.setting, steps, first)
    otherwise = () if scene is None else others(read, possible, decision.model, scene.setting, steps, rivals, first)
    leaning = [] if live else _one_sided(log, decision.model, record.rounding)
    shifts += tuple(Shift(one.component, 0, len(time_s), one.sigma) for one in leaning)
    said = tuple(
        rival for rival in rivals if rival.chosen != MOTION or rival.other != STEP if rival.gain < odds.LIKELIER
    )
    faults = Faults(copied, (*steps, *doubtful), shifts, tuple(leaning), said)
    log = one_sided.without(log, leaning)
    return Edited(log, decision.model, decision.starts, decision, faults, tuple(otherwise))


def _one_sided(log: Observations, model: Model, rounding: FloatArray) -> list[OneSided]:
    """The components with errors on one side, by readings that are spread over the log."""
    around = samples_around(log, median_level(model))
    residual, variance = residuals_near(log, model, one_sided.spread(len(log.time_s)), around)
    return one_sided.find(log.weight, residual, variance, rounding)


def _decided(
    time_s: FloatArray, measurement: FloatArray, known: Known, segment_of: Model | None, work: Work, white: bool,
    banned: NDArray[np.bool_],
) -> tuple[Record, Decision]:  # fmt: skip
    """The decisions on a log as if it had no steps, with a jerk profile. banned: (n, 3) readings of patches."""
    jerk_psd = known.jerk_psd
    rounding = rounding_sigma(measurement)
    screened, jumps_only, sigma, exact = screen(time_s, measurement, rounding)
    accepted = known.accepted.of(time_s, measurement)
    possible = np.isfinite(measurement) & ~banned & ~stuck_readings(measurement, sigma)
    possible |= accepted & np.isfinite(measurement)
    possible[:, 0] &= measurement[:, 0] > NO_RANGE_M  # no target is at the station, or behind it
    fixed = Fixed(np.isfinite(known.sigma) | exact | (segment_of is not None), jerk_psd is not None)
    coarse = np.where(rounding > COARSE * sigma, np.sqrt(12) * rounding, 0.0)
    uneven = uneven_noise.repeated(measurement, coarse)
    if known.uneven is not None:
        uneven = known.uneven if uneven is None else Uneven(uneven.times * known.uneven.times, uneven.late)
    trusted = screened if known.uneven is None else np.where(accepted, 1.0, screened)
    record = Record(
        time_s, measurement, possible, trusted * possible, sigma, fixed, known.gate, rounding, work, uneven, white,
        accepted,
    )  # fmt: skip
    begin = partial(_first, segment_of=segment_of, known=known)
    first = begin(record, record.screened)
    if segment_of is None and _forgets(*first):  # outliers that screening has missed may resemble motion
        first = likelier(first, begin(record, record.screened, shortest=REMEMBERED))
    record, decision = with_less_noise(first, begin)
    found = _examined(record, decision, known)
    for finer in finer_noise((record, decision), begin) if not _rejects_many(*found, MOST_REJECTED) else ():
        other = _examined(*finer, known)
        if preferred(found, other) is found:
            break
        found = other
    if jerk_psd is None and found[1].stamp_s == 0 and not found[1].settled:  # turns may have been taken for patches
        other = begin(record, jumps_only * possible)
        takes_in = (other[1].weight > found[1].weight).any()
        if takes_in and log_probability(*other) > log_probability(*found) - odds.HOPELESS:
            found = preferred(found, _examined(*other, known))
    elif not work.of_window and rejects_runs(*found):  # what screening took for patches was believed
        other = begin(record._replace(sigma=found[0].sigma), possible.astype(float))
        found = _nothing_screened(found, other, known)
    return found


def _nothing_screened(
    found: tuple[Record, Decision], other: tuple[Record, Decision], known: Known
) -> tuple[Record, Decision]:
    """The decisions from another start, if these are far likelier; a short log tells less, and is soon examined."""
    likely, least = log_probability(*found), min(odds.ANEW, odds.FEW_ANEW * found[0].possible.sum())
    if log_probability(*other) > likely + (least if least == odds.ANEW else -odds.HOPELESS):
        other = _examined(*other, known)
    return preferred(found, other) if log_probability(*other) > likely + least else found


def _forgets(record: Record, decision: Decision) -> bool:
    """Whether a filter with this model follows each reading."""
    scales = scales_of(record.weighted(decision.weight), decision.model.noise_variance)
    return scales.memory_samples(float(decision.model.jerk[0, 0])) < FORGETS


def _first(
    record: Record, weight: FloatArray, segment_of: Model | None, known: Known, shortest: float = 0.0
) -> tuple[Record, Decision]:
    """The decisions that are made from these weights (n, 3) on, and from the noise of the record. shortest: see
    `first_jerk`."""
    log, noise = record.weighted(weight), np.where(np.isfinite(known.sigma), known.sigma, record.sigma) ** 2
    jerk_psd = known.jerk_psd
    if segment_of is not None and (segment_of.coloured or jerk_psd is not None):  # no level is sought
        model = segment_of
    else:
        level = first_jerk(log, noise, shortest) if jerk_psd is None else jerk_psd
        model = Model(noise if segment_of is None else segment_of.noise_variance, isotropic(level))
    rates = np.tile(np.array(outlier_chain.START_RATES), (3, 1))
    starts = find_starts(log, model.noise_variance, float(model.jerk[0, 0]))
    begun = Decision(weight, model, starts, rates)
    found = record, decide(record, begun, tune_first=True)
    if _may_miss_turns(found, begun):
        whole = record._replace(whole=True)
        other = whole, decide(whole, begun, tune_first=True)
        found = likelier(found, other) if _much_stiffer(found[1], other[1]) else found
    return found


def _may_miss_turns(found: tuple[Record, Decision], begun: Decision) -> bool:
    """Whether the spans that stand for a long log showed far less jerk than the search for it began with: the target
    may turn between them only, and its turns be taken for outliers."""
    return _much_stiffer(found[1], begun) and not found[0].whole and is_long(found[0].time_s)


def _much_stiffer(one: Decision, other: Decision) -> bool:
    return bool(one.model.jerk[0, 0] * STIFFER < other.model.jerk[0, 0])


def _examined(record: Record, decision: Decision, known: Known) -> tuple[Record, Decision]:
    """The decisions made again where the noise is not even, and where they do not explain the log."""
    found = (record, decision) if record.white else allow_for_tails(*_with_late_stamps(record, decision))
    for _ in range(0 if record.white else DRIFT_ROUNDS):
        before, found = found, likelier(found, allow_for_drift(*found))
        if _rejects_many(*before, REJECTED):
            grown = allow_for_drift(*before, rejected=True)
            if log_probability(*grown) > log_probability(*found) + (0.0 if found[1].drifts else odds.ANEW):
                found = grown
        if found is before or found[1].weight.sum() <= before[1].weight.sum():
            break
    return found if known.jerk_psd is not None else (found[0], reassess(*found))


def _rejects_many(record: Record, decision: Decision, share: float) -> bool:
    """Whether such a share is rejected of some component: its noise may be larger for a while."""
    rejected = (record.possible & (decision.weight <= 0)).sum(0)
    return bool((rejected > share * record.possible.sum(0)).any())


def _with_late_stamps(record: Record, decision: Decision) -> tuple[Record, Decision]:
    """The decisions made again if time stamps are late now and then, and a few of them by far more."""
    stamps, likeliest = late_stamps(record, decision), (record, decision)
    if stamps is None:
        return likeliest
    many = record.possible.sum() - decision.weight.sum() > MOST_LATE * record.possible.sum()
    for imprecise in IMPRECISE:
        found = allow_for_late_stamps(record, decision, stamps, imprecise)
        if many and log_probability(*found) < log_probability(record, decision) - odds.HOPELESS:
            continue  # they are patches of outliers
        for _ in range(STAMP_ROUNDS):
            before, found = found, preferred(found, allow_for_very_late_stamps(*found, imprecise, record))
            if found is before:
                break
        likeliest = preferred(likeliest, found)
    return likeliest
