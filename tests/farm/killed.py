"""Kills a farm with kill -9 at random times: cumulet-farm, or a program that it runs. No frame is lost, truncated or
different, and no process survives.

Usage: killed.py PROGRAMS_FOLDER OUT_FOLDER RUNS
"""

import contextlib
import os
import pathlib
import random
import signal
import subprocess
import sys
import time

from common import Farm, empty, files, unfinished
from slurm_machine import tree_of

FRAMES = "11-13"
RANGES = [(0, 5), (5, 6)]
OPTIONS = ["--frames", FRAMES, "--samples", "11", "--parts", "2", "--processes", "2", "--wait", "0", "--attempts", "5",
           "--checkpoint-every", "0.05"]


def check(made, wanted, parts):
    """Checks that all files with final names are complete."""
    for name, content in files(made).items():
        assert content == wanted[name], f"{name} is torn"
    for name, content in files(made / "p.farm" / "parts").items():
        assert content == parts[name], f"{name} is torn"


def main():
    programs, out, runs = sys.argv[1], empty(pathlib.Path(sys.argv[2])), int(sys.argv[3])
    farm = Farm(programs, out, ["--size", "32x24"])
    wanted = farm.merged(out / "wanted", FRAMES, RANGES)
    parts = {f"{number}.part{k}.exr": content for name, content in files(out / "wanted" / "parts").items()
             for number, k, _ in [name.split(".")]}
    began = time.monotonic()
    assert farm.do("run", empty(out / "first"), *OPTIONS).returncode == 0
    length = time.monotonic() - began
    assert files(out / "first") == wanted
    dice = random.Random(13)
    made = empty(out / "made")
    hit = {"farm": 0, "task": 0, "ended": 0}
    done = 0
    for run in range(runs):
        if done == len(wanted) or run % 4 == 0:
            made = empty(out / "made")
        process = subprocess.Popen(farm.command("run", made, *OPTIONS), stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                   text=True)
        time.sleep(dice.uniform(0.0, 0.8 * length))
        below = tree_of(process.pid)[1:]
        if process.poll() is not None:
            hit["ended"] += 1
        elif below and dice.random() < 0.5:
            with contextlib.suppress(ProcessLookupError):
                os.kill(dice.choice(below), signal.SIGKILL)
            hit["task"] += 1
        else:
            process.kill()
            hit["farm"] += 1
        if process.poll() is None and hit["farm"] + hit["task"] > 0 and dice.random() < 0.5:
            process.kill()  # and all other processes soon after
        text, _ = process.communicate(timeout=300)
        assert process.returncode in (0, -signal.SIGKILL), (process.returncode, text)
        end = time.monotonic() + 60
        while any(os.path.exists(f"/proc/{each}/exe") and is_ours(each, farm) for each in below):
            assert time.monotonic() < end, "a task goes on without the farm"
            time.sleep(0.02)
        check(made, wanted, parts)
        done = len(files(made))
    last = farm.do("run", made, *OPTIONS)
    assert last.returncode == 0, last
    assert files(made) == wanted and not files(made / "p.farm" / "parts") and not unfinished(made)
    print(f"{runs} runs: {hit}")
    assert runs < 10 or min(hit["farm"], hit["task"]) > 0


def is_ours(process, farm):
    with contextlib.suppress(OSError):
        return os.readlink(f"/proc/{process}/exe").startswith(str(farm.programs.resolve()))
    return False


main()
