"""Run in Blender before cycles.py: the volumes and models of a scene, each in its place, which that does not know.

The scene's "volumes" are {"file", "grid", "places": [16 numbers, column by column, ...], "medium": {"density_scale",
"albedo", "anisotropy"}}, its "models" {"file", "to_world"}. They are there before cycles.py goes on, which makes models'
materials matte (LAMBERT=1). Extinction is density_scale times the grid, albedo the part of it that scatters."""

import json
import math
import os
import sys

import bpy
from mathutils import Matrix

FILE = sys.argv[sys.argv.index("--") + 1]


def matrix(numbers):
    return Matrix([numbers[i::4] for i in range(4)])


def medium(name, grid, settings):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new("ShaderNodeVolumePrincipled")
    shader.inputs["Density"].default_value = settings["density_scale"]
    shader.inputs["Density Attribute"].default_value = grid
    shader.inputs["Color"].default_value = (*settings["albedo"], 1)
    shader.inputs["Absorption Color"].default_value = (0, 0, 0, 1)
    shader.inputs["Anisotropy"].default_value = settings.get("anisotropy", 0)
    shader.inputs["Blackbody Intensity"].default_value = 0
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(shader.outputs[0], output.inputs["Volume"])
    material.cycles.volume_step_rate = float(os.environ.get("STEP", "1"))
    return material


@bpy.app.handlers.persistent
def place_all(*_):
    bpy.app.handlers.load_post.remove(place_all)
    with open(FILE) as file:
        scene = json.load(file)
    folder = os.path.dirname(os.path.abspath(FILE))
    origin = bpy.data.objects.new("origin", None)
    bpy.context.collection.objects.link(origin)
    for number, one in enumerate(scene.get("volumes", [])):
        volume = bpy.data.volumes.new(f"volume {number}")
        volume.filepath = os.path.join(folder, one["file"])
        volume.render.space = "WORLD"  # what is stretched is as dense as before
        volume.materials.append(medium(f"medium {number}", one["grid"], one["medium"]))
        # Cycles has voxels half a voxel further along each axis than OpenVDB.
        volume.grids.load()
        to_object = next(grid for grid in volume.grids if grid.name == one["grid"]).matrix_object
        shift = to_object @ Matrix.Translation((-0.5, -0.5, -0.5)) @ to_object.inverted()
        for place in one["places"]:
            instance = bpy.data.objects.new(volume.name, volume)
            bpy.context.collection.objects.link(instance)
            # An object's own place is never sheared, what stands before it may be.
            instance.parent = origin
            instance.matrix_parent_inverse = matrix(place) @ shift
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    for one in scene.get("models", []):
        before = set(bpy.data.objects)
        bpy.ops.import_scene.gltf(filepath=os.path.join(folder, one["file"]))
        new = [o for o in bpy.data.objects if o not in before]
        # Blender has turned it to Z-up.
        turned = matrix(one["to_world"]) @ Matrix.Rotation(-math.pi / 2, 4, "X")
        for root in [o for o in new if o.parent is None]:
            root.matrix_world = turned @ root.matrix_world
        for other in [o for o in new if o.type in ("LIGHT", "CAMERA")]:
            bpy.data.objects.remove(other)


bpy.app.handlers.load_post.append(place_all)
