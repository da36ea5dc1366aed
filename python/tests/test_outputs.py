"""Files that the package writes: checked before the work, and complete or as they were. As the command's
(tests/test_outputs.c)."""
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
        assert main(["convert", *arguments]) == 1
        assert said in capsys.readouterr().err
        assert scene.read_text() == text and not other.exists()
    # The same scene as a page that is no page: endings keep it away; the file behind the name does not.
    page = tmp_path / "page.html"
    page.symlink_to("scene.json")
    assert main(["record", str(scene), "-o", str(page), *RUN]) == 1
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


@pytest.mark.parametrize("number, status", [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_run_that_is_ended_leaves_what_was_there(tmp_path, number, status):
    path = tmp_path / "a.html"
    path.write_text("old")
    # A shell that begins the tests in the background has SIGINT ignored.
    program = ("import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
               "from subadmm.__main__ import main; "
               "sys.exit(main())")
    run = subprocess.Popen([sys.executable, "-c", program, "record", "pyramid:2", "-o", str(path), "--seconds",
                            "100000",
                            "--fps", "0.001", "--backend", "cpu"])
    end = time.monotonic() + 60
    while not any(name.endswith(".part") for name in left(tmp_path)) and time.monotonic() < end:
        time.sleep(0.01)
    run.send_signal(number)
    assert run.wait(60) == status
    assert path.read_text() == "old" and left(tmp_path) == {"a.html"}


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
    (["record", "--steps", "0"], "seconds: 0"),
    (["record", "--fps", "nan"], "--fps: nan; must be a number in (0, 1000]"),
    (["record", "--fps", "inf"], "--fps: inf"),
    (["record", "--fps", "0"], "--fps: 0"),
    (["record", "--contacts", "-1"], "--contacts: -1"),
    (["record", "--contacts", str(2**31)], f"--contacts: {2**31}"),
    (["record", "--iterations", str(2**31 - 1)], "iterations = 2147483647: must be in [1, 1000000]"),
    (["record", "--iterations", str(2**31)], "iterations = 2147483648: must be a whole number"),
    (["view", "--port", "65536"], "--port: 65536; must be a whole number in [0, 65535]"),
    (["view", "--port", "-1"], "--port: -1"),
    (["convert", "--duration", "nan"], "--duration: nan; must be a number in [0, 1e+09]"),
    (["convert", "--duration", "1e10"], "--duration: 10000000000.0"),
], ids=lambda value: " ".join(value) if isinstance(value, list) else "")
def test_arguments_out_of_range_are_named(arguments, said, tmp_path, capsys):
    path = str(tmp_path / {"picture": "a.png", "record": "a.html", "convert": "a.json", "view": ""}[arguments[0]])
    output = {"view": [], "convert": [path]}.get(arguments[0], ["-o", path])
    assert main([arguments[0], "pyramid:2", *output, *arguments[1:]]) == 1
    reported = capsys.readouterr().err
    assert said in reported and reported.count("\n") == 1, reported
    assert not os.listdir(tmp_path)


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
        assert main(["convert", str(robot), str(out), "--report", str(tmp_path / name)]) == 1
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
    assert main(["convert", str(tmp_path / "a.usda"), str(out), "--report", str(tmp_path / "part.usda")]) == 1
    assert "is a file that is read" in capsys.readouterr().err and (tmp_path / "part.usda").read_text() == before
    assert main(["convert", str(tmp_path / "a.usda"), str(out)]) == 0 and out.exists()
