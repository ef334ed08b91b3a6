"""A session of cumulet-demo on a virtual display: plays replay files, and compares screenshots."""

import json
import mmap
import os
import struct
import subprocess
import time

from png import Picture, difference

ALIKE = (3.0, 16.0)  # maximum mean and maximum difference of blocks that noise causes, on a scale of 255
SIZE = ["--size", "640x304"]


class Screen:
    """The current framebuffer of Xvfb, read from its file: fast, and without asking an X client."""

    def __init__(self, file):
        with file.open("rb") as f:
            self.data = mmap.mmap(f.fileno(), 0, access=mmap.ACCESS_READ)
        header = struct.unpack(">25I", self.data[:100])
        self.start, self.bytes, self.line = header[0] + 12 * header[19], header[11] // 8, header[12]

    def row(self, x, y, width):
        """Returns the bytes of a row of pixels."""
        begin = self.start + y * self.line + x * self.bytes
        return self.data[begin: begin + width * self.bytes]


class Session:
    def __init__(self, demo, render, scene, out):
        self.demo, self.renderer, self.scene, self.out = demo, render, scene, out
        self.cumulus, self.explosion = f"{scene}/cumulus.vdb", f"{scene}/explosion_0012.vdb"
        self.environment = dict(os.environ, XDG_CONFIG_HOME=str(out / "config"), XDG_STATE_HOME=str(out / "state"))

    def start(self, arguments, **more):
        return subprocess.run([self.demo, *arguments], cwd=self.out, env=self.environment, timeout=900,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **more)

    def play(self, name, replay, *arguments, size=SIZE, auto_exposure=False):
        (self.out / f"{name}.replay").write_text("\n".join(replay) + "\n")
        samples = [] if "--spp" in arguments else ["--spp", "6"]
        # Tests compare the samples, not the denoised image.
        samples += [] if "--denoise" in arguments else ["--denoise", "off"]
        # The tests' thresholds were chosen before density scales adapted to the volume.
        scale = [] if "--scene" in arguments or "--density-scale" in arguments else ["--density-scale", "1"]
        # With more bounces the tests take twice as long. A scene file and an automatic default look keep their own
        # value.
        if not {"--scene", "--max-bounces", "auto"} & set(arguments):
            scale += ["--max-bounces", "8"]
        # A given exposure disables auto exposure.
        if not auto_exposure and not {"--scene", "--exposure"} & set(arguments):
            scale += ["--exposure", "0"]
        done = self.start([*size, *samples, *scale, *arguments, "--replay", f"{name}.replay"])
        assert done.returncode == 0, f"{name}: {done.returncode}: {done.stderr}"

    def play_live(self, name, replay, hand, *arguments, size=SIZE):
        """Plays a replay that idles. Calls hand(), which uses mouse and keyboard, as soon as the replay has written
        live.json."""
        (self.out / f"{name}.replay").write_text("\n".join(replay) + "\n")
        denoise = [] if "--denoise" in arguments else ["--denoise", "off"]
        demo = subprocess.Popen([self.demo, *size, *arguments, *denoise, "--replay", f"{name}.replay"], cwd=self.out,
                                env=self.environment, stderr=subprocess.PIPE, text=True)
        try:
            while not (self.out / "live.json").exists():
                assert demo.poll() is None, demo.stderr.read()
                time.sleep(0.05)
            hand()
            _, errors = demo.communicate(timeout=600)
        finally:
            demo.kill()
        assert demo.returncode == 0, f"{name}: {demo.returncode}: {errors}"
        return errors

    def hand(self, *arguments):
        """Runs xdotool, which sends X events as a user would."""
        subprocess.run(["xdotool", *map(str, arguments)], env=self.environment, check=True, timeout=300)

    def screen(self, x, y, width, height):
        """Returns rows of bytes of the display."""
        display = Screen(self.out / "Xvfb_screen0")
        return [display.row(x, row, width) for row in range(y, y + height)]

    def picture(self, name):
        return Picture(self.out / f"{name}.png")

    def report(self, name):
        return json.loads((self.out / f"{name}.json").read_text())


def shot(name):
    return [f'screenshot "{name}.png"', f'report "{name}.json"']


def look(s, name):
    """Returns a screenshot, its report and the position of the rendered image in it."""
    report, picture = s.report(name), s.picture(name)
    # The line of text at the bottom changes all the time.
    x, y, width, height = report["viewport"]
    return picture, report, (x, y, width, height - 48)


def assert_saved(screenshot, file, area):
    """Compares the rendered image in a screenshot with a file of it."""
    x, y, width, height = area
    assert_alike(screenshot, file, area, (0, 0, width, height))


def assert_alike(a, b, area, other=None):
    mean, most = difference(a, b, area, other)
    assert mean < ALIKE[0] and most < ALIKE[1], f"the pictures differ: mean {mean:.2f}, largest {most:.2f}"


def assert_differ(a, b, area):
    mean, most = difference(a, b, area)
    assert mean > ALIKE[0] and most > 2 * ALIKE[1], f"the pictures are alike: mean {mean:.2f}, largest {most:.2f}"


def assert_drawn(picture, area):
    lights = [sum(b) / 3 for b in picture.blocks(area)]
    assert max(lights) - min(lights) > 25, "the picture is blank"


def shown(name, control="Scene/"):
    """Returns the commands that show a part or object in the inspector, or one of its tabs."""
    return [f'click "{control}{name}"', "frames 2"]


def tab(name):
    return shown(name, "")


SETTLE = ["frames 3", "wait loaded", "wait converged"]
