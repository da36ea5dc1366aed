"""Files that the package writes: checked before the work, and complete or as they were. As the command's
(tests/test_outputs.c)."""
import json
import os
import signal
import stat
import subprocess
import sys
import time

import pytest

import subadmm
from subadmm import show
from subadmm.__main__ import main
from subadmm.convert import convert
from subadmm.output import Output

RUN = ["--steps", "2", "--backend", "cpu"]

#: Of each thing that writes a file: its ending, and the arguments of the command.
COMMANDS = {
    "record": (".html", lambda path: ["record", "pyramid:2", "-o", path, *RUN]),
    "record glTF": (".glb", lambda path: ["record", "pyramid:2", "-o", path, *RUN]),
    "picture": (".png", lambda path: ["picture", "pyramid:2", "-o", path, "--size", "32x32", *RUN]),
    "convert": (".json", lambda path: ["convert", "pyramid:2", path]),
    "report": (".txt", lambda path: ["convert", "pyramid:2", os.path.join(os.path.dirname(path) or ".", "made.json"),
                                     "--report", path]),
}


def left(folder):
    """Names in it, but for what 'report' makes beside its file."""
    return {name for name in os.listdir(folder) if name != "made.json"}


@pytest.fixture(params=COMMANDS)
def command(request, tmp_path):
    """(path of the output, the command's arguments)."""
    ending, arguments = COMMANDS[request.param]
    path = str(tmp_path / f"out{ending}")
    return path, arguments(path)


def test_a_file_is_replaced_when_it_is_complete(command, tmp_path):
    path, arguments = command
    assert main(arguments) == 0
    name = os.path.basename(path)
    size = os.path.getsize(path)
    assert size > 100 if not path.endswith(".txt") else size > 10
    assert left(tmp_path) == {name}
    with open(path, "w") as file:
        file.write("old")
    os.chmod(path, 0o640)
    link = str(tmp_path / f"link{os.path.splitext(path)[1]}")
    os.symlink(name, link)
    assert main([link if argument == path else argument for argument in arguments]) == 0
    # Links are followed and stay, and so does the mode.
    assert os.path.islink(link) and os.path.getsize(path) == size and stat.S_IMODE(os.stat(path).st_mode) == 0o640
    assert left(tmp_path) == {name, os.path.basename(link)}


def test_what_cannot_be_written_is_said_before_the_work(command, tmp_path, capsys, monkeypatch):
    path, arguments = command

    def never(*_, **__):
        raise AssertionError("the work was begun")

    for name in ("scene", "load"):
        monkeypatch.setattr(subadmm, name, never)
    ending = os.path.splitext(path)[1]
    (tmp_path / f"folder{ending}").mkdir()
    (tmp_path / f"loop{ending}").symlink_to(f"loop{ending}")
    cases = [(str(tmp_path / "none" / f"a{ending}"), "No such file"),
             (str(tmp_path / f"folder{ending}"), "Is a directory"),
             (str(tmp_path / f"loop{ending}"), "symbolic links"), (f"{tmp_path}/{'n' * 300}{ending}", "too long")]
    if os.getuid() != 0:  # who may write everywhere
        read_only = tmp_path / f"read_only{ending}"
        read_only.write_text("old")
        read_only.chmod(0o400)
        cases.append((str(read_only), "Permission denied"))
    before = left(tmp_path)
    for bad, said in cases:
        assert main([bad if argument == path else argument for argument in arguments]) == 1
        reported = capsys.readouterr().err
        assert said in reported and reported.count("\n") == 1, reported
    assert left(tmp_path) == before


def test_a_run_that_fails_leaves_what_was_there(command, tmp_path, capsys, monkeypatch):
    path, arguments = command
    with open(path, "w") as file:
        file.write("old")

    def fail(*_, **__):
        raise subadmm.Error("it failed")

    for name in ("scene", "load"):
        monkeypatch.setattr(subadmm, name, fail)
    assert main(arguments) == 1 and capsys.readouterr().err == "subadmm: it failed\n"
    assert open(path).read() == "old" and left(tmp_path) == {os.path.basename(path)}


def test_no_output_is_a_file_that_is_read_or_another_output(tmp_path, capsys):
    scene, other, link = tmp_path / "scene.json", tmp_path / "other.json", tmp_path / "link.json"
    assert convert("pyramid:2", scene) == []
    text = scene.read_text()
    link.symlink_to("scene.json")
    hard = tmp_path / "hard.json"
    os.link(scene, hard)
    for arguments, said in (
        ([str(scene), str(scene)], "is a file that is read"),
        ([str(scene), str(link)], "is a file that is read"),
        ([str(scene), str(hard)], "is a file that is read"),
        ([str(scene), str(other), "--report", str(scene)], "is a file that is read"),
        ([str(scene), str(other), "--report", str(other)], "is the same as path"),
        ([str(scene), str(other), "--report", str(tmp_path / "." / "other.json")], "is the same as path"),
    ):
        assert main(["convert", *arguments]) == 2
        assert said in capsys.readouterr().err
        assert scene.read_text() == text and not other.exists()
    # The same scene as a page that is no page: endings keep it away; the file behind the name does not.
    page = tmp_path / "page.html"
    page.symlink_to("scene.json")
    assert main(["record", str(scene), "-o", str(page), *RUN]) == 2
    assert "is a file that is read" in capsys.readouterr().err and scene.read_text() == text
    assert left(tmp_path) == {"scene.json", "link.json", "hard.json", "page.html"}


def test_functions_write_the_same_way(tmp_path, monkeypatch):
    world = subadmm.scene("pyramid:2", backend="cpu")
    taken = show.record(world, 0.1)
    taken.data("a.html"), taken.data("a.glb")  # which imports what makes them
    for name, write in (
        ("a.html", taken.save),
        ("a.glb", taken.save),
        ("a.png", lambda path: show.save_picture(path, world, width=32, height=32)),
        ("a.json", lambda path: convert("pyramid:2", path)),
    ):
        path = tmp_path / name
        path.write_text("old")
        with monkeypatch.context() as patched:
            for module, what in (("page", "page_of"), ("glb", "glb_of"), ("picture", "png_of")):
                patched.setattr(sys.modules[f"subadmm.show.{module}"], what, lambda *_: 1 / 0)
            patched.setattr("subadmm.World.to_json", lambda *_, **__: 1 / 0)
            with pytest.raises(ZeroDivisionError):
                write(path)
        assert path.read_text() == "old" and left(tmp_path) == {name}
        write(path)
        assert path.stat().st_size > 100 and left(tmp_path) == {name}
        path.unlink()
        with pytest.raises(FileNotFoundError, match="path"):
            write(tmp_path / "none" / name)
        with pytest.raises(ValueError, match="must be the name of a file"):
            Output("path", "")


def test_what_is_no_file_is_written_directly(tmp_path):
    made = tmp_path / "made.json"
    out = subprocess.run([sys.executable, "-m", "subadmm", "convert", "pyramid:2", str(made), "--report",
                          "/dev/stdout"],
                         capture_output=True, text=True, check=True)
    assert '"not_carried_over": []' in out.stdout and made.stat().st_size > 100
    with open(tmp_path / "log.txt", "w") as log:  # where standard output is a file, it goes on
        log.write("first\n")
        log.flush()
        subprocess.run([sys.executable, "-m", "subadmm", "convert", "pyramid:2", str(made), "--report", "/dev/stdout"],
                       stdout=log, check=True)
    assert (tmp_path / "log.txt").read_text().startswith("first\n{")
    assert main(["convert", "pyramid:2", str(made), "--report", "/dev/null"]) == 0
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode) and left(tmp_path) == {"log.txt"}


# A shell that begins the tests in the background has SIGINT ignored. The file `begun` says that steps are made.
PROGRAM = """
import signal, sys
from subadmm.__main__ import main
from subadmm.show import recording

step = recording.step_until

def begun(*arguments):
    open("begun", "w").close()
    return step(*arguments)

recording.step_until = begun
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.exit(main())
"""


def started(tmp_path, *arguments):
    """The command, making steps without end; it has begun to when this comes back."""
    run = subprocess.Popen([sys.executable, "-c", PROGRAM, *arguments, "--backend", "cpu"], stderr=subprocess.PIPE,
                           text=True, cwd=tmp_path)
    end = time.monotonic() + 60
    while not (tmp_path / "begun").exists() and time.monotonic() < end:
        time.sleep(0.01)
    (tmp_path / "begun").unlink()
    return run


@pytest.mark.parametrize("number, status", [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
@pytest.mark.parametrize("command", ["record", "picture"])
def test_a_run_that_is_asked_to_end_keeps_what_it_has(tmp_path, command, number, status):
    path = tmp_path / {"record": "a.html", "picture": "a.png"}[command]
    path.write_text("old")
    frames = ["--fps", "1"] if command == "record" else []
    run = started(tmp_path, command, "pyramid:2", "-o", str(path), "--seconds", "10000", *frames)
    run.send_signal(number)
    assert "subadmm: interrupted\n" in run.communicate(timeout=60)[1] and run.returncode == status
    assert left(tmp_path) - {"begun"} == {path.name} and path.stat().st_size > 1000
    if command == "picture":
        assert path.read_bytes().startswith(b"\x89PNG")


@pytest.fixture
def interruptible():
    """What runs in a shell's background has SIGINT ignored, and Signals leaves alone what is."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_a_second_signal_ends_at_once(tmp_path, monkeypatch, interruptible):
    from subadmm.ending import Ended, Signals

    path = tmp_path / "a.html"
    path.write_text("old")
    with Signals() as signals:
        with signals.checked():
            os.kill(os.getpid(), signal.SIGTERM)
            assert signals.asked == signal.SIGTERM and signals.status == 143
            with pytest.raises(Ended):
                os.kill(os.getpid(), signal.SIGINT)
            assert signals.asked == signal.SIGTERM  # the first one says how it ended
    # And one that comes where nobody asks, as while the file is made: it stays as it was.
    monkeypatch.setattr(subadmm, "scene", lambda *_, **__: os.kill(os.getpid(), signal.SIGTERM))
    before = signal.getsignal(signal.SIGTERM)
    assert main(["record", "pyramid:2", "-o", str(path), *RUN]) == 143
    assert path.read_text() == "old" and left(tmp_path) == {"a.html"} and signal.getsignal(signal.SIGTERM) == before


def test_what_is_kept_is_the_beginning_of_the_whole(tmp_path):
    whole = show.record(subadmm.scene("pile:8", backend="cpu"), 0.5)
    asked = iter([False] * 20 + [True] * 1000)
    part = show.record(subadmm.scene("pile:8", backend="cpu"), 0.5, ended=lambda: next(asked))
    frames = len(part.times)
    assert 1 < frames < len(whole.times)
    assert (part.positions == whole.positions[:frames]).all() and (part.times == whole.times[:frames]).all()
    assert all(len(values) == frames for values in part.measures.values())
    part.save(tmp_path / "a.html"), part.save(tmp_path / "a.glb")
    first = show.record(subadmm.scene("pile:8", backend="cpu"), 0.5, ended=lambda: True)
    assert len(first.times) == 1
    first.save(tmp_path / "b.html"), first.save(tmp_path / "b.glb")


# ---- standard output -----------------------------------------------------------------------------------------------


def ran(*arguments, **options):
    return subprocess.run([sys.executable, "-m", "subadmm", *arguments], capture_output="stdout" not in options,
                          **options)


@pytest.mark.parametrize("arguments, begins", [
    (["record", "pyramid:2", "-o", "-", *RUN], b"<!"),
    (["picture", "pyramid:2", "-o", "-", "--size", "32x32", *RUN], b"\x89PNG"),
    (["convert", "pyramid:2", "-"], b"{"),
], ids=["record", "picture", "convert"])
def test_a_dash_is_standard_output(arguments, begins, tmp_path):
    run = ran(*arguments, cwd=tmp_path)
    assert run.returncode == 0 and run.stdout.startswith(begins) and run.stderr == b"" and not os.listdir(tmp_path)
    with open("/dev/full", "wb") as full:
        run = ran(*arguments, stdout=full, stderr=subprocess.PIPE)
    assert run.returncode == 1 and b"No space left on device: /dev/stdout\n" in run.stderr
    assert run.stderr.count(b"\n") == 1


def test_reports_go_to_standard_output_alone(tmp_path):
    run = ran("convert", "pyramid:2", str(tmp_path / "a.json"), "--report", "-")
    assert run.returncode == 0 and set(json.loads(run.stdout)) == {"not_carried_over", "joints"}
    run = ran("convert", "pyramid:2", "-", "--report", "-")
    assert run.returncode == 2 and b"is the same as" in run.stderr and run.stdout == b""
    run = ran("convert", "jenga", "-")  # what is not carried over is said, and not in the file
    assert json.loads(run.stdout)["name"] == "jenga" and b"its script" in run.stderr


def test_help_that_cannot_be_written_is_a_failure():
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}  # argparse hides it
    with open("/dev/full", "wb") as full:
        run = ran("--help", stdout=full, stderr=subprocess.PIPE, env=environment)
    assert run.returncode == 1 and run.stderr == (b"subadmm: standard output could not be written: No space left on "
                                                  b"device\n")


# ---- arguments -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("arguments, said", [
    (["picture", "--azimuth", "inf"], "--azimuth: inf; must be a number in [-3600, 3600]"),
    (["picture", "--azimuth", "nan"], "--azimuth: nan"),
    (["picture", "--elevation", "nan"], "--elevation: nan; must be a number in [-89, 89]"),
    (["picture", "--elevation", "90"], "--elevation: 90"),
    (["picture", "--zoom", "inf"], "--zoom: inf; must be a number in [0.001, 1000]"),
    (["picture", "--zoom", "0"], "--zoom: 0"),
    (["picture", "--size", "2147483647x600"], "--size: width: 2147483647; must be a whole number in [16, 8192]"),
    (["picture", "--size", "960x1"], "--size: height: 1"),
    (["picture", "--size", "1x2x3"], "--size: 1x2x3"),
    (["picture", "--seconds", "nan"], "--seconds: nan; must be a number in [0, 1e+09]"),
    (["picture", "--seconds", "inf"], "--seconds: inf"),
    (["picture", "--steps", "-1"], "--steps: -1"),
    (["picture", "--steps", str(2**63)], f"--steps: {2**63}"),
    (["record", "--seconds", "-1"], "--seconds: -1"),
    (["record", "--seconds", "1e9", "--fps", "1000"], "frames, and must be 10000000 at most"),
    (["record", "--steps", "0"], "--steps: 0; a recording must have some"),
    (["record", "--seconds", "0"], "--seconds: 0; a recording must have some"),
    (["record", "--fps", "nan"], "--fps: nan; must be a number in (0, 1000]"),
    (["record", "--fps", "inf"], "--fps: inf"),
    (["record", "--fps", "0"], "--fps: 0"),
    (["record", "--contacts", "-1"], "--contacts: -1"),
    (["record", "--contacts", str(2**31)], f"--contacts: {2**31}"),
    (["record", "--iterations", str(2**31 - 1)], "--iterations: 2147483647; must be a whole number in [1, 1000000]"),
    (["record", "--iterations", str(2**31)], "--iterations: 2147483648"),
    (["record", "--iterations", "0"], "--iterations: 0"),
    (["picture", "--threads", "-1"], "--threads: -1; must be a whole number in [0, 1024]"),
    (["view", "--copies", "0"], "--copies: 0; must be a whole number in [1, 10000]"),
    (["view", "--port", "65536"], "--port: 65536; must be a whole number in [0, 65535]"),
    (["view", "--port", "-1"], "--port: -1"),
    (["convert", "--duration", "nan"], "--duration: nan; must be a number in [0, 1e+09]"),
    (["convert", "--duration", "1e10"], "--duration: 10000000000.0"),
    (["convert", "--floating"], "--floating: a scene has none; it is of MJCF, URDF or USD files"),
], ids=lambda value: " ".join(value) if isinstance(value, list) else "")
def test_arguments_out_of_range_are_named(arguments, said, tmp_path, capsys):
    path = str(tmp_path / {"picture": "a.png", "record": "a.html", "convert": "a.json", "view": ""}[arguments[0]])
    output = {"view": [], "convert": [path]}.get(arguments[0], ["-o", path])
    assert main([arguments[0], "pyramid:2", *output, *arguments[1:]]) == 2
    reported = capsys.readouterr().err
    assert said in reported and reported.count("\n") == 1, reported
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize("arguments, status, said", [
    (["picture", "nothing", "-o", "a.png"], 2, "scene = \"nothing\": must be one of"),
    (["picture", "", "-o", "a.png"], 2, "must be one of"),
    (["record", "pyramid:x", "-o", "a.html"], 2, "N must be a whole number in [1, 300]"),
    (["convert", "nothing", "a.json"], 2, "must be one of"),
    (["picture", "pyramid:2", "-o", "a.jpg"], 2, "--output: a.jpg; must end in .png, or be -"),
    (["record", "pyramid:2", "-o", "a.gif"], 2, "--output: a.gif; must end in .html"),
    (["convert", "pyramid:2", "a.txt"], 2, "output: a.txt; must end in .json, or be -"),
    (["picture", "none.json", "-o", "a.png"], 1, "none.json: could not be opened: No such file"),
    (["convert", "none.json", "a.json"], 1, "none.json: could not be opened"),
    (["picture", "bad.json", "-o", "a.png"], 1, "bad.json: line 1, column"),
    (["picture", "folder.json", "-o", "a.png"], 1, "folder.json: could not be read: Is a directory"),
    (["picture", "./none", "-o", "a.png"], 1, "./none: could not be opened"),
])
def test_bad_scenes_are_said_on_a_line(arguments, status, said, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.json").write_text("{")
    (tmp_path / "folder.json").mkdir()
    assert main(arguments) == status
    reported = capsys.readouterr().err
    assert said in reported and reported.count("\n") == 1 and reported.startswith("subadmm: "), reported
    assert left(tmp_path) == {"bad.json", "folder.json"}


@pytest.mark.parametrize("name, text, said", [
    ("a.urdf", None, "there is no file a.urdf"),
    ("a.urdf", b"<robot", "a.urdf is no XML: unclosed token"),
    ("a.urdf", b"\xff\xfe\x00a", "a.urdf is no XML"),
    ("a.urdf", b"", "a.urdf is no XML: no element found"),
    ("a.xml", b"<html/>", "a.xml is neither MJCF nor URDF: its root is <html>"),
    ("A.XML", b"<html/>", "A.XML is neither MJCF nor URDF"),
    ("a.xml", b'<mujoco><worldbody><body><geom type="mesh" mesh="no"/></body></worldbody></mujoco>',
     "a.xml: Error: mesh 'no' not found"),
    ("a.urdf", b'<robot name="a"><link name="x"><inertial><mass value="abc"/></inertial></link></robot>',
     "a.urdf: XML Error: bad format in attribute 'value' Element 'mass', line 1"),
    ("a.urdf", b'<robot name="a"><link name="x"><collision><geometry><mesh filename="none.obj"/></geometry></collision>'
               b'</link></robot>', "there is no mesh none.obj"),
    ("a.urdf", b'<robot name="a"><link name="x"><collision><geometry><mesh filename="bad.obj"/></geometry></collision>'
               b'</link></robot>', "a.urdf: "),
])
def test_bad_robots_are_said_on_a_line(name, text, said, tmp_path, capsys, monkeypatch):
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.obj").write_text("v 0 0 x")
    if text is not None:
        (tmp_path / name).write_bytes(text)
    before = left(tmp_path)
    for arguments in (["picture", name, "-o", "a.png", *RUN], ["convert", name, "a.json"]):
        assert main(arguments) == 1
        reported = capsys.readouterr().err
        assert said in reported and reported.count("\n") == 1 and reported.startswith("subadmm: "), reported
    assert left(tmp_path) == before


def test_bad_stages_are_said_on_a_line(tmp_path, capsys, monkeypatch):
    pytest.importorskip("pxr")
    monkeypatch.chdir(tmp_path)
    for name, text in (("a.usda", b"#usda 1.0\ndef Cube"), ("a.usd", b""), ("a.usdz", b"PK"), ("a.usdc", b"\0" * 99)):
        (tmp_path / name).write_bytes(text)
        assert main(["convert", name, "a.json"]) == 1
        reported = capsys.readouterr().err
        assert name in reported and reported.count("\n") == 1, reported
    assert "a.json" not in left(tmp_path)


@pytest.mark.parametrize("seconds, steps", [("0.3", 30), ("0.7", 70), ("0.301", 31), ("1e-9", 1), ("0", 0)])
def test_seconds_are_whole_steps_rounded_up(seconds, steps, tmp_path, monkeypatch):
    made = []
    monkeypatch.setattr("subadmm.show.recording.step_until", lambda world, steps, ended=None: made.append(steps))
    scene = tmp_path / "a.json"
    scene.write_text('{"format": "subadmm scene", "format_version": 1, "settings": {"dt": 0.01}, "bodies": ['
                     '{"mass": 1, "inertia": [1, 1, 1], "shapes": [{"type": "sphere", "size": [1]}]}]}')
    assert main(["picture", str(scene), "-o", str(tmp_path / "a.png"), "--seconds", seconds, "--size", "32x32"]) == 0
    assert made == [steps]


def test_what_a_robot_is_made_of_is_read_as_well(tmp_path, capsys):
    pytest.importorskip("mujoco")
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "wedge.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
    (tmp_path / "more.xml").write_text('<mujoco><asset><mesh file="wedge.obj"/></asset></mujoco>')
    robot = tmp_path / "robot.xml"
    robot.write_text('<mujoco><compiler meshdir="parts"/><include file="more.xml"/><worldbody><body><freejoint/>'
                     '<geom type="mesh" mesh="wedge"/></body></worldbody></mujoco>')
    out = tmp_path / "robot.json"
    for name in ("robot.xml", "more.xml", "parts/wedge.obj"):
        before = (tmp_path / name).read_text()
        assert main(["convert", str(robot), str(out), "--report", str(tmp_path / name)]) == 2
        assert "is a file that is read" in capsys.readouterr().err
        assert (tmp_path / name).read_text() == before and not out.exists()
    assert main(["convert", str(robot), str(out), "--report", str(tmp_path / "report.json")]) == 0 and out.exists()


def test_layers_of_a_stage_are_read_as_well(tmp_path, capsys):
    Usd = pytest.importorskip("pxr.Usd")
    (tmp_path / "part.usda").write_text(
        '#usda 1.0\ndef Cube "part" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsCollisionAPI"]) {}\n')
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    stage.DefinePrim("/part").GetReferences().AddReference("./part.usda", "/part")
    stage.Save()
    before = (tmp_path / "part.usda").read_text()
    out = tmp_path / "a.json"
    assert main(["convert", str(tmp_path / "a.usda"), str(out), "--report", str(tmp_path / "part.usda")]) == 2
    assert "is a file that is read" in capsys.readouterr().err and (tmp_path / "part.usda").read_text() == before
    assert main(["convert", str(tmp_path / "a.usda"), str(out)]) == 0 and out.exists()
