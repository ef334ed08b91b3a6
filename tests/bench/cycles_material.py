"""Runs in Blender: renders cubes of width 1 with the Principled Volume node, each with other settings, and prints a row
of results/cycles_material.csv for each: the radiance of emission, and alpha, 1 - transmittance.

usage: blender -b --python cycles_material.py -- SAMPLES
"""

import array
import math
import os
import sys
import tempfile

import bpy

KELVIN = (500, 800, 1000, 1200, 1500, 1800, 2000, 2500, 3000, 4000, 6500, 10000, 12000, 20000)
ROWS = 4  # pixels; a cube covers the inner half of 4 x 4


def settings():
    """Returns the names of all settings with the values of the node's inputs."""
    cubes = [(f"black body of {kelvin} K", {"Blackbody Intensity": 1, "Temperature": kelvin}) for kelvin in KELVIN]
    cubes += [(f"black body of 2000 K, intensity {intensity:g}", {"Blackbody Intensity": intensity, "Temperature": 2000})
              for intensity in (0.01, 0.25, 2)]
    cubes.append(("black body of 2000 K, tint 0.2 0.5 1",
                  {"Blackbody Intensity": 1, "Temperature": 2000, "Blackbody Tint": (0.2, 0.5, 1, 1)}))
    cubes.append(("emission strength 3, color 1 0.5 0.25", {"Emission Strength": 3, "Emission Color": (1, 0.5, 0.25, 1)}))
    for color, absorption in ((0.5, 0), (0.5, 0.25), (0, 0.25), (1, 0.25)):
        cubes.append((f"density 1, color {color:g}, absorption color {absorption:g}",
                      {"Density": 1, "Color": (color,) * 3 + (1,), "Absorption Color": (absorption,) * 3 + (1,)}))
    return cubes


def add_cube(place, values):
    bpy.ops.mesh.primitive_cube_add(size=1, location=(2 * place, 0, 0))
    material = bpy.data.materials.new("medium")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    output, node = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeVolumePrincipled")
    material.node_tree.links.new(node.outputs[0], output.inputs["Volume"])
    for name, value in {"Density": 0, "Density Attribute": "", "Temperature Attribute": "", **values}.items():
        node.inputs[name].default_value = value
    bpy.context.object.data.materials.append(material)


def render(cubes, samples):
    """Returns the RGBA pixels of the cubes in a row, each in a square of ROWS x ROWS pixels."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    for place, (_, values) in enumerate(cubes):
        add_cube(place, values)
    scene.world = bpy.data.worlds.new("black")
    scene.world.color = (0, 0, 0)
    lens = bpy.data.cameras.new("camera")
    lens.type, lens.ortho_scale = "ORTHO", 2 * len(cubes)
    scene.camera = bpy.data.objects.new("camera", lens)
    bpy.context.collection.objects.link(scene.camera)
    scene.camera.location, scene.camera.rotation_euler = (len(cubes) - 1, -10, 0), (math.pi / 2, 0, 0)
    scene.render.engine, scene.render.film_transparent = "CYCLES", True
    cycles = scene.cycles
    cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = samples, False, False
    cycles.max_bounces = cycles.volume_bounces = 0
    cycles.pixel_filter_type, scene.render.filter_size = "BOX", 0.01
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = ROWS * len(cubes), ROWS, 100
    scene.view_settings.view_transform = "Raw"
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.image_settings.color_mode = "RGBA"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = os.path.join(folder, "cubes.exr")
        bpy.ops.render.render(write_still=True)
        pixels = array.array("f", [0.0]) * (4 * ROWS * ROWS * len(cubes))
        bpy.data.images.load(scene.render.filepath).pixels.foreach_get(pixels)
    return pixels


def main():
    cubes = settings()
    pixels = render(cubes, int(sys.argv[-1]))
    for place, (name, _) in enumerate(cubes):
        inner = [4 * (y * ROWS * len(cubes) + ROWS * place + x) for y in (1, 2) for x in (1, 2)]
        *radiance, alpha = (sum(pixels[at + channel] for at in inner) / len(inner) for channel in range(4))
        # Cubes that scatter are lit by those that emit.
        means = ["", "", ""] if alpha > 0 else [f"{mean:.6g}" for mean in radiance]
        print("ROW", ",".join([f'"{name}"', *means, f"{alpha:.4g}"]))


main()
