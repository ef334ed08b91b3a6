"""Selects from a fuzzer's corpus the inputs with the most coverage per byte, up to a total size in bytes.

Usage: corpus.py FUZZER CORPUS BYTES OUT_FOLDER
"""

import os
import pathlib
import subprocess
import sys
import tempfile


def features(fuzzer, corpus):
    """Returns each input's coverage features, from libFuzzer's merge."""
    with tempfile.TemporaryDirectory() as folder:
        control, merged = pathlib.Path(folder) / "control", pathlib.Path(folder) / "merged"
        merged.mkdir()
        # The options of fuzz.sh: a failed large allocation is not an error.
        environment = dict(os.environ, ASAN_OPTIONS="detect_leaks=0:detect_odr_violation=0:alloc_dealloc_mismatch=0:"
                                                    "allocator_may_return_null=1")
        subprocess.run([fuzzer, "-merge=1", f"-merge_control_file={control}", merged, corpus], check=True, cwd=folder,
                       env=environment, stderr=subprocess.DEVNULL)
        lines = control.read_text().splitlines()
    files = lines[2:2 + int(lines[0])]
    reached = {}
    for line in lines:
        if line.startswith("FT "):
            _, index, *found = line.split()
            reached[pathlib.Path(files[int(index)])] = set(map(int, found))
    return reached


def main():
    fuzzer, corpus, room, out = *map(os.path.abspath, sys.argv[1:3]), int(sys.argv[3]), pathlib.Path(sys.argv[4])
    reached = features(fuzzer, corpus)
    known = set()
    out.mkdir(parents=True, exist_ok=True)
    while fits := {path: found - known for path, found in reached.items() if path.stat().st_size <= room}:
        best = max(sorted(fits), key=lambda path: len(fits[path]) / (512 + path.stat().st_size))
        if not fits[best]:
            break
        known |= fits[best]
        room -= best.stat().st_size
        del reached[best]
        (out / best.name).write_bytes(best.read_bytes())


main()
