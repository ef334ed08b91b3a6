// Sub-pixel position of each layer of the surface pass. Shared by GLSL and C++.
#ifndef CM_JITTER_GLSL
#define CM_JITTER_GLSL

// For 1 to 8 layers: the n-rooks pattern with the largest distances, where each column and each row of an n x n grid
// has one sample, at its cell's center. x to the right, y down the image, from the pixel's corner. The mean over all
// layers is (0.5, 0.5).
CM_FN vec2 cm_layer_jitter(uint layer, uint layers) {
  // Hexadecimal digit i is the row of layer i.
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
