"""The figures of each component of a run: how many readings have which label, and how large their innovations are."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ftproc.order_statistics import median
from ftproc.quality import consistency
from ftproc.records import ACCEPTED, GOOD, ISOLATED, MISSING, PATCH, REJECTED, FlagArray, FloatArray

if TYPE_CHECKING:
    from ftproc.core.beside import Channel

TESTED = 2.0  # times the least variance: of heights, more is what stands for many that are rounded to the same
_LABELS = {"isolated": ISOLATED, "patch": PATCH, "missing": MISSING}


class Component:
    """Figures of range, azimuth or elevation. every: of so many innovation sigmas one is kept."""

    def __init__(self, every: int) -> None:
        self.every = every
        self.labels = np.zeros(6, int)
        self.longest_s, self.patch_from = 0.0, np.nan  # the longest patch, and the start of one that may continue
        self.squares, self.count = 0.0, 0
        self.innovation_sigma: list[FloatArray] = []

    def add_innovations(self, squares: FloatArray, sigma: FloatArray, tested: NDArray[np.bool_]) -> None:
        """Squares of the normalised innovations (n,), their sigmas (n,), and which of them count (n,)."""
        self.squares += float(squares[tested].sum())
        self.count += int(tested.sum())
        self.innovation_sigma.append(sigma[:: self.every][tested[:: self.every]])

    def add_labels(self, time_s: FloatArray, label: FlagArray) -> None:
        """Missing readings inside a patch do not end it, nor do those rejected by hand, nor the end of a part."""
        self.labels += np.bincount(label, minlength=6)
        there = np.flatnonzero((label != MISSING) & (label != REJECTED))
        if not there.size:
            return
        inside = np.r_[False, label[there] == PATCH, False]
        edges = np.flatnonzero(inside[1:] != inside[:-1]).reshape(-1, 2)
        starts, ends = time_s[there[edges[:, 0]]], time_s[there[edges[:, 1] - 1]]
        if len(edges) and edges[0, 0] == 0 and np.isfinite(self.patch_from):
            starts[0] = self.patch_from
        self.longest_s = max(self.longest_s, float((ends - starts).max(initial=0.0)))
        self.patch_from = starts[-1] if len(edges) and edges[-1, 1] == len(there) else np.nan

    def counts(self) -> dict[str, Any]:
        """How many readings have which label; those accepted by hand are good."""
        counts = {name: int(self.labels[label]) for name, label in _LABELS.items()}
        good, rejected, accepted = (int(self.labels[label]) for label in (GOOD, REJECTED, ACCEPTED))
        by_hand = {"rejected_by_hand": rejected, "accepted_by_hand": accepted} if rejected or accepted else {}
        return {"good": good + accepted, **counts, **by_hand, "longest_patch_s": self.longest_s}

    def consistency(self, noise_sigma: float) -> dict[str, Any]:
        sigmas = np.concatenate(self.innovation_sigma)
        return {
            "predicted_sigma_ratio": consistency.predicted_sigma_ratio(sigmas, noise_sigma),
            **consistency.innovation_test(self.squares, self.count),
        }


class Scalars:
    """Figures of the range rates of a log, or of its heights beside elevations, to which those of its parts are
    added."""

    def __init__(self, every: int) -> None:
        self.component, self.closing, self.why = Component(every), False, dict[str, None]()
        self.late_s = list[float]()
        self.noises, self.off_m = list[float](), list[float]()

    @property
    def used(self) -> bool:
        """Whether some part uses them."""
        return bool(self.noises)

    def add(self, time_s: FloatArray, channel: Channel) -> None:
        """Add a part with these times (n,)."""
        self.component.add_labels(time_s, channel.label)
        if channel.why:
            self.why[channel.why] = None
            return
        self.closing |= channel.closing
        self.noises.append(channel.noise)
        self.late_s.append(channel.late_s)
        if np.isfinite(channel.off).any():
            self.off_m.append(float(np.nanmedian(channel.off)))
        with np.errstate(invalid="ignore", divide="ignore"):
            squares = np.square(channel.innovation / channel.sigma)
        tested = (channel.rates.weight > 0) & (channel.rates.variance <= TESTED * channel.rates.variance.min())
        self.component.add_innovations(squares, channel.sigma, tested)

    def remarks(self) -> Iterator[str]:
        """What was done with them, and why they are not used."""
        if self.off_m:
            off_m = median(np.array(self.off_m))
            yield f"the heights are {off_m:.3g} m above those by the elevations, which is taken out"
        turned = ["the range rates count inward, as the motion shows, and are turned round"] if self.closing else []
        yield from (*turned, *self._shifted(), *self.why)

    def _shifted(self) -> Iterator[str]:
        """By how much they were late or early."""
        if found := [each for each in self.late_s if each != 0]:
            late_s = median(np.array(found))
            side = "late" if late_s > 0 else "early"
            yield f"the range rates are {side} by {abs(late_s):.3g} s, as the motion shows, and are corrected for it"

    def figures(self, name: str) -> dict[str, Any]:
        """As those of other components. name: range_rate or height."""
        noise = median(np.array(self.noises))
        return {
            **self.component.counts(),
            "held": 0,
            "interpolated": 0,
            "computed": 0,
            "noise_m" if name == "height" else "noise_mps": noise,
            "noise_correlation": 0.0,
            **self.component.consistency(noise),
        }
