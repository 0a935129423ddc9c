"""The model of motion that the log's own readings choose, once it is decided which of them are good.

Each model is fitted from the jerk profile of white jerk, linearised about the track that was smoothed with it, and the
likeliest is kept: the likelihood counts what is known beforehand of the profile and of its ratios.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ftproc.core import odds
from ftproc.core.filtering.records import FilterRun, Model, Observations, Scalars, Start, Uneven
from ftproc.core.filtering.smoother import SmootherRun, likelihood_of, smooth_log
from ftproc.core.identification import decimation
from ftproc.core.identification.motions import falling, jolts, orbits
from ftproc.core.identification.motions.falling import Logged, finite
from ftproc.core.identification.profile import ALLOWANCE, climbed, roughness, with_allowance
from ftproc.core.identification.scales import scales_of
from ftproc.core.model.forces import AT_REST_MPS
from ftproc.core.model.motion import WHITE_JERK, Motion
from ftproc.records import FloatArray, IntArray

Run = TypeVar("Run", FilterRun, SmootherRun)

WHITE, ORBITAL = "white-jerk", "orbital"
MODELS = {
    WHITE: WHITE_JERK,
    "turning-force": Motion(acts=True, turns=1.0),
    "ballistic": Motion(acts=True, turns=1.0, pressed=1.0),
    ORBITAL: Motion(acts=True),
}
NOTHING = np.zeros(3, bool)
STEPS = 3  # of the search for a profile
CLOSE = 2 * odds.SURE  # with less, white jerk is as good as another model, or that as good as white jerk
FARTHEST_TURN = 0.2  # rad, over which the motion goes on in one step
MOST_STEPS = 100  # in a gap
FADING = (0.5, 1.0)  # of gravity by speed: the rates at which the acceleration along the path may fade
SETTLED = 4.0  # times the variance of a smoothed acceleration: that of a start which nobody doubts much


class Candidates(NamedTuple):
    """The models of motion to choose from, by their names in MODELS, and (2, 3) the earth of a `Motion`, where the site
    of the station is known; it has to be found otherwise."""

    names: tuple[str, ...]
    earth: FloatArray | None = None


ONLY_WHITE = Candidates((WHITE,))


class Chosen(NamedTuple):
    """The motion of a log.

    name: in MODELS. model: with the profile that was fitted, and, of an orbit, the noise. gain: by how much more likely
    the log is than with white jerk, in log-likelihood. log, starts: those to run over, with steps in the gaps. white:
    the model with white jerk from which it was fitted. row:
    (n,) where the log's own samples are among these. rival: another motion that explains the log about as well.
    """

    name: str
    model: Model
    gain: float
    log: Observations
    starts: list[Start]
    white: Model
    row: IntArray | None = None
    rival: Chosen | None = None

    def share(self, of: float) -> Chosen:
        """What such a share of the samples has of the gain."""
        return self._replace(gain=of * self.gain)

    def with_beside(self, scalars: tuple[Scalars, ...]) -> Chosen:
        """The same with these scalars of the log's own samples in place of its own."""
        row, n = self.row, len(self.log.time_s)
        spread = scalars if row is None else tuple(each.spread(row, n) for each in scalars)
        rival = None if self.rival is None else self.rival.with_beside(scalars)
        return self._replace(log=self.log._replace(beside=spread), rival=rival)

    def about_its_own(self) -> Chosen:
        """The same, linearised about the track to which it leads."""
        track = smooth_log(self.log, self.model, self.starts).state
        return self._replace(model=self.model._replace(motion=self.model.motion.about(track)))

    def abrupt_s(self) -> list[float]:
        """The times of the abrupt changes of the acceleration."""
        return self.model.jolts.changes_s(self.model.knot_s)

    def log_probability(self) -> float:
        """Of the readings and of the jerk profile."""
        return likelihood_of(self.log, self.model, self.starts) - roughness(self.model)

    def of_rows(self, run: Run) -> Run:
        """A run over the log with its steps, of the log's own samples."""
        return of_rows(run, self.row)


def of_rows(run: Run, row: IntArray | None) -> Run:
    """A run at some of its samples; None: at all."""
    if row is None:
        return run
    own: dict[str, Any] = {name: each[row] for name, each in run._asdict().items() if isinstance(each, np.ndarray)}
    return run._replace(**own)


def choose(
    log: Observations, starts: list[Start], white: Model, among: Candidates, known: NDArray[np.bool_] = NOTHING
) -> Chosen:
    """The likeliest motion of a log, with abrupt changes where it tells some. white: the model with white jerk, whose
    profile has its allowance. known: (3,) which noise the user has specified.

    A single name is taken without asking how likely it is; of white jerk, without abrupt changes.
    """
    if not [name for name in among.names if name != WHITE]:
        return Chosen(WHITE, white, 0.0, log, starts, white)
    found = _chosen(log, starts, white, among, known)
    with_changes = jolts.told(log, starts, white)
    if with_changes is None:
        return found
    other = _chosen(log, starts, with_changes, among, known)
    return other if other.log_probability() > found.log_probability() + odds.SURE else found


def _chosen(
    log: Observations, starts: list[Start], white: Model, among: Candidates, known: NDArray[np.bool_]
) -> Chosen:
    names = among.names
    others = among._replace(names=tuple(name for name in names if name != WHITE))
    fitted, short, course = _fitted(log, starts, white, others, known)
    best = max(fitted, key=lambda each: finite(each.gain))
    other = Chosen(WHITE, white, best.gain, log, starts, white)
    if best.gain > odds.SURE or WHITE not in names:
        found = _about_its_track(best, log, short, course, white)
        return found._replace(rival=other if WHITE in names and best.gain < CLOSE else None)
    rival = _about_its_track(best, log, short, course, white, again=False) if best.gain > 0 else None
    return other._replace(rival=rival)


def _fitted(
    log: Observations, starts: list[Start], white: Model, others: Candidates, known: NDArray[np.bool_]
) -> tuple[list[Chosen], Observations, FloatArray]:
    """Each of these models, fitted to the log with neighbours merged; this log, and the course (m, 9) along it."""
    scales = scales_of(log, white.noise_variance)
    likeliest = white._replace(jerk=white.jerk / ALLOWANCE)
    count = 1 if log.sites is not None else decimation.how_many(scales, likeliest, white.knot_s)
    short = Logged(*decimation.merged(log, starts, count), scales)
    _, base = climbed(short.log, short.starts, likeliest, STEPS, scales)
    course = smooth_log(short.log, white, short.starts).state
    turn = orbits.FARTHEST_TURN if orbits.may_be(course) else FARTHEST_TURN
    dense, own, row = with_steps(log, starts, course, turn)
    if orbits.may_be(course):  # whose readings alone are too far apart to follow it
        short = Logged(*with_steps(short.log, short.starts, course, turn)[:2], scales)
        course = smooth_log(short.log, white, short.starts).state
    found = list[Chosen]()
    names = others.names
    for name in names:
        motion = MODELS[name]
        if len(names) > 1 and not _may_be(name, course):
            continue
        begin = likeliest._replace(motion=motion.about(course))
        if name == ORBITAL:
            model, likelihood = orbits.fit(
                orbits.Track(*short[:2], known, others.earth), begin, base if len(names) > 1 else -math.inf
            )
        else:
            model, likelihood = falling.fit(short, begin) if motion.pressed else _steered(short, begin, base)
        found.append(Chosen(name, model, likelihood - base, dense, own, white, row))
    return found, short.log, course


def _about_its_track(
    found: Chosen, log: Observations, short: Observations, course: FloatArray, white: Model, again: bool = True
) -> Chosen:
    """A motion that was fitted to a short log along a course (m, 9), linearised about the track of the log that it is
    for; again: and about the track that follows."""
    track = course if found.log is short else smooth_log(found.log, white, found.starts).state
    found = found._replace(model=found.model._replace(motion=found.model.motion.about(track)))
    # Else the samples are far closer than the motion is followed.
    return found.about_its_own() if short is log and again else found


def _may_be(name: str, course: FloatArray) -> bool:
    """Whether a motion is worth a trial, by a course (n, 9): an orbit is one above the air, and nothing else is."""
    if orbits.may_be(course) or name == ORBITAL:
        return orbits.may_be(course) and (name == ORBITAL or not MODELS[name].turns)
    return not MODELS[name].pressed or falling.falls(course)


def _steered(short: Logged, model: Model, base: float) -> tuple[Model, float]:
    """The likeliest profile from this one on, with its allowance, and the likelihood. Where that is beyond a base, the
    acceleration along the path may fade."""
    model, likelihood = climbed(*short[:2], model, STEPS, short.scales)
    if finite(likelihood) > base + odds.SURE:
        faded = _fading(short, model)
        if faded.motion.fades > 0:
            model, likelihood = climbed(*short[:2], faded, STEPS, short.scales)
    return with_allowance(short.log, model, short.scales), likelihood


def _fading(short: Logged, model: Model) -> Model:
    """The same with the likeliest rate at which the acceleration along the path fades. It begins as the track does:
    else what is saved is the doubt about an acceleration that has soon faded anyway."""
    heads = smooth_log(short.log, model, short.starts).heads
    starts = [_settled(*each) for each in zip(short.starts, heads, strict=True)]
    found, least = model, likelihood_of(short.log, model, starts) + odds.SURE
    for fades in FADING:
        faded = model._replace(motion=model.motion._replace(fades=fades))
        likelihood = finite(likelihood_of(short.log, faded, starts))
        if likelihood > least:
            found, least = faded, likelihood
    return found


def _settled(start: Start, head: Start) -> Start:
    """A start with the acceleration of the smoothed track, as if it were hardly known."""
    covariance = start.covariance.copy()
    covariance[6:], covariance[:, 6:] = 0.0, 0.0
    covariance[6:, 6:] = SETTLED * head.covariance[6:, 6:]
    return Start(start.sample, np.append(start.state[:6], head.state[6:]), covariance)


def with_steps(
    log: Observations, starts: list[Start], course: FloatArray, turn: float = FARTHEST_TURN
) -> tuple[Observations, list[Start], IntArray | None]:
    """The log with samples without readings in its gaps, so that no step turns too far, its starts, and where its own
    samples are; None where nothing was added. course: (m, 9) states along it. turn: rad, of a step."""
    speed = np.sqrt((course[:, 3:6] ** 2).sum(1) + AT_REST_MPS**2)
    fastest = float((np.sqrt((course[:, 6:] ** 2).sum(1)) / speed).max())
    interval = np.diff(log.time_s)
    with np.errstate(invalid="ignore"):
        pieces = np.clip(np.nan_to_num(np.ceil(interval * fastest / turn)), 1, MOST_STEPS).astype(np.int64)
    if not (pieces > 1).any():
        return log, starts, None
    row = np.append(0, np.cumsum(pieces))
    number = np.arange(row[-1] + 1)
    time_s = np.interp(number, row, log.time_s)
    measurement, weight = np.full((len(number), 3), np.nan), np.zeros((len(number), 3))
    time_s[row], measurement[row], weight[row] = log.time_s, log.measurement, log.weight
    uneven = None if log.uneven is None else Uneven.none(len(number))
    if log.uneven is not None and uneven is not None:
        uneven.times[row], uneven.late[row] = log.uneven
    sites = None
    if log.sites is not None:
        sites = log.sites.part(np.searchsorted(row, number, "right") - 1)
    moved = [start._replace(sample=int(row[start.sample])) for start in starts]
    beside = tuple(each.spread(row, len(number)) for each in log.beside)
    about = None
    if log.about is not None:
        about = np.full((len(number), 3), np.nan)
        about[row] = log.about
    return Observations(time_s, measurement, weight, uneven, sites, beside, about), moved, row
