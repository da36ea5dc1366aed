"""Who may talk to the view's server, and what it may say.

A page of any origin may open a WebSocket to this machine, and a name that somebody else's server answers for may lead
here: what asks has to come from the page that this server gave out, by a name that is this machine's. Of messages only
those that the page sends are let in, with finite numbers in range; all others are dropped, as if they had not come.
viser has no place for either, so that its server is derived from, and the function that it opens its socket with is
given a check of its own.
"""
import errno
import ipaddress
import math
import socket
import sys
import threading
from http import HTTPStatus
from types import SimpleNamespace
from urllib.parse import urlsplit

LARGEST = 1e9            # of any number in a message
_MOST_BYTES = 1 << 16    # of a message
_LONGEST = 1000          # characters of any text
_MOST_PORTS = 1000       # tried, from the one that is asked for on
_starting = threading.Lock()


# ---- addresses -----------------------------------------------------------------------------------------------------


def _bind(places, port):
    """Can a server listen at all of them? OSError."""
    for family, kind, protocol, _, place in places:
        try:
            probe = socket.socket(family, kind, protocol)
        except OSError:          # no such addresses on this machine, which servers leave out as well
            continue
        with probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if family == socket.AF_INET6:
                probe.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            probe.bind((place[0], port, *place[2:]))


def free_port(host, port):
    """The first port from `port` on that a server can listen at; 0: any, and 0 is returned. Raises OSError where there
    is none, or the host is no address of this machine."""
    try:
        places = socket.getaddrinfo(host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except (socket.gaierror, UnicodeError) as error:
        raise OSError(errno.EADDRNOTAVAIL,
                      f"host: {host!r}; must be an address or a name of this machine ({error})") from None
    for candidate in range(port, min(port + _MOST_PORTS, 65536) if port else 1):
        try:
            _bind(places, candidate)
            return candidate
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise OSError(error.errno,
                              f"host: {host!r}, port: {candidate}; cannot be served at: {error.strerror}") from None
    raise OSError(errno.EADDRINUSE, f"port: {port}; no port is free from there on")


# ---- who -----------------------------------------------------------------------------------------------------------


def _address(name):
    """Of an IP address as text; None of another name."""
    try:
        return ipaddress.ip_address(name)
    except ValueError:
        return None


def _is_here(name, host):
    """Is it a name of this machine that a server at `host` may be asked by? An address cannot be made to lead
    elsewhere, a name can: only those that are this machine's by themselves."""
    bound, asked = _address(host), _address(name)
    only_here = host == "localhost" or (bound is not None and bound.is_loopback)
    if asked is not None:
        return asked.is_loopback if only_here else True
    if name == "localhost" or name.endswith(".localhost"):
        return True
    return not only_here and name in {host.lower(), socket.gethostname().lower(), socket.getfqdn().lower()}


def refusal(host, headers):
    """Why a request with these headers is refused by a server at `host`; None: it is not. headers.get_all(name): the
    values of a header."""
    hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
    if len(hosts) != 1 or len(origins) > 1:
        return "one header Host, and one Origin at most"
    try:
        name = urlsplit(f"//{hosts[0]}").hostname or ""
        origin = urlsplit(origins[0]) if origins else None
    except ValueError:
        return "Host and Origin are no addresses"
    if not _is_here(name.rstrip("."), host):
        return f"Host {hosts[0]}: is not this server"
    if origin and (origin.scheme not in ("http", "https") or origin.netloc.lower() != hosts[0].lower()):
        return f"Origin {origins[0]}: is not this server's page"
    return None


# ---- what ----------------------------------------------------------------------------------------------------------


def is_number(x, low=-LARGEST, high=LARGEST):
    return isinstance(x, (int, float)) and not isinstance(x, bool) and low <= x <= high


def _numbers(count):
    return lambda x: isinstance(x, (tuple, list)) and len(x) == count and all(map(is_number, x))


def _is_turn(q):
    return _numbers(4)(q) and 0.5 <= math.hypot(*q) <= 2


def _is_text(x):
    return isinstance(x, str) and len(x) <= _LONGEST


def _one_of(*values):
    return lambda x: any(x is value or (isinstance(x, str) and x == value) for value in values)


def _is_index(x):
    return x is None or (isinstance(x, int) and not isinstance(x, bool) and 0 <= x < 2**31)


def _is_pair(x):
    """Places on the screen, which nobody reads; of points behind the camera they are anything."""
    return isinstance(x, list) and len(x) == 2


def _is_modifier(x):
    return x is None or _is_text(x)


#: Messages that the page sends, and what their fields have to be. `updates` of the controls is looked at below.
FIELDS = {
    "ViewerCameraMessage": {
        "wxyz": _is_turn, "position": _numbers(3), "look_at": _numbers(3), "up_direction": _numbers(3),
        "fov": lambda x: is_number(x, 0, math.pi), "near": is_number, "far": is_number,
        "image_height": lambda x: is_number(x, 0, 1e5), "image_width": lambda x: is_number(x, 0, 1e5),
    },
    "SceneNodeDragMessage": {
        "phase": _one_of("start", "update", "end"), "name": _is_text, "instance_index": _is_index,
        "start_position": _numbers(3), "start_screen_pos": _is_pair, "end_position": _numbers(3),
        "end_screen_pos": _is_pair, "button": _one_of("left", "middle", "right"), "modifier": _is_modifier,
        "owner": _is_text,
    },
    "TransformControlsUpdateMessage": {"name": _is_text, "wxyz": _is_turn, "position": _numbers(3), "owner": _is_text},
    "TransformControlsDragStartMessage": {"name": _is_text, "owner": _is_text},
    "TransformControlsDragEndMessage": {"name": _is_text, "owner": _is_text},
    "SceneNodeClickMessage": {
        "name": _is_text, "instance_index": _is_index, "ray_origin": _numbers(3), "ray_direction": _numbers(3),
        "screen_pos": _is_pair, "modifier": _is_modifier, "owner": _is_text,
    },
    "CommandTriggerMessage": {"uuid": _is_text},
    "GuiUpdateMessage": {"uuid": _is_text, "updates": lambda x: isinstance(x, dict) and x.keys() == {"value"}},
}


def fits_control(control, value):
    """May a control of the page have this value?"""
    if isinstance(control.value, bool):
        return isinstance(value, bool)
    if hasattr(control, "options"):
        return isinstance(value, str) and value in control.options
    if isinstance(control.value, (int, float)):
        low, high = (getattr(control, name, None) for name in ("min", "max"))
        low, high = -LARGEST if low is None else low, LARGEST if high is None else high
        slack = 1e-9 * (high - low)  # of sliders, whose steps are added up by the page
        return is_number(value, low - slack, high + slack)
    return False


def wanted_of(control):
    """What fits_control() lets in, in words."""
    if isinstance(control.value, bool):
        return "must be true or false"
    if hasattr(control, "options"):
        return f"must be one of {', '.join(control.options)}"
    low, high = (getattr(control, name, None) for name in ("min", "max"))
    return f"must be a number in [{-LARGEST if low is None else low:g}, {LARGEST if high is None else high:g}]"


def fits(message, control_of, refuse=lambda control, value: None):
    """May the page say this, a dict? control_of(uuid): a control of it, or None. refuse(control, value): told of a
    value of a control that does not fit."""
    kind = message.get("type")
    fields = FIELDS.get(kind) if isinstance(kind, str) else None
    if kind == "SceneNodeDragMessage" and message.get("phase") == "end":   # it lets go, wherever that is
        message = {name: x for name, x in message.items() if not name.endswith("_position")}
    if fields is None or not all(name == "type" or (name in fields and fields[name](x)) for name, x in message.items()):
        return False
    if kind != "GuiUpdateMessage":
        return True
    control = control_of(message["uuid"])
    if control is None:
        return False
    fine = fits_control(control, message["updates"]["value"])
    if not fine:
        refuse(control, message["updates"]["value"])
    return fine


class _Dropped:
    """Instead of a message that is not let in: nobody has asked for any of this type."""


class _Filter:
    """In the place of viser's class of messages: reads those that fit."""

    def __init__(self, messages):
        self.messages, self.control_of = messages, lambda uuid: None
        self.refuse = lambda control, value: None

    def deserialize(self, data):
        import msgspec  # as viser does

        try:
            if len(data) <= _MOST_BYTES and fits(msgspec.msgpack.decode(data), self.control_of, self.refuse):
                return self.messages.deserialize(data)
        except Exception:  # whatever else the bytes are
            pass
        return _Dropped()


# ---- the server ----------------------------------------------------------------------------------------------------


def _guarded(base, host, made):
    """viser's server, of which `made` becomes the list."""

    class Server(base):
        def __init__(self, *args, message_class, **options):
            self.filter, self.guarded, self.ended, self.worker = _Filter(message_class), False, None, None
            super().__init__(*args, message_class=self.filter, **options)
            made.append(self)

        def serve(self, serve):
            """In the place of websockets' serve()."""
            def guarded_serve(*args, process_request, **options):
                def checked(connection, request):
                    why = refusal(host, request.headers)
                    if why is not None:
                        return connection.respond(HTTPStatus.FORBIDDEN, why + "\n")
                    return process_request(connection, request)

                if threading.get_ident() != self.worker:    # somebody else's server
                    return serve(*args, process_request=process_request, **options)
                self.guarded = True
                return serve(*args, process_request=checked, **options)

            return guarded_serve

        def _background_worker(self, ready):
            self.worker = threading.get_ident()
            try:
                super()._background_worker(ready)
                self.ended = OSError(errno.EADDRINUSE, f"host: {host!r}; cannot be served at")
            except BaseException as error:
                self.ended = error
            finally:
                ready.release()      # who waits for it to begin does not wait for ever

        def start(self):
            super().start()
            if self.ended is not None:
                raise self.ended

    return Server


def tell_refused(server, tell):
    """tell(label, why): called with each value of a control that the page sends and that is not let in. The page has
    the old one again."""
    def refuse(control, value):
        shown = repr(value) if isinstance(value, (int, float, str)) else type(value).__name__
        tell(control.label, f"{shown[:60]}; {wanted_of(control)}")
        if not isinstance(control.value, bool):
            control._queue_update("value", control.value)

    server.filter.refuse = refuse


def serve(viser, host, port):
    """A viser.ViserServer at host and port, or the first port after it that is free."""
    port = free_port(host, port)
    infra, made = viser.infra, []
    with _starting:
        base = infra.WebsockServer
        module = sys.modules[base.__module__]
        websockets = module.websockets
        infra.WebsockServer = _guarded(base, host, made)

        def guarded_serve(*args, **options):
            plain = websockets.asyncio.server.serve
            return (made[0].serve(plain) if made else plain)(*args, **options)

        class Websockets:
            """The package, with one function that is another."""
            asyncio = SimpleNamespace(server=SimpleNamespace(serve=guarded_serve))

            def __getattr__(self, name):
                return getattr(websockets, name)

        module.websockets = Websockets()
        try:
            server = viser.ViserServer(host=host, port=port, verbose=False)
        finally:
            infra.WebsockServer, module.websockets = base, websockets
    if not made or not made[0].guarded:
        server.stop()
        raise ImportError(f"the view cannot guard the server of viser {viser.__version__}: another version is needed")
    server.filter = made[0].filter
    server.filter.control_of = lambda uuid: server.gui._gui_input_handle_from_uuid.get(uuid)
    return server
