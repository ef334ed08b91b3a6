// Calls from inside callbacks.

#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <functional>
#include <future>
#include <regex>
#include <set>
#include <sstream>
#include <thread>
#include <vector>

#include "support/c_host.hpp"
#include "support/egl_context.hpp"
#include "support/slow_builds.hpp"

namespace {

using namespace std::chrono_literals;
using cumulet::test::CameraRef;
using cumulet::test::EglContext;
using cumulet::test::make_ball;
using cumulet::test::make_cloth;
using cumulet::test::make_desc;
using cumulet::test::make_viewer;
using cumulet::test::patience;
using cumulet::test::slow_grid;
using cumulet::test::SurfacesRef;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;
using Clock = std::chrono::steady_clock;

/// Calls every function of the API from inside a callback and keeps the results.
struct Caller {
  cumulet_viewer* viewer = nullptr;
  cumulet_viewer* other = nullptr;
  cumulet_camera* camera = nullptr;
  cumulet_volume* volume = nullptr;
  cumulet_surfaces* surfaces = nullptr;
  std::atomic<int> rounds = 0;
  std::atomic<bool> armed = false;
  std::set<std::string> names;
  std::vector<std::string> wrong;

  void answer(const std::string& name, cumulet_status status,
              cumulet_status expected = CUMULET_ERROR_INVALID_ARGUMENT) {
    names.insert(name);
    if (status != expected) wrong.push_back(name + ": " + std::to_string(status));
  }
  void call_all();
  void call_others();
  static void on_update(void* user) { static_cast<Caller*>(user)->once(); }
  static void on_log(void* user, cumulet_log_level, const char*) { static_cast<Caller*>(user)->once(); }

 private:
  void once() {
    if (!armed.exchange(false)) return;
    call_all();
    ++rounds;
  }
};

#define CALL(function, ...) answer(#function, function(__VA_ARGS__))

void Caller::call_others() {
  const std::array<std::uint8_t, 4> bytes{};
  const auto stream = make_desc<cumulet_stream_desc>();
  const auto file = make_desc<cumulet_volume_file_desc>();
  cumulet_volume* new_volume = nullptr;
  cumulet_environment* new_environment = nullptr;
  CALL(cumulet_instance_set_clip, nullptr, nullptr);
  CALL(cumulet_instance_set_color_ramp, nullptr, CUMULET_RAMP_DENSITY, nullptr, 0);
  CALL(cumulet_volume_open, "none.vdb", nullptr, &new_volume, nullptr, 0);
  CALL(cumulet_volume_open_file, &file, &new_volume, nullptr, 0);
  CALL(cumulet_volume_from_memory, bytes.data(), bytes.size(), &file, &new_volume, nullptr, 0);
  CALL(cumulet_volume_from_stream, &stream, &file, &new_volume, nullptr, 0);
  CALL(cumulet_environment_open, "none.hdr", &new_environment, nullptr, 0);
  CALL(cumulet_environment_from_memory, bytes.data(), bytes.size(), nullptr, &new_environment, nullptr, 0);
  CALL(cumulet_environment_from_stream, &stream, nullptr, &new_environment, nullptr, 0);
  const auto read = make_desc<cumulet_read_desc>();
  auto read_info = make_desc<cumulet_read_info>();
  std::uint64_t number = 0;
  cumulet_interpolation interpolation{};
  for (cumulet_viewer* v : {viewer, other}) {
    CALL(cumulet_get_interpolation, v, &interpolation);
    CALL(cumulet_set_clip, v, nullptr);
    CALL(cumulet_set_color_ramp, v, CUMULET_RAMP_DENSITY, nullptr, 0);
    CALL(cumulet_set_display_lut, v, nullptr);
    CALL(cumulet_begin_read, v, &read, &number);
    CALL(cumulet_finish_read, v, 1, nullptr, 0, &read_info);
    CALL(cumulet_cancel_read, v, 1);
  }
  if (new_volume != nullptr || new_environment != nullptr) wrong.push_back("a reader's handle");
}

void Caller::call_all() {
  call_others();
  std::array<double, 16> m{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  std::array<double, 3> low{}, high{1.0, 1.0, 1.0};
  std::array<float, 4> one{};
  std::array<std::uint8_t, 4> bytes{};
  std::size_t room = bytes.size();
  double number = 0.0;
  std::int32_t handled = 0;
  const auto create = make_desc<cumulet_create_desc>();
  const auto dense = make_desc<cumulet_dense_desc>();
  const auto sparse = make_desc<cumulet_sparse_desc>();
  const auto triangles = make_desc<cumulet_triangles_desc>();
  const auto medium = make_desc<cumulet_medium_desc>();
  const auto light = make_desc<cumulet_sun_sky_desc>();
  const auto analytic_light = make_desc<cumulet_light_desc>();
  const auto environment = make_desc<cumulet_environment_desc>();
  const auto environment_settings = make_desc<cumulet_environment_settings_desc>();
  const auto ground = make_desc<cumulet_ground_desc>();
  auto environment_info = make_desc<cumulet_environment_info>();
  const auto grid = make_desc<cumulet_grid_desc>();
  const auto sampling = make_desc<cumulet_sampling_desc>();
  const auto display = make_desc<cumulet_display_desc>();
  const auto navigation = make_desc<cumulet_navigation_desc>();
  const auto event = make_desc<cumulet_event>();
  const auto frame = make_desc<cumulet_frame_desc>();
  const auto settings = make_desc<cumulet_surface_settings_desc>();
  auto pose = make_desc<cumulet_camera_desc>();
  auto pick = make_desc<cumulet_pick>();
  const auto map_desc = make_desc<cumulet_transmittance_map_desc>();
  auto map = make_desc<cumulet_transmittance_map>();
  auto stats = make_desc<cumulet_stats>();
  auto denoise = make_desc<cumulet_denoise_desc>();
  denoise.network = "none.tza";
  auto progress = make_desc<cumulet_progress>();
  auto volume_info = make_desc<cumulet_volume_info>();
  auto values_info = make_desc<cumulet_histogram_info>();
  auto surfaces_info = make_desc<cumulet_surfaces_info>();
  auto animation = make_desc<cumulet_animation_info>();
  const auto volume_file = make_desc<cumulet_volume_file_desc>();
  auto file_info = make_desc<cumulet_volume_file_info>();
  auto grid_info = make_desc<cumulet_grid_info>();
  auto metadata = make_desc<cumulet_metadata>();
  cumulet_inspection* new_inspection = nullptr;
  cumulet_viewer* new_viewer = nullptr;
  cumulet_camera* new_camera = nullptr;
  cumulet_volume* new_volume = nullptr;
  cumulet_surfaces* new_surfaces = nullptr;
  cumulet_environment* new_environment = nullptr;
  cumulet_shader_cache* new_programs = nullptr;
  cumulet_instance* new_instance = nullptr;
  auto instance = make_desc<cumulet_instance_desc>();
  cumulet_dynamic_volume* new_live = nullptr;
  const auto live = make_desc<cumulet_dynamic_volume_desc>();
  const auto state = make_desc<cumulet_volume_fields_desc>();
  const auto gl_state = make_desc<cumulet_gl_volume_desc>();
  auto live_info = make_desc<cumulet_dynamic_volume_info>();
  const auto limits = make_desc<cumulet_limits_desc>();
  cumulet_model* new_model = nullptr;
  const auto model = make_desc<cumulet_model_desc>();
  cumulet_sequence* new_sequence = nullptr;
  const auto sequence = make_desc<cumulet_sequence_desc>();
  const auto playback = make_desc<cumulet_playback_desc>();
  auto sequence_info = make_desc<cumulet_sequence_info>();
  auto variant = make_desc<cumulet_variant_info>();
  std::uint32_t at = 0;
  auto programs = make_desc<cumulet_shader_cache_desc>();
  auto warm_up = make_desc<cumulet_warm_up_result>();
  std::array<float, 3> rgb{};
  const auto object_name = [](void*, cumulet_object_kind, std::uint64_t, std::uint32_t) { return "object"; };

  // The functions that are allowed.
  for (cumulet_viewer* v : {viewer, other}) {
    answer("cumulet_get_progress", cumulet_get_progress(v, &progress), CUMULET_OK);
    cumulet_cancel(v);
  }
  const std::array<float, 4> region{};
  std::array<std::uint32_t, 4> pixels{};
  answer("cumulet_region_pixels", cumulet_region_pixels(region.data(), 1, 1, pixels.data()), CUMULET_OK);
  names.insert({"cumulet_cancel",
                "cumulet_status_text",
                "cumulet_version",
                "cumulet_volume_retain",
                "cumulet_volume_release",
                "cumulet_surfaces_retain",
                "cumulet_surfaces_release",
                "cumulet_shader_cache_retain",
                "cumulet_shader_cache_release",
                "cumulet_camera_release",
                "cumulet_environment_retain",
                "cumulet_environment_release",
                "cumulet_instance_retain",
                "cumulet_instance_release",
                "cumulet_dynamic_volume_retain",
                "cumulet_dynamic_volume_release",
                "cumulet_model_retain",
                "cumulet_model_release",
                "cumulet_sequence_retain",
                "cumulet_sequence_release",
                "cumulet_inspection_release",
                "cumulet_destroy",
                "cumulet_last_error",
                "cumulet_transmittance_map_glsl",
                "cumulet_cryptomatte_id"});
  cumulet_volume_release(cumulet_volume_retain(volume));
  cumulet_surfaces_release(cumulet_surfaces_retain(surfaces));
  cumulet_shader_cache_release(cumulet_shader_cache_retain(nullptr));
  cumulet_camera_release(nullptr);
  cumulet_environment_release(cumulet_environment_retain(nullptr));
  cumulet_inspection_release(nullptr);
  cumulet_instance_release(cumulet_instance_retain(nullptr));
  cumulet_dynamic_volume_release(cumulet_dynamic_volume_retain(nullptr));
  cumulet_model_release(cumulet_model_retain(nullptr));
  cumulet_sequence_release(cumulet_sequence_retain(nullptr));
  if (cumulet_status_text(CUMULET_OK) == nullptr || cumulet_version() == 0) wrong.push_back("text or version");
  if (cumulet_cryptomatte_id("hello") != 0x248bfa47U) wrong.push_back("id");
  if (cumulet_transmittance_map_glsl() == nullptr) wrong.push_back("glsl");
  // Rejected, but these have no status.
  cumulet_destroy(viewer);
  cumulet_destroy(other);
  if (std::string(cumulet_last_error(viewer)).empty()) wrong.push_back("cumulet_last_error");

  CALL(cumulet_create, &create, &new_viewer, nullptr, 0);
  CALL(cumulet_shader_cache_create, &programs, &new_programs, nullptr, 0);
  CALL(cumulet_volume_from_dense, &dense, &new_volume, nullptr, 0);
  CALL(cumulet_volume_from_sparse, &sparse, &new_volume, nullptr, 0);
  CALL(cumulet_volume_suggest_density_scale, volume, &number);
  CALL(cumulet_inspect_volume_file, "none.vdb", &new_inspection, nullptr, 0);
  CALL(cumulet_inspection_get_file, new_inspection, &file_info);
  CALL(cumulet_inspection_get_grid, new_inspection, 0, &grid_info);
  CALL(cumulet_inspection_get_metadata, new_inspection, 0, 0, &metadata);
  CALL(cumulet_volume_get_info, volume, &volume_info);
  CALL(cumulet_volume_get_histogram, volume, CUMULET_RAMP_DENSITY, &values_info);
  CALL(
      cumulet_list_grids, "none.vdb", [](void*, const char*, const char*, const char*) {}, nullptr, nullptr, 0);
  CALL(cumulet_environment_from_pixels, &environment, &new_environment, nullptr, 0);
  CALL(cumulet_environment_get_info, new_environment, &environment_info);
  CALL(cumulet_environment_get_pixels, new_environment, 1, 1, rgb.data(), rgb.size());
  CALL(cumulet_surfaces_open, "none.glb", &new_surfaces, nullptr, 0);
  CALL(cumulet_surfaces_from_memory, bytes.data(), bytes.size(), nullptr, nullptr, &new_surfaces, nullptr, 0);
  CALL(cumulet_surfaces_from_triangles, &triangles, &new_surfaces, nullptr, 0);
  CALL(cumulet_surfaces_get_info, surfaces, &surfaces_info);
  CALL(cumulet_surfaces_get_animation, surfaces, 0, &animation);
  CALL(cumulet_surfaces_get_variant, surfaces, 0, &variant);
  CALL(cumulet_model_create, &model, &new_model, nullptr, 0);
  CALL(cumulet_model_set, new_model, &model);
  CALL(cumulet_model_set_to_world, new_model, m.data());
  CALL(cumulet_model_set_time, new_model, 1.0);
  CALL(cumulet_model_set_previous, new_model, nullptr, nullptr);
  CALL(cumulet_volume_from_fields, &state, &new_volume, nullptr, 0);
  CALL(cumulet_dynamic_volume_create, &live, &new_live, nullptr, 0);
  CALL(cumulet_dynamic_volume_set, new_live, &state, nullptr, 0);
  CALL(cumulet_dynamic_volume_update, new_live, &state, nullptr, 0);
  CALL(cumulet_dynamic_volume_get_volume, new_live, &new_volume, nullptr, 0);
  CALL(cumulet_sequence_create, &sequence, &new_sequence, nullptr, 0);
  CALL(cumulet_sequence_set_playback, new_sequence, &playback);
  CALL(cumulet_sequence_set_time, new_sequence, 0.0);
  CALL(cumulet_sequence_set_frame, new_sequence, 0.0);
  CALL(cumulet_sequence_get_frame_at, new_sequence, 0.0, &at);
  CALL(cumulet_sequence_get_time_of, new_sequence, 0, &number);
  CALL(cumulet_instance_create, &instance, &new_instance, nullptr, 0);
  CALL(cumulet_instance_set, new_instance, &instance);
  CALL(cumulet_instance_set_to_world, new_instance, m.data());
  CALL(cumulet_instance_set_previous, new_instance, nullptr);
  CALL(cumulet_instance_set_ramp, new_instance, CUMULET_RAMP_DENSITY, nullptr, 0);
  CALL(cumulet_camera_create, &pose, &new_camera);
  CALL(cumulet_camera_set, camera, &pose);
  CALL(cumulet_camera_get, camera, &pose);
  CALL(cumulet_camera_set_matrices, camera, m.data(), m.data(), CUMULET_CLIP_NEGATIVE_ONE_TO_ONE);
  CALL(cumulet_camera_set_shutter, camera, &pose, nullptr);
  CALL(cumulet_camera_get_matrices, camera, 1.0, CUMULET_CLIP_NEGATIVE_ONE_TO_ONE, m.data(), m.data());
  CALL(cumulet_camera_orbit, camera, 0.1, 0.1);
  CALL(cumulet_camera_look, camera, 0.1, 0.1);
  CALL(cumulet_camera_roll, camera, 0.1);
  CALL(cumulet_camera_pan, camera, 0.1, 0.1);
  CALL(cumulet_camera_dolly, camera, 1.1);
  CALL(cumulet_camera_fly, camera, 0.1, 0.1, 0.1);
  CALL(cumulet_camera_frame, camera, low.data(), high.data(), 1.0);
  for (cumulet_viewer* v : {viewer, other}) {
    CALL(cumulet_attach, v, EglContext::get_proc, nullptr);
    CALL(cumulet_detach, v);
    CALL(cumulet_context_lost, v);
    CALL(cumulet_load_volume, v, "none.vdb", nullptr);
    CALL(cumulet_load_volume_file, v, &volume_file);
    CALL(cumulet_set_volume, v, nullptr);
    CALL(cumulet_set_volume_transforms, v, nullptr, 0);
    CALL(cumulet_set_previous_volume_transforms, v, nullptr, 0);
    CALL(cumulet_set_volume_shutter_transforms, v, nullptr, nullptr, 1);
    CALL(cumulet_get_volume, v, &new_volume);
    CALL(cumulet_add_model, v, new_model);
    CALL(cumulet_remove_model, v, new_model);
    CALL(cumulet_add_instance, v, new_instance);
    CALL(cumulet_remove_instance, v, new_instance);
    CALL(cumulet_set_sequence, v, nullptr);
    CALL(cumulet_set_dynamic_volume, v, nullptr);
    CALL(cumulet_get_dynamic_volume_info, v, &live_info);
    CALL(cumulet_dynamic_volume_set_gl, v, new_live, &gl_state);
    CALL(cumulet_set_limits, v, &limits);
    CALL(cumulet_get_sequence_info, v, &sequence_info, nullptr, 0);
    CALL(cumulet_get_sequence_frame, v, 0, nullptr, 0);
    CALL(cumulet_get_instance_sequence_info, v, new_instance, &sequence_info, nullptr, 0);
    CALL(cumulet_get_instance_sequence_frame, v, new_instance, 0, nullptr, 0);
    CALL(cumulet_get_instance_dynamic_volume_info, v, new_instance, &live_info);
    CALL(cumulet_load_surfaces, v, "none.glb");
    CALL(cumulet_set_surfaces, v, nullptr);
    CALL(cumulet_get_surfaces, v, &new_surfaces);
    CALL(cumulet_set_surface_settings, v, &settings);
    CALL(cumulet_use_surface_camera, v, 0);
    CALL(cumulet_wait, v, 0.0);
    CALL(cumulet_rebuild, v);
    CALL(cumulet_set_grid, v, &grid);
    CALL(cumulet_set_medium, v, &medium);
    CALL(cumulet_set_ramp, v, CUMULET_RAMP_DENSITY, nullptr, 0);
    CALL(cumulet_set_sun_sky, v, &light);
    CALL(cumulet_set_lights, v, &analytic_light, 1);
    CALL(cumulet_load_environment, v, "none.hdr");
    CALL(cumulet_set_environment, v, nullptr);
    CALL(cumulet_get_environment, v, &new_environment);
    CALL(cumulet_set_environment_settings, v, &environment_settings);
    CALL(cumulet_set_ground, v, &ground);
    CALL(cumulet_set_sampling, v, &sampling);
    CALL(cumulet_set_display, v, &display);
    CALL(cumulet_set_camera, v, camera);
    CALL(cumulet_set_previous_camera, v, camera, 0.0);
    CALL(cumulet_get_camera, v, &new_camera);
    CALL(cumulet_frame_all, v);
    CALL(cumulet_set_navigation, v, &navigation);
    CALL(cumulet_input, v, &event, &handled);
    CALL(cumulet_render, v, &frame, nullptr);
    CALL(cumulet_warm_up, v, &frame, CUMULET_WARM_UP_SCENE, &warm_up);
    CALL(cumulet_pick_at, v, 0.0, 0.0, &pick);
    CALL(cumulet_update_transmittance_map, v, &map_desc, &map);
    CALL(cumulet_destroy_transmittance_map, v, 0U);
    CALL(cumulet_get_bounds, v, low.data(), high.data());
    CALL(cumulet_read_linear, v, one.data(), one.size());
    CALL(cumulet_read_display, v, bytes.data(), bytes.size());
    CALL(cumulet_encode_display, v, one.data(), bytes.data(), bytes.size());
    CALL(cumulet_read_denoised, v, &denoise, one.data(), one.size());
    CALL(cumulet_read_aov, v, CUMULET_AOV_BEAUTY, one.data(), one.size());
    CALL(cumulet_read_light_group, v, 0, one.data(), one.size());
    CALL(cumulet_read_cryptomatte, v, object_name, nullptr, 1U, one.data(), one.size());
    CALL(cumulet_measure_noise, v, &number);
    CALL(cumulet_read_accumulation, v, bytes.data(), &room);
    CALL(cumulet_restore_accumulation, v, bytes.data(), bytes.size());
    CALL(cumulet_get_stats, v, &stats);
  }
  if (new_viewer != nullptr || new_camera != nullptr || new_volume != nullptr || new_surfaces != nullptr ||
      new_environment != nullptr || new_inspection != nullptr || new_programs != nullptr || new_sequence != nullptr) {
    wrong.push_back("a refused call gave a handle");
  }
}

/// Runs the call on another thread, and ends the program if it never returns.
void expect_returns(const std::string& what, const std::function<void()>& call) {
  auto done = std::async(std::launch::async, call);
  if (done.wait_for(patience) == std::future_status::ready) return;
  std::fprintf(stderr, "%s: deadlock\n", what.c_str());
  std::_Exit(1);
}

TEST(Callbacks, EveryFunctionIsRejectedInsideWithoutDeadlock) {
  Caller caller;
  const ViewerPtr viewer = make_viewer(
      {.update = Caller::on_update, .update_user = &caller, .log = Caller::on_log, .log_user = &caller, .samples = 1});
  const ViewerPtr other = make_viewer({});
  const VolumeRef volume = make_ball(16);
  const SurfacesRef surfaces = make_cloth(2, 1.0F);
  cumulet_camera* out = nullptr;
  ASSERT_EQ(cumulet_get_camera(viewer.get(), &out), CUMULET_OK);
  const CameraRef camera(out);
  ASSERT_EQ(cumulet_set_camera(other.get(), camera.get()), CUMULET_OK);
  caller.viewer = viewer.get();
  caller.other = other.get();
  caller.camera = camera.get();
  caller.volume = volume.get();
  caller.surfaces = surfaces.get();

  // Updates are notified once per frame, so each trigger has a new viewer without a pending notification.
  int rounds = 0;
  const auto trigger = [&](const std::string& what, const std::function<void()>& call) {
    caller.armed = true;
    expect_returns(what, call);
    const auto until = Clock::now() + patience;
    while (caller.rounds == rounds && Clock::now() < until) std::this_thread::sleep_for(1ms);
    EXPECT_EQ(caller.rounds, ++rounds) << what << ": no callback came";
  };
  const auto fresh = [&] {
    ViewerPtr made = make_viewer({.log = Caller::on_log, .log_user = &caller, .samples = 1});
    return made;
  };
  // A camera change notifies on the calling thread. (make_viewer has notified an update; a frame re-enables the next.)
  const EglContext context;
  expect_returns("a frame", [&] {
    context.make_current();
    EXPECT_EQ(cumulet_attach(viewer.get(), EglContext::get_proc, nullptr), CUMULET_OK);
    auto frame = make_desc<cumulet_frame_desc>();
    frame.target = CUMULET_TARGET_NONE;
    EXPECT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_OK);
    context.release();
  });
  trigger("camera", [&] { EXPECT_EQ(cumulet_camera_orbit(camera.get(), 0.2, 0.1), CUMULET_OK); });
  // A setting notifies, and a job that ends on the worker thread.
  const auto make_way = [&] {
    context.make_current();
    auto frame = make_desc<cumulet_frame_desc>();
    frame.target = CUMULET_TARGET_NONE;
    EXPECT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_OK);
    context.release();
  };
  expect_returns("a frame", make_way);
  trigger("setting", [&] {
    const auto light = make_desc<cumulet_sun_sky_desc>();
    EXPECT_EQ(cumulet_set_sun_sky(viewer.get(), &light), CUMULET_OK);
  });
  expect_returns("a job", [&] {
    EXPECT_EQ(cumulet_set_volume(viewer.get(), volume.get()), CUMULET_OK);
    EXPECT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_OK);
  });
  // Log lines come from the worker thread too: the grid is limited by max_cells.
  const ViewerPtr logging = fresh();
  caller.viewer = logging.get();
  trigger("log", [&] {
    auto grid = slow_grid();
    grid.max_cells = 100;
    EXPECT_EQ(cumulet_set_grid(logging.get(), &grid), CUMULET_OK);
    EXPECT_EQ(cumulet_set_volume(logging.get(), volume.get()), CUMULET_OK);
    (void)cumulet_wait(logging.get(), -1.0);  // the callback cancelled
  });
  EXPECT_EQ(caller.wrong, std::vector<std::string>{});

  // No function of the header was forgotten.
  std::ifstream file(CUMULET_HEADER);
  std::stringstream header;
  header << file.rdbuf();
  const std::string text = header.str();
  const std::regex declaration("CUMULET_API [^(;]*?(cumulet_\\w+)\\(");
  std::set<std::string> all;
  for (std::sregex_iterator i(text.begin(), text.end(), declaration), end; i != end; ++i) all.insert((*i)[1]);
  EXPECT_GT(all.size(), 50U);
  EXPECT_EQ(caller.names, all);

  // Outside of callbacks, everything works as before.
  EXPECT_EQ(cumulet_camera_orbit(camera.get(), 0.1, 0.0), CUMULET_OK);
  expect_returns("detach", [&] {
    context.make_current();
    EXPECT_EQ(cumulet_detach(viewer.get()), CUMULET_OK);
    context.release();
  });
}

}  // namespace
