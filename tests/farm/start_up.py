"""Measures the overhead of a farm task: time to the first sample, bytes read from and written to a shared folder, and
operations on that folder's server (open, stat, rename, ...). docs/farm.md has the numbers and conclusions.

Usage: start_up.py PROGRAMS_FOLDER VOLUMES_FOLDER OUT_FOLDER [--check]. VOLUMES_FOLDER is of cumulet-scene --only
explosion.
--check: fails if a task needs more operations on the shared folder than docs/farm.md says. 77: strace does not run
here.
"""

import collections
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import time

from common import empty

LOOK = ["--size", "320x240", "--spp", "1"]
METADATA = {"open", "openat", "stat", "lstat", "newfstatat", "statx", "access", "faccessat", "faccessat2", "readlink",
            "readlinkat", "rename", "renameat", "renameat2", "unlink", "unlinkat", "mkdir", "mkdirat", "getdents64"}


class Costs:
    def __init__(self, text, roots):
        """Parses strace's output and counts the operations below one of the folders."""
        self.calls, self.missed = collections.Counter(), 0
        self.read, self.written = collections.Counter(), 0
        for line in text.splitlines():
            match = re.match(r"\d+ +(\w+)\((.*)", line)
            if not match:
                continue
            name, rest = match.groups()
            descriptor = re.match(r"\d+<([^>]*)>", rest)
            path = re.search(r'"([^"]*)"', rest)
            result = re.search(r"= (-?\d+)", rest)
            of = path[1] if path and path[1] else descriptor[1] if descriptor else ""
            if not any(of.startswith(f"{root}/") for root in roots) or not result:
                continue
            if name in METADATA:
                self.calls[name] += 1
                self.missed += "ENOENT" in rest
            elif "read" in name and descriptor:
                self.read[pathlib.Path(of).suffix] += int(result[1])
            elif "write" in name and descriptor:
                self.written += int(result[1])

    def asked(self):
        return sum(self.calls.values())


def traced(command, log):
    """Returns strace's output, or None if tracing is not permitted."""
    done = subprocess.run(["strace", "-f", "-y", "-s", "0", "-o", log, "-e", "trace=%file,%desc", *command],
                          capture_output=True, text=True, timeout=600)
    return log.read_text(errors="replace") if done.returncode == 0 else None


def timeline(command, out):
    """Returns (what, begin, length) of the trace and the whole run time, in milliseconds since exec."""
    began = time.monotonic()
    subprocess.run([*command, "--trace", out / "trace.json"], check=True, capture_output=True, timeout=600)
    whole = time.monotonic() - began
    events = json.loads((out / "trace.json").read_text())
    events = events if isinstance(events, list) else events["traceEvents"]
    spans = [(e["name"], e["ts"] / 1000 - began * 1000, e["dur"] / 1000) for e in events if e.get("ph") == "X"]
    return spans, whole * 1000


def times(title, command, out, environment):
    os.environ.update(environment)
    rows = collections.defaultdict(list)
    for _ in range(5):
        spans, whole = timeline(command, out)
        ready = max(begin + length for name, begin, length in spans if "warm-up" in name)
        first = min(begin for name, begin, _ in spans if name == "frame" and begin >= ready)
        rows["to the first event"].append(min(begin for _, begin, _ in spans))
        rows["to the first sample"].append(first)
        rows["the whole run"].append(whole)
        before = collections.Counter()
        for name, begin, length in spans:
            if begin < first:
                before["reading volumes" if name.endswith(".vdb") else name] += length
        for name, length in before.items():
            rows["of it, " + name].append(length)
    for name in environment:
        del os.environ[name]
    print(title)
    for name, values in rows.items():
        print(f"  {name}: {statistics.median(values):.0f} ms")


def main():
    programs, volumes, out = sys.argv[1], pathlib.Path(sys.argv[2]).resolve(), empty(pathlib.Path(sys.argv[3]).resolve())
    check = "--check" in sys.argv
    render = [f"{programs}/cumulet-render", volumes / "explosion_####.vdb", *LOOK]
    cached = ["--shader-cache", out / "shaders"]
    picture = ["--frames", "12", "--overwrite", "-o", out / "p.####.exr"]
    settled = ["--sequence-cache", out / "settled"]
    subprocess.run([*render, *cached, *settled, *picture], check=True, capture_output=True, timeout=600)
    if not check:
        times("shaders compiled anew", [*render, *picture], out, {"MESA_SHADER_CACHE_DISABLE": "true"})
        times("--shader-cache", [*render, *cached, *picture], out, {})
        times("--shader-cache, --sequence-cache", [*render, *cached, *settled, *picture], out, {})
    roots = [str(volumes), str(out)]
    costs = {}
    for name, more in {"a frame": [*picture], "a frame, settled": [*settled, *picture],
                       "two frames, settled": [*settled, "--frames", "12,13", *picture[2:]],
                       "a part, settled": [*settled, "--first-sample", "4", "--checkpoint", out / "####.ck", *picture]}.items():
        text = traced([*render, *cached, *more], out / "strace.txt")
        if text is None:
            print("start_up: skipped: strace may not look here")
            sys.exit(77)
        cost = costs[name] = Costs(text, roots)
        print(f"{name}: {cost.asked()} calls {dict(cost.calls)}, {cost.missed} of names that are not there;"
              f" read {dict(cost.read)}, written {cost.written}")
    libraries = Costs(text, [str(pathlib.Path(programs).resolve().parent)])
    print(f"the folder of the programs: {libraries.asked()} calls, {libraries.missed} of names that are not there")
    sizes = [(volumes / f"explosion_{n:04}.vdb").stat().st_size for n in (12, 13, 20)]
    print(f"volumes of frames 12, 13, 20: {sizes} bytes")
    if check:
        assert costs["a frame, settled"].asked() <= 60 and costs["a part, settled"].asked() <= 80, costs
        assert costs["two frames, settled"].asked() - costs["a frame, settled"].asked() <= 30, costs
        # A task reads its own volume and, for the settings of the sequence, the largest one. It reads each once, except
        # for seeks that read a buffer again.
        again = 2**20
        assert costs["a frame, settled"].read[".vdb"] <= 1.2 * sizes[0] + again, costs["a frame, settled"].read
        assert costs["a frame"].read[".vdb"] <= 1.2 * (sizes[0] + sizes[2]) + 3 * again, costs["a frame"].read
        assert costs["two frames, settled"].read[".vdb"] <= 1.2 * (sizes[0] + sizes[1]) + 2 * again, costs

main()
