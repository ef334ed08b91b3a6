"""Renders smoke that Blender simulates, in Blender's own Python and without a window:

    blender --background --python blender_smoke.py -- OUT.png [FRAMES WIDTH HEIGHT SAMPLES]

Blender 3 and later. Its Python finds the package in PYTHONPATH (Debian), or after
"PYTHON -m pip install cumulet-*.whl", where PYTHON is the one of Blender's folder.
"""

import os
import sys
import tempfile

import bpy
import cumulet

# Z is up in Blender. Rows of the matrix that maps (x, y, z) to (x, z, -y).
TO_WORLD = [[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]]


def add_fluid(kind):
    """Makes the active object a part of the simulation, and returns its modifier."""
    modifier = bpy.context.object.modifiers.new("Fluid", "FLUID")
    modifier.fluid_type = kind
    return modifier


def simulate(folder, frames):
    """Bakes smoke that rises from a sphere. Returns the OpenVDB file of the last frame."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.3, location=(0, 0, -0.6))
    flow = add_fluid("FLOW").flow_settings
    flow.flow_type, flow.flow_behavior = "SMOKE", "INFLOW"
    bpy.ops.mesh.primitive_cube_add()
    domain = add_fluid("DOMAIN").domain_settings
    domain.domain_type = "GAS"
    domain.resolution_max = 32
    domain.cache_directory = folder
    domain.cache_type, domain.cache_data_format = "MODULAR", "OPENVDB"
    domain.cache_frame_start, domain.cache_frame_end = 1, frames
    bpy.ops.fluid.bake_data()
    return os.path.join(folder, "data", f"fluid_data_{frames:04}.vdb")


def main():
    arguments = sys.argv[sys.argv.index("--") + 1:]
    frames, width, height, samples = (int(text) for text in arguments[1:5] or (20, 640, 360, 64))
    with tempfile.TemporaryDirectory() as folder:
        volume = cumulet.Volume.from_file(simulate(folder, frames), to_world=TO_WORLD)
    picture = cumulet.render(volume, size=(width, height), samples=samples)
    picture.save(arguments[0])
    print(picture)


main()
