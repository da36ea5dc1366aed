"""Files that are written: complete, or as they were before.

As the command's outputs (src/cli/output.h): what cannot be written is said before the work is done. A file is written
beside its target and takes its place when it is complete. Symbolic links are followed and stay; a file that is replaced
keeps its mode. What is no file (a pipe, a device, /dev/stdout) is written directly. No output may be a file that is
read, or another output.
"""
import errno
import os
import stat
import sys
from contextlib import suppress

_MOST_HOPS = 40


def _is_descriptor(path):
    """Another name of an open file, which has a position of its own and may have no name: not to be replaced."""
    return path.startswith(("/proc/", "/dev/fd/"))


def _follow(path):
    """Where a path leads through symbolic links, whether something is there or not."""
    for _ in range(_MOST_HOPS):
        if _is_descriptor(path) or not os.path.islink(path):
            return path
        path = os.path.join(os.path.dirname(path), os.readlink(path))
    raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))


def _stat(path):
    try:
        return os.stat(path)
    except FileNotFoundError:
        return None


class Refused(ValueError):
    """It must not be written."""


class Output:
    """A file that is written, open from the beginning. As a context: complete at its end, and after an error what was
    there before.

    name: of the argument, for messages. reads: paths that are read; others: Outputs of the same run. Raises Refused
    (must not be written), OSError (cannot be).
    """

    def __init__(self, name, path, reads=(), others=()):
        self._stream = self._temporary = None
        self.name, self.path = name, os.fsdecode(path)
        if not self.path or "\0" in self.path:
            raise Refused(f"{name} = {self.path!r}: must be the name of a file")
        try:
            self._target = _follow(self.path)
            self._old = _stat(self._target)
            self._check(reads, others)
            if self._old and (not stat.S_ISREG(self._old.st_mode) or _is_descriptor(self._target)):
                self._open_direct()
            else:
                self._open_part()
        except OSError as error:
            self.drop()
            raise OSError(error.errno, f"{name}: {error.strerror}", self.path) from None
        except BaseException:
            self.drop()
            raise

    def _place(self):
        """By what the same file is known: device and inode, or those of the folder and a name."""
        if self._old:
            return self._old.st_dev, self._old.st_ino
        folder = os.stat(os.path.dirname(self._target) or ".")
        return folder.st_dev, folder.st_ino, os.path.basename(self._target)

    def _check(self, reads, others):
        if self._old and stat.S_ISDIR(self._old.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        for path in reads:
            try:
                info = os.stat(path)
            except (OSError, ValueError):  # what is not there is not read either
                continue
            if self._old and os.path.samestat(info, self._old):
                raise Refused(f"{self.name} = {self.path!r}: is a file that is read: must be another")
        for other in others:
            alike = _is_descriptor(self._target) and _is_descriptor(other._target)  # which may be a terminal
            if self._place() == other._place() and (alike or not (self._old and stat.S_ISCHR(self._old.st_mode))):
                raise Refused(f"{self.name} = {self.path!r}: is the same as {other.name} = {other.path!r}: "
                              f"must be another")

    def _open_direct(self):
        for number in (1, 2):
            if _is_descriptor(self._target) and os.path.samestat(os.fstat(number), self._old):
                sys.stdout.flush()
                self._stream = os.fdopen(os.dup(number), "wb")
                return
        self._stream = open(self._target, "ab")

    def _open_part(self):
        if self._old and not os.access(self._target, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        for attempt in range(100):
            name = f".subadmm-{os.getpid()}-{attempt}.part"
            temporary = os.path.join(os.path.dirname(self._target), name)
            self._temporary = temporary  # before it is there: a signal may come between
            try:
                file = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
            except FileExistsError:
                self._temporary = None
                continue
            self._stream = os.fdopen(file, "wb")
            if self._old:
                os.chmod(temporary, stat.S_IMODE(self._old.st_mode))
            return
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))

    def write(self, data):
        """Text (UTF-8) or bytes."""
        try:
            self._stream.write(data.encode() if isinstance(data, str) else data)
        except OSError as error:
            raise OSError(error.errno, f"{self.name}: {error.strerror}", self.path) from None

    def close(self):
        """It is complete: put it in its place."""
        try:
            self._stream.close()
            if self._temporary:
                os.replace(self._temporary, self._target)
                self._temporary = None
        except OSError as error:
            raise OSError(error.errno, f"{self.name}: {error.strerror}", self.path) from None
        finally:
            self.drop()

    def drop(self):
        """It is not: what was there before stays."""
        stream, temporary = self._stream, self._temporary
        self._stream = self._temporary = None
        try:
            if stream:
                stream.close()
        except OSError:  # of a disk that is full: the part goes anyway
            pass
        finally:
            if temporary:
                with suppress(OSError):  # it may never have been there
                    os.unlink(temporary)

    def __del__(self):  # of one that a signal kept from its context
        self.drop()

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        if kind is None:
            self.close()
        else:
            self.drop()
