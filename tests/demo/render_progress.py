"""cumulet-render's terminal output: its shaders compile before the first sample, and it prints why a rendering ended.

Usage: render_progress.py RENDER VOLUME MODEL OUT_FOLDER
"""

import os
import pathlib
import pty
import re
import subprocess
import sys


def shown(arguments, folder):
    """Returns the lines that a command prints on a terminal."""
    ours, its = pty.openpty()
    process = subprocess.Popen(arguments, stderr=its, cwd=folder)
    os.close(its)
    text = b""
    try:
        while part := os.read(ours, 4096):
            text += part
    except OSError:  # the program has closed its end
        pass
    assert process.wait(timeout=60) == 0, text
    return re.split(r"[\r\n]+", text.decode().replace("\x1b[K", ""))


def main():
    render, volume, model, out = sys.argv[1:]
    folder = pathlib.Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    lines = shown([render, volume, "--size", "64x48", "--spp", "4", "--gltf", model, "-o", "picture.png"], folder)
    lines_with = {name: [i for i, line in enumerate(lines) if line.startswith(name)] for name in ("compiling shaders", "rendering")}
    parts = [int(re.search(r"(\d+) %", lines[i]).group(1)) for i in lines_with["compiling shaders"]]
    assert parts == sorted(parts) and parts[-1] == 100, lines
    assert max(lines_with["compiling shaders"]) < min(lines_with["rendering"]), lines
    assert (folder / "picture.png").stat().st_size > 0
    stops_by_noise(render, volume, folder)
    stops_by_time(render, volume, folder)


def ending(lines):
    """Parses the last line: noise and samples per pixel."""
    last = [line for line in lines if line][-1]
    match = re.match(r"stopped.png: noise ([\d.]+) %.* after ([\d.]+) samples per pixel", last)
    assert match, last
    return float(match.group(1)), float(match.group(2)), last


def stops_by_noise(render, volume, folder):
    picture = [render, volume, "--size", "64x48", "-o", "stopped.png", "--noise-target", "12"]
    lines = shown(picture, folder)
    noise, samples, last = ending(lines)
    assert noise <= 12.0 and 16 <= samples < 4096 and "(target 12 %)" in last, last
    parts = [int(re.search(r"(\d+) %", line).group(1)) for line in lines if line.startswith("rendering")]
    assert parts == sorted(parts), lines
    # If the noise limit needs more samples than the maximum, the output says so.
    _, samples, last = ending(shown(picture + ["--spp", "3"], folder))
    assert samples == 3 and last.endswith(", the maximum"), last


def stops_by_time(render, volume, folder):
    lines = shown([render, volume, "--size", "64x48", "-o", "stopped.png", "--time-limit", "0.5"], folder)
    _, samples, last = ending(lines)
    assert samples >= 1 and last.endswith(", stopped at the time limit of 0.5 s"), last
    assert (folder / "stopped.png").stat().st_size > 0


main()
