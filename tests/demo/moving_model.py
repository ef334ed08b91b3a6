"""Writes a glTF model with two animations and two material variants."""

import base64
import json
import struct


def write_moving_model(path):
    """A gray triangle in front of the origin. Its animation "rise" moves it up by 20 units per second for two seconds,
    "slide" to the right for one second. Its variants are "red" and "green"."""
    parts = [struct.pack("<9f", -6, -10, 6, 6, -10, 6, 0, 2, 6), struct.pack("<2f", 0, 2), struct.pack("<6f", 0, 0, 0, 0, 40, 0),
             struct.pack("<2f", 0, 1), struct.pack("<6f", 0, 0, 0, 20, 0, 0)]
    data = b"".join(parts)
    views = [{"buffer": 0, "byteOffset": sum(map(len, parts[:i])), "byteLength": len(part)} for i, part in enumerate(parts)]

    def accessor(view, count, kind, **more):
        return {"bufferView": view, "componentType": 5126, "count": count, "type": kind, **more}

    def animation(name, times, places):
        return {"name": name, "samplers": [{"input": times, "output": places}],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}

    materials = [{"pbrMetallicRoughness": {"baseColorFactor": [*color, 1]}} for color in ((0.5, 0.5, 0.5), (0.8, 0, 0), (0, 0.8, 0))]
    mappings = [{"material": 1, "variants": [0]}, {"material": 2, "variants": [1]}]
    path.write_text(json.dumps({
        "asset": {"version": "2.0"}, "extensionsUsed": ["KHR_materials_variants"],
        "extensions": {"KHR_materials_variants": {"variants": [{"name": "red"}, {"name": "green"}]}},
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "materials": materials,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0, "extensions": {"KHR_materials_variants": {"mappings": mappings}}}]}],
        "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}],
        "bufferViews": views,
        "accessors": [accessor(0, 3, "VEC3", min=[-6, -10, 6], max=[6, 2, 6]), accessor(1, 2, "SCALAR", min=[0], max=[2]), accessor(2, 2, "VEC3"),
                      accessor(3, 2, "SCALAR", min=[0], max=[1]), accessor(4, 2, "VEC3")],
        "animations": [animation("rise", 1, 2), animation("slide", 3, 4)]}))
    return path
