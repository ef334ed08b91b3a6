"""What cumulet-render shows on a terminal: its shaders compile before the first sample.

Usage: render_progress.py RENDER VOLUME MODEL OUT_FOLDER
"""

import os
import pathlib
import pty
import re
import subprocess
import sys


def shown(arguments, folder):
    """Its lines on a terminal."""
    ours, its = pty.openpty()
    process = subprocess.Popen(arguments, stderr=its, cwd=folder)
    os.close(its)
    text = b""
    try:
        while part := os.read(ours, 4096):
            text += part
    except OSError:  # its end is closed
        pass
    assert process.wait(timeout=60) == 0, text
    return re.split(r"[\r\n]+", text.decode().replace("\x1b[K", ""))


def main():
    render, volume, model, out = sys.argv[1:]
    folder = pathlib.Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    lines = shown([render, volume, "--size", "64x48", "--spp", "4", "--gltf", model, "-o", "picture.png"], folder)
    places = {name: [i for i, line in enumerate(lines) if line.startswith(name)] for name in ("compiling shaders", "rendering")}
    parts = [int(re.search(r"(\d+) %", lines[i]).group(1)) for i in places["compiling shaders"]]
    assert parts == sorted(parts) and parts[-1] == 100, lines
    assert max(places["compiling shaders"]) < min(places["rendering"]), lines
    assert (folder / "picture.png").stat().st_size > 0


main()
