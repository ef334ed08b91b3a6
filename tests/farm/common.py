"""Shared code of the farm's tests: a small sequence, its expected frames, and calls of cumulet-farm."""

import os
import pathlib
import shutil
import subprocess


def empty(folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def files(folder):
    """Returns name and content of all images that are complete or have a final name. For a job's parts, it searches all
    folders of the job."""
    paths = folder.rglob("*.exr") if folder.name == "parts" else folder.glob("*.exr")
    return {path.name: path.read_bytes() for path in sorted(paths)}


def unfinished(folder):
    return [path for path in folder.rglob("*") if ".tmp" in path.name]


class Farm:
    def __init__(self, programs, out, look):
        self.programs, self.out, self.look = pathlib.Path(programs), out, look
        self.render, self.merge = str(self.programs / "cumulet-render"), str(self.programs / "cumulet-merge")
        self.volumes = empty(out / "volumes")
        self.environment = dict(os.environ)
        subprocess.run([self.programs / "cumulet-scene", self.volumes, "--only", "explosion", "--voxels", "3000"],
                       check=True, timeout=300, stdout=subprocess.DEVNULL)

    def arguments(self):
        return [str(self.volumes / "explosion_####.vdb"), *self.look]

    def whole(self, folder, frames, samples):
        """Renders the frames with one process."""
        subprocess.run([self.render, *self.arguments(), "--frames", frames, "--spp", str(samples), "-o",
                        empty(folder) / "p.####.exr"], check=True, timeout=900, capture_output=True)
        return files(folder)

    def merged(self, folder, frames, ranges):
        """Renders each part with its own process, one after the other, and merges them with cumulet-merge."""
        parts = empty(folder / "parts")
        for k, (first, count) in enumerate(ranges):
            subprocess.run([self.render, *self.arguments(), "--frames", frames, "--spp", str(count), "--first-sample",
                            str(first), "-o", parts / f"####.{k}.exr"], check=True, timeout=900, capture_output=True)
        for number in sorted({path.name.partition(".")[0] for path in parts.iterdir()}):
            subprocess.run([self.merge, *(parts / f"{number}.{k}.exr" for k in range(len(ranges))), "-o",
                            folder / f"p.{number}.exr"], check=True, timeout=60, capture_output=True)
        return files(folder)

    def command(self, action, folder, *options, arguments=True):
        where = ["-o", str(folder / "p.####.exr")]
        return [str(self.programs / "cumulet-farm"), action, *where, *options,
                *(["--", *self.arguments()] if arguments else [])]

    def do(self, action, folder, *options, arguments=True):
        return subprocess.run(self.command(action, folder, *options, arguments=arguments), capture_output=True, text=True,
                              timeout=1200, env=self.environment)

    def equal_but_for_rounding(self, a, b):
        """Compares with cumulet-compare, within the error of a different order of summation."""
        done = subprocess.run([self.programs / "cumulet-compare", a, b, "--tolerance", "1e-5", "--bias", "1e-6"],
                              capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stdout
