"""The server of the live page: the page itself, and over a WebSocket what it shows and what it asks for."""

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

from hsv.base.errors import HsvError, ParameterError, reason
from hsv.base.files import json_text
from hsv.graph.addresses import HOST, origins
from hsv.pages.live.commands import Command, read_command
from hsv.pages.live.hub import Hub
from hsv.pages.live.page import render

SOCKET = "/flight"
"""Path of the WebSocket."""

_LONGEST_REQUEST = 10_000
"""Bytes of what a page may send at once."""

_GOING = 1001
"""Close code of a server that ends."""

Answer = Callable[[dict[str, Any]], None]
"""Takes the answer to a command: whether it was ``accepted``, a ``message``, and the ``step`` from which on it acts."""


class PageServer:
    """Serves the page in a separate thread: a client that is slow, or never reads, does not delay others.

    Raises:
        ParameterError: The port is in use.
    """

    def __init__(self, port: int, hub: Hub) -> None:
        self._hub = hub
        self._token = secrets.token_urlsafe(16)
        self.commands: SimpleQueue[tuple[Command, Answer]] = SimpleQueue()
        """Commands that were checked, to be carried out and answered."""
        self._changed: set[asyncio.Event] = set()
        self._loop = asyncio.new_event_loop()
        try:
            self._server = self._loop.run_until_complete(self._listen(port))
        except OSError as error:
            self._loop.close()
            raise ParameterError(
                f"live.page_port = {port}: {reason(error).lower()}, expected a free port of this machine"
            ) from None
        self.port = int(self._server.sockets[0].getsockname()[1])
        self._page = render(hub, self.port).encode()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """Address of the page, with the token for commands in the fragment, which browsers do not send."""
        return f"http://{HOST}:{self.port}/#token={self._token}"

    @property
    def watched(self) -> bool:
        """Whether somebody looks at the page."""
        return bool(self._changed)

    def publish(self) -> None:
        """Send new data of the hub to all clients, to each when it is ready."""
        if self._changed:
            self._loop.call_soon_threadsafe(self._wake)

    def close(self) -> None:
        """Send new data, and disconnect the clients."""

        async def leave() -> None:
            self._wake()
            with suppress(TimeoutError):
                # The tasks of clients that read have sent everything by then.
                await asyncio.wait_for(self._sent(), _LAST_WORDS)
            self._server.close(code=_GOING, reason="the live view has ended")
            with suppress(TimeoutError):
                await asyncio.wait_for(self._server.wait_closed(), _LAST_WORDS)
            unread = asyncio.all_tasks() - {asyncio.current_task()}
            for task in unread:
                task.cancel()
            await asyncio.gather(*unread, return_exceptions=True)

        asyncio.run_coroutine_threadsafe(leave(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _wake(self) -> None:
        for changed in self._changed:
            changed.set()

    async def _listen(self, port: int) -> Server:
        # Of a client that comes wrongly, a person at the flight need not hear.
        logger = logging.getLogger(__name__)
        logger.addFilter(lambda record: record.msg != "opening handshake failed")
        return await serve(
            self._serve,
            HOST,
            port,
            process_request=self._respond,
            max_size=_LONGEST_REQUEST,
            close_timeout=_LAST_WORDS,
            logger=logger,
        )

    async def _sent(self) -> None:
        await asyncio.sleep(0)
        while any(event.is_set() for event in self._changed):
            await asyncio.sleep(_LOOK)

    def _respond(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer whatever asks for no WebSocket, and refuse pages of other places."""
        origin = request.headers.get("Origin")
        allowed = origins(self.port)
        if origin is not None and origin not in allowed:
            text = f"Origin: {origin!r}, expected {' or '.join(allowed)}\n"
            return connection.respond(HTTPStatus.FORBIDDEN, text)
        if request.path == SOCKET and "Upgrade" in request.headers:
            if origin is None:
                return connection.respond(HTTPStatus.FORBIDDEN, f"Origin: missing, expected {' or '.join(allowed)}\n")
            return None
        if request.path != "/":
            return connection.respond(HTTPStatus.NOT_FOUND, f"path = {request.path!r}: expected / or {SOCKET}\n")
        response = connection.respond(HTTPStatus.OK, "")
        response.body = self._page
        del response.headers["Content-Type"], response.headers["Content-Length"]
        response.headers["Content-Type"] = "text/html; charset=utf-8"
        response.headers["Content-Length"] = str(len(self._page))
        response.headers["Cache-Control"] = "no-store"
        return response

    async def _serve(self, connection: ServerConnection) -> None:
        changed = asyncio.Event()
        changed.set()
        self._changed.add(changed)
        sender = asyncio.create_task(self._send(connection, changed))
        try:
            async for text in connection:
                self._take(connection, text)
        except ConnectionClosed:
            pass
        finally:
            self._changed.discard(changed)
            sender.cancel()

    async def _send(self, connection: ServerConnection, changed: asyncio.Event) -> None:
        """Send what has changed since the last time, as fast as the client reads."""
        generation, rows, version = 0, 0, -1
        with suppress(ConnectionClosed):
            while True:
                await changed.wait()
                if self._hub.version != version:
                    version = self._hub.version
                    await connection.send(json_text({"kind": "status", **self._hub.status()}))
                history = self._hub.history(generation, rows)
                if history.generation != generation:
                    generation = history.generation
                    await connection.send(json_text({"kind": "history"}))
                rows = history.first + len(history.rows)
                if len(history.rows):
                    await connection.send(history.rows.tobytes())
                if self._hub.version == version:
                    changed.clear()

    def _take(self, connection: ServerConnection, text: str | bytes) -> None:
        """Check a request and hand it on; whatever comes of it is answered."""
        number: Any = None

        def answer(values: dict[str, Any]) -> None:
            words = json_text({"kind": "answer", "id": number, **values})
            self._loop.call_soon_threadsafe(lambda: self._loop.create_task(_send_quietly(connection, words)))

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
    try:
        fields = json.loads(text)
    except ValueError as error:
        raise ParameterError(f"request: no JSON ({error}), expected an object") from None
    if not isinstance(fields, dict):
        raise ParameterError(f"request = {text!r}: expected a JSON object")
    return fields


async def _send_quietly(connection: ServerConnection, words: str) -> None:
    with suppress(ConnectionClosed):
        await connection.send(words)


_LAST_WORDS = 1.0
"""Seconds for which clients are waited for at the end."""

_LOOK = 0.01
