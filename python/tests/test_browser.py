"""The pages in a headless browser: left out where there is none. WebGL is drawn in software."""
import threading
import time

import numpy as np
import pytest

import browser
import subadmm
from subadmm import show

pytestmark = pytest.mark.skipif(not browser.PATH, reason="there is no Chromium")
pytest.importorskip("websockets")


def colourful(pixels):
    """The share of pixels in strong colours: bodies are, pages are not."""
    return (np.ptp(pixels.astype(int), axis=2) > 40).mean()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    world = subadmm.scene("ragdolls:2", backend="cpu", settings={"certify": True})
    path = tmp_path_factory.mktemp("page") / "dolls.html"
    show.record(world, 1.5, title="dolls", contacts=20).save(path)
    return path


def test_recordings_play(recorded):
    with browser.Page(f"file://{recorded}", 320, 240) as page:
        page.wait_for("document.body.dataset.drawn > 1")
        assert page.evaluate("document.getElementById('say').textContent") == "23 bodies"
        page.wait_for("document.body.dataset.frame == 45 && document.getElementById('play').textContent == 'Play'")
        seen = page.evaluate("""new Promise((done) => {
            const seen = [];
            const look = () => {
              seen.push(Number(document.body.dataset.frame));
              if (seen.length > 5 && seen[seen.length - 1] == 45) done(seen); else requestAnimationFrame(look);
            };
            document.getElementById('play').click();
            setTimeout(look, 100); })""")
        assert seen == sorted(seen) and len(set(seen)) >= 5 and seen[0] < 45 and page.errors == []
        assert not page.evaluate("document.getElementById('legend').hidden")


def test_recordings_show_bodies_and_forces(recorded):
    with browser.Page(f"file://{recorded}#t=0.3", 320, 240) as page:
        page.wait_for("document.body.dataset.drawn")
        page.evaluate("document.getElementById('forces').click()")
        page.wait_for("document.body.dataset.drawn > 1")
        # Two dolls of strong colours in the middle of a pale page.
        bodies = page.pixels()[40:180]
        assert colourful(bodies) > 0.01
        # On the ground, with forces: bodies grow pale, arrows do not.
        page.evaluate("location.hash = '#t=1.5'; location.reload()")
        page.wait_for("document.body.dataset.frame == 45")
        with_forces = page.pixels()[40:150]
        page.evaluate("document.getElementById('forces').click()")
        page.wait_for("document.body.dataset.drawn > 1")
        assert (np.abs(with_forces.astype(int) - page.pixels()[40:150]) > 20).any(axis=2).mean() > 0.01
        assert page.errors == []


@pytest.fixture
def shown():
    """A box on the ground, in a running view."""
    pytest.importorskip("viser")
    from subadmm.show.session import Session
    from subadmm.show.view import View

    def build():
        world = subadmm.World(backend="cpu")
        world.add_ground()
        box = world.add_solid(subadmm.box(0.1, 0.1, 0.1), mass=2, position=(0, 0, 0.1))
        lid = world.add_solid(subadmm.box(0.1, 0.1, 0.01), mass=0.2, position=(0, 0, 0.21))
        servo = subadmm.Coordinate(drive="position", drive_stiffness=20, drive_damping=1)
        world.add_joint("revolute", box, lid, position=(0.1, 0, 0.2), orientation=(0.5 ** 0.5, 0.5 ** 0.5, 0, 0),
                        coordinates={5: servo})
        world.add_coupling(lid, target_position=(0, 0, 0.21), linear_stiffness=10, linear_damping=1)
        return world

    view = View(Session(build), "a box", port=18438)
    ended = threading.Event()

    def run():
        while not ended.is_set():
            view.frame()
            time.sleep(1 / 20)

    thread = threading.Thread(target=run)
    thread.start()
    yield view
    ended.set()
    thread.join()
    view.stop()


def until(true, seconds=30):
    end = time.monotonic() + seconds
    while not true() and time.monotonic() < end:
        time.sleep(0.05)
    return true()


def test_the_view_loads_and_a_dragged_body_moves(shown):
    session = shown.session
    with browser.Page(shown.url, 900, 400) as page:
        page.wait_for("document.querySelector('canvas') && document.body.innerText.includes('contacts')", 60)
        x, y = page.evaluate("(() => { const c = document.querySelector('canvas').getBoundingClientRect();"
                             " return [c.x + c.width / 2, c.y + c.height / 2]; })()")  # the camera looks at the box
        assert page.errors == []
        before = session.world.positions[1]
        for attempt in range(5):                  # until the box is there to be taken
            page.mouse("mouseMoved", x, y)
            page.mouse("mousePressed", x, y, held=True)
            for k in range(1, 11):
                page.mouse("mouseMoved", x, y - 10 * k, held=True)
                time.sleep(0.05)
            if until(lambda: session.hand() is not None, 3):
                break
            page.mouse("mouseReleased", x, y - 100)
        assert session.hand() is not None, "nothing was taken"
        assert until(lambda: session.world.positions[1, 2] > before[2] + 0.05), "the hand does not pull"
        page.mouse("mouseReleased", x, y - 100)
        assert until(lambda: session.hand() is None)


def test_steering_switches_in_the_page(shown):
    with browser.Page(shown.url, 900, 700) as page:
        page.wait_for("document.body.innerText.includes('feels')", 60)
        where = "[...document.querySelectorAll('label')].find((l) => l.textContent == 'steer')"
        page.wait_for(f"!!{where}")
        page.evaluate(f"document.getElementById({where}.htmlFor).click()")
        assert until(lambda: shown.session.steering.on)
        assert until(lambda: shown._steering._gizmos[0].visible) and page.errors == []


def test_keys_run_step_and_reset(shown):
    session = shown.session

    def press(page, key, code, number):
        for kind in ("keyDown", "keyUp"):
            page.call("Input.dispatchKeyEvent", type=kind, key=key, code=code, windowsVirtualKeyCode=number,
                      **({"text": key} if kind == "keyDown" and len(key) == 1 else {}))

    with browser.Page(shown.url, 500, 300) as page:
        page.wait_for("document.body.innerText.includes('contacts')", 60)
        press(page, " ", "Space", 32)
        assert until(lambda: not session.running)
        steps = session.steps
        time.sleep(0.3)
        press(page, "ArrowRight", "ArrowRight", 39)
        assert until(lambda: session.steps == steps + 1)
        press(page, "r", "KeyR", 82)
        assert until(lambda: session.steps == 0)
        # A click as soon after a key is taken for the same one.
        time.sleep(0.5)
        # The button has the focus after a click, and space would press it, too.
        where = "[...document.querySelectorAll('button')].find((b) => b.textContent.trim() == 'Run')"
        page.wait_for(f"!!{where}")
        page.evaluate(f"{where}.focus(); {where}.click()")
        assert until(lambda: session.running)
        time.sleep(0.5)
        press(page, " ", "Space", 32)
        assert until(lambda: not session.running)
        time.sleep(0.5)
        assert not session.running and page.errors == []
