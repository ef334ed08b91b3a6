"""A program in a process with unusual locales reads and writes the same text as one without.

Usage: hostile_locale.py RENDER VOLUME MODEL HOSTILE_LIBRARY LOCPATH OUT_FOLDER
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys


def run(command, environment):
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, env=environment)
    assert done.returncode == 0, f"{command}: {done.stderr}"
    return done.stdout + done.stderr


def outputs(render, volume, model, folder, environment):
    """Returns outputs and file contents by name."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    found = {"--info": run([render, "--info", volume, "--gltf", model], environment),
             "--info --json": run([render, "--info", "--json", volume], environment)}
    json.loads(found["--info --json"])
    scene = folder / "scene.json"
    scene.write_text(json.dumps({"cumulet_scene": 2, "volumes": [{"file": str(volume), "translate": [0.5, 0.25, 0.0]}],
                                 "camera": {"fovy_degrees": 33.5}}))
    for kind in ("exr", "pfm", "png"):
        picture, stats = folder / f"picture.{kind}", folder / f"stats_{kind}.json"
        said = run([render, "--scene", str(scene), "--size", "24x16", "--spp", "3", "--density-scale", "0.75",
                    "--noise-target", "0.5", "--denoise", "off", "--stats", str(stats), "-o", str(picture)],
                   environment)
        found[f"bytes of {kind}"] = picture.read_bytes()
        found[f"lines of {kind}"] = re.sub(r" in \d+:\d\d", "", said.replace(str(folder), ""))  # times differ
        numbers = json.loads(stats.read_text())
        found[f"keys of {kind}'s stats"] = sorted(numbers)
    return found


def main(render, volume, model, hostile, locpath, out):
    folder = pathlib.Path(out)
    wanted = outputs(render, volume, model, folder / "plain", dict(os.environ))
    found = outputs(render, volume, model, folder / "hostile", dict(os.environ, LD_PRELOAD=hostile, LOCPATH=locpath))
    for name, value in wanted.items():
        assert found[name] == value, f"{name}: {found[name]!r} instead of {value!r}"


if __name__ == "__main__":
    main(*sys.argv[1:])
