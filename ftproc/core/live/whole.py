"""All of the window decided on again by two-pass editing, a little at a time, while readings go on coming."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ftproc.core.editing.two_pass import Edited
from ftproc.core.pacing import Paced
from ftproc.records import IntArray


class Whole(Paced[Edited]):
    """An edit under way. samples: where the readings that it knows are in the window."""

    def __init__(self, edit: Callable[[], Edited], count: int) -> None:
        super().__init__(edit)
        self.samples: IntArray = np.arange(count)
