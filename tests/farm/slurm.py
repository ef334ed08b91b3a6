"""cumulet-farm submit on a Slurm of this machine: frames in parts, with a process and then a node killed in the middle.

Usage: slurm.py PROGRAMS_FOLDER OUT_FOLDER. 77: no Slurm here.
"""

import os
import pathlib
import re
import shutil
import signal
import sys
import tempfile
import time

import slurm_machine
from common import Farm, empty, files, unfinished

SAMPLES = 600
PARTS = [(0, 300), (300, 300)]


def renders(slurm, node):
    """Returns the processes of cumulet-render that run on this node."""
    found = []
    for step in slurm.steps(node):
        found += [p for p in slurm_machine.tree_of(step) if slurm_machine.command_of(p)[0].endswith(b"cumulet-render")]
    return found


def drained(slurm):
    """Returns whether the queue is empty. Starts requeued jobs without their delay of two minutes."""
    rows = [line.split("|") for line in slurm.ask("squeue", "-h", "-r", "-o", "%i|%T|%r").stdout.splitlines()]
    for job, state, reason in rows:
        if state == "PENDING" and reason == "BeginTime":
            slurm.ask("scontrol", "update", f"JobId={job}", "StartTime=now")
    return not rows


def at_work(slurm, node):
    """Returns a process of cumulet-render on this node that has written a checkpoint."""
    for process in renders(slurm, node):
        words = slurm_machine.command_of(process)
        frame = words[words.index(b"--frames") + 1].decode().zfill(4)
        checkpoint = words[words.index(b"--checkpoint") + 1].decode()
        if os.path.exists(checkpoint.replace("####", frame)):
            return process
    return None


def wait_for_work(slurm, node):
    found = []

    def is_there():
        process = at_work(slurm, node)
        if process is not None:
            found.append(process)
        return bool(found)

    slurm.wait(f"a checkpoint of {node}", is_there)
    return found[0]


def killed(farm, slurm, out):
    """Kills a process, then a node with its processes. No part is lost or made twice, and the frames are the same."""
    whole = farm.whole(out / "whole", "12-15", SAMPLES)
    wanted = farm.merged(out / "wanted", "12-15", PARTS)
    assert len(wanted) == 4 and len(set(wanted.values())) == 4
    made = empty(out / "made")
    options = ["--frames", "12-15", "--samples", str(SAMPLES), "--parts", "2", "--checkpoint-every", "0.1", "--wait", "0"]
    done = farm.do("submit", made, *options)
    assert done.returncode == 0 and "12 of 12 tasks submitted" in done.stdout, done
    again = farm.do("submit", made, *options)
    assert again.returncode == 1 and "still contains arrays" in again.stderr and again.stderr.count("\n") == 1, again

    os.kill(wait_for_work(slurm, "node1"), signal.SIGKILL)
    wait_for_work(slurm, "node0")
    assert slurm.kill_node("node0") == 1
    slurm.wait("node0 is missed", lambda: slurm.states()["node0"].startswith("down"), 180)
    slurm.wait("the other node makes all", lambda: drained(slurm), 600)
    slurm.start_node("node0")

    logs = {path.name: path.read_text() for path in (made / "p.farm" / "logs").iterdir()}
    text = "\n".join(logs.values())
    assert files(made) == wanted, text
    for name in wanted:
        farm.equal_but_for_rounding(made / name, out / "whole" / name)
    # Each part ran once. Two were restarted and continued from their checkpoints.
    assert len(logs) == 12, sorted(logs)
    rendered = re.findall(r"^frame (\d+) \(1 of 1\) (\w+) (\S+)", text, re.MULTILINE)
    assert len(rendered) == 8 and all(state == "done" for _, state, _ in rendered), rendered
    assert len({file for _, _, file in rendered}) == 8, rendered
    assert len(re.findall(r"^task \S+ done", text, re.MULTILINE)) == 12, text
    assert len(re.findall(r"^task \S+ started", text, re.MULTILINE)) == 14, text
    assert text.count("killed by SIGKILL") == 1 and text.count("resuming from") == 2, text
    # The parts' files and the files of killed processes are deleted.
    assert not unfinished(made) and not files(made / "p.farm" / "parts") and not list(made.rglob("*.ck"))
    assert farm.do("status", made, arguments=False).returncode == 0
    last = farm.do("submit", made, *options)
    assert last.returncode == 0 and "all 12 tasks are done" in last.stdout, last


def failed(farm, slurm, out):
    """A frame whose volume is missing is tried again and reported, and does not stop others. After the repair, only
    that frame is made."""
    made = empty(out / "failed")
    options = ["--frames", "11,99", "--samples", "4", "--parts", "2", "--attempts", "2", "--wait", "0"]
    slurm.wait("node0 is back", lambda: slurm.states()["node0"] == "idle")
    done = farm.do("submit", made, *options)
    assert done.returncode == 0, done
    slurm.wait("the queue", lambda: drained(slurm), 300)
    assert sorted(files(made)) == ["p.0011.exr"]
    status = farm.do("status", made, arguments=False)
    assert status.returncode == 1 and "merge: 1 of 2 done; not frames 99" in status.stdout, status
    text = "\n".join(path.read_text() for path in (made / "p.farm" / "logs").iterdir())
    assert len(re.findall(r"frame 99 \(1 of 1\) failed .*explosion_0099\.vdb", text)) == 4, text
    assert text.count("failed: exit status 1, attempt 2 of 2") == 2, text
    before = files(made)
    missing = farm.volumes / "explosion_0099.vdb"
    shutil.copy(farm.volumes / "explosion_0012.vdb", missing)
    done = farm.do("submit", made, "--job", str(made / "p.farm"), arguments=False)
    assert done.returncode == 0 and "3 of 6 tasks" in done.stdout, done
    slurm.wait("the queue", lambda: drained(slurm), 300)
    missing.unlink()
    after = files(made)
    assert sorted(after) == ["p.0011.exr", "p.0099.exr"] and after["p.0011.exr"] == before["p.0011.exr"]


def split(farm, slurm, out):
    """More frames than an array can hold, several frames per task, one part. A wrong command is not tried again."""
    made = empty(out / "split")
    done = farm.do("submit", made, "--frames", "3-19x2", "--samples", "2", "--frames-per-task", "2", "--limit", "1",
                   "--sbatch=--nice=5")
    assert done.returncode == 0 and "5 of 5 tasks" in done.stdout and done.stdout.count("(render)") == 2, done
    slurm.wait("the queue", lambda: drained(slurm), 300)
    assert files(made) == farm.whole(out / "split_wanted", "3-19x2", 2)
    wrong = empty(out / "wrong")
    farm.look = [*farm.look, "--no-such-flag"]
    assert farm.do("submit", wrong, "--frames", "12").returncode == 0
    farm.look.pop()
    slurm.wait("the queue", lambda: drained(slurm), 300)
    log = next((wrong / "p.farm" / "logs").iterdir()).read_text()
    assert log.count(" started, attempt ") == 1 and "exit status 2" in log, log


def main():
    programs, out = sys.argv[1], pathlib.Path(sys.argv[2])
    missing = slurm_machine.missing_programs()
    if missing:
        print(f"slurm: skipped: it needs {', '.join(missing)} (scripts/packages.txt)")
        sys.exit(77)
    empty(out)
    farm = Farm(programs, out, ["--size", "64x48"])
    # A short name, because the paths of sockets have a length limit.
    with tempfile.TemporaryDirectory(prefix="slurm-", ignore_cleanup_errors=True) as folder:
        with slurm_machine.SlurmMachine(folder, nodes=2, max_array=4, node_timeout=20) as slurm:
            farm.environment = slurm.environment
            for part in (killed, failed, split):
                began = time.monotonic()
                try:
                    part(farm, slurm, out)
                except BaseException:
                    print(slurm.logs())
                    print(slurm.ask("squeue").stdout)
                    raise
                print(f"{part.__name__}: {time.monotonic() - began:.0f} s", flush=True)


main()
