"""The file that cumulet-render --trace writes: frames, their passes and the workers' jobs.

Usage: render_trace.py RENDER VOLUME FIRE MODEL OUT_FOLDER
"""

import json
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import spans


def main():
    render, volume, fire, model, out = sys.argv[1:]
    folder = pathlib.Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "trace.json"
    file.unlink(missing_ok=True)
    subprocess.run([render, volume, "--gltf", model, "--size", "64x48", "--spp", "4", "-o", "picture.png", "--trace",
                    file.name], cwd=folder, check=True, timeout=200)
    spans.check(file, ["computing the sky", volume, model], 1)

    # The medium of a fire is chosen before its grid is built, so that one job builds it once.
    subprocess.run([render, fire, "--size", "64x48", "--spp", "1", "-o", "fire.png", "--trace", file.name], cwd=folder,
                   check=True, timeout=200)
    events = json.loads(file.read_text())
    names = [event["name"] for event in (events["traceEvents"] if isinstance(events, dict) else events)]
    builds = [name for name in names if name == "building the grid"]
    assert len(builds) == 1 and fire not in names, sorted(set(names))


main()
