#pragma once

#include <glm/vec2.hpp>
#include <optional>

#include "exchange.hpp"
#include "gizmo.hpp"
#include "handles.hpp"
#include "input.hpp"
#include "model.hpp"
#include "region_drag.hpp"

namespace cumulet::demo {

/// The mouse in the image: for the render region, a handle, a click or the camera.
class ImageInput {
 public:
  /// All must outlive it.
  ImageInput(Model& model, Exchange& exchange, const Input& input)
      : model_(model), exchange_(exchange), input_(input) {}

  /// viewport: the image's rectangle in the window. scale: user interface scale, as in Ui.
  void set_viewport(const Rectangle& viewport, float scale);
  [[nodiscard]] const Rectangle& viewport() const { return viewport_; }
  /// Returns the projection of the scene to the window; nullopt while the camera has no position.
  [[nodiscard]] std::optional<Sight> sight() const;
  /// Returns true if buttons are pressed that were pressed in the image.
  [[nodiscard]] bool has_buttons() const { return buttons_ != 0; }

  /// Returns true if the event belongs to the drag of a render region.
  bool take_for_region(const Event& event);
  /// Handles an event of the mouse, or the loss of the focus.
  void take(const Event& event);
  /// Sends an event to the viewer.
  void to_viewer(const Event& event);
  /// Moves the dragged handle to the pointer, and sets the render region that was dragged.
  void follow_pointer();
  /// Ends the drag of a handle.
  void release_handle() { handles_.release(); }
  /// Cancels the drag of a render region or handle. Returns true if there was one.
  bool cancel();
  /// Makes the next drag over the image set the render region.
  void arm_region() { region_drag_.arm(); }
  /// Draws the handles behind the panels.
  void draw_handles() const;
  /// Draws the render region during its drag.
  void draw_region() const;

 private:
  void take_button(const Event& event);
  void press(const Event& event);
  void let_go(const Event& event);
  void choose_at(const glm::dvec2& pixel);
  void drag_handle();
  [[nodiscard]] glm::dvec2 pointer() const { return {input_.x(), input_.y()}; }

  Model& model_;
  Exchange& exchange_;
  const Input& input_;
  Rectangle viewport_;
  float scale_ = 0.0f;
  unsigned buttons_ = 0;  // buttons pressed in the image, as a bit mask
  RegionDrag region_drag_;
  Handles handles_;
  std::optional<glm::dvec2> clicked_;  // position of the left button press, while it may become a click
};

}  // namespace cumulet::demo
