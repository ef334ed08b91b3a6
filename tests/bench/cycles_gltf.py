"""Renders glTF models with cumulet-render and with Blender's Cycles, all materials made matte, and compares the images.
Prints one row of a Markdown table per model and writes MODEL.png (ours, Cycles', eight times the difference) to the
folder --out.

Both renderers read the same file. First, features that only one of them supports are removed, and the row lists them:
animations, lights, transmission, unlit materials, images that are neither PNG nor JPEG. Triangles without a material
get a white one. Cycles has no single-sided surfaces, so all surfaces are made double-sided.

The peer renderer runs cycles.py, with lambert.py next to it. It needs Blender 3.4 and, in Blender's Python, numpy.
results/cycles_models.csv lists the results.
"""

import argparse
import base64
import json
import math
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import urllib.parse
import zlib

try:
    import numpy
except ImportError:
    numpy = None

SUN = {"azimuth_degrees": 35, "elevation_degrees": 40, "irradiance": [2.5, 2.5, 2.5]}
SKY = {"radiance": [0.5, 0.5, 0.5]}
FOVY = 40
BLOCK = 8
# Debian's Blender runs the first python3 in PATH, which must be Debian's too.
PEER_PATH = "/usr/bin:" + os.environ["PATH"]


class Unusable(Exception):
    """A model that one of the two renderers cannot show. The message gives the reason."""


def read_model(path):
    """Returns the JSON of a .gltf or .glb and its binary chunk."""
    data = path.read_bytes()
    if data[:4] != b"glTF":
        return json.loads(data), b""
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20:20 + length]), data[28 + length:]


def pack(model, binary, folder):
    """Returns one binary chunk with all data that the model refers to, and points the model to it."""
    def resolve(uri):
        if uri.startswith("data:"):
            return base64.b64decode(uri.split(",", 1)[1])
        return (folder / urllib.parse.unquote(uri)).read_bytes()

    chunk = bytearray()

    def append(data):
        chunk.extend(b"\0" * (-len(chunk) % 4))
        chunk.extend(data)
        return len(chunk) - len(data)

    starts = [append(resolve(b["uri"]) if "uri" in b else binary[:b["byteLength"]]) for b in model.get("buffers", [])]
    for view in model.get("bufferViews", []):
        view["byteOffset"] = view.get("byteOffset", 0) + starts[view["buffer"]]
        view["buffer"] = 0
    for image in model.get("images", []):
        if "uri" not in image:
            continue
        data = resolve(image.pop("uri"))
        image["bufferView"] = len(model.setdefault("bufferViews", []))
        image["mimeType"] = {b"\x89PN": "image/png", b"\xff\xd8\xff": "image/jpeg"}.get(data[:3], "image/ktx2")
        model["bufferViews"].append({"buffer": 0, "byteOffset": append(data), "byteLength": len(data)})
    model["buffers"] = [{"byteLength": len(chunk)}]
    return bytes(chunk)


def simplify(model, animation=None):
    """Removes features that only one renderer supports, and all animations but the given one. Returns their names."""
    changes = []
    animations = model.pop("animations", [])
    if animation is not None:
        model["animations"] = [animations[animation]]
    elif animations:
        changes.append("animation")
    if "KHR_lights_punctual" in model.get("extensions", {}):
        changes.append("lights")
    model.pop("extensions", None)
    for node in model.get("nodes", []):
        node.pop("camera", None)
        node.get("extensions", {}).pop("KHR_lights_punctual", None)
    model.pop("cameras", None)
    readable = [image.get("mimeType") in ("image/png", "image/jpeg") for image in model.get("images", [])]
    whole = [readable[texture["source"]] if "source" in texture else False for texture in model.get("textures", [])]

    def has_whole(name, info):
        usable = not name.endswith("Texture") or whole[info["index"]]
        if not usable and "images" not in changes:
            changes.append("images")
        return usable

    for material in model.get("materials", []):
        for part in (material, material.get("pbrMetallicRoughness", {})):
            for name in [n for n, info in part.items() if not has_whole(n, info)]:
                del part[name]
        extensions = material.get("extensions", {})
        if "KHR_materials_transmission" in extensions:
            changes.append("transmission")
        if extensions.pop("KHR_materials_unlit", None) is not None:
            changes.append("unlit")
    materials = model.setdefault("materials", [])
    for mesh in model.get("meshes", []):
        for primitive in mesh["primitives"]:
            primitive.setdefault("material", len(materials))
            if primitive.get("extensions", {}).pop("KHR_materials_variants", None):
                changes.append("variants")
    materials.append({"name": "white"})
    return ", ".join(sorted(set(changes)))


def read_nearest_texels(model):
    samplers = model.setdefault("samplers", [])
    for texture in model.get("textures", []):
        texture.setdefault("sampler", len(samplers))
    samplers.append({})
    for sampler in samplers:
        sampler.update(magFilter=9728, minFilter=9728)


def write_glb(path, model, chunk):
    text = json.dumps(model, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunk += b"\0" * (-len(chunk) % 4)
    parts = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(chunk), b"BIN\0") + chunk
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(parts)) + parts)


def run(command, **arguments):
    """Returns the standard output of a program. If the program fails, raises an error with its last line of output."""
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **arguments)
    if done.returncode:
        said = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
        raise Unusable(said[-1] if said else f"{command[0]}: exit status {done.returncode}")
    return done.stdout


def fitted_camera(low, high, aspect):
    """Returns the camera with which cumulet fits bounds: from +Z and slightly above."""
    target = [(a + b) / 2 for a, b in zip(low, high)]
    back = numpy.array([0, 0.2, 1]) / math.hypot(0.2, 1)
    right = numpy.array([1.0, 0, 0])
    up = numpy.cross(back, right)
    tangent = math.tan(math.radians(FOVY) / 2)
    distance = 0.0
    for corner in range(8):
        q = numpy.array([(high if corner >> i & 1 else low)[i] - target[i] for i in range(3)])
        needed = max(abs(q @ right) / (tangent * aspect), abs(q @ up) / tangent)
        distance = max(distance, q @ back + needed)
    return {"eye": [t + distance * b for t, b in zip(target, back)], "target": target, "fovy_degrees": FOVY}


def read_pfm(path):
    with path.open("rb") as file:
        file.readline()
        width, height = map(int, file.readline().split())
        scale = float(file.readline())
        return numpy.frombuffer(file.read(), "<f4" if scale < 0 else ">f4").reshape(height, width, 3).astype(float)


def write_png(path, image):
    """Writes linear rows, bottom row first, as an sRGB PNG."""
    level = numpy.clip(image[::-1], 0, 1)
    level = numpy.where(level > 0.0031308, 1.055 * level ** (1 / 2.4) - 0.055, 12.92 * level)
    rows = (level * 255 + 0.5).astype(numpy.uint8)
    raw = b"".join(b"\0" + row.tobytes() for row in rows)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", rows.shape[1], rows.shape[0], 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b""))


def blocks_of(image):
    height, width = (BLOCK * (n // BLOCK) for n in image.shape)
    return image[:height, :width].reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK).sum(axis=(1, 3))


def compare(ours, theirs):
    """Compares two images each, of two seeds: differences relative to ours, over the blocks with more than sky, and
    their noise."""
    weights = numpy.array([0.2126, 0.7152, 0.0722])
    a1, a2, b1, b2 = (image @ weights for image in (*ours, *theirs))
    sky = numpy.array(SKY["radiance"]) @ weights
    shows = numpy.zeros(a1.shape, bool)
    for image in (a1, a2, b1, b2):
        shows |= abs(image - sky) > 1e-4 * sky
    shown = blocks_of(shows.astype(float)) > 0
    if not shown.any():
        raise Unusable("nothing is in sight")
    a = blocks_of((a1 + a2) / 2)[shown]
    b = blocks_of((b1 + b2) / 2)[shown]
    variance = blocks_of(((a1 - a2) ** 2 + (b1 - b2) ** 2) / 4)[shown]
    least = 0.01 * a.mean()  # a relative difference is meaningless where the image is nearly black
    difference = (b - a) / numpy.maximum(a, least)
    noise = numpy.sqrt(variance) / numpy.maximum(a, least)
    square = (difference ** 2).mean() - (noise ** 2).mean()
    worst = numpy.argmax(abs(difference) - 2 * noise)
    rows, columns = numpy.nonzero(shown)
    return {"mean": b.sum() / a.sum() - 1, "mean_noise": math.sqrt(variance.sum()) / a.sum(),
            "blocks": math.sqrt(max(0.0, square)), "blocks_noise": math.sqrt((noise ** 2).mean()),
            "worst": difference[worst], "worst_noise": noise[worst],
            "worst_at": (BLOCK * columns[worst], a1.shape[0] - BLOCK * (rows[worst] + 1))}


def render(model_file, options, out):
    """Renders two seeds with each renderer. Returns the images, the removed features, the triangle count and both
    render times in seconds."""
    if not json.loads(run([options.render, "--info", "--json", model_file]))["surfaces"]["triangles"]:
        raise Unusable("no triangles")
    try:
        model, binary = read_model(model_file)
        chunk = pack(model, binary, model_file.parent)
        changes = simplify(model)
        if options.nearest:
            read_nearest_texels(model)
    except (OSError, ValueError, KeyError, IndexError, TypeError, AttributeError, struct.error) as error:
        raise Unusable(f"{type(error).__name__}: {error}") from error
    packed, matte, scene, peer_scene = (out.with_name(out.name + end) for end in (".packed.glb", ".glb", ".json", ".cycles.json"))
    write_glb(packed, model, chunk)
    run([sys.executable, options.peer / "lambert.py", packed, matte])
    packed.unlink()
    info = json.loads(run([options.render, "--info", "--json", matte]))["surfaces"]
    width, height = map(int, options.size.split("x"))
    description = {
        "cumulet_scene": 1, "surfaces": {"file": matte.name, "double_sided": True}, "medium": {"max_bounces": options.bounces},
        "camera": fitted_camera(info["bounds_min"], info["bounds_max"], width / height), "light": {"sun": SUN, "sky": SKY}}
    scene.write_text(json.dumps(description))
    ours, theirs = ([out.with_name(f"{out.name}.{who}{seed}.pfm") for seed in (1, 2)] for who in ("ours", "cycles"))
    seconds = [0.0, 0.0]
    for seed, file in enumerate(ours, 1):
        stats = file.with_suffix(".json")
        run([options.render, "--scene", scene, "--size", options.size, "--spp", options.spp, "--seed", seed, "-o", file,
             "--stats", stats])
        seconds[0] += json.loads(stats.read_text())["trace_seconds"]
        stats.unlink()
    # Cycles counts path segments between surfaces, cumulet counts surface hits.
    description["medium"]["max_bounces"] -= 1
    peer_scene.write_text(json.dumps(description))
    environment = dict(os.environ, LAMBERT="1", PATH=PEER_PATH)
    alpha = pathlib.Path(__file__).with_name("cycles_alpha.py")
    for seed, file in enumerate(theirs, 1):
        file.unlink(missing_ok=True)
        said = run(["blender", "-b", "--python", alpha, "--python", options.peer / "cycles.py", "--", peer_scene, options.size, options.peer_spp, seed,
                    file], env=environment)
        if not file.exists():
            errors = [line for line in said.splitlines() if "Error" in line]
            raise Unusable("Cycles: " + (errors[-1] if errors else "no picture"))
        seconds[1] += float(re.search(r"SECONDS ([\d.]+)", said).group(1))
    return [read_pfm(f) for f in ours], [read_pfm(f) for f in theirs], changes, info["triangles"], seconds


def models_of(paths):
    """Yields (file, name) of each glTF in the files and folders."""
    for path in paths:
        files = [path] if path.is_file() else sorted(p for p in path.rglob("*") if p.suffix in (".gltf", ".glb"))
        for file in files:
            yield file, file.relative_to(path if path.is_dir() else path.parent)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("render", type=pathlib.Path, help="cumulet-render")
    parser.add_argument("peer", type=pathlib.Path, help="folder of cycles.py and lambert.py")
    parser.add_argument("models", type=pathlib.Path, nargs="+", help=".gltf, .glb or folders of them")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder for scenes and pictures")
    parser.add_argument("--size", default="128x128")
    parser.add_argument("--spp", type=int, default=32, help="samples per pixel and seed")
    parser.add_argument("--peer-spp", type=int, default=64, help="Cycles', whose samples are cheaper")
    parser.add_argument("--bounces", type=int, default=8, help="at least 2")
    parser.add_argument("--nearest", action="store_true",
                        help="no filter of textures: Cycles' mixes texels before it decodes sRGB, ours after, as glTF has it")
    parser.add_argument("--within", type=float, nargs=2, metavar=("MEAN", "BLOCKS"),
                        help="fail where a model differs by more, in %%, beyond the noise")
    options = parser.parse_args()
    for missing, what in ((numpy is None, "numpy"), (not shutil.which("blender", path=PEER_PATH), "Blender"),
                          (not (options.peer / "cycles.py").exists(), f"{options.peer}/cycles.py")):
        if missing:
            print(f"skipped: there is no {what}")
            sys.exit(77)
    options.out.mkdir(parents=True, exist_ok=True)
    failed = False
    print("| Model | Triangles | Mean, % | Blocks, % (their noise) | Worst block, % (its noise), at | Taken out | Seconds, ours and Cycles' |")
    print("|---|--:|--:|--:|--:|---|--:|", flush=True)
    for file, name in models_of(options.models):
        out = options.out / re.sub(r"[^\w-]+", "_", str(name.with_suffix("")))
        try:
            ours, theirs, changes, triangles, seconds = render(file, options, out)
            found = compare(ours, theirs)
        except Unusable as error:
            print(f"| {name} | - | - | - | - | - | {error} |", flush=True)
            failed = True
            continue
        a, b = (sum(images) / 2 for images in (ours, theirs))
        write_png(out.with_suffix(".png"), numpy.concatenate([a, b, 0.5 + 8 * (b - a) / 2], axis=1))
        x, y = found["worst_at"]
        print(f"| {name} | {triangles} | {100 * found['mean']:+.2f} ± {100 * found['mean_noise']:.2f} "
              f"| {100 * found['blocks']:.2f} ({100 * found['blocks_noise']:.2f}) "
              f"| {100 * found['worst']:+.1f} ({100 * found['worst_noise']:.1f}), {x} {y} | {changes or '-'} "
              f"| {seconds[0]:.0f}, {seconds[1]:.0f} |", flush=True)
        if options.within:
            mean, blocks = options.within
            failed |= 100 * (abs(found["mean"]) - 2 * found["mean_noise"]) > mean or 100 * found["blocks"] > blocks
    sys.exit(1 if options.within and failed else 0)


if __name__ == "__main__":
    main()
