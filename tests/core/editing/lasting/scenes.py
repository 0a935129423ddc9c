"""Parts of logs as the search for lasting faults sees them."""

from __future__ import annotations

import numpy as np

from ftproc.core.editing.lasting.curves import Setting
from ftproc.core.editing.lasting.weighing import Scene
from ftproc.core.filtering.records import Model, Observations
from ftproc.core.model.motion import isotropic

N = 200


def scene(*rejected):
    """A scene with rejected readings of (component, begin, end)."""
    weight = np.ones((N, 3))
    for c, begin, end in rejected:
        weight[begin:end, c] = 0.0
    time_s, zeros = np.arange(N) * 1.0, np.zeros((N, 3))
    log = Observations(time_s, zeros, weight)
    model = Model(np.ones(3), isotropic(1.0))
    return Scene(
        log, np.ones((N, 3), bool), weight, Setting(time_s, zeros), model, False, np.full((1, 3, 3), 0.01), 4.0, zeros
    )
