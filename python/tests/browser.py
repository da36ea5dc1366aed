"""A headless Chromium, led by its DevTools protocol: what tests need of it."""
import base64
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
import urllib.request
import zlib
import struct

import numpy as np

NAMES = ("chromium", "chromium-browser", "chromium-headless-shell", "google-chrome", "chrome")
PATH = next((path for path in map(shutil.which, NAMES) if path), None)
FLAGS = ("--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--disable-dev-shm-usage", "--no-first-run", "--remote-debugging-port=0")


class Page:
    """A page of its own browser. errors: what it wrote to the console as errors, and exceptions. before: a script that
    runs before those of the page; flags: more of the browser's."""

    def __init__(self, url, width=640, height=480, before=None, flags=()):
        from websockets.sync.client import connect

        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self._process = subprocess.Popen(
            [PATH, *FLAGS, *flags, f"--window-size={width},{height}", f"--user-data-dir={self._folder.name}", "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env={**os.environ, "HOME": self._folder.name},
            start_new_session=True)
        self.errors, self._number = [], 0
        try:
            self._socket = connect(self._address(), max_size=None)
            self.call("Runtime.enable")
            self.call("Log.enable")
            self.call("Page.enable")
            if before is not None:
                self.call("Page.addScriptToEvaluateOnNewDocument", source=before)
            self.call("Page.navigate", url=url)
        except BaseException:
            self.close()
            raise

    def _address(self):
        """The first page's, from the port that the browser has written down."""
        port = os.path.join(self._folder.name, "DevToolsActivePort")
        end = time.monotonic() + 30
        while time.monotonic() < end:
            try:
                with open(port) as file:
                    number = int(file.readline())
                with urllib.request.urlopen(f"http://127.0.0.1:{number}/json/list", timeout=5) as answer:
                    pages = [page for page in json.load(answer) if page["type"] == "page"]
                if pages:
                    return pages[0]["webSocketDebuggerUrl"]
            except (OSError, ValueError):
                pass
            time.sleep(0.05)
        raise TimeoutError("the browser did not start within 30 s")

    def _end(self, how):
        try:
            os.killpg(self._process.pid, how)
        except ProcessLookupError:
            pass

    def close(self):
        """The browser with all of its processes: Debian's command is a script that starts it."""
        self._end(signal.SIGTERM)
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            pass
        self._end(signal.SIGKILL)
        self._process.wait()
        self._folder.cleanup()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._socket.close()
        self.close()

    def _note(self, message):
        kind, about = message.get("method"), message.get("params", {})
        if kind == "Runtime.exceptionThrown":
            detail = about["exceptionDetails"]
            self.errors.append(detail.get("exception", {}).get("description", detail.get("text")))
        elif kind == "Runtime.consoleAPICalled" and about["type"] == "error":
            self.errors.append(" ".join(str(arg.get("value", arg.get("description"))) for arg in about["args"]))
        elif kind == "Log.entryAdded" and about["entry"]["level"] == "error":
            self.errors.append(about["entry"]["text"])

    def call(self, method, **parameters):
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv(timeout=60))
            self._note(message)
            if message.get("id") == self._number:
                if "error" in message:
                    raise RuntimeError(f"{method}: {message['error']}")
                return message["result"]

    def evaluate(self, text):
        """The value of an expression in the page."""
        result = self.call("Runtime.evaluate", expression=text, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(result["exceptionDetails"].get("exception", {}).get("description", text))
        return result["result"].get("value")

    def wait_for(self, text, seconds=30):
        """Until an expression is true; its value. What fails is not there yet: the page is loading."""
        end, said = time.monotonic() + seconds, None
        while time.monotonic() < end:
            try:
                value = self.evaluate(text)
                if value:
                    return value
            except RuntimeError as error:
                said = error
            time.sleep(0.05)
        raise TimeoutError(f"not within {seconds} s: {text}; {said}; console: {self.errors}")

    def mouse(self, kind, x, y, held=False):
        """kind: 'mousePressed', 'mouseMoved' (held: with the button down) or 'mouseReleased': of the left button."""
        clicks = int(kind != "mouseMoved")
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left" if held or clicks else "none",
                  buttons=int(held), clickCount=clicks)

    def png(self):
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def pixels(self):
        """What is seen, height x width x 3."""
        return decoded(self.png())


def decoded(data):
    """Pixels of a PNG of 8-bit colours."""
    at, body = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        chunk = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, colours = struct.unpack(">IIBB", chunk[:10])
        body += chunk if kind == b"IDAT" else b""
        at += 12 + size
    assert depth == 8 and colours in (2, 6)
    size = 3 if colours == 2 else 4
    rows = np.frombuffer(zlib.decompress(body), np.uint8).reshape(height, -1)
    above, out = [0] * (size * width), np.zeros((height, size * width), np.uint8)
    for y in range(height):
        kind, line = int(rows[y, 0]), rows[y, 1:].tolist()
        for x in range(size * width):
            left, corner = (line[x - size], above[x - size]) if x >= size else (0, 0)
            up = above[x]
            guess = left + up - corner
            near = min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))[2]
            line[x] = (line[x] + (0, left, up, (left + up) // 2, near)[kind]) & 255
        out[y], above = line, line
    return out.reshape(height, width, size)[:, :, :3]
