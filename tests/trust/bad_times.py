"""Times that are wrong or odd: backwards, standing still, far away, of several zones, through midnight."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ftproc.records import MeasurementLog
from tests.trust import cases
from tests.trust.bad_logs import ROW, timeless
from tests.trust.cases import HEADER, Case, rows, same, text, with_cell, with_column, written


def all_cases() -> Iterator[Case]:
    """Every log whose times are wrong or odd."""
    good = rows()
    yield Case("log", "times reversed", written(text(good[::-1])), None, same)
    yield Case("log", "times constant", written(text(with_column(0, lambda t: 5.0))), either=True)
    yield Case("log", "one time missing", written(text(with_cell(ROW, 0, ""))), None, timeless)
    yield Case("log", "all times missing", written(text([["", *r[1:]] for r in good])), ("no row has a time",))
    yield Case(
        "log",
        "every row twice",
        written(text([r for row in good for r in (row, row)])),
        None,
        lambda log: log.duplicate_times == len(good),
    )
    for label, cell in (("1e308", "1e308"), ("-1e308", "-1e308"), ("1e18", "1e18"), ("1e9", "1e9"), ("-1e9", "-1e9")):
        yield Case("log", f"one time {label}", written(text(with_cell(ROW, 0, cell))), either=True)
    for scale in (1e-300, 1e-12, 1e-6, 1e6, 1e12, 1e300, 4e306):
        yield Case(
            "log", f"times {scale:g} apart", written(text(with_column(0, lambda t, s=scale: t * s))), either=True
        )
    for origin in (1.7e9, -1e7, 1e15, 1e17, 1e308):
        yield Case(
            "log", f"times from {origin:g}", written(text(with_column(0, lambda t, o=origin: t + o))), either=True
        )
    span = with_column(0, lambda t: -1.7e308 if t < 20 else 1.7e308)
    yield Case("log", "times that overflow", written(text(span)), either=True)
    yield from _stamps()
    yield from _midnight()


def _stamps() -> Iterator[Case]:
    def stamped(stamps: list[str]) -> cases.Make:
        return written(text([[stamp, *row[1:]] for stamp, row in zip(stamps, rows(), strict=True)], "t,R,A,E"))

    seconds = [f"{k // 60:02d}:{k % 60:02d}" for k in range(len(rows()))]
    plain = [f"2024-05-31T12:{s}" for s in seconds]
    count = len(rows())

    def counted(log: MeasurementLog) -> bool:
        return np.array_equal(log.time_s - log.time_s[0], np.arange(count))

    for label, stamps in (
        ("plain", plain),
        ("Z", [s + "Z" for s in plain]),
        ("+02:00", [s + "+02:00" for s in plain]),
        ("blank", [s.replace("T", " ") for s in plain]),
        ("fraction", [s + ".000" for s in plain]),
        ("comma", [f'"{s},000"' for s in plain]),
        ("year 2500", [s.replace("2024", "2500") for s in plain]),
        ("year 0001", [s.replace("2024", "0001") for s in plain]),
        ("year 9999", [s.replace("2024", "9999") for s in plain]),
        ("time of day", [f"12:{s}" for s in seconds]),
        ("German", [f"31.05.2024 12:{s}" for s in seconds]),
        ("American", [f"05/31/2024 12:{s}" for s in seconds]),
        (
            "through midnight",
            [f"2024-05-31T23:59:{k:02d}" for k in range(40, 60)] + [f"2024-06-01T00:00:{k:02d}" for k in range(20)],
        ),
        (
            "two offsets",
            [f"2024-05-31T12:{s}+02:00" if k % 2 else f"2024-05-31T10:{s}Z" for k, s in enumerate(seconds)],
        ),
    ):
        yield Case("log", f"timestamps {label}", stamped(stamps), None, counted)
    for label, stamps in (
        ("zone once", [*plain[:9], plain[9] + "Z", *plain[10:]]),
        ("zone but once", [s + "Z" for s in plain[:-1]] + plain[-1:]),
        ("a number among them", [*plain[:9], "17.5", *plain[10:]]),
        ("a word", [*plain[:9], "later", *plain[10:]]),
        ("month 13", [s.replace("-05-", "-13-") for s in plain]),
        ("second 61", [s[:-2] + "61" for s in plain]),
        ("day 30 of February", [s.replace("05-31", "02-30") for s in plain]),
        ("named zone", [s + " CXST" for s in plain]),
        ("hour 25", [s.replace("T12", "T25") for s in plain]),
    ):
        yield Case("log", f"timestamps {label}", stamped(stamps), ('column "t"', "row ", "expected a time"))


def _midnight() -> Iterator[Case]:
    def continued(log: MeasurementLog) -> bool:
        steps = np.abs(np.diff(log.time_s) - 1) < 1e-6
        return bool(steps.all()) and any("restarts" in remark and "row 20" in remark for remark in log.remarks)

    for start in (86380.0, 86380.5, 86380.999):
        turned = text(with_column(0, lambda t, s=start: (t + s) % 86400))
        yield Case("log", f"midnight from {start}", written(turned), None, continued)
    turned = text(with_column(0, lambda t: (t * 1e3 + 86_380_000) % 86_400_000), HEADER.replace("time_s", "time_ms"))
    yield Case("log", "midnight in ms", written(turned), None, continued)
    turned = text(with_column(0, lambda t: (t + 604_780) % 604_800))
    yield Case("log", "end of the GPS week", written(turned), None, continued)
    for cell, what in (("0.0", "to 0"), ("5.5", "back a little"), ("16.999", "by a millisecond")):
        yield Case(
            "log",
            f"glitch {what}",
            written(text(with_cell(ROW, 0, cell))),
            None,
            lambda log: log.rows_out_of_order <= 1 and len(log) == len(rows()),
        )
    late = with_column(0, lambda t: t + 86_300)
    late[ROW][0] = "0.0"
    yield Case("log", "glitch to 0 before midnight", written(text(late)), None, lambda log: log.rows_out_of_order > 0)
    mixed = [rows()[k] for k in np.random.default_rng(1).permutation(len(rows()))]
    yield Case("log", "rows shuffled", written(text(mixed)), None, same)
