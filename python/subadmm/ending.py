"""Being asked to end, as the command is (src/cli/interrupt.h): SIGINT (Ctrl-C) and SIGTERM.

A run that checks Signals.asked ends in order at the first of them, with what it has. A second one ends it at once, as
the first does where nobody checks.
"""
import signal
import threading
from contextlib import contextmanager


class Ended(BaseException):
    """At once: what is not complete is dropped on the way out."""


class Signals:
    """As a context, of the main thread: signals that are not ignored are taken. asked: the first one's number, or 0."""

    def __init__(self):
        self.asked = 0
        self._checked, self._before = False, {}

    def __enter__(self):
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                if signal.getsignal(number) not in (signal.SIG_IGN, None):
                    self._before[number] = signal.signal(number, self._take)
        return self

    def __exit__(self, *_):
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _take(self, number, _):
        first, self.asked = not self.asked, self.asked or number
        if not (first and self._checked):
            raise Ended

    @contextmanager
    def checked(self):
        """Within this, who runs asks `asked`."""
        self._checked = True
        try:
            yield
        finally:
            self._checked = False

    @property
    def status(self):
        """The exit status of what was asked to end."""
        return 128 + self.asked
