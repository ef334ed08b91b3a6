"""cumulet-farm on this machine: job descriptions, runs, kept files, retries and refused arguments.

Usage: local.py PROGRAMS_FOLDER OUT_FOLDER
"""

import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time

from common import Farm, empty, files, unfinished

LINE = re.compile(r"task (\S+) \((\d+) of (\d+)\) (done in [\d.]+ s|kept|failed: .+)")


def lines(text):
    matches = [LINE.fullmatch(line) for line in text.splitlines() if " is retried: " not in line]
    assert all(matches), text
    assert [int(m[2]) for m in matches] == list(range(1, len(matches) + 1)), text
    return {m[1]: m[4].split()[0].rstrip(":") for m in matches}


def parts(farm, out):
    """The merged parts equal cumulet-merge's result of the same parts and, except for rounding, the image of one
    process. A second run keeps all."""
    whole = farm.whole(out / "whole", "12,14", 7)
    wanted = farm.merged(out / "wanted", "12,14", [(0, 2), (2, 2), (4, 3)])
    made = empty(out / "parts")
    options = ["--frames", "12,14", "--samples", "7", "--parts", "3", "--processes", "2"]
    done = farm.do("run", made, *options)
    assert done.returncode == 0 and set(lines(done.stdout).values()) == {"done"}, done
    assert len(lines(done.stdout)) == 8 and files(made) == wanted
    for name in whole:
        farm.equal_but_for_rounding(made / name, out / "whole" / name)
    assert not files(made / "p.farm" / "parts") and not unfinished(made)
    # Nothing runs twice, not even the parts of existing frames. A deleted frame is made again, but only from its own
    # parts.
    done = farm.do("run", made, *options)
    assert done.returncode == 0 and set(lines(done.stdout).values()) == {"kept"}, done
    (made / "p.0014.exr").unlink()
    done = farm.do("run", made, "--processes", "2", arguments=False)
    states = lines(done.stdout)
    assert done.returncode == 0 and {name for name, state in states.items() if state == "done"} == {
        "part0.1", "part1.1", "part2.1", "merge.1"}, done
    assert files(made) == wanted
    # Adding frames to a job is allowed. Other sample counts are refused, unless --overwrite restarts the job.
    done = farm.do("describe", made, *[{"12,14": "12,14,16"}.get(word, word) for word in options])
    assert done.returncode == 0 and "12 tasks" in done.stdout, done
    other = [{"7": "9"}.get(word, word) for word in options]
    done = farm.do("run", made, *other)
    assert done.returncode == 1 and "with other commands" in done.stderr and done.stderr.count("\n") == 1, done
    assert files(made) == wanted
    done = farm.do("run", made, *other, "--overwrite", "--keep-parts")
    assert done.returncode == 0 and set(lines(done.stdout).values()) == {"done"} and files(made) != wanted, done
    assert len(files(made / "p.farm" / "parts")) == 6


def described(farm, out):
    """Another queue can make the same images from the job description and docs/farm.md only. This one uses just the
    argument lists, their dependencies and their output files."""
    wanted = farm.merged(out / "wanted", "12,14", [(0, 2), (2, 2), (4, 3)])
    made = empty(out / "described")
    done = farm.do("describe", made, "--frames", "12,14", "--samples", "7", "--parts", "3", "--cpus", "2", "--memory", "900",
                   "--minutes", "5")
    assert done.returncode == 0 and not files(made), done
    job = json.loads((made / "p.farm" / "job.json").read_text())
    assert (job["format"], job["version"]) == ("cumulet-farm", 1)
    assert job["resources"] == {"cpus": 2, "memory_mb": 900, "minutes": 5}
    assert job["retry"] == {"attempts": 3, "wait_seconds": 5.0, "permanent_statuses": [2]}
    done_tasks = set()
    for task in job["tasks"]:
        assert set(task["depends_on"]) <= done_tasks
        for name in task["inputs"]:
            assert os.path.isfile(os.path.join(job["folder"], name)), name
        for command in task["commands"]:
            subprocess.run(command, cwd=job["folder"], check=True, timeout=300, capture_output=True)
        for name in task["outputs"]:
            assert os.path.getsize(os.path.join(job["folder"], name)) > 0
        done_tasks.add(task["id"])
    assert list((made / "p.farm" / "shaders").iterdir())  # shortens later starts
    volumes = {os.path.basename(name) for task in job["tasks"] if task["layer"] == "part0" for name in task["inputs"]}
    assert volumes == {"explosion_0012.vdb", "explosion_0014.vdb"}, volumes
    assert files(made) == wanted
    assert farm.do("status", made, arguments=False).returncode == 0


def scene_files(farm, out):
    """A single image, without a frame number, of a scene file. The job lists the files that the scene names."""
    folder = empty(out / "scene")
    scene = folder / "one.json"
    scene.write_text(json.dumps({"cumulet_scene": 1, "volume": {"file": "../volumes/explosion_0012.vdb"}}))
    look = ["--scene", str(scene), *farm.look]
    command = [str(farm.programs / "cumulet-farm"), "run", "--samples", "6", "--parts", "2", "-o", str(folder / "one.exr")]
    done = subprocess.run([*command, "--", *look], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and (folder / "one.farm" / "job.json").exists(), done
    job = json.loads((folder / "one.farm" / "job.json").read_text())
    named = {os.path.basename(name) for name in job["tasks"][0]["inputs"]}
    assert named == {"one.json", "explosion_0012.vdb"}, named
    subprocess.run([farm.render, *look, "--spp", "6", "-o", folder / "whole.exr"], check=True, timeout=300,
                   capture_output=True)
    farm.equal_but_for_rounding(folder / "one.exr", folder / "whole.exr")


def failing(farm, out):
    """A failing task is tried as often as requested and reported, and does not stop other frames. Tasks that depend on
    it do not start."""
    made = empty(out / "failing")
    options = ["--frames", "98,12", "--samples", "4", "--parts", "2", "--attempts", "2", "--wait", "0"]
    done = farm.do("run", made, *options)
    states = lines(done.stdout)
    assert done.returncode == 1 and done.stderr.count("\n") == 1 and "3 of 6 tasks failed" in done.stderr, done
    assert {name for name, state in states.items() if state == "failed"} == {"part0.0", "part1.0", "merge.0"}, done
    assert done.stdout.count("is retried: exit status 1, attempt 1 of 2") == 2, done
    assert sorted(files(made)) == ["p.0012.exr"]
    log = (made / "p.farm" / "logs" / "part0.0.log").read_text()
    assert log.count(" started, attempt ") == 2 and "explosion_0098.vdb" in log, log
    status = farm.do("status", made, arguments=False)
    assert status.returncode == 1 and "merge: 1 of 2 done; not frames 98" in status.stdout, status
    # A wrong command is not tried again, because it would always fail.
    wrong = empty(out / "wrong")
    farm.look = [*farm.look, "--no-such-flag"]
    done = farm.do("run", wrong, "--frames", "12", "--wait", "0")
    farm.look.pop()
    assert done.returncode == 1 and "attempt 1 of 3" in done.stdout and "retried" not in done.stdout, done


def stopped(farm, out):
    """After SIGTERM, the finished samples are kept, no process survives, and the same command continues from there."""
    wanted = farm.whole(out / "stopped_wanted", "12", 2000)
    made = empty(out / "stopped")
    command = farm.command("run", made, "--frames", "12", "--samples", "2000", "--checkpoint-every", "0.1")
    checkpoint = made / "p.farm" / "parts" / "0" / "0012.render.ck"
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    end = time.monotonic() + 120
    while not checkpoint.exists():
        assert process.poll() is None and time.monotonic() < end
        time.sleep(0.01)
    log = made / "p.farm" / "logs" / "render.0.log"
    (made / "p.0012.exr").write_bytes(b"of a live job")
    for words in (["run"], ["submit"], ["run", "--overwrite"], ["describe", "--overwrite"]):
        second = farm.do(words[0], made, *(["--frames", "12", *words[1:]] if words[1:] else []), arguments=bool(words[1:]))
        assert second.returncode == 1 and "another process is running this job" in second.stderr, second
        assert checkpoint.exists() and log.exists() and (made / "p.0012.exr").exists(), words
    (made / "p.0012.exr").unlink()
    process.send_signal(signal.SIGTERM)
    _, error = process.communicate(timeout=60)
    assert process.returncode == 1 and "interrupted: 1 of 1 tasks not done" in error, error
    assert not files(made) and checkpoint.exists()
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done
    assert "resuming from" in log.read_text()
    assert files(made) == wanted and not checkpoint.exists()


def apart(farm, out):
    """Images with other names, kept settings of other volumes, and jobs that are still in a queue."""
    made = empty(out / "apart")
    folder = made / "p.farm"
    done = farm.do("run", made, "--frames", "12", "--samples", "2")
    assert done.returncode == 0 and (folder / "settled").exists(), done
    # The same names in another notation are accepted; other names in the same folder are refused.
    command = [str(farm.programs / "cumulet-farm"), "describe", "--samples", "2", "--frames"]
    for name, frame, status in (("p.%04d.exr", "14", 0), ("p.####.png", "12", 1), ("p_####.exr", "12", 1)):
        done = subprocess.run([*command, frame, "-o", str(made / name), "--", *farm.arguments()], capture_output=True, text=True,
                              timeout=60)
        assert done.returncode == status and done.stderr.count("\n") == status, done
        assert status == 0 or f"has the output {made / 'p.%04d.exr'}" in done.stderr, done
    assert "p.%04d.exr" in (folder / "job.json").read_text()
    # Slurm's answer decides. If Slurm cannot be reached, the job may still be running.
    tools = empty(out / "tools")
    environment = {**os.environ, "PATH": f"{tools}:{os.environ['PATH']}"}
    def answered(script, *more):
        (tools / "squeue").write_text(f"#!/bin/sh\n{script}\n")
        (tools / "squeue").chmod(0o755)
        (folder / "slurm.json").write_text(json.dumps({"arrays": [{"id": "7", "layer": "render", "first": 0}]}))
        return subprocess.run(farm.command("describe", made, "--frames", "12", "--samples", "2", *more), capture_output=True,
                              text=True, timeout=60, env=environment)
    assert answered("echo 'slurm_load_jobs error: Invalid job id specified' >&2; exit 1").returncode == 0
    assert answered("exit 0").returncode == 0
    for script, told in (("echo 7", "still contains arrays"),
                         ("echo 'Unable to contact slurm controller' >&2; exit 1", "Unable to contact")):
        done = answered(script, "--overwrite")
        assert done.returncode == 1 and told in done.stderr and done.stderr.count("\n") == 1, done
        assert (made / "p.0012.exr").exists() and (folder / "settled").exists()
    done = answered("exit 0", "--overwrite")
    assert done.returncode == 0 and not (made / "p.0012.exr").exists(), done
    assert not (folder / "settled").exists() and not (folder / "slurm.json").exists() and (folder / "shaders").exists()
    # The user's own files for the flags, as one word or two.
    for words in ([f"--sequence-cache={made / 'mine'}", f"--shader-cache={made / 'own'}"],
                  ["--settled", str(made / "mine"), "--shader-cache", str(made / "own")]):
        done = subprocess.run([*farm.command("describe", made, "--frames", "12", "--overwrite"), *words],
                              capture_output=True, text=True, timeout=60)
        text = (folder / "job.json").read_text()
        assert done.returncode == 0 and str(folder / "settled") not in text and str(folder / "shaders") not in text, text


def sent_again(farm, out):
    """A preempted task continues even if its attempts are few, but at most 100 times."""
    made = empty(out / "sent_again")
    assert farm.do("describe", made, "--frames", "12", "--samples", "2", "--attempts", "2").returncode == 0
    command = farm.command("work", made, "--task", "render.0", arguments=False)
    for times, status in ((100, 1), (99, 0)):
        done = subprocess.run(command, capture_output=True, text=True, timeout=300,
                              env={**os.environ, "SLURM_RESTART_COUNT": str(times)})
        assert done.returncode == status and ("requeued 100 times" in done.stderr) == (status == 1), done


def slurm_flags(farm, out):
    """Checks the arguments of sbatch with a script that records them. A % in a folder's name is escaped, because it is
    a pattern for Slurm."""
    made = empty(out / "50% %A")
    tools = empty(out / "tools")
    for name, script in (("scontrol", "echo 'MaxArraySize = 1001'"),
                         ("sbatch", f"printf '%s\\n' \"$@\" > '{tools}/flags'; cat > /dev/null; echo 7")):
        (tools / name).write_text(f"#!/bin/sh\n{script}\n")
        (tools / name).chmod(0o755)
    done = subprocess.run(farm.command("submit", made, "--frames", "12", "--samples", "2"), capture_output=True, text=True,
                          timeout=60, env={**os.environ, "PATH": f"{tools}:{os.environ['PATH']}"})
    assert done.returncode == 0, done
    flags = (tools / "flags").read_text().splitlines()
    assert f"--output={out}/50%% %%A/p.farm/logs/slurm-%A_%a.out" in flags, flags


def refused(farm, out):
    """Wrong arguments are refused with one line before any file is written."""
    made = out / "refused"
    wrong = (["--frames", "9-1"], ["--frames", "a"], ["--frames", "1-4", "--parts", "2"], ["--parts", "0"],
             ["--frames", "1", "--samples", "1", "--parts", "2"], ["--nothing"], ["--frames", "1", "--samples", "x"], [])
    for options in wrong:
        done = farm.do("run", made, *options)
        assert done.returncode == 2 and done.stderr.count("\n") == 1 and done.stdout == "", (options, done)
    program = str(farm.programs / "cumulet-farm")
    for words in (["run"], ["fly"], [], ["run", "-o", "p.png", "--frames", "1", "--samples", "4", "--parts", "2", "--", "a.vdb"],
                  ["run", "-o", "p.##.##.exr", "--frames", "1", "--", "a.vdb"],
                  ["run", "-o", "p.exr", "--frames", "1-2", "--", "a.vdb"], ["run", "-o", "p.exr", "--"],
                  ["run", "-o", "p.exr", "--", "a.vdb", "--spp", "4"], ["run", "-o", "p.exr", "--", "a.vdb", "-o", "b.exr"],
                  ["run", "-o", "p.exr", "--samples", "4", "--parts", "2", "--", "a.vdb", "--noise-target=2"],
                  ["work", "-o", "p.exr"], ["status", "-o", "p.exr", "--", "a.vdb"]):
        done = subprocess.run([program, *words], capture_output=True, text=True, timeout=60, cwd=out)
        assert done.returncode == 2 and done.stderr.count("\n") == 1 and done.stdout == "", (words, done)
    assert not made.exists() and not list(out.glob("*.farm"))
    # Job descriptions that are invalid.
    folder = empty(out / "bad.farm")
    good = {"format": "cumulet-farm", "version": 1, "name": "x", "folder": str(out), "layers": ["a"],
            "retry": {"attempts": 1, "wait_seconds": 0, "permanent_statuses": []}, "resources": {}, "tasks": []}
    task = {"id": "a.0", "layer": "a", "index": 0, "frames": [], "commands": [], "inputs": [], "outputs": ["x"], "scratch": [],
            "depends_on": [], "intermediate": False}
    for text in ("", "[]", "{}", json.dumps({**good, "version": 2}), json.dumps({**good, "tasks": [{"id": "a"}]}),
                 json.dumps({**good, "tasks": [{**task, "depends_on": ["a.0"]}]}),
                 json.dumps({**good, "tasks": [task, task]}), json.dumps({**good, "tasks": [{**task, "commands": "rm"}]}),
                 json.dumps({**good, "tasks": [{**task, "layer": "b"}]})):
        (folder / "job.json").write_text(text)
        done = subprocess.run([program, "run", "--job", str(folder)], capture_output=True, text=True, timeout=60)
        assert done.returncode == 1 and done.stderr.count("\n") == 1 and "bad.farm/job.json" in done.stderr, (text, done)
    # Commands that succeed without writing their output, or that write an empty file, fail.
    for command in (["true"], ["touch", "x"]):
        (folder / "job.json").write_text(json.dumps({**good, "tasks": [{**task, "commands": [command]}]}))
        done = subprocess.run([program, "run", "--job", str(folder)], capture_output=True, text=True, timeout=60)
        assert done.returncode == 1 and "x was not created" in done.stdout, done


def negative(farm, out):
    """Negative frame numbers are tasks like others, with either way of padding."""
    for style, name in (("c", "{:04d}".format), ("b", lambda n: f"-{-n:04d}" if n < 0 else f"{n:04d}")):
        there = empty(out / f"negative_{style}")
        for n in range(-2, 2):
            shutil.copy(farm.volumes / f"explosion_{13 + n:04}.vdb", there / f"n.{name(n)}.vdb")
        made = empty(out / f"negative_{style}_made")
        command = lambda action, *options: [str(farm.programs / "cumulet-farm"), action, "-o", str(made / "p.####.exr"), *options,
                                            "--", str(there / "n.####.vdb"), *farm.look]
        described = command("describe", "--frames", "-2-1", "--frames-per-task", "2", "--samples", "2")
        done = subprocess.run(described, capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done
        tasks = json.loads((made / "p.farm" / "job.json").read_text())["tasks"]
        assert [task["frames"] for task in tasks] == [[-2, -1], [0, 1]], tasks
        assert [pathlib.Path(path).name for path in tasks[0]["outputs"]] == ["p.-002.exr", "p.-001.exr"], tasks[0]
        inputs = {pathlib.Path(path).name for path in tasks[0]["inputs"]}
        assert inputs == {f"n.{name(-2)}.vdb", f"n.{name(-1)}.vdb"}, inputs
        done = subprocess.run(command("run", "--frames=-2-1", "--frames-per-task", "2", "--samples", "2"), capture_output=True,
                              text=True, timeout=300)
        assert done.returncode == 0 and sorted(files(made)) == [f"p.{n:04d}.exr" for n in (-1, -2, 0, 1)], done


def main():
    programs, out = sys.argv[1], empty(pathlib.Path(sys.argv[2]))
    farm = Farm(programs, out, ["--size", "32x24"])
    for part in (refused, slurm_flags, sent_again, apart, parts, described, scene_files, negative, failing, stopped):
        began = time.monotonic()
        part(farm, out)
        print(f"{part.__name__}: {time.monotonic() - began:.0f} s", flush=True)


main()
