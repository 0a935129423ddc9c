"""Tables inside other languages, with a line for each column, and records of one pair to a line."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused
from tests.files.reading.standards.test_layouts import DEG, A, E, R, T

NAMES = ("time_s", "range_m", "az_deg", "el_deg")
ROWS = [tuple(f"{v:.6f}" for v in row) for row in zip(T, R, A * DEG, E * DEG, strict=True)]
COLUMNS = list(zip(*ROWS, strict=True))


def each(pattern: str) -> str:
    return "".join(pattern.format(*row, k=k) + "\n" for k, row in enumerate(ROWS))


def across(between: str, pattern: str = "{name}{between}{cells}") -> str:
    columns = zip(NAMES, COLUMNS, strict=True)
    return "".join(pattern.format(name=n, between=between, cells=between.join(cells)) + "\n" for n, cells in columns)


def below(head: str, rows: str, foot: str = "") -> str:
    return head + "\n" + each(rows) + foot


CREATED = (
    "CREATE TABLE `plots` (\n" + "".join(f" `{n}` double(9,3),\n" for n in NAMES) + " PRIMARY KEY (`time_s`)\n) X;\n"
)
INSERTED = "INSERT INTO `plots` VALUES " + ",".join(f"('{r[0]}',{','.join(r[1:])})" for r in ROWS) + ";\n"
PAGE, BOX = "<html><body><h1>Track</h1><table>", "┌──┬──┬──┬──┐\n"
RECORD = "Time: {0} s\nRange: {1} m\nAzimuth: {2} deg\nElevation: {3} deg"
TEXTS = {
    "HTML": below(
        f"{PAGE}<tr><th>{'</th><th>'.join(NAMES)}</th></tr>",
        "<tr><td>{0}</td><td>{1}</td><td class='x'>{2}</td><td>&nbsp;<b>{3}</b></td></tr>", "</table></body></html>",
    ),
    "HTML without ends": below(f"<table border=1><tr><th>{'<th>'.join(NAMES)}", "<tr><td>{0}<td>{1}<td>{2}<td>{3}"),
    "SQL with names": each(f"INSERT INTO plots ({', '.join(NAMES)}) VALUES ({{0}}, {{1}}, {{2}}, {{3}});"),
    "SQL of a dump": CREATED + INSERTED,
    "SQL of PostgreSQL": below(
        f"SET x = 0;\nCOPY public.plots ({', '.join(NAMES)}) FROM stdin;", "{0}\t{1}\t{2}\t{3}", "\\.\n\nSELECT 1;\n"
    ),
    "SQL of two tables": "INSERT INTO site VALUES (1,'X');\n"
    + each(f"INSERT INTO plots ({', '.join(NAMES)}) VALUES ({{0}}, {{1}}, {{2}}, {{3}});"),
    "SQL of Microsoft": each(
        "INSERT [dbo].[plots] ([time_s], [range_m], [az_deg], [el_deg]) "
        "VALUES (CAST({0} AS Decimal(10, 2)), {1}, N'{2}', {3})"
    ),
    "LaTeX": below(
        f"\\begin{{tabular}}{{r@{{ }}r|rr}}\n\\toprule\n{' & '.join(NAMES)} \\\\\n\\midrule",
        "{0} & ${1}$ & {2} & {3} \\\\ \\hline", "\\bottomrule\n\\end{tabular}\n",
    ),
    "a matrix": below(f"% {' '.join(NAMES)}\ndata = [", "{0} {1} {2} {3};", "];\n"),
    "rows of a matrix": below(f"# {', '.join(NAMES)}\nz = np.array([", "    [{0}, {1}, {2}, {3}],", "])\n"),
    "a drawn table": below(f"{BOX}│ {' │ '.join(NAMES)} │\n╞══╪══╪══╪══╡", "│ {0} │ {1} │ {2} │ {3} │", "└──┴──┘\n"),
    "a table of a wiki": below(f"||{'||'.join(NAMES)}||", "|{0}|{1}|{2}|{3}|"),
    "a table of MediaWiki": below(
        f"{{| class='wikitable'\n! {' !! '.join(NAMES)}", "|-\n| {0} || {1} || {2} || {3}", "|}\n"
    ),
    "tuples of a program": below(f"# {', '.join(NAMES)}\ndata = [", "    ({0}, {1}, {2}, {3}),", "]\n"),
    "rules above and below": below(f"==== ====\n{' '.join(NAMES)}\n==== ====", "{0} {1} {2} {3}", "==== ====\n"),
    "a line for each column": across(","),
    "vectors of a program": across(" ", "{name} = [{cells}];"),
    "columns of a program": across("; ", "{name} = [{cells}]"),
    "units in cells": re.sub(r"_(s|m|deg),", r",\1,", across(",")),
    "a row for each quantity": below(
        "time_s,name,value,quality", "{0},range_m,{1},1\n{0},az_deg,{2},2\n{0},el_deg,{3},3",
    ),
    "a row for each quantity and unit": "t;quantity;value;unit\n" + "".join(
        f"{t};{name};{cell};{unit}\n" for name, unit, cells in zip(
            ("range", "azimuth", "elevation"), ("m", "deg", "deg"), COLUMNS[1:], strict=True
        ) for t, cell in zip(COLUMNS[0], cells, strict=True)
    ),
    "sections": "[site]\nname = X\n\n" + each("[plot {k}]\ntime_s = {0}\nrange_m = {1}\naz_deg = {2}\nel_deg = {3}\n"),
    "an array of TOML": each("[[plot]]\nt = {0}\nrange = {1}\naz = {2}\nel = {3}"),
    "records with units": each(RECORD + "\n"),
    "records without anything between": each(RECORD),
    "protobuf": each(
        "plot {{\n  time: {0}\n  polar {{\n    range_m: {1}\n    az_deg: {2}\n    el_deg: {3}\n  }}\n}}"
    ),
}  # fmt: skip


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_a_table_in_another_language_is_read(make: Make, text: str) -> None:
    log = logs.read(make(text, "log.txt"))
    np.testing.assert_allclose(log.time_s, T, atol=1e-6)
    np.testing.assert_allclose(log.measurement, np.column_stack([R, A, E]), atol=1e-5)


@pytest.mark.parametrize("kind", [name for name in TEXTS if "HTML" in name.upper()])
def test_a_text_may_be_called_a_workbook(make: Make, kind: str) -> None:
    """As programs call a page that a spreadsheet is to open; the bytes tell."""
    np.testing.assert_allclose(logs.read(make(TEXTS[kind], "log.xls")).time_s, T, atol=1e-6)
    assert "this is an old Excel workbook" in refused(make(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(99), "log.xls"))
    assert "save the table in it as .csv" in refused(make(TEXTS[kind], "log.htm"))


def test_what_is_left_of_other_languages_is_refused(make: Make) -> None:
    two = each("INSERT INTO a VALUES ({0}, {1}, {2}, {3});\nINSERT INTO b VALUES ({0}, {1}, {2}, {3});")
    for text in (two, "z = [\n" + each("{0} {1} {2} {3};")):
        refused(make(text, "log.txt"))
    assert "this is a listing of statements of SQL" in refused(make(two, "log.txt"))
    assert "this is a page of HTML" in refused(make("<!DOCTYPE html><html><p>1</p></html>", "log.txt"))
    packets = "Frame 1: 90 bytes on wire\n    RHO, NM: 43.6\n\n" * 9
    assert "this is a listing of packets" in refused(make(packets, "log.txt"))


@pytest.mark.parametrize(
    "hostile",
    [
        lambda n: "INSERT INTO a VALUES (" + "''" * n,
        lambda n: "INSERT INTO a VALUES " + "(" * n,
        lambda n: "CREATE TABLE (" * (n // 8) + "\nINSERT INTO a VALUES (1)",
        lambda n: "a=[\n" * n,
        lambda n: "a=[\n1" * n,
        lambda n: "CAST(" * n + "\nINSERT INTO a VALUES (1)",
        lambda n: "<tr>" * n + "<td>" + "<" * n,
        lambda n: "<tr><td>" * n,
        lambda n: "\\begin{tabular}{" + "{" * n,
        lambda n: "a" + " " * n + "x",
        lambda n: "t" + " [" * n + " 1234567890",
        lambda n: "|" * n,
        lambda n: "a: 1\n" * n,
        lambda n: "[a]\n\n" * n,
    ],
)
def test_long_texts_take_time_by_their_length(make: Make, hostile: Callable[[int], str]) -> None:
    refused(make(hostile(100_000), "log.txt"))


def test_records_of_which_one_lacks_a_pair_are_not_mixed_up(make: Make) -> None:
    text = each(RECORD)
    refused(make(re.sub(r"Range: .*\n", "", text, count=1), "log.txt"))
    sections = each("[plot {k}]\nrange_m = {1}\ntime_s = {0}\naz_deg = {2}\nel_deg = {3}")
    log = logs.read(make(re.sub(r"range_m = .*\n", "", sections, count=1), "log.txt"))
    assert np.isnan(log.measurement[0, 0])
    np.testing.assert_allclose(log.measurement[1:, 0], R[1:], atol=1e-5)


@pytest.mark.parametrize("rest", ["{r}", "0.00001,0.0002,-0.0003,0.00004,{r},1234"])
@pytest.mark.parametrize("before", ["14:25:{k:02d} > %R1Q,2167:2\n14:25:{k:02d} < ", "14:25:{k:02d};"])
def test_replies_of_a_total_station_with_a_time_of_day(make: Make, before: str, rest: str) -> None:
    line = before + "%R1P,0,0:0,{a},{z}," + rest + "\n"
    text = [line.format(k=k, a=a, z=np.pi / 2 - e, r=r) for k, (r, a, e) in enumerate(zip(R, A, E, strict=True))]
    log = logs.read(make("".join(text), "log.txt"))
    np.testing.assert_allclose(log.time_s - log.time_s[0], T, atol=1e-6)
    np.testing.assert_allclose(log.measurement, np.column_stack([R, A, E]), atol=1e-5)
    without = "".join(each[each.index("%R1P") :] for each in text)
    assert "without times" in refused(make(without, "log.txt"))
