"""The view's server: who may talk to it, what it lets be said, and where it can be."""
import base64
import itertools
import math
import socket
import time

import numpy as np
import pytest

import subadmm
from subadmm import show
from subadmm.show.session import Session

viser = pytest.importorskip("viser")

from subadmm.show import guard  # noqa: E402
from subadmm.show.view import View  # noqa: E402


def led_box():
    """A box with a coupling, and a lever with a servo: all that the page has controls for."""
    world = subadmm.World(backend="cpu")
    world.add_ground()
    box = world.add_solid(subadmm.box(0.1, 0.1, 0.1), mass=2, position=(0, 0, 0.1))
    world.add_coupling(box, target_position=(0, 0, 0.1), linear_stiffness=10, linear_damping=10)
    lever = world.add_solid(subadmm.box(0.1, 0.1, 0.1), mass=2, position=(1, 0, 0.5), name="lever")
    servo = subadmm.Coordinate(drive="position", drive_stiffness=50, drive_damping=2)
    world.add_joint("revolute", None, lever, position=(1, 0, 0.5), coordinates={5: servo})
    return world


@pytest.fixture
def view():
    made = View(Session(led_box), "a box", port=0)
    yield made
    made.stop()


# ---- addresses -----------------------------------------------------------------------------------------------------


def test_addresses_that_cannot_be_served_are_errors_and_no_server_is_waited_for(capsys):
    from subadmm.__main__ import main

    for host, said in (("203.0.113.9", "'203.0.113.9', port: 18441; cannot be served at"),
                       ("no.such.host.invalid", "must be an address"),
                       ("300.1.1.1", "must be an address"), ("a" * 300, "must be an address")):
        with pytest.raises(OSError, match="host: '" + host[:9]):
            View(Session(led_box), host=host, port=18441)
        assert main(["view", "pyramid:2", "--host", host, "--port", "18441"]) == 1
        reported = capsys.readouterr().err
        assert said in reported and reported.count("\n") == 1
    for port in (-1, 65536, 2**31 - 1):
        with pytest.raises(ValueError, match=f"port: {port}"):
            show.view.serve(led_box, port=port)


def test_a_port_that_is_taken_is_left_to_who_has_it(monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert guard.free_port("127.0.0.1", port) > port or port > 65000
    with socket.socket() as taken:  # the last one there is
        try:
            taken.bind(("127.0.0.1", 65535))
            taken.listen()
        except OSError:
            pass
        with pytest.raises(OSError, match="port: 65535; no port is free"):
            guard.free_port("127.0.0.1", 65535)
        # A server that finds none although there was one a moment ago says so, too.
        monkeypatch.setattr(guard, "free_port", lambda host, port: port)
        with pytest.raises((OSError, OverflowError)):
            View(Session(led_box), port=65535)


# ---- who may talk to it --------------------------------------------------------------------------------------------


class Headers(dict):
    def get_all(self, name):
        return self.get(name, [])


@pytest.mark.parametrize("host, asked, origin, fine", [
    ("127.0.0.1", "127.0.0.1:8080", None, True),          # no browser
    ("127.0.0.1", "127.0.0.1:8080", "http://127.0.0.1:8080", True),
    ("127.0.0.1", "localhost:8080", "http://localhost:8080", True),
    ("127.0.0.1", "LOCALHOST:8080", "http://localhost:8080", True),
    ("127.0.0.1", "localhost:9000", "http://localhost:9000", True),   # a port that is passed on
    ("localhost", "[::1]:8080", "http://[::1]:8080", True),
    ("127.0.0.1", "127.0.0.1:8080", "http://evil.example", False),
    ("127.0.0.1", "127.0.0.1:8080", "https://evil.example:8080", False),
    ("127.0.0.1", "127.0.0.1:8080", "http://127.0.0.1:8081", False),  # another server of this machine
    ("127.0.0.1", "127.0.0.1:8080", "http://localhost:8080", False),
    ("127.0.0.1", "127.0.0.1:8080", "null", False),       # of a file, or a frame in a sandbox
    ("127.0.0.1", "127.0.0.1:8080", "file://", False),
    ("127.0.0.1", "127.0.0.1:8080", "http://[", False),
    ("127.0.0.1", "evil.example:8080", "http://evil.example:8080", False),   # a name that leads here
    ("127.0.0.1", "evil.example:8080", None, False),
    ("127.0.0.1", "127.0.0.1.evil.example", None, False),
    ("127.0.0.1", "192.168.1.5:8080", None, False),
    ("127.0.0.1", "", None, False),
    ("127.0.0.1", "[", None, False),
    ("0.0.0.0", "192.168.1.5:8080", "http://192.168.1.5:8080", True),
    ("0.0.0.0", f"{socket.gethostname()}:8080", f"http://{socket.gethostname()}:8080", True),
    ("0.0.0.0", "evil.example:8080", "http://evil.example:8080", False),
    ("0.0.0.0", "192.168.1.5:8080", "http://evil.example", False),
    ("mybox.lan", "mybox.lan:8080", "http://mybox.lan:8080", True),
])
def test_requests_come_from_the_page_by_a_name_of_this_machine(host, asked, origin, fine):
    headers = Headers(Host=[asked], **({} if origin is None else {"Origin": [origin]}))
    assert (guard.refusal(host, headers) is None) == fine
    assert guard.refusal(host, Headers(headers, Host=[asked, asked])) is not None
    assert guard.refusal(host, Headers(Origin=["http://localhost"])) is not None


def answer(port, host, origin=None, upgrade=True):
    """The status of a request."""
    lines = ["GET / HTTP/1.1", f"Host: {host}"]
    if upgrade:
        key = base64.b64encode(b"0123456789abcdef").decode()
        lines += ["Upgrade: websocket", "Connection: Upgrade", f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13",
                  f"Sec-WebSocket-Protocol: viser-v{viser.__version__}"]
    if origin is not None:
        lines.append(f"Origin: {origin}")
    with socket.create_connection(("127.0.0.1", port), timeout=20) as line:
        line.sendall("\r\n".join([*lines, "", ""]).encode())
        return int(line.recv(1000).split()[1])


def test_other_pages_are_refused(view):
    port = view.server.get_port()
    here = f"127.0.0.1:{port}"
    assert answer(port, here) == 101 and answer(port, here, f"http://{here}") == 101
    assert answer(port, here, upgrade=False) == 200
    assert answer(port, here, "http://evil.example") == 403
    assert answer(port, f"evil.example:{port}", f"http://evil.example:{port}") == 403
    assert answer(port, f"evil.example:{port}", upgrade=False) == 403


def test_other_servers_of_viser_are_as_they_were(view):
    server = viser.ViserServer(host="127.0.0.1", port=guard.free_port("127.0.0.1", 20000), verbose=False)
    try:
        port = server.get_port()
        assert answer(port, f"127.0.0.1:{port}", "http://elsewhere.example") == 101
    finally:
        server.stop()
    assert answer(view.server.get_port(), f"127.0.0.1:{view.server.get_port()}", "http://elsewhere.example") == 403


# ---- what may be said ----------------------------------------------------------------------------------------------

CAMERA = {"type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [1, 2, 3], "fov": 1.0, "near": 0.1,
          "far": 1000,
          "image_height": 600, "image_width": 960, "look_at": [0, 0, 0], "up_direction": [0, 0, 1]}
DRAG = {"type": "SceneNodeDragMessage", "phase": "start", "name": "/bodies/0", "instance_index": 0,
        "start_position": [0, 0, 0.2],
        "start_screen_pos": [0.5, 0.5], "end_position": [0, 0, 0.2], "end_screen_pos": [0.5, 0.5], "button": "left",
        "modifier": None, "owner": ""}
GIZMO = {"type": "TransformControlsUpdateMessage", "name": "/steering/0", "wxyz": [1, 0, 0, 0], "position": [0, 0, 0.3],
         "owner": ""}


class Client:
    """A page, as far as the server sees it."""

    def __init__(self, view):
        from websockets.sync.client import connect

        self.view = view
        self.line = connect(f"ws://127.0.0.1:{view.server.get_port()}", subprotocols=[f"viser-v{viser.__version__}"],
                            max_size=None)
        self.send(CAMERA)
        until(lambda: view.server.get_clients())

    def send(self, *messages):
        import msgspec

        for message in messages:
            self.line.send(message if isinstance(message, bytes) else msgspec.msgpack.encode(message))

    def control(self, label):
        """(uuid, handle) of a control of the page."""
        return next((uuid, handle) for uuid, handle in self.view.server.gui._gui_input_handle_from_uuid.items()
                    if handle.label == label)

    def set(self, label, value, **more):
        uuid, _ = self.control(label)
        self.send({"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value, **more}})

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.line.close()


def until(true):
    end = time.monotonic() + 30
    while not true():
        assert time.monotonic() < end, "it did not come to that within 30 s"
        time.sleep(0.005)


def works(view, client):
    """All that was sent before is done, and the page can be used: what it says is done, and frames come."""
    speed = 0.5 if view.session.speed != 0.5 else 0.75
    client.set("speed", speed)
    until(lambda: view.session.speed == speed)
    steps = view.session.steps
    view.session.running = True
    until(lambda: view.frame() or view.session.steps > steps)
    assert np.isfinite(view.session.world.positions).all()
    return True


def test_what_the_page_says_is_done(view):
    with Client(view) as client:
        assert works(view, client)
        client.set("iterations", 33)
        client.set("method", "paper")
        until(lambda: view.session.world.settings.iterations == 33 and view.session.world.settings.method == "paper")
        client.set("measure the error", False)
        until(lambda: not view.session.world.settings.certify)
        client.set("Reset", True)
        until(lambda: view.session.steps == 0)
        name = next(handle.name for group, handle in view._moving)
        client.send({**DRAG, "name": name})
        until(lambda: view.session.hand() is not None)
        client.send({**DRAG, "name": name, "phase": "end", "end_position": [math.nan] * 3,
                     "end_screen_pos": [math.nan, 0]})
        until(lambda: view.session.hand() is None)
        client.set("steer", True)
        until(lambda: view.session.steering.on)
        client.send(GIZMO)
        until(lambda: view.session.steering.leads[0].position.tolist() == [0, 0, 0.3])
        slider = client.control("lever, °")[1]
        client.set("lever, °", slider.max)
        until(lambda: view.session.steering.goals[0, 5] == pytest.approx(slider.max * np.pi / 180))
        assert works(view, client)


NUMBERS = [math.nan, math.inf, -math.inf, 1e300, "1", None, [], True, {}, b"\0"]


def test_values_that_would_leave_it_unusable_are_dropped(view):
    with Client(view) as client:
        assert works(view, client)
        name = view._moving[0][1].name
        view.session.running = False
        controls = {label: client.control(label)[1].value for label in (
            "Pause", "iterations", "method", "backend", "measure the error", "contact forces", "steer", "lever, °")}
        settings = view.session.world.settings
        for wrong in NUMBERS + [-1, 0, 2**31, 1.5e9, "no such"]:
            for label in controls:
                if isinstance(controls[label], bool) and isinstance(wrong, bool):
                    continue
                if label == "lever, °" and wrong in (-1, 0):
                    continue
                client.set(label, wrong)
        for uuid, _ in (client.control("speed"), client.control("iterations")):   # no other member of a control
            for updates in ({"visible": False}, {"removed": True}, {"update_cb": []}, {"value": 1.0, "max": 2}, {}, [],
                            None):
                client.send({"type": "GuiUpdateMessage", "uuid": uuid, "updates": updates})
        for wrong in NUMBERS:
            for message, fields in ((GIZMO, ("position", "wxyz")),
                                    ({**DRAG, "name": name}, ("start_position", "end_position"))):
                for field in fields:
                    client.send({**message, field: wrong}, {**message, field: [wrong] * len(message[field])})
        client.send({**GIZMO, "wxyz": [0, 0, 0, 0]}, {**GIZMO, "position": [1e6, 0, 0]}, {**GIZMO, "position": [0, 0]},
                    {**DRAG, "name": name, "instance_index": 10**6}, {**DRAG, "name": name, "instance_index": -1},
                    {**DRAG, "name": name, "start_position": [0, 0, 1e6]},
                    {**DRAG, "name": name, "end_position": [0, 0, 1e6]},
                    {**DRAG, "name": name, "phase": "none"}, {**CAMERA, "fov": math.nan},
                    {**CAMERA, "position": [math.nan] * 3})
        client.send({"type": "ShareUrlRequest"}, {"type": "none"}, {}, b"", b"\xc1", b"\x92\x01",
                    {"type": "FileTransferStartUpload", "source_component_uuid": "", "transfer_uuid": "a",
                     "filename": "a",
                     "mime_type": "", "part_count": 1, "size_bytes": 10**12})
        view.session.running = False
        client.set("speed", 1.25)
        until(lambda: view.session.speed == 1.25)
        assert {label: client.control(label)[1].value for label in controls} == controls
        now = view.session.world.settings
        assert all(getattr(now, name) == getattr(settings, name) for name in ("iterations", "method", "certify"))
        assert view.session.hand() is None and not view.session.world.couplings[1:]
        assert view.session.steering.leads[0].position.tolist() == [0, 0, 0.1] and not view.session.steering.on
        assert np.isfinite(next(iter(view.server.get_clients().values())).camera.position).all()
        assert works(view, client)


def test_whatever_is_said_the_view_goes_on(view):
    """Messages of all types with some of their fields anything: a fixed sequence."""
    random = np.random.default_rng(7)
    with Client(view) as client:
        name = view._moving[0][1].name
        uuids = [client.control(label)[0]
                 for label in ("iterations", "Reset", "steer", "lever, °", "contact forces", "method")]
        values = [*NUMBERS, 0, 1, -1, 0.5, 1e-300, 1e9, 2**31, 2**53, "", "start", "Reset", "paper", "x" * 3000,
                  [0, 0, 1],
                  [1, 0, 0, 0], [math.nan] * 3, [1e8] * 3, False, {"value": 7}, {"value": math.nan}, {"value": "Step"}]
        # as objects: what lists there are have lists in them
        pick = lambda of: of[random.integers(len(of))]  # noqa: E731
        for _ in range(1500):
            message = dict(pick([CAMERA, {**DRAG, "name": name}, GIZMO,
                                 {"type": "GuiUpdateMessage", "uuid": pick(uuids), "updates": {"value": 1}}]))
            for field in random.permutation(list(message))[:random.integers(0, 3)]:
                message[str(field)] = pick(values)
            client.send(message)
        # Some connections are closed by what they say; others go on.
    view.session.release()
    with Client(view) as client:
        client.set("Reset", True)
        client.set("method", "fast")
        assert works(view, client)


def test_a_step_that_fails_pauses_and_is_said(view):
    view.session.world.add_body(mass=1, inertia=(1, 1, 1), position=(5, 5, 5), linear_velocity=(1e6, 0, 0))
    body = view.session.world.bodies[-1]
    body.set_wrench((1e15, 0, 0))
    settings = view.session.world.settings
    settings.dt = 1.0
    view.session.world.settings = settings

    def fail(*_):
        raise subadmm.NonFinite("a step made no number")

    view.session.step, step = fail, view.session.step
    view.session._late = 10.0
    view._plotted = 0
    view.frame()
    assert not view.session.running and "a step made no number" in view._said.content
    view.session.step = step
    with Client(view) as client:
        client.set("Reset", True)
        until(lambda: view.session.steps == 0 and not view._wrong)
        assert works(view, client)


# ---- controls ------------------------------------------------------------------------------------------------------


def command(view, label):
    """The number by which the page asks for a command."""
    return next(uuid for uuid, handle in view.server.gui._command_handle_from_uuid.items() if handle.label == label)


def trigger(client, label):
    client.send({"type": "CommandTriggerMessage", "uuid": command(client.view, label)})


def test_one_control_runs_and_pauses_and_says_which(view):
    hotkeys = {handle._impl.props.hotkey for handle in view.server.gui._command_handle_from_uuid.values()}
    assert hotkeys == {"space", "arrowright", "R"}
    with Client(view) as client:
        assert works(view, client) and view._run.label == "Pause"
        client.set("Pause", True)
        until(lambda: not view.session.running and view._run.label == "Run")
        steps = view.session.steps
        time.sleep(2 * 0.15)
        trigger(client, "One step")
        until(lambda: view.session.steps == steps + 1)
        trigger(client, "Run or pause")
        until(lambda: view.session.running and view._run.label == "Pause")
        trigger(client, "Reset")
        until(lambda: view.session.steps == 0)
        # Space on the button that has the focus: one press.
        view._pressed = (0.0, "")
        running = view.session.running
        view._once("key", view._toggle)
        view._once("button", view._toggle)
        assert view.session.running != running
        for wrong in ({"uuid": 3}, {"uuid": "none"}, {"uuid": None}):
            client.send({"type": "CommandTriggerMessage", **wrong})
        assert works(view, client)


def test_values_that_are_refused_are_said(view):
    with Client(view) as client:
        assert works(view, client)
        for label, value, said in (("iterations", 1e30, "iterations: 1e+30; must be a number in [1, 1e+06]"),
                                   ("method", "none", "method: 'none'; must be one of"),
                                   ("speed", -1, "speed: -1; must be a number in [0.05, 2]")):
            client.set(label, value)
            until(lambda: said in view._said.content)
        before = view.session.world.settings.iterations
        client.set("iterations", before + 1)
        until(lambda: view.session.world.settings.iterations == before + 1 and not view._wrong)


def test_the_last_minute_can_be_looked_at_again(view):
    session = view.session
    session.running = False
    _, moving = view._moving[0]
    session.world.bodies[1].linear_velocity = (0, 0, 3)
    for _ in range(100):
        session.step()
    view.frame()
    now = moving.batched_positions.copy()
    with Client(view) as client:
        client.set("time line, s", -0.4)
        until(lambda: view._time.line.value == -0.4)
        view.frame()
        then = next(state for when, state in zip(session.tape.times, session.tape.states) if when > 0.09)
        shown = [handle.batched_positions for _, handle in view._moving]
        assert np.abs(shown[0] - now).max() > 1e-3
        places = np.concatenate([group.poses(*view.description.poses(then.astype(float)))[0]
                                 for group, _ in view._moving])
        assert np.allclose(np.concatenate(shown), places, atol=2e-3)
        view._toggle()
        assert session.running and view._time.line.value == 0
    # A minute is kept, thirty times a second.
    tape, state = session.tape, session.state()
    for k in range(3000):
        tape.add(10 + k / 30, state)
    assert tape.times[-1] - tape.times[0] == pytest.approx(60, abs=0.04) and 1799 <= len(tape.times) <= 1801


def test_a_reset_clears_the_curves(view):
    view.session.running = False
    for _ in range(20):
        view.session.step()
    view._plotted = 0
    view.frame()
    assert len(view._plots["kinetic"].data[0]) > 1
    view._reset()
    assert all(len(plot.data[0]) == 1 for plot in view._plots.values()) and not view.session.history["time"]


def test_a_recording_is_offered_as_a_file(view):
    sent = []

    class Client:
        def send_file_download(self, name, data):
            sent.append((name, data))

    view.session.running = False
    view._time._switch(Client())
    for _ in range(60):
        view.session.step()
        view.frame()
    assert view._time.recording and "recording" in view._said.content
    view._time._switch(Client())
    (name, data), = sent
    assert name == "recording.html" and b"<!DOCTYPE html>" in data and not view._time.recording
    view._time._switch(Client())
    view._time._switch(Client())
    assert len(sent) == 1 and "nothing was recorded" in view._said.content


def test_what_is_picked_is_described(view):
    lever = view.session.world["lever"]
    group = next(group for group in view.description.groups if lever.index in group.body)
    name = next(handle.name for of, handle in view._moving if of is group)
    instance = group.body.tolist().index(lever.index)
    with Client(view) as client:
        click = {"type": "SceneNodeClickMessage", "name": name, "instance_index": instance, "ray_origin": [0, 0, 1],
                 "ray_direction": [0, 0, -1], "screen_pos": [0.5, 0.5], "modifier": None, "owner": ""}
        client.send({**click, "instance_index": 10**6}, {**click, "ray_origin": [math.nan] * 3}, click)
        until(lambda: "lever" in view._look.said.content)
    for said in ("**lever**, dynamic", "2 kg", "1 × box", "friction 0.5", "revolute joint"):
        assert said in view._look.said.content


def test_joint_frames_are_at_the_joints(view):
    view._look.joints.value = True
    view._look.grid.value = False
    view.frame()
    frames = view._look._frames
    assert frames.visible and np.allclose(frames.batched_positions, [[1, 0, 0.5]]) and not view._look._grid.visible


def test_actuators_have_sliders_and_layers_a_switch(tmp_path):
    pytest.importorskip("mujoco")
    from test_looks import MJCF

    (tmp_path / "robot.xml").write_text(MJCF)
    view = View(Session(lambda: subadmm.load(tmp_path / "robot.xml", backend="cpu")), port=0)
    try:
        with Client(view) as client:
            _, motor = client.control("m")
            assert (motor.min, motor.max) == (-2, 3)
            client.set("m", 1.5)
            until(lambda: view.session.loaded.actuators["m"].control == 1.5)
            client.set("p, °", 90.0)
            until(lambda: view.session.loaded.actuators["p"].control == pytest.approx(np.pi / 2))
            view._reset()
            assert view.session.loaded.actuators["m"].control == 0 and motor.value == 0
            assert view.session.loaded is view.session.source and not view.session.steering.chains
            shown = {name: [handle.visible for handle in handles] for name, handles in view._layers.items()}
            assert shown == {"visuals": [True, True], "collision shapes": [False]}
            client.set("shown", "collision shapes")
            until(lambda: view._layers["collision shapes"][0].visible and not view._layers["visuals"][0].visible)
            view.frame()
    finally:
        view.stop()


def test_environments_are_shown_side_by_side():
    from test_looks import two_balls

    view = View(Session(two_balls), port=0)
    try:
        view.session.step(2)
        view.frame()
        view._plotted = 0
        view.frame()
        assert sum(len(handle.batched_positions) for _, handle in view._moving) == 4
        assert "4 environments" in view._said.content
        view._settle(iterations=12)
        assert view.session.environments.settings.iterations == 12 and not view._wrong
        view._settle(backend="cpu")
        assert "environments stay" in view._said.content
    finally:
        view.stop()


# ---- sessions ------------------------------------------------------------------------------------------------------


def test_sessions_refuse_what_is_no_number():
    session = Session(led_box)
    for wrong in (math.nan, math.inf, -1, 1e9):
        for call, name in ((lambda: setattr(session, "speed", wrong), "speed"),
                           (lambda: session.advance(wrong, 1), "seconds"),
                           (lambda: session.advance(0, wrong), "budget")):
            if name == "speed" or wrong != 1e9:
                with pytest.raises(ValueError, match=f"{name}: {wrong}; must be a number"):
                    call()
    for wrong in ((math.nan, 0, 0), (0, math.inf, 0)):
        for call in (lambda: session.grab(1, wrong), lambda: session.pull(wrong),
                     lambda: session.steering.leads[0].go(wrong, (1, 0, 0, 0))):
            with pytest.raises(ValueError, match="must be 3 finite numbers"):
                call()
    for index in (-1, 3, 2**31 - 1):
        with pytest.raises(ValueError, match=f"index: {index}; must be a whole number in \\[0, 2\\]"):
            session.grab(index, (0, 0, 0))
    with pytest.raises(ValueError, match="orientation"):
        session.steering.leads[0].go((0, 0, 0), (0, 0, 0, 0))
    before = session.world.settings.iterations
    for changes in (dict(iterations=7, backend="no such"), dict(iterations=7, method="no such"),
                    dict(iterations=7, dt=-1.0)):
        with pytest.raises((subadmm.Error, ValueError)):
            session.change(**changes)
        assert session.world.settings.iterations == before
    assert session.hand() is None and len(session.world.couplings) == 1
    assert all(math.isfinite(x) for x in itertools.chain(*session.world.positions))
