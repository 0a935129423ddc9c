"""Lines of names and values: names that come again, and records that share a line."""

import numpy as np
import pytest

from ftproc.files.reading import logs
from ftproc.files.reading.formats import content
from tests.files.conftest import Make, refused

ROWS = range(30)


@pytest.mark.parametrize(
    ("before", "record", "between"),
    [
        ('<log version="1">', '<p t="{t}" r="{r}" a="0.{k}" e="0.2"/>', ""),
        ("", '{{"t":{t},"r":{r},"a":0.{k},"e":0.2}}', " "),
        ("[", "{{'t': {t}, 'r': {r}, 'a': 0.{k}, 'e': 0.2}}", ", "),
        ("", "level=info t={t} r={r} a=0.{k} e=0.2", "; "),
        ("", "2024-05-31 12:00:{k}.5 INFO r={r} a=0.{k} e=0.2", " "),
    ],
)
def test_records_on_one_line_are_all_read(
    make: Make, monkeypatch: pytest.MonkeyPatch, before: str, record: str, between: str
) -> None:
    records = [record.format(t=k / 10, r=8000 + k, k=10 + k) for k in ROWS]
    path = make(before + between.join(records), "a.txt")
    log = logs.read(path)
    monkeypatch.setattr(content, "LARGE", 0)
    assert logs.read(path).measurement.tolist() == log.measurement.tolist()
    assert log.measurement[:, 0].tolist() == [8000 + k for k in ROWS]
    assert len(log.rows_without_time) == 0


def test_records_on_one_line_may_lack_a_value(make: Make) -> None:
    records = [f"t={k / 10} r={8000 + k} a=0.{10 + k}" + " e=0.2" * (k % 5 > 0) for k in ROWS]
    log = logs.read(make(" ".join(records), "a.txt"))
    assert len(log) == len(ROWS)
    assert int(np.isnan(log.measurement[:, 2]).sum()) == 6


@pytest.mark.parametrize("second", ["TRK2 r={s}", "TRK2 r={s} a=0.3 e=0.1"])
def test_a_name_that_comes_again_on_a_line_is_asked_about(make: Make, second: str) -> None:
    text = "".join(f"TRK t={k / 10} r={8000 + k} a=0.{k} e=0.2 {second.format(s=9000 + k)}\n" for k in ROWS)
    path = make(text, "a.txt")
    assert (
        "columns 1:r and 2:r could each be the range. Say which one it is: --columns range=1:r or --columns range=2:r"
        in refused(path)
    )
    columns = "range=2:r" if "a=" not in second else "range=2:r,azimuth=2:a,elevation=2:e"
    assert logs.read(path, columns=columns).measurement[3, 0] == 9003


def test_a_name_that_comes_again_with_the_same_value_is_one(make: Make) -> None:
    text = "".join(f"t={k / 10} r={8000 + k} a=0.{k} e=0.2 r={8000 + k}\n" for k in ROWS)
    assert logs.read(make(text, "a.txt")).measurement[3, 0] == 8003
