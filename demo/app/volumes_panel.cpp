// The inspector of a model.

#include <algorithm>

#include "panel.hpp"

namespace cumulet::demo {

void Panel::one_model(const Model& model, SceneModel& one) {
  ui_.value_row("Model", one.file);
  name_row(one.name);
  ui_.checkbox("Visible", "If off, the object is hidden and casts no shadow.", one.visible);
  ui_.checkbox("Shadow only", "Invisible to the camera, but casts shadows and appears in reflections.",
               one.shadow_only);
  ui_.checkbox("Holdout", "Leaves a hole with alpha 0 in the image.", one.holdout);
  ui_.checkbox("Double sided", "Shows both sides of all surfaces, for models with inverted triangle winding.",
               one.double_sided);
  const auto file = std::ranges::find(model.status.model_files, one.file, &ModelFile::file);
  if (file != model.status.model_files.end()) {
    animation(model, *file, one.animation, one.time);
    variant(*file, one.variant);
  }
  transform_.draw(one.to_world);
}

}  // namespace cumulet::demo
