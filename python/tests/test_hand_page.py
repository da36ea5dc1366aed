"""The page of hands: who may talk to it, what it lets be said, and what it does in a browser with a headset that is
none."""
import json
import math
import shutil
import socket
import ssl
import struct
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import browser
import subadmm
from subadmm import hands

pytest.importorskip("websockets", minversion="13")

from subadmm.hands import messages  # noqa: E402
from subadmm.hands.page import HandPage, Place  # noqa: E402

STAND = (-0.45, 0, -0.9)


def cube_world():
    world = subadmm.World(backend="cpu", settings=subadmm.Settings(dt=0.005, threads=1))
    world.add_ground()
    world.add_solid(subadmm.box(0.03, 0.03, 0.03, friction=1), mass=0.2, position=(0, 0, 0.03), name="red cube")
    return world


@pytest.fixture
def page():
    made = HandPage(cube_world, "a cube", port=0, stand=STAND)
    yield made
    made.stop()


def until(true, seconds=30):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, f"it did not come to that within {seconds} s"
        time.sleep(0.005)


def to_user(joints, place):
    """Joints of the world (n x 3) in the space of WebXR: the other way of Place."""
    turned = (np.asarray(joints) - place.stand) / place.scale
    return np.stack([-turned[:, 1], turned[:, 2], -turned[:, 0]], axis=1)


def near(hand, joints):
    """Is it where the joints have it?"""
    return np.allclose(hand.bodies[0].position, hands.parts_of(joints, hand.side)[0][0], atol=1e-3)


def with_25(joints):
    """The 25 joints of WebXR by 21: where fingers' bones begin in the palm is of no consequence."""
    names = [name for name in hands.XR_JOINTS if not name.endswith("finger-metacarpal")]
    by_name = dict(zip(names, joints))
    return np.array([by_name.get(name, joints[0]) for name in hands.XR_JOINTS])


def hands_message(place, **sides):
    """sides: 21 joints, world."""
    return {"type": "hands", "left": None, "right": None,
            **{side: {"joints": with_25(to_user(joints, place)).ravel().tolist()} for side, joints in sides.items()}}


class Line:
    """A page, as far as the server sees it."""

    def __init__(self, page, **options):
        from websockets.sync.client import connect

        scheme = page.url.partition(":")[0].replace("http", "ws")
        self.line = connect(f"{scheme}://127.0.0.1:{page.port}/hands", max_size=None, close_timeout=1,
                            **options)

    def send(self, *said):
        for one in said:
            self.line.send(one if isinstance(one, (str, bytes)) else json.dumps(one))

    def get(self, kind):
        """The next message of a type, or of the number of a binary one."""
        while True:
            data = self.line.recv(timeout=30)
            if isinstance(data, str):
                message = json.loads(data)
                if message["type"] == kind:
                    return message
            elif struct.unpack("<I", data[:4])[0] == kind:
                return np.frombuffer(data, np.uint8, offset=4)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.line.close()


# ---- addresses, and who may talk to it -----------------------------------------------------------------------------


def test_addresses_that_cannot_be_served_are_errors():
    def build():
        raise AssertionError("a world was built in vain")

    with pytest.raises(OSError, match="host: '203.0.113.9', port: 18451; cannot be served at"):
        HandPage(build, host="203.0.113.9", port=18451)
    with pytest.raises(OSError, match="must be an address"):
        HandPage(build, host="no.such.host.invalid")
    with pytest.raises(ValueError, match="port: 65536"):
        HandPage(build, port=65536)
    with socket.create_server(("127.0.0.1", 0)) as taken:        # it is left to who has it
        port = taken.getsockname()[1]
        made = HandPage(cube_world, port=port, stand=STAND)
        made.stop()
        assert made.port > port


def test_a_port_that_is_taken_at_the_last_moment_is_an_error(monkeypatch):
    from subadmm.show import guard

    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        monkeypatch.setattr(guard, "free_port", lambda host, port: port)
        with pytest.raises(OSError, match=f"port: {port}; cannot be served at"):
            HandPage(cube_world, port=port, stand=STAND)


def status(port, host, path="/hands", origin=None, upgrade=True):
    lines = [f"GET {path} HTTP/1.1", f"Host: {host}"]
    if upgrade:
        lines += ["Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==",
                  "Sec-WebSocket-Version: 13"]
    if origin is not None:
        lines.append(f"Origin: {origin}")
    with socket.create_connection(("127.0.0.1", port), timeout=20) as line:
        line.sendall("\r\n".join([*lines, "", ""]).encode())
        return int(line.recv(1000).split()[1])


def test_other_pages_are_refused(page):
    here = f"127.0.0.1:{page.port}"
    assert status(page.port, here) == 101 and status(page.port, here, origin=f"http://{here}") == 101
    assert status(page.port, here, "/", upgrade=False) == 200
    assert status(page.port, here, "/etc/passwd", upgrade=False) == 404
    for origin in ("http://evil.example", "null", f"http://localhost:{page.port}", "http://127.0.0.1:1"):
        assert status(page.port, here, origin=origin) == 403
    assert status(page.port, f"evil.example:{page.port}", origin=f"http://evil.example:{page.port}") == 403
    assert status(page.port, f"evil.example:{page.port}", "/", upgrade=False) == 403


@pytest.fixture(scope="module")
def certificate(tmp_path_factory):
    if not shutil.which("openssl"):
        pytest.skip("there is no openssl")
    folder = tmp_path_factory.mktemp("tls")
    paths = folder / "cert.pem", folder / "key.pem"
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost",
                    "-addext", "subjectAltName=IP:127.0.0.1", "-out", paths[0], "-keyout", paths[1]], check=True,
                   capture_output=True)
    return paths


def test_with_a_certificate_it_is_https(certificate):
    cert, key = certificate
    page = HandPage(cube_world, port=0, stand=STAND, certificate=cert, key=key)
    try:
        assert page.url == f"https://127.0.0.1:{page.port}"
        context = ssl.create_default_context(cafile=str(cert))
        with Line(page, ssl=context, origin=page.url) as line:
            assert line.get("scene")["count"] == 14
    finally:
        page.stop()


@pytest.mark.parametrize("given, error, said", [
    ({"certificate": "cert"}, ValueError, "key: None; must be given with the certificate"),
    ({"key": "key"}, ValueError, "certificate: None; must be given with the key"),
    ({"certificate": "none.pem", "key": "key"}, FileNotFoundError, "none.pem"),
    ({"certificate": "key", "key": "cert"}, ValueError, "must be files of PEM that belong together"),
])
def test_certificates_that_are_none_are_refused(given, error, said, certificate):
    paths = dict(zip(("cert", "key"), certificate))
    with pytest.raises(error, match=said):
        HandPage(cube_world, port=0, **{name: paths.get(value, value) for name, value in given.items()})


# ---- what may be said ----------------------------------------------------------------------------------------------

HAND = {"joints": list(range(75))}
CONTROLLER = {"position": [0, 1, -0.5], "orientation": [1, 0, 0, 0], "closed": 0.5}


def said(**sides):
    return json.dumps({"type": "hands", "left": None, "right": None, **sides})


@pytest.mark.parametrize("text", [
    said(), said(left=HAND), said(left=HAND, right=HAND), said(right=CONTROLLER), said(left=CONTROLLER, right=HAND),
    '{"type": "reset"}', '{"type": "run", "on": false}'])
def test_what_the_page_says_is_let_in(text):
    assert messages.read(text) == json.loads(text)


@pytest.mark.parametrize("text", [
    "", "{", "[]", "1", "null", '"reset"', "{}", '{"type": 1}', '{"type": []}', '{"type": "none"}',
    b'{"type": "reset"}',
    '{"type": "reset", "more": 1}', '{"type": "run"}', '{"type": "run", "on": 1}', '{"type": "hands", "left": null}',
    said(up=None), said(left={}), said(left=[]), said(left={"joints": []}), said(left={"joints": list(range(74))}),
    said(left={"joints": [None] * 75}), said(left={"joints": [True] * 75}), said(left={"joints": ["1"] * 75}),
    said(left={"joints": [math.nan] * 75}), said(left={"joints": [math.inf] * 75}),
    said(left={"joints": [1e400 if k else 101 for k in range(75)]}), said(left={"joints": [100.1] * 75}),
    said(left={**HAND, "more": 1}), said(right={**CONTROLLER, "closed": 1.01}),
    said(right={**CONTROLLER, "closed": -0.1}), said(right={**CONTROLLER, "orientation": [0, 0, 0, 0]}),
    said(right={**CONTROLLER, "position": [0, 1]}), said(right={**CONTROLLER, "position": [1e9, 0, 0]}),
    said(right=CONTROLLER) + " " * messages.MOST_BYTES, "[" * 10000, "9" * 10000,
    '{"type": "hands", "left": null, "right": {"joints": [' + "1e999," * 74 + "1]}}"])
def test_all_else_is_dropped(text):
    assert messages.read(text) is None


def test_whatever_is_said_the_page_goes_on(page):
    random = np.random.default_rng(3)
    values = [None, True, 0, 1, -1, 1e9, "x", [], {}, [1e8] * 75, [0] * 75, [0.1] * 3, [0] * 4, HAND,
              CONTROLLER, "reset"]
    with Line(page) as line:
        line.get("scene")
        for _ in range(400):
            message = json.loads(said(left=dict(HAND), right=dict(CONTROLLER)))
            for part in (message, message["left"], message["right"]):
                for name in random.permutation(list(part))[:random.integers(0, 2)]:
                    part[str(name)] = values[random.integers(len(values))]
            line.send(message)
        line.send(said(left={"joints": [0.5] * 75}))               # no direction
        for _ in range(5):
            page.frame()
        assert np.isfinite(page.session.world.positions).all()
    with Line(page) as line:
        line.get("scene")
        line.send(b"\0" * 100, "x" * 1000)
        until(lambda: page.frame() or True)
        line.send({"type": "run", "on": False})
        until(lambda: page.frame() or not page.session.running)
    with Line(page) as line:                       # too long: this line is closed, others are not
        line.get("scene")
        line.send("x" * (messages.MOST_BYTES + 1))
        with Line(page) as other:
            other.send({"type": "run", "on": True})
            until(lambda: page.frame() or page.session.running)


# ---- where the user is ---------------------------------------------------------------------------------------------


def test_the_users_space_is_in_the_world_where_it_was_put():
    place = Place((1, 2, 3))
    # Right, up and back of the user, who looks to x.
    assert np.allclose(place(np.eye(3)) - [1, 2, 3], [[0, -1, 0], [0, 0, 1], [-1, 0, 0]])
    place = Place((1, 2, 3), yaw=math.pi / 2, scale=2)               # looks to y
    assert np.allclose(place(np.eye(3)) - [1, 2, 3], [[2, 0, 0], [0, 0, 2], [0, -2, 0]])
    points = np.random.default_rng(1).normal(size=(5, 3))
    assert np.allclose((place.matrix() @ np.c_[points, np.ones(5)].T)[:3].T, place(points))
    for wrong in ({"stand": (0, 0, math.nan)}, {"stand": (0, 0, 0), "scale": 0}, {"stand": (0, 0, 0), "yaw": math.inf}):
        with pytest.raises(ValueError):
            Place(**wrong)


def test_what_moves_is_before_the_users_chest():
    page = HandPage(lambda: subadmm.scene("hand_demo", backend="cpu"), port=0)
    try:
        centre = to_user([page.session.describe().centre], page.place)[0]
        assert abs(centre[0]) < 0.3 and 0.8 < centre[1] < 1.5 and -1.5 < centre[2] < -0.3
        page.session.step(5)
        assert not any(felt.hand.forces.any() for felt in page._felt.values())    # they wait in the air
    finally:
        page.stop()


def test_a_hand_holds_a_controller_as_grip_space_has_it():
    """Held ahead, thumb up: z points down, the arm is behind (y); the back of the right hand is outwards (x), so is
    that of the left one (-x)."""
    grip = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]).T          # columns: x, y, z in the user's space
    from subadmm.hands.joints import _quaternions
    orientation = _quaternions(grip[None])[0].tolist()
    assert np.allclose(grip @ [0, 1, 0], [0, 0, 1]) or np.allclose(grip @ [0, 1, 0], [0, 0, -1])
    for side, out in (("right", 1), ("left", -1)):
        joints = messages.held(side, [0, 0, 0], orientation, 0.5)
        along = joints[9] - joints[0]                                 # to the knuckles: away from the arm
        assert along @ (grip @ [0, -1, 0]) > 0.08
        thumbwards = joints[5] - joints[17]
        assert thumbwards @ (grip @ [0, 0, -1]) > 0.05
        inwards = joints[8:21:4].mean(axis=0) - joints[9]             # tips are on the side of the palm
        assert inwards @ (grip @ [out, 0, 0]) < -0.02
        wide, closed = (messages.held(side, [0, 0, 0], orientation, x) for x in (0, 1))
        assert np.linalg.norm(wide[12] - wide[4]) == pytest.approx(0.1, abs=0.01)
        assert (closed[12] - closed[4]) @ (wide[12] - wide[4]) < 0.002    # closed: they have passed each other


# ---- hands in the world --------------------------------------------------------------------------------------------


def test_tracked_hands_are_in_the_world_and_what_they_feel_is_told(page):
    joints = hands.grasping("right", (0, 0, 0.2), opening=0.09)
    session, hand = page.session, page.hands["right"]
    with Line(page) as line:
        scene = line.get("scene")
        assert scene["count"] == 14 and len(line.get(0)) > 1000
        assert np.allclose(np.reshape(scene["toWorld"], (4, 4)).T, page.place.matrix())
        line.send(hands_message(page.place, right=joints))
        until(lambda: page.frame() or near(hand, joints))
        poses = line.get(1).view("<f4").reshape(-1, 8)                # whatever was there first
        assert poses.shape == (14, 8)
        # Down to the cube, and closed: led by jumps of a tracking at 90 Hz, as the clock goes.
        keys = [(0.0, 0.2, 0.09), (0.5, 0.03, 0.09), (1.0, 0.03, 0.066), (1.6, 0.15, 0.066), (2.2, 0.15, 0.066)]
        begun = session.steps * session.dt
        times, heights, wide = np.array(keys).T
        touched = set()

        def go():
            now = session.steps * session.dt - begun
            said = hands.grasping("right", (0, 0, np.interp(now, times, heights)),
                                  opening=np.interp(now, times, wide))
            line.send(hands_message(page.place, right=said))
            page.frame()
            return now > times[-1]

        until(go, 60)
        until(lambda: page.frame() or page._said is None)
        cube = session.world["red cube"]
        assert cube.position[2] > 0.12 and session.world.contacts().size
        felt = hand.forces
        # What still moves: 5 % of the weight, 1.96 N.
        assert -felt[:, 2].sum() == pytest.approx(0.2 * 9.81, rel=0.05)
        end = session.steps * session.dt
        while (message := line.get("forces"))["time"] < end:
            touched |= {tuple(touch[:3]) for touch in message["touches"]}
        assert {("right", part, True) for part in hands.FINGERS} <= touched
        assert message["right"][1] == pytest.approx(np.linalg.norm(felt[1]), rel=0.1)
        assert message["left"] == [0] * 6


def test_one_page_has_the_hands_and_others_look_on(page):
    first, second = (hands.grasping("left", (0, y, 0.5)) for y in (0.3, -0.3))
    hand = page.hands["left"]

    with Line(page) as looker:
        with Line(page) as line:
            line.send(hands_message(page.place, left=first))
            until(lambda: page.frame() or near(hand, first))
            looker.send(hands_message(page.place, left=second))
            for _ in range(20):
                page.frame()
                time.sleep(0.01)
            assert near(hand, first)
        until(lambda: page._speaker is None)
        looker.send(hands_message(page.place, left=second))
        until(lambda: page.frame() or near(hand, second))


def test_reset_begins_anew_and_every_page_is_told(page):
    with Line(page) as line, Line(page) as other:
        for one in (line, other):
            one.get("scene")
        until(lambda: page.frame() or page.session.steps > 5)
        world = page.session.world
        line.send({"type": "reset"})
        until(lambda: page.frame() or page.session.world is not world)
        for one in (line, other):
            assert one.get("scene")["count"] == 14
        assert page.hands["left"].world is page.session.world


def test_a_step_that_fails_pauses_and_is_said(page):
    def fail(*_):
        raise subadmm.NonFinite("a step made no number")

    page.session.step = fail
    with Line(page) as line:
        line.get("scene")
        until(lambda: page.frame() or not page.session.running)
        page.frame()
        while not (message := line.get("forces"))["wrong"]:
            pass
        assert message["wrong"] == "a step made no number" and not message["running"]


def test_the_command(monkeypatch, capsys):
    from subadmm.__main__ import main
    from subadmm.hands import page as of_page

    def end(self):
        raise KeyboardInterrupt

    monkeypatch.setattr(of_page.HandPage, "frame", end)
    assert main(["hands", "pyramid:2", "--port", "0", "--stand", "0", "0", "-1", "--yaw", "90"]) == 130
    assert "pyramid:2: http://127.0.0.1:" in capsys.readouterr().out
    for wrong, status_ in ((["--port", "-1"], 2), (["--scale", "0"], 2), (["--certificate", "a.pem"], 2),
                           (["--yaw", "nan"], 2), (["--host", "no.such.host.invalid"], 1),
                           (["--certificate", "none.pem", "--key", "none.pem"], 1)):
        assert main(["hands", "pyramid:2", *wrong]) == status_
        assert capsys.readouterr().err.count("\n") == 1


def test_the_command_ends_cleanly_after_it_was_asked():
    """Also where lines of pages are still being closed: nothing keeps the world."""
    process = subprocess.Popen([sys.executable, "-m", "subadmm", "hands", "pyramid:2", "--port", "0"], text=True,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    port = int(process.stdout.readline().rpartition(":")[2])
    assert status(port, f"127.0.0.1:{port}", "/", upgrade=False) == 200
    assert status(port, "evil.example", "/", upgrade=False) == 403
    process.terminate()
    _, complaints = process.communicate(timeout=60)
    assert process.returncode == 143 and complaints == ""


# ---- in a browser --------------------------------------------------------------------------------------------------

#: A headset that is none: what the page needs of WebXR. `fake` leads it: joints by side (75 numbers) or a controller.
FAKE = """
window.fake = { left: null, right: null, pulses: [], frames: 0 };
(() => {
  const place = (m) => ({ matrix: new Float32Array(m), position: { x: m[12], y: m[13], z: m[14], w: 1 },
    orientation: { x: 0, y: 0, z: 0, w: 1 } });
  const at = (x, y, z) => place([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1]);
  const gamepad = { buttons: [{ value: 0 }, { value: 0 }],
    hapticActuators: [{ pulse: async (value, ms) => { fake.pulses.push([value, ms]); return true; } }] };
  class Session extends EventTarget {
    constructor() { super(); this.renderState = {}; this.ended = false; }
    get inputSources() {
      return ["left", "right"].filter((side) => fake[side]).map((side) => {
        const what = fake[side];
        gamepad.buttons[0].value = what.closed || 0;
        return { handedness: side, gamepad, gripSpace: what.grip ? { grip: what.grip } : null,
          hand: what.joints ? { get: (name) => ({ joint: fake.names.indexOf(name), of: what.joints }) } : null };
      });
    }
    updateRenderState(state) { Object.assign(this.renderState, state); }
    async requestReferenceSpace(kind) {
      if (kind === "local-floor" && fake.floorless) throw new DOMException("no floor", "NotSupportedError");
      return { kind };
    }
    requestAnimationFrame(call) {
      requestAnimationFrame((now) => { if (!this.ended) { ++fake.frames; call(now, frame); } });
    }
    async end() { this.ended = true; this.dispatchEvent(new Event("end")); }
  }
  const frame = {
    getJointPose: ({ joint, of }) => joint < 0 ? null : { transform: at(...of.slice(3 * joint, 3 * joint + 3)) },
    getPose: ({ grip }) => ({ transform: at(...grip) }),
    getViewerPose: () => ({ views: [-0.03, 0.03].map((x) => ({ transform: at(x, fake.floorless ? -0.1 : 1.3, 0),
      projectionMatrix: new Float32Array([1.2, 0, 0, 0, 0, 1.2, 0, 0, 0, 0, -1, -1, 0, 0, -0.06, 0]) })) }),
  };
  window.XRWebGLLayer = class {
    constructor(session, gl) { this.gl = gl; this.framebuffer = null; this.views = new Map(); }
    getViewport(view) {
      const width = this.gl.drawingBufferWidth / 2, k = view.transform.position.x > 0 ? 1 : 0;
      return { x: k * width, y: 0, width, height: this.gl.drawingBufferHeight };
    }
  };
  WebGL2RenderingContext.prototype.makeXRCompatible = async () => {};
  Object.defineProperty(navigator, "xr", { value: {
    isSessionSupported: async (mode) => mode === "immersive-vr",
    requestSession: async (mode, options) => { fake.asked = options; return fake.session = new Session(); },
  } });
})();
"""


@pytest.fixture
def running(page):
    ended = threading.Event()

    def run():
        while not ended.is_set():
            page.frame()
            time.sleep(1 / 40)

    thread = threading.Thread(target=run)
    thread.start()
    yield page
    ended.set()
    thread.join()


def colourful(pixels):
    return (np.ptp(pixels.astype(int), axis=2) > 40).mean()


needs_browser = pytest.mark.skipif(not browser.PATH, reason="there is no Chromium")


@needs_browser
def test_without_a_headset_the_page_looks_on(running):
    with browser.Page(running.url, 640, 400) as seen:
        seen.wait_for("document.body.dataset.drawn > 3")
        assert seen.evaluate("document.getElementById('say').textContent") == "14 bodies"
        assert seen.evaluate("document.getElementById('enter').disabled") and colourful(seen.pixels()) > 0.003
        seen.evaluate("document.getElementById('run').click()")
        until(lambda: not running.session.running)
        seen.wait_for("document.getElementById('run').textContent == 'Run'")
        seen.evaluate("document.getElementById('run').click()")
        until(lambda: running.session.running)
        seen.evaluate("document.getElementById('reset').click()")
        seen.wait_for("document.body.dataset.built == 2")
        assert seen.errors == []


@needs_browser
@pytest.mark.parametrize("floorless", [False, True])
def test_hands_of_a_headset_lift_the_cube_and_are_drawn_for_both_eyes(running, floorless):
    place, session = running.place, running.session
    lower = 1.4 if floorless else 0.0             # joints from where the eyes were, m

    def joints(height, opening):
        said = with_25(to_user(hands.grasping("right", (0, 0, height), opening=opening), place)) - [0, lower, 0]
        return json.dumps(said.ravel().tolist())

    with browser.Page(running.url, 640, 400, before=FAKE) as seen:
        seen.wait_for("document.body.dataset.drawn > 1 && !document.getElementById('enter').disabled")
        seen.evaluate(f"fake.names = {json.dumps(hands.XR_JOINTS)}; fake.floorless = {json.dumps(floorless)};"
                      f"fake.right = {{ joints: {joints(0.2, 0.09)} }}; document.getElementById('enter').click()")
        seen.wait_for("document.body.dataset.xr > 3")
        assert seen.evaluate("fake.asked.optionalFeatures.includes('hand-tracking')")
        hand = running.hands["right"]
        until(lambda: near(hand, hands.grasping("right", (0, 0, 0.2))))
        apart = running.hands["left"].bodies[0].position - hand.bodies[0].position
        assert np.linalg.norm(apart) > 0.3                 # not tracked: it waits
        # Each eye has a picture with the cube and the hand in it.
        seen.evaluate("for (const id of ['felt', 'bar']) document.getElementById(id).style.display = 'none'")

        def both_see():
            pixels = seen.pixels()
            left, right = pixels[:, :320], pixels[:, 320:]
            return colourful(left) > 0.01 and colourful(right) > 0.01 and (left != right).any()

        until(both_see)
        for keys in (((0.2, 0.03), (0.09, 0.09)), ((0.03, 0.03), (0.09, 0.066)), ((0.03, 0.15), (0.066, 0.066))):
            for share in np.linspace(0, 1, 12):
                height, opening = (a + share * (b - a) for a, b in keys)
                seen.evaluate(f"fake.right.joints = {joints(height, opening)}")
                now = session.steps
                until(lambda: session.steps > now + 8)
        cube = session.world["red cube"]
        until(lambda: cube.position[2] > 0.12)
        assert seen.evaluate("fake.pulses.length") > 0
        strength, length = seen.evaluate("fake.pulses[fake.pulses.length - 1]")
        assert 0.1 < strength <= 1 and length == 40       # the thumb presses with some newtons, of 5
        # A hand that is lost stays where it was, and holds the cube.
        seen.evaluate("fake.right = null")
        time.sleep(0.5)
        assert cube.position[2] > 0.12
        seen.evaluate("document.getElementById('enter').click()")
        seen.wait_for("document.getElementById('enter').textContent == 'Enter VR'")
        assert seen.errors == []


@needs_browser
def test_a_controller_leads_a_hand_and_its_trigger_closes_it(running):
    hand = running.hands["left"]

    def apart():
        return np.linalg.norm(hand.bodies[3].position - hand.bodies[1].position)

    with browser.Page(running.url, 640, 400, before=FAKE) as seen:
        seen.wait_for("document.body.dataset.drawn > 1 && !document.getElementById('enter').disabled")
        seen.evaluate("fake.left = { grip: [-0.1, 1.4, -0.5], closed: 0 }; document.getElementById('enter').click()")
        # About where the controller is, in the world: 0.5 m ahead, 0.1 m to the left, 1.4 m up.
        until(lambda: np.linalg.norm(hand.bodies[0].position - (np.array(STAND) + [0.5, 0.1, 1.4])) < 0.1)
        assert abs(apart() - 0.1) < 5e-3
        seen.evaluate("fake.left.closed = 0.75")
        until(lambda: apart() < 0.02)
        assert seen.errors == []
