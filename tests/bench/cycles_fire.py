"""Renders one volume, which may emit light, with cumulet-render and with Blender's Cycles, and compares the images.
Both read the same file, without resampling: Cycles interpolates linearly between voxels, and so does Cumulet with
linear interpolation. Prints a row of a Markdown table per grid type with the columns of results/cycles_linear.csv, and
writes fire.png (ours, Cycles', eight times the difference of the last row) to the folder --out.

Each renderer renders two seeds. The peer renderer runs cycles.py, which needs Blender 3.4 and numpy. Its pictures are
kept in --out and used again if the scene and the options are the same.
"""

import argparse
import json
import os
import pathlib
import re
import shutil
import sys

import cycles_gltf
from cycles_gltf import PEER_PATH, SKY, SUN, Unusable, compare, numpy, read_pfm, run, write_png

FOVY = 40


def channels(ours, theirs):
    """Returns the means of red, green and blue relative to Cycles, in percent, where there is more than sky."""
    a, b = (sum(images) / 2 for images in (ours, theirs))
    shown = abs(b - numpy.array(SKY["radiance"])).max(axis=2) > 1e-4
    return " ".join(f"{100 * (a[shown][:, i].sum() / b[shown][:, i].sum() - 1):+.2f}" for i in range(3))


def described(options):
    """Returns the scene for Cumulet and the scene for Cycles."""
    medium = {"density_scale": options.density_scale, "albedo": [options.albedo] * 3, "max_bounces": options.max_bounces}
    if options.flame:
        medium.update(flame_grid=options.flame, flame_strength=options.flame_strength, flame_color=[1, 0.6, 0.3])
    if options.temperature:
        medium.update(temperature_grid=options.temperature, temperature_scale=options.temperature_scale, blackbody=options.blackbody)
    if options.color:
        medium.update(color_grid=options.color)
    camera = {"eye": options.eye, "target": options.target, "fovy_degrees": FOVY}
    # Cycles places voxels half a voxel further along each axis than OpenVDB.
    shift = [options.voxel / 2] * 3
    ours = {"cumulet_scene": 3, "camera": camera, "sun_sky": {"sun": SUN, "sky": SKY},
            "volumes": [{"file": str(options.file.resolve()), "grid": options.grid, "translate": shift,
                         "medium": {**dict.fromkeys(("temperature_grid", "flame_grid", "color_grid"), "none"), **medium}}]}
    theirs = {"camera": camera, "light": {"sun": SUN, "sky": SKY}, "volume": {"file": str(options.file.resolve()), "grid": options.grid},
              "medium": medium}
    return ours, theirs


def render_ours(options, description, grid_type):
    scene = options.out / "scene.json"
    scene.write_text(json.dumps(description))
    files, cells = [], 0
    for seed in (1, 2):
        file, stats = options.out / f"{grid_type}{seed}.pfm", options.out / "stats.json"
        run([options.render, "--scene", scene, "--size", options.size, "--spp", options.spp, "--seed", seed, "-o", file, "--stats", stats,
             "--grid-type", grid_type, "--interpolation", options.interpolation,
             *(["--threshold", options.threshold] if options.threshold else [])])
        cells = json.loads(stats.read_text()).get("cells", "")
        files.append(file)
    return files, cells


def render_theirs(options, description):
    made_from = json.dumps([description, options.size, options.peer_spp, options.step])
    made, scene = options.out / "cycles.made", options.out / "cycles.json"
    files = [options.out / f"cycles{seed}.pfm" for seed in (1, 2)]
    if made.exists() and made.read_text() == made_from:
        return files
    made.unlink(missing_ok=True)
    scene.write_text(json.dumps(description))
    environment = dict(os.environ, STEP=str(options.step), PATH=PEER_PATH)
    for seed, file in zip((1, 2), files):
        file.unlink(missing_ok=True)
        said = run(["blender", "-b", "--python", options.peer / "cycles.py", "--", scene, options.size, options.peer_spp, seed, file],
                   env=environment)
        if not file.exists():
            errors = [line for line in said.splitlines() if "Error" in line]
            raise Unusable("Cycles: " + (errors[-1] if errors else "no picture"))
        print(f"Cycles, seed {seed}: {re.search(r'SECONDS ([0-9.]+)', said).group(1)} s", file=sys.stderr)
    made.write_text(made_from)
    return files


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("render", type=pathlib.Path, help="cumulet-render")
    parser.add_argument("peer", type=pathlib.Path, help="folder of cycles.py")
    parser.add_argument("file", type=pathlib.Path, help="a .vdb without rotation")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder for scenes and pictures")
    parser.add_argument("--voxel", type=float, required=True, help="width of the file's voxels")
    parser.add_argument("--eye", type=float, nargs=3, required=True, metavar=("X", "Y", "Z"))
    parser.add_argument("--target", type=float, nargs=3, required=True, metavar=("X", "Y", "Z"))
    parser.add_argument("--size", default="48x40")
    parser.add_argument("--spp", type=int, default=256, help="samples per pixel and seed")
    parser.add_argument("--peer-spp", type=int, default=64)
    parser.add_argument("--step", type=float, default=0.25, help="Cycles' volume step rate: it marches by steps of so many voxels")
    parser.add_argument("--grid-types", nargs="*", default=["bricks", "dense", "tetrahedral"])
    parser.add_argument("--interpolation", default="linear", choices=["linear", "nearest"])
    parser.add_argument("--threshold", type=float, help="of our grids")
    parser.add_argument("--grid", default="density")
    parser.add_argument("--density-scale", type=float, default=1.0)
    parser.add_argument("--albedo", type=float, default=0.6)
    parser.add_argument("--max-bounces", type=int, default=0)
    parser.add_argument("--color", help="grid of colors")
    parser.add_argument("--flame", help="grid of a flame")
    parser.add_argument("--flame-strength", type=float, default=1.0)
    parser.add_argument("--temperature", help="grid of temperatures")
    parser.add_argument("--temperature-scale", type=float, default=1500.0)
    parser.add_argument("--blackbody", type=float, default=1.0)
    parser.add_argument("--within", type=float, nargs=2, metavar=("MEAN", "BLOCKS"), help="fail where they differ by more, in %%, beyond the noise")
    options = parser.parse_args()
    for missing, what in ((numpy is None, "numpy"), (not shutil.which("blender", path=PEER_PATH), "Blender"),
                          (not (options.peer / "cycles.py").exists(), f"{options.peer}/cycles.py"), (not options.file.exists(), f"{options.file}")):
        if missing:
            print(f"skipped: there is no {what}")
            sys.exit(77)
    options.out.mkdir(parents=True, exist_ok=True)
    ours, theirs = described(options)
    b = [read_pfm(file) for file in render_theirs(options, theirs)]
    print("| Grid type | Cells | Step of Cycles | Mean, % | Blocks, % (their noise) | Worst block, % (its noise), at "
          "| Red, green, blue, % |\n|---|--:|--:|--:|--:|--:|--:|")
    failed = False
    for grid_type in options.grid_types:
        files, cells = render_ours(options, ours, grid_type)
        a = [read_pfm(file) for file in files]
        found = compare(b, a)
        x, y = found["worst_at"]
        print(f"| {grid_type} | {cells} | {options.step:g} | {100 * found['mean']:+.2f} ± {100 * found['mean_noise']:.2f} "
              f"| {100 * found['blocks']:.2f} ({100 * found['blocks_noise']:.2f}) "
              f"| {100 * found['worst']:+.1f} ({100 * found['worst_noise']:.1f}), {x} {y} "
              f"| {channels(a, b)} |", flush=True)
        first, second = (sum(images) / 2 for images in (a, b))
        write_png(options.out / "fire.png", numpy.concatenate([first, second, 0.5 + 8 * (first - second) / 2], axis=1))
        if options.within:
            mean, blocks = options.within
            failed |= 100 * (abs(found["mean"]) - 2 * found["mean_noise"]) > mean or 100 * found["blocks"] > blocks
    sys.exit(failed)


main()
