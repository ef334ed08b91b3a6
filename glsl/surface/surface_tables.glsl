// Layout of the word tables with a scene's triangles for the path tracer. surface.glsl reads them;
// scene/model_source.cpp writes them. A word is a uvec4. CmModel (model_table.glsl) has the first word of each table.
#ifndef CM_SURFACE_TABLES_GLSL
#define CM_SURFACE_TABLES_GLSL

// A vertex: position and normal; both sets of texture coordinates; tangent with handedness, and color.
const uint CM_VERTEX_WORDS = 3u;
const uint CM_VERTEX_POSITION = 0u;
const uint CM_VERTEX_UV = 1u;
const uint CM_VERTEX_REST = 2u;

// A material: its own words, and two for each texture.
const uint CM_MATERIAL_WORDS = 38u;
const uint CM_MATERIAL_BASE_COLOR = 0u;
const uint CM_MATERIAL_EMISSION = 1u;        // w: alpha cutoff
const uint CM_MATERIAL_REFLECTION = 2u;      // metallic, roughness, ((ior - 1) / (ior + 1))^2, specular
const uint CM_MATERIAL_SPECULAR_COLOR = 3u;  // w: clearcoat
const uint CM_MATERIAL_COAT = 4u;            // clearcoat roughness, transmission, normal scale
const uint CM_MATERIAL_FLAGS = 5u;           // x
const uint CM_USE_BASE_COLOR = 6u;
const uint CM_USE_METALLIC_ROUGHNESS = 8u;
const uint CM_USE_NORMAL = 10u;
const uint CM_USE_EMISSION = 12u;
const uint CM_USE_SPECULAR = 14u;
const uint CM_USE_SPECULAR_COLOR = 16u;
const uint CM_USE_CLEARCOAT = 18u;
const uint CM_USE_CLEARCOAT_ROUGHNESS = 20u;
const uint CM_USE_TRANSMISSION = 22u;
const uint CM_USE_SHEEN_COLOR = 24u;
const uint CM_USE_SHEEN_ROUGHNESS = 26u;
const uint CM_USE_ANISOTROPY = 28u;
const uint CM_USE_IRIDESCENCE = 30u;
const uint CM_USE_FILM_THICKNESS = 32u;
const uint CM_MATERIAL_SHEEN = 34u;       // w: sheen roughness
const uint CM_MATERIAL_FILM = 35u;        // iridescence, index, minimum thickness, maximum thickness
const uint CM_MATERIAL_VOLUME = 36u;      // absorption, 1 / m; w: index of the volume that it bounds, 0 for a thin wall
const uint CM_MATERIAL_ANISOTROPY = 37u;  // strength, cosine and sine of its rotation; w: dispersion

// A material's flags.
const uint CM_ALPHA_MASK = 1u;
const uint CM_ALPHA_BLEND = 2u;
const uint CM_UNLIT = 4u;
const uint CM_ONE_SIDED = 8u;

// Flag beside the number of a material's texture plus one (0: no texture).
const uint CM_USE_SECOND_UV = 0x80000000u;

// A texture's last word: wrap modes of s and t, and the filter.
const uint CM_WRAP_REPEAT = 0u;
const uint CM_WRAP_MIRRORED = 1u;
const uint CM_WRAP_CLAMP = 2u;
const uint CM_WRAP_MASK = 3u;
const uint CM_WRAP_T_SHIFT = 2u;
const uint CM_TEXTURE_NEAREST = 16u;

#endif
