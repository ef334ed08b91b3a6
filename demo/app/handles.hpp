#pragma once

#include <imgui.h>

#include <glm/glm.hpp>
#include <optional>
#include <string>

#include "clip_faces.hpp"
#include "gizmo.hpp"
#include "model.hpp"

namespace cumulet::demo {

/// Transform handles of the selected object, and of the faces of its clip box, drawn over the image with Dear ImGui and
/// dragged with the mouse. scale: user interface scale, as in Ui. pixel: window coordinates.
class Handles {
 public:
  /// Returns true if there is a handle at the pixel, and starts to drag it.
  bool press(const Model& model, const Sight& sight, const glm::dvec2& pixel, float scale);
  /// Moves, rotates or scales the object. snapped: in steps. Does nothing without a dragged handle.
  void drag(Model& model, const Sight& sight, const glm::dvec2& pixel, bool snapped);
  /// Ends the drag and keeps the result.
  void release() {
    held_.reset();
    held_face_.reset();
  }
  /// Ends the drag and restores the original transform.
  void cancel(Model& model);
  [[nodiscard]] bool holds() const { return held_ || held_face_; }

  /// Returns the light whose icon is at the pixel. Lights are not part of the image, so a pick cannot find them.
  [[nodiscard]] static std::optional<Item> analytic_light_at(const Model& model, const Sight& sight,
                                                             const glm::dvec2& pixel, float scale);
  /// Returns the position of a handle by its label, for replay files: "Handle X", "Handle YZ", "Handle free", "Handle
  /// clip X min".
  [[nodiscard]] static std::optional<Rectangle> find(const std::string& label, const Model& model, const Sight& sight,
                                                     float scale);
  /// Draws the icons of lights, and the outline and handles of the selected object. pixel: the pointer, if it can grab
  /// a handle.
  void draw(ImDrawList& list, const Model& model, const Sight& sight, const std::optional<glm::dvec2>& pixel,
            float scale) const;

 private:
  struct Held {
    Drag drag;
    Item item;
    SceneOptions before;
    glm::dmat4 transform;  // transform at the start
    glm::dvec2 pixel;      // last pointer position
    bool snapped = false;
  };

  // A face of a volume's clip box.
  struct HeldFace {
    ClipDrag drag;
    Item item;
    settings::Clip before;
    glm::dvec2 pixel;  // last pointer position
    bool snapped = false;
  };
  // Draws the clip box of the selected volume. Returns the face that is dragged or under the pointer.
  std::optional<ClipFace> draw_clip_of(ImDrawList& list, const Model& model, const Sight& sight,
                                       const std::optional<glm::dvec2>& pixel, float scale) const;
  void drag_face(Model& model, const Sight& sight, const glm::dvec2& pixel, bool snapped);

  std::optional<Held> held_;
  std::optional<HeldFace> held_face_;
};

}  // namespace cumulet::demo
