"""The first image of cumulet-render with default settings. A cloud is neither black nor overexposed, at any density. An
explosion shows flames in dark smoke.

Usage: first_picture.py RENDER CLOUD EXPLOSION OUT_FOLDER
"""

import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from png import Picture


def luminances(picture):
    """Returns displayed luminances, from 0 to 1."""
    n = picture.channels
    return [(0.2126 * row[x] + 0.7152 * row[x + 1] + 0.0722 * row[x + 2]) / 255
            for row in picture.rows for x in range(0, n * picture.width, n)]


def main():
    render, volume, explosion, out = *sys.argv[1:4], pathlib.Path(sys.argv[4])
    out.mkdir(parents=True, exist_ok=True)

    def shown(name, *more):
        subprocess.run([render, volume, "--size", "64x40", "--spp", "16", "-o", f"{out}/{name}.png", *more], check=True,
                       timeout=90)
        return luminances(Picture(out / f"{name}.png"))

    # Tests the file as it is, much thinner and much denser, because other programs use such densities.
    looks = {"default": [], "thin": ["--density-scale", "0.04"], "thick": ["--density-scale", "8"]}
    for name, more in looks.items():
        values = shown(name, *more)
        mean = sum(values) / len(values)
        clipped, black = (sum(map(test, values)) / len(values) for test in (lambda v: v > 0.985, lambda v: v < 0.02))
        print(f"{name}: mean {mean:.3f}, clipped {100 * clipped:.2f} %, black {100 * black:.2f} %")
        assert 0.35 < mean < 0.7, (name, mean)
        assert clipped < 0.02 and black < 0.02, (name, clipped, black)
        # The cloud fills the center; it must show light and shade.
        middle = [v for y in range(14, 28) for v in values[64 * y + 22:64 * y + 42]]
        assert 0.35 < sum(middle) / len(middle) < 0.95, (name, sum(middle) / len(middle))
        assert max(values) - min(values) > 0.3, (name, min(values), max(values))

    subprocess.run([render, explosion, "--size", "64x40", "--spp", "32", "-o", f"{out}/fire.png"], check=True, timeout=90)
    picture = Picture(out / "fire.png")
    n = picture.channels
    pixels = [row[x:x + 3] for row in picture.rows for x in range(0, n * picture.width, n)]
    burnt, orange, dark = (sum(map(test, pixels)) / len(pixels) for test in (
        lambda p: min(p) > 250, lambda p: p[0] > 150 and p[0] > 1.4 * p[2] and p[0] > 1.15 * p[1], lambda p: max(p) < 70))
    print(f"fire: burnt {100 * burnt:.2f} %, orange {100 * orange:.2f} %, dark {100 * dark:.2f} %")
    assert burnt < 0.002 and orange > 0.03 and dark > 0.01, (burnt, orange, dark)


main()
