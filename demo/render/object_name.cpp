#include "object_name.hpp"

#include <filesystem>

namespace cumulet::demo {

std::string object_name(const SceneOptions& scene, const Instances& others, cumulet_object_kind kind,
                        std::uint64_t tag) {
  if (kind == CUMULET_OBJECT_GROUND) return "ground";
  if (kind == CUMULET_OBJECT_VOLUME) {
    const auto indices = others.find_tag(tag);
    return indices ? scene.others.at(indices->volume).label() : scene.label();
  }
  if (tag > 0) return scene.models.at(static_cast<std::size_t>(tag) - 1).label();
  return std::filesystem::path(scene.surfaces).filename().string();
}

}  // namespace cumulet::demo
