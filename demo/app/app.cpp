#include "app.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <glad/gl.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <file.hpp>
#include <filesystem>
#include <image.hpp>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <program.hpp>
#include <settings.hpp>
#include <stdexcept>
#include <thread>
#include <utility>

#include "fire.hpp"
#include "renderer.hpp"
#include "thumbnail_texture.hpp"

namespace cumulet::demo {
namespace {

using Json = nlohmann::ordered_json;

// Tracing budget per frame in milliseconds. During interaction the frame rate matters, and the library traces as few
// pixels as fit. At rest the sample rate matters.
constexpr double moving_budget = 16.0;
constexpr double resting_budget = 60.0;

constexpr double event_emissive = 0.7;  // seconds of frames after an event, because tooltips and highlights appear late
constexpr double motion_rest = 0.4;     // seconds without camera motion that end an undo step
constexpr double replay_frame = 1.0 / 60.0;
constexpr double min_frame = 1.0 / 60.0;  // minimum seconds between frames
constexpr double picture_frame = 0.15;    // maximum seconds that the window waits for an image being rendered
constexpr double click_reach = 4.0;       // pixels at scale 1 that the pointer may move during a click

}  // namespace

App::App(DemoOptions options) : options_(std::move(options)), preferences_path_(preferences_path()) {
  model_.scene = options_.scene;
  model_.unchosen_ground = options_.unchosen_ground;
  suggest_next_ = model_.scene.auto_density_scale && model_.scene.medium.density_scale == 0.0;
  spell_out_defaults(model_.scene);
  model_.preferences = load_preferences(preferences_path_);
  model_.navigation.style = model_.preferences.style;
  if (!options_.replay.empty())
    player_.emplace(parse_replay(image::read_file(options_.replay), options_.replay), options_.replay);
  if (!options_.trace.empty()) image::check_writable(options_.trace);
  if (!options_.record.empty()) recorder_.emplace(options_.record);

  const int width = options_.sized ? static_cast<int>(options_.scene.width) : model_.preferences.width;
  const int height = options_.sized ? static_cast<int>(options_.scene.height) : model_.preferences.height;
  window_ = std::make_unique<Window>(width, height);
  gl_ = std::make_unique<GladGLContext>();
  if (gladLoadGLContextUserPtr(
          gl_.get(),
          [](void* user, const char* name) { return reinterpret_cast<GLADapiproc>(Window::get_proc(user, name)); },
          nullptr) == 0)
    throw std::runtime_error("the OpenGL functions cannot be loaded");
  context_ = window_->make_shared_context();
  renderer_ =
      std::make_unique<Renderer>(*gl_, context_.get(), Window::wake, options_.trace.empty() ? nullptr : &timeline_,
                                 options_.shader_cache, options_.shaders);
  // The scene's size is that of a rendered image. The window has its own size.
  model_.scene.width = 1280;
  model_.scene.height = 720;
  if (!options_.open.empty()) open(options_.open);
  history_.emplace(model_.scene);
}

App::~App() = default;

void App::run() {
  while (!quit_ && !window_->should_close()) {
    Window::wait(patience());
    // Limits the frame rate: the remaining time is for rendering.
    const double early = now_ + min_frame - glfwGetTime();
    if (!stepped() && early > 0.0) {
      std::this_thread::sleep_for(std::chrono::duration<double>(early));
      Window::wait(0.0);
    }
    frame();
  }
  remember();
  if (!options_.trace.empty()) image::replace_file(options_.trace, timeline_.json());
}

double App::patience() const {
  if (stepped() || window_->input().pending()) return 0.0;
  double wait = player_ ? order_.idle : std::numeric_limits<double>::infinity();
  if (has_pending_frame_) wait = std::min(wait, std::max(drawn_at_ + picture_frame - now_, min_frame));
  constexpr double emissive_frame = 1.0 / 30.0;
  if (model_.playing) return std::min(wait, min_frame);
  if (now_ - last_event_ < event_emissive) return std::min(wait, emissive_frame);
  constexpr double blink = 0.4;
  constexpr double slow_frame = 0.1;
  if (ImGui::GetIO().WantTextInput) wait = std::min(wait, blink);
  for (const Message& message : model_.messages)
    if (!message.error) wait = std::min(wait, std::max(message.until - now_, slow_frame));
  return wait;
}

void App::frame() {
  const double before = std::exchange(now_, glfwGetTime());
  const auto scale = static_cast<float>(options_.ui_scale > 0.0 ? options_.ui_scale : window_->content_scale());
  if (scale != ui_scale_) Window::set_ui_scale(scale);
  ui_scale_ = scale;
  take();
  // The clock stops while an image is being saved, so that it shows one point in time.
  if (model_.playing && model_.status.saving.empty()) advance_clock(stepped() ? replay_frame : now_ - before);

  order_ = {};
  if (player_) {
    ReplayHost host;
    host.loading = model_.status.busy || waiting();
    host.converged = settled() && (model_.status.frame.flags & CUMULET_RENDER_CONVERGED) != 0;
    host.viewport = viewport_;
    host.find = [this](const std::string& label) {
      auto control = panel_.ui().find(label);
      const auto seen = sight();
      if (!control && seen) control = Handles::find(label, model_, *seen, ui_scale_);
      if (!control) panel_.ui().bring_into_view(label);
      return control;
    };
    order_ = player_->next(host, window_->input());
  }
  const std::vector<Event> events = window_->input().take();
  if (!events.empty()) last_event_ = now_;
  window_->begin_frame(events, stepped() ? replay_frame : 0.0);
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  viewport_ = Panel::viewport(model_, static_cast<double>(screen.x), static_cast<double>(screen.y), ui_scale_);
  handle(events);
  if (const auto region = region_drag_.taken(viewport_)) std::ranges::copy(*region, model_.scene.sampling.region);
  drag_handle();
  if (model_.chosen && !transform_of(model_.scene, *model_.chosen)) model_.chosen.reset();

  model_.can_undo = history_->can_undo(model_.scene);
  model_.can_redo = history_->can_redo();
  last_state_ = panel_.state();
  take_thumbnail();
  std::vector<Command> commands;
  panel_.draw(model_, ui_scale_, now_, commands);
  execute(commands);

  if (std::exchange(camera_moved_, false) && model_.navigation.turntable_degrees_per_second == 0.0) last_motion_ = now_;
  follow_playback();
  held_ = ImGui::IsAnyItemActive() || viewport_buttons_ != 0 || now_ - last_motion_ < motion_rest;
  ask();
  if (stepped()) {
    renderer_->wait_for(desired_.number);
    take();
  }
  follow_history();
  const bool picture = drawn_pictures_ != pictures_;
  const bool drawn = draw();
  obey(order_);
  if (recorder_) recorder_->frame(events, model_.status.busy || waiting());
  if (drawn) {
    window_->swap();
    ++drawn_frames_;
  }
  take_frame_time(events, drawn, picture);
  take_statistics();
  ++frames_;

  const std::string name = std::filesystem::path(main_file(model_.scene)).filename().string();
  title_ = name.empty() ? "Cumulet" : name + " - Cumulet";
  window_->set_title(title_);
}

void App::handle(const std::vector<Event>& events) {
  for (const Event& event : events) {
    const bool over_picture = !ImGui::GetIO().WantCaptureMouse;
    if (region_drag_.take(event, window_->input().x(), window_->input().y(), over_picture)) continue;
    switch (event.type) {
      case Event::Type::key:
        handle_key(event);
        break;
      case Event::Type::drop:
        open(event.path);
        break;
      case Event::Type::resize:
        window_->resize(static_cast<int>(event.x), static_cast<int>(event.y));
        break;
      case Event::Type::focus_lost:
        viewport_buttons_ = 0;
        handles_.release();
        clicked_.reset();
        to_viewer(event);
        break;
      case Event::Type::button: {
        const unsigned bit = 1U << static_cast<unsigned>(event.code);
        const bool ours = event.down ? !ImGui::GetIO().WantCaptureMouse : (viewport_buttons_ & bit) != 0;
        if (!ours) break;
        viewport_buttons_ = event.down ? viewport_buttons_ | bit : viewport_buttons_ & ~bit;
        if (event.down)
          press(event);
        else
          let_go(event);
        break;
      }
      case Event::Type::move:
        if (clicked_ && glm::distance(*clicked_, pointer()) > click_reach * static_cast<double>(ui_scale_))
          clicked_.reset();
        if (handles_.holds()) break;
        [[fallthrough]];
      case Event::Type::wheel:
        if (viewport_buttons_ != 0 || !ImGui::GetIO().WantCaptureMouse) to_viewer(event);
        break;
      case Event::Type::character:
        break;
    }
  }
}

void App::handle_key(const Event& event) {
  const ImGuiIO& io = ImGui::GetIO();
  const bool in_popup = ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopupId | ImGuiPopupFlags_AnyPopupLevel);
  if (event.down && !in_popup) {
    const bool escape = event.code == GLFW_KEY_ESCAPE;
    const auto command = command_of(event.code, event.modifiers, io.WantTextInput);
    // Space activates the focused control during keyboard navigation.
    const bool presses = event.code == GLFW_KEY_SPACE && io.NavVisible;
    // Fly mode uses the tool keys itself.
    const bool flies = command && command->action == Action::tool && model_.navigation.fly != 0;
    if (command && !presses && !flies && !(escape && ImGui::IsAnyItemActive())) {
      execute(*command);
      return;
    }
  }
  if (event.down && (io.WantCaptureKeyboard || io.WantTextInput)) return;
  to_viewer(event);
}

void App::press(const Event& event) {
  clicked_.reset();
  const bool plain = (event.modifiers & (modifier_shift | modifier_alt)) == 0;
  if (event.code == GLFW_MOUSE_BUTTON_LEFT && plain && model_.navigation.fly == 0) {
    const auto seen = sight();
    if (seen && handles_.press(model_, *seen, pointer(), ui_scale_)) return;
    if ((event.modifiers & modifier_ctrl) == 0) clicked_ = pointer();
  }
  if (!handles_.holds()) to_viewer(event);
}

void App::let_go(const Event& event) {
  if (event.code != GLFW_MOUSE_BUTTON_LEFT || !handles_.holds()) {
    to_viewer(event);
    if (event.code == GLFW_MOUSE_BUTTON_LEFT && clicked_) choose_at(*std::exchange(clicked_, std::nullopt));
    return;
  }
  drag_handle();
  handles_.release();
}

void App::choose_at(const glm::dvec2& pixel) {
  const auto seen = sight();
  if (!seen) return;
  if (const auto analytic_light = Handles::analytic_light_at(model_, *seen, pixel, ui_scale_)) {
    model_.chosen = analytic_light;
    return;
  }
  requests_.push_back({Request::Type::pick, {}, pixel.x - viewport_.x, pixel.y - viewport_.y});
}

std::optional<Sight> App::sight() const {
  if (needs_fit(model_.scene.camera) || !(viewport_.width > 0.0 && viewport_.height > 0.0)) return std::nullopt;
  return Sight(model_.scene.camera, viewport_);
}

void App::drag_handle() {
  if (!handles_.holds()) return;
  if (const auto seen = sight())
    handles_.drag(model_, *seen, pointer(), (window_->input().modifiers() & modifier_ctrl) != 0);
}

void App::draw_handles() {
  const auto seen = sight();
  if (!seen || model_.navigation.fly != 0) return;
  const bool free = viewport_buttons_ == 0 && !ImGui::GetIO().WantCaptureMouse;
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const auto corner = [](double x, double y) { return ImVec2(static_cast<float>(x), static_cast<float>(y)); };
  list.PushClipRect(corner(viewport_.x, viewport_.y),
                    corner(viewport_.x + viewport_.width, viewport_.y + viewport_.height));
  handles_.draw(list, model_, *seen, free ? std::optional(pointer()) : std::nullopt, ui_scale_);
  list.PopClipRect();
}

void App::to_viewer(const Event& event) {
  cumulet_event out{};
  out.struct_size = sizeof out;
  out.x = window_->input().x() - viewport_.x;
  out.y = window_->input().y() - viewport_.y;
  out.modifiers = event.modifiers;
  switch (event.type) {
    case Event::Type::move:
      out.type = CUMULET_EVENT_POINTER_MOVE;
      break;
    case Event::Type::button:
      out.type = event.down ? CUMULET_EVENT_BUTTON_DOWN : CUMULET_EVENT_BUTTON_UP;
      out.button = event.code == GLFW_MOUSE_BUTTON_LEFT     ? CUMULET_BUTTON_LEFT
                   : event.code == GLFW_MOUSE_BUTTON_MIDDLE ? CUMULET_BUTTON_MIDDLE
                                                            : CUMULET_BUTTON_RIGHT;
      break;
    case Event::Type::wheel:
      out.type = CUMULET_EVENT_WHEEL;
      out.wheel = event.y;
      break;
    case Event::Type::key:
      out.type = event.down ? CUMULET_EVENT_KEY_DOWN : CUMULET_EVENT_KEY_UP;
      out.key = viewer_key(event.code);
      break;
    case Event::Type::focus_lost:
      out.type = CUMULET_EVENT_FOCUS_LOST;
      break;
    case Event::Type::character:
    case Event::Type::drop:
    case Event::Type::resize:
      return;
  }
  inputs_.push_back({out, event.type == Event::Type::key ? event.code : 0});
}

void App::execute(const std::vector<Command>& commands) {
  for (const Command& command : commands) execute(command);
}

void App::execute(const Command& command) {
  constexpr float third = 1.0f / 3.0f;
  constexpr double turn_speed = 20.0;
  auto& display = model_.scene.display;
  auto& navigation = model_.navigation;
  switch (command.action) {
    case Action::open_dialog:
      panel_.dialog().open("Open", Action::open, {".vdb", ".nvdb", ".gltf", ".glb", ".hdr", ".exr", ".json"},
                           model_.preferences.folder);
      break;
    case Action::open:
      open(command.text);
      break;
    case Action::add_volume_dialog:
      panel_.dialog().open("Add volume", Action::add_volume, {".vdb", ".nvdb"}, model_.preferences.folder);
      break;
    case Action::add_volume:
      model_.scene.others.emplace_back().volume = command.text;
      spell_out_defaults(model_.scene);
      break;
    case Action::add_model_dialog:
      panel_.dialog().open("Add model", Action::add_model, {".gltf", ".glb"}, model_.preferences.folder);
      break;
    case Action::add_model:
      model_.scene.models.push_back({command.text});
      break;
    case Action::environment_dialog:
      panel_.dialog().open("Open environment map", Action::open, {".hdr", ".exr"}, model_.preferences.folder);
      break;
    case Action::clear_environment:
      model_.scene.environment.clear();
      give_daylight(model_.scene);
      break;
    case Action::save_scene:
      if (!model_.scene_path.empty()) {
        save_scene(model_.scene_path);
        break;
      }
      [[fallthrough]];
    case Action::save_scene_dialog:
      panel_.dialog().open("Save scene", Action::save_scene_as, {".json"}, suggest_path(model_, ".json"));
      break;
    case Action::save_scene_as:
      save_scene(command.text);
      break;
    case Action::png_dialog:
      if (model_.status.has_content)
        panel_.dialog().open("Save image", Action::save_png, {".png"}, suggest_path(model_, ".png"));
      break;
    case Action::exr_dialog:
      if (model_.status.has_content)
        panel_.dialog().open("Save linear radiance", Action::save_exr, {".exr"}, suggest_path(model_, ".exr"));
      break;
    case Action::save_png:
    case Action::save_exr:
      requests_.push_back(
          {command.action == Action::save_exr ? Request::Type::save_exr : Request::Type::save_png, command.text});
      break;
    case Action::undo:
    case Action::redo:
      step_history(command.action == Action::undo);
      break;
    case Action::frame_all:
      requests_.push_back({Request::Type::frame_all});
      break;
    case Action::cancel:
      cancel();
      break;
    case Action::cancel_load:
      renderer_->cancel();
      break;
    case Action::dismiss:
      std::erase_if(model_.messages, [&](const Message& message) { return message.text == command.text; });
      break;
    case Action::toggle_panel:
      model_.panel = !model_.panel;
      break;
    case Action::focus_panel:
      model_.panel = true;
      panel_.focus();
      break;
    case Action::toggle_help:
      model_.help = !model_.help;
      break;
    case Action::toggle_fly:
      navigation.fly = navigation.fly != 0 ? 0 : 1;
      // Moves the keyboard focus from the panel to the image.
      ImGui::SetWindowFocus(nullptr);
      break;
    case Action::toggle_turntable:
      navigation.turntable_degrees_per_second = navigation.turntable_degrees_per_second != 0.0 ? 0.0 : turn_speed;
      break;
    case Action::tool:
      handles_.release();
      model_.tool = static_cast<Tool>(command.value);
      break;
    case Action::toggle_axes:
      handles_.release();
      model_.axes = model_.axes == Axes::world ? Axes::local : Axes::world;
      break;
    case Action::brighter:
      display.exposure_stops = std::min(display.exposure_stops + third, 10.0f);
      break;
    case Action::darker:
      display.exposure_stops = std::max(display.exposure_stops - third, -10.0f);
      break;
    case Action::next_grid_type:
      model_.scene.grid.type = static_cast<cumulet_grid_type>((static_cast<int>(model_.scene.grid.type) + 1) % 3);
      break;
    case Action::view:
      model_.scene.sampling.view = static_cast<cumulet_view_mode>(command.value);
      break;
    case Action::grids_dialog:
      panel_.picker().open(model_.status.play ? model_.status.play->row.file(model_.status.play->info.requested_frame)
                                              : model_.scene.volume,
                           Window::wake);
      break;
    case Action::choose_grid:
      suggest_next_ = model_.scene.grid_name != command.text;
      model_.scene.grid_name = command.text;
      break;
    case Action::choose_up:
      // The volume moves with the up axis, so the camera must be fitted again.
      fit_next_ = model_.scene.up != static_cast<UpAxis>(command.value);
      model_.scene.up = static_cast<UpAxis>(command.value);
      break;
    case Action::auto_density:
      requests_.push_back({Request::Type::suggest_density});
      break;
    case Action::play_row:
      play_row();
      break;
    case Action::play:
      play_or_pause();
      break;
    case Action::step:
      step(command.value);
      break;
    case Action::go_to:
      model_.playing = false;
      go_to(static_cast<std::uint32_t>(command.value));
      break;
    case Action::begin_here:
      if (model_.status.play) model_.scene.sequence.first = model_.status.play->frame();
      break;
    case Action::end_here:
      if (model_.status.play) model_.scene.sequence.last = model_.status.play->frame();
      break;
    case Action::draw_region:
      region_drag_.arm();
      break;
    case Action::clear_region:
      std::ranges::fill(model_.scene.sampling.region, 0.0f);
      break;
    case Action::quit:
      quit_ = true;
      break;
  }
}

void App::cancel() {
  if (region_drag_.cancel()) return;
  if (handles_.holds())
    handles_.cancel(model_);
  else if (model_.help)
    model_.help = false;
  else if (!model_.messages.empty())
    model_.messages.pop_back();
  else if (!model_.status.saving.empty())
    requests_.push_back({Request::Type::forget_saves});
  else if (model_.status.busy || waiting())
    renderer_->cancel();
  else if (model_.chosen)
    model_.chosen.reset();
  else
    ImGui::SetWindowFocus(nullptr);
}

void App::go_to(std::uint32_t index) {
  const auto& play = model_.status.play;
  if (!play) return;
  static_cast<void>(cumulet_sequence_set_frame(play->sequence.get(), index));
  static_cast<void>(cumulet_sequence_get_time_of(play->sequence.get(), index, &model_.clock));
}

void App::step(int frames) {
  const auto& play = model_.status.play;
  if (!play) return;
  model_.playing = false;
  const auto last = static_cast<std::int64_t>(play->row.count()) - 1;
  go_to(
      static_cast<std::uint32_t>(std::clamp<std::int64_t>(std::int64_t{play->info.requested_frame} + frames, 0, last)));
}

void App::play_or_pause() {
  const auto& play = model_.status.play;
  if (!play) return;
  model_.playing = !model_.playing;
  const cumulet_playback_desc playback = playback_of(model_.scene.sequence, play->row);
  const bool at_end = play->info.requested_frame >= playback.first_frame + playback.frame_count - 1;
  if (model_.playing && playback.repeat == CUMULET_REPEAT_HOLD && at_end) go_to(playback.first_frame);
}

void App::play_row() {
  const auto& row = model_.status.neighbours;
  if (!row) return;
  SceneOptions& scene = model_.scene;
  for (std::uint32_t i = 0; i < row->count(); ++i)
    if (row->file(i) == scene.volume) scene.sequence.frame = row->number(i);
  scene.volume = row->pattern().text();
}

void App::advance_clock(double seconds) {
  const auto& play = model_.status.play;
  if (!play) {
    model_.playing = false;
    return;
  }
  model_.clock += seconds;
  const cumulet_playback_desc playback = playback_of(model_.scene.sequence, play->row);
  const double length = playback.frame_count / playback.frames_per_second;
  // With CUMULET_REPEAT_HOLD, playback stops at the last frame.
  if (playback.repeat == CUMULET_REPEAT_HOLD && model_.clock >= playback.offset_seconds + length) {
    model_.playing = false;
    go_to(playback.first_frame + playback.frame_count - 1);
    return;
  }
  static_cast<void>(cumulet_sequence_set_time(play->sequence.get(), model_.clock));
}

void App::follow_playback() {
  const auto& play = model_.status.play;
  if (!play) return;
  const cumulet_playback_desc now = playback_of(model_.scene.sequence, play->row);
  const bool known = std::exchange(known_sequence_, play->sequence.get()) == play->sequence.get();
  if (known && settings::same(now, playback_of(desired_.scene.sequence, play->row))) return;
  // After a change of the playback settings the clock is set so that the displayed frame stays.
  model_.clock = now.offset_seconds + (double(play->info.requested_frame) - now.first_frame) / now.frames_per_second;
}

void App::open(const std::string& path) {
  if (path.empty()) return;
  if (is_model(path)) {
    open_surfaces(model_, path);
    return;
  }
  if (is_environment(path)) {
    model_.scene.environment = opening_environment_ = path;
    return;
  }
  if (!has_ending(path, ".json")) {
    set_volume(model_.scene, {.volume = path});
    model_.scene.sequence.first.reset();
    model_.scene.sequence.last.reset();
    model_.scene.sequence.frame.reset();
    model_.scene.visible = true;
    fit_next_ = suggest_next_ = pick_next_ = reload_ = true;
    return;
  }
  try {
    SceneOptions scene = load_scene(path);
    suggest_next_ = scene.auto_density_scale && scene.medium.density_scale == 0.0;
    spell_out_defaults(scene);
    scene.width = model_.scene.width;
    scene.height = model_.scene.height;
    model_.scene = std::move(scene);
    model_.unchosen_ground = false;
    model_.scene_path = path;
    opening_scene_ = path;
    reload_ = true;
    fit_next_ = needs_fit(model_.scene.camera);
  } catch (const std::exception& error) {
    complain(error.what());
    model_.preferences.forget(path);
  }
}

void App::save_scene(const std::string& path) {
  SceneOptions scene = model_.scene;
  // Saves the viewport size, so that cumulet-render gives the same framing.
  scene.width = static_cast<std::uint32_t>(std::clamp(viewport_.width, 1.0, 16384.0));
  scene.height = static_cast<std::uint32_t>(std::clamp(viewport_.height, 1.0, 16384.0));
  if (model_.status.play) {
    scene.sequence.frame = model_.status.play->frame();
    if (!scene.surfaces.empty()) scene.surface.time = std::max(model_.clock, 0.0);
  }
  try {
    demo::save_scene(scene, path);
    model_.scene_path = path;
    model_.preferences.remember(path);
    tell(model_, false, "Saved " + path, now_);
  } catch (const std::exception& error) {
    tell(model_, true, error.what(), now_);
  }
}

bool App::waiting() const {
  return answer_waits_ || answered_volume_ != desired_.volume_edit || answered_surfaces_ != desired_.surfaces_edit ||
         answered_environment_ != desired_.environment_edit;
}

bool App::is_unsaid() const {
  cumulet_medium_desc medium = model_.scene.medium;
  if (demo::is_unsaid(medium)) return true;
  if (!look_) return false;
  medium.density_scale = look_->density_scale;
  return settings::same(medium, *look_);
}

void App::complain(const std::string& cause) {
  if (starting_) std::cerr << "cumulet-demo: " << one_line(cause) << std::endl;
  tell(model_, true, cause, now_);
}

void App::follow_history() {
  SceneOptions scene = model_.scene;
  // Turntable motion is not an undo step.
  if (model_.navigation.turntable_degrees_per_second != 0.0) scene.camera = history_->current().camera;
  history_->offer(scene, held_ || waiting() || !settled());
}

void App::ask() {
  DesiredState desired;
  desired.number = desired_.number;
  desired.scene = model_.scene;
  if (model_.status.play) desired.scene.surface.time = std::max(model_.clock, 0.0);
  desired.camera_edit = desired_.camera_edit + (same_camera(desired.scene.camera, desired_.scene.camera) ? 0 : 1);
  const bool load = std::exchange(reload_, false) || volume_of(desired.scene) != volume_of(desired_.scene);
  desired.volume_edit = desired_.volume_edit + (load ? 1 : 0);
  desired.fit = load ? std::exchange(fit_next_, false) : desired_.fit;
  desired.suggest = load ? std::exchange(suggest_next_, false) : desired_.suggest;
  desired.unsaid = load ? is_unsaid() : desired_.unsaid;
  desired.surfaces_edit = desired_.surfaces_edit + (desired.scene.surfaces == desired_.scene.surfaces ? 0 : 1);
  desired.environment_edit =
      desired_.environment_edit + (desired.scene.environment == desired_.scene.environment ? 0 : 1);
  desired.navigation = model_.navigation;
  desired.adaptive_resolution = model_.adaptive_resolution;
  desired.held = held_;
  desired.paused = panel_.dialog_open();
  desired.budget_ms = held_ || now_ - last_event_ < motion_rest ? moving_budget : resting_budget;
  desired.width = static_cast<std::uint32_t>(viewport_.width);
  desired.height = static_cast<std::uint32_t>(viewport_.height);
  desired.scale = static_cast<double>(ui_scale_);
  if (!stepped() && same_request(desired, desired_) && inputs_.empty() && requests_.empty()) return;
  ++desired.number;
  const bool changed = !inputs_.empty() || !same_scene(desired.scene, desired_.scene);
  if (changed && !changed_at_) {
    changed_at_ = now_;
    changed_number_ = desired.number;
  }
  desired_ = desired;
  renderer_->ask(std::move(desired), std::exchange(inputs_, {}), std::exchange(requests_, {}));
}

void App::take() {
  if (const auto answer = renderer_->take()) accept(*answer);
}

void App::accept(const Answer& answer) {
  if (answer.drawn) {
    ++pictures_;
    drawn_ = answer.desired;
  }
  answered_ = answer.desired;
  answer_waits_ = answer.waiting;
  answered_volume_ = answer.volume_edit;
  answered_surfaces_ = answer.surfaces_edit;
  answered_environment_ = answer.environment_edit;
  camera_moved_ |= answer.camera_moved;
  if (answer.camera_moved) {
    end_shutter(model_.scene);
    end_shutter(desired_.scene);
  }
  // Ignores values of the viewer that the user has changed since.
  if (answer.camera_edit == desired_.camera_edit) model_.scene.camera = desired_.scene.camera = answer.camera;
  if (answer.volume_edit == desired_.volume_edit) {
    set_volume(model_.scene, answer.volume);
    set_volume(desired_.scene, answer.volume);
  }
  if (answer.surfaces_edit == desired_.surfaces_edit) model_.scene.surfaces = desired_.scene.surfaces = answer.surfaces;
  if (answer.environment_edit == desired_.environment_edit)
    model_.scene.environment = desired_.scene.environment = answer.environment;
  if (!waiting() && !opening_environment_.empty()) {
    if (model_.scene.environment == opening_environment_) take_daylight(model_.scene);
    opening_environment_.clear();
  }
  if (model_.status.compiled && !answer.status.compiled) model_.charts.compiled_percent.add(100.0f);
  if (answer.status.compiled) model_.charts.compiled_percent.add(static_cast<float>(100.0 * *answer.status.compiled));
  if (answer.status.noise && answer.status.noise != model_.status.noise)
    model_.charts.noise_percent.add(static_cast<float>(100.0 * *answer.status.noise));
  if (answer.density_scale) model_.scene.medium.density_scale = *answer.density_scale;
  if (answer.look && is_unsaid()) {
    look_ = answer.look;
    model_.scene.medium = *look_;
  }
  if (answer.picked) model_.chosen = answer.picked->item;
  // Changes during startup are not undo steps.
  if (starting_ && (answer.density_scale || answer.look)) history_.emplace(model_.scene);
  model_.status = answer.status;
  model_.grids = answer.grids;
  for (const Answer::Notice& notice : answer.notices) {
    if (notice.error)
      complain(notice.text);
    else
      tell(model_, false, notice.text, now_);
  }
  remember_files(answer);
  if (!waiting() && std::exchange(pick_next_, false)) {
    const auto& grids = model_.grids;
    const auto shown = std::ranges::count_if(grids, [](const GridInfo& grid) { return grid.refusal.empty(); });
    const bool clear = std::ranges::any_of(grids, [](const GridInfo& grid) { return grid.name == "density"; });
    if (shown > 1 && !clear) panel_.picker().open(model_.scene.volume, Window::wake);
  }
  if (!waiting()) starting_ = false;
}

void App::remember_files(const Answer& answer) {
  Preferences& preferences = model_.preferences;
  for (const Answer::File& file : answer.files) {
    switch (file.fate) {
      case Answer::File::Fate::opened:
        preferences.remember(file.path);
        break;
      case Answer::File::Fate::failed:
        preferences.forget(file.path);
        preferences.forget(opening_scene_);
        opening_scene_.clear();
        break;
      case Answer::File::Fate::saved:
        preferences.folder = std::filesystem::path(file.path).parent_path().string();
        break;
    }
  }
  if (!waiting() && !opening_scene_.empty()) preferences.remember(std::exchange(opening_scene_, {}));
}

void App::step_history(bool back) {
  handles_.release();
  const auto scene = back ? history_->undo(model_.scene) : history_->redo(model_.scene);
  if (!scene) return;
  const cumulet_camera_desc camera = model_.scene.camera;
  model_.scene = *scene;
  fit_next_ = suggest_next_ = false;
  if (model_.navigation.turntable_degrees_per_second != 0.0) model_.scene.camera = camera;
}

bool App::draw() {
  const Renderer::Picture picture = renderer_->picture();
  if (picture.texture != 0) {
    // NOLINTNEXTLINE(performance-no-int-to-ptr): so ImGui has textures
    auto* texture = reinterpret_cast<ImTextureID>(std::uintptr_t{picture.texture});
    const ImVec2 low(static_cast<float>(viewport_.x), static_cast<float>(viewport_.y));
    const ImVec2 high(low.x + static_cast<float>(viewport_.width), low.y + static_cast<float>(viewport_.height));
    ImDrawList& behind = *ImGui::GetBackgroundDrawList();
    // The image is opaque. Blending would cost as much as everything else on software drivers.
    const auto cover = [](const ImDrawList*, const ImDrawCmd* command) {
      static_cast<const GladGLContext*>(command->UserCallbackData)->Disable(GL_BLEND);
    };
    behind.AddCallback(cover, gl_.get());
    behind.AddImage(texture, low, high, {0.0f, 1.0f}, {1.0f, 0.0f});
    behind.AddCallback(ImDrawCallback_ResetRenderState, nullptr);
    draw_handles();
  }
  if (const auto drawn = region_drag_.drawn()) {
    const ImVec2 low(static_cast<float>(drawn->x), static_cast<float>(drawn->y));
    const ImVec2 high(low.x + static_cast<float>(drawn->width), low.y + static_cast<float>(drawn->height));
    ImGui::GetForegroundDrawList()->AddRect(low, high, IM_COL32(255, 160, 40, 255), 0.0f, 0, ui_scale_);
  }
  // During a drag there may be 60 changes per second, and with software drivers drawing the window costs as much as an
  // image. So an unchanged window is not drawn, and changes outside the image wait for the next image.
  const bool changed = window_->ui_changed();
  const bool waits = viewport_buttons_ != 0 && now_ - drawn_at_ < picture_frame;
  const bool draws = drawn_pictures_ != pictures_ || !order_.screenshot.empty() || (changed && !waits);
  has_pending_frame_ = changed && !draws;
  if (!draws) return false;
  gl_->BindFramebuffer(GL_FRAMEBUFFER, 0);
  gl_->Disable(GL_SCISSOR_TEST);
  constexpr float dark = 0.075f;
  gl_->ClearColor(dark, dark * 1.08f, dark * 1.2f, 1.0f);
  gl_->Clear(GL_COLOR_BUFFER_BIT);
  window_->draw_ui();
  drawn_pictures_ = pictures_;
  drawn_at_ = now_;
  return true;
}

void App::take_frame_time(const std::vector<Event>& events, bool drawn, bool picture) {
  for (const Event& event : events)
    if (event.time > 0.0) frame_times_.hand(event.time);
  const bool refines = (model_.status.frame.flags & CUMULET_RENDER_INCOMPLETE) != 0;
  const bool due = !desired_.paused && (refines || !settled());
  if (!drawn) {
    if (!has_pending_frame_ && !due) frame_times_.rest();
    return;
  }
  if (const auto seconds = frame_times_.shown(glfwGetTime(), picture, due))
    model_.charts.frame_ms.add(static_cast<float>(1000.0 * *seconds));
}

void App::take_thumbnail() {
  if (model_.status.thumbnail == thumbnail_) return;
  thumbnail_ = model_.status.thumbnail;
  // The new texture is created before the old one is deleted: its name then differs, by which the window detects the
  // change.
  thumbnail_texture_ = thumbnail_ ? std::make_unique<ThumbnailTexture>(*gl_, *thumbnail_) : nullptr;
  model_.thumbnail_texture = thumbnail_ ? thumbnail_texture_->name() : 0;
}

void App::take_statistics() {
  const Status& status = model_.status;
  Charts& charts = model_.charts;
  if (changed_at_ && drawn_ >= changed_number_)
    charts.picture_ms.add(static_cast<float>(1000.0 * (glfwGetTime() - *std::exchange(changed_at_, std::nullopt))));

  const double device = device_seconds(status.stats);
  if (device > device_seconds_) charts.device_ms.add(static_cast<float>(1000.0 * (device - device_seconds_)));
  device_seconds_ = device;

  constexpr double rate_period = 0.5;
  const bool more = (status.frame.flags & CUMULET_RENDER_INCOMPLETE) != 0;
  const double elapsed = now_ - rate_since_;
  // A decreasing count means that the image was restarted.
  if (status.stats.samples < rate_samples_ || !more) {
    rate_samples_ = status.stats.samples;
    rate_since_ = now_;
  } else if (elapsed > rate_period && status.stats.samples > rate_samples_) {
    charts.samples_per_second.add(
        static_cast<float>(static_cast<double>(status.stats.samples - rate_samples_) / elapsed));
    rate_samples_ = status.stats.samples;
    rate_since_ = now_;
  }
}

void App::obey(const Player::Order& order) {
  if (!order.screenshot.empty()) save_window(order.screenshot);
  if (!order.report.empty()) write_report(order.report);
  if (order.quit) quit_ = true;
}

void App::save_window(const std::string& path) {
  const auto [width, height] = window_->size();
  image::Image picture{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), {}};
  const std::size_t row = std::size_t{4} * picture.width;
  std::vector<std::uint8_t> bytes(row * picture.height);
  gl_->BindFramebuffer(GL_READ_FRAMEBUFFER, 0);
  gl_->PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl_->ReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, bytes.data());
  picture.rgba.resize(bytes.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const std::size_t y = picture.height - 1 - i / row;
    picture.rgba[y * row + i % row] = image::srgb_decode(static_cast<float>(bytes[i]) / 255.0f);
  }
  image::PngOptions png;
  png.tone_mapping = image::ToneMapping::none;
  image::write_png(path, picture, png);
}

void App::write_report(const std::string& path) const {
  const Status& status = model_.status;
  Json json;
  json["frames"] = frames_;
  json["drawn_frames"] = drawn_frames_;
  json["idle_frames"] = player_ ? player_->idle_frames() : 0;
  json["converged"] = (status.frame.flags & CUMULET_RENDER_CONVERGED) != 0;
  json["preview"] = (status.frame.flags & CUMULET_RENDER_PREVIEW) != 0;
  json["progress"] = status.frame.progress;
  json["picture"] = {status.frame.width, status.frame.height};
  json["viewport"] = {viewport_.x, viewport_.y, viewport_.width, viewport_.height};
  json["busy"] = status.busy;
  json["has_volume"] = status.has_volume;
  json["has_content"] = status.has_content;
  json["title"] = title_;
  json["saving"] = status.saving;
  json["cells"] = status.stats.cells;
  json["cell_bytes"] = status.stats.cell_bytes;
  json["samples"] = status.stats.samples;
  json["noise"] = status.noise ? Json(*status.noise) : Json();
  json["undo_steps"] = history_->depth();
  json["frame_ms"] = model_.charts.frame_ms.values();
  json["picture_ms"] = model_.charts.picture_ms.values();
  json["compiled_percent"] = model_.charts.compiled_percent.values();
  json["device_ms"] = model_.charts.device_ms.values();
  json["pass_seconds"] = {
      {"upload", status.stats.pass_seconds_upload},     {"host_depth", status.stats.pass_seconds_host_depth},
      {"surfaces", status.stats.pass_seconds_surfaces}, {"trace", status.stats.pass_seconds_trace},
      {"inspect", status.stats.pass_seconds_inspect},   {"display", status.stats.pass_seconds_display}};
  json["pictures"] = pictures_;
  json["grid"] = status.grid;
  if (status.play) {
    const auto& [sequence, row, info, states, failure] = *status.play;
    json["sequence"] = {{"frame", row.number(info.requested_frame)},
                        {"drawn", info.is_displayed != 0 ? Json(row.number(info.displayed_frame)) : Json()},
                        {"first", row.number(0)},
                        {"count", row.count()},
                        {"ready", info.ready_frames},
                        {"failed", info.failed_frames},
                        {"failure", failure},
                        {"playing", model_.playing},
                        {"clock", model_.clock}};
    const SceneSequence& given = model_.scene.sequence;
    json["sequence"]["first_played"] = given.first ? Json(*given.first) : Json();
    json["sequence"]["last_played"] = given.last ? Json(*given.last) : Json();
    json["sequence"]["frames_per_second"] = given.playback.frames_per_second;
    json["sequence"]["repeat"] = static_cast<int>(given.playback.repeat);
  }
  json["neighbours"] = status.neighbours ? status.neighbours->count() : 0;
  json["state"] = last_state_;
  json["dialog"] = panel_.dialog_open();
  json["recent"] = model_.preferences.recent;
  json["messages"] = Json::array();
  for (const Message& message : model_.messages)
    json["messages"].push_back({{"error", message.error}, {"text", message.text}});
  json["tool"] = static_cast<int>(model_.tool);
  json["local_axes"] = model_.axes == Axes::local;
  json["chosen"] = model_.chosen ? Json(title_of(model_.scene, *model_.chosen)) : Json();
  json["turntable"] = model_.navigation.turntable_degrees_per_second;
  json["fly"] = model_.navigation.fly != 0;
  json["scene"] = Json::parse(scene_text(model_.scene, path, SceneFormat::first));
  const Json current = Json::parse(scene_text(model_.scene, path));
  // Version 1 has no such sections.
  for (const char* key : {"volumes", "models", "lights"}) json[key] = current.value(key, Json::array());
  image::replace_file(path, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

void App::remember() {
  const auto [width, height] = window_->size();
  if (!options_.sized && width > 0 && height > 0) {
    model_.preferences.width = width;
    model_.preferences.height = height;
  }
  save_preferences(model_.preferences, preferences_path_);
}

}  // namespace cumulet::demo
