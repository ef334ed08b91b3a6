#include <imgui.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "app.hpp"
#include "file_facts.hpp"
#include "selection.hpp"

// Scene files, and the protection of unsaved changes.
namespace cumulet::demo {
void App::show(SceneOptions scene, const std::string& path) {
  spell_out_defaults(scene);
  scene.width = model_.scene.width;
  scene.height = model_.scene.height;
  model_.scene = std::move(scene);
  model_.scene_path = path;
  deselect(model_);
  loading_.reload = true;
  loading_.fit = loading_.remark = needs_fit(model_.scene.camera);
  changes_->reset(model_.scene);
}

void App::new_scene() {
  SceneOptions scene = parse_demo_options({}, std::cout)->scene;
  derived_ = {};
  loading_.suggest = true;
  model_.unchosen_ground = true;
  scene.sequence.playback.repeat = CUMULET_REPEAT_LOOP;
  show(std::move(scene), "");
}

bool App::open_scene(const std::string& path, const std::string& source) {
  try {
    SceneOptions scene = load_scene(source);
    loading_.suggest = scene.auto_density_scale && scene.medium.density_scale == 0.0;
    model_.unchosen_ground = false;
    derived_ = {};
    derived_.exposure_given = true;
    loading_.scene = path;
    show(std::move(scene), path);
    return true;
  } catch (const std::exception& error) {
    complain(error.what());
    model_.preferences.forget(source);
    return false;
  }
}

void App::save_scene(const std::string& path) {
  SceneOptions scene = model_.scene;
  // Saves the viewport size, so that cumulet-render gives the same framing.
  scene.width = static_cast<std::uint32_t>(std::clamp(image_->viewport().width, 1.0, 16384.0));
  scene.height = static_cast<std::uint32_t>(std::clamp(image_->viewport().height, 1.0, 16384.0));
  if (model_.status.play) {
    scene.sequence.frame = model_.status.play->frame();
    set_animation_time(scene, model_.clock);
  }
  try {
    demo::save_scene(scene, path);
    model_.scene_path = path;
    model_.preferences.remember(path);
    changes_->reset(model_.scene);
    model_.modified = false;
    show_message(model_, false, "Saved " + path, now_);
    execute_waiting();
  } catch (const std::exception& error) {
    show_message(model_, true, error.what(), now_);
  }
}

bool App::ask_about_changes(std::vector<Command> commands) {
  if (loading_.discards) return false;
  // Includes the change of a control that is still active, and of this frame.
  changes_->follow(model_.scene, now_);
  model_.modified = changes_->any();
  if (!model_.modified) return false;
  loading_.waiting = std::move(commands);
  const std::string name = scene_name(model_).substr(1);
  panel_.question().ask("Unsaved changes", "Save the changes of " + name + "?",
                        {{"Save", "Saves the scene and continues.", Command{Action::save_scene}},
                         {"Discard", "Continues without the changes.", Command{Action::discard_changes}},
                         {"Cancel", "Returns to the scene (Escape).", std::nullopt}});
  return true;
}

void App::discard_changes() {
  // autosave() marks the changes again if another scene cannot be opened.
  model_.modified = false;
  loading_.discards = true;
  execute_waiting();
  loading_.discards = false;
}

void App::execute_waiting() { execute(std::exchange(loading_.waiting, {})); }

void App::offer_recovery() {
  const auto& left = changes_->recovery().left();
  if (!left) return;
  const std::string name = std::filesystem::path(left->scene_path).filename().string();
  panel_.question().ask("Recover unsaved changes",
                        "Cumulet ended without saving " + (name.empty() ? "a new scene" : name) +
                            ". Open the copy of " + written_text(left->path) + "?",
                        {{"Recover", "Opens the copy. It is not saved yet.", Command{Action::recover}},
                         {"Discard", "Deletes the copy.", Command{Action::discard_recovery}},
                         {"Later", "Asks again at the next start (Escape).", std::nullopt}});
}

void App::recover() {
  RecoveryFile& recovery = changes_->recovery();
  if (!recovery.left()) return;
  const RecoveryFile::Left left = *recovery.left();
  if (!open_scene(left.scene_path, left.path)) return;
  recovery.take_over();
  SceneOptions saved;
  try {
    if (!left.scene_path.empty()) saved = load_scene(left.scene_path);
  } catch (const std::exception& error) {
    complain(error.what());
  }
  spell_out_defaults(saved);
  changes_->reset(saved);
}

void App::autosave() {
  if (!panel_.dialog_open()) loading_.waiting.clear();
  // A drag ends soon, but a text field may be active for hours.
  const bool drags = held_ && !ImGui::GetIO().WantTextInput;
  if (!drags) changes_->follow(model_.scene, now_);
  model_.modified = changes_->any();
  if (drags) return;
  try {
    changes_->autosave(model_.scene, model_.scene_path, now_);
  } catch (const std::exception& error) {
    complain(error.what());
  }
}

void App::keep_or_remove_recovery() {
  if (ending_.quit || !model_.modified) {
    changes_->recovery().remove();
    return;
  }
  try {
    changes_->recovery().write(model_.scene, model_.scene_path);
  } catch (const std::exception& error) {
    std::cerr << "cumulet-demo: " << one_line(error.what()) << std::endl;
  }
}

}  // namespace cumulet::demo
