"""The first image of cumulet-render with default settings. A cloud is neither black nor overexposed, at any density. An
explosion shows flames in dark smoke at dusk, also as the frames of a sequence. Gray smoke gets the exposure that suits
it, unless a flag or a scene file sets the exposure.

Usage: first_picture.py RENDER CLOUD EXPLOSION OUT_FOLDER
"""

import json
import pathlib
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from png import Picture


def luminances(picture):
    """Returns displayed luminances, from 0 to 1."""
    n = picture.channels
    return [(0.2126 * row[x] + 0.7152 * row[x + 1] + 0.0722 * row[x + 2]) / 255
            for row in picture.rows for x in range(0, n * picture.width, n)]


def sequence(render, explosion, out):
    """All frames have the same exposure and light."""
    folder = out / "frames"
    folder.mkdir(exist_ok=True)
    for number in (1, 2):
        shutil.copy(explosion, folder / f"fire_{number}.vdb")
    done = subprocess.run([render, f"{folder}/fire_#.vdb", "--size", "32x20", "--spp", "4", "--overwrite", "-o", f"{out}/frame_#.png"],
                          check=True, timeout=180, stderr=subprocess.PIPE, text=True)
    assert done.stderr.count("dusk light") == 1 and "suits the image" not in done.stderr, done.stderr
    first, second = (Picture(out / f"frame_{number}.png").rows for number in (1, 2))
    assert first == second, "the same light"
    # Without the volume from which the first run took the look
    cache = out / "cache"
    cache.unlink(missing_ok=True)
    for given in ([], [], ["--tone-map", "neutral"]):
        done = subprocess.run([render, f"{folder}/fire_#.vdb", "--size", "32x20", "--spp", "4", "--overwrite", "--frames", "2", "--sequence-cache",
                               str(cache), *given, "-o", f"{out}/again_#.png"], check=True, timeout=180, stderr=subprocess.PIPE, text=True)
        rows = Picture(out / "again_2.png").rows
        assert (rows == second) == (not given), (given, done.stderr)


def smoke(render, explosion, out):
    """Smoke is darker than a cloud in the same light. Its .png gets the exposure that suits it."""
    scene = out / "smoke.json"
    scene.write_text(json.dumps({"cumulet_scene": 3, "volumes": [{"file": str(pathlib.Path(explosion).resolve())}]}))

    def shown(name, source, *more):
        """Returns the mean luminance of a .png, and whether a line says that its exposure was measured."""
        file = out / name
        done = subprocess.run([render, *source, "--flame-grid", "none", "--temperature-grid", "none", "--ground", "none", "--size", "64x40",
                               "--spp", "16", "-o", str(file), *more], check=True, timeout=180, stderr=subprocess.PIPE, text=True)
        values = luminances(Picture(file)) if file.suffix == ".png" else [0.0]
        return sum(values) / len(values), "stops suits the image" in done.stderr

    bright, measured = shown("smoke.png", [explosion])
    plain, kept = shown("smoke_plain.png", [explosion], "--exposure", "0")
    print(f"smoke: mean {bright:.3f}, at exposure 0 {plain:.3f}")
    assert measured and 0.35 < bright < 0.7 and bright > plain + 0.08, (measured, bright, plain)
    assert not kept
    assert not shown("smoke_scene.png", ["--scene", scene])[1], "a scene file sets the exposure, also by leaving it out"
    assert not shown("smoke.exr", [explosion])[1], "linear radiance has no exposure"
    assert not shown("smoke_part.png", [explosion], "--region", "0,0,0.5,1")[1], "all regions of an image have one exposure"


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

    def fire(name, *more, volume=explosion, ending="png"):
        """Returns the picture's pixels and the messages."""
        file = f"{out}/{name}.{ending}"
        done = subprocess.run([render, volume, "--size", "64x40", "--spp", "32", "-o", file, *more], check=True, timeout=180,
                              stderr=subprocess.PIPE, text=True)
        if ending != "png" or "####" in file:
            return [], done.stderr
        picture = Picture(file)
        n = picture.channels
        return [row[x:x + 3] for row in picture.rows for x in range(0, n * picture.width, n)], done.stderr

    pixels, messages = fire("fire")
    burnt, orange, pale, dark = (sum(map(test, pixels)) / len(pixels) for test in (
        lambda p: min(p) > 250, lambda p: p[0] > 150 and p[0] > 1.4 * p[2] and p[0] > 1.15 * p[1],
        lambda p: p[0] > 240 and p[2] > 150 and p[0] > 1.1 * p[2], lambda p: max(p) < 70))
    print(f"fire: burnt {100 * burnt:.2f} %, orange {100 * orange:.2f} %, pale {100 * pale:.2f} %, dark {100 * dark:.2f} %")
    assert burnt < 0.002 and orange > 0.03 and pale < 0.01 and dark > 0.01, (burnt, orange, pale, dark)
    assert messages.count("using dusk light, --tone-map filmic and --exposure 1 ") == 1, messages
    # Any option of the look keeps the daylight.
    blue = lambda pixels: sum(p[2] - p[0] for p in pixels[:8 * 64]) / (8 * 64)  # of the sky
    for number, given in enumerate((["--tone-map", "neutral"], ["--exposure", "0"])):
        day, messages = fire(f"day{number}", *given)
        assert "dusk" not in messages and blue(day) > blue(pixels) + 20, (given, blue(day), blue(pixels), messages)
    assert "dusk" in fire("linear", ending="exr")[1], "linear radiance has the light too"
    sequence(render, explosion, out)
    smoke(render, explosion, out)


main()
