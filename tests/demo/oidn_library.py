"""cumulet-render --denoise high by a library of Open Image Denoise, which needs no networks. The library of the test adds
green. Without it the filter denoises, and lines say so, also for an
installed library that cannot be loaded.

Usage: oidn_library.py RENDER CLOUD LIBRARY OUT_FOLDER
"""

import os
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from png import Picture


def main():
    render, volume, library, out = *sys.argv[1:4], pathlib.Path(sys.argv[4])
    out.mkdir(parents=True, exist_ok=True)

    def run(name, *flags, **variables):
        """Returns the mean of green minus red, and the messages."""
        environment = dict(os.environ, CUMULET_OIDN_WEIGHTS=str(out / "none"), **variables)
        done = subprocess.run([render, volume, "--size", "32x20", "--spp", "2", "--denoise", "high", "-o", f"{out}/{name}.png", *flags],
                              timeout=200, capture_output=True, text=True, env=environment, check=True)
        picture = Picture(out / f"{name}.png")
        n = picture.channels
        differences = [row[x + 1] - row[x] for row in picture.rows for x in range(0, n * picture.width, n)]
        return sum(differences) / len(differences), done.stderr

    said = "denoising by Open Image Denoise 2.3.1"
    for green, messages in (run("flag", "--oidn-library", library), run("variable", CUMULET_OIDN_LIBRARY=library)):
        assert green > 30 and messages.count(said) == 1, (green, messages)
    for green, messages in (run("off", "--oidn-library", "off", CUMULET_OIDN_LIBRARY=library), run("off", CUMULET_OIDN_LIBRARY="off")):
        assert green < 15 and said not in messages and "using the fast filter: " in messages, (green, messages)
    green, messages = run("missing", "--oidn-library", str(out / "none.so"))
    assert green < 15 and messages.count("none.so") == 1 and "using the fast filter unless" in messages, (green, messages)
    # Libraries with the usual names that are not libraries
    broken = out / "broken"
    broken.mkdir(exist_ok=True)
    for number in (1, 2):
        (broken / f"libOpenImageDenoise.so.{number}").write_text("no library " * 100)
    green, messages = run("broken", LD_LIBRARY_PATH=str(broken))
    lines = [line for line in messages.splitlines() if "is installed but cannot be loaded" in line]
    assert green < 15 and len(lines) == 1, messages
    assert f"{broken}/libOpenImageDenoise.so.2: " in lines[0] and "by the fast filter" in lines[0], lines


main()
