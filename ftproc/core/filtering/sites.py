"""What another station than that at the frame's origin expects to read: the same transform, in its own axes."""

from __future__ import annotations

from typing import Any

from ftproc.core.compiled import part
from ftproc.core.filtering import ukf
from ftproc.core.filtering.filters import Filter


@part
def expect_at(sample: Any, f: Filter) -> None:
    """`ukf.expect` of the station that took a sample: in its own axes, from its own place. H is that of the state's
    frame. The state has no offsets if a station is not at the origin."""
    if sample.placed == 0.0:
        ukf.expect(f)
        return
    x, p, h, a, o = f.x, f.p, f.h, sample.axes, sample.place
    x0, x1, x2 = x[0], x[1], x[2]
    p00, p10, p11, p20, p21, p22 = p[0, 0], p[1, 0], p[1, 1], p[2, 0], p[2, 1], p[2, 2]
    d0, d1, d2 = x0 - o[0], x1 - o[1], x2 - o[2]
    for i in range(3):
        x[i] = a[i, 0] * d0 + a[i, 1] * d1 + a[i, 2] * d2
        b0 = a[i, 0] * p00 + a[i, 1] * p10 + a[i, 2] * p20
        b1 = a[i, 0] * p10 + a[i, 1] * p11 + a[i, 2] * p21
        b2 = a[i, 0] * p20 + a[i, 1] * p21 + a[i, 2] * p22
        for j in range(i + 1):
            p[i, j] = b0 * a[j, 0] + b1 * a[j, 1] + b2 * a[j, 2]
    ukf.expect(f)
    x[0], x[1], x[2] = x0, x1, x2
    p[0, 0], p[1, 0], p[1, 1], p[2, 0], p[2, 1], p[2, 2] = p00, p10, p11, p20, p21, p22
    for i in range(3):
        h0, h1, h2 = h[i, 0], h[i, 1], h[i, 2]
        for j in range(3):
            h[i, j] = h0 * a[0, j] + h1 * a[1, j] + h2 * a[2, j]
