"""A port that is a file descriptor: serial line, pseudo-terminal, TCP connection.

A thread in C reads and stamps (reader.h), so that neither waits for Python. Where there is none (Windows, macOS, or
`thread=False`), the calling thread reads, and a stamp is as late as the caller.
"""

from __future__ import annotations

import contextlib
import os
import select
import threading
import time
import weakref
from collections.abc import Callable
from typing import Any

from boebot.errors import BoardError
from boebot.link.ports import switch_interval

try:
    from boebot.link.ports._reader import ffi, lib
except ImportError:
    HAS_THREAD = False
else:
    HAS_THREAD = True

WRITE_TIMEOUT_S = 1.0
_READ_BYTES = 65536
_CHUNKS = 1024  # for one call into C
_SLICE_S = 0.05  # Python looks at signals (Ctrl-C) this often while it waits


class DescriptorTransport:
    """Reads and writes a descriptor that does not block. One thread reads at a time, one writes.

    Attributes:
        name: the port's.
        resets_board: opening may have reset the board.
    """

    realtime = True
    resets_board = False

    def __init__(self, name: str, descriptor: int, release: Callable[[], None], thread: bool = True) -> None:
        """Takes over `descriptor`; `release` closes it and whatever belongs to it, at the latest when Python ends."""
        self.name = name
        self._descriptor = descriptor
        self._reader: Any = None
        if thread and HAS_THREAD:
            reader = lib.reader_start(descriptor)
            if reader == ffi.NULL:  # never to be given to reader_free
                release()
                raise BoardError(f"{name} cannot be read: no memory, no file or no thread for it")
            self._reader = ffi.gc(reader, lib.reader_free)
            self._bytes = ffi.new("uint8_t[]", _READ_BYTES)
            self._view = memoryview(ffi.buffer(self._bytes))
            self._times = ffi.new("double[]", _CHUNKS)
            self._ends = ffi.new("uint32_t[]", _CHUNKS)
        switch_interval.shorten()
        self._closed = False
        self._close_once = weakref.finalize(self, _close, self._reader, release, os.getpid())

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        """What arrived, as soon as there is something, at the latest after `wait_s`."""
        pieces = self.read_stamped(wait_s, quiet_s)
        return pieces[0][1] if len(pieces) == 1 else b"".join(data for _, data in pieces)

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        """The same in the pieces in which it came, each with its receipt (s, monotonic clock)."""
        del quiet_s  # bytes wait in the thread's or the operating system's buffer anyway
        if self._closed:
            raise BoardError(self._gone())
        return self._take(wait_s) if self._reader is not None else self._read_here(wait_s)

    def write(self, data: bytes) -> None:
        """Sends bytes; gives up when the other side takes none for a second."""
        if self._closed:
            raise BoardError(self._gone())
        rest = memoryview(data)
        until = time.monotonic() + WRITE_TIMEOUT_S
        while rest:
            try:
                rest = rest[self._send(rest) :]
                continue
            except (BlockingIOError, InterruptedError):
                pass
            except OSError:
                raise BoardError(self._gone()) from None
            self._wait_to_write(until)

    def now(self) -> float:
        """The monotonic clock (s)."""
        return time.monotonic()

    def close(self) -> None:
        """Closes the port."""
        self._closed = True
        self._close_once()

    # ---- what a kind of port may do differently ----------------------------------------------------------------

    def _send(self, data: memoryview) -> int:
        return os.write(self._descriptor, data)

    def _receive(self) -> bytes:
        return os.read(self._descriptor, _READ_BYTES)

    def _gone(self) -> str:
        """Why nothing goes any more, in one sentence."""
        return f"{self.name} has gone: closed by the other side"

    # ---- inside ------------------------------------------------------------------------------------------------

    def _forget_received(self) -> None:
        """Drops what was received and not yet read."""
        if self._reader is not None:
            lib.reader_forget(self._reader)

    def _take(self, wait_s: float) -> list[tuple[float, bytes]]:
        """What the thread has."""
        until = time.monotonic() + wait_s
        left = wait_s
        while True:
            count = lib.reader_take(
                self._reader, min(left, _SLICE_S), self._bytes, _READ_BYTES, self._times, self._ends, _CHUNKS
            )
            if count < 0:
                raise BoardError(self._gone())
            if count == 0:
                left = until - time.monotonic()
                if left <= 0:
                    return []
                continue
            start, pieces = 0, []
            for i in range(count):
                end = self._ends[i]
                pieces.append((self._times[i], self._view[start:end].tobytes()))
                start = end
            return pieces

    def _read_here(self, wait_s: float) -> list[tuple[float, bytes]]:
        """Without the thread: what the operating system has."""
        try:
            ready, _, _ = select.select([self._descriptor], [], [], wait_s)
            if not ready:
                return []
            data = self._receive()
        except BlockingIOError:
            return []
        except (OSError, ValueError):
            data = b""
        if not data:  # readable at its end: the other side is gone
            raise BoardError(self._gone())
        return [(time.monotonic(), data)]

    def _wait_to_write(self, until: float) -> None:
        left = until - time.monotonic()
        try:
            ready = left > 0 and select.select([], [self._descriptor], [], left)[1]
        except (OSError, ValueError):
            raise BoardError(self._gone()) from None
        if not ready:
            raise BoardError(f"{self.name} takes no bytes: its other side does not read")


def _close(reader: Any, release: Callable[[], None], process: int) -> None:
    """Ends the thread first: it must not see another file under its descriptor's number. A forked child has no such
    thread, but its parent has, and keeps the port: the child only gives its copy of the descriptor back."""
    if reader is not None and os.getpid() == process:
        lib.reader_stop(reader)
    with contextlib.suppress(OSError):
        release()
    switch_interval.restore()


def within(seconds: float, open_it: Callable[[], Any], give_back: Callable[[Any], None]) -> Any:
    """What `open_it` returns or raises, but after `seconds` TimeoutError, however long names or connections take; what
    it then opens late goes to `give_back`."""
    results: list[Any] = []
    errors: list[BaseException] = []
    lock = threading.Lock()
    given_up = False

    def work() -> None:
        try:
            opened = open_it()
        except BaseException as error:
            errors.append(error)
            return
        with lock:
            if not given_up:
                results.append(opened)
                return
        give_back(opened)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(seconds)
    with lock:
        given_up = True
        if results:
            return results[0]
    if errors:
        raise errors[0]
    raise TimeoutError(f"no answer within {seconds:g} s")
