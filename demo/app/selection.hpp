#pragma once

#include <vector>

#include "model.hpp"

// The selection: the subject of the inspector, and the objects that are selected together with it.

namespace cumulet::demo {

/// Returns the subject of the inspector. Objects that are removed are replaced by the first one.
[[nodiscard]] Subject subject_of(const Model& model);
/// Returns the selected objects in the order of listed_items; empty if the subject is a part.
[[nodiscard]] std::vector<Item> selected_items(const Model& model);

/// Shows a part or object in the inspector, and selects nothing else. Objects with a position are also selected in the
/// image.
void select(Model& model, const Subject& subject);
/// Adds an object to the selection, as the subject, or removes it from the selection. The last one stays.
void toggle_selected(Model& model, const Item& item);
/// Selects these objects. subject: one of them.
void select_items(Model& model, std::vector<Item> items, const Item& subject);
void deselect(Model& model);

/// Returns true if an object is selected, which can be removed or duplicated.
[[nodiscard]] bool has_selection(const Model& model);
/// Returns true if the selection contains an object that can be hidden.
[[nodiscard]] bool can_hide(const Model& model);
void remove_selected(Model& model);
/// Duplicates the selected objects and selects the copies.
void duplicate_selected(Model& model);
/// Hides the selected objects; shows them if all are hidden.
void hide_selected(Model& model);
/// Moves an object to the place of another one of its kind, and selects it. Returns true if the order has changed.
bool reorder(Model& model, const Item& from, const Item& to);
/// Adds a point light above the camera's target, and selects it. Its power suits the exposure: at 0 stops its
/// irradiance at the target is half of the noon sun's.
void add_light(Model& model);
/// Gives a light whose kind the user has changed values that suit it: W and W/m² differ, a spot needs a cone, and an
/// area light a size.
void adapt_light(cumulet_light_desc& light, cumulet_light_kind before, const SceneOptions& scene);

}  // namespace cumulet::demo
