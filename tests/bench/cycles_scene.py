"""Renders a scene of three overlapping volumes and two models inside them with cumulet-render and with Blender's
Cycles. All materials are matte; each renderer renders two seeds. Prints a row of a Markdown table with the columns of
results/cycles_scenes.csv and writes scene.png (ours, Cycles', eight times the difference) to the folder --out. With
--moving some objects and the camera move while the shutter is open. With --flow the scene is only a Mantaflow file with
motion blur from its velocity grid. With --deform it is only a model with motion blur from its animation.

The peer renderer runs cycles.py, after cycles_objects.py adds the features that cycles.py lacks. It needs Blender 3.4
and numpy.
"""

import argparse
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys

import cycles_gltf
from cycles_gltf import PEER_PATH, SKY, SUN, Unusable, compare, numpy, read_pfm, run, write_png

CAMERA = {"eye": [8, 40, 128], "target": [5, 27, 0], "fovy_degrees": 40}


def transform(translate, degrees=0.0, scale=(1, 1, 1)):
    """Returns a matrix, column by column: scale, then rotation about the vertical axis, then translation."""
    s, c = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    x, y, z = scale
    return [c * x, 0, -s * x, 0, 0, y, 0, 0, s * z, 0, c * z, 0, *translate, 1]


def aside(x, y, z):
    """Returns a motion from -(x, y, z) to (x, y, z) around the object's transform while the shutter is open."""
    return {"open": {"translate": [-x, -y, -z]}, "close": {"translate": [x, y, z]}}


def moving(camera, shown, models):
    """Adds motion to the scene: to the camera, two of three volumes and both models."""
    def seen(x):
        return {"eye": [camera["eye"][0] + x, *camera["eye"][1:]], "target": [camera["target"][0] + 0.7 * x, *camera["target"][1:]]}

    return ({**camera, "open": seen(-1.5), "close": seen(1.5)},
            [{**shown[0], **aside(5, 0, 0)}, shown[1], {**shown[2], **aside(0, 4, 2)}],
            [{**models[0], **aside(3, 1, 0)}, {**models[1], **aside(0, 3, 0)}])


def flow(file):
    """Returns the volume of a Mantaflow file: upright, 88 wide, dark in front of the sky."""
    return [{"file": file, "grid": "density", "velocity": "velocity", "places": [[45, 0, 0, 0, 0, 0, -45, 0, 0, 45, 0, 0, -40, -14, 46, 1]],
             "medium": {"density_scale": 1, "albedo": [0.5, 0.5, 0.5], "anisotropy": 0.3}}]


def volumes(cloud, other):
    """Returns a cloud, a stretched, sheared and colored second instance of it across the first, and a volume of another
    file."""
    sheared = transform([34, 2, 12], 40, (0.9, 0.7, 0.6))
    sheared[4] = 0.25
    return [
        {"file": cloud, "grid": "density", "places": [transform([-14, 0, 0])],
         "medium": {"density_scale": 0.1, "albedo": [1, 1, 1], "anisotropy": 0.3}},
        {"file": cloud, "grid": "density", "places": [sheared],
         "medium": {"density_scale": 0.2, "albedo": [0.95, 0.7, 0.4], "anisotropy": 0.3}},
        {"file": other, "grid": "density", "places": [transform([10, 14, 26], -30, (3.5, 3.5, 3.5))],
         "medium": {"density_scale": 0.15, "albedo": [0.5, 0.6, 0.8], "anisotropy": 0.3}}]


def matte(model_file, out, options):
    """Returns the model with the features that both renderers support, in one file, and its bounds."""
    model, binary = cycles_gltf.read_model(model_file)
    chunk = cycles_gltf.pack(model, binary, model_file.parent)
    cycles_gltf.simplify(model, options.deform)
    cycles_gltf.read_nearest_texels(model)
    packed = out.with_suffix(".packed.glb")
    cycles_gltf.write_glb(packed, model, chunk)
    run([sys.executable, options.peer / "lambert.py", packed, out])
    packed.unlink()
    info = json.loads(run([options.render, "--info", "--json", out]))["surfaces"]
    return info["bounds_min"], info["bounds_max"]


def standing(bounds, middle, size, degrees):
    """Returns the transform that scales a model to this size and moves its center to this point."""
    low, high = bounds
    scale = size / max(b - a for a, b in zip(low, high))
    at = transform([0, 0, 0], degrees, (scale,) * 3)
    centre = [(a + b) / 2 for a, b in zip(low, high)]
    moved = [middle[row] - sum(at[4 * i + row] * centre[i] for i in range(3)) for row in range(3)]
    return at[:12] + moved + [1]


def render_ours(options, description):
    scene = options.out / "scene.json"
    scene.write_text(json.dumps(description))
    files, seconds, cells = [], 0.0, 0
    for seed in (1, 2):
        file, stats = options.out / f"ours{seed}.pfm", options.out / "stats.json"
        run([options.render, "--scene", scene, "--size", options.size, "--spp", options.spp, "--seed", seed, "-o", file, "--stats", stats,
             "--interpolation", options.interpolation, *(["--threshold", options.threshold] if options.threshold else [])])
        said = json.loads(stats.read_text())
        seconds += said["trace_seconds"] + said["build_seconds"]["total"]
        cells = said["cells"]
        files.append(file)
    return files, seconds, cells


def render_theirs(options, description):
    scene = options.out / "cycles.json"
    scene.write_text(json.dumps(description))
    files, seconds = [], 0.0
    environment = dict(os.environ, LAMBERT="1", STEP=str(options.step), PATH=PEER_PATH)
    here = pathlib.Path(__file__)
    before = [part for name in ("cycles_objects.py", "cycles_alpha.py") for part in ("--python", here.with_name(name))]
    for seed in (1, 2):
        file = options.out / f"cycles{seed}.pfm"
        file.unlink(missing_ok=True)
        said = run(["blender", "-b", *before, "--python", options.peer / "cycles.py", "--", scene, options.size, options.peer_spp, seed, file],
                   env=environment)
        if not file.exists():
            errors = [line for line in said.splitlines() if "Error" in line]
            raise Unusable("Cycles: " + (errors[-1] if errors else "no picture"))
        seconds += float(re.search(r"SECONDS ([\d.]+)", said).group(1))
        files.append(file)
    return files, seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("render", type=pathlib.Path, help="cumulet-render")
    parser.add_argument("peer", type=pathlib.Path, help="folder of cycles.py, lambert.py and compare.py")
    parser.add_argument("files", type=pathlib.Path, nargs="+",
                        help="cumulet-scene's cumulus.vdb and explosion_0012.vdb and two models, .gltf or .glb; with --flow one of "
                             "Mantaflow's, with --deform a model")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder for scenes and pictures")
    parser.add_argument("--size", default="128x96")
    parser.add_argument("--spp", type=int, default=64, help="samples per pixel and seed")
    parser.add_argument("--peer-spp", type=int, default=64)
    parser.add_argument("--step", type=float, default=0.5, help="Cycles' volume step rate: it marches by steps of so many voxels")
    parser.add_argument("--threshold", type=float, help="of our grids")
    parser.add_argument("--interpolation", choices=("nearest", "linear"), default="nearest",
                        help="of our grids (default: nearest, as in older results; Cycles interpolates linearly)")
    motion = parser.add_mutually_exclusive_group()
    motion.add_argument("--moving", action="store_true", help="there is motion")
    motion.add_argument("--flow", action="store_true", help="one volume, which moves by its velocity")
    motion.add_argument("--deform", type=int, metavar="N", help="one model, by its animation of that number, from 0")
    parser.add_argument("--time", type=float, default=0.0, help="of --deform: seconds into the animation")
    parser.add_argument("--shutter", type=float, help="seconds (default: 1 with --moving, 0.0005 with --flow, 0.04 with --deform)")
    parser.add_argument("--within", type=float, nargs=2, metavar=("MEAN", "BLOCKS"), help="fail where they differ by more, in %%, beyond the noise")
    options = parser.parse_args()
    if len(options.files) != (1 if options.flow or options.deform is not None else 4):
        parser.error("other files are needed")
    for missing, what in ((numpy is None, "numpy"), (not shutil.which("blender", path=PEER_PATH), "Blender"),
                          (not (options.peer / "cycles.py").exists(), f"{options.peer}/cycles.py"),
                          (not all(file.exists() for file in options.files), "file of that name")):
        if missing:
            print(f"skipped: there is no {what}")
            sys.exit(77)
    options.out.mkdir(parents=True, exist_ok=True)
    camera, shown, models, shutter = CAMERA, [], [], 0.0
    if options.flow:
        shown = flow(str(options.files[0].resolve()))
        shutter = 0.0005 if options.shutter is None else options.shutter
    elif options.deform is not None:
        out = options.out / "model.glb"
        at = standing(matte(options.files[0], out, options), CAMERA["target"], 80, 60)
        models.append({"file": out.name, "to_world": at, "time": options.time})
        shutter = 0.04 if options.shutter is None else options.shutter
    else:
        shown = volumes(*(str(file.resolve()) for file in options.files[:2]))
        for number, (file, middle, size, degrees) in enumerate(zip(options.files[2:], ([-24, 24, 22], [22, 18, 40]), (40, 22), (25, -40))):
            out = options.out / f"model{number}.glb"
            models.append({"file": out.name, "to_world": standing(matte(file, out, options), middle, size, degrees)})
    if options.moving:
        camera, shown, models = moving(camera, shown, models)
        shutter = 1.0 if options.shutter is None else options.shutter
    none = dict.fromkeys(("temperature_grid", "flame_grid"), "none")
    ours = {"cumulet_scene": 2, "camera": camera, "environment": {"sun": SUN, "sky": SKY}, "picture": {"shutter_seconds": shutter},
            "volumes": [{**{key: one[key] for key in one if key != "velocity"}, "medium": {**one["medium"], **none}} for one in shown],
            "models": [{**one, "double_sided": True} for one in models]}
    theirs = {"camera": camera, "light": {"sun": SUN, "sky": SKY}, "volumes": shown, "models": models, "shutter_seconds": shutter}
    our_files, our_seconds, cells = render_ours(options, ours)
    their_files, their_seconds = render_theirs(options, theirs)
    a, b = ([read_pfm(file) for file in files] for files in (our_files, their_files))
    found = compare(a, b)
    speed = json.loads(subprocess.run([sys.executable, options.peer / "compare.py", *their_files, str(their_seconds), *our_files,
                                       str(our_seconds)], capture_output=True, text=True, check=True).stdout)
    first, second = (sum(images) / 2 for images in (a, b))
    write_png(options.out / "scene.png", numpy.concatenate([first, second, 0.5 + 8 * (second - first) / 2], axis=1))
    print("| Cells | Step of Cycles | Mean, % | Blocks, % (their noise) | Worst block, % (its noise), at "
          "| Variance of ours / Cycles', relative | Seconds, ours and Cycles' | Time to equal variance, Cycles' / ours |")
    print("|--:|--:|--:|--:|--:|--:|--:|--:|")
    x, y = found["worst_at"]
    print(f"| {cells} | {options.step:g} | {100 * found['mean']:+.2f} ± {100 * found['mean_noise']:.2f} "
          f"| {100 * found['blocks']:.2f} ({100 * found['blocks_noise']:.2f}) "
          f"| {100 * found['worst']:+.1f} ({100 * found['worst_noise']:.1f}), {x} {y} "
          f"| {speed['variance_b']:.3g} / {speed['variance_a']:.3g} | {our_seconds:.0f}, {their_seconds:.0f} | {speed['speed']:.2f} |")
    if options.within:
        mean, blocks = options.within
        sys.exit(100 * (abs(found["mean"]) - 2 * found["mean_noise"]) > mean or 100 * found["blocks"] > blocks)


main()
