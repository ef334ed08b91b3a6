"""Run in Blender before cycles.py, which ignores coverage. Adds the coverage of a glTF's matte materials when the
rendering starts.

Coverage (alphaMode BLEND and MASK) becomes a transparent shader, which does not count as a bounce. Cycles multiplies
the colors of images by their alpha even in opaque materials; this script prevents that.
"""

import bpy


@bpy.app.handlers.persistent
def complete(scene, *_):
    for image in bpy.data.images:
        image.alpha_mode = "CHANNEL_PACKED"
    for material in bpy.data.materials:
        tree = material.node_tree
        for node in [n for n in tree.nodes if n.type == "BSDF_PRINCIPLED"] if tree else []:
            alpha = node.inputs["Alpha"]
            if material.blend_method == "OPAQUE" or not (alpha.links or alpha.default_value < 1):
                continue
            surface = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL" and n.inputs["Surface"].links).inputs["Surface"]
            # For MASK: alpha is less than the cutoff. Otherwise: alpha is less than a random number.
            clear = tree.nodes.new("ShaderNodeMath")
            mask = material.blend_method == "CLIP"
            clear.operation = "LESS_THAN" if mask else "SUBTRACT"
            value, other = (clear.inputs[0], clear.inputs[1]) if mask else (clear.inputs[1], clear.inputs[0])
            other.default_value = material.alpha_threshold if mask else 1
            if alpha.links:
                tree.links.new(alpha.links[0].from_socket, value)
            else:
                value.default_value = alpha.default_value
            mix = tree.nodes.new("ShaderNodeMixShader")
            tree.links.new(clear.outputs[0], mix.inputs[0])
            tree.links.new(surface.links[0].from_socket, mix.inputs[1])
            tree.links.new(tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[2])
            tree.links.new(mix.outputs[0], surface)
    scene.cycles.transparent_max_bounces = 1024


bpy.app.handlers.render_init.append(complete)
