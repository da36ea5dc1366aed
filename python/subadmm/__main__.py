"""python -m subadmm view | hands | record | picture SCENE: scenes to look at; convert FILE: robots as scene files."""
import argparse
import math
import os
import sys
import time
import warnings
from contextlib import contextmanager, nullcontext

import subadmm
from subadmm._core import _names
from subadmm.convert import is_model, read_by
from subadmm.ending import Ended, Signals
from subadmm.given import real, whole
from subadmm.output import Output, Refused


def _arguments():
    parser = argparse.ArgumentParser(prog="python -m subadmm", description="Scenes to look at, and robots as scenes.",
                                     epilog="Exit status: 0 done; 1 something failed or could not be written; 2 wrong "
                                            "usage; 130 or 143: interrupted (SIGINT, SIGTERM), with what was recorded "
                                            "until then, or the picture of where it was.")
    parser.add_argument("--version", action="version", version=f"subadmm {subadmm.__version__} ({subadmm.build_commit()})")
    commands = parser.add_subparsers(dest="command", required=True)
    view = commands.add_parser("view", help="open a page with the running scene (needs: pip install 'viser<2')")
    record = commands.add_parser(
        "record", help="run a scene into a page that plays by itself (.html), glTF (.glb), a video (.mp4; needs: pip "
                       "install imageio-ffmpeg) or a stage (.usd, .usda, .usdc; needs: pip install usd-core)"
    )
    hands = commands.add_parser(
        "hands", help="open a page (WebXR) by which a user's hands are in the running scene (needs: pip install "
                      "'websockets>=13')")
    picture = commands.add_parser("picture", help="run a scene and write a picture of its end (.png)")
    for command in (view, hands, record, picture):
        command.add_argument("scene",
                             help="as 'pile:300', the names: subadmm.scenes(); or a file, .json, .xml, .urdf or "
                                  ".usd...")
        command.add_argument("--backend", default="auto", choices=_names["backend"])
        command.add_argument("--precision", choices=_names["precision"], help="default: the scene's")
        command.add_argument("--method", choices=_names["method"], help="default: the scene's")
        command.add_argument("--iterations", type=int, help="a step; default: the scene's")
        command.add_argument("--threads", type=int, help="at most so many; 0: OpenMP's default; default: the scene's")
    for command in (record, picture):
        command.add_argument("-o", "--output", required=True,
                             help="the file to write; -: standard output" + (" (.html)" if command is record else ""))
        length = command.add_mutually_exclusive_group()
        length.add_argument("--seconds", type=float, help="simulated time, s, rounded up to whole steps; default: the "
                                                             "scene's duration")
        length.add_argument("--steps", type=int, help="instead of --seconds")
    record.add_argument("--fps", type=float, default=30, help="frames a simulated second (30)")
    record.add_argument("--contacts", type=int, default=0, metavar="N",
                        help="keep the N largest contact forces of each frame, for arrows in the page (0)")
    record.add_argument("--certify", action="store_true", help="measure the true error of every step, for the plots")
    record.add_argument("--size", default="1280x720", help="of .mp4, WIDTHxHEIGHT in pixels, even (1280x720)")
    picture.add_argument("--size", default="960x600", help="WIDTHxHEIGHT in pixels (960x600)")
    picture.add_argument("--collision", action="store_true", help="of robots' files: the shapes that collide")
    picture.add_argument("--azimuth", type=float, default=-60, help="where the camera stands, degrees (-60)")
    picture.add_argument("--elevation", type=float, default=24, help="degrees (24)")
    picture.add_argument("--zoom", type=float, default=1, help="2: twice as near (1)")
    convert = commands.add_parser("convert",
                                  help="write a robot's file (MJCF, URDF, USD) or a scene as a scene file (.json)")
    convert.add_argument("source", help="a .xml, .urdf, .usd... file, a scene as 'pile:300', or a scene file")
    convert.add_argument("output", help="the scene file to write, for 'subadmm run' and others; -: standard output")
    convert.add_argument("--report", metavar="FILE", help="also write what is not carried over to a file, as JSON; -: standard output")
    convert.add_argument("--duration", type=float,
                         help="how long the scene is meant to be run for, s (default: its own, or 10)")
    convert.add_argument("--floating", action="store_true", help="URDF: the base is free")
    convert.add_argument("--keyframe", help="MJCF: the keyframe to start from")
    convert.add_argument("--decompose", action="store_true",
                         help="several hulls for each mesh of a moving body (needs: pip install coacd)")
    view.add_argument("--copies", type=int, default=1, help="so many environments, side by side (1)")
    for command, port in ((view, 8080), (hands, 8081)):
        command.add_argument("--host", default="127.0.0.1", help="address to serve at (127.0.0.1: this machine only)")
        command.add_argument("--port", type=int, default=port, help=f"port to serve at ({port})")
    hands.add_argument("--certificate", metavar="FILE", help="PEM; browsers have WebXR on other machines by https only")
    hands.add_argument("--key", metavar="FILE", help="PEM, of the certificate")
    hands.add_argument("--stand", type=float, nargs=3, metavar=("X", "Y", "Z"),
                       help="where the middle of your floor is, m, world (default: what moves is before your chest)")
    hands.add_argument("--yaw", type=float, default=0, help="where you look: about z from x, degrees (0)")
    hands.add_argument("--scale", type=float, default=1, help="metres of the world to one of yours (1)")
    return parser


_DURATION = 10.0  # s, of worlds that do not say


class _Usage(Exception):
    """Wrong usage, by its exit status; other errors are failures."""


@contextmanager
def _usage():
    try:
        yield
    except ValueError as error:
        raise _Usage(error) from None


def _standard(path):
    """Of "-": standard output, by its name as a file."""
    return "/dev/stdout" if path == "-" else path


def _steps(world, given):
    """How many to make: those that cover --seconds, but for the rounding of it and of dt."""
    if given.steps is not None:
        return given.steps
    dt = world.settings.dt
    if given.seconds is None:
        return round((world.duration or _DURATION) / dt)
    exact = given.seconds / dt
    nearest = round(exact)
    return nearest if abs(exact - nearest) <= 1e-12 * exact else math.ceil(exact)


def _check_run(given):
    """What is known to be wrong before anything is done."""
    if given.seconds is not None:
        real("--seconds", given.seconds, 0, 1e9)
    if given.steps is not None:
        whole("--steps", given.steps, 0, 2**63 - 1)


def _record(build, given, signals):
    from subadmm import show
    from subadmm.show.recording import check_ending, check_frames, check_video, count_frames

    path = "a.html" if given.output == "-" else given.output  # by its ending
    options = {}
    with _usage():
        check_ending("--output", path)
        check_frames(given.fps, given.contacts, "--")
        _check_run(given)
        if path.endswith(".mp4"):
            width, height = _size(given.size)
            options = {"width": width, "height": height}
            check_video(**options)
        if given.steps == 0 or given.seconds == 0:
            raise ValueError(f"--{'steps' if given.steps == 0 else 'seconds'}: 0; a recording must have some")
        if given.seconds:
            count_frames(given.seconds, given.fps, "--")
    said = [0.0]

    def progress(frame, frames):
        now = time.monotonic()
        if sys.stderr.isatty() and (now - said[0] > 0.2 or frame + 1 == frames):
            said[0] = now
            print(
                f"\rframe {frame + 1} of {frames}", end="\n" if frame + 1 == frames else "", file=sys.stderr, flush=True
            )

    with Output("--output", _standard(given.output), read_by(given.scene)) as file:
        source = build()
        world = getattr(source, "world", source)
        if given.certify:
            settings = world.settings
            settings.certify = True
            world.settings = settings
        seconds = _steps(world, given) * world.settings.dt
        with _usage():
            count_frames(seconds, given.fps, "--")
        with signals.checked():
            made = show.record(source, seconds, given.fps, title=given.scene, contacts=given.contacts,
                               after_frame=progress, ended=lambda: signals.asked)
        file.write(made.data(path, **options))


def _size(given):
    """(width, height) of --size."""
    try:
        width, height = map(int, given.split("x"))
    except ValueError:
        raise ValueError(f"--size: {given}; must be WIDTHxHEIGHT, as 960x600") from None
    return width, height


def _picture(build, given, signals):
    from subadmm import show
    from subadmm.show.camera import check_place
    from subadmm.show.picture import check_size
    from subadmm.show.png import png_of
    from subadmm.show.recording import step_until

    with _usage():
        if given.output != "-" and not given.output.endswith(".png"):
            raise ValueError(f"--output: {given.output}; must end in .png, or be -")
        width, height = _size(given.size)
        check_size(width, height, "--size: ")
        check_place(given.azimuth, given.elevation, given.zoom, "--")
        _check_run(given)
    with Output("--output", _standard(given.output), read_by(given.scene)) as file:
        source = build()
        world = getattr(source, "world", source)
        with signals.checked():
            step_until(world, _steps(world, given), lambda: signals.asked)
        description = show.describe(source, collision=given.collision)
        camera = show.looking_at(description, given.azimuth, given.elevation, given.zoom)
        file.write(png_of(show.picture(source, width, height, camera=camera, description=description)))


def _view(build, given, _):
    from subadmm.show.view import serve

    with _usage():
        copies, port = whole("--copies", given.copies, 1, 10000), whole("--port", given.port, 0, 65535)
    one = build
    if copies > 1:
        def build():
            source = one()
            world = getattr(source, "world", source)
            if world.has_script:
                world.script = False
            return subadmm.replicate(source, copies)
    serve(build, os.path.basename(given.scene), host=given.host, port=port)


def _hands(build, given, _):
    from .hands.page import serve

    with _usage():
        port, yaw = whole("--port", given.port, 0, 65535), math.radians(real("--yaw", given.yaw, -3600, 3600))
        scale = real("--scale", given.scale, 1e-3, 1e3)
        if (given.certificate is None) != (given.key is None):
            raise ValueError("--certificate, --key: one must be given with the other")
    serve(build, os.path.basename(given.scene), host=given.host, port=port, certificate=given.certificate,
          key=given.key, stand=given.stand, yaw=yaw, scale=scale)


def _convert(given):
    from .convert import convert

    options = {name: getattr(given, name) for name in ("floating", "keyframe", "decompose") if getattr(given, name)}
    with _usage():
        if given.output != "-" and not given.output.endswith(".json"):
            raise ValueError(f"output: {given.output}; must end in .json, or be -")
        if given.duration is not None:
            real("--duration", given.duration, 0, 1e9)
        if options and not is_model(given.source):
            raise ValueError(f"--{next(iter(options))}: a scene has none; it is of MJCF, URDF or USD files")
    with nullcontext() if is_model(given.source) or _is_file(given.source) else _usage():
        notes = convert(given.source, _standard(given.output), report=given.report and _standard(given.report),
                        duration=given.duration, **options)
    if notes:
        out = sys.stderr if {"-", "/dev/stdout"} & {given.output, given.report} else sys.stdout
        print(f"not carried over, or not exactly ({len(notes)}):\n{notes}", file=out)


def _is_file(scene):
    """As the command: a path by its ending or its slash, else a name."""
    return scene.endswith(".json") or "/" in scene


def _build(given):
    """The world of a scene, or what load() makes of a robot's file."""
    settings = {name: getattr(given, name) for name in ("iterations", "threads") if getattr(given, name) is not None}
    if is_model(given.scene):
        loaded = subadmm.load(given.scene, backend=given.backend, precision=given.precision or "f64")
        changed = loaded.world.settings
        for name, value in {**settings, **({"method": given.method} if given.method else {})}.items():
            setattr(changed, name, value)
        loaded.world.settings = changed
        return loaded
    with nullcontext() if _is_file(given.scene) else _usage():
        return subadmm.scene(given.scene, backend=given.backend, precision=given.precision, method=given.method,
                             settings=settings)


def _run(given, signals):
    if given.command == "convert":
        _convert(given)
        return
    with _usage():
        if given.iterations is not None:
            whole("--iterations", given.iterations, 1, 1000000)
        if given.threads is not None:
            whole("--threads", given.threads, 0, 1024)
    act = {"record": _record, "picture": _picture, "view": _view, "hands": _hands}[given.command]
    act(lambda: _build(given), given, signals)


def _fail(status, error):
    if isinstance(error, OSError) and error.strerror:  # without its number
        error = error.strerror + (f": {error.filename}" if error.filename else "")
    print(f"subadmm: {error}", file=sys.stderr)
    return status


def main(arguments=None):
    """The command; gives its exit status: 0 done, 1 failed, 2 wrong usage, 130 and 143 interrupted."""
    given = _arguments().parse_args(arguments)
    with Signals() as signals:
        try:
            _run(given, signals)
            return _fail(signals.status, "interrupted") if signals.asked else 0
        except (_Usage, Refused) as error:
            return _fail(2, error)
        except (subadmm.Error, ValueError, ImportError, OSError) as error:
            return _fail(1, error)
        except (MemoryError, RecursionError) as error:
            return _fail(1, f"{given.command}: {str(error) or 'out of memory'}")
        except (KeyboardInterrupt, Ended):
            return signals.status if signals.asked else 130


def _exit():
    """As the command: what standard output did not take is a failure, and said."""
    shown = warnings.showwarning
    warnings.showwarning = lambda message, *_, **__: print(f"subadmm: warning: {message}", file=sys.stderr)
    try:
        status = main()
    except SystemExit as ended:  # --help, and what argparse refuses
        status = ended.code
    finally:
        warnings.showwarning = shown
    try:
        if sys.stdout:
            sys.stdout.flush()
    except OSError as error:
        print(f"subadmm: standard output could not be written: {error.strerror}", file=sys.stderr)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what is still in its buffer goes there
        status = status or 1
    sys.exit(status)


if __name__ == "__main__":
    _exit()
