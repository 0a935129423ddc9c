"""Two flights round a theodolite with errors of its own, and their GPS truth, into the current directory: what
`ftproc train` is shown with.

python -m tests.docs.circle
"""

from __future__ import annotations

from ftproc.files.writing import flights
from ftproc.simulation import simulate
from tests.bench.correction import THEODOLITE

FLIGHTS = {"circle": (1, 600.0), "next": (2, 200.0)}  # seed, duration in s


def main() -> None:
    """NAME.csv and NAME.gps.csv of each flight."""
    for name, (seed, duration_s) in FLIGHTS.items():
        flight = simulate("calibration", seed=seed, duration_s=duration_s, instrument=THEODOLITE)
        flights.write_log(flight.log, f"{name}.csv")
        flights.write_truth(flight.truth, f"{name}.gps.csv")


if __name__ == "__main__":
    main()
