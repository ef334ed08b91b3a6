#version 450
#extension GL_EXT_samplerless_texture_functions : require
// The viewer's image, premultiplied. Its row 0 is the top, as in Vulkan.
layout(set = 0, binding = 0) uniform texture2D volume;
layout(location = 0) out vec4 color;

void main() { color = texelFetch(volume, ivec2(gl_FragCoord.xy), 0); }
