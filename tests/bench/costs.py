"""What channels and lights cost: cumulet-render on one volume in variants that take turns, as ratios of one run.

    python3 tests/bench/costs.py RENDER VOLUME [--fire FILE --colour GRID] [--env FILE] [--beside X,Y,Z] [--within X,Y,Z]
    python3 tests/bench/costs.py RENDER VOLUME --march --fire FILE [--thresholds T...]

Each table's first row is what the others are held against. Noise is the standard deviation of a pixel over the picture's
mean, from two seeds, without the noisiest 0.5 % of pixels; "time" is what the same noise takes.
"""

import argparse
import array
import json
import pathlib
import statistics
import subprocess
import tempfile

GLOW = ["--blackbody", "12", "--flame-strength", "9", "--flame-color", "1,0.3,0.05"]
DARK = ["--temperature-grid", "none", "--flame-grid", "none"]
SKY = ["--sky", "0.3,0.4,0.6"]
SUN = ["--sun", "60,35 3,2.7,2.3"]


def picture(file):
    with open(file, "rb") as f:
        f.readline()
        width, height = map(int, f.readline().split())
        f.readline()
        rgb = array.array("f", f.read(width * height * 12))
    return width, height, [0.2126 * rgb[i] + 0.7152 * rgb[i + 1] + 0.0722 * rgb[i + 2] for i in range(0, len(rgb), 3)]


def variance(a, b):
    """Of a pixel, over the mean's square."""
    mean = sum(a + b) / (2 * len(a))
    squares = sorted((p - q) ** 2 / 2 for p, q in zip(a, b))[: int(len(a) * 0.995)]
    return sum(squares) / len(squares) / mean**2


def blocks(file):
    width, height, light = picture(file)
    return [sum(light[y * width + x] for y in range(j, j + 8) for x in range(i, i + 8))
            for j in range(0, height - 7, 8) for i in range(0, width - 7, 8)]


class Bench:
    def __init__(self, options, folder):
        self.options, self.folder = options, folder

    def render(self, name, flags, seed):
        out, stats = self.folder / f"{name}_{seed}.pfm", self.folder / "stats.json"
        command = [self.options.render, *flags, "--size", self.options.size, "--spp", str(self.options.spp),
                   "--seed", str(seed), "--stats", str(stats), "-o", str(out)]
        subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
        return json.loads(stats.read_text()), out

    def take_turns(self, title, variants):
        """variants: {name: flags}. Prints the table; returns what was drawn."""
        runs = {name: [] for name in variants}
        drawn = {name: [] for name in variants}
        for repeat in range(self.options.repeats):
            for name, flags in variants.items():
                stats, out = self.render(name.replace(" ", "_"), flags, repeat)
                runs[name].append(stats)
                drawn[name].append(out)
        first = next(iter(variants))
        print(f"\n| {title} | Cells | Steps a path | A step, x | A sample, x | Noise, % | Time to the same noise, x |")
        print("|---|--:|--:|--:|--:|--:|--:|", flush=True)
        rows = {}
        for name in variants:
            step = [r["trace_seconds"] / (r["mean_steps_per_path"] * r["samples"]) for r in runs[name]]
            sample = [r["trace_seconds"] / r["samples"] for r in runs[name]]
            noise = variance(*(picture(f)[2] for f in drawn[name][:2]))
            rows[name] = step, sample, noise
        for name, (step, sample, noise) in rows.items():
            ratio = lambda of: statistics.median(a / b for a, b in zip(rows[name][of], rows[first][of]))
            print(f"| {name} | {runs[name][0].get('cells', 0) / 1e3:.0f}k | {runs[name][0]['mean_steps_per_path']:.0f} | "
                  f"{ratio(0):.2f} | {ratio(1):.2f} | {100 * noise ** 0.5:.1f} | "
                  f"{ratio(1) * noise / rows[first][2]:.2f} |", flush=True)
        return drawn


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("render")
    parser.add_argument("volume")
    parser.add_argument("--fire", help="a file of density, temperature and flame, for the table of channels")
    parser.add_argument("--colour", help="its grid of colours")
    parser.add_argument("--env", help="an environment, for the table of lights")
    parser.add_argument("--beside", metavar="X,Y,Z", help="where a lamp stands outside the volume")
    parser.add_argument("--within", metavar="X,Y,Z", help="and one in it")
    parser.add_argument("--march", action="store_true", help="only the marches, on --fire, with the light it gives off")
    parser.add_argument("--thresholds", nargs="*", default=["0.02"], help="of the tetrahedra held against dense")
    parser.add_argument("--size", default="128x128")
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    if options.march and not options.fire:
        parser.error("--march needs --fire")
    if options.repeats < 2:
        parser.error("--repeats: two pictures at least, for their noise")
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(options, pathlib.Path(folder))
        if options.march:
            fire = ["--volume", options.fire, "--density-scale", "9", *GLOW, *SKY, *SUN]
            variants = {"dense": [*fire, "--march", "dense"], "brick": [*fire, "--march", "brick"]}
            for threshold in options.thresholds:
                variants[f"tet {threshold}"] = [*fire, "--threshold", threshold]
            drawn = bench.take_turns("March", variants)
            # The error of 8x8 blocks: products of two independent halves, so that noise does not enter.
            halves = {name: [[sum(p) for p in zip(*(blocks(f) for f in files[k::2]))] for k in (0, 1)]
                      for name, files in drawn.items()}
            count = {name: [len(files[k::2]) for k in (0, 1)] for name, files in drawn.items()}
            for name in list(variants)[1:]:
                differences = [[p / count[name][k] - q / count["dense"][k]
                                for p, q in zip(halves[name][k], halves["dense"][k])] for k in (0, 1)]
                square = sum(p * q for p, q in zip(*differences)) / len(differences[0])
                mean = sum(halves["dense"][0]) / count["dense"][0] / len(halves["dense"][0])
                print(f"error of {name}: {100 * max(square, 0) ** 0.5 / mean:.2f} % of the mean")
            return
        if options.fire:
            fire = ["--volume", options.fire, *SKY, *SUN]
            variants = {"density": [*fire, *DARK], "+ emission": [*fire, *GLOW]}
            if options.colour:
                variants["+ colour"] = [*fire, *DARK, "--color-grid", options.colour]
                variants["+ both"] = [*fire, *GLOW, "--color-grid", options.colour]
            bench.take_turns("Channels", variants)
        cloud = ["--volume", options.volume, *DARK]
        variants = {"constant sky": [*cloud, *SKY], "sun": [*cloud, *SUN], "sun and sky": [*cloud, *SUN, *SKY],
                    "physical sky": [*cloud, "--sky-model", "3,0.2", "--sun", "60,35 1,1,1"]}
        if options.env:
            variants["environment"] = [*cloud, "--env", options.env]
        for name, place in (("point lamp beside it", options.beside), ("point lamp in it", options.within)):
            if place:
                lit = {"cumulet_scene": 2, "volumes": [{"file": str(pathlib.Path(options.volume).resolve())}],
                       "lights": [{"kind": "point", "position": [float(x) for x in place.split(",")], "power": 1e5}]}
                scene = pathlib.Path(folder) / f"{name.replace(' ', '_')}.json"
                scene.write_text(json.dumps(lit))
                variants[name] = ["--scene", str(scene), *DARK]
        bench.take_turns("Light", variants)


main()
