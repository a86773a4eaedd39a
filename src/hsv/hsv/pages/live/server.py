"""The server of the live page, with a WebSocket for data and commands."""

from __future__ import annotations

import asyncio
import json
import logging
import secrets
import threading
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from queue import SimpleQueue
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from hsv.base.errors import DocumentError, HsvError, ParameterError, reason
from hsv.base.files import json_text, parse_json
from hsv.graph.exclusive import HOST, origins
from hsv.pages.live.commands import Command, read_command
from hsv.pages.live.hub import Hub
from hsv.pages.live.page import live_page

SOCKET = "/flight"
"""Path of the WebSocket."""

LAYOUT = "/foxglove.json"
"""Path of the layout for Foxglove and Lichtblick."""

LONGEST_REQUEST = 10_000
"""Maximum length (bytes) of a request."""

MAX_WAITING = 100
"""Maximum number of answers that wait until a client reads them; further ones are dropped."""

GOING_AWAY = 1001
"""WebSocket close code of a server that stops."""

PERIOD = 0.05
"""Time (s) between checks for new data."""

CLOSE_TIMEOUT = 1.0
"""Time (s) to wait for clients when the server stops."""

Answer = Callable[[dict[str, Any]], None]
"""Function that sends the answer to a command: ``accepted``, ``message``, and the ``step`` at which it takes effect."""


class PageServer:
    """A server of the page in a separate thread; a slow client does not delay others.

    Raises:
        ParameterError: The port is in use.
    """

    def __init__(self, port: int, hub: Hub, layout: str) -> None:
        """Listen on ``port`` (0: any free port); ``layout`` is the Foxglove layout, which is served as well."""
        self._hub = hub
        self._token = secrets.token_urlsafe(16)
        self.commands: SimpleQueue[tuple[Command, Answer]] = SimpleQueue()
        """Queue of valid commands with the functions that answer them."""
        self._senders: set[asyncio.Task[None]] = set()
        self._ended = False
        self._loop = asyncio.new_event_loop()
        try:
            self._server = self._loop.run_until_complete(self._listen(port))
        except OSError as error:
            self._loop.close()
            raise ParameterError(
                f"live.page_port = {port}: {reason(error).lower()}, expected a free port of this machine"
            ) from None
        self.port = int(self._server.sockets[0].getsockname()[1])
        self._documents = {
            "/": ("text/html; charset=utf-8", live_page(hub, self.port).encode()),
            LAYOUT: ("application/json", layout.encode()),
        }
        """Media type and content of each served document, by path."""
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """URL of the page; the fragment, which browsers do not send, contains the token for commands."""
        return f"http://{HOST}:{self.port}/#token={self._token}"

    @property
    def layout_url(self) -> str:
        """URL of the layout for Foxglove and Lichtblick."""
        return f"http://{HOST}:{self.port}{LAYOUT}"

    def close(self) -> None:
        """Send the last data and disconnect the clients."""
        asyncio.run_coroutine_threadsafe(self._leave(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def _leave(self) -> None:
        self._ended = True
        if self._senders:
            await asyncio.wait(self._senders, timeout=CLOSE_TIMEOUT)
        self._server.close(code=GOING_AWAY, reason="the live view has ended")
        with suppress(TimeoutError):
            await asyncio.wait_for(self._server.wait_closed(), CLOSE_TIMEOUT)
        # The remaining tasks belong to clients that do not read.
        unread = asyncio.all_tasks() - {asyncio.current_task()}
        for task in unread:
            task.cancel()
        await asyncio.gather(*unread, return_exceptions=True)

    async def _listen(self, port: int) -> Server:
        # Suppress messages about clients without a valid handshake.
        logger = logging.getLogger(__name__)
        logger.addFilter(lambda record: record.msg != "opening handshake failed")
        return await serve(
            self._serve,
            HOST,
            port,
            process_request=self._respond,
            max_size=LONGEST_REQUEST,
            close_timeout=CLOSE_TIMEOUT,
            logger=logger,
        )

    def _respond(self, connection: ServerConnection, request: Request) -> Response | None:
        """Serve page and layout, and refuse requests from other origins; return None to accept a WebSocket."""
        origin, allowed = request.headers.get("Origin"), origins(self.port)
        socket = request.path == SOCKET and "Upgrade" in request.headers
        if origin not in allowed and (origin is not None or socket):
            shown = "missing" if origin is None else repr(origin)
            return connection.respond(HTTPStatus.FORBIDDEN, f"Origin: {shown}, expected {' or '.join(allowed)}\n")
        if socket:
            return None
        if request.path not in self._documents:
            known = f"{', '.join(self._documents)} or {SOCKET}"
            return connection.respond(HTTPStatus.NOT_FOUND, f"path = {request.path!r}: expected {known}\n")
        response = connection.respond(HTTPStatus.OK, "")
        kind, response.body = self._documents[request.path]
        del response.headers["Content-Type"], response.headers["Content-Length"]
        response.headers["Content-Type"] = kind
        response.headers["Content-Length"] = str(len(response.body))
        response.headers["Cache-Control"] = "no-store"
        return response

    async def _serve(self, connection: ServerConnection) -> None:
        sender, waiting = asyncio.create_task(self._send(connection)), set[asyncio.Task[None]]()
        self._senders.add(sender)
        try:
            async for text in connection:
                self._receive(connection, text, waiting)
        except ConnectionClosed:
            pass
        finally:
            self._senders.discard(sender)
            sender.cancel()

    async def _send(self, connection: ServerConnection) -> None:
        """Send the hub's changes every ``PERIOD``, later to a slow client, and the last ones when the server stops."""
        known, count, version, ended = 0, 0, -1, False
        with suppress(ConnectionClosed):
            while not ended:
                ended = self._ended
                if self._hub.version != version:
                    version = self._hub.version
                    await connection.send(json_text({"kind": "status", **self._hub.status()}))
                generation, first, rows = self._hub.history(known, count)
                if generation != known:
                    await connection.send(json_text({"kind": "history"}))
                known, count = generation, first + len(rows)
                if len(rows):
                    await connection.send(rows.tobytes())
                await asyncio.sleep(PERIOD)

    def _receive(self, connection: ServerConnection, text: str | bytes, waiting: set[asyncio.Task[None]]) -> None:
        """Validate a request and queue its command, or reply why it is rejected."""
        number: Any = None

        def answer(values: dict[str, Any]) -> None:
            words = json_text({"kind": "answer", "id": number, **values})
            self._loop.call_soon_threadsafe(send, words)

        def send(words: str) -> None:
            if len(waiting) < MAX_WAITING:  # otherwise the client does not read
                task = self._loop.create_task(_send_quietly(connection, words))
                waiting.add(task)
                task.add_done_callback(waiting.discard)

        try:
            fields = _fields(text)
            number = fields.get("id")
            if not secrets.compare_digest(str(fields.get("token", "")).encode(), self._token.encode()):
                raise ParameterError("token: wrong or missing, expected that of the address that the start has printed")
            command = read_command(fields)
        except HsvError as error:
            answer({"accepted": False, "message": str(error)})
            return
        self.commands.put((command, answer))


def _fields(text: str | bytes) -> dict[str, Any]:
    """Return the fields of a request; raise a ParameterError if it is not a JSON object."""
    try:
        fields = parse_json(text)
        json.dumps(fields, ensure_ascii=False).encode()
    except DocumentError as error:
        raise ParameterError(f"request: no JSON ({error}), expected an object") from None
    except UnicodeError:
        raise ParameterError("request: half a surrogate pair in a text, expected characters") from None
    if not isinstance(fields, dict):
        raise ParameterError(f"request = {text!r}: expected a JSON object")
    return fields


async def _send_quietly(connection: ServerConnection, words: str) -> None:
    with suppress(ConnectionClosed):
        await connection.send(words)
