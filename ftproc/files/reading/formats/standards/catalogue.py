"""The formats of texts that a standard or a maker describes: how each is recognised, and what reads it."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

from ftproc.errors import InputError
from ftproc.files.limits import Room
from ftproc.files.reading.formats import content, documents
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.formats.standards import asterix, crd, gsi, kinds, lvm, markup, meteors, nmea, tdm
from ftproc.files.reading.formats.texts import tagged, templated

_HEAD = 1 << 16  # bytes in which a format is recognised


class Format(NamedTuple):
    """name: as people call it. mark: what stands in its first lines. read: the text -> its table; None if it is
    something else after all."""

    name: str
    mark: re.Pattern[str]
    read: Callable[[str, Room], TableHeader | None]


def _of(name: str, mark: str, read: Callable[[str, Room], TableHeader | None]) -> Format:
    return Format(name, re.compile(mark, re.MULTILINE), read)


def _no(name: str, mark: str, what: str) -> Format:
    """A format that holds no log."""

    def refuse(text: str, room: Room) -> TableHeader | None:
        raise InputError(f"{room.name}: this is {what}.")

    return _of(name, mark, refuse)


_SURVEY = "points of a survey without times, not readings of a moving target"
_EPHEMERIS = "an ephemeris, computed positions and no readings"
TEXTS = (
    _of("ASTERIX in text", r"^Item +\d{3} *:", asterix.text),
    _of("ASTERIX in JSON", r'\A\s*[\[{][^\0]{0,4000}"(?:I?040|CAT0?48)"', documents.plots),
    _of("ASTERIX in XML", r"<ASTERIX\b[^>]{0,300}\bcat=", asterix.xml),
    _of("CCSDS TDM", r"\A\W*CCSDS_TDM_VERS\s*=|<(?:\w+:)?tdm\b", tdm.read),
    _of("ILRS CRD", r"\A\s*(?:00 .*\n\s*)*[hH]1\s+CRD\b", crd.read),
    _of("FTPdetectinfo", r"\AMeteor Count *=", meteors.read),
    _of("NMEA 0183", r"^.{0,60}[$!][A-Z][A-Z0-9]{2,7},", nmea.read),
    _of("LabVIEW measurement", r"\A\s*LabVIEW Measurement\b", lvm.read),
    _of("Leica GSI", r"\A\s*\*?\d\d[\d.]{4}[+-]\w{8}", gsi.read),
    _of("lines of several kinds", kinds.MARK, kinds.read),
    _no("GeoCOM", r"\A\s*%R1[QP],", "a dialogue with a total station (GeoCOM) without times; log the time before "
        "each reply"),
    _no("ILRS CPF", r"\A\s*[hH]1\s+CPF\b", f"a prediction of the ILRS (CPF), {_EPHEMERIS}"),
    _no("SP3", r"\A#[a-d][PV]\d{4} ", f"an SP3 file, {_EPHEMERIS}"),
    _no("CCSDS OEM", r"\A\W*CCSDS_O[EPM]M_VERS\s*=|<(?:\w+:)?o[epm]m\b", f"a CCSDS message with {_EPHEMERIS}"),
    _no("Horizons", r"^\$\$SOE\s*$", f"a table of JPL Horizons, {_EPHEMERIS}"),
    _no("two-line elements", r"\A\s*(?:.{1,24}\r?\n)?1 [\d ]{5}[UCS ].{60,63}\r?\n2 [\d ]{5} ",
        "orbits in two-line elements, and no readings"),
    _no("IOD", r"^\d{5} \d\d \d{3}\w{1,3} +\w{4} [A-Z] \d{12,17} +\d\d \d\d ",
        "positions of satellites among the stars (IOD), in right ascension and declination, not azimuth and elevation"),
    _no("CMN meteor", r"^24\d{5}\.\d{8,} \d{3}\.\d+ [+-]\d\d\.\d+ [+-]\d",
        "a meteor's right ascension and declination, not azimuth and elevation"),
    _no("RINEX", r"\A.{60}RINEX VERSION / TYPE", "a RINEX file, of satellites as a GNSS receiver sees them"),
    _no("GPX", r"<(?:gpx|kml)\b", "positions on the earth, and no readings of a range or an angle"),
    _no("IGC", r"^B\d{6}\d{7}[NS]\d{8}[EW][AV]", "a flight recorder's positions (IGC), no readings of a station"),
    _no("SBS-1", r"^MSG,[1-8],(?:\d*,){2}", "positions that aircraft broadcast (SBS-1), and no readings of a station"),
    _no("LandXML", r"<LandXML\b", _SURVEY),
    _no("Carlson RW5", r"^SS,OP\w{1,20},FP\w{1,20},AR", f"a field book of a total station (RW5), {_SURVEY}"),
    _no("Nikon RAW", r"\ACO,.*Nikon RAW", f"a field book of a total station (Nikon), {_SURVEY}"),
    _no("JobXML", r"<JOBFile\b", "a field book of a total station (JobXML), points of a survey; to filter the track of "
        "a prism in it, export times, circles and slope distances as .csv"),
    _no("Topcon GTS", r"\A_'[^\r\n]{0,200}_\(", f"a field book of a total station (Topcon), {_SURVEY}"),
    _no("Sokkia SDR", r"\A00NM(?:SDR|\w\w)", f"a field book of a total station (SDR), {_SURVEY}"),
    _no("SQL", r"^[ \t]*(?:INSERT\s+INTO|CREATE\s+TABLE)\b", "a listing of statements of SQL that do not fill one "
        "table of a log; export the table as .csv"),
    _no("HTML", r"\A\s*<(?i:(?:!DOCTYPE\s+)?html\b)", "a page of HTML without a table of a log; save that as .csv"),
    _no("tshark", r"^Frame \d+: \d+ bytes on wire", "a listing of packets; save the packets as .pcap, or their "
        "fields as JSON (tshark -T json)"),
    _of("XML", r"\A\s*<(?:\?xml\b|[A-Za-z][\w:.-]*[\s>])", markup.read),
    _of("rows in brackets", r"\A\s*\[\s*\[", documents.nested_rows),
    _of("names and values", r"[=:]\s*[\"']?[+-]?\.?\d", tagged.pairs),
    _of("numbers among words", r"^(?=.{0,200}[^\W\d][^\W\d]).{0,200}\s[+-]?\.?\d", templated.read),
)  # fmt: skip


def read(head: str, text: Callable[[], str], room: Room) -> TableHeader | None:
    """The table of a text of one of TEXTS, or None. head: its first lines; text: gives all of it. Raises InputError for
    a format that holds no log."""
    for each in TEXTS:
        if each.mark.search(head[:_HEAD]) is None:
            continue
        with content.undamaged(room.name, f"a text of {each.name}", "correct it"):
            found = each.read(text(), room)
        if found is not None:
            return found
    return None
