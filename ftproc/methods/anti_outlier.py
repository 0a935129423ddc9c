"""The main method's filter: the anti-outlier UKF (Zuo et al. 2021 section 2.3), recursive or in two passes, over logs
of any length in memory that does not grow with them. The network's correction (section 2.2) works on its output and is
added by the pipeline.

Two-pass editing uses the record on both sides of a sample, but what lies far away says nothing of it: a long log is cut
into short ones that overlap, of which the middles are kept, and which are processed in parallel. Noise belongs to the
instrument and is found once, from spans that are spread over the log. Live and recursive editing see only what has come
so far (`live`).
"""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from ftproc.core import impact, threads
from ftproc.core.editing import two_pass
from ftproc.core.filtering import forward
from ftproc.core.filtering.initialization import WIDEST_BLIND_BRIDGE, find_starts
from ftproc.core.filtering.records import FilterRun, Model, Observations, Start
from ftproc.core.filtering.smoother import PATHS, STATES, SmootherRun, likelihood_of, smooth_log
from ftproc.core.identification import likelihood
from ftproc.core.identification.motions import motion_models, orbits
from ftproc.core.identification.motions.motion_models import Candidates, Chosen
from ftproc.core.identification.profile import ALLOWANCE, fit_profile, median_level, with_allowance
from ftproc.methods import bridging, live, preparing, scalars
from ftproc.methods.bridging import Bridged
from ftproc.methods.estimate import Estimate, Part, Readings, Recording, typical_interval
from ftproc.methods.widening import off_by, reaching, widened, worse_of
from ftproc.order_statistics import median
from ftproc.records import ISOLATED, PATCH, FloatArray
from ftproc.settings import FilterSettings

LONGEST_WHOLE = 60_000  # samples of a log that is edited as a whole
KEPT = 30_000  # samples of a segment, without its margins,
KEPT_MARGINS = 12  # or so many times its margin
MOST_PIECES = 20  # of a track: what is re-initialized so often shows no motion (two targets in turn: 115)
MOST_COURSES = 6  # about which a motion is linearised, each that to which the one before led
MARGIN_S, LEAST_MARGIN, MOST_MARGIN = 60.0, 1_000, 10_000  # s and samples on each side of a segment


def estimate(readings: Readings, settings: FilterSettings) -> Estimate:
    """Filter, edit and (if asked) smooth a log as a whole, by the way of editing that the settings name."""
    if settings.editing == "two-pass":
        return edited_twice(readings, settings)
    if settings.editing in ("live", "forward"):
        return live.smoothed(readings, settings) if settings.smooth else live.whole(readings, settings)
    return preparing.unedited(readings, settings)


def parts(record: Recording, settings: FilterSettings) -> Iterator[Part]:
    """The estimate of a log, a stretch at a time. Raises ValueError where there is no first state."""
    if settings.editing in ("live", "forward") and not settings.smooth:
        yield from live.parts(record, settings)
    elif settings.editing == "two-pass" and len(record) > LONGEST_WHOLE:
        work = partial(_segment, record, settings, usual_of(record, settings))
        yield from threads.in_order(work, segments(record))
    else:
        yield Part(estimate(record.whole(), settings), 0, 0, len(record))


def edited_twice(readings: Readings, settings: FilterSettings, usual: Model | None = None) -> Estimate:
    """Two-pass editing. usual: of a segment, what is usual in the log, see `core.editing.two_pass`."""
    known = preparing.what_is_known(readings, settings)
    found = edited = readings.edited or two_pass.edit(readings.time_s, readings.measurement, known, usual)
    specified = np.isfinite(known.sigma)
    log, model, how = edited.log, edited.model, (settings.gate, settings.jerk_psd_m2ps5 is not None)
    channel = height = None
    if readings.range_rate is not None:
        given = readings.range_rate, readings.rate_interval_mps
        accepted = readings.accepted.rates(readings.time_s)
        log, model, channel = scalars.fit(log, model, edited.starts, given, how, accepted)
    if readings.heights is not None:
        accepted = readings.accepted.heights(readings.time_s)
        log, model, height = scalars.fit_heights(log, model, edited.starts, readings.heights, how, accepted)
    channels = [each for each in (channel, height) if each is not None and not each.why]
    used = tuple(each.rates if each.used is None else each.used for each in channels)
    told = tuple(each.silent if each is height else one for each, one in zip(channels, used, strict=True))
    among = preparing.motions(settings, settings.site, readings.north)
    if len(edited.starts) > MOST_PIECES and motion_models.WHITE in among.names:
        among = motion_models.ONLY_WHITE
    again = preparing.re_initialized(edited.starts)
    over = _bridged(log, model, edited.starts, settings.jerk_psd_m2ps5 is not None)
    label = preparing.labels(np.where(over.read, 0.0, over.log.weight), log.measurement)

    def chosen(among: Candidates, white: Model) -> Chosen:
        found = motion_models.choose(over.log, over.starts, white, among, specified)
        return found if channel is None or channel.used is None else found.with_beside(told)

    wanted = PATHS if settings.smooth else STATES  # cheap, proves the correction, and says what could be had
    motion = chosen(among, over.model)
    others, edited = edited.others, edited._replace(log=over.log, model=motion.white, starts=over.starts)
    white = chosen(motion_models.ONLY_WHITE, motion.white) if motion_models.WHITE in among.names else motion
    motion, (run, smoothed, left) = _followed(motion, white, wanted)
    if height is not None and not height.why:
        motion = motion.with_beside(used)
        if not how[1]:
            motion = motion._replace(model=scalars.upward(motion.log, motion.model, motion.starts))
        run, smoothed, left = _with_motion(motion, motion.model, wanted)
    for other in _as_likely(edited, known, run):
        filtered, other_smoothed, _ = _with_motion(motion, other, wanted)
        run = worse_of(run, filtered)
        smoothed = smoothed and other_smoothed and worse_of(smoothed, other_smoothed)
    for off in () if height is None or height.why else height.off_sigma_m.T:
        moved = motion.with_beside((*used[:-1], used[-1]._replace(value=used[-1].value + off)))
        filtered, other_smoothed, _ = _with_motion(moved, motion.model, wanted)
        run = off_by(run, np.nan_to_num(filtered.state - run.state))
        if smoothed is not None and other_smoothed is not None:
            smoothed = off_by(smoothed, np.nan_to_num(other_smoothed.state - smoothed.state))
    rows = 1 + int(np.flatnonzero(edited.weight.any(1))[-1])
    fixed = settings.jerk_psd_m2ps5 is not None
    for away in (*_elsewhere(edited, others, fixed), *_by_rival(motion, smoothed)):
        run, smoothed = reaching(run, away, rows), smoothed and reaching(smoothed, away, rows)
    run, smoothed = over.filtered(run), smoothed and over.smoothed(smoothed)
    if shifts := edited.faults.shifts:
        run, smoothed = widened(run, shifts), smoothed and widened(smoothed, shifts)
    could_be = hindsight = None
    if smoothed is not None and not settings.smooth:
        if usual is None:  # else it is of one segment
            could_be = median(np.sqrt((smoothed.sigma[:, :3] ** 2).sum(1)))
        hindsight, smoothed = smoothed.state, None
    decision, seen = edited.decision, iter(left)
    channel, height = (each if each is None or each.why else each.filtered(next(seen)) for each in (channel, height))
    stand_still = decision.settled or not np.isin(label, (ISOLATED, PATCH)).any()  # else where would one look?
    return Estimate(
        run, label, motion.model, smoothed, again, stand_still,
        unexamined=decision.unexamined, stamp_s=decision.stamp_s, drifts=decision.drifts,
        alternative=decision.alternative,
        faults=edited.faults, motion=motion, smoothed_sigma_m=could_be, hindsight=hindsight,
        range_rate=channel, height=height, last=_last_of(motion, smoothed or run),
        edited=found if usual is None else None,
    )  # fmt: skip


def _bridged(log: Observations, model: Model, starts: list[Start], fixed: bool) -> Bridged:
    """The log with curves through the gaps that are too long to bridge, and the process noise that it asks for there.
    fixed: whether that is known. As it was where that diverges."""
    found = bridging.bridged(log, model, starts)
    if fixed or len(found.starts) == len(starts):
        return found
    likeliest = found.model._replace(jerk=found.model.jerk / ALLOWANCE)
    fitted = fit_profile(found.log, found.starts, likeliest, motion_models.STEPS)
    found = found._replace(model=with_allowance(found.log, fitted))
    through = forward.filter_log(found.log, found.model, found.starts).state
    return found if np.isfinite(through).all() else bridging.none(log, model, starts)


def _followed(
    motion: Chosen, white: Chosen, wanted: int | None
) -> tuple[Chosen, tuple[FilterRun, SmootherRun | None, FloatArray]]:
    """A motion and what comes of it, or of white jerk, if the filter follows that better: it knows no course but its
    own estimate, and may diverge where the smoother is right about the course; or if the smoother leaves the course
    about which it is linearised, and that to which it leads, and so on. wanted: of the smoother."""
    found = _with_motion(motion, motion.model, wanted)
    near = orbits.NEAR if motion.name == motion_models.ORBITAL else WIDEST_BLIND_BRIDGE
    for _ in range(MOST_COURSES):
        if motion.name == motion_models.WHITE or not _leaves_its_course(motion, found[1], near):
            break
        motion = motion.about_its_own()
        found = _with_motion(motion, motion.model, wanted)
    if motion.name != white.name:
        starts = preparing.smoothed_starts(white.log, white.model, white.starts)
        other = likelihood_of(white.log, white.model.causal, starts)
        if other > found[0].log_likelihood or _leaves_its_course(motion, found[1], WIDEST_BLIND_BRIDGE):
            return white, _with_motion(white, white.model, wanted)
    return motion, found


def _leaves_its_course(motion: Chosen, smoothed: SmootherRun | None, near: float) -> bool:
    """Whether a smoothed track goes farther away than near, times its range, from the course about which its model is
    linearised."""
    if smoothed is None:
        return False
    course = motion.model.motion.course if motion.row is None else motion.model.motion.course[motion.row]
    away, range_m = ((each[:, :3] ** 2).sum(1) for each in (smoothed.state - course, course))
    return not bool((away < near**2 * range_m).all())


def _with_motion(motion: Chosen, model: Model, wanted: int | None) -> tuple[FilterRun, SmootherRun | None, FloatArray]:
    """The filter and, if asked, the smoother over an edited log, by a model; and what the filter leaves of its scalars,
    (kinds, n, WIDTH), see `core.filtering.beside`. wanted: of the smoother."""
    starts = preparing.smoothed_starts(motion.log, model, motion.starts)
    run, left = forward.filter_with_beside(motion.log, model.causal, starts)
    left = left if motion.row is None or not len(left) else left[:, motion.row]
    smoothed = motion.of_rows(smooth_log(motion.log, model, motion.starts, wanted)) if wanted is not None else None
    return motion.of_rows(run), smoothed, left


def _last_of(motion: Chosen, best: FilterRun | SmootherRun) -> Start | None:
    if not motion.model.motion.pressed:
        return None
    return impact.end_of(motion.log, motion.model, motion.starts, best.state[-1], best.sigma[-1])


def _as_likely(edited: two_pass.Edited, known: two_pass.Known, run: FilterRun) -> Iterator[Model]:
    """Other models of noise that the log does not exclude, for which the sigmas allow."""
    decision, free = edited.decision, np.isnan(known.sigma)
    slowest = decision.slowest if decision.alternative is None else decision.alternative.slowest
    most = likelihood.most_noise(edited.log, edited.model, edited.starts, np.where(free, run.innovation_sigma, 0.0))
    yield from (other._replace(jolts=edited.model.jolts) for other in (slowest, most) if other is not None)


def _elsewhere(edited: two_pass.Edited, others: Sequence[Observations], fixed: bool) -> Iterator[FloatArray]:
    """(n, 9) how far away from the track that which follows from each other understanding is. fixed: as in
    `_bridged`."""
    if not others:
        return
    state = smooth_log(edited.log, edited.model, edited.starts, STATES).state
    for other in others:
        with contextlib.suppress(ValueError):  # a component has too few readings
            starts = find_starts(other, edited.model.noise_variance, median(edited.model.jerk[:, 0]))
            over = _bridged(other, edited.model, starts, fixed)
            away = smooth_log(over.log, over.model, over.starts, STATES).state - state
            yield np.where(np.isfinite(away), away, 0.0)


def _by_rival(motion: Chosen, smoothed: SmootherRun | None) -> Iterator[FloatArray]:
    """(n, 9) how far away from a smoothed track that by another motion is which explains the log about as well."""
    rival = motion.rival
    if rival is not None and smoothed is not None:
        away = rival.of_rows(smooth_log(rival.log, rival.model, rival.starts, STATES)).state - smoothed.state
        yield np.where(np.isfinite(away), away, 0.0)


def usual_of(record: Recording, settings: FilterSettings) -> Model | None:
    """Noise and typical jerk of a log: the medians over spans spread over it; None if no span could be edited."""
    found = [e for e in threads.in_order(partial(_span, record, settings), record.spans()) if e is not None]
    if not found:
        return None
    variance, markov = (
        np.median([getattr(edited.model, name) for edited in found], 0)
        for name in ("noise_variance", "markov_variance")
    )
    tau_s = np.exp(np.median([np.log(edited.model.tau_s) for edited in found], 0))
    levels = np.array([median_level(edited.model).jerk for edited in found])
    jerk = np.exp(np.median(np.log(levels), 0))
    return Model(variance, jerk, markov_variance=markov, tau_s=tau_s)


def _span(record: Recording, settings: FilterSettings, rows: slice) -> two_pass.Edited | None:
    readings = record.part(rows)
    known = preparing.what_is_known(readings, settings)
    try:
        return two_pass.edit(readings.time_s, readings.measurement, known)
    except ValueError:  # a component has too few readings in this span
        return None


def segments(record: Recording) -> list[tuple[int, int]]:
    """First and one past the last sample of what is kept of each segment, all about as long. Their number is even, so
    that two threads end together."""
    kept = max(KEPT, KEPT_MARGINS * margin_of(record))
    count = max(2 * round(len(record) / kept / 2), 1)
    edges = np.linspace(0, len(record), count + 1).astype(int)
    return [(int(low), int(high)) for low, high in itertools.pairwise(edges)]


def _segment(record: Recording, settings: FilterSettings, usual: Model | None, span: tuple[int, int]) -> Part:
    """The estimate of samples [low, high) of a log, made with the readings around them.

    Where these do not tell where the track is (a component is missing for long), the margins are widened.
    """
    low, high = span
    margin = margin_of(record)
    while True:
        first, last = max(low - margin, 0), min(high + margin, len(record))
        whole = last - first == len(record)
        try:
            estimate = edited_twice(record.part(slice(first, last)), settings, usual)
        except ValueError:
            if whole:
                raise
        else:
            if first == 0 or _begins(estimate) <= low - first:
                return Part(estimate, first, low - first, high - first)
        margin *= 4


def margin_of(record: Recording) -> int:
    """Samples that a segment is longer on each side than what is kept of it."""
    interval_s = typical_interval(record.time_s)
    wanted = MARGIN_S / interval_s if interval_s > 0 else MOST_MARGIN
    return int(np.clip(wanted, LEAST_MARGIN, MOST_MARGIN))


def _begins(estimate: Estimate) -> int:
    """The sample of the first start; those before it were extrapolated."""
    return max(int(np.argmax(estimate.run.since_start > 0)) - 1, 0)
