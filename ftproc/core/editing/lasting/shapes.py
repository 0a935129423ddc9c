"""Of how many terms the curve of a patch is that was followed, and from where to where it goes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ftproc.core.editing.lasting.between import PER_TERM, TERMS, trimmed
from ftproc.core.editing.lasting.curves import Curve
from ftproc.core.editing.lasting.screen import leaves_curves
from ftproc.core.editing.lasting.weighing import Scene, Weighed, as_it_is, weighed

TRIMMED = 2  # times that the ends of a patch are brought to where its readings fit it


def of_few_terms(part: Scene, ends: Sequence[Sequence[Curve]], least: float, prior: float) -> Weighed | None:
    """The likeliest of curves of a few terms with these ends; None if those with the last ends explain the part of a
    log no better than motion does, and most terms too little for a gain of so much with this prior: motion that does
    not follow the patch leaves more to them."""
    most, weight = [curve.of(max(TERMS)) for curve in ends[-1]], part.log.weight
    if not leaves_curves(part, most, least - prior, as_it_is(part, weight, part.at_median)):
        return None
    without, first = weighed(part, weight, ()), weighed(part, weight, ends[-1])
    if first.log_probability > without.log_probability or leaves_curves(part, most, least, without):
        return _likeliest(part, ends[:-1], first)
    return None


def of_any_shape(part: Scene, best: Weighed) -> Weighed:
    """The likeliest curves of any number of terms, first with these ends, then with those that their readings show."""
    most = min(curve.end - curve.begin for curve in best.curves) // PER_TERM
    best = _likeliest(part, ([curve.of(terms) for curve in best.curves] for terms in TERMS[1:] if terms <= most), best)
    for _ in range(TRIMMED):
        best = _likeliest(part, [trimmed(best.curves, best.weight)], best)
    return best


def _likeliest(part: Scene, of: Iterable[Sequence[Curve]], *others: Weighed) -> Weighed:
    tried = (weighed(part, part.log.weight, curves) for curves in of)
    return max((*others, *tried), key=lambda each: each.log_probability)
