#!/usr/bin/env python3
"""bench/report.py: test_report.py PROJECT [SUBADMM SUBADMM_BENCH, which have a GPU or an emulated one].

Rows of a backend are replaced and others kept, what is missing is said and what fails stops nothing, tables have both
backends, command lines that make no sense are refused. With the two commands: every report that a GPU adds is made.
"""
import contextlib
import csv
import io
import os
import subprocess
import sys
import tempfile

PROJECT = sys.argv[1]
sys.path.insert(0, os.path.join(PROJECT, "bench"))
import report  # noqa: E402
import report_files  # noqa: E402
import reports  # noqa: E402


def precision_row(backend, precision, iterations, ms, error, name="scene a"):
    return {"kind": "curve", "name": name, "method": "fast", "backend": backend, "precision": precision,
            "iterations": str(iterations), "ms": str(ms), "ncp_balanced": str(error)}


def write(path, notes, rows):
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.writelines(f"# {note}\n" for note in notes)
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def failure(call, *args):
    try:
        call(*args)
    except reports.Failed as reason:
        return str(reason)
    raise AssertionError(f"{call.__name__}{args} did not fail")


def test_merge(folder):
    """Of the CPU's figures, and an older run of a GPU, the latter is replaced: the rows and the note."""
    source, into = os.path.join(folder, "source"), os.path.join(folder, "into")
    os.makedirs(source), os.makedirs(into)
    path = os.path.join(into, "precision.csv")
    cpu = [precision_row("cpu", "f32", 1, 0.1, 1), precision_row("cpu", "f64", 2, 0.2, 1e-9)]
    old = [precision_row("cuda", "f32", 1, 9, 1), precision_row("cuda", "f32", 2, 9, 1)]
    new = [precision_row("cuda", "f64", 3, 0.3, 1e-9)]
    two_lines = ["A CPU, 2 cores; 2026-01-01; subadmm 1", "bench/report.py precision"]
    write(path, [*two_lines, "cuda: old GPU; 2026-01-01; subadmm 1; bench/report.py --gpu precision"], cpu + old)
    note = "cuda: new GPU; 1 device; 2026-02-02; subadmm 2; bench/report.py --gpu precision"
    write(os.path.join(source, "precision.csv"), [note], new)
    assert report.merge(source, into) == ["precision"]
    assert report_files.read_csv(path) == ([*two_lines, note], cpu + new)
    table = list(report_files.table_of("precision", into))
    assert table[-2] == ("*A CPU, 2 cores; subadmm 1; `bench/report.py precision`; cuda: new GPU; 1 device; subadmm 2; "
                         "`bench/report.py --gpu precision`*"), table[-2]

    # the CPU's rows measured anew leave those of the GPU; they come first again
    report_files.replace_parts(path, {"cpu": (["a CPU"], cpu[:1])})
    assert report_files.read_csv(path) == (["a CPU", note], cpu[:1] + new)

    # where there was no file, and where all rows were the GPU's
    write(os.path.join(source, "gpu.csv"), ["cuda: new"], [{"scene": "a", "backend": "cuda"}])
    write(os.path.join(into, "gpu.csv"), ["from before notes said so"], [{"scene": "b", "backend": "cuda"}])
    os.remove(path)
    report.merge(source, into)
    assert report_files.read_csv(path) == ([note], new)
    assert report_files.read_csv(os.path.join(into, "gpu.csv")) == (["cuda: new"], [{"scene": "a", "backend": "cuda"}])

    # nothing is written where one file is not to be merged
    before = read(path)
    write(os.path.join(source, "precision.csv"), ["bench/report.py precision"], cpu)
    write(os.path.join(source, "stress.csv"), ["bench/report.py --quick stress"], [{"case": "a"}])
    assert "--quick" in failure(report.merge, source, into)
    os.rename(os.path.join(source, "stress.csv"), os.path.join(source, "stresses.csv"))
    assert "no report has this name" in failure(report.merge, source, into)
    assert read(path) == before
    assert "no CSV file" in failure(report.merge, folder, into)


def test_tables():
    # the error falls below 1e-3 after 10, and rises again, to no number even: only from 30 on it stays below
    cpu = [precision_row("cpu", "f32", k, ms, error) for k, ms, error in
           ((10, 0.1, 5e-4), (20, "", "inf"), (25, 0.2, 2e-3), (30, 0.3, 5e-4))]
    cuda = [precision_row("cuda", "f64", k, ms, error) for k, ms, error in ((10, 0.4, 1e-4), (20, 0.5, 1e-9))]
    assert list(reports.soonest_of(cpu)) == [
        {"scene": "a", "by": "cpu", "1e-3": "f32 fast, 30: 0.3 ms", "1e-5": "-", "1e-8": "-"}]
    assert list(reports.soonest_of(cpu + cuda)) == [
        {"scene": "a", "by": "cpu", "1e-3": "**f32 fast, 30: 0.3 ms**", "1e-5": "-", "1e-8": "-"},
        {"scene": "a", "by": "cuda", "1e-3": "f64 fast, 10: 0.4 ms", "1e-5": "**f64 fast, 20: 0.5 ms**",
         "1e-8": "**f64 fast, 20: 0.5 ms**"}]

    def stress_row(backend, value, verdict):
        return {"case": "grip", "parameter": "mass ratio", "value": value, "backend": backend, "precision": "f32",
                "verdict": verdict}
    rows = [stress_row("cpu", "1", "pass"), stress_row("cpu", "1e+08", "FAIL"), stress_row("cpu", "100", "pass"),
            stress_row("cuda", "1", "limit")]
    assert list(reports.verdicts_of(rows)) == [{"case": "grip", "parameter": "mass ratio", "values": "1 to 1e+08",
                                                "cpu f32": "2 pass, 1 FAIL", "cuda f32": "1 limit"}]

    def ablation_row(backend, name, ms, times):
        return {"scene": "pile:300", "name": name, "what": "w", "backend": backend, "total_ms": ms, "times": times,
                "ncp_max": "1e-3"}
    rows = [ablation_row("cpu", "as it is", "2.5", "1"), ablation_row("ref", "literal form", "5", "2"),
            ablation_row("cuda", "as it is", "0.5", "1"), ablation_row("cuda", "half", "0.3", "0.6")]
    assert [(row["by"], row["name"], row["pile:300"]) for row in reports.times_and_errors_of(rows)] == [
        ("cpu", "as it is", "2.5 ms, 1e-03"), ("cpu", "literal form", "2.00, 1e-03"),
        ("cuda", "as it is", "0.5 ms, 1e-03"), ("cuda", "half", "0.60, 1e-03")]


class NoTools(reports.Tools):
    """Tools that need no commands."""

    def output(self, command):
        return "subadmm 1 (commit)\n"

    def device(self):
        return "a GPU"


def test_make(folder):
    """Three reports: one that is made, one that cannot be, one that fails after its first row."""
    def good(tools):
        yield {"scene": "a", "backend": tools.backend}

    def missing(tools):
        raise reports.Missing("no siconos")
        yield

    def broken(tools):
        yield {"scene": "a", "backend": tools.backend}
        raise reports.Failed("the time is over")

    known = dict(reports.REPORTS)
    columns = [("scene", "scene"), ("never", "of no row")]
    reports.REPORTS.update({name: reports.Report(rows, columns) for name, rows in
                            (("missing", missing), ("broken", broken), ("good", good))})
    try:
        def made(named, backend, into):
            said = io.StringIO()
            os.makedirs(into, exist_ok=True)
            with contextlib.redirect_stdout(said):
                failed = report.make(["missing", "broken", "good"], NoTools("b", backend=backend), into, named)
            return failed, said.getvalue().splitlines()

        into = os.path.join(folder, "made")
        failed, said = made(False, "cuda", into)
        assert failed == ["broken"], failed
        assert said[0] == "missing: left out: no siconos", said
        assert said[1] == "broken: FAILED: Failed: the time is over", said
        assert said[2].startswith("good: ") and said[2].endswith(" s") and said[3].startswith("together "), said
        assert made(True, "cuda", into)[0] == ["missing", "broken"]
        assert sorted(os.listdir(into)) == ["broken.csv", "good.csv", "tables.md"]
        notes, rows = report_files.read_csv(os.path.join(into, "broken.csv"))
        assert notes[0].startswith("cuda: a GPU; ") and notes[0].endswith("; bench/report.py --gpu broken (broken off)")
        assert rows == [{"scene": "a", "backend": "cuda"}]
        assert "| scene |\n|---|\n| a |" in read(os.path.join(into, "tables.md"))

        # in the folder of the documents, what is broken off leaves the file as it is
        documents, put = report.RESULTS, report.put_tables
        report.RESULTS, report.put_tables = os.path.join(folder, "results"), lambda: None
        try:
            os.makedirs(report.RESULTS)
            for name in ("missing", "broken", "good"):
                write(os.path.join(report.RESULTS, name + ".csv"), ["before"], [{"scene": "b", "backend": "cpu"}])
            made(False, "cpu", report.RESULTS)
            kept = [report_files.read_csv(os.path.join(report.RESULTS, name + ".csv"))[1][0]["scene"]
                    for name in ("missing", "broken", "good")]
            assert kept == ["b", "b", "a"], kept
        finally:
            report.RESULTS, report.put_tables = documents, put
    finally:
        reports.REPORTS.clear()
        reports.REPORTS.update(known)


def run(*words):
    return subprocess.run([sys.executable, os.path.join(PROJECT, "bench", "report.py"), *words], capture_output=True,
                          text=True, check=False)


def test_refused(folder):
    for words, said in (([], "which reports?"), (["nothing"], "no report 'nothing'"),
                        (["--all", "readme"], "--all: takes no names"), (["--all", "--gpu"], "--all: does not go with"),
                        (["--all", "--check"], "not allowed with"), (["--tables", "--quick"], "--tables: does not go"),
                        (["--merge", folder, "--gpu"], "--merge: does not go with"),
                        (["--gpu", "motion"], "--gpu: has rows of gpu, precision, ablation, stress"),
                        (["readme", "--out", folder], "--out: goes with"), (["--all", "--seconds", "9"], "--seconds:"),
                        (["--gpu", "--seconds", "0"], "--seconds 0:"), (["readme", "--repeats", "0"], "--repeats 0:")):
        done = run(*words)
        assert done.returncode == 2 and said in done.stderr, (words, done.returncode, done.stderr)
    for words, said in ((["--merge", folder], f"--merge {folder}: no CSV file"),
                        (["--all", "--build", folder], "subadmm: is not there; --build")):
        done = run(*words)
        assert done.returncode == 1 and said in done.stderr, (words, done.returncode, done.stderr)


def test_gpu(folder, subadmm, bench):
    """Every report that a GPU adds, shortened, and the folder of files that is merged elsewhere."""
    build, out = os.path.join(folder, "build"), os.path.join(folder, "gpu")
    for path, command in (("src/subadmm", subadmm), ("bench/subadmm-bench", bench)):
        os.makedirs(os.path.dirname(os.path.join(build, path)))
        os.symlink(os.path.abspath(command), os.path.join(build, path))
    done = run("--gpu", "--quick", "--build", build, "--out", out)
    assert done.returncode == 0, done.stdout + done.stderr
    names = [name for name, entry in reports.REPORTS.items() if entry.gpu]
    for name in names:
        notes, rows = report_files.read_csv(os.path.join(out, name + ".csv"))
        assert len(notes) == 1 and notes[0].startswith("cuda: ") and notes[0].endswith(f"--quick --gpu {name}"), notes
        assert {row["backend"] for row in rows} == {"cuda"}
        assert {row["precision"] for row in rows} == {"f32", "f64"}
        assert f"## {name}" in read(os.path.join(out, "tables.md"))
    done = run("--gpu", "stress", "--seconds", "1e-9", "--build", build, "--out", out)
    assert done.returncode == 1 and "the time is over" in done.stdout + done.stderr, done.stdout + done.stderr


def main():
    with tempfile.TemporaryDirectory() as folder:
        if len(sys.argv) > 2:
            test_gpu(folder, *sys.argv[2:])
            return
        os.makedirs(os.path.join(folder, "empty"))
        test_merge(folder)
        test_tables()
        test_make(folder)
        test_refused(os.path.join(folder, "empty"))


main()
