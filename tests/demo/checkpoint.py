"""Stops or kills a rendering and continues it from its checkpoint. The file must equal that of an uninterrupted
rendering.

Usage: checkpoint.py RENDER VOLUME OUT_FOLDER
"""

import pathlib
import random
import shutil
import signal
import subprocess
import sys
import time


class Picture:
    def __init__(self, render, volume, folder, *more):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        self.output, self.checkpoint = folder / "picture.exr", folder / "picture.ck"
        self.command = [render, volume, "--size", "64x48", "--seed", "3", "-o", str(self.output), *more]
        self.kept = self.command + ["--checkpoint", str(self.checkpoint)]

    def run(self, command):
        done = subprocess.run(command, capture_output=True, text=True, timeout=600)
        return done.returncode, done.stderr

    def stop_once_kept(self, number):
        """Like stop(), but waits until the run has written a new checkpoint."""
        before = self.checkpoint.stat().st_mtime_ns if self.checkpoint.exists() else 0
        process = subprocess.Popen(self.kept + ["--checkpoint-every", "0.05"], stderr=subprocess.PIPE, text=True)
        while process.poll() is None:
            try:
                if self.checkpoint.stat().st_mtime_ns != before:
                    break
            except FileNotFoundError:
                pass
            time.sleep(0.005)
        process.send_signal(number)
        return process, process.communicate(timeout=120)[1]

    def stop(self, seconds, number):
        """Sends the signal after so many seconds. Returns the exit status and the standard error."""
        process = subprocess.Popen(self.kept, stderr=subprocess.PIPE, text=True)
        time.sleep(seconds)
        process.send_signal(number)
        return process, process.communicate(timeout=120)[1]


def stopped(render, volume, out):
    """SIGTERM writes a checkpoint and no image. A second run writes the same image as an uninterrupted run."""
    whole = Picture(render, volume, out / "whole", "--spp", "300", "--aovs", "volume,error")
    status, error = whole.run(whole.command)
    assert status == 0, error
    part = Picture(render, volume, out / "part", "--spp", "300", "--aovs", "volume,error")
    times = 0
    for _ in range(4):
        had = part.checkpoint.exists()
        process, error = part.stop_once_kept(signal.SIGTERM)
        if process.returncode == 0:
            break
        assert process.returncode == 1 and "interrupted" in error, error
        assert not part.output.exists()
        if part.checkpoint.exists() and had:
            times += 1
            assert f"resuming from {part.checkpoint}" in error, error
    if not part.output.exists():
        status, error = part.run(part.kept)
        assert status == 0 and "resuming from" in error, error
        times += 1
    assert times > 0, "it was never stopped"
    assert part.output.read_bytes() == whole.output.read_bytes(), "not the same file"
    assert not part.checkpoint.exists()


def killed(render, volume, out):
    """After kill -9 the last checkpoint is complete, and the image is the same."""
    whole = Picture(render, volume, out / "alone", "--spp", "200")
    began = time.monotonic()
    assert whole.run(whole.command)[0] == 0
    length = time.monotonic() - began
    part = Picture(render, volume, out / "killed", "--spp", "200")
    part.kept += ["--checkpoint-every", "0.05"]
    dice = random.Random(11)
    for _ in range(5):
        part.stop(dice.uniform(0.2, 1.0) * length, signal.SIGKILL)
        if part.output.exists():
            break
    status, error = part.run(part.kept)
    assert status == 0, error
    assert part.output.read_bytes() == whole.output.read_bytes(), "not the same file"
    assert not part.checkpoint.exists()


def refused(render, volume, out):
    """A checkpoint of another rendering and a damaged one are refused with one line."""
    picture = Picture(render, volume, out / "refused", "--spp", "1000000")
    for seconds in (1.0, 3.0, 10.0, 30.0):
        picture.stop(seconds, signal.SIGINT)
        if picture.checkpoint.exists():
            break
    kept = picture.checkpoint.read_bytes()
    for more in (["--seed", "4"], ["--size", "32x32"], ["--density-scale", "2"], ["--spp", "4"]):
        status, error = picture.run(picture.kept + more)
        assert status == 1 and error.count("\n") == 1 and "is the checkpoint of another image" in error, error
    assert picture.checkpoint.read_bytes() == kept and not picture.output.exists()
    picture.checkpoint.write_bytes(kept[: len(kept) // 2])
    status, error = picture.run(picture.kept)
    assert status == 1 and error.count("\n") == 1 and "damaged" in error, error


def main():
    render, volume, out = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    stopped(render, volume, out)
    killed(render, volume, out)
    refused(render, volume, out)


main()
