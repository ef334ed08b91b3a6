"""Compiles the project's files that include OpenVDB or NanoVDB against the headers of other versions of OpenVDB, without
generating code. It needs neither the libraries nor their dependencies.

Usage: openvdb_versions.py [--under FOLDER]... [--also FILE]... COMPILE_COMMANDS SOURCE_DIR [HEADERS...]

HEADERS is a source tree of OpenVDB or the prefix of an installation. A FILE that the database lacks is compiled like
another one. Exit status 77 means skipped, because there is no HEADERS."""

import argparse
import concurrent.futures
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

SKIPPED = 77
INCLUDE = re.compile(r'^\s*#\s*include\s*(?:"([^"]+)"|<((?:openvdb|nanovdb)/[^>]+)>)', re.MULTILINE)
# Settings of an ordinary build of OpenVDB.
ENABLED = {"OPENVDB_USE_IMATH_HALF", "OPENVDB_IMATH_VERSION", "OPENVDB_USE_BLOSC", "OPENVDB_USE_ZLIB", "OPENVDB_USE_DELAYED_LOADING",
           "OPENVDB_USE_EXPLICIT_INSTANTIATION"}
TREES = {
    "REAL": "Float Double",
    "NUMERIC": "Int32 Int64 Float Double",
    "VEC3": "Vec3S Vec3D Vec3I",
    "VOLUME": "Bool Int32 Int64 Float Double Vec3S Vec3D Vec3I",
    "ALL": "Mask points::PointData Bool Int32 Int64 Float Double Vec3S Vec3D Vec3I",
}


def version_header(tree):
    """Returns the text of version.h, which OpenVDB's build generates."""
    cmake = (tree / "CMakeLists.txt").read_text()
    part = {name: re.search(rf"set\(OpenVDB_{name}_VERSION (\d+)\)", cmake)[1] for name in ("MAJOR", "MINOR", "PATCH")}
    values = {f"OpenVDB_{name}_VERSION": number for name, number in part.items()}
    values["OPENVDB_ABI_VERSION_NUMBER"] = part["MAJOR"]
    values["OPENVDB_PACKED_VERSION"] = str(int(part["MAJOR"]) << 24 | int(part["MINOR"]) << 16 | int(part["PATCH"]))
    for name, trees in TREES.items():
        lines = [f"OPENVDB_INSTANTIATE Function({tree_name}Tree);" for tree_name in trees.split()]
        values[f"OPENVDB_{name}_TREE_INSTANTIATIONS"] = " \\\n    ".join(["", *lines])
    text = (tree / "openvdb/openvdb/version.h.in").read_text()
    text = re.sub(r"#cmakedefine (\w+)", lambda m: ("#define " if m[1] in ENABLED else "// no ") + m[1], text)
    return re.sub(r"\$\{(\w+)\}|@(\w+)@", lambda m: values.get(m[1] or m[2], ""), text)


def include_folders(tree, work):
    """Returns the folders with the headers of a source tree or an installation."""
    if (tree / "include/openvdb/version.h").exists():
        return [tree / "include"]
    if not (tree / "openvdb/openvdb/version.h.in").exists():
        sys.exit(f"openvdb_versions: {tree} is neither a source tree nor an installation of OpenVDB")
    generated = Path(work) / str(abs(hash(tree)))
    (generated / "openvdb").mkdir(parents=True)
    (generated / "openvdb/version.h").write_text(version_header(tree))
    return [generated, generated / "openvdb", tree / "openvdb", tree / "nanovdb"]


def version_of(folders):
    """Returns the version in version.h as text."""
    text = next(folder / "openvdb/version.h" for folder in folders if (folder / "openvdb/version.h").exists()).read_text()
    return re.search(r'LIBRARY_VERSION_STRING "([\d.]+)"', text)[1]


def includes_openvdb(file, roots, known):
    """Whether a file includes OpenVDB or NanoVDB, perhaps through other files of the project."""
    if file not in known:
        known[file] = False
        for quoted, _ in INCLUDE.findall(file.read_text()):
            found = next((p for p in (root / quoted for root in [file.parent, *roots]) if p.exists()), None)
            if not quoted or (found and includes_openvdb(found.resolve(), roots, known)):
                known[file] = True
                break
    return known[file]


def selected(commands, source, under, also):
    """Returns one entry of the compilation database per file to compile."""
    known = {}
    chosen = {}
    for entry in commands:
        file = Path(entry["file"]).resolve()
        if not any(file.is_relative_to(source / folder) for folder in under) or file.suffix != ".cpp":
            continue
        roots = [Path(word[2:]) for word in shlex.split(entry["command"]) if word.startswith("-I")]
        if includes_openvdb(file, roots, known):
            chosen.setdefault(file, entry)
    for name in also if chosen else ():
        like, entry = next(iter(chosen.items()))
        file = (source / name).resolve()
        chosen[file] = entry | {"command": entry["command"].replace(str(like), str(file))}
    return chosen


def command_with(entry, folders):
    """Returns the words of a compile command that only checks the file, with other headers."""
    words = shlex.split(entry["command"])
    out = words.index("-o")
    words = [word for word in words[:out] + words[out + 2:] if not word.startswith("-DOPENVDB_ABI_VERSION_NUMBER")]
    if os.path.basename(words[0]) == "ccache":
        words = words[1:]
    headers = [word for folder in folders for word in ("-isystem", str(folder))]
    return [words[0], *headers, *words[1:], "-fsyntax-only"]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("commands", type=Path)
    parser.add_argument("source", type=Path)
    parser.add_argument("--under", action="append")
    parser.add_argument("--also", action="append", default=[])
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("headers", type=Path, nargs="*")
    options = parser.parse_intermixed_args()
    if not options.headers:
        print("openvdb_versions: skipped: CUMULET_OPENVDB_HEADERS names no folders with headers of OpenVDB")
        sys.exit(SKIPPED)
    entries = selected(json.loads(options.commands.read_text()), options.source.resolve(),
                       options.under or ["src", "demo"], options.also)
    if not entries:
        sys.exit("openvdb_versions: no file includes OpenVDB")
    failed = 0
    with tempfile.TemporaryDirectory() as work, concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for tree in options.headers:
            folders = include_folders(tree.resolve(), work)

            def check(file):
                entry = entries[file]
                return file, subprocess.run(command_with(entry, folders), cwd=entry["directory"], text=True,
                                            stderr=subprocess.PIPE, check=False)

            for file, result in pool.map(check, sorted(entries)):
                good = result.returncode == 0
                failed += not good
                print(f"{version_of(folders)}: {file.relative_to(options.source.resolve())}: {'ok' if good else 'FAILED'}",
                      flush=True)
                if not good:
                    print(result.stderr, flush=True)
    print(f"openvdb_versions: {len(entries)} files, {len(options.headers)} versions, {failed} failures")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
