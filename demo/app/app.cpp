#include "app.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <glad/gl.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <default_look.hpp>
#include <exception>
#include <file.hpp>
#include <filesystem>
#include <image.hpp>
#include <iostream>
#include <limits>
#include <program.hpp>
#include <settings.hpp>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "default_medium.hpp"
#include "renderer.hpp"
#include "thumbnail_texture.hpp"

namespace cumulet::demo {
namespace {

// Tracing budget per frame in milliseconds. During interaction the frame rate matters, and the library traces as few
// pixels as fit. At rest the sample rate matters.
constexpr double moving_budget = 16.0;
constexpr double resting_budget = 60.0;

constexpr double event_emissive = 0.7;  // seconds of frames after an event, because tooltips and highlights appear late
constexpr double motion_rest = 0.4;     // seconds without camera motion that end an undo step
constexpr double replay_frame = 1.0 / 60.0;
constexpr double min_frame = 1.0 / 60.0;  // minimum seconds between frames
constexpr double picture_frame = 0.15;    // maximum seconds that the window waits for an image being rendered

}  // namespace

App::App(DemoOptions options)
    : options_(std::move(options)), preferences_path_(preferences_path()), pictures_(options_.viewer) {
  model_.scene = options_.scene;
  model_.scene_path = options_.scene_file;
  model_.unchosen_ground = options_.unchosen_ground;
  loading_.suggest = model_.scene.auto_density_scale && model_.scene.medium.density_scale == 0.0;
  spell_out_defaults(model_.scene);
  if (options_.scene_file.empty()) model_.scene.sequence.playback.repeat = CUMULET_REPEAT_LOOP;
  model_.preferences = load_preferences(preferences_path_);
  model_.navigation.style = model_.preferences.style;
  derived_.exposure_given = options_.exposure_given;
  meter_when_loaded();
  if (!options_.replay.empty())
    replay_.player.emplace(parse_replay(image::read_file(options_.replay), options_.replay), options_.replay);
  if (!options_.trace.empty()) image::check_writable(options_.trace);
  if (!options_.record.empty()) replay_.recorder.emplace(options_.record);

  const int width = options_.sized ? static_cast<int>(options_.scene.width) : model_.preferences.width;
  const int height = options_.sized ? static_cast<int>(options_.scene.height) : model_.preferences.height;
  window_ = std::make_unique<Window>(width, height);
  gl_ = std::make_unique<GladGLContext>();
  if (gladLoadGLContextUserPtr(
          gl_.get(),
          [](void* user, const char* name) { return reinterpret_cast<GLADapiproc>(Window::get_proc(user, name)); },
          nullptr) == 0)
    throw std::runtime_error("the OpenGL functions cannot be loaded");
  make_sample_cards();
  image_.emplace(model_, exchange_, window_->input());
  context_ = window_->make_shared_context();
  renderer_ = std::make_unique<Renderer>(*gl_, context_.get(), Window::wake,
                                         options_.trace.empty() ? nullptr : &timeline_, options_.viewer);
  // The scene's size is that of a rendered image. The window has its own size.
  model_.scene.width = 1280;
  model_.scene.height = 720;
  if (options_.open.empty() && options_.scene_file.empty()) suggest_up_axis();
  changes_.emplace(recovery_folder(), model_.preferences.autosave_seconds, model_.scene);
  if (!options_.open.empty()) open(options_.open);
  loading_.fit_all = needs_fit(model_.scene.camera) && model_.scene.surface_camera < 0;
  loading_.surfaces = model_.scene_path.empty() && !model_.scene.surfaces.empty();
  loading_.remark |= !model_.scene_path.empty() && loading_.fit_all;
  history_.emplace(model_.scene);
  choose_dialogs();
  offer_recovery();
}

App::~App() = default;

void App::run() {
  while (!ending_.quit && !ending_.signals.received()) {
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
  keep_or_remove_recovery();
  if (!options_.trace.empty()) image::replace_file(options_.trace, timeline_.json());
}

double App::patience() const {
  if (stepped() || window_->input().pending()) return 0.0;
  double wait = replay_.player ? replay_.order.idle : std::numeric_limits<double>::infinity();
  if (changes_->due()) wait = std::min(wait, std::max(*changes_->due() - now_, min_frame));
  if (frames_.pending) wait = std::min(wait, std::max(frames_.drawn_at + picture_frame - now_, min_frame));
  constexpr double emissive_frame = 1.0 / 30.0;
  if (model_.playing) return std::min(wait, min_frame);
  if (now_ - last_event_ < event_emissive) return std::min(wait, emissive_frame);
  constexpr double blink = 0.4;
  constexpr double slow_frame = 0.1;
  if (samples_.files.writes() || panel_.dialog().waits() || recent_.thumbnails.works())
    wait = std::min(wait, slow_frame);
  if (ImGui::GetIO().WantTextInput) wait = std::min(wait, blink);
  for (const Message& message : model_.messages)
    if (!message.error) wait = std::min(wait, std::max(message.until - now_, slow_frame));
  return wait;
}

void App::frame() {
  const double before = std::exchange(now_, glfwGetTime());
  const int percent = model_.preferences.scale_percent;
  const double chosen = percent > 0 ? 0.01 * percent : window_->content_scale();
  const auto scale = static_cast<float>(options_.ui_scale > 0.0 ? options_.ui_scale : chosen);
  if (scale != ui_scale_) Window::set_ui_scale(scale);
  ui_scale_ = scale;
  take();
  // The clock stops while an image is being saved, so that it shows one point in time.
  if (model_.playing && model_.status.saving.empty()) clock_.advance(stepped() ? replay_frame : now_ - before);

  replay_.order = {};
  if (replay_.player) {
    ReplayHost host;
    host.loading = loads();
    host.rendering = pictures_.queue().unfinished() > 0;
    host.converged = exchange_.settled() && (model_.status.frame.flags & CUMULET_RENDER_CONVERGED) != 0;
    host.viewport = image_->viewport();
    host.find = [this](const std::string& label) {
      auto control = panel_.ui().find(label);
      const auto seen = image_->sight();
      if (!control && seen) control = Handles::find(label, model_, *seen, ui_scale_);
      if (!control) panel_.ui().bring_into_view(label);
      return control;
    };
    replay_.order = replay_.player->next(host, window_->input());
  }
  const std::vector<Event> events = window_->input().take();
  if (!events.empty()) last_event_ = now_;
  frames_.in_popup = ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopupId | ImGuiPopupFlags_AnyPopupLevel);
  window_->begin_frame(events, stepped() ? replay_frame : 0.0);
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  image_->set_viewport(Panel::viewport(model_, static_cast<double>(screen.x), static_cast<double>(screen.y), ui_scale_),
                       ui_scale_);
  handle(events);
  image_->follow_pointer();
  if (model_.chosen && !transform_of(model_.scene, *model_.chosen)) model_.chosen.reset();

  model_.undo = history_->undo_name(model_.scene);
  model_.redo = history_->redo_name();
  frames_.state = panel_.state();
  take_thumbnail();
  follow_renders();
  follow_samples();
  follow_recent();
  model_.seconds_left = measurements_.seconds_left(model_.scene.sampling);
  std::vector<Command> commands;
  panel_.draw(model_, ui_scale_, now_, commands);
  execute(commands);

  if (std::exchange(camera_moved_, false) && model_.navigation.turntable_degrees_per_second == 0.0) last_motion_ = now_;
  clock_.follow(exchange_.desired.scene.sequence, loading_.reload || exchange_.waiting());
  held_ = ImGui::IsAnyItemActive() || image_->has_buttons() || now_ - last_motion_ < motion_rest ||
          panel_.ui().may_become_double_click();
  ask();
  if (stepped()) {
    renderer_->wait_for(exchange_.desired.number);
    take();
  }
  follow_history();
  autosave();
  const bool picture = frames_.drawn_pictures != frames_.pictures;
  const bool drawn = draw();
  obey(replay_.order);
  if (replay_.recorder) replay_.recorder->frame(events, loads());
  if (drawn) {
    window_->swap();
    ++frames_.drawn;
  }
  const bool refines = (model_.status.frame.flags & CUMULET_RENDER_INCOMPLETE) != 0;
  const bool due = !exchange_.desired.paused && (refines || !exchange_.settled());
  measurements_.take_frame(events, drawn, picture, due, frames_.pending);
  measurements_.take_status(model_.status, exchange_.drawn, now_);
  ++frames_.count;

  const std::string name = scene_name(model_);
  frames_.title = name.empty() ? "Cumulet" : name + " - Cumulet";
  window_->set_title(frames_.title);
}

void App::handle(const std::vector<Event>& events) {
  for (const Event& event : events) {
    if (image_->take_for_region(event)) continue;
    switch (event.type) {
      case Event::Type::key:
        handle_key(event);
        break;
      case Event::Type::drop:
        open_dropped(event.files);
        break;
      case Event::Type::close:
        execute({Action::quit});
        break;
      case Event::Type::resize:
        window_->resize(static_cast<int>(event.x), static_cast<int>(event.y));
        break;
      case Event::Type::focus_lost:
      case Event::Type::button:
      case Event::Type::move:
      case Event::Type::wheel:
        image_->take(event);
        break;
      case Event::Type::character:
        break;
    }
  }
}

void App::handle_key(const Event& event) {
  const ImGuiIO& io = ImGui::GetIO();
  if (event.down && !frames_.in_popup) {
    const bool escape = event.code == GLFW_KEY_ESCAPE;
    const auto command = command_of(event.code, event.modifiers, io.WantTextInput);
    // Space activates the focused control during keyboard navigation.
    const bool presses = event.code == GLFW_KEY_SPACE && io.NavVisible;
    // Fly mode uses the tool keys itself.
    const bool flies = command && command->action == Action::tool && model_.navigation.fly != 0;
    const bool removes_stop = event.code == GLFW_KEY_DELETE && panel_.ui().takes_delete();
    if (removes_stop) return;
    if (command && !presses && !flies && !(escape && ImGui::IsAnyItemActive())) {
      execute(*command);
      return;
    }
  }
  if (event.down && (io.WantCaptureKeyboard || io.WantTextInput)) return;
  image_->to_viewer(event);
}

// While a sequence plays, its next frames are read and built, which does not end in a loop.
bool App::loads() const { return (model_.status.busy && !model_.playing) || exchange_.waiting(); }

bool App::is_unsaid() const {
  cumulet_medium_desc medium = model_.scene.medium;
  if (demo::is_unsaid(medium)) return true;
  if (!derived_.look) return false;
  medium.density_scale = derived_.look->medium.density_scale;
  return settings::same(medium, derived_.look->medium);
}

void App::complain(const std::string& cause) {
  if (loading_.starting) std::cerr << "cumulet-demo: " << one_line(cause) << std::endl;
  show_message(model_, true, cause, now_);
}

void App::follow_history() {
  SceneOptions scene = model_.scene;
  // Turntable motion is not an undo step.
  if (model_.navigation.turntable_degrees_per_second != 0.0) scene.camera = history_->current().camera;
  history_->offer(scene, held_ || exchange_.waiting() || !exchange_.settled());
}

void App::ask() {
  const DesiredState& sent = exchange_.desired;
  DesiredState desired;
  desired.number = sent.number;
  desired.scene = model_.scene;
  if (model_.status.play) set_animation_time(desired.scene, model_.clock);
  desired.edits.camera = sent.edits.camera + (same_camera(desired.scene.camera, sent.scene.camera) ? 0 : 1);
  const bool load = std::exchange(loading_.reload, false) || volume_of(desired.scene) != volume_of(sent.scene);
  desired.edits.volume = sent.edits.volume + (load ? 1 : 0);
  desired.fit = load ? std::exchange(loading_.fit, false) : sent.fit;
  // A volume that has become the first one may have no scale yet.
  const bool no_scale = desired.scene.auto_density_scale && desired.scene.medium.density_scale == 0.0;
  desired.suggest = load ? std::exchange(loading_.suggest, false) || no_scale : sent.suggest;
  desired.unsaid = load ? is_unsaid() : sent.unsaid;
  desired.edits.surfaces = sent.edits.surfaces + (desired.scene.surfaces == sent.scene.surfaces ? 0 : 1);
  desired.edits.environment = sent.edits.environment + (desired.scene.environment == sent.scene.environment ? 0 : 1);
  desired.navigation = model_.navigation;
  desired.adaptive_resolution = model_.adaptive_resolution;
  desired.held = held_;
  desired.paused = panel_.dialog_open();
  desired.budget_ms = held_ || now_ - last_event_ < motion_rest ? moving_budget : resting_budget;
  desired.width = static_cast<std::uint32_t>(image_->viewport().width);
  desired.height = static_cast<std::uint32_t>(image_->viewport().height);
  desired.scale = static_cast<double>(ui_scale_);
  if (!stepped() && same_request(desired, sent) && exchange_.inputs.empty() && exchange_.requests.empty()) return;
  ++desired.number;
  const bool changed = !exchange_.inputs.empty() || !same_scene(desired.scene, sent.scene);
  if (changed) measurements_.change(now_, desired.number);
  exchange_.desired = desired;
  renderer_->ask(std::move(desired), std::exchange(exchange_.inputs, {}), std::exchange(exchange_.requests, {}));
}

void App::take() {
  const auto answer = renderer_->take();
  if (!answer) return;
  const SceneOptions before = model_.scene;
  accept(*answer);
  changes_->take_program_change(before, model_.scene);
  if (answer->metered) take_exposure(*answer->metered);
}

void App::accept(const Answer& answer) {
  DesiredState& sent = exchange_.desired;
  if (answer.drawn) {
    ++frames_.pictures;
    exchange_.drawn = answer.desired;
  }
  exchange_.answered = answer.desired;
  camera_moved_ |= answer.camera_moved && !exchange_.waiting();  // a fit after a load is not a motion
  exchange_.loads = answer.waiting;
  exchange_.answered_edits = answer.edits;
  if (answer.camera_moved) {
    end_shutter(model_.scene);
    end_shutter(sent.scene);
  }
  // Ignores values of the viewer that the user has changed since.
  if (answer.edits.camera == sent.edits.camera) model_.scene.camera = sent.scene.camera = answer.camera;
  if (answer.edits.volume == sent.edits.volume) {
    set_volume(model_.scene, answer.volume);
    set_volume(sent.scene, answer.volume);
  }
  if (answer.edits.surfaces == sent.edits.surfaces && model_.scene.surfaces == sent.scene.surfaces)
    model_.scene.surfaces = sent.scene.surfaces = answer.surfaces;
  if (answer.edits.environment == sent.edits.environment)
    model_.scene.environment = sent.scene.environment = answer.environment;
  if (!exchange_.waiting() && !loading_.environment.empty()) {
    if (model_.scene.environment == loading_.environment) {
      take_daylight(model_.scene);
      set_default_ground(model_, CUMULET_GROUND_SHADOW_CATCHER_BELOW);  // the map shows its own ground
    }
    loading_.environment.clear();
  }
  if (model_.status.compiled && !answer.status.compiled) model_.charts.compiled_percent.add(100.0f);
  if (answer.status.compiled) model_.charts.compiled_percent.add(static_cast<float>(100.0 * *answer.status.compiled));
  if (answer.status.noise && answer.status.noise != model_.status.noise)
    model_.charts.noise_percent.add(static_cast<float>(100.0 * *answer.status.noise));
  if (answer.density_scale) model_.scene.medium.density_scale = *answer.density_scale;
  if (answer.look && is_unsaid()) take_look(*answer.look);
  if (answer.picked) model_.chosen = answer.picked->item;
  // Changes during startup are not undo steps.
  if (loading_.starting && (answer.density_scale || answer.look)) history_.emplace(model_.scene);
  model_.status = answer.status;
  model_.grids = answer.grids;
  for (const Answer::Notice& notice : answer.notices) {
    if (notice.error)
      complain(notice.text);
    else
      show_message(model_, false, notice.text, now_);
  }
  remember_files(answer);
  if (!exchange_.waiting() && std::exchange(loading_.pick, false)) {
    const auto& grids = model_.grids;
    const auto shown = std::ranges::count_if(grids, [](const GridInfo& grid) { return grid.refusal.empty(); });
    const bool clear = std::ranges::any_of(grids, [](const GridInfo& grid) { return grid.name == "density"; });
    if (shown > 1 && !clear && !burns()) panel_.picker().open(model_.scene.volume, Window::wake);
  }
  if (!exchange_.waiting()) place_added();
  if (!exchange_.waiting()) loading_.starting = false;
  if (!exchange_.waiting() && std::exchange(loading_.meter, false)) request({Request::Type::meter_exposure});
}

bool App::burns() const { return derived_.look && derived_.look->content == Content::fire; }

void App::take_look(const DefaultMedium& look) {
  // Another grid of a fire keeps the light that the user chose for the first one.
  const bool burned = burns();
  const bool smoked = derived_.look && derived_.look->content == Content::smoke;
  derived_.look = look;
  model_.scene.medium = look.medium;
  if (look.content == Content::smoke && !smoked)
    show_message(model_, false, "The volume is smoke: gray, as in Blender", now_,
                 MessageButton{"White", "Makes it white, as a cloud. Ctrl+Z undoes that.", {Action::white}});
  if (!burns()) give_day(model_.scene, derived_.exposure);
  if (burns() && !burned && take_dusk(model_.scene, derived_.exposure))
    show_message(
        model_, false, "The volume burns: dusk light and the filmic tone map", now_,
        MessageButton{"Daylight", "Sets the default daylight and tone map. Ctrl+Z undoes that.", {Action::daylight}});
}

void App::take_exposure(const Metered& metered) {
  const bool asked = std::exchange(derived_.exposure_asked, false);
  float& stops = model_.scene.display.exposure_stops;
  if (!metered.stops) {
    if (asked) show_message(model_, false, "The image is black: no exposure suits it", now_);
    return;
  }
  if (!asked) {
    const bool chosen = derived_.exposure_given || !is_default_exposure(model_.scene, derived_.exposure);
    if (chosen || std::abs(*metered.stops - stops) < exposure_tolerance) return;
  }
  const SceneOptions before = model_.scene;
  stops = *metered.stops;
  derived_.exposure = stops;
  // The user's request is a change, the measurement after a load is none.
  if (!asked) changes_->take_program_change(before, model_.scene);
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "Auto exposure: %+.1f stops", static_cast<double>(stops));
  show_message(model_, false, text.data(), now_);
}

void App::remember_files(const Answer& answer) {
  Preferences& preferences = model_.preferences;
  for (const Answer::File& file : answer.files) {
    switch (file.fate) {
      case Answer::File::Fate::opened:
        preferences.remember(file.path);
        remember();  // a program that is killed keeps its recent files
        break;
      case Answer::File::Fate::failed:
        drop_failed(file.path);
        preferences.forget(file.path);
        preferences.forget(loading_.scene);
        loading_.scene.clear();
        break;
      case Answer::File::Fate::saved:
        preferences.folder = std::filesystem::path(file.path).parent_path().string();
        break;
    }
  }
  if (!exchange_.waiting() && !loading_.scene.empty()) preferences.remember(std::exchange(loading_.scene, {}));
}

bool App::draw() {
  const Renderer::Picture picture = renderer_->picture();
  if (picture.texture != 0 && model_.status.has_content) {
    // NOLINTNEXTLINE(performance-no-int-to-ptr): so ImGui has textures
    auto* texture = reinterpret_cast<ImTextureID>(std::uintptr_t{picture.texture});
    const Rectangle& viewport = image_->viewport();
    const ImVec2 low(static_cast<float>(viewport.x), static_cast<float>(viewport.y));
    const ImVec2 high(low.x + static_cast<float>(viewport.width), low.y + static_cast<float>(viewport.height));
    ImDrawList& behind = *ImGui::GetBackgroundDrawList();
    // The image is opaque. Blending would cost as much as everything else on software drivers.
    const auto cover = [](const ImDrawList*, const ImDrawCmd* command) {
      static_cast<const GladGLContext*>(command->UserCallbackData)->Disable(GL_BLEND);
    };
    behind.AddCallback(cover, gl_.get());
    behind.AddImage(texture, low, high, {0.0f, 1.0f}, {1.0f, 0.0f});
    behind.AddCallback(ImDrawCallback_ResetRenderState, nullptr);
    // The image still shows the previous objects while a file is loading.
    if (!exchange_.waiting()) image_->draw_handles();
  }
  image_->draw_region();
  // During a drag there may be 60 changes per second, and with software drivers drawing the window costs as much as an
  // image. So an unchanged window is not drawn, and changes outside the image wait for the next image.
  const bool changed = window_->ui_changed();
  const bool waits = image_->has_buttons() && now_ - frames_.drawn_at < picture_frame;
  const bool draws =
      frames_.drawn_pictures != frames_.pictures || !replay_.order.screenshot.empty() || (changed && !waits);
  frames_.pending = changed && !draws;
  if (!draws) return false;
  gl_->BindFramebuffer(GL_FRAMEBUFFER, 0);
  gl_->Disable(GL_SCISSOR_TEST);
  constexpr float dark = 0.075f;
  gl_->ClearColor(dark, dark * 1.08f, dark * 1.2f, 1.0f);
  gl_->Clear(GL_COLOR_BUFFER_BIT);
  window_->draw_ui();
  frames_.drawn_pictures = frames_.pictures;
  frames_.drawn_at = now_;
  return true;
}

void App::take_thumbnail() {
  if (model_.status.thumbnail == thumbnail_.thumbnail) return;
  thumbnail_.thumbnail = model_.status.thumbnail;
  // The new texture is created before the old one is deleted: its name then differs, by which the window detects the
  // change.
  const ThumbnailPtr& shown = thumbnail_.thumbnail;
  thumbnail_.texture = shown ? std::make_unique<ThumbnailTexture>(*gl_, *shown) : nullptr;
  model_.thumbnail_texture = shown ? thumbnail_.texture->name() : 0;
}

void App::make_sample_cards() {
  if (!samples_.files.exist()) return;
  for (const Sample& sample : samples()) {
    const Thumbnail picture{image::decode_png(sample.picture, sample.scene).rgba};
    samples_.textures.push_back(std::make_unique<ThumbnailTexture>(*gl_, picture));
    model_.samples.push_back({sample.label, sample.tip, sample.scene, samples_.textures.back()->name()});
  }
}

void App::follow_recent() {
  if (replay_.player) return;  // whose pictures do not depend on a cache
  if (model_.status.has_content || exchange_.waiting()) {
    recent_.thumbnails.stop();
    return;
  }
  if (!recent_.thumbnails.follow(listed_files(model_.preferences), now_)) return;
  model_.recent_textures.clear();
  for (const std::string& file : listed_files(model_.preferences)) {
    const std::string picture = recent_.thumbnails.find(file);
    if (picture.empty()) continue;
    auto& texture = recent_.textures[picture];
    try {
      if (!texture) {
        const image::PngPixels pixels = image::decode_png(image::read_file(picture), picture);
        texture = std::make_unique<ThumbnailTexture>(*gl_, pixels.rgba, pixels.width, pixels.height);
      }
      model_.recent_textures[file] = texture->name();
    } catch (const std::exception&) {
      // A damaged thumbnail is made again at the next start.
      std::error_code error;
      std::filesystem::remove(picture, error);
    }
  }
}

void App::obey(const Player::Order& order) {
  if (!order.screenshot.empty()) save_window(order.screenshot);
  if (!order.report.empty()) write_report(order.report);
  if (order.quit) ending_.quit = true;
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
