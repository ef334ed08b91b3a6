#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <optional>
#include <scene_file.hpp>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace cumulet::demo {

/// An object that can be selected and moved: a volume (one of its transforms), a model, or a light with a position (all
/// except suns).
struct Item {
  enum class Kind { volume, model, analytic_light };
  Kind kind = Kind::volume;
  std::size_t index = 0;            // volumes: 0 is the scene's first volume, 1 the first of others
  std::size_t transform_index = 0;  // index of a volume's transform

  bool operator==(const Item&) const = default;
};

/// A part of the scene that exists once.
enum class Part { render, camera, sun_sky, environment, ground };
/// A part or an object of the scene, as the inspector shows it.
using Subject = std::variant<Part, Item>;

/// Returns a volume of the scene; index 0 is the first volume.
[[nodiscard]] SceneVolume& volume_at(SceneOptions& scene, std::size_t index);
[[nodiscard]] const SceneVolume& volume_at(const SceneOptions& scene, std::size_t index);
/// Returns all items, also the lights without a position.
[[nodiscard]] std::vector<Item> listed_items(const SceneOptions& scene);
/// Returns all items that can be moved, in the order of the panel.
[[nodiscard]] std::vector<Item> items_of(const SceneOptions& scene);
/// Returns the title of an item: "Volume 2", "Volume 1, instance 3", "Model 1", "Light 1".
[[nodiscard]] std::string title_of(const SceneOptions& scene, const Item& item);
/// Returns the item's name or kind, for lists.
[[nodiscard]] std::string row_text(const SceneOptions& scene, const Item& item);
/// Returns the name that the user can edit; null for lights.
[[nodiscard]] std::string* name_of_object(SceneOptions& scene, const Item& item);
/// Returns the visibility that the user can edit; null for lights.
[[nodiscard]] bool* visibility_of(SceneOptions& scene, const Item& item);

/// Removes an item. Of a volume with several instances only the instance is removed.
void remove_item(SceneOptions& scene, const Item& item);
/// Duplicates an item and returns the copy.
Item duplicate_item(SceneOptions& scene, const Item& item);

/// Moves an item to the place of another one of its kind; the items between them move by one place. An instance moves
/// within its volume, or else with all its volume. Returns the moved item; nullopt if the order stays.
std::optional<Item> move_item(SceneOptions& scene, const Item& from, const Item& to);

/// Updates the selection after an item was removed: clears it, or adjusts the index of a later item.
void forget(std::optional<Item>& chosen, Item::Kind kind, std::size_t index);

/// Returns the transform of an item, relative to the placement by its file; nullopt if the scene does not have it. For
/// a light, it transforms one at the origin that shines along +Z and has its width along +X; its axes are unit vectors.
[[nodiscard]] std::optional<glm::dmat4> transform_of(const SceneOptions& scene, const Item& item);
/// Sets the transform of an item of the scene. For a light, settings that its kind does not have are kept, and the
/// lengths of the axes scale its size.
void set_transform(SceneOptions& scene, const Item& item, const glm::dmat4& transform);
/// Restores the transform from another scene that has this item.
void restore_transform(SceneOptions& scene, const Item& item, const SceneOptions& from);

/// World-space bounding box of a volume or model before its item transform.
struct Box {
  glm::dvec3 least{};
  glm::dvec3 most{};
};
/// Known bounding boxes, by file.
struct Boxes {
  std::vector<std::pair<VolumeFile, Box>> volumes;
  std::vector<std::pair<std::string, Box>> models;
};
/// Returns the bounding box of an item. A light has a box of its size, or none.
[[nodiscard]] std::optional<Box> box_of(const SceneOptions& scene, const Boxes& boxes, const Item& item);
/// Returns the transformed center of the box; the transform's origin if the box is not known.
[[nodiscard]] glm::dvec3 pivot_of(const glm::dmat4& transform, const std::optional<Box>& box);

}  // namespace cumulet::demo
