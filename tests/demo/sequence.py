"""cumulet-render on the frames of a sequence: its output, the files that it keeps, and the files left after it is
killed.

Usage: sequence.py RENDER SCENE OUT_FOLDER
"""

import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import time

from moving_model import write_moving_model

LINE = re.compile(r"frame (-?\d+) \((\d+) of (\d+)\) (done|kept|failed) (.+)")
LOOK = ["--size", "32x24", "--spp", "2"]


class Sequence:
    def __init__(self, render, folder):
        self.render, self.folder = render, folder

    def command(self, output, *more):
        return [self.render, str(self.folder / "explosion_####.vdb"), *LOOK, "-o", str(output), *more]

    def run(self, output, *more):
        """Returns the exit status, the frames' (number, state, rest) and the standard error."""
        done = subprocess.run(self.command(output, *more), capture_output=True, text=True, timeout=600)
        matches = [LINE.fullmatch(line) for line in done.stdout.splitlines()]
        assert all(matches), done.stdout
        positions = [(int(m[2]), int(m[3])) for m in matches]
        assert positions == [(i + 1, positions[0][1]) for i in range(len(positions))], done.stdout
        return done.returncode, [(int(m[1]), m[4], m[5]) for m in matches], done.stderr


def files(folder):
    """Returns name and content of all files in the folder."""
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def empty(folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def bad_frames(sequence, out):
    """Missing, truncated and empty files are named in the output, and the other frames are rendered."""
    broken = Sequence(sequence.render, empty(out / "broken"))
    for path in sequence.folder.glob("explosion_*.vdb"):
        shutil.copy(path, broken.folder)
    frame = lambda n: broken.folder / f"explosion_{n:04}.vdb"
    frame(13).unlink()
    frame(14).write_bytes(frame(14).read_bytes()[:3000])
    frame(15).write_bytes(b"")
    pictures = empty(out / "bad")
    status, frames, error = broken.run(pictures / "p.$F4.exr", "--frames", "12-16")
    states = {number: state for number, state, _ in frames}
    assert states == {12: "done", 13: "failed", 14: "failed", 15: "failed", 16: "done"}, frames
    for number, state, rest in frames:
        assert state == "done" or frame(number).name in rest, rest
        assert state == "failed" or re.fullmatch(rf"\S*p\.{number:04}\.exr in [\d.]+ s", rest), rest
    assert status == 1 and error.splitlines()[-1] == "cumulet-render: 3 of 5 frames failed: 13-15", (status, error)
    assert sorted(files(pictures)) == ["p.0012.exr", "p.0016.exr"]
    # A repaired frame is rendered, and existing frames are kept.
    shutil.copy(sequence.folder / "explosion_0014.vdb", broken.folder)
    before = files(pictures)
    status, frames, _ = broken.run(pictures / "p.####.exr", "--frames", "12,14,16")
    assert status == 0 and [state for _, state, _ in frames] == ["kept", "done", "kept"], frames
    after = files(pictures)
    assert {name: after[name] for name in before} == before and "p.0014.exr" in after


def alone_as_among_others(sequence, out):
    """A frame's image does not depend on which other frames are rendered. Density scale, camera and ground are
    determined for the whole sequence."""
    all_of_them, one = empty(out / "all"), empty(out / "one")
    status, frames, error = sequence.run(all_of_them / "p.####.exr", "--frames", "12-16x2")
    assert status == 0 and [n for n, _, _ in frames] == [12, 14, 16], (frames, error)
    assert "density scale" in error, error
    status, _, _ = sequence.run(one / "p.####.exr", "--frames", "14")
    assert status == 0
    assert files(one)["p.0014.exr"] == files(all_of_them)["p.0014.exr"]
    # The frames' images differ.
    assert len(set(files(all_of_them).values())) == 3
    # --overwrite renders an existing frame again: with other samples the file changes.
    status, frames, _ = sequence.run(one / "p.####.exr", "--frames", "14", "--overwrite", "--seed", "5")
    assert status == 0 and frames[0][1] == "done"
    assert files(one)["p.0014.exr"] != files(all_of_them)["p.0014.exr"]


def settled(sequence, out):
    """Settings common to all frames are computed once and stored (--sequence-cache). The images are the same to the bit, and
    the volume that the settings came from is not read again. A stored file that is damaged or of another scene is
    computed again."""
    wanted, pictures = empty(out / "unsettled"), empty(out / "settled")
    status, _, _ = sequence.run(wanted / "p.####.exr", "--frames", "12-16x2")
    assert status == 0
    common = Sequence(sequence.render, empty(out / "common"))
    for path in sequence.folder.glob("explosion_*.vdb"):
        shutil.copy(path, common.folder)
    largest = max(common.folder.iterdir(), key=lambda path: path.stat().st_size)
    assert largest.name not in ("explosion_0012.vdb", "explosion_0014.vdb", "explosion_0016.vdb")
    kept = pictures / "common"
    run = lambda frame, *more: common.run(pictures / "p.####.exr", "--frames", str(frame), "--sequence-cache", str(kept), *more)
    assert run(12)[0] == 0 and kept.exists()
    before = kept.read_bytes()
    was, voxels = largest.stat(), largest.read_bytes()
    largest.write_bytes(b"not a volume".ljust(was.st_size))
    os.utime(largest, (was.st_atime, was.st_mtime))
    assert run(14)[0] == 0 and kept.read_bytes() == before
    assert run(16)[0] == 0
    made = files(pictures)
    assert {name: made[name] for name in files(wanted)} == files(wanted)
    # The largest file is replaced under the same name. The settings are computed again from the new content, which is
    # another volume.
    os.utime(largest, (was.st_atime, was.st_mtime + 5))
    assert run(12, "--overwrite")[0] == 0 and kept.read_bytes() != before
    largest.write_bytes(voxels)
    os.utime(largest, (was.st_atime, was.st_mtime))
    kept.unlink()  # otherwise it would stay valid, because the largest file is restored
    assert run(12, "--overwrite")[0] == 0 and kept.read_bytes() == before
    assert files(pictures)["p.0012.exr"] == made["p.0012.exr"]
    # A stored file of another scene, and a truncated one.
    assert run(12, "--anisotropy", "0.3", "--overwrite")[0] == 0 and kept.read_bytes() != before
    assert files(pictures)["p.0012.exr"] != made["p.0012.exr"]
    kept.write_bytes(before[: len(before) // 2])
    status, frames, _ = run(12, "--overwrite")
    assert status == 0 and frames[0][1] == "done" and len(kept.read_bytes()) > len(before) // 2
    nowhere = common.run(pictures / "q.####.exr", "--frames", "12", "--sequence-cache", str(out / "none" / "common"))
    assert nowhere[0] == 1 and "none/common" in nowhere[2].splitlines()[-1], nowhere


def begins_empty(sequence, out):
    """A fire has empty frames before it starts. The common settings come from a frame that is not empty, even if the
    empty frame is the first one and the largest file."""
    begun = Sequence(sequence.render, empty(out / "begun"))
    wanted, pictures = empty(out / "without_empty"), empty(out / "with_empty")
    for path in sequence.folder.glob("explosion_001[2-6].vdb"):
        shutil.copy(path, begun.folder)
    largest = max(path.stat().st_size for path in begun.folder.iterdir())
    look = ["--density-scale", "auto"]
    status, _, _ = begun.run(wanted / "p.####.exr", "--frames", "12,14", *look)
    assert status == 0
    nothing = (sequence.folder / "explosion_0001.vdb").read_bytes()
    (begun.folder / "explosion_0001.vdb").write_bytes(nothing + bytes(largest))
    status, frames, error = begun.run(pictures / "p.####.exr", "--frames", "1,12,14", *look)
    assert status == 0 and [state for _, state, _ in frames] == ["done"] * 3, (frames, error)
    assert "explosion_0001.vdb" in error and "density scale" in error, error
    made = files(pictures)
    assert made.pop("p.0001.exr") not in made.values()
    assert made == files(wanted)


def negative(sequence, out):
    """Negative frame numbers, padded as C, Houdini and ffmpeg do and as Blender does. Files with any other padding are
    named in an error."""
    names = {"c": "{:04d}".format, "b": lambda n: f"-{-n:04d}" if n < 0 else f"{n:04d}"}
    for style, name in names.items():
        there = empty(out / f"negative_{style}")
        for n in range(-2, 3):
            shutil.copy(sequence.folder / f"explosion_{14 + n:04}.vdb", there / f"n.{name(n)}.vdb")
        pictures = empty(out / f"negative_{style}_pictures")
        made = lambda *words: subprocess.run([sequence.render, str(there / "n.####.vdb"), *LOOK, "-o", str(pictures / "p.####.exr"),
                                              *words], capture_output=True, text=True, timeout=600)
        for words, numbers in ((["--frames", "-2--1"], [-2, -1]), (["--frames=-2-2", "--overwrite"], [-2, -1, 0, 1, 2]),
                               (["--overwrite", "--frames", "-4-2x2"], [-4, -2, 0, 2]), (["--overwrite"], [-2, -1, 0, 1, 2])):
            done = made(*words)
            frames = [LINE.fullmatch(line) for line in done.stdout.splitlines()]
            assert [int(m[1]) for m in frames] == numbers, (words, done)
            assert [m[4] for m in frames] == ["failed" if n < -2 else "done" for n in numbers], (words, done)
            assert done.returncode == (1 if -4 in numbers else 0) and "ignored because" not in done.stderr, (words, done)
        assert sorted(files(pictures)) == sorted(f"p.{n:04d}.exr" for n in range(-2, 3)), files(pictures)
        assert len(set(files(pictures).values())) == 5, "each its own frame"
    shutil.copy(sequence.folder / "explosion_0014.vdb", there / "n.7.vdb")
    done = made("--overwrite", "--frames", "-1")
    assert done.returncode == 0 and done.stderr.splitlines()[0] == (
        f"warning: {there}/n.####.vdb: files ignored because their frame numbers have another padding: n.7.vdb"), done
    far = empty(out / "far")
    for n in (9999, 10000, 10001):
        shutil.copy(sequence.folder / "explosion_0014.vdb", far / f"f.{n}.vdb")
    done = subprocess.run([sequence.render, str(far / "f.####.vdb"), *LOOK, "-o", str(far / "p.####.exr")], capture_output=True,
                          text=True, timeout=600)
    assert sorted(path.name for path in far.glob("p.*")) == ["p.10000.exr", "p.10001.exr", "p.9999.exr"], done


def gap(sequence, out):
    """A missing file is not replaced by its neighbors. Its failure is printed once, on its own line."""
    there = empty(out / "gap")
    for n in (12, 13, 15):
        shutil.copy(sequence.folder / f"explosion_00{n}.vdb", there)
    pictures = empty(out / "gap_pictures")
    done = subprocess.run([sequence.render, str(there / "explosion_####.vdb"), *LOOK, "-o", str(pictures / "p.####.exr"), "--frames",
                           "13-15x0.5", "--density-scale", "1"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=600)
    lines = [line for line in done.stdout.splitlines() if "explosion_0014.vdb" in line]
    assert len(lines) == 3 and all(" failed " in line for line in lines), done.stdout
    assert "instead" not in done.stdout, done.stdout
    assert done.stdout.splitlines()[-1] == "cumulet-render: 3 of 5 frames failed: 13.5, 14, 14.5", done.stdout
    assert len(files(pictures)) == 2


def refused(sequence, out):
    """Wrong arguments are refused before any file is written."""
    def said(output, *more):
        done = subprocess.run(sequence.command(output, *more), capture_output=True, text=True, timeout=60)
        assert done.stdout == "" and done.stderr.count("\n") == 1, (done.stdout, done.stderr)
        return done.returncode, done.stderr
    for arguments in (["p.exr"], ["p.##.##.exr"], ["p.####.exr", "--frames", "9-1"], ["p.####.exr", "--frames", "a"],
                      ["p.####.exr", "--stats", "s.json"], ["p.####.exr", "--info"],
                      ["p.####.exr", "--sequence-cache", ""], ["p.####.exr", "--sequence-cache", "c", "--trace", "c"]):
        status, line = said(*arguments)
        assert status == 2, (arguments, status, line)
    status, line = said(out / "none" / "p.####.exr")
    assert status == 1 and "none/p.0001.exr: No such file or directory" in line, line


def interrupted(sequence, out):
    """After Ctrl-C, no image with fewer samples replaces one with all samples."""
    pictures = empty(out / "interrupted")
    process = subprocess.Popen(sequence.command(pictures / "p.####.exr", "--frames", "12-14", "--spp", "1000000"),
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    time.sleep(4)  # during the samples, or before them on a busy machine
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=120)
    assert process.returncode == 1, error
    last = error.splitlines()[-1]
    assert last.startswith("cumulet-render: interrupted") and last.endswith(": frames 12-14 not rendered"), error
    assert files(pictures) == {}, files(pictures)


def killed(sequence, out, runs):
    """After kill -9 at random times, no frame is lost, truncated or of another image."""
    whole = empty(out / "whole")
    began = time.monotonic()
    status, _, _ = sequence.run(whole / "p.####.exr", "--frames", "10-17")
    length = time.monotonic() - began
    assert status == 0
    wanted = files(whole)
    assert len(wanted) == 8
    dice = random.Random(7)
    pictures = empty(out / "killed")
    for run in range(runs):
        if run % 5 == 0:
            empty(pictures)
        process = subprocess.Popen(sequence.command(pictures / "p.####.exr", "--frames", "10-17"),
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(dice.uniform(0.0, 0.5 * length))
        process.kill()
        process.wait()
        for name, content in files(pictures).items():
            assert ".tmp" in name or content == wanted[name], f"{name} is torn"
    made = [name for name in files(pictures) if name in wanted]
    status, frames, _ = sequence.run(pictures / "p.####.exr", "--frames", "10-17")
    assert status == 0 and [state for _, state, _ in frames].count("kept") == len(made), (frames, made)
    assert {name: content for name, content in files(pictures).items() if name in wanted} == wanted


def animated(sequence, out):
    """Animations of models follow the clock of the sequence, also between frames, unless --gltf-time is given."""
    pictures = empty(out / "animated")
    model = write_moving_model(pictures / "model.gltf")
    look = ["--camera", "0,10,60 0,10,0 40", "--density-scale", "0.2", "--ground", "none", "--sun", "20,40 3,3,3", "--sky", "0.4,0.5,0.6"]

    def frames(name, numbers, *more):
        done = subprocess.run(sequence.command(pictures / f"{name}_####.pfm", "--frames", numbers, *look, *more), capture_output=True,
                              text=True, timeout=600)
        assert done.returncode == 0, done.stderr
        return {float(path.name[len(name) + 1:-4]): path.read_bytes() for path in sorted(pictures.glob(f"{name}_*.pfm"))}

    def single(name, volume, *more):
        path = pictures / f"{name}.pfm"
        subprocess.run([sequence.render, *volume, *LOOK, *look, *more, "-o", str(path)], check=True, timeout=300, stderr=subprocess.DEVNULL)
        return path.read_bytes()

    volume = lambda number: sequence.folder / f"explosion_{number:04}.vdb"
    clock = frames("clock", "7,13,13.5", "--gltf", str(model))
    still = frames("still", "7,13,13.5", "--gltf", str(model), "--gltf-time", "0.5")
    later = frames("later", "13.5", "--gltf", str(model), "--gltf-time", str(12.5 / 24))
    assert clock[13] == still[13] and clock[7] != still[7] and clock[13.5] != still[13.5], "frame 13 is at 12 / 24 s"
    assert clock[13.5] == later[13.5]
    assert clock[7] == single("seventh", [str(volume(7))], "--gltf", str(model), "--gltf-time", "0.25")
    # The other models of a scene follow it too.
    scene = pictures / "scene.json"

    def put(name, time):
        scene.write_text(json.dumps({"cumulet_scene": 3, "volumes": [{"file": name}], "models": [{"file": str(model), "name": "other", "time": time}]}))

    put(str(sequence.folder / "explosion_####.vdb"), 0.1)
    done = subprocess.run([sequence.render, "--scene", str(scene), *LOOK, *look, "--frames", "7,13", "-o", str(pictures / "scene_####.pfm")],
                          capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    for number, time in ((7, 0.25), (13, 0.5)):
        put(str(volume(number)), time)
        assert (pictures / f"scene_{number:04}.pfm").read_bytes() == single("alone", ["--scene", str(scene)]), number


def main():
    render, scene, out = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    volumes = empty(out / "volumes")
    subprocess.run([scene, str(volumes), "--only", "explosion", "--voxels", "3000"], check=True, timeout=300)
    sequence = Sequence(render, volumes)
    refused(sequence, out)
    negative(sequence, out)
    gap(sequence, out)
    bad_frames(sequence, out)
    alone_as_among_others(sequence, out)
    settled(sequence, out)
    begins_empty(sequence, out)
    interrupted(sequence, out)
    killed(sequence, out, 10)
    animated(sequence, out)


main()
