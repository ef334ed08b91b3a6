"""Run in Blender before cycles.py: adds the volumes and models of a scene with their transforms, which cycles.py does
not support.

The scene's "volumes" are {"file", "grid", "places": [16 numbers, column by column, ...], "medium": {"density_scale",
"albedo", "anisotropy"}}, its "models" {"file", "to_world"}. They exist before cycles.py continues and makes the models'
materials matte (LAMBERT=1). Extinction is density_scale times the grid; albedo is the scattered fraction of it.

With "shutter_seconds" there is motion blur. "open" and "close" of a volume or model are {"translate": three numbers}:
its offset from its transform at that moment. Those of the camera are {"eye", "target"}. A volume's "velocity" names a
grid of its file. A frame lasts a second.
"""

import json
import math
import os
import sys

import bpy
from mathutils import Matrix, Vector

FILE = sys.argv[sys.argv.index("--") + 1]


def matrix(numbers):
    return Matrix([numbers[i::4] for i in range(4)])


def origin_of(scene, one, name):
    """Returns an object at the world's origin that moves like this volume or model. It is the parent of the volume's or
    model's objects."""
    mover = bpy.data.objects.new(name, None)
    bpy.context.collection.objects.link(mover)
    for end, at in (("open", -0.5), ("close", 0.5)):
        if end in one:
            mover.location = one[end]["translate"]
            key(mover, ("location",), scene, at)
    return mover


def key(moved, properties, scene, at):
    """Sets a keyframe with the present values, at the fraction `at` of the shutter time after the frame time.
    Interpolates linearly."""
    for name in properties:
        moved.keyframe_insert(name, frame=1 + at * scene["shutter_seconds"])
    for curve in moved.animation_data.action.fcurves:
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
        curve.extrapolation = "LINEAR"


def open_shutter(description):
    """Runs when the rendering starts, when the camera exists."""
    @bpy.app.handlers.persistent
    def begin(scene, *_):
        render = scene.render
        render.fps, render.fps_base = 1, 1
        render.use_motion_blur, render.motion_blur_shutter = True, description["shutter_seconds"]
        scene.cycles.motion_blur_position = "CENTER"
        camera, view = scene.camera, description["camera"]
        for end, at in (("open", -0.5), ("close", 0.5)):
            if end in view:
                eye, target = Vector(view[end]["eye"]), Vector(view[end]["target"])
                forward = (target - eye).normalized()
                right = forward.cross(Vector((0, 1, 0))).normalized()
                camera.rotation_mode = "QUATERNION"
                camera.location = eye
                camera.rotation_quaternion = Matrix((right, right.cross(forward), -forward)).transposed().to_quaternion()
                key(camera, ("location", "rotation_quaternion"), description, at)

    bpy.app.handlers.render_init.append(begin)


def set_clock(actions, time):
    """Shifts and scales animations so that the frame time is so many seconds after their start. They were imported at 1
    frame per second."""
    for curve in (curve for action in actions for curve in action.fcurves):
        for point in curve.keyframe_points:
            for end in (point.co, point.handle_left, point.handle_right):
                end.x += 1 - time


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
def add_instances(*_):
    bpy.app.handlers.load_post.remove(add_instances)
    with open(FILE) as file:
        scene = json.load(file)
    folder = os.path.dirname(os.path.abspath(FILE))
    moves = scene.get("shutter_seconds", 0) > 0
    if moves:
        open_shutter(scene)
    for number, one in enumerate(scene.get("volumes", [])):
        origin = origin_of(scene, one, f"origin of volume {number}")
        volume = bpy.data.volumes.new(f"volume {number}")
        volume.filepath = os.path.join(folder, one["file"])
        volume.render.space = "WORLD"  # stretching does not change the density
        if moves:
            volume.velocity_grid, volume.velocity_unit = one.get("velocity", ""), "SECOND"
        volume.materials.append(medium(f"medium {number}", one["grid"], one["medium"]))
        # Cycles places voxels half a voxel further along each axis than OpenVDB.
        volume.grids.load()
        to_object = next(grid for grid in volume.grids if grid.name == one["grid"]).matrix_object
        shift = to_object @ Matrix.Translation((-0.5, -0.5, -0.5)) @ to_object.inverted()
        for transform in one["places"]:
            instance = bpy.data.objects.new(volume.name, volume)
            bpy.context.collection.objects.link(instance)
            # An object's own transform cannot contain shear, but its parent inverse matrix can.
            instance.parent = origin
            instance.matrix_parent_inverse = matrix(transform) @ shift
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    bpy.context.scene.render.fps = 1  # frame rate of imported keyframes
    for number, one in enumerate(scene.get("models", [])):
        origin = origin_of(scene, one, f"origin of model {number}")
        before, actions_before = set(bpy.data.objects), set(bpy.data.actions)
        bpy.ops.import_scene.gltf(filepath=os.path.join(folder, one["file"]))
        new = [o for o in bpy.data.objects if o not in before]
        # Blender's importer has rotated the model to Z-up; this rotates it back.
        turned = matrix(one["to_world"]) @ Matrix.Rotation(-math.pi / 2, 4, "X")
        for root in [o for o in new if o.parent is None]:
            root.parent = origin
            root.matrix_parent_inverse = turned
        set_clock(set(bpy.data.actions) - actions_before, one.get("time", 0))
        for other in [o for o in new if o.type in ("LIGHT", "CAMERA")]:
            bpy.data.objects.remove(other)


bpy.app.handlers.load_post.append(add_instances)
