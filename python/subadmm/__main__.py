"""python -m subadmm view | hands | record | picture SCENE: scenes to look at; convert FILE: robots as scene files."""
import argparse
import math
import os
import signal
import sys
import threading
import time
from contextlib import contextmanager

import subadmm
from subadmm._core import _names
from subadmm.convert import MODELS, read_by
from subadmm.given import real, whole
from subadmm.output import Output


def _arguments():
    parser = argparse.ArgumentParser(prog="python -m subadmm", description="Scenes to look at, and robots as scenes.")
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
        command.add_argument("-o", "--output", required=True, help="the file to write")
        length = command.add_mutually_exclusive_group()
        length.add_argument("--seconds", type=float, help="simulated time; default: the scene's duration")
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
    convert.add_argument("output", help="the scene file to write, for 'subadmm run' and others")
    convert.add_argument("--report", metavar="FILE", help="also write what is not carried over to a file, as JSON")
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


def _steps(world, given):
    """How many to make."""
    if given.steps is not None:
        return given.steps
    seconds = given.seconds if given.seconds is not None else world.duration or _DURATION
    return round(seconds / world.settings.dt)


def _check_run(given):
    """What is known to be wrong before anything is done."""
    if given.seconds is not None:
        real("--seconds", given.seconds, 0, 1e9)
    if given.steps is not None:
        whole("--steps", given.steps, 0, 2**63 - 1)


def _record(build, given):
    from subadmm import show
    from subadmm.show.recording import check_ending, check_frames, check_video

    check_ending("--output", given.output)
    check_frames(given.fps, given.contacts, "--")
    _check_run(given)
    said = [0.0]

    def progress(frame, frames):
        now = time.monotonic()
        if sys.stderr.isatty() and (now - said[0] > 0.2 or frame + 1 == frames):
            said[0] = now
            print(
                f"\rframe {frame + 1} of {frames}", end="\n" if frame + 1 == frames else "", file=sys.stderr, flush=True
            )

    options = {}
    if given.output.endswith(".mp4"):
        width, height = _size(given.size)
        options = {"width": width, "height": height}
        check_video(**options)
    with Output("--output", given.output, read_by(given.scene)) as file:
        source = build()
        world = getattr(source, "world", source)
        if given.certify:
            settings = world.settings
            settings.certify = True
            world.settings = settings
        seconds = _steps(world, given) * world.settings.dt
        made = show.record(source, seconds, given.fps, title=given.scene, contacts=given.contacts, after_frame=progress)
        file.write(made.data(given.output, **options))


def _size(given):
    """(width, height) of --size."""
    try:
        width, height = map(int, given.split("x"))
    except ValueError:
        raise ValueError(f"--size: {given}; must be WIDTHxHEIGHT, as 960x600") from None
    return width, height


def _picture(build, given):
    from subadmm import show
    from subadmm.show.camera import check_place
    from subadmm.show.picture import check_size
    from subadmm.show.png import png_of

    if not given.output.endswith(".png"):
        raise ValueError(f"--output: {given.output}; must end in .png")
    width, height = _size(given.size)
    check_size(width, height, "--size: ")
    check_place(given.azimuth, given.elevation, given.zoom, "--")
    _check_run(given)
    with Output("--output", given.output, read_by(given.scene)) as file:
        source = build()
        world = getattr(source, "world", source)
        world.step(_steps(world, given))
        description = show.describe(source, collision=given.collision)
        camera = show.looking_at(description, given.azimuth, given.elevation, given.zoom)
        file.write(png_of(show.picture(source, width, height, camera=camera, description=description)))


def _view(build, given):
    from subadmm.show.view import serve

    copies, one = whole("--copies", given.copies, 1, 10000), build
    if copies > 1:
        def build():
            source = one()
            world = getattr(source, "world", source)
            if world.has_script:
                world.script = False
            return subadmm.replicate(source, copies)
    serve(build, os.path.basename(given.scene), host=given.host, port=whole("--port", given.port, 0, 65535))


def _hands(build, given):
    from .hands.page import serve

    serve(build, os.path.basename(given.scene), host=given.host, port=whole("--port", given.port, 0, 65535),
          certificate=given.certificate, key=given.key, stand=given.stand,
          yaw=math.radians(real("--yaw", given.yaw, -3600, 3600)), scale=given.scale)


def _convert(given):
    from .convert import convert

    if not given.output.endswith(".json"):
        raise ValueError(f"output: {given.output}; must end in .json")
    if given.duration is not None:
        real("--duration", given.duration, 0, 1e9)
    options = {name: getattr(given, name) for name in ("floating", "keyframe", "decompose") if getattr(given, name)}
    notes = convert(given.source, given.output, report=given.report, duration=given.duration, **options)
    if notes:
        print(f"not carried over, or not exactly ({len(notes)}):")
        print(notes)


class _Ended(BaseException):
    """By SIGTERM: what is not complete is dropped on the way out."""


@contextmanager
def _ended_by_signals():
    def end(*_):
        raise _Ended

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def main(arguments=None):
    """The command; gives its exit status."""
    given = _arguments().parse_args(arguments)

    def build():
        settings = {name: getattr(given, name) for name in ("iterations", "threads")
                    if getattr(given, name) is not None}
        if given.scene.endswith(MODELS):
            loaded = subadmm.load(given.scene, backend=given.backend, precision=given.precision or "f64")
            changed = loaded.world.settings
            for name, value in {**settings, **({"method": given.method} if given.method else {})}.items():
                setattr(changed, name, value)
            loaded.world.settings = changed
            return loaded
        return subadmm.scene(given.scene, backend=given.backend, precision=given.precision, method=given.method,
                             settings=settings)

    try:
        with _ended_by_signals():
            if given.command == "convert":
                _convert(given)
            else:
                {"record": _record, "picture": _picture, "view": _view, "hands": _hands}[given.command](build, given)
    except (subadmm.Error, ValueError, ImportError, OSError) as error:
        print(f"subadmm: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    except _Ended:
        return 143
    return 0


if __name__ == "__main__":
    sys.exit(main())
