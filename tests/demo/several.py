"""Scene files of several volumes: cumulet-render shows them as the files say.

several.py CUMULET_RENDER CLOUD_VDB FIRE_VDB FOLDER
"""

import array
import json
import pathlib
import shutil
import subprocess
import sys

program, cloud, fire, folder = sys.argv[1], sys.argv[2], sys.argv[3], pathlib.Path(sys.argv[4])
shutil.rmtree(folder, ignore_errors=True)
folder.mkdir(parents=True)


def run(name, volumes, *flags, **keys):
    """Runs the program and returns the process. An image is written to folder/name.pfm. keys: further keys of the
    scene."""
    scene = folder / f"{name}.json"
    camera = {"eye": [0, 20, 130], "target": [0, 15, 0]}
    picture = {"width": 64, "height": 48, "samples": 64}
    whole = {"cumulet_scene": 2, "volumes": volumes, "camera": camera, "picture": picture, **keys}
    scene.write_text(json.dumps(whole))
    command = [program, "--scene", scene, "--output", folder / f"{name}.pfm", "--stats", folder / f"{name}.stats", *flags]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def render(name, volumes, *flags, **keys):
    """Returns the content of the image file."""
    done = run(name, volumes, *flags, **keys)
    assert done.returncode == 0, (name, done.stderr)
    return (folder / f"{name}.pfm").read_bytes()


def mean(pfm):
    values = array.array("f", pfm[-4 * 3 * 64 * 48 :])
    return sum(values) / len(values)


def stats(name):
    return json.loads((folder / f"{name}.stats").read_text())


def cells(name):
    return stats(name)["cells"]


def near(a, b, part):
    return abs(a - b) <= part * abs(b)


def volume(file, scale, **more):
    return {"file": file, "medium": {"density_scale": scale, "albedo": [0.9, 0.8, 0.7]}, **more}


hidden = {"visible": False}
moved = {"places": [{"translate": [40, 10, 45], "rotate_degrees": [0, 90, 0], "scale": [3, 3, 3]}]}

whole = render("whole", [volume(cloud, 0.8)])
halves = render("halves", [volume(cloud, 0.4), volume(cloud, 0.4)])
assert near(mean(halves), mean(whole), 0.01), (mean(halves), mean(whole))
assert cells("halves") <= 1.02 * cells("whole"), "one grid for both"

# A hidden volume changes no bit of the image, and its file need not exist.
assert render("hidden", [volume(cloud, 0.8), volume("/nowhere.vdb", 1, **hidden)]) == whole
# The order of the volumes does not matter, and a cloud as the second volume gives the same image.
other = render("other", [volume(fire, 1, **hidden), volume(cloud, 0.8)])
assert near(mean(other), mean(whole), 0.01), (mean(other), mean(whole))
two = render("two", [volume(cloud, 0.8), volume(fire, 2, **moved)])
again = render("again", [volume(fire, 2, **moved), volume(cloud, 0.8)])
assert near(mean(again), mean(two), 0.01), (mean(again), mean(two))
assert not near(mean(two), mean(whole), 0.01), "the second is to be seen"
# Instance transforms of a second volume have the same effect as those of the first.
places = {"places": [{"translate": [-25, 0, 0]}, {"translate": [25, 0, 0]}]}
first = render("first_places", [volume(cloud, 0.8, **places)])
second = render("second_places", [volume(fire, 1, **hidden), volume(cloud, 0.8, **places)])
assert near(mean(second), mean(first), 0.01), (mean(second), mean(first))

# All of them are interpolated linearly unless the scene or a flag says otherwise.
assert {stats(name)["interpolation"] for name in ("whole", "two", "second_places")} == {"linear"}
assert render("linear", [volume(cloud, 0.8)], grid={"interpolation": "linear"}) == whole
nearest = render("nearest", [volume(cloud, 0.8)], grid={"interpolation": "nearest"})
assert nearest != whole and stats("nearest")["interpolation"] == "nearest"
assert render("auto", [volume(cloud, 0.8)], "--interpolation", "auto", grid={"interpolation": "nearest"}) == whole
assert render("flag", [volume(cloud, 0.8)], "--interpolation", "nearest") == nearest

# The camera is one of the scene's cameras, by name.
cameras = [{"name": "front", "eye": [0, 20, 130], "target": [0, 15, 0]},
           {"name": "above", "eye": [0, 200, 1], "target": [0, 15, 0]}]
assert render("front", [volume(cloud, 0.8)], camera="front", cameras=cameras) == whole
above = render("above", [volume(cloud, 0.8)], "--scene-camera", "above", camera="front", cameras=cameras)
assert above != whole
pose = {key: cameras[1][key] for key in ("eye", "target")}
assert render("posed", [volume(cloud, 0.8)], camera=pose) == above

missing = run("missing", [volume(cloud, 0.8), volume("/nowhere.vdb", 1)])
assert missing.returncode != 0 and missing.stderr.count("\n") == 1 and "/nowhere.vdb" in missing.stderr, missing.stderr
dense = run("dense", [volume(cloud, 0.8), volume(fire, 1)], "--grid-type", "dense")
assert dense.returncode != 0 and dense.stderr.count("\n") == 1 and "dense" in dense.stderr, dense.stderr
