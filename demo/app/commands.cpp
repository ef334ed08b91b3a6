#include <glad/gl.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <default_look.hpp>
#include <exception>
#include <filesystem>
#include <glm/glm.hpp>
#include <info.hpp>
#include <string>
#include <utility>
#include <vector>

#include "about.hpp"
#include "app.hpp"
#include "clip_rows.hpp"
#include "desktop.hpp"
#include "dropped_files.hpp"
#include "ocio_text.hpp"
#include "renderer.hpp"
#include "selection.hpp"

// The commands of the user interface.
namespace cumulet::demo {
namespace {

constexpr float exposure_step = 1.0f / 3.0f;  // stops
constexpr float max_exposure = 10.0f;         // stops
constexpr double turn_speed = 20.0;           // degrees per second

std::size_t file_count(const SceneOptions& scene) {
  const std::size_t single =
      (scene.volume.empty() ? 0 : 1) + (scene.surfaces.empty() ? 0 : 1) + (scene.environment.empty() ? 0 : 1);
  return single + scene.others.size() + scene.models.size();
}

}  // namespace

/// The functions of the commands, in the order of Action.
struct App::Commands {
  struct Row {
    Action action;
    void (*run)(App& app, const Command& command);
  };

  static constexpr auto table = std::to_array<Row>({
      {Action::new_scene,
       [](App& app, const Command& command) {
         if (!app.ask_about_changes({command})) app.new_scene();
       }},
      {Action::open_dialog,
       [](App& app, const Command&) {
         app.open_dialog("Open", Action::open,
                         {".vdb", ".nvdb", ".nrrd", ".nhdr", ".vti", ".raw", ".tif", ".tiff", ".gltf", ".glb", ".hdr", ".exr", ".json"});
       }},
      {Action::open,
       [](App& app, const Command& command) {
         if (has_ending(command.text, ".json") && app.ask_about_changes({command})) return;
         app.open(command.text);
       }},
      {Action::open_sample, [](App& app, const Command& command) { app.open_sample(command.text); }},
      {Action::add_volume_dialog,
       [](App& app, const Command&) {
         app.open_dialog("Add volume", Action::add_volume, {".vdb", ".nvdb", ".nrrd", ".nhdr", ".vti", ".raw", ".tif", ".tiff"});
       }},
      {Action::add_volume,
       [](App& app, const Command& command) {
         SceneVolume& added = app.model_.scene.others.emplace_back();
         added.volume = command.text;
         added.up = known_up_axis(command.text);
         spell_out_defaults(app.model_.scene);
         if (added.up == UpAxis::z) app.show_up_axis(command.text, command.text);
         app.take_added({Item::Kind::volume, app.model_.scene.others.size(), 0});
       }},
      {Action::add_model_dialog,
       [](App& app, const Command&) { app.open_dialog("Add model", Action::add_model, {".gltf", ".glb"}); }},
      {Action::add_model,
       [](App& app, const Command& command) {
         app.model_.scene.models.push_back({command.text});
         app.take_added({Item::Kind::model, app.model_.scene.models.size() - 1, 0});
       }},
      {Action::environment_dialog,
       [](App& app, const Command&) { app.open_dialog("Open environment map", Action::open, {".hdr", ".exr"}); }},
      {Action::clear_environment,
       [](App& app, const Command&) {
         app.model_.scene.environment.clear();
         give_daylight(app.model_.scene);
         set_default_ground(app.model_, CUMULET_GROUND_BELOW);
       }},
      {Action::ocio_dialog,
       [](App& app, const Command&) { app.open_dialog("Open OpenColorIO configuration", Action::open_ocio, {".ocio"}); }},
      {Action::open_ocio,
       [](App& app, const Command& command) {
         try {
           static_cast<void>(ocio_displays(command.text));
           app.model_.scene.ocio = {.config = command.text};
         } catch (const std::exception& error) {
           show_message(app.model_, true, ocio_text(error.what()), app.now_);
         }
       }},
      {Action::save_scene,
       [](App& app, const Command&) {
         if (app.model_.scene_path.empty())
           app.execute({Action::save_scene_dialog});
         else
           app.save_scene(app.model_.scene_path);
       }},
      {Action::save_scene_dialog,
       [](App& app, const Command&) { app.save_dialog("Save scene", Action::save_scene_as, ".json"); }},
      {Action::save_scene_as, [](App& app, const Command& command) { app.save_scene(command.text); }},
      {Action::discard_changes, [](App& app, const Command&) { app.discard_changes(); }},
      {Action::recover, [](App& app, const Command&) { app.recover(); }},
      {Action::discard_recovery,
       [](App& app, const Command&) {
         app.changes_->recovery().take_over();
         app.changes_->recovery().remove();
       }},
      {Action::render_dialog,
       [](App& app, const Command&) {
         if (app.model_.status.has_content) app.panel_.render_dialog().open(app.model_);
       }},
      {Action::render, [](App& app, const Command&) { app.render_picture(); }},
      {Action::cancel_render,
       [](App& app, const Command& command) { app.pictures_.queue().cancel(std::stoull(command.text)); }},
      {Action::toggle_renders, [](App& app, const Command&) { app.model_.renders_open = !app.model_.renders_open; }},
      {Action::clear_renders, [](App& app, const Command&) { app.pictures_.queue().clear(); }},
      {Action::show_in_folder,
       [](App& app, const Command& command) {
         if (!show_in_folder(command.text))
           show_message(app.model_, true, command.text + ": xdg-open is not installed", app.now_);
       }},
      {Action::png_dialog,
       [](App& app, const Command&) {
         if (app.model_.status.has_content) app.save_dialog("Save image", Action::save_png, ".png");
       }},
      {Action::save_png,
       [](App& app, const Command& command) { app.request({Request::Type::save_png, command.text}); }},
      {Action::exr_dialog,
       [](App& app, const Command&) {
         if (app.model_.status.has_content) app.save_dialog("Save linear radiance", Action::save_exr, ".exr");
       }},
      {Action::save_exr,
       [](App& app, const Command& command) { app.request({Request::Type::save_exr, command.text}); }},
      {Action::undo, [](App& app, const Command&) { app.step_history(true); }},
      {Action::redo, [](App& app, const Command&) { app.step_history(false); }},
      {Action::frame_all, [](App& app, const Command&) { app.request({Request::Type::frame_all}); }},
      {Action::cancel, [](App& app, const Command&) { app.cancel(); }},
      {Action::cancel_load, [](App& app, const Command&) { app.renderer_->cancel(); }},
      {Action::dismiss,
       [](App& app, const Command& command) {
         std::erase_if(app.model_.messages, [&](const Message& message) { return message.text == command.text; });
       }},
      {Action::toggle_log, [](App& app, const Command&) { app.model_.log_open = !app.model_.log_open; }},
      {Action::clear_log, [](App& app, const Command&) { app.model_.log.clear(); }},
      {Action::toggle_panel, [](App& app, const Command&) { app.model_.panel = !app.model_.panel; }},
      {Action::focus_panel,
       [](App& app, const Command&) {
         app.model_.panel = true;
         app.panel_.focus();
       }},
      {Action::duplicate_selected, [](App& app, const Command&) { duplicate_selected(app.model_); }},
      {Action::remove_selected, [](App& app, const Command&) { remove_selected(app.model_); }},
      {Action::hide_selected, [](App& app, const Command&) { hide_selected(app.model_); }},
      {Action::add_light, [](App& app, const Command&) { add_light(app.model_); }},
      {Action::toggle_help, [](App& app, const Command&) { app.model_.help = !app.model_.help; }},
      {Action::scale_interface,
       [](App& app, const Command& command) { app.model_.preferences.scale_percent = command.value; }},
      {Action::toggle_fly,
       [](App& app, const Command&) {
         auto& fly = app.model_.navigation.fly;
         fly = fly != 0 ? 0 : 1;
         // Moves the keyboard focus from the panel to the image.
         ImGui::SetWindowFocus(nullptr);
       }},
      {Action::toggle_turntable,
       [](App& app, const Command&) {
         double& speed = app.model_.navigation.turntable_degrees_per_second;
         speed = speed != 0.0 ? 0.0 : turn_speed;
       }},
      {Action::tool,
       [](App& app, const Command& command) {
         app.image_->release_handle();
         app.model_.tool = static_cast<Tool>(command.value);
         // The object in the inspector gets the handles, also if it was not selected by hand.
         const Subject subject = subject_of(app.model_);
         const Item* const item = std::get_if<Item>(&subject);
         if (app.model_.tool != Tool::none && !app.model_.chosen && item != nullptr &&
             transform_of(app.model_.scene, *item))
           app.model_.chosen = *item;
       }},
      {Action::toggle_axes,
       [](App& app, const Command&) {
         app.image_->release_handle();
         app.model_.axes = app.model_.axes == Axes::world ? Axes::local : Axes::world;
       }},
      {Action::brighter,
       [](App& app, const Command&) {
         float& stops = app.model_.scene.display.exposure_stops;
         stops = std::min(stops + exposure_step, max_exposure);
       }},
      {Action::darker,
       [](App& app, const Command&) {
         float& stops = app.model_.scene.display.exposure_stops;
         stops = std::max(stops - exposure_step, -max_exposure);
       }},
      {Action::auto_exposure,
       [](App& app, const Command&) {
         app.derived_.exposure_asked = true;
         app.request({Request::Type::meter_exposure});
       }},
      {Action::toggle_auto_exposure,
       [](App& app, const Command&) {
         bool& on = app.model_.preferences.auto_exposure;
         on = !on;
       }},
      {Action::toggle_desktop_dialogs,
       [](App& app, const Command&) {
         bool& on = app.model_.preferences.desktop_dialogs;
         on = !on;
         app.choose_dialogs();
       }},
      {Action::next_grid_type,
       [](App& app, const Command&) {
         cumulet_grid_type& type = app.model_.scene.grid.type;
         type = static_cast<cumulet_grid_type>((static_cast<int>(type) + 1) % 3);
       }},
      {Action::view,
       [](App& app, const Command& command) {
         app.model_.scene.sampling.view = static_cast<cumulet_view_mode>(command.value);
       }},
      {Action::grids_dialog,
       [](App& app, const Command&) {
         const auto& play = app.model_.status.play;
         app.panel_.picker().open(play ? play->row.file(play->info.requested_frame) : app.model_.scene.volume,
                                  Window::wake);
       }},
      {Action::choose_grid,
       [](App& app, const Command& command) {
         app.loading_.suggest = app.model_.scene.grid_name != command.text;
         app.model_.scene.grid_name = command.text;
       }},
      {Action::choose_up,
       [](App& app, const Command& command) {
         // The volume moves with the up axis, so the camera must be fitted again.
         const auto up = static_cast<UpAxis>(command.value);
         if (!command.text.empty()) {
           for (SceneVolume& other : app.model_.scene.others)
             if (other.volume == command.text) app.set_up_axis(other, up);
           return;
         }
         app.loading_.fit = app.model_.scene.up != up;
         app.set_up_axis(app.model_.scene, up);
         if (app.model_.status.play) app.model_.scene.sequence.frame = app.model_.status.play->frame();
       }},
      {Action::auto_density, [](App& app, const Command&) { app.request({Request::Type::suggest_density}); }},
      {Action::play_row,
       [](App& app, const Command&) {
         app.clock_.play_row();
         app.model_.scene.sequence.playback.repeat = CUMULET_REPEAT_LOOP;
         app.loading_.reload = true;
         app.clock_.play_when_loaded(true);
       }},
      {Action::play, [](App& app, const Command&) { app.clock_.play_or_pause(); }},
      {Action::step, [](App& app, const Command& command) { app.clock_.step(command.value); }},
      {Action::go_to,
       [](App& app, const Command& command) {
         app.model_.playing = false;
         app.clock_.go_to(static_cast<std::uint32_t>(command.value));
       }},
      {Action::begin_here,
       [](App& app, const Command&) {
         if (app.model_.status.play) app.model_.scene.sequence.first = app.model_.status.play->frame();
       }},
      {Action::end_here,
       [](App& app, const Command&) {
         if (app.model_.status.play) app.model_.scene.sequence.last = app.model_.status.play->frame();
       }},
      {Action::draw_region, [](App& app, const Command&) { app.image_->arm_region(); }},
      {Action::clear_region,
       [](App& app, const Command&) { std::ranges::fill(app.model_.scene.sampling.region, 0.0f); }},
      {Action::quit,
       [](App& app, const Command&) {
         if (!app.ask_about_renders()) app.execute({Action::quit_anyway});
       }},
      {Action::quit_anyway,
       [](App& app, const Command& command) {
         if (!app.ask_about_changes({command})) app.ending_.quit = true;
       }},
      {Action::follow_light, [](App& app, const Command&) { app.meter_when_loaded(); }},
      {Action::daylight,
       [](App& app, const Command&) {
         if (give_day(app.model_.scene, app.derived_.exposure)) app.meter_when_loaded();
       }},
      {Action::white,
       [](App& app, const Command&) {
         std::ranges::fill(app.model_.scene.medium.coalbedo, 0.0f);
         app.model_.scene.albedo_given = true;
       }},
      {Action::keep_place,
       [](App& app, const Command& command) {
         const Item item{command.text == "model" ? Item::Kind::model : Item::Kind::volume,
                         static_cast<std::size_t>(command.value), 0};
         if (transform_of(app.model_.scene, item)) set_transform(app.model_.scene, item, glm::dmat4(1.0));
       }},
      {Action::go_to_end,
       [](App& app, const Command& command) {
         app.model_.playing = false;
         app.clock_.go_to_end(command.value > 0);
       }},
      {Action::about, [](App& app, const Command&) { app.show_about(); }},
  });

  /// Returns true if each action has a function, at its index.
  static constexpr bool is_complete() {
    for (std::size_t i = 0; i < table.size(); ++i)
      if (table[i].action != static_cast<Action>(i)) return false;
    return table.size() == static_cast<std::size_t>(Action::about) + 1;
  }
};

void App::execute(const std::vector<Command>& commands) {
  for (const Command& command : commands) execute(command);
}

void App::execute(const Command& command) {
  static_assert(Commands::is_complete());
  Commands::table[static_cast<std::size_t>(command.action)].run(*this, command);
}

void App::choose_dialogs() {
  if (model_.preferences.desktop_dialogs && options_.replay.empty())
    panel_.dialog().use_desktop(desktop_dialog_program(), window_->portal_name());
  else
    panel_.dialog().use_own();
}

void App::open_dialog(const char* title, Action action, std::vector<std::string> endings) {
  panel_.dialog().open(title, action, std::move(endings), model_.preferences.folder);
}

void App::save_dialog(const char* title, Action action, const char* ending) {
  panel_.dialog().open(title, action, {ending}, suggest_path(model_, ending));
}

void App::cancel() {
  if (image_->cancel()) return;
  if (model_.help)
    model_.help = false;
  else if (!model_.messages.empty())
    model_.messages.pop_back();
  else if (!model_.status.saving.empty())
    exchange_.requests.push_back({Request::Type::forget_saves});
  else if (model_.status.busy || exchange_.waiting())
    renderer_->cancel();
  else if (model_.chosen)
    model_.chosen.reset();
  else
    ImGui::SetWindowFocus(nullptr);
}

void App::open(const std::string& path) {
  if (path.empty()) return;
  if (has_ending(path, ".json")) {
    open_scene(path, path);
    return;
  }
  const bool keeps = model_.modified || !model_.scene_path.empty();
  if (is_model(path)) {
    open_surfaces(model_, path);
    loading_.surfaces = loading_.remark = true;
  } else if (is_environment(path)) {
    model_.scene.environment = loading_.environment = path;
  } else {
    const UpAxis up = known_up_axis(path);
    set_volume(model_.scene, {.volume = path, .up = up});
    model_.scene.clip = {};  // it is in the space of the volume before
    if (!loading_.starting) model_.scene.albedo_given = false;
    if (up == UpAxis::z) show_up_axis(path, "");
    model_.scene.sequence.first.reset();
    model_.scene.sequence.last.reset();
    model_.scene.sequence.frame.reset();
    model_.scene.sequence.playback.repeat = CUMULET_REPEAT_LOOP;
    model_.scene.visible = true;
    deselect(model_);
    loading_.fit = loading_.suggest = loading_.pick = loading_.reload = loading_.remark = true;
    for (std::size_t i = 0; i < model_.scene.models.size(); ++i) {
      if (model_.scene.models[i].to_world == std::array<double, 16>{})
        loading_.added.push_back({Item::Kind::model, i, 0});
    }
  }
  meter_when_loaded();
  // A file that is only viewed needs no saving.
  if (!keeps && file_count(model_.scene) == 1) changes_->reset(model_.scene);
}

void App::open_sample(const std::string& scene) {
  try {
    samples_.files.request(scene);
    if (samples_.files.writes()) show_message(model_, false, "Writing the sample scenes...", now_);
  } catch (const std::exception& error) {
    show_message(model_, true, error.what(), now_);
  }
}

void App::follow_samples() {
  try {
    if (const auto scene = samples_.files.take()) execute({Action::open, *scene});
  } catch (const std::exception& error) {
    show_message(model_, true, error.what(), now_);
  }
}

void App::set_up_axis(SceneVolume& volume, UpAxis up) {
  if (volume.up == up) return;
  volume.up = up;
  if (volume.clip.empty()) return;
  // The clip is in the space after this transform.
  if (volume.to_world == SceneVolume().to_world)
    volume.clip = turned(volume.clip, up);
  else
    show_message(model_, false,
                 "The clip of " + volume.label() + " stays, because the volume has a transform of its own", now_);
}

void App::show_about() {
  const auto text_of = [this](unsigned name) {
    const auto* const text = gl_->GetString(name);
    return text == nullptr ? std::string("unknown") : std::string(reinterpret_cast<const char*>(text));
  };
  panel_.question().ask("About Cumulet", about_text(text_of(GL_RENDERER), text_of(GL_VERSION)),
                        {{"Close", "Closes the window (Escape).", std::nullopt}});
}

void App::show_up_axis(const std::string& path, const std::string& further) {
  const std::string name = std::filesystem::path(path).filename().string();
  show_message(model_, false, name + ": Z is up, as its metadata says", now_,
               MessageButton{"Y up",
                             "Stands the volume on its Y axis, as in its file. Ctrl+Z undoes that.",
                             {Action::choose_up, further, static_cast<int>(UpAxis::y)}});
}

void App::suggest_up_axis() {
  const SceneVolume& volume = model_.scene;
  if (!volume.is_shown() || volume.up != UpAxis::y || known_up_axis(volume.volume) != UpAxis::z) return;
  show_message(model_, false, volume.volume + ": written by Blender or Mantaflow, whose up axis is Z", now_,
               MessageButton{"Z up",
                             "Stands the volume on its Z axis, as --up z. Ctrl+Z undoes that.",
                             {Action::choose_up, "", static_cast<int>(UpAxis::z)}});
}

void App::render_picture() {
  SceneOptions scene = model_.scene;
  if (const auto& play = model_.status.play) {
    scene.sequence.frame = play->frame();
    set_animation_time(scene, model_.clock);
  }
  try {
    pictures_.add(job_of(panel_.render_dialog().settings(), scene));
    model_.renders_open = true;
  } catch (const std::exception& error) {
    show_message(model_, true, error.what(), now_);
  }
}

void App::follow_renders() {
  RenderQueue& queue = pictures_.queue();
  model_.renders = queue.entries();
  for (const RenderEntry& entry : queue.take_ended()) {
    const MessageButton button{"Show in folder", "Opens the folder of the file.", {Action::show_in_folder, entry.path}};
    if (entry.state == RenderEntry::State::failed)
      show_message(model_, true, "Render of " + entry.path + " failed: " + entry.text, now_);
    else if (entry.state == RenderEntry::State::done)
      show_message(model_, false, "Rendered " + entry.path + ", " + entry.text, now_, button);
  }
}

bool App::ask_about_renders() {
  const std::size_t count = pictures_.queue().unfinished();
  if (count == 0) return false;
  panel_.question().ask(
      "Unfinished pictures",
      (count == 1 ? "A picture is" : std::to_string(count) + " pictures are") + std::string(" still being rendered."),
      {{"Wait", "Returns to the scene.", std::nullopt},
       {"Quit anyway", "Cancels the pictures.", Command{Action::quit_anyway}},
       {"Cancel", "Returns to the scene (Escape).", std::nullopt}});
  return true;
}

void App::open_dropped(const std::vector<std::string>& files) {
  const DroppedFiles dropped = demo::open_dropped(files);
  clock_.play_when_loaded(dropped.plays);
  const bool replaces = !dropped.commands.empty() && has_ending(dropped.commands.front().text, ".json");
  if (!replaces || !ask_about_changes(dropped.commands)) execute(dropped.commands);
  for (const std::string& file : dropped.left_out)
    show_message(model_, true, file + ": not opened, because another dropped file of its kind was", now_);
}

void App::step_history(bool back) {
  image_->release_handle();
  const auto scene = back ? history_->undo(model_.scene) : history_->redo(model_.scene);
  if (!scene) return;
  const cumulet_camera_desc camera = model_.scene.camera;
  model_.scene = *scene;
  loading_.added.clear();
  loading_.fit = loading_.suggest = false;
  if (model_.navigation.turntable_degrees_per_second != 0.0) model_.scene.camera = camera;
}

}  // namespace cumulet::demo
