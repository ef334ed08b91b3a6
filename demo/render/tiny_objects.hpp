#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <scene_file.hpp>
#include <span>
#include <string>
#include <vector>

#include "instances.hpp"
#include "models.hpp"

namespace cumulet::demo {

/// An object of a scene and its bounding box in world space.
struct PlacedBox {
  std::string name;
  std::array<double, 3> least{};
  std::array<double, 3> most{};
};

/// Returns the boxes of all visible objects that the viewer has loaded.
[[nodiscard]] std::vector<PlacedBox> placed_boxes(cumulet_viewer* viewer, const SceneOptions& scene,
                                                  const Instances& others, const Models& models);

/// Returns a remark, one line, for each object that a view of all objects hardly shows because it is over 100 times
/// smaller than all of them together.
[[nodiscard]] std::vector<std::string> remarks_on_tiny(std::span<const PlacedBox> objects);

}  // namespace cumulet::demo
