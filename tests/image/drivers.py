"""Renders the image tests' scenes with each driver and many samples, and compares the differences between drivers with
those between two seeds.

Usage: drivers.py RENDER OUT_FOLDER ZINK_ICD SAMPLES NAME=FLAG|FLAG|... ...
A path depends only on seed, pixel and sample index, so drivers differ only by rounding: by less than the noise.
SAMPLES: samples per pixel; a scene NAME/8 has an eighth of them. The images stay in OUT_FOLDER.
"""

import array
import json
import math
import os
import pathlib
import subprocess
import sys
import time

NEAR_BLACK = 0.01  # of relMSE: (x - r)^2 / (r^2 + 0.01)


def read_pfm(path):
    """Returns the RGB values, with rows in the file's order."""
    with path.open("rb") as file:
        kind, size, scale = (file.readline().decode().strip() for _ in range(3))
        assert kind == "PF" and float(scale) < 0, f"{path}: {kind} {scale}"
        values = array.array("f")
        values.frombytes(file.read())
    width, height = map(int, size.split())
    assert len(values) == 3 * width * height, path
    assert all(map(math.isfinite, values)), f"{path} has what is no number"
    return values


def apart(a, b):
    """Returns b's mean minus a's, relative to a's; the standard error of it if only noise differs; and relMSE."""
    mean = sum(a) / len(a)
    # Sums a pixel's channels, because the same paths contribute to all three.
    squares = sum((sum(a[i:i + 3]) - sum(b[i:i + 3])) ** 2 for i in range(0, len(a), 3))
    relative = sum((x - y) ** 2 / ((0.5 * (x + y)) ** 2 + NEAR_BLACK) for x, y in zip(a, b)) / len(a)
    return (sum(b) / len(b) - mean) / mean, math.sqrt(squares) / len(a) / mean, relative


class Renderer:
    def __init__(self, program, out, icd):
        self.program, self.out, self.icd = program, out, icd

    def render(self, name, driver, seed, flags):
        picture, stats = self.out / f"{name}-{driver}-{seed}.pfm", self.out / f"{name}-{driver}-{seed}.json"
        environment = dict(os.environ)
        if driver == "zink":
            environment.update(MESA_LOADER_DRIVER_OVERRIDE="zink", LIBGL_ALWAYS_SOFTWARE="1", VK_ICD_FILENAMES=self.icd)
        begun = time.monotonic()
        subprocess.run([self.program, *flags, "--size", "96x72", "--seed", str(seed), "--backend",
                        "osmesa" if driver == "osmesa" else "egl", "--stats", stats, "-o", picture],
                       env=environment, check=True, stderr=subprocess.DEVNULL)
        made_by = json.loads(stats.read_text())["gl"]["renderer"]
        assert made_by.startswith("zink" if driver == "zink" else "llvmpipe"), made_by
        return read_pfm(picture), time.monotonic() - begun


def without(flags, name):
    """Returns the flags without this one and its value."""
    at = flags.index(name) if name in flags else len(flags)
    return flags[:at] + flags[at + 2:]


def main():
    program, out, icd, samples, *scenes = sys.argv[1:]
    out = pathlib.Path(out)
    out.mkdir(parents=True, exist_ok=True)
    renderer = Renderer(program, out, icd)
    drivers = ["osmesa"] + (["zink"] if pathlib.Path(icd).exists() else [])
    bad = []
    print("| Scene | Samples | Another seed: mean, % | relMSE | " +
          " | ".join(f"{driver}: mean, % | relMSE" for driver in drivers) + " |\n|---" + "|--:" * (3 + 2 * len(drivers)) + "|")
    for scene in scenes:
        name, flags = scene.split("=", 1)
        name, _, part = name.partition("/")
        count = max(1, int(samples) // int(part or 1))
        flags = without(flags.split("|"), "--spp") + ["--spp", str(count)]
        first, seconds = renderer.render(name, "egl", 1, flags)
        times = [f"egl {seconds:.0f} s"]
        mean, error, noise = apart(first, renderer.render(name, "egl", 2, flags)[0])
        row = f"| {name} | {count} | {100 * mean:+.3f} (s.e. {100 * error:.3f}) | {noise:.2e} |"
        for driver in drivers:
            picture, seconds = renderer.render(name, driver, 1, flags)
            times.append(f"{driver} {seconds:.0f} s")
            mean, _, relative = apart(first, picture)
            row += f" {100 * mean:+.4f} | {relative:.2e} |"
            if abs(mean) > 3 * error or relative > 1.1 * noise:
                bad.append(f"{name}: {driver} differs by more than noise")
        print(row, flush=True)
        print(name, *times, sep=", ", file=sys.stderr, flush=True)
    assert not bad, bad


main()
