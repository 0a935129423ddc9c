"""What the search for other understandings of a log may cost: counted in samples, not in seconds, so that a result does
not depend on the machine."""

from __future__ import annotations

WORK, WORK_PER_SAMPLE = 250_000, 60  # samples that may be smoothed for a log, and for each of its samples
LASTING, LASTING_PER_SAMPLE = 200_000, 10  # the same of samples that are weighed with faults that last, a dozen sweeps
# each: flights with three long patches take up to 180,000, logs with sixty steps would take three million
SEVERAL = 5  # times as much of several stations, in all: 2,000 events on either side of a jump are weighed, and flights
# with usual patches take 250,000 to 710,000


class Work:
    """What a search in a log of so many samples may still cost, in all hypotheses about it: `left`. passed: hypotheses
    that no work was left for. apart: the same of a search of its own, so that enough is left for the rest."""

    def __init__(
        self, samples: int, at_least: int = WORK, each: int = WORK_PER_SAMPLE, apart: Work | None = None
    ) -> None:
        """at_least: how much work any log is worth; a window that moves on is worth none."""
        self.left, self.of_window, self.passed, self.apart = at_least + each * samples, at_least == 0, 0, apart

    @property
    def passed_in_all(self) -> int:
        """Hypotheses that no work was left for, those apart among them."""
        return self.passed + (0 if self.apart is None else self.apart.passed)


def for_lasting_faults(samples: int, stations: int = 1) -> Work:
    """What the search for faults that last and the reassessment of rejected runs may cost, and apart from it that for
    patches that were followed in one station; several share it."""
    if stations > 1:
        return Work(samples, SEVERAL * LASTING, LASTING_PER_SAMPLE)
    return Work(samples, LASTING, LASTING_PER_SAMPLE, Work(samples, LASTING, 2 * LASTING_PER_SAMPLE))
