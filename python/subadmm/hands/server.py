"""The server of the page of hands: gives the page, and keeps what its WebSockets say and are to be told."""
import errno
import socket
import threading
from http import HTTPStatus

from ..show import guard
from . import messages

_BLOCKED = 10.0   # s that a page may take to read what it is sent
#: Pages at a time.
_MOST = 16


def _websockets():
    try:
        import websockets.sync.server
    except ImportError as error:
        raise ImportError("the page of hands needs websockets: pip install 'websockets>=13'") from error
    return websockets


def context_of(certificate, key):
    """An ssl.SSLContext of the files, or None of none. Raises ValueError, OSError."""
    import ssl

    if certificate is None and key is None:
        return None
    if certificate is None or key is None:
        raise ValueError(f"{'certificate' if certificate is None else 'key'}: None; must be given with the "
                         f"{'key' if certificate is None else 'certificate'}")
    for path in (certificate, key):
        with open(path, "rb"):
            pass
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(certificate, key)
    except ssl.SSLError as error:
        raise ValueError(f"certificate: {certificate}, key: {key}; must be files of PEM that belong together "
                         f"({error})") from None
    return context


class Client:
    """A page. What it is told waits here: the scene, of which every message is sent, then the newest frame and all
    events."""

    def __init__(self, line):
        self.line = line
        self._there = threading.Condition()
        self._scene, self._frame, self._events, self._ended = [], None, [], False

    def tell_scene(self, parts):
        with self._there:
            self._scene, self._frame, self._events = list(parts), None, []
            self._there.notify()

    def tell(self, frame, event=None):
        with self._there:
            self._frame = frame
            if event is not None:
                self._events.append(event)
                del self._events[:-100]
            self._there.notify()

    def end(self):
        with self._there:
            self._ended = True
            self._there.notify()

    def send(self):
        """Until the line ends."""
        while True:
            with self._there:
                self._there.wait_for(lambda: self._scene or self._frame or self._events or self._ended)
                if self._ended:
                    return
                parts = self._scene + self._events + ([self._frame] if self._frame is not None else [])
                self._scene, self._frame, self._events = [], None, []
            try:
                for part in parts:
                    self.line.send(part)
            except Exception:       # it has gone
                return


class Server:
    """Serves `page` (text) at host and port, or the first port after it that is free. hear(client, message): called
    with each message that is let in, from the client's thread; greet(client), gone(client): when a page comes and
    goes. Raises OSError where it cannot be served there."""

    def __init__(self, page, host, port, context, hear, greet, gone):
        websockets = _websockets()
        self._page, self._host = page.encode(), host
        self._hear, self._greet, self._gone = hear, greet, gone
        self.clients, self._lock = set(), threading.Lock()
        port = guard.free_port(host, port)
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            self._server = websockets.sync.server.serve(
                self._serve, host, port, family=family, ssl=context, process_request=self._answer,
                max_size=messages.MOST_BYTES, compression=None, open_timeout=_BLOCKED, close_timeout=1.0)
        except OSError as error:
            raise OSError(error.errno or errno.EADDRINUSE,
                          f"host: {host!r}, port: {port}; cannot be served at: {error.strerror}") from None
        self.port = self._server.socket.getsockname()[1]
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def _answer(self, connection, request):
        """None: it is a WebSocket of the page's; else the answer."""
        from websockets.datastructures import Headers
        from websockets.http11 import Response

        why = guard.refusal(self._host, request.headers)
        if why is not None:
            return connection.respond(HTTPStatus.FORBIDDEN, why + "\n")
        path = request.path.partition("?")[0]
        if path == "/hands":
            if len(self.clients) >= _MOST:
                return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, "too many pages\n")
            return None
        if path != "/":
            return connection.respond(HTTPStatus.NOT_FOUND, "there is nothing here\n")
        return Response(HTTPStatus.OK, "OK", Headers([
            ("Content-Type", "text/html; charset=utf-8"), ("Content-Length", str(len(self._page))),
            ("Cache-Control", "no-store"), ("Connection", "close")]), self._page)

    def _serve(self, line):
        from websockets.exceptions import ConnectionClosed

        client = Client(line)
        with self._lock:
            self.clients.add(client)
        sender = threading.Thread(target=client.send, daemon=True)
        sender.start()
        try:
            self._greet(client)
            for data in line:
                message = messages.read(data)
                if message is not None:
                    self._hear(client, message)
        except ConnectionClosed:
            pass
        finally:
            with self._lock:
                self.clients.discard(client)
            client.end()
            self._gone(client)

    def everybody(self):
        """The pages that there are now."""
        with self._lock:
            return list(self.clients)

    def stop(self):
        """End it, and all lines."""
        for client in self.everybody():
            client.end()
        self._server.shutdown()
        for client in self.everybody():
            client.line.close()
        self._thread.join(5)
        # Threads of lines that are still being closed keep this object, and should keep no world.
        self._hear = self._greet = self._gone = lambda *_: None
