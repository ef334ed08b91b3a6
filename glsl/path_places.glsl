// Which pixels lanes have. Places are the pixels of the squares in the tile's list, square by square: a lane begins with
// the place of its own number, and takes the next that no lane has had once its pixel is done. So vectors of lanes stay
// full, however much longer some pixels take than others. Those who include this have glsl/path_store.glsl and
// glsl/pixel_store.glsl before it.
#ifndef CM_PATH_PLACES_GLSL
#define CM_PATH_PLACES_GLSL

// Of the picture; perhaps outside the tile.
uvec2 cm_pixel_of(uint place) {
  uint square = bitfieldExtract(cm_squares[place / CM_SQUARE_PIXELS], 0, CM_SQUARE_ROWS);
  uint across = (cm.dispatch.tile_size.x + CM_SQUARE_EDGE - 1u) / CM_SQUARE_EDGE;
  uint within = place % CM_SQUARE_PIXELS;
  return cm.dispatch.tile_corner + CM_SQUARE_EDGE * uvec2(square % across, square / across) +
         uvec2(within % CM_SQUARE_EDGE, within / CM_SQUARE_EDGE);
}

// Whether its pixel is to be sampled; then how many samples it has.
bool cm_is_due(uint place, out uint samples) {
  uvec2 at = cm_pixel_of(place);
  samples = 0u;
  if (any(greaterThanEqual(at, cm.dispatch.tile_corner + cm.dispatch.tile_size))) return false;
  uint row = (at.y - cm.dispatch.tile_corner.y) & 1u;
  if ((cm_squares[place / CM_SQUARE_PIXELS] >> (uint(CM_SQUARE_ROWS) + row) & 1u) == 0u) return false;
  samples = cm_pixel_samples(at);
  return samples < cm.dispatch.samples;
}

// A pixel for the path from this place on, or it is done.
void cm_take_place(inout CmPath p, uint place, inout uint samples) {
  p.stage = CM_STAGE_DONE;
  while (place < cm.dispatch.places) {
    if (cm_is_due(place, samples)) {
      p.place = place;
      p.stage = CM_STAGE_CAMERA;
      return;
    }
    place = atomicAdd(cm_next_place, 1u);
  }
}
void cm_take_next_place(inout CmPath p, inout uint samples) {
  cm_take_place(p, atomicAdd(cm_next_place, 1u), samples);
}

#endif
