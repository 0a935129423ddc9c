"""Bytes -> UTF-8: byte order marks, UTF-16 and UTF-32 without one, national encodings, Windows and Latin-1 text."""

from __future__ import annotations

import codecs
import re
from typing import NamedTuple

from ftproc.errors import InputError
from ftproc.files.units import SPELLINGS
from ftproc.files.words import ALIASES, WEAK_ALIASES, plain_letters

_MARKS = (
    (b"\xef\xbb\xbf", "utf-8", ""),
    (b"\xff\xfe\x00\x00", "utf-32-le", "UTF-32"),
    (b"\x00\x00\xfe\xff", "utf-32-be", "UTF-32"),
    (b"\xff\xfe", "utf-16-le", "UTF-16"),
    (b"\xfe\xff", "utf-16-be", "UTF-16"),
)
#: The share of NUL bytes at each byte of four, in text without a mark.
_BY_NULS = {"utf-32-le": "0111", "utf-32-be": "1110", "utf-16-le": "0101", "utf-16-be": "1010"}
#: Encodings of which nothing in the file tells: that in which the most known words stand counts, else the first.
_NATIONAL = {
    "cp1252": "Windows or Latin-1", "gb18030": "GBK", "big5": "Big5", "shift_jis": "Shift JIS", "euc_kr": "EUC-KR",
    "euc_jp": "EUC-JP", "cp1251": "Windows-1251", "koi8_r": "KOI8-R", "cp866": "DOS-866", "iso8859_5": "ISO 8859-5",
    "cp1250": "Windows-1250", "iso8859_2": "ISO 8859-2", "cp1253": "Windows-1253", "cp1254": "Windows-1254",
    "mac_roman": "Mac Roman", "cp437": "DOS-437",
}  # fmt: skip
_TABLES = (ALIASES, WEAK_ALIASES, SPELLINGS)
_KNOWN = {word for table in _TABLES for words in table.values() for word in words if word[1:]}
_SAMPLE = 4096
_WORDS = 1 << 16  # bytes in which known words are sought
_CONTROL = re.compile(rb"[\x00-\x08\x0e-\x19\x1c-\x1f]")

_OTHER_KINDS = {
    b"PAR1": "is a Parquet file; give it the name .parquet",
    b"PK\x03\x04": "is a zip archive or an Excel workbook; give it the name .zip or .xlsx",
    b"ARROW1": "is an Arrow file; give it the name .arrow",
    b"\x89HDF": "is an HDF5 file; give it the name .h5",
    b"\x89PNG": "is a picture; name the log",
    b"\xff\xd8\xff": "is a picture; name the log",
    b"GIF8": "is a picture; name the log",
    b"%PDF": "is a PDF document; save the table in it as CSV",
    b"\xd0\xcf\x11\xe0": "is an old Office document (it has NUL bytes); save the sheet as .xlsx or CSV",
}


class Utf8(NamedTuple):
    """data: UTF-8 without a mark. skipped: bytes of the mark. was: the name of another encoding, or ""."""

    data: bytes
    skipped: int = 0
    was: str = ""


def as_utf8(source: str, data: bytes, cut: bool = False) -> Utf8:
    """The text in UTF-8. cut: `data` is only the beginning. Raises InputError for what is no text."""
    for magic, reason in _OTHER_KINDS.items():
        if data.startswith(magic):
            raise InputError(f"{source}: this {reason}.")
    mark, name, word = next((entry for entry in _MARKS if data.startswith(entry[0])), (b"", "", ""))
    name = name or _by_nuls(data[:_SAMPLE])
    if name not in ("", "utf-8"):
        try:
            decoded = codecs.getincrementaldecoder(name)().decode(data[len(mark) :], final=not cut)
            return Utf8(decoded.encode(), len(mark), word or name[:6].upper())
        except UnicodeDecodeError as error:
            raise InputError(f"{source}: this is damaged {name[:6].upper()} text; save it as UTF-8.") from error
    no_text = f"{source}: this is not text in UTF-8 (it has NUL bytes or the like); save it as UTF-8 CSV."
    if b"\0" in data[:_SAMPLE]:
        raise InputError(no_text)
    text = data[len(mark) :]
    if text.isascii() or _is_utf8(text, cut):
        return Utf8(text, len(mark))
    if _CONTROL.search(text[:_SAMPLE]):
        raise InputError(no_text)
    national = max(_NATIONAL, key=lambda each: _known_words(text[:_WORDS], each))
    return Utf8(text.decode(national, "replace").replace("\ufffd", "?").encode(), 0, _NATIONAL[national])


def _known_words(sample: bytes, encoding: str) -> int:
    """How many letters the known words have that a sample, read in an encoding, holds; -1 if it cannot be so."""
    strict = "replace" if encoding == "cp1252" else "strict"
    try:
        text = codecs.getincrementaldecoder(encoding)(strict).decode(sample)  # its last letter may be cut
    except UnicodeDecodeError:
        return -1
    phrases = {phrase for phrase in re.split(r"[^\w ]+|  +", text) if not phrase.isascii()}
    known = sum(len(phrase) for phrase in phrases if plain_letters(phrase).replace(" ", "") in _KNOWN)
    return known + bool(re.search(r"[(\[ ]°", text))


def _is_utf8(text: bytes, cut: bool) -> bool:
    try:
        text.decode()
    except UnicodeDecodeError as error:
        return cut and error.start >= len(text) - 3
    return True


def _by_nuls(sample: bytes) -> str:
    whole = sample[: len(sample) // 4 * 4]
    if not whole or b"\0" not in whole:
        return ""
    share = [whole[k::4].count(0) / len(whole[k::4]) for k in range(4)]
    pattern = "".join("1" if part > 0.8 else "0" if part < 0.2 else "?" for part in share)
    return next((name for name, marks in _BY_NULS.items() if marks == pattern), "")
