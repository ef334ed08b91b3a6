#pragma once

#include <imgui.h>

#include <glm/glm.hpp>
#include <optional>
#include <string>

#include "gizmo.hpp"
#include "model.hpp"

namespace cumulet::demo {

/// The handles of the chosen thing in the picture, before all that is in it: a hand drags them, and they are drawn on
/// Dear ImGui's list. scale: of everything, as Ui has it; pixels: of the window.
class Handles {
 public:
  /// Whether a handle is there, which is held from now on.
  bool press(const Model& model, const Sight& sight, const glm::dvec2& pixel, float scale);
  /// Moves, turns or stretches what is held; snapped: by steps. Without a held handle it does nothing.
  void drag(Model& model, const Sight& sight, const glm::dvec2& pixel, bool snapped);
  /// What it came to stays.
  void release() { held_.reset(); }
  /// It is as it was when the handle was taken.
  void cancel(Model& model);
  [[nodiscard]] bool holds() const { return held_.has_value(); }

  /// The lamp whose mark is there: what a picture does not show.
  [[nodiscard]] static std::optional<Item> lamp_at(const Model& model, const Sight& sight, const glm::dvec2& pixel,
                                                   float scale);
  /// Where to take a handle of the chosen thing, for replay files: "Handle X", "Handle YZ", "Handle free".
  [[nodiscard]] static std::optional<Rectangle> find(const std::string& label, const Model& model, const Sight& sight,
                                                     float scale);
  /// Lamps' marks, the outline of what is chosen and its handles. pixel: the pointer, where it is free to take one.
  void draw(ImDrawList& list, const Model& model, const Sight& sight, const std::optional<glm::dvec2>& pixel,
            float scale) const;

 private:
  struct Held {
    Drag drag;
    Item item;
    SceneOptions before;
    glm::dmat4 place;  // there
    glm::dvec2 pixel;  // the pointer's, that was followed last
    bool snapped = false;
  };

  std::optional<Held> held_;
};

}  // namespace cumulet::demo
