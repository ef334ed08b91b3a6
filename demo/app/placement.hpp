#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "model.hpp"

namespace cumulet::demo {

/// Place of an object that was added to a scene of another size or at another place.
struct Placement {
  double scale = 1.0;  // 1: the object's own size suits the scene
  glm::dmat4 transform{1.0};
};

/// Returns the world-space box of all objects of the scene except one; nullopt if there are none with a known box.
[[nodiscard]] std::optional<Box> box_of_others(const Model& model, const Item& item);

/// Returns a place for an object with this box in a scene with another box: in front of it for a camera at `eye`, on
/// the same ground. nullopt if the object's own place is suitable: it is neither tiny nor huge nor far away.
[[nodiscard]] std::optional<Placement> place_in(const Box& scene, const Box& object, const glm::dvec3& eye);

/// Gives an object that was just added its place beside the others, if its own is unsuitable, and shows a message.
/// box: of the object, without the transform of the scene. now: seconds, of the message, here and below.
/// Returns true if it gave the object a place.
bool place(Model& model, const Item& item, const Box& box, const Box& others, double now);
/// Turns the loaded surfaces into a model of the scene, so that they can be moved, named and hidden as all models. Does
/// nothing without surfaces. in_view: places the model as place() does.
/// Returns true if the model got a place.
bool adopt_surfaces(Model& model, bool in_view, double now);
/// Shows a message for each object that a view of the whole scene hardly shows. Returns false if the box of an object
/// is not known yet.
bool remark_on_tiny(Model& model, double now);

}  // namespace cumulet::demo
