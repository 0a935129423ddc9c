"""The figures of a run's summary, collected part by part, so that a log of any length needs little memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ftproc.core.components import any_of, sums, totals
from ftproc.core.impact import heights
from ftproc.core.model.frames import from_cartesian, measurement_sigma
from ftproc.files.moments import NO_ZONE
from ftproc.methods.estimate import ASSUMED_READING, typical_interval
from ftproc.order_statistics import median
from ftproc.quality import consistency, verdict
from ftproc.quality.components import Component, Scalars
from ftproc.quality.faults import FaultStatistics, clock_set_back
from ftproc.records import COMPONENTS, GOOD, FloatArray, MeasurementLog
from ftproc.scoring.figures import changes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ftproc.core.filtering.records import Start
    from ftproc.methods.estimate import Estimate
    from ftproc.methods.height.heights import Common

UNITS = ("m", "rad", "rad")
NO_HEIGHTS = "the heights beside the elevations are not used: only the main method's two-pass editing uses them"
GAP_INTERVALS = 3.0  # median intervals that make a gap
MOST_KEPT = 250_000  # samples whose sigmas are kept; of more, the largest of every few


class RunStatistics:
    """Figures of one log, to which its parts are added in their order. absent: components missing throughout. height:
    what stands for the elevation, if something does."""

    def __init__(self, log: MeasurementLog, absent: Sequence[int], height: Common | None = None) -> None:
        self.log, self.absent, self.height = log, absent, height
        self.beside = dict[str, Scalars]()
        self.zone_stated = NO_ZONE not in log.understood.get("doubts", ())
        self.every = 1 + (len(log) - 1) // MOST_KEPT
        self.interval_s = typical_interval(log.time_s)
        self.components = [Component(self.every) for _ in COMPONENTS]
        self.gaps, self.longest_gap_s, self.last_time = 0, 0.0, np.nan
        self.last_cleaned, self.changed, self.changes = np.full((1, 3), np.nan), np.zeros(3), np.zeros(3, int)
        self.nis_sum, self.nis_count, self.used, self.rows_used = 0.0, 0, 0, 0
        self.times: list[FloatArray] = []
        self.sigmas: list[FloatArray] = []
        self.jerk: list[FloatArray] = []
        self.motions: dict[str, int] = {}
        self.motion_gain, self.abrupt_s = 0.0, list[float]()
        self.acceleration = 0.0  # m/s2, that the target had at least
        self.last: Start | None = None
        self.lowest_m = np.inf  # of the heights, with their 1-sigma
        self.reacquired, self.unexamined, self.stamp_s, self.drifts = 0, 0, 0.0, False
        self.slow_noise_s, self.slow_noise_likelier, self.slow_noise_separable = 0.0, False, True
        self.faults = FaultStatistics()
        self.screened_out, self.overlooked = 0, 0
        self.converged: bool | None = None
        self.left_behind: list[dict[str, Any]] = []
        self.smoothed_sigma_m: float | None = None
        self.largest_m, self.largest_sigma = 0.0, 0.0
        self.outside, self.rows, self.parts, self.unknown = 0.0, 0, 0, 0

    def add(
        self, time_s: FloatArray, estimate: Estimate, cleaned: FloatArray, correction: FloatArray, outside: float
    ) -> None:
        """Add a part: time_s (n,), its estimate, cleaned range, azimuth and elevation (n, 3) as published, correction
        (n, 6), and the share outside the network's training."""
        run = estimate.run
        best = run if estimate.smoothed is None else estimate.smoothed
        used = run.weight > 0
        used[:, list(self.absent)] = False
        with np.errstate(invalid="ignore", divide="ignore"):
            squares = np.square(run.innovation / run.innovation_sigma)
        for c, component in enumerate(self.components):
            component.add_labels(time_s, estimate.label[:, c])
            component.add_innovations(squares[:, c], run.innovation_sigma[:, c], used[:, c])
            tested = used[:, c] & np.isfinite(squares[:, c])
            if not (squares[tested, c] > consistency.FAR_OFF**2).any():
                continue
            left = consistency.left_behind(time_s[tested], squares[tested, c])
            self.left_behind += [{"component": COMPONENTS[c], **each} for each in left]
        self._add_gaps(time_s)
        self._add_changes(cleaned)
        if not self.absent:
            self.acceleration = max(self.acceleration, consistency.least_acceleration(best.state, best.sigma))
        finite = np.isfinite(run.nis)
        self.nis_sum += float(run.nis[finite].sum())
        self.nis_count += int(finite.sum())
        self.used += int(used.sum())
        self.rows_used += int(any_of(used).sum())
        self._add_sigmas(time_s, self._tested_sigmas(best.state, best.sigma, best.los_sigma))
        self.jerk.append(estimate.model.jerk.mean(1))
        self.model = estimate.model
        self.last = estimate.last
        if not self.absent:
            above = heights(best.state[:, :3]) + best.sigma[:, 2]
            self.lowest_m = float(np.min(above, initial=self.lowest_m, where=np.isfinite(above)))
        if estimate.motion is not None:
            name = estimate.motion.name
            self.motions[name] = self.motions.get(name, 0) + len(time_s)
            self.motion_gain += estimate.motion.gain
            self.abrupt_s += [each for each in estimate.motion.abrupt_s() if time_s[0] <= each <= time_s[-1]]
        self.reacquired += len(estimate.reacquired)
        if estimate.settled is not None:
            self.converged = estimate.settled and self.converged is not False
        self.stamp_s = max(self.stamp_s, estimate.stamp_s)
        self.drifts |= estimate.drifts
        if estimate.alternative is not None:
            other = estimate.alternative.model
            self.slow_noise_likelier |= estimate.alternative.likelier
            self.slow_noise_separable &= estimate.alternative.separable
            self.slow_noise_s = max(self.slow_noise_s, float(other.tau_s[other.markov_variance > 0].max()))
        self.unexamined += estimate.unexamined
        self.smoothed_sigma_m = None if self.absent else estimate.smoothed_sigma_m
        if estimate.screened_out is not None:
            self.screened_out += int(estimate.screened_out.sum())
            self.overlooked += int((estimate.screened_out & (estimate.label == GOOD)).sum())
        for name, channel in (("range_rate", estimate.range_rate), ("height", estimate.height)):
            if channel is not None:
                self.beside.setdefault(name, Scalars(self.every)).add(time_s, channel)
        if estimate.faults is not None:
            self.faults.add(time_s, estimate.faults)
        if correction.any():
            self.largest_m = max(self.largest_m, float(np.sqrt(sums(correction[:, :3] ** 2).max())))
            changed, sigma = np.abs(correction), best.sigma[:, : correction.shape[1]]
            ratio = np.divide(changed, sigma, out=np.zeros_like(changed), where=changed > 0)
            self.largest_sigma = max(self.largest_sigma, float(np.nanmax(ratio)))
        self.outside += outside * len(time_s)
        self.rows += len(time_s)
        self.parts += 1
        self.unknown += 0 if estimate.known is None else int((~estimate.known).sum())

    def _add_gaps(self, time_s: FloatArray) -> None:
        interval = np.diff(time_s, prepend=self.last_time) if self.rows else np.diff(time_s)
        self.last_time = float(time_s[-1])
        if self.interval_s > 0 and (gaps := interval[interval > GAP_INTERVALS * self.interval_s]).size:
            self.gaps += len(gaps)
            self.longest_gap_s = max(self.longest_gap_s, float(gaps.max()))

    def _add_changes(self, cleaned: FloatArray) -> None:
        change = changes(np.concatenate([self.last_cleaned, cleaned]))
        known = np.isfinite(change)
        self.changed += totals(np.where(known, change, 0.0))
        self.changes += totals(known)
        self.last_cleaned = cleaned[-1:].copy()

    def _average_gradient(self) -> dict[str, float | None]:
        """F of Zuo et al. 2021, eq. 18; None where no two neighbours have a value."""
        pairs = zip(COMPONENTS, UNITS, self.changed, self.changes, strict=True)
        return {f"{name}_{unit}": float(total / count) if count else None for name, unit, total, count in pairs}

    def _tested_sigmas(self, state: FloatArray, sigma: FloatArray, los_sigma: FloatArray) -> FloatArray:
        """(n, 3) 1-sigma of the position m; where it is not observable of the readings m, rad, rad, those of absent
        ones zero."""
        if not self.absent:
            return sigma[:, :3]
        found = measurement_sigma(from_cartesian(state[:, :3]), los_sigma[:, :3])
        found[:, list(self.absent)] = 0.0
        return found

    def _add_sigmas(self, time_s: FloatArray, sigma: FloatArray) -> None:
        groups = -(-len(time_s) // self.every)
        size = np.zeros(groups * self.every)
        scale = (1.0, ASSUMED_READING[0], ASSUMED_READING[0]) if self.absent else (1.0, 1.0, 1.0)
        size[: len(time_s)] = sums((sigma * scale) ** 2)
        chosen = self.every * np.arange(groups) + size.reshape(groups, self.every).argmax(1)
        self.times.append(time_s[chosen])
        self.sigmas.append(sigma[chosen])

    def summary(self, correction: Mapping[str, Any]) -> dict[str, Any]:
        """The figures with the verdict on them, JSON-serialisable; units are in the names. correction: what is said of
        the model beside its figures."""
        log, absent, model = self.log, self.absent, self.model
        components: dict[str, Any] = {}
        for c, name in enumerate(COMPONENTS):
            noise, unit = float(np.sqrt(model.reading_variance[c])), UNITS[c]
            part = {
                **self.components[c].counts(),
                **self.faults.of_component(c),
                f"noise_{unit}": noise if c not in absent else None,
                "noise_correlation": float(model.correlation(self.interval_s)[c]),
                **self.components[c].consistency(noise),
            }
            if c == 2 and self.height is not None and not absent:
                name, part = "height", {**part, "noise_m": noise * self.height.range_m}
                del part["noise_rad"]
            components[name] = part
        components |= {name: each.figures(name) for name, each in self.beside.items() if each.used}
        psd = np.concatenate(self.jerk)
        jerk = {"lowest": float(psd.min()), "median": median(psd), "highest": float(psd.max())}
        time_s, sigma = np.concatenate(self.times), np.concatenate(self.sigmas)
        figures = {
            "rows": len(log),
            "rows_in_file": log.rows_in_file,
            "rows_without_time": len(log.rows_without_time),
            "first_row_without_time": log.rows_without_time[0] if log.rows_without_time else None,
            "rows_out_of_order": log.rows_out_of_order,
            "duplicate_times": log.duplicate_times,
            "rows_without_estimate": self.unknown,
            "remarks": [*log.remarks, *self._beside()],
            "assumed": list(log.understood.get("assumed", ())),
            "duration_s": float(log.time_s[-1] - log.time_s[0]),
            "start_s": float(log.time_s[0]),
            "epoch": log.epoch,
            "zone_stated": self.zone_stated,
            "interval_s": self.interval_s,
            "gaps": self.gaps,
            "longest_gap_s": self.longest_gap_s,
            "components": components,
            "not_observable": [COMPONENTS[c] for c in absent],
            **({} if self.height is None else self.height.figures()),
            "average_gradient": self._average_gradient(),
            "jerk_psd_m2ps5": jerk if np.isfinite(psd).all() else None,
            **motion(self.motions, self.motion_gain, self.abrupt_s),
            "acceleration_at_least_mps2": self.acceleration,
            "left_behind": self.left_behind,
            "nis_mean": self.nis_sum / self.nis_count if self.nis_count else None,
            "components_used_mean": float(self.used / max(self.rows_used, 1)),
            "poorly_observable": [] if absent else consistency.poorly_observable(time_s, sigma),
            "poorly_observable_readings": self._poorly_observable_readings(time_s, sigma),
            "median_sigma_m": None if absent or not np.isfinite(middle := median(np.sqrt(sums(sigma**2)))) else middle,
            "median_sigma_smoothed_m": self.smoothed_sigma_m,
            "sigmas_published": bool(np.isfinite(sigma).all(1).any()),
            "reacquired": self.reacquired,
            "editing_converged": self.converged,
            "slow_noise_s": self.slow_noise_s,
            "slow_noise_likelier": self.slow_noise_likelier,
            "slow_noise_separable": self.slow_noise_separable,
            "time_stamp_sigma_s": self.stamp_s,
            "noise_drifts": self.drifts,
            "editing_places_unexamined": self.unexamined,
            **self.faults.figures(),
            "screened_out": self.screened_out,
            "screened_out_but_used": self.overlooked,
            "clock_set_back": clock_set_back(log),
            "correction_largest_m": self.largest_m,
            "correction_largest_sigma": self.largest_sigma,
            "correction_outside_training": self.outside / max(self.rows, 1),
        }
        figures |= correction
        trust = verdict.verdict(verdict.remarks(figures), verdict.too_wide(figures), figures["assumed"])
        return figures | {"trust": trust}

    def _beside(self) -> Iterator[str]:
        """What was done with what is measured beside the readings, in words."""
        for each in self.beside.values():
            yield from each.remarks()
        if self.log.heights is not None and self.height is None and "height" not in self.beside:
            yield NO_HEIGHTS

    def _poorly_observable_readings(self, time_s: FloatArray, sigma: FloatArray) -> dict[str, list[dict[str, float]]]:
        """By component, of a log in which the position is not observable."""
        seen = [c for c in range(3) if self.absent and c not in self.absent]
        found = {COMPONENTS[c]: consistency.poorly_observable(time_s, sigma[:, [c]], UNITS[c]) for c in seen}
        return {name: intervals for name, intervals in found.items() if intervals}


def motion(rows: Mapping[str, int], gain: float, abrupt_s: list[float]) -> dict[str, Any]:
    """The model of motion of most rows, of a method that chooses one; the share of these rows; and by how much more
    likely the readings are with what was chosen than with white jerk, or with the best rival than with white jerk; and
    the times of abrupt changes of the acceleration. rows: of each model by name."""
    if not rows:
        return {"motion": None}
    name = max(rows, key=lambda each: rows[each])
    share = rows[name] / sum(rows.values())
    return {"motion": name.replace("-", " "), "motion_share": share, "motion_gain": gain, "abrupt_changes_s": abrupt_s}
