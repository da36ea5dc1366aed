"""python -m subadmm view | record | picture SCENE: scenes to look at; convert FILE: robots as scene files."""
import argparse
import sys
import time

import subadmm
from subadmm.convert import MODELS


def _arguments():
    parser = argparse.ArgumentParser(prog="python -m subadmm", description="Scenes to look at, and robots as scenes.")
    commands = parser.add_subparsers(dest="command", required=True)
    view = commands.add_parser("view", help="open a page with the running scene (needs: pip install 'subadmm[view]')")
    record = commands.add_parser(
        "record", help="run a scene into a page that plays by itself (.html) or a glTF file (.glb)"
    )
    picture = commands.add_parser("picture", help="run a scene and write a picture of its end (.png)")
    for command in (view, record, picture):
        command.add_argument("scene", help="as 'pile:300', the names: subadmm.scenes(); or a file, .json, .xml, .urdf or .usd...")
        command.add_argument("--backend", default="auto", choices=["auto", "ref", "cpu", "cuda"])
        command.add_argument("--precision", choices=["f32", "f64"], help="default: the scene's")
        command.add_argument("--method", choices=["fast", "paper"], help="default: the scene's")
        command.add_argument("--iterations", type=int, help="a step; default: the scene's")
    for command in (record, picture):
        command.add_argument("-o", "--output", required=True, help="the file to write")
        length = command.add_mutually_exclusive_group()
        length.add_argument("--seconds", type=float, help="simulated time; default: the scene's duration")
        length.add_argument("--steps", type=int, help="instead of --seconds")
    record.add_argument("--fps", type=float, default=30, help="frames a simulated second (30)")
    record.add_argument("--contacts", type=int, default=0, metavar="N",
                        help="keep the N largest contact forces of each frame, for arrows in the page (0)")
    record.add_argument("--certify", action="store_true", help="measure the true error of every step, for the plots")
    picture.add_argument("--size", default="960x600", help="WIDTHxHEIGHT in pixels (960x600)")
    picture.add_argument("--azimuth", type=float, default=-60, help="where the camera stands, degrees (-60)")
    picture.add_argument("--elevation", type=float, default=24, help="degrees (24)")
    picture.add_argument("--zoom", type=float, default=1, help="2: twice as near (1)")
    convert = commands.add_parser("convert", help="write a robot's file (MJCF, URDF, USD) or a scene as a scene file (.json)")
    convert.add_argument("source", help="a .xml, .urdf, .usd... file, a scene as 'pile:300', or a scene file")
    convert.add_argument("output", help="the scene file to write, for 'subadmm run' and others")
    convert.add_argument("--report", metavar="FILE", help="also write what is not carried over to a file, as JSON")
    convert.add_argument("--duration", type=float, help="how long the scene is meant to be run for, s (default: its own, or 10)")
    convert.add_argument("--floating", action="store_true", help="URDF: the base is free")
    convert.add_argument("--keyframe", help="MJCF: the keyframe to start from")
    convert.add_argument("--decompose", action="store_true",
                         help="several hulls for each mesh of a moving body (needs: pip install 'subadmm[decompose]')")
    view.add_argument("--host", default="127.0.0.1", help="address to serve at (127.0.0.1: this machine only)")
    view.add_argument("--port", type=int, default=8080, help="port to serve at (8080)")
    return parser


_DURATION = 10.0  # s, of worlds that do not say


def _steps(world, given):
    """How many to make."""
    if given.steps is not None:
        if given.steps < 0:
            raise ValueError(f"--steps: {given.steps}; must be 0 or more")
        return given.steps
    seconds = given.seconds if given.seconds is not None else world.duration or _DURATION
    if not 0 <= seconds < float("inf"):
        raise ValueError(f"--seconds: {seconds}; must be 0 or more")
    return round(seconds / world.settings.dt)


def _record(world, given):
    from subadmm import show

    dt = world.settings.dt
    if given.certify:
        settings = world.settings
        settings.certify = True
        world.settings = settings
    said = [0.0]

    def progress(frame, frames):
        now = time.monotonic()
        if sys.stderr.isatty() and (now - said[0] > 0.2 or frame + 1 == frames):
            said[0] = now
            print(
                f"\rframe {frame + 1} of {frames}", end="\n" if frame + 1 == frames else "", file=sys.stderr, flush=True
            )

    if not given.output.endswith((".html", ".glb")):
        raise ValueError(f"--output: {given.output}; must end in .html or .glb")
    show.record(world, _steps(world, given) * dt, given.fps, title=given.scene, contacts=given.contacts,
                after_frame=progress).save(given.output)


def _picture(world, given):
    from subadmm import show

    if not given.output.endswith(".png"):
        raise ValueError(f"--output: {given.output}; must end in .png")
    try:
        width, height = map(int, given.size.split("x"))
    except ValueError:
        raise ValueError(f"--size: {given.size}; must be WIDTHxHEIGHT, as 960x600") from None
    world.step(_steps(world, given))
    description = show.describe(world)
    camera = show.looking_at(description, given.azimuth, given.elevation, given.zoom)
    show.save_picture(given.output, world, width=width, height=height, camera=camera, description=description)


def _convert(given):
    from .convert import convert

    if not given.output.endswith(".json"):
        raise ValueError(f"output: {given.output}; must end in .json")
    if given.duration is not None and not 0 <= given.duration < float("inf"):
        raise ValueError(f"--duration: {given.duration}; must be 0 or more")
    options = {name: getattr(given, name) for name in ("floating", "keyframe", "decompose") if getattr(given, name)}
    notes = convert(given.source, given.output, report=given.report, duration=given.duration, **options)
    if notes:
        print(f"not carried over, or not exactly ({len(notes)}):")
        print(notes)


def main(arguments=None):
    """The command; gives its exit status."""
    given = _arguments().parse_args(arguments)

    def build():
        settings = {} if given.iterations is None else {"iterations": given.iterations}
        if given.scene.endswith(MODELS):
            world = subadmm.load(given.scene, backend=given.backend, precision=given.precision or "f64").world
            changed = world.settings
            for name, value in {**settings, **({"method": given.method} if given.method else {})}.items():
                setattr(changed, name, value)
            world.settings = changed
            return world
        return subadmm.scene(given.scene, backend=given.backend, precision=given.precision, method=given.method,
                             settings=settings)

    try:
        if given.command == "convert":
            _convert(given)
        elif given.command == "view":
            from subadmm.show.view import serve
            serve(build, given.scene, host=given.host, port=given.port)
        else:
            {"record": _record, "picture": _picture}[given.command](build(), given)
    except (subadmm.Error, ValueError, ImportError, OSError) as error:
        print(f"subadmm: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
