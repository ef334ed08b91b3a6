// Where in its pixel each layer of the surface pass is sampled. Shared by GLSL and C++.
#ifndef CM_JITTER_GLSL
#define CM_JITTER_GLSL

// Of `layers` layers, 1 to 8: n rooks far apart, each column and each row of an n x n grid has one, in its cell's middle.
// x to the right, y down the picture, from the pixel's corner. The mean over all layers is (0.5, 0.5).
CM_FN vec2 cm_layer_jitter(uint layer, uint layers) {
  // The row of layer i in hexadecimal digit i.
  uint rows = layers <= 1u   ? 0u
              : layers == 2u ? 0x10u
              : layers == 3u ? 0x210u
              : layers == 4u ? 0x2031u
              : layers == 5u ? 0x31420u
              : layers == 6u ? 0x351420u
              : layers == 7u ? 0x4631520u
                             : 0x52741630u;
  uint row = (rows >> (4u * layer)) & 15u;
  return vec2(float(layer) + 0.5f, float(row) + 0.5f) * (1.0f / float(max(layers, 1u)));
}

#endif
