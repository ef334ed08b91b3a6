// Assigns pixels to lanes: persistent threads with path regeneration (Aila and Laine 2009; Novak, Havran and
// Dachsbacher 2010). Pixel slots are the pixels of the tile's listed 8x8 blocks, block by block. A lane begins with the
// slot of its own number. When its pixel is finished, it takes the next unused slot from a counter. This keeps SIMD
// groups full, although some pixels take much longer than others. The includer has glsl/path/path_store.glsl and
// glsl/path/pixel_store.glsl before this.
#ifndef CM_PIXEL_SLOTS_GLSL
#define CM_PIXEL_SLOTS_GLSL

// Returns the pixel of a slot, in image coordinates. It may lie outside the tile.
uvec2 cm_pixel_of(uint slot) {
  uint square = bitfieldExtract(cm_squares[slot / CM_SQUARE_PIXELS], 0, CM_SQUARE_ROWS);
  uint across = (cm.dispatch.tile_size.x + CM_SQUARE_EDGE - 1u) / CM_SQUARE_EDGE;
  uint within = slot % CM_SQUARE_PIXELS;
  return cm.dispatch.tile_corner + CM_SQUARE_EDGE * uvec2(square % across, square / across) +
         uvec2(within % CM_SQUARE_EDGE, within / CM_SQUARE_EDGE);
}

// Entry cell of the pixel's camera rays, for glsl/path/free_flight.glsl.
uint cm_kept_cell(uint slot) { return cm_slot_words[slot] - 1u; }
void cm_keep_cell(uint slot, uint cell) { cm_slot_words[slot] = cell + 1u; }

// Returns true if the slot's pixel needs samples. samples: the number it has.
bool cm_is_due(uint slot, out uint samples) {
  uvec2 at = cm_pixel_of(slot);
  samples = 0u;
  if (any(greaterThanEqual(at, cm.dispatch.tile_corner + cm.dispatch.tile_size))) return false;
  uint row = (at.y - cm.dispatch.tile_corner.y) & 1u;
  if ((cm_squares[slot / CM_SQUARE_PIXELS] >> (uint(CM_SQUARE_ROWS) + row) & 1u) == 0u) return false;
  samples = cm_pixel_samples(at);
  return samples < cm.dispatch.samples;
}

// Gives the path the first pixel from this slot on that needs samples, or sets CM_STAGE_DONE if there is none.
void cm_take_slot(inout CmPath p, uint slot, inout uint samples) {
  p.stage = CM_STAGE_DONE;
  while (slot < cm.dispatch.slots) {
    if (cm_is_due(slot, samples)) {
      p.slot = slot;
      p.stage = CM_STAGE_CAMERA;
      return;
    }
    slot = atomicAdd(cm_next_slot, 1u);
  }
}
void cm_take_next_slot(inout CmPath p, inout uint samples) {
  cm_take_slot(p, atomicAdd(cm_next_slot, 1u), samples);
}

#endif
