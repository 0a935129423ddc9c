"""Where the bytes of a log that grows come from: standard input, a file, which may be replaced or overwritten, a serial
line, or the network."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import select
import socket
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

from ftproc.errors import InputError
from ftproc.files import remote
from ftproc.files.reading.formats import content
from ftproc.files.reading.formats.standards import octets
from ftproc.live.stop import Source

MOST = 1 << 18  # bytes that are read at once
NAP_S = 0.003  # between polls of a file that has not grown
AGAIN_S = 0.2  # between attempts to reach the sender
BUFFER = 1 << 23  # bytes of datagrams that the system is asked to hold while we compute
NETWORK = ("udp", "tcp")
_KNOWN_AGAIN = 256  # bytes before the offset where reading goes on, by which the file is known to be the same


def is_network(source: str) -> bool:
    """Whether a source is the address of a sender or receiver."""
    return source.partition("://")[0] in NETWORK


def cannot_be_corrected(source: str) -> bool:
    """Whether what comes is gone when it has come: from the network, a serial line, or a pipe with a name."""
    path = None if source == "-" else remote.local(source)
    return is_network(source) or (path is not None and path.exists() and not path.is_file())


@contextlib.contextmanager
def opened(source: str) -> Iterator[Source]:
    """A file of this machine, `-`, `udp://HOST:PORT` or `tcp://HOST:PORT`. Raises InputError."""
    if source == "-":
        yield Input()
        return
    if is_network(source):
        kind, address = _address(source)
        with contextlib.closing(Udp(source, address) if kind == "udp" else Tcp(source, address)) as network:
            yield network
        return
    path = remote.local(source)
    if path is None:
        raise InputError(
            f"{source}: --follow reads a file of this machine, udp://HOST:PORT, tcp://HOST:PORT, or - for standard "
            "input; name one of them."
        )
    with contextlib.closing(File(source, path)) as file:
        yield file


def _address(source: str) -> tuple[str, tuple[str, int]]:
    try:
        parts = urlsplit(source)
        if parts.port and not parts.path.strip("/") and not parts.query:
            return parts.scheme, (parts.hostname or "", parts.port)
    except ValueError:
        pass
    raise InputError(f"{source}: this is no address; expected such as udp://0.0.0.0:5000 or tcp://10.0.0.7:5000.")


def _until_readable(stream: int | socket.socket, seconds: float) -> None:
    select.select([stream], [], [], seconds)


class Input:
    """Standard input."""

    news = ""

    def __init__(self) -> None:
        if sys.stdin is None:
            raise InputError("-: standard input is closed; pipe a log into it, or name a file.")
        self._stream = sys.stdin.buffer
        try:
            self._descriptor = self._stream.fileno() if os.name == "posix" else -1
        except (OSError, AttributeError):  # a stream in memory
            self._descriptor = -1

    def poll(self) -> bytes | None:
        if self._descriptor < 0:
            stream = self._stream
            return stream.read1(MOST) if isinstance(stream, io.BufferedReader) else stream.read(MOST)
        if not select.select([self._descriptor], [], [], 0)[0]:
            return None
        try:
            return os.read(self._descriptor, MOST)
        except BlockingIOError:
            return None

    def wait(self, seconds: float) -> None:
        _until_readable(self._descriptor, seconds)


class File:
    """A file under a name, which may come to name another one; a named pipe, or a serial line. Each poll also reads the
    end of what is known: where it stands no more, the file was overwritten, whatever its length."""

    def __init__(self, source: str, path: Path) -> None:
        self.news = ""
        self._path = path
        try:
            self._begin()
        except OSError:
            content.read(source, path, limit=1)  # whose messages say why it cannot be read
            raise

    @property
    def offset(self) -> tuple[int, bytes]:
        """Where reading goes on, and the bytes before."""
        return self._offset, self._end

    @offset.setter
    def offset(self, offset: tuple[int, bytes]) -> None:
        self._offset, self._end = offset

    def close(self) -> None:
        if hasattr(self, "_stream"):
            self._stream.close()

    def poll(self) -> bytes | None:
        replaced = self._is_replaced()
        if self._stream.seekable():
            self._stream.seek(self._offset - len(self._end))
        data = self._stream.read(MOST) or b""
        if not data.startswith(self._end):
            self._offset, self._end, self.news = 0, b"", "became shorter or was overwritten"
            return None
        if new := data[len(self._end) :]:
            if self._stream.seekable():
                self._offset, self._end = self._offset + len(new), data[-_KNOWN_AGAIN:]
            return new
        if replaced:
            with contextlib.suppress(FileNotFoundError):
                self._begin()
                self.news = "was replaced by another file"
        return None

    def wait(self, seconds: float) -> None:
        time.sleep(min(seconds, NAP_S))

    def _begin(self) -> None:
        stream = io.FileIO(self._path, opener=_without_waiting)
        self.close()
        self._stream, self._offset, self._end = stream, 0, b""

    def _is_replaced(self) -> bool:
        """Asked before reading, so that what the old file still got is read first."""
        try:
            return not os.path.samestat(self._path.stat(), os.fstat(self._stream.fileno()))
        except FileNotFoundError:  # moved away, and nothing is there yet
            return False


def _without_waiting(name: str, flags: int) -> int:
    """A descriptor, also of a named pipe into which nobody writes yet: neither this nor a read waits for a writer, so
    that signals are heard."""
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0))


def _resolved(source: str, address: tuple[str, int], kind: socket.SocketKind) -> tuple[socket.AddressFamily, object]:
    """The family, and the address for its sockets. Raises InputError."""
    try:
        family, _, _, _, found = socket.getaddrinfo(address[0] or None, address[1], 0, kind, 0, socket.AI_PASSIVE)[0]
    except OSError as error:
        raise InputError(f"{source}: there is no such host ({error.strerror or error}); check its name.") from error
    return family, found


class Udp:
    """Datagrams that are sent to an address of this machine, each of one or more whole lines, or data blocks."""

    news = ""

    def __init__(self, source: str, address: tuple[str, int]) -> None:
        family, found = _resolved(source, address, socket.SOCK_DGRAM)
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
        try:
            self._socket.bind(found)  # type: ignore[arg-type]
        except OSError as error:
            self._socket.close()
            raise InputError(
                f"{source}: cannot be listened to ({error.strerror}); name an address of this machine (0.0.0.0 for "
                "all) and a port that no other program uses."
            ) from error

    def close(self) -> None:
        self._socket.close()

    def poll(self) -> bytes | None:
        found = bytearray()
        with contextlib.suppress(BlockingIOError):
            while len(found) < MOST:
                datagram = self._socket.recv(1 << 16)
                whole = datagram.endswith(b"\n") or octets.are_blocks(datagram)
                found += datagram if whole else datagram + b"\n"
        return bytes(found) or None

    def wait(self, seconds: float) -> None:
        _until_readable(self._socket, seconds)


class Tcp:
    """A sender that listens at an address. Where nobody listens, and the address is one of this machine, it is waited
    for there until a sender connects; else until one listens. A connection that is lost is made again; one that is
    closed is the end of the input."""

    def __init__(self, source: str, address: tuple[str, int]) -> None:
        self.news, self._lost = "", False
        self._family, self._address = _resolved(source, address, socket.SOCK_STREAM)
        self._here = not address[0]
        self._listening: socket.socket | None = None
        self._socket: socket.socket | None = None

    def close(self) -> None:
        for each in (self._socket, self._listening):
            if each is not None:
                each.close()

    def poll(self) -> bytes | None:
        if self._socket is None:
            self._reach()
        if self._socket is None:
            return None
        try:
            return self._socket.recv(MOST)
        except BlockingIOError:
            return None
        except OSError:
            self._socket.close()
            self._socket, self.news = None, "lost its connection"
            return None

    def wait(self, seconds: float) -> None:
        ready = self._socket or self._listening
        if ready is None:
            time.sleep(min(seconds, AGAIN_S))
        else:
            _until_readable(ready, seconds)

    def _reach(self) -> None:
        if self._listening is not None:
            with contextlib.suppress(BlockingIOError):
                self._socket, _ = self._listening.accept()
                self._socket.setblocking(False)
            return
        made = socket.socket(self._family, socket.SOCK_STREAM)
        made.settimeout(AGAIN_S)
        try:
            if self._here:
                raise ConnectionRefusedError(errno.ECONNREFUSED, "nobody is to be reached there")
            made.connect(self._address)  # type: ignore[arg-type]
            made.setblocking(False)
            self._socket = made
        except ConnectionRefusedError:
            made.close()
            self._listen()
        except OSError:  # not there yet
            made.close()

    def _listen(self) -> None:
        made = socket.socket(self._family, socket.SOCK_STREAM)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            made.bind(self._address)  # type: ignore[arg-type]
            made.listen(1)
            made.setblocking(False)
            self._listening = made
        except OSError:  # the address of another machine
            made.close()
