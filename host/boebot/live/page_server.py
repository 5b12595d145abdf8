"""Serves one page and its stream to browsers: HTTP and WebSocket on one port, in a thread of its own.

Only who has the address gets anything: it holds a random token, and requests that name another host or come from
another page are refused. It listens on loopback only. A page that does not read, floods or
sends rubbish is let go; nothing that a page does slows the run.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import http
import logging
import secrets
import threading
import time
from collections.abc import Callable
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers, MultipleValuesError
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from boebot.errors import BoebotError
from boebot.live.outbox import Outbox

LOOPBACK = "127.0.0.1"
MESSAGE_BYTES = 16_384  # of a page's message
MESSAGES_PER_S = 200  # of a page, in the long run
MESSAGES_AT_ONCE = 400
PAGES = 16  # at most
SILENT_S = 20.0  # a page that answers no ping for so long is gone
START_S = 5.0
_LOGGER = logging.getLogger("boebot.live")  # who sends rubbish must not fill the run's terminal
_LOGGER.addHandler(logging.NullHandler())
_LOGGER.propagate = False
_POLICY = "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"  # beside what the page itself says


class PageServer:
    """Serves until it is closed.

    Attributes:
        url: of the page, with its token.
    """

    def __init__(
        self,
        page: Callable[[str], str],
        heard: Callable[[Outbox, str], str | None],
        went: Callable[[Outbox], None],
        port: int = 0,
    ) -> None:
        """
        Args:
            page: gives the HTML, by where its stream is, as in ws://127.0.0.1:8080.
            heard: a page has sent a message; returns why it is to be let go, in a sentence, or None. It and `went` are
                called in the server's thread, and must return at once.
            went: a page is gone.
            port: 0: any free one.

        Raises:
            BoebotError: the port is taken.
        """
        self._page, self._heard, self._went = page, heard, went
        self._token = secrets.token_urlsafe(16)
        self._port = port
        self._count = self._open = 0
        self._failure: OSError | None = None
        self._started = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="live view", daemon=True)
        self._thread.start()
        self._started.wait(START_S)
        if self._failure is not None:
            self._thread.join()
            raise BoebotError(
                f"the live view cannot be served at {LOOPBACK}:{port}: {self._failure.strerror or self._failure}; "
                "expected a free port (--view-port 0: any)"
            )
        self.url = f"http://{LOOPBACK}:{self._port}/?token={self._token}"

    def wake(self, page: Outbox) -> None:
        """There is something to be sent to it. Called from any thread."""
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(page.ready.set)

    def close(self) -> None:
        """Says good-bye to all pages. May be called twice."""
        if self._thread.is_alive():
            with contextlib.suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join(START_S)

    # ---- in the server's thread ------------------------------------------------------------------------------------

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve())
        except OSError as error:
            self._failure = error
        finally:
            self._started.set()
            self._loop.close()

    async def _serve(self) -> None:
        self._stop = asyncio.Event()
        async with serve(
            self._talk,
            LOOPBACK,
            self._port,
            process_request=self._answer,
            compression=None,
            max_size=MESSAGE_BYTES,
            max_queue=16,
            ping_interval=SILENT_S / 2,
            ping_timeout=SILENT_S / 2,
            close_timeout=0.5,
            server_header=None,
            logger=_LOGGER,
        ) as server:
            self._port = next(iter(server.sockets)).getsockname()[1]
            self._started.set()
            await self._stop.wait()

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """The page, or a refusal; None: the stream, which goes on as a WebSocket."""
        try:
            address = urlsplit(request.path)
            host, origin = request.headers.get("Host", ""), request.headers.get("Origin")
            given = parse_qs(address.query).get("token", [""])[0]
        except (ValueError, MultipleValuesError):
            return _refusal(http.HTTPStatus.BAD_REQUEST, "that is no request of a browser")
        if host not in (f"{LOOPBACK}:{self._port}", f"localhost:{self._port}"):
            return _refusal(http.HTTPStatus.FORBIDDEN, f"this is {LOOPBACK}:{self._port}, not {host!r}")
        if not hmac.compare_digest(given.encode(), self._token.encode()):
            return _refusal(http.HTTPStatus.FORBIDDEN, "wrong token; expected the address that boebot has printed")
        if address.path == "/stream":
            if origin != f"http://{host}":
                return _refusal(http.HTTPStatus.FORBIDDEN, "another page may not look at this run")
            if self._open >= PAGES:
                return _refusal(http.HTTPStatus.SERVICE_UNAVAILABLE, f"{PAGES} pages look already; close one")
            return None
        if address.path != "/":
            return _refusal(http.HTTPStatus.NOT_FOUND, "there is one page here: /")
        return _response(http.HTTPStatus.OK, "text/html; charset=utf-8", self._page(f"ws://{host}").encode(), _POLICY)

    async def _talk(self, connection: ServerConnection) -> None:
        """One page, from its coming to its going."""
        self._count += 1
        self._open += 1
        page = Outbox(self._count)
        sender = asyncio.create_task(self._send(connection, page))
        try:
            await self._receive(connection, page)
        except ConnectionClosed:
            pass
        finally:
            sender.cancel()
            self._open -= 1
            self._went(page)

    async def _send(self, connection: ServerConnection, page: Outbox) -> None:
        try:
            while True:
                await page.ready.wait()
                page.ready.clear()
                for text in page.take():
                    await connection.send(text)
        except ConnectionClosed:
            return

    async def _receive(self, connection: ServerConnection, page: Outbox) -> None:
        allowed, since = float(MESSAGES_AT_ONCE), time.perf_counter()
        async for data in connection:
            now = time.perf_counter()
            allowed = min(float(MESSAGES_AT_ONCE), allowed + (now - since) * MESSAGES_PER_S) - 1.0
            since = now
            why = f"more than {MESSAGES_PER_S} messages in a second" if allowed < 0 else "expected a text"
            if allowed >= 0 and isinstance(data, str):
                why_not = self._heard(page, data)
                if why_not is None:
                    continue
                why = why_not
            await connection.close(1008, why.encode()[:120].decode(errors="ignore"))
            return


def _refusal(status: http.HTTPStatus, sentence: str) -> Response:
    return _response(status, "text/plain; charset=utf-8", f"{sentence}\n".encode(), "default-src 'none'")


def _response(status: http.HTTPStatus, kind: str, body: bytes, policy: str) -> Response:
    headers = Headers(
        {
            "Content-Type": kind,
            "Content-Length": str(len(body)),
            "Content-Security-Policy": policy,
            "Cache-Control": "no-store",
            "Referrer-Policy": "no-referrer",
            "X-Content-Type-Options": "nosniff",
            "Connection": "close",
        }
    )
    return Response(status.value, status.phrase, headers, body)
