#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <optional>
#include <scene_file.hpp>
#include <string>
#include <utility>
#include <vector>

namespace cumulet::demo {

/// Something that stands in a scene, and so can be chosen and moved: a volume in one of its places, a model, or a lamp
/// that stands somewhere, which suns do not.
struct Item {
  enum class Kind { volume, model, lamp };
  Kind kind = Kind::volume;
  std::size_t index = 0;  // volumes: 0 is the scene's first, then its others
  std::size_t place = 0;  // of a volume's places

  bool operator==(const Item&) const = default;
};

/// In the order of the panel.
[[nodiscard]] std::vector<Item> items_of(const SceneOptions& scene);
/// "Volume 2", "Volume 1, place 3", "Model 1", "Lamp 1".
[[nodiscard]] std::string title_of(const SceneOptions& scene, const Item& item);
/// What a list calls it: with what it is.
[[nodiscard]] std::string name_of(const SceneOptions& scene, const Item& item);

/// What of the kind is gone: a choice of it with it, one of a later thing is of that still.
void forget(std::optional<Item>& chosen, Item::Kind kind, std::size_t index);

/// Where it stands: what takes it there from where its file has it, or for a lamp, with unit axes, from one at the
/// origin that shines along +Z with its width along +X. Nothing if the scene has it not.
[[nodiscard]] std::optional<glm::dmat4> place_of(const SceneOptions& scene, const Item& item);
/// Of an item that the scene has. A lamp keeps what its kind has not; its axes' lengths stretch it.
void set_place(SceneOptions& scene, const Item& item, const glm::dmat4& place);
/// As it stands in another scene that has it, too.
void restore_place(SceneOptions& scene, const Item& item, const SceneOptions& from);

/// What a volume or model takes up before it is placed, world space.
struct Box {
  glm::dvec3 least{};
  glm::dvec3 most{};
};
/// Those of files, as far as they are known.
struct Boxes {
  std::vector<std::pair<VolumeFile, Box>> volumes;
  std::vector<std::pair<std::string, Box>> models;
};
/// A lamp has its own: as wide as it is, or none.
[[nodiscard]] std::optional<Box> box_of(const SceneOptions& scene, const Boxes& boxes, const Item& item);
/// Its middle, where it stands; that of its place where its box is not known.
[[nodiscard]] glm::dvec3 pivot_of(const glm::dmat4& place, const std::optional<Box>& box);

}  // namespace cumulet::demo
