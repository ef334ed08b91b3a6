"""cumulet-render's terminal output: its shaders compile before the first sample, and it prints why a rendering ended.

Usage: render_progress.py RENDER VOLUME MODEL OUT_FOLDER
"""

import json
import os
import pathlib
import pty
import re
import subprocess
import sys
import time


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
    assert "picture.png: denoised (--denoise off keeps the samples)" in lines, lines
    last = [line for line in lines if line][-1]
    assert re.fullmatch(r"picture.png: noise [\d.]+ % after 4 samples per pixel in \d+:\d\d", last), last
    denoises_by_default(render, volume, folder)
    gets_better_in_place(render, volume, folder)
    stops_by_noise(render, volume, folder)
    stops_by_time(render, volume, folder)


def denoises_by_default(render, volume, folder):
    """A .png is denoised, unless a flag or the scene file says otherwise. Linear files keep the samples."""
    def bytes_of(name, *more):
        shown([render, "--size", "64x48", "--spp", "2", "-o", name, *more], folder)
        return (folder / name).read_bytes()

    fast, off = (bytes_of(f"{how}.png", volume, "--denoise", how) for how in ("fast", "off"))
    assert bytes_of("default.png", volume) == fast != off
    for how, wanted in (("fast", fast), ("off", off)):
        (folder / "scene.json").write_text(json.dumps({"cumulet_scene": 2, "volumes": [{"file": str(pathlib.Path(volume).resolve())}],
                                                       "display": {"denoise": how}}))
        lines = shown([render, "--scene", "scene.json", "--size", "64x48", "--spp", "2", "-o", "scene.png"], folder)
        assert any("denoised (" in line for line in lines) == (how == "fast"), lines
    assert bytes_of("default.pfm", volume) == bytes_of("off.pfm", volume, "--denoise", "off")


def gets_better_in_place(render, volume, folder):
    """The file of a long rendering exists before its end. With --stats it does not."""
    for more, early in (([], True), (["--stats", "stats.json"], False)):
        picture = folder / "early.png"
        picture.unlink(missing_ok=True)
        process = subprocess.Popen([render, volume, "--size", "64x48", "--spp", "60000", "-o", picture.name, *more], cwd=folder,
                                   stderr=subprocess.DEVNULL)
        try:
            began = time.monotonic()
            # The machine may be busy, so that the first sample comes late.
            while not picture.exists() and process.poll() is None and time.monotonic() - began < (120 if early else 15):
                time.sleep(0.1)
            assert process.poll() is None and picture.exists() == early, (more, time.monotonic() - began)
            if early:
                assert picture.read_bytes()[:4] == b"\x89PNG" and time.monotonic() - began > 5
        finally:
            process.kill()
            process.wait()


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
