"""Ends processes while viewers work, at random times: exits.py HOST LOADING_HOST LIBRARY VOLUME FOLDER

Each must exit in time with the status that its host chose, without output on standard error.
"""

import base64
import json
import math
import os
import random
import shutil
import struct
import subprocess
import sys

HOST, LOADING_HOST, LIBRARY, VOLUME, FOLDER = sys.argv[1:6]
SEED = int(os.environ.get("CUMULET_EXIT_SEED", "1"))
ROUNDS = int(os.environ.get("CUMULET_EXIT_ROUNDS", "1"))
LEFT_WELL = 7
TIMEOUT = 30
WORK = ["load", "build", "pose", "sequence", "live"]
WAYS = ["exit", "return", "thread", "callback", "static", "fork", "unload"]


def write_model(path, side=64):
    """Writes an animated model: a rotating sheet of 2 x side x side triangles."""
    points = [(x / side, 0.1 * math.sin(9 * x / side), z / side) for z in range(side + 1) for x in range(side + 1)]
    indices = []
    for z in range(side):
        for x in range(side):
            a = z * (side + 1) + x
            indices += [a, a + side + 1, a + 1, a + 1, a + side + 1, a + side + 2]
    parts = [
        b"".join(struct.pack("<3f", *p) for p in points),
        struct.pack(f"<{len(indices)}I", *indices),
        struct.pack("<2f", 0.0, 1.0),
        struct.pack("<8f", 0, 0, 0, 1, 0, 1, 0, 0),
    ]
    views, offset = [], 0
    for part in parts:
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(part)})
        offset += len(part)
    low, high = ([f(p[i] for p in points) for i in range(3)] for f in (min, max))
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3", "min": low, "max": high},
        {"bufferView": 1, "componentType": 5125, "count": len(indices), "type": "SCALAR"},
        {"bufferView": 2, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0.0], "max": [1.0]},
        {"bufferView": 3, "componentType": 5126, "count": 2, "type": "VEC4"},
    ]
    data = base64.b64encode(b"".join(parts)).decode()
    model = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "animations": [
            {
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}],
                "samplers": [{"input": 2, "output": 3}],
            }
        ],
        "buffers": [{"byteLength": offset, "uri": "data:application/octet-stream;base64," + data}],
        "bufferViews": views,
        "accessors": accessors,
    }
    with open(path, "w", encoding="utf-8") as file:
        json.dump(model, file)


def write_files():
    os.makedirs(FOLDER, exist_ok=True)
    shutil.copy(VOLUME, f"{FOLDER}/cloud.vdb")
    for frame in range(4):
        shutil.copy(VOLUME, f"{FOLDER}/clip.{frame}.vdb")
    write_model(f"{FOLDER}/wave.gltf")
    width, height = 256, 128
    with open(f"{FOLDER}/sky.hdr", "wb") as file:
        file.write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width))
        file.write(b"\x80\x80\x80\x81" * (width * height))


def commands(moments):
    """Tests each kind of work with each way to exit; then scripts, and frames."""

    def moment():
        # Half of the times fall into the first jobs, which create the statics of other libraries.
        return str(moments.choice([moments.randrange(0, 12), moments.randrange(0, 120)]))

    for work in WORK:
        for way in WAYS:
            host = LOADING_HOST if way == "unload" else HOST
            yield [host, work, way, moment(), FOLDER]
    for work in ["load", "pose", "load", "pose", "load"]:
        yield [sys.executable, os.path.dirname(os.path.abspath(__file__)) + "/ctypes_host.py", LIBRARY, work, moment(), FOLDER]
    for way in ["exit", "thread", "callback"]:
        yield [HOST, "frames", way, str(300 + int(moment())), FOLDER]


def ends_well(command):
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False)
    except subprocess.TimeoutExpired:
        print(f"HANGS: {' '.join(command)}")
        return False
    if done.returncode == LEFT_WELL and not done.stderr:
        return True
    print(f"FAILED with status {done.returncode}: {' '.join(command)}\n{done.stderr}")
    return False


def main():
    write_files()
    moments = random.Random(SEED)
    all_commands = [command for _ in range(ROUNDS) for command in commands(moments)]
    bad = sum(not ends_well(command) for command in all_commands)
    print(f"{len(all_commands)} exits, {bad} of them wrong")
    sys.exit(1 if bad else 0)


main()
