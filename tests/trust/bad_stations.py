"""Station files that are no TOML, lie, or are bombs; what is let in is also applied to a flight."""

from __future__ import annotations

import codecs
from collections.abc import Iterator

from ftproc.config.keys import every
from ftproc.config.recipe import Recipe
from tests.config.test_config import FULL
from tests.trust import bad_models
from tests.trust.cases import Case, written

NAME = "s.toml"
_CUTS = 30

#: Values that almost no key may have.
_ODD = ("[]", "{}",
        "[[1]]", "true", "''", "nan", "inf", "-inf", "-1", "0", "1e308", "1e-320", "1e999", f"1{'0' * 400}",
        f"1{'0' * 5000}", "'x'",
        "1979-05-27", "07:32:00", "1979-05-27T07:32:00Z", "'\\n'", '"\\u0000"', '"\\u001b[31m"',
        "'a/../../b'", "'=1+1'", f"'{'x' * 5000}'", f"[{'1,' * 5000}]", f"{'[' * 90}{']' * 90}")  # fmt: skip


def values() -> Iterator[Case]:
    """Every key with every odd value: refused or harmless."""
    for section, name, key in every():
        spelt = f"{name}_{key.units[0]}" if key.units else name
        for odd in _ODD:
            content = f"[{section}]\n{spelt} = {odd}\n"
            yield Case(
                "station", f"{section}.{name} = {odd[:20]}, {len(odd)} letters", written(content, NAME), either=True
            )
    for odd in ("[]", "{}", "['ekf']"):
        says = ("[filter] method", "the name of a method")
        yield Case("station", f"a method that is {odd}", written(f"[filter]\nmethod = {odd}", NAME), says)
    for key in ("range]\nbias_km", "range]\nsigma_nmi", "time]\noffset_s"):
        says = (key.partition("\n")[2], "expected a number")
        yield Case("station", f"{key!r} overflows", written(f"[{key} = 1e{400}", NAME), says)
    yield Case("station", "1e308 km", written("[range]\nbias_km = 1e308", NAME), ("[range] bias_km", "expected"))
    many = "[filter]\nmethod = 'enkf'\nmodel = 'none'\nparticles = 1e12"
    yield Case("station", "a million million particles", written(many, NAME), either=True)
    yield Case(
        "station", "a model with NUL", written('[filter]\nmodel = "a\\u0000b"', NAME), ("[filter] model", "expected")
    )


def bombs() -> Iterator[Case]:
    """A little text that becomes much, or goes deep."""
    for depth, says in ((1000, ("s.toml",)), (100_000, ("far too large",))):
        for label, content in (
            ("lists", "a = " + "[" * depth + "]" * depth),
            ("tables", "a = " + "{b = " * depth + "1" + "}" * depth),
            ("lists in a key", "[filter]\ngate = " + "[" * depth + "]" * depth),
            ("open lists", "a = " + "[" * depth),
        ):
            yield Case("station", f"{label} {depth} deep", written(content, NAME), says)
    for depth in (1000, 50_000):
        dotted = ".".join("a" * depth)
        yield Case("station", f"{depth} dots", written(f"{dotted} = 1", NAME), either=True)
        yield Case("station", f"a section of {depth} dots", written(f"[{dotted}]", NAME), either=True)
    for digits in (400, 5000, 200_000):
        yield Case("station", f"{digits} digits", written(f"[filter]\ngate = {'9' * digits}", NAME), ("s.toml",))
    many = "".join(f"[a{k}]\n" for k in range(2_000))
    yield Case("station", "2,000 sections", written(many, NAME), ('there is no section "a0"',))
    keys = "[filter]\n" + "".join(f"a{k} = {k}\n" for k in range(2_000))
    yield Case("station", "2,000 keys", written(keys, NAME), ('has no key "a0"',))
    for what, content in (
        ("a name", f"{'x' * 500_000} = 1"),
        ("a section", f"[{'x' * 500_000}]"),
        ("a text", f"[range]\nunit = '{'x' * 500_000}'"),
    ):
        yield Case("station", f"{what} of 500,000 letters", written(content, NAME), ("s.toml",))
    yield Case("station", "2 MB of comment", written("#" + "x" * 2_000_000, NAME), ("too large", "--write-config"))


def texts() -> Iterator[Case]:
    """Encodings, cuts, repeats, and files that are something else."""
    usual = lambda found: found == Recipe()  # noqa: E731
    for label, content in (
        ("empty", b""),
        ("comments", b"# nothing\n"),
        ("CRLF", b"[filter]\r\nsmooth = false\r\n"),
        ("only a BOM", codecs.BOM_UTF8),
    ):
        yield Case("station", label, written(content, NAME), None, usual)
    with_bom = codecs.BOM_UTF8 + b"[filter]\nsmooth = true\n"
    yield Case("station", "a BOM", written(with_bom, NAME), None, lambda found: found.settings.smooth)
    for encoding in ("utf-16", "utf-32", "cp037"):
        yield Case("station", encoding, written(FULL.encode(encoding), NAME), ("not UTF-8", "save it as UTF-8"))
    for encoding in ("utf-16-le", "utf-16-be"):
        yield Case("station", encoding, written(FULL.encode(encoding), NAME), ("s.toml",))
    yield Case("station", "latin-1", written("# H\u00f6he".encode("latin-1"), NAME), ("not UTF-8",))
    for label, content in (
        ("NULs", bytes(500)),
        ("a CR alone", b"[filter]\rgate = 3"),
        ("a section twice", b"[filter]\n[filter]\n"),
        ("a key twice", b"[filter]\ngate = 3\ngate = 4\n"),
        ("a control character", b"[filter]\nmethod = 'a\x1bb'"),
        ("an open text", b"[filter]\nmethod = 'ek"),
        ("JSON", b'{"filter": {"gate": 3}}'),
        ("YAML", b"filter:\n  gate: 3\n"),
        ("INI", b"[filter]\ngate: 3\n"),
        ("XML", b"<filter><gate>3</gate></filter>"),
        ("gzip", b"\x1f\x8b\x08\x00"),
        ("CSV", b"time_s,range_m\n0,1\n"),
        ("decimal comma", b"[filter]\ngate = 3,5"),
        ("a unit in the value", b"[range]\nbias_m = 3 m"),
        ("a leading zero", b"[filter]\ngate = 007"),
    ):
        yield Case("station", label, written(content, NAME), ("s.toml",))
    for label, content in (
        ("an array of sections", "[[filter]]\ngate = 3"),
        ("a section in a section", "[filter.gate]\nx = 1"),
        ("a dotted key", "[range]\nbias.m = 1"),
        ("a key of another section", "[site]\ngate = 3"),
        ("an empty name", "[filter]\n'' = 3"),
        ("a key of control characters", '[filter]\n"\\u001b[31m" = 3'),
        ("a section of control characters", '["\\u001b[31m\\u202e"]'),
    ):
        yield Case("station", label, written(content, NAME), ("s.toml: ",))
    for place in range(1, len(FULL), len(FULL) // _CUTS):
        yield Case("station", f"cut at {place}", written(FULL[:place], NAME), either=True)
        flipped = bytearray(FULL.encode())
        flipped[place] ^= 1 << place % 8
        yield Case("station", f"flipped at {place}", written(bytes(flipped), NAME), either=True)


def places() -> Iterator[Case]:
    """A name behind which there is no ordinary file."""
    for label, how in bad_models.NO_FILES:
        make = bad_models.put(how, NAME)
        yield Case("station", label, make, ("s.toml",))


def all_cases() -> Iterator[Case]:
    """Every station file."""
    for table in (values, bombs, texts, places):
        yield from table()
