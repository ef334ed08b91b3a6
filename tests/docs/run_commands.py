"""Runs the commands of a page with the files of a small sample scene, tiny pictures and few samples.

The commands of cumulet-render, cumulet-merge, cumulet-farm and cumulet-scene in the page's blocks and captions run in
their order, in one folder. Files that a reader would own are links to the sample scene's. Each command must end with
status 0 and write its output. Other programs, and cumulet-demo, which needs a display, are not run.

usage: run_commands.py PAGE SCENE_FOLDER OUT_FOLDER PROGRAM...
"""

import pathlib
import re
import shutil
import subprocess
import sys

from pages import Page, block_commands, span_commands

SAMPLES, SIZE, FRAMES = 2, "32x24", "1-2"
SECONDS = 600
CLOUD, FIRE, MODEL = "cumulus.vdb", "explosion_0012.vdb", "mountains.glb"
# A reader's file -> the sample scene's. Scene files name other files, which lie beside them.
FILES = {
    "cloud.vdb": CLOUD,
    "explosion.vdb": FIRE,
    "fire.vdb": FIRE,
    "smoke.0001.vdb": FIRE,
    "smoke.0002.vdb": FIRE,
    "smoke.0003.vdb": FIRE,
    "fluid_data_0020.vdb": FIRE,
    "model.glb": MODEL,
    "room.glb": MODEL,
    "cloud.json": "sample.json",
    "build/sample": "",
}
# The reader's OpenColorIO configuration, with the displays and views that pages name.
OCIO = """ocio_profile_version: 2
roles: {default: lin_rec709}
displays:
  sRGB - Display:
    - !<View> {name: ACES 1.0 - SDR Video, colorspace: lin_rec709}
    - !<View> {name: Film, colorspace: lin_rec709}
colorspaces:
  - !<ColorSpace> {name: lin_rec709}
"""
PLACEHOLDER = re.compile(r"#+")
PROGRAMS = ("cumulet-render", "cumulet-merge", "cumulet-farm", "cumulet-scene")


def replaced(words, flag, value, otherwise=True):
    """The words with another value of a flag, which is added if it is missing."""
    words = list(words)
    if flag in words:
        words[words.index(flag) + 1] = value
        return words
    return [*words, flag, value] if otherwise else words


def value_of(words, *flags):
    return next((words[i + 1] for i in range(len(words) - 1) if words[i] in flags), None)


def small(program, words):
    """The command's words with a small picture, few samples, few frames and a small scene."""
    if program == "cumulet-farm":
        at = words.index("--")
        ours = replaced(replaced(words[:at], "--samples", str(SAMPLES)), "--frames", "12", otherwise=False)
        return [*ours, "--", *replaced(words[at + 1:], "--size", SIZE)]
    if program == "cumulet-scene":
        return [*words, "--voxels", "20000", *([] if "--frame" in words or "--only" in words else ["--frame", "12"])]
    if program == "cumulet-merge" or "--info" in words:
        return words
    first, samples = value_of(words, "--first-sample"), value_of(words, "--spp")
    if first:  # parts that follow each other still do
        words = replaced(words, "--first-sample", str(int(first) * SAMPLES // int(samples)))
    frames = value_of(words, "--frames")
    if frames and "-" in frames:
        words = replaced(words, "--frames", FRAMES if "x" not in frames else "1-3x2")
    return replaced(replaced(words, "--spp", str(SAMPLES)), "--size", SIZE)


def outputs(program, words):
    """Patterns of the files that a command writes."""
    if program == "cumulet-scene":
        return [f"{words[0]}/*"]
    named = [value_of(words, "-o", "--output"), value_of(words, "--stats")]
    return [PLACEHOLDER.sub("*", name) for name in named if name]


def prepare(scene, folder):
    """Fills the folder with the reader's files."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name in (CLOUD, FIRE, MODEL):
        (folder / name).symlink_to(scene / name)
    (folder / "config.ocio").write_text(OCIO)
    for name, sample in FILES.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        if sample:
            file.symlink_to(scene / sample) if not name.endswith(".json") else shutil.copy(scene / sample, file)
        else:  # a command may write it again
            shutil.copytree(scene, file)


def run(command, programs, folder):
    """Runs a command. Returns the line of its failure, or None."""
    program = command.text[0].rsplit("/", 1)[-1]
    words = small(program, command.text[1:])
    for pattern in outputs(program, words) if program != "cumulet-scene" else []:
        for file in folder.glob(pattern):
            file.unlink()
    print(f"{command.page}:{command.line}: {program} {' '.join(words)}", flush=True)
    try:
        done = subprocess.run([programs[program], *words], cwd=folder, timeout=SECONDS, capture_output=True, text=True,
                              stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        return f"not done after {SECONDS} s"
    if done.returncode != 0:
        return f"status {done.returncode}: {done.stderr.strip()}"
    missing = [p for p in outputs(program, words) if not any(f.stat().st_size for f in folder.glob(p))]
    return f"wrote no {' and no '.join(missing)}" if missing else None


def main(page, scene, folder, paths):
    programs = {pathlib.Path(path).name: path for path in paths}
    page = Page(page.name, page.read_text(encoding="utf-8"))
    names = [name for name in PROGRAMS if name in programs]
    # Captions have whole commands, other prose only names and flags.
    whole = [c for c in span_commands(page, names) if value_of(c.text, "-o") or c.text[0] == "cumulet-scene"]
    commands = sorted([*block_commands(page, names), *whole], key=lambda c: c.line)
    prepare(scene.resolve(), folder)
    failures = [f"{c.page}:{c.line}: {failure}" for c in commands if (failure := run(c, programs, folder))]
    for failure in failures:
        print(failure)
    print(f"{page.path}: {len(commands)} commands, {len(failures)} failed")
    sys.exit(bool(failures) or not commands)


if __name__ == "__main__":
    if len(sys.argv) < 5:
        sys.exit(__doc__)
    main(*map(pathlib.Path, sys.argv[1:4]), sys.argv[4:])
