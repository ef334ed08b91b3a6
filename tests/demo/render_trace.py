"""The file that cumulet-render --trace writes: frames, their passes and the workers' jobs.

Usage: render_trace.py RENDER VOLUME MODEL OUT_FOLDER
"""

import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import spans


def main():
    render, volume, model, out = sys.argv[1:]
    folder = pathlib.Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "trace.json"
    file.unlink(missing_ok=True)
    subprocess.run([render, volume, "--gltf", model, "--size", "64x48", "--spp", "4", "-o", "picture.png", "--trace",
                    file.name], cwd=folder, check=True, timeout=200)
    spans.check(file, ["computing the sky", volume, model], 1)


main()
