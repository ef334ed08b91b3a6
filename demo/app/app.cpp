#include "app.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <glad/gl.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <file.hpp>
#include <filesystem>
#include <image.hpp>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

namespace cumulet::demo {
namespace {

using Json = nlohmann::ordered_json;

// Milliseconds of tracing a frame. While things move, frames are what counts: the library takes as few pixels as fit.
// At rest, samples are: the window answers ten times a second all the same.
constexpr double moving_budget = 16.0;
constexpr double resting_budget = 60.0;

constexpr double event_glow = 0.7;   // seconds of frames after an event: tooltips and highlights come late
constexpr double motion_rest = 0.4;  // seconds without motion that end a step of undo
constexpr double replay_frame = 1.0 / 60.0;

}  // namespace

App::App(DemoOptions options) : options_(std::move(options)), preferences_path_(preferences_path()) {
  model_.scene = options_.scene;
  spell_out_defaults(model_.scene);
  model_.preferences = load_preferences(preferences_path_);
  model_.navigation.style = model_.preferences.style;
  if (!options_.replay.empty())
    player_.emplace(parse_replay(image::read_file(options_.replay), options_.replay), options_.replay);
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
  session_ = std::make_unique<Session>(Window::get_proc, nullptr, Window::wake);
  // Sizes in the scene are for pictures: here the window has its own.
  model_.scene.width = 1280;
  model_.scene.height = 720;
  if (!options_.open.empty()) open(options_.open);
  history_.emplace(model_.scene);
}

App::~App() = default;

void App::run() {
  while (!quit_ && !window_->should_close()) {
    Window::wait(patience());
    frame();
  }
  remember();
}

double App::patience() const {
  if (player_ && order_.idle <= 0.0) return 0.0;
  const double most = player_ ? order_.idle : std::numeric_limits<double>::infinity();
  const Status& status = model_.status;
  const bool flying = model_.navigation.fly != 0 && window_->input().any_key();
  const bool turning = model_.navigation.turntable_degrees_per_second != 0.0 && status.has_volume;
  if (window_->input().pending() || flying || turning || (status.frame.flags & CUMULET_RENDER_MORE) != 0) return 0.0;
  constexpr double glow_frame = 1.0 / 30.0;
  if (now_ - last_event_ < event_glow) return std::min(most, glow_frame);
  constexpr double slow_frame = 0.1;
  if (status.busy || session_->waiting()) return std::min(most, slow_frame);
  constexpr double blink = 0.4;
  double wait = ImGui::GetIO().WantTextInput ? blink : most;
  for (const Message& message : model_.messages)
    if (!message.error) wait = std::min(wait, std::max(message.until - now_, slow_frame));
  return std::min(wait, most);
}

void App::frame() {
  now_ = glfwGetTime();
  const double begun = now_;
  const auto scale = static_cast<float>(options_.ui_scale > 0.0 ? options_.ui_scale : window_->content_scale());
  if (scale != ui_scale_) Window::set_ui_scale(scale);
  ui_scale_ = scale;

  order_ = {};
  if (player_) {
    ReplayHost host;
    host.loading = model_.status.busy || session_->waiting();
    host.converged = (model_.status.frame.flags & CUMULET_RENDER_CONVERGED) != 0;
    host.viewport = viewport_;
    host.find = [this](const std::string& label) {
      auto place = panel_.ui().find(label);
      if (!place) panel_.ui().bring_into_view(label);
      return place;
    };
    order_ = player_->next(host, window_->input());
  }
  const std::vector<Event> events = window_->input().take();
  if (!events.empty()) last_event_ = now_;
  window_->begin_frame(events, player_ && order_.idle <= 0.0 ? replay_frame : 0.0);
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  viewport_ = Panel::viewport(model_, static_cast<double>(screen.x), static_cast<double>(screen.y), ui_scale_);
  handle(events);

  model_.can_undo = history_->can_undo(model_.scene);
  model_.can_redo = history_->can_redo();
  std::vector<Command> commands;
  panel_.draw(model_, ui_scale_, now_, commands);
  execute(commands);

  const bool motion = session_->camera_moved() && model_.navigation.turntable_degrees_per_second == 0.0;
  if (motion) last_motion_ = now_;
  held_ = ImGui::IsAnyItemActive() || viewport_buttons_ != 0 || now_ - last_motion_ < motion_rest;
  session_->follow(model_, held_);
  follow_history();
  draw(held_ || now_ - last_event_ < motion_rest ? moving_budget : resting_budget);
  Window::draw_ui();
  obey(order_);
  if (recorder_) recorder_->frame(events, model_.status.busy || session_->waiting());
  const double seconds = glfwGetTime() - begun;
  window_->swap();
  take_statistics(seconds);
  ++frames_;

  const std::string name = std::filesystem::path(model_.scene.volume).filename().string();
  window_->set_title(name.empty() ? "Cumulet" : name + " - Cumulet");
}

void App::handle(const std::vector<Event>& events) {
  for (const Event& event : events) {
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
        to_viewer(event);
        break;
      case Event::Type::button: {
        const unsigned bit = 1U << static_cast<unsigned>(event.code);
        const bool ours = event.down ? !ImGui::GetIO().WantCaptureMouse : (viewport_buttons_ & bit) != 0;
        if (!ours) break;
        viewport_buttons_ = event.down ? viewport_buttons_ | bit : viewport_buttons_ & ~bit;
        to_viewer(event);
        break;
      }
      case Event::Type::move:
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
    const auto command = command_of(event.code, window_->input().modifiers(), io.WantTextInput);
    if (command && !(escape && ImGui::IsAnyItemActive())) {
      execute(*command);
      return;
    }
  }
  if (event.down && (io.WantCaptureKeyboard || io.WantTextInput)) return;
  to_viewer(event);
}

void App::to_viewer(const Event& event) {
  cumulet_event out{};
  out.struct_size = sizeof out;
  out.x = window_->input().x() - viewport_.x;
  out.y = window_->input().y() - viewport_.y;
  out.modifiers = window_->input().modifiers();
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
  if (!session_->input(out) && event.type == Event::Type::key && event.down) move_by_keys(event.code);
}

void App::move_by_keys(int key) {
  constexpr double step = 0.1;
  constexpr double closer = 0.9;
  switch (key) {
    case GLFW_KEY_LEFT:
      session_->orbit(-step, 0.0);
      break;
    case GLFW_KEY_RIGHT:
      session_->orbit(step, 0.0);
      break;
    case GLFW_KEY_UP:
      session_->orbit(0.0, step);
      break;
    case GLFW_KEY_DOWN:
      session_->orbit(0.0, -step);
      break;
    case GLFW_KEY_EQUAL:
    case GLFW_KEY_KP_ADD:
      session_->dolly(closer);
      break;
    case GLFW_KEY_MINUS:
    case GLFW_KEY_KP_SUBTRACT:
      session_->dolly(1.0 / closer);
      break;
    default:
      break;
  }
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
      panel_.dialog().open("Open", Action::open, {".vdb", ".nvdb", ".gltf", ".glb", ".json"},
                           model_.preferences.folder);
      break;
    case Action::open:
      open(command.text);
      break;
    case Action::save_scene:
      if (!model_.scene_path.empty()) {
        save_scene(model_.scene_path);
        break;
      }
      [[fallthrough]];
    case Action::save_scene_dialog:
      panel_.dialog().open("Save the scene", Action::save_scene_as, {".json"}, suggest_path(model_, ".json"));
      break;
    case Action::save_scene_as:
      save_scene(command.text);
      break;
    case Action::png_dialog:
      if (model_.status.has_volume)
        panel_.dialog().open("Save the picture", Action::save_png, {".png"}, suggest_path(model_, ".png"));
      break;
    case Action::exr_dialog:
      if (model_.status.has_volume)
        panel_.dialog().open("Save linear radiance", Action::save_exr, {".exr"}, suggest_path(model_, ".exr"));
      break;
    case Action::save_png:
    case Action::save_exr:
      save_picture(command);
      break;
    case Action::undo:
    case Action::redo:
      step_history(command.action == Action::undo);
      break;
    case Action::frame_all:
      session_->frame_all(model_);
      break;
    case Action::cancel:
      cancel();
      break;
    case Action::cancel_load:
      session_->cancel();
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
      // Its keys are the picture's.
      ImGui::SetWindowFocus(nullptr);
      break;
    case Action::toggle_turntable:
      navigation.turntable_degrees_per_second = navigation.turntable_degrees_per_second != 0.0 ? 0.0 : turn_speed;
      break;
    case Action::brighter:
      display.exposure_stops = std::min(display.exposure_stops + third, 10.0f);
      break;
    case Action::darker:
      display.exposure_stops = std::max(display.exposure_stops - third, -10.0f);
      break;
    case Action::next_march:
      model_.scene.grid.march = static_cast<cumulet_march>((static_cast<int>(model_.scene.grid.march) + 1) % 3);
      break;
    case Action::view:
      model_.scene.sampling.view = static_cast<cumulet_view>(command.value);
      break;
    case Action::quit:
      quit_ = true;
      break;
  }
}

void App::cancel() {
  if (model_.help)
    model_.help = false;
  else if (!model_.messages.empty())
    model_.messages.pop_back();
  else if (model_.status.busy)
    session_->cancel();
  else
    ImGui::SetWindowFocus(nullptr);
}

void App::open(const std::string& path) {
  if (path.empty()) return;
  if (has_ending(path, ".gltf") || has_ending(path, ".glb")) {
    model_.scene.surfaces = path;
    model_.scene.surface = {};
    model_.scene.surface.struct_size = sizeof model_.scene.surface;
    model_.scene.surface_camera = -1;
    return;
  }
  if (!has_ending(path, ".json")) {
    model_.scene.volume = path;
    model_.scene.grid_name.clear();
    session_->fit_next();
    session_->reload();
    return;
  }
  try {
    SceneOptions scene = load_scene(path);
    spell_out_defaults(scene);
    scene.width = model_.scene.width;
    scene.height = model_.scene.height;
    model_.scene = std::move(scene);
    model_.scene_path = path;
    model_.preferences.remember(path);
    if (is_unplaced(model_.scene.camera)) session_->fit_next();
  } catch (const std::exception& error) {
    tell(model_, true, error.what(), now_);
  }
}

void App::save_scene(const std::string& path) {
  SceneOptions scene = model_.scene;
  // The same framing in cumulet-render.
  scene.width = static_cast<std::uint32_t>(std::clamp(viewport_.width, 1.0, 16384.0));
  scene.height = static_cast<std::uint32_t>(std::clamp(viewport_.height, 1.0, 16384.0));
  try {
    demo::save_scene(scene, path);
    model_.scene_path = path;
    model_.preferences.remember(path);
    tell(model_, false, "Saved " + path, now_);
  } catch (const std::exception& error) {
    tell(model_, true, error.what(), now_);
  }
}

void App::save_picture(const Command& command) {
  try {
    if (command.action == Action::save_exr) {
      session_->write_exr(model_, command.text);
    } else {
      image::PngOptions png;
      png.tone_mapping = image::ToneMapping::none;
      png.keep_alpha = model_.scene.display.background == CUMULET_BACKGROUND_TRANSPARENT;
      image::write_png(command.text, session_->read_display(model_), png);
    }
    model_.preferences.folder = std::filesystem::path(command.text).parent_path().string();
    tell(model_, false, "Saved " + command.text, now_);
  } catch (const std::exception& error) {
    tell(model_, true, error.what(), now_);
  }
}

void App::follow_history() {
  SceneOptions scene = model_.scene;
  // A turntable's motion is no change of the user's.
  if (model_.navigation.turntable_degrees_per_second != 0.0) scene.camera = history_->current().camera;
  history_->offer(scene, held_ || session_->waiting());
}

void App::step_history(bool back) {
  const auto scene = back ? history_->undo(model_.scene) : history_->redo(model_.scene);
  if (!scene) return;
  const cumulet_camera_desc camera = model_.scene.camera;
  model_.scene = *scene;
  if (model_.navigation.turntable_degrees_per_second != 0.0) model_.scene.camera = camera;
}

void App::draw(double budget_ms) {
  const auto [width, height] = window_->size();
  gl_->BindFramebuffer(GL_FRAMEBUFFER, 0);
  gl_->Disable(GL_SCISSOR_TEST);
  constexpr float dark = 0.075f;
  gl_->ClearColor(dark, dark * 1.08f, dark * 1.2f, 1.0f);
  gl_->Clear(GL_COLOR_BUFFER_BIT);
  cumulet_frame_desc frame{};
  frame.struct_size = sizeof frame;
  frame.budget_ms = budget_ms;
  frame.width = static_cast<std::uint32_t>(width);
  frame.height = static_cast<std::uint32_t>(height);
  frame.viewport[0] = static_cast<std::int32_t>(viewport_.x);
  frame.viewport[1] = 0;
  frame.viewport[2] = static_cast<std::int32_t>(viewport_.width);
  frame.viewport[3] = static_cast<std::int32_t>(viewport_.height);
  frame.scale = static_cast<double>(ui_scale_);
  session_->render(model_, frame);
}

void App::take_statistics(double frame_seconds) {
  Status& status = model_.status;
  const bool more = (status.frame.flags & CUMULET_RENDER_MORE) != 0;
  if (more) status.frame_ms.add(static_cast<float>(1000.0 * frame_seconds));

  constexpr double rate_period = 0.5;
  const double elapsed = now_ - rate_since_;
  // Fewer than before: the picture began anew.
  if (status.stats.samples < rate_samples_ || !more) {
    rate_samples_ = status.stats.samples;
    rate_since_ = now_;
  } else if (elapsed > rate_period && status.stats.samples > rate_samples_) {
    status.samples_per_second.add(
        static_cast<float>(static_cast<double>(status.stats.samples - rate_samples_) / elapsed));
    rate_samples_ = status.stats.samples;
    rate_since_ = now_;
  }

  constexpr double noise_period = 1.0;
  const bool refining = (more || (status.frame.flags & CUMULET_RENDER_CONVERGED) != 0) && !held_ &&
                        status.frame.progress > 0.0 && (status.frame.flags & CUMULET_RENDER_PREVIEW) == 0 &&
                        model_.scene.sampling.view == CUMULET_VIEW_SHADED;
  // Fewer samples than when it was measured: another picture.
  if (status.stats.samples < noise_samples_) status.noise = 0.0;
  if (!refining || now_ - last_noise_ < noise_period) return;
  if (status.noise > 0.0 && status.stats.samples == noise_samples_) return;
  last_noise_ = now_;
  noise_samples_ = status.stats.samples;
  session_->measure_noise(model_);
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
  json["idle_frames"] = player_ ? player_->idle_frames() : 0;
  json["converged"] = (status.frame.flags & CUMULET_RENDER_CONVERGED) != 0;
  json["preview"] = (status.frame.flags & CUMULET_RENDER_PREVIEW) != 0;
  json["progress"] = status.frame.progress;
  json["picture"] = {status.frame.width, status.frame.height};
  json["viewport"] = {viewport_.x, viewport_.y, viewport_.width, viewport_.height};
  json["busy"] = status.busy;
  json["has_volume"] = status.has_volume;
  json["cells"] = status.stats.cells;
  json["cell_bytes"] = status.stats.cell_bytes;
  json["samples"] = status.stats.samples;
  json["noise"] = status.noise;
  json["undo_steps"] = history_->depth();
  json["frame_ms"] = status.frame_ms.values();
  json["messages"] = Json::array();
  for (const Message& message : model_.messages)
    json["messages"].push_back({{"error", message.error}, {"text", message.text}});
  json["turntable"] = model_.navigation.turntable_degrees_per_second;
  json["fly"] = model_.navigation.fly != 0;
  json["scene"] = Json::parse(scene_text(model_.scene, path));
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
