// libFuzzer over cumulet.h: a program of calls with descriptors of arbitrary numbers. No call may crash, hang, leak or
// fail without a one-line error message. Pointers and counts are valid, because C cannot check those. See README.md.

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "api_fuzz_arguments.hpp"
#include "api_fuzz_camera.hpp"
#include "cumulet/cumulet.h"
#include "headless.hpp"
#include "unit/support/c_host.hpp"

namespace {

using cumulet::fuzz::Arguments;
using cumulet::fuzz::check_line;
using cumulet::fuzz::fail;
using cumulet::headless::Context;
using cumulet::test::CameraRef;
using cumulet::test::EnvironmentRef;
using cumulet::test::InstanceRef;
using cumulet::test::LiveRef;
using cumulet::test::ModelRef;
using cumulet::test::ProgramsRef;
using cumulet::test::SequenceRef;
using cumulet::test::SurfacesRef;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;

/// One context for all inputs; viewers come and go in it.
Context& context() {
  static Context made = Context::create(cumulet::headless::Backend::osmesa);
  return made;
}

class Program : Arguments {
 public:
  using Arguments::Arguments;

  void run() {
    auto desc = described<cumulet_create_desc>();
    desc.struct_size = sizeof desc;
    draws_ = input.ConsumeIntegralInRange(0, 7) == 7;
    make_programs();
    desc.shader_cache = programs_.get();
    desc.trace = [](void*, const char* name, double begin, double end) {
      check_line(name);
      if (!(begin <= end)) fail("a span that ends before it begins");
    };
    desc.trace_user = nullptr;
    desc.get_proc = draws_ ? Context::get_proc : nullptr;
    desc.get_proc_user = draws_ ? &context() : nullptr;
    desc.log = [](void*, cumulet_log_level, const char* message) { check_line(message); };
    desc.log_user = nullptr;
    desc.update = nullptr;
    std::array<char, 256> error{};
    cumulet_viewer* viewer = nullptr;
    if (cumulet_create(&desc, &viewer, error.data(), error.size()) != CUMULET_OK) {
      check_line(error.data());
      return;
    }
    viewer_.reset(viewer);
    for (int calls = 0; calls < 40 && input.remaining_bytes() > 0; ++calls) call();
  }

 private:
  /// Checks the status of a viewer's call.
  void check(cumulet_status status) {
    const char* line = cumulet_last_error(viewer_.get());
    if (status != CUMULET_OK) check_line(line);
    if (status == CUMULET_OK && *line != '\0') fail("a success with an error");
  }
  /// A call with an error buffer.
  template <class Make>
  void made(Make make) {
    std::array<char, 256> error{};
    if (make(error.data(), error.size()) != CUMULET_OK) check_line(error.data());
  }

  void make_programs() {
    auto desc = described<cumulet_shader_cache_desc>();
    desc.folder = input.ConsumeBool() ? "/dev/null/nowhere" : nullptr;
    desc.shaders = input.ConsumeIntegralInRange(0, 7) == 7 ? "/dev/null/nowhere" : nullptr;
    cumulet_shader_cache* programs = nullptr;
    made([&](char* error, std::size_t size) { return cumulet_shader_cache_create(&desc, &programs, error, size); });
    programs_.reset(programs);
  }

  void make_dense() {
    std::vector<float> values;
    const cumulet_dense_desc desc = dense(values);
    cumulet_volume* volume = nullptr;
    made([&](char* error, std::size_t size) { return cumulet_volume_from_dense(&desc, &volume, error, size); });
    if (volume != nullptr) volume_.reset(volume);
  }

  void make_sparse() {
    Sparse kept;
    const cumulet_sparse_desc desc = sparse(kept);
    cumulet_volume* volume = nullptr;
    made([&](char* error, std::size_t size) { return cumulet_volume_from_sparse(&desc, &volume, error, size); });
    if (volume != nullptr) volume_.reset(volume);
  }

  void make_triangles() {
    auto mesh = described<cumulet_mesh_desc>();
    mesh.struct_size = sizeof mesh;
    const std::size_t vertices = input.ConsumeIntegralInRange<std::size_t>(0, 12);
    const std::vector<float> positions = floats(3 * vertices);
    const std::vector<float> normals = floats(3 * vertices);
    const std::vector<float> colors = floats(4 * vertices);
    std::vector<std::uint32_t> indices(input.ConsumeIntegralInRange<std::size_t>(0, 12));
    for (std::uint32_t& index : indices) index = input.ConsumeIntegralInRange<std::uint32_t>(0, 13);
    mesh.positions = positions.data();
    mesh.normals = input.ConsumeBool() ? normals.data() : nullptr;
    mesh.colors = input.ConsumeBool() ? colors.data() : nullptr;
    mesh.velocities = input.ConsumeBool() ? normals.data() : nullptr;
    mesh.vertex_count = vertices;
    mesh.indices = indices.data();
    mesh.index_count = indices.size();
    auto desc = described<cumulet_triangles_desc>();
    desc.meshes = &mesh;
    desc.mesh_count = input.ConsumeBool() ? 1 : 0;
    desc.name = nullptr;
    cumulet_surfaces* surfaces = nullptr;
    made([&](char* error, std::size_t size) { return cumulet_surfaces_from_triangles(&desc, &surfaces, error, size); });
    if (surfaces != nullptr) surfaces_.reset(surfaces);
  }

  void set_transforms() {
    constexpr std::uint32_t most = 3;
    std::array<double, std::size_t{16} * most> transforms{};
    const auto all = [&] {
      for (std::size_t i = 0; i < most; ++i) put_transform(&transforms[16 * i]);
      return transforms;
    };
    const auto count = input.ConsumeIntegralInRange(0U, most);
    check(cumulet_set_volume_transforms(viewer_.get(), all().data(), count));
    const auto open = all();
    const auto close = all();
    check(cumulet_set_volume_shutter_transforms(viewer_.get(), input.ConsumeBool() ? open.data() : nullptr,
                                                input.ConsumeBool() ? close.data() : nullptr,
                                                input.ConsumeBool() ? count : most - count));
  }

  void change_instances() {
    auto medium = described<cumulet_medium_desc>();
    std::array<cumulet_instance_desc, 2> desc{};
    desc[0] = described<cumulet_instance_desc>();
    put_transform(desc[0].to_world);
    put_transform(desc[0].open_to_world);
    put_transform(desc[0].close_to_world);
    desc[0].volume = volume_.get();
    desc[0].sequence = volume_ ? nullptr : sequence_.get();
    desc[0].dynamic_volume = volume_ || sequence_ ? nullptr : live_.get();
    desc[0].medium = input.ConsumeBool() ? &medium : nullptr;
    if (medium.struct_size > sizeof medium) medium.struct_size = sizeof medium;
    switch (input.ConsumeIntegralInRange(0, 4)) {
      case 0:
        cumulet_instance_set(instance_.get(), desc.data());
        return;
      case 1:
        cumulet_instance_set_to_world(instance_.get(), desc[0].to_world);
        return;
      case 2:
        return check(cumulet_add_instance(viewer_.get(), instance_.get()));
      case 3:
        return check(cumulet_remove_instance(viewer_.get(), instance_.get()));
      default: {
        cumulet_instance* instance = nullptr;
        made([&](char* error, std::size_t size) {
          return cumulet_instance_create(desc.data(), &instance, error, size);
        });
        if (instance != nullptr) instance_.reset(instance);
      }
    }
  }

  void change_models() {
    std::array<cumulet_model_desc, 2> desc{};
    desc[0] = described<cumulet_model_desc>();
    put_transform(desc[0].to_world);
    put_transform(desc[0].open_to_world);
    put_transform(desc[0].close_to_world);
    desc[0].surfaces = surfaces_.get();
    switch (input.ConsumeIntegralInRange(0, 6)) {
      case 0:
        cumulet_model_set(model_.get(), desc.data());
        return;
      case 1:
        cumulet_model_set_to_world(model_.get(), desc[0].to_world);
        return;
      case 2:
        cumulet_model_set_time(model_.get(), bits<double>(number()));
        return;
      case 3:
        return check(cumulet_add_model(viewer_.get(), model_.get()));
      case 4:
        return check(cumulet_remove_model(viewer_.get(), model_.get()));
      case 5: {
        const ModelRef again(cumulet_model_retain(model_.get()));
        if (again.get() != model_.get()) fail("a model that is another once it is retained");
        return;
      }
      default: {
        cumulet_model* model = nullptr;
        made([&](char* error, std::size_t size) { return cumulet_model_create(desc.data(), &model, error, size); });
        if (model != nullptr) model_.reset(model);
      }
    }
  }

  void set_live() {
    auto state = make_state();
    if (input.ConsumeBool()) {
      // Read later and in place. The sanitizer checks that it is released exactly once.
      state->desc.release = [](void* user) { delete static_cast<State*>(user); };
      state->desc.release_user = state.get();
    }
    const cumulet_volume_fields_desc desc = state->desc;
    std::array<char, 256> error{};
    if (cumulet_dynamic_volume_set(live_.get(), &desc, error.data(), error.size()) != CUMULET_OK)
      check_line(error.data());
    else if (desc.release != nullptr)
      static_cast<void>(state.release());  // owned by the library, or already released
  }

  /// Names that are usually not objects of the context, but may be the library's own by chance.
  void set_live_gl() {
    std::array<cumulet_gl_field, 2> fields{described<cumulet_gl_field>(), described<cumulet_gl_field>()};
    if (input.ConsumeBool()) {
      for (cumulet_gl_field& field : fields) {
        field.struct_size = sizeof field;
        field.texture = input.ConsumeBool() ? input.ConsumeIntegralInRange<std::uint32_t>(0, 40) : 0;
        field.buffer = field.texture == 0 ? input.ConsumeIntegralInRange<std::uint32_t>(0, 40) : 0;
        for (std::int32_t& side : field.size) side = input.ConsumeIntegralInRange(-1, 20);
      }
    }
    std::array<cumulet_voxel_box, 2> boxes{};
    for (cumulet_voxel_box& box : boxes) {
      for (std::int32_t& at : box.min) at = input.ConsumeIntegral<std::int32_t>();
      for (std::int32_t& at : box.max) at = input.ConsumeIntegral<std::int32_t>();
    }
    auto desc = described<cumulet_gl_volume_desc>();
    desc.fields = fields.data();
    desc.field_count = input.ConsumeIntegralInRange<std::uint64_t>(0, fields.size());
    desc.changed = input.ConsumeBool() ? boxes.data() : nullptr;
    desc.changed_count = desc.changed != nullptr ? input.ConsumeIntegralInRange<std::uint64_t>(0, boxes.size()) : 0;
    desc.wait = nullptr;
    desc.name = input.ConsumeBool() ? "a state\nof lines" : nullptr;
    check(cumulet_dynamic_volume_set_gl(viewer_.get(), live_.get(), &desc));
  }

  void change_live() {
    switch (input.ConsumeIntegralInRange(0, 10)) {
      case 0:
      case 1:
      case 2:
        return set_live();
      case 3:
      case 4: {
        const auto state = make_state();
        return made([&](char* error, std::size_t size) {
          return cumulet_dynamic_volume_update(live_.get(), &state->desc, error, size);
        });
      }
      case 5: {
        cumulet_volume* volume = nullptr;
        made([&](char* error, std::size_t size) {
          return cumulet_dynamic_volume_get_volume(live_.get(), &volume, error, size);
        });
        if (volume != nullptr) volume_.reset(volume);
        return;
      }
      case 6:
        return check(cumulet_set_dynamic_volume(viewer_.get(), input.ConsumeBool() ? live_.get() : nullptr));
      case 7:
        return get<cumulet_dynamic_volume_info>(cumulet_get_dynamic_volume_info);
      case 8: {
        const auto state = make_state();
        cumulet_volume* volume = nullptr;
        made([&](char* error, std::size_t size) {
          return cumulet_volume_from_fields(&state->desc, &volume, error, size);
        });
        if (volume != nullptr) volume_.reset(volume);
        return;
      }
      case 9:
        return set_live_gl();
      default: {
        const auto desc = described<cumulet_dynamic_volume_desc>();
        cumulet_dynamic_volume* live = nullptr;
        made([&](char* error, std::size_t size) {
          return cumulet_dynamic_volume_create(input.ConsumeBool() ? &desc : nullptr, &live, error, size);
        });
        if (live != nullptr) live_.reset(live);
      }
    }
  }

  void change_sequence() {
    auto playback = described<cumulet_playback_desc>();
    std::uint32_t frame = 0;
    double seconds = 0.0;
    switch (input.ConsumeIntegralInRange(0, 7)) {
      case 0:
        cumulet_sequence_set_playback(sequence_.get(), &playback);
        return;
      case 1:
        cumulet_sequence_set_time(sequence_.get(), bits<double>(number()));
        return;
      case 2:
        cumulet_sequence_set_frame(sequence_.get(), bits<double>(number()));
        return;
      case 3:
        if (cumulet_sequence_get_frame_at(sequence_.get(), bits<double>(number()), &frame) == CUMULET_OK && frame > 2)
          fail("a frame that is not there");
        cumulet_sequence_get_time_of(sequence_.get(), frame, &seconds);
        return;
      case 4:
        return check(cumulet_set_sequence(viewer_.get(), input.ConsumeBool() ? sequence_.get() : nullptr));
      case 5: {
        std::array<cumulet_sequence_info, 2> info{};
        info[0] = described<cumulet_sequence_info>();
        std::array<std::uint8_t, 4> states{};
        return check(cumulet_get_sequence_info(viewer_.get(), info.data(), states.data(), states.size()));
      }
      case 6: {
        std::array<char, 64> cause{};
        check(cumulet_get_sequence_frame(viewer_.get(), input.ConsumeIntegralInRange(0U, 4U), cause.data(),
                                         cause.size()));
        if (cause.front() != '\0') check_line(cause.data());  // it failed, if a message was written
        return;
      }
      default: {
        constexpr std::array paths = {"/dev/null", "/dev/null/nowhere.vdb", ""};
        auto file = described<cumulet_volume_file_desc>();
        file.path = file.grid_name = file.temperature_grid = nullptr;
        file.flame_grid = file.color_grid = file.anisotropy_grid = file.velocity_grid = nullptr;
        file.struct_size = std::min(file.struct_size, sizeof file);
        auto desc = described<cumulet_sequence_desc>();
        desc.paths = paths.data();
        desc.count = input.ConsumeIntegralInRange(0U, 3U);
        desc.file = input.ConsumeBool() ? &file : nullptr;
        cumulet_sequence* sequence = nullptr;
        made([&](char* error, std::size_t size) { return cumulet_sequence_create(&desc, &sequence, error, size); });
        if (sequence != nullptr) sequence_.reset(sequence);
      }
    }
  }

  void make_environment() {
    auto desc = described<cumulet_environment_desc>();
    desc.width = input.ConsumeIntegralInRange<std::uint32_t>(0, 9);
    desc.height = input.ConsumeIntegralInRange<std::uint32_t>(0, 9);
    const std::vector<float> values = floats(std::size_t{3} * desc.width * desc.height);
    desc.values = values.data();
    desc.value_count = values.size();
    desc.name = input.ConsumeBool() ? "an environment\nof lines" : nullptr;
    cumulet_environment* environment = nullptr;
    made([&](char* error, std::size_t size) {
      return cumulet_environment_from_pixels(&desc, &environment, error, size);
    });
    if (environment != nullptr) environment_.reset(environment);
    std::array<float, 27> seen{};
    const auto side = [&] { return input.ConsumeIntegralInRange<std::uint32_t>(0, 4); };
    const std::uint32_t width = side();
    if (cumulet_environment_get_pixels(environment_.get(), width, side(), seen.data(), seen.size()) != CUMULET_OK)
      return;
    for (const float value : seen) {
      if (!(value >= 0.0F && value <= 2e30F)) fail("an environment that is not what counts");
    }
  }

  template <class Desc, class Set>
  void set(Set function) {
    const auto desc = described<Desc>();
    check(function(viewer_.get(), &desc));
  }
  template <class Out, class Get>
  void get(Get function) {
    std::array<Out, 2> out{};  // struct_size may be slightly too large
    out[0] = described<Out>();
    check(function(viewer_.get(), out.data()));
  }

  void warm_up() {
    const cumulet_frame_desc frame = small_frame();
    std::array<cumulet_warm_up_result, 2> result{};
    result[0] = described<cumulet_warm_up_result>();
    check(cumulet_warm_up(viewer_.get(), &frame, static_cast<cumulet_warm_up_scope>(input.ConsumeIntegralInRange(0, 2)),
                          result.data()));
  }

  void render() {
    const cumulet_frame_desc frame = small_frame();
    std::array<cumulet_frame_result, 2> result{};
    result[0] = described<cumulet_frame_result>();
    check(cumulet_render(viewer_.get(), &frame, result.data()));
  }

  void look() {
    std::vector<float> values(4096);
    std::vector<std::uint8_t> bytes(4096);
    double noise = 0.0;
    std::array<cumulet_pick, 2> pick{};
    pick[0] = described<cumulet_pick>();
    std::size_t room = bytes.size();
    switch (input.ConsumeIntegralInRange(0, 9)) {
      case 9: {
        const auto name = [](void*, cumulet_object_kind kind, std::uint64_t, std::uint32_t) {
          return kind == CUMULET_OBJECT_GROUND ? nullptr : "object";
        };
        return check(cumulet_read_cryptomatte(viewer_.get(), name, nullptr, input.ConsumeIntegralInRange(0U, 17U),
                                              values.data(), values.size()));
      }
      case 8:
        return check(cumulet_destroy_transmittance_map(viewer_.get(), input.ConsumeIntegralInRange(0U, 17U)));
      case 7: {
        const auto desc = described<cumulet_transmittance_map_desc>();
        std::array<cumulet_transmittance_map, 2> map{};
        map[0] = described<cumulet_transmittance_map>();
        return check(cumulet_update_transmittance_map(viewer_.get(), &desc, map.data()));
      }
      case 5:
        return check(cumulet_read_accumulation(viewer_.get(), bytes.data(), &room));
      case 6:
        return check(cumulet_restore_accumulation(viewer_.get(), bytes.data(), bytes.size()));
      case 0:
        return check(cumulet_read_linear(viewer_.get(), values.data(), values.size()));
      case 1:
        return check(cumulet_read_display(viewer_.get(), bytes.data(), bytes.size()));
      case 2:
        return check(cumulet_read_aov(viewer_.get(), static_cast<cumulet_aov>(input.ConsumeIntegralInRange(0, 10)),
                                      values.data(), values.size()));
      case 3:
        return check(cumulet_measure_noise(viewer_.get(), &noise));
      default:
        return check(cumulet_pick_at(viewer_.get(), bits<double>(number()), bits<double>(number()), pick.data()));
    }
  }

  /// May be called at any time, and does not change the last error.
  void look_at_progress() {
    std::array<cumulet_progress, 2> progress{};
    progress[0] = described<cumulet_progress>();
    if (cumulet_get_progress(viewer_.get(), progress.data()) != CUMULET_OK) return;
    const std::string message = progress[0].message;
    if (!message.empty()) check_line(message.c_str());
  }

  void ask() {
    double low[3];
    double high[3];
    switch (input.ConsumeIntegralInRange(0, 5)) {
      case 0:
        return get<cumulet_stats>(cumulet_get_stats);
      case 1:
        return look_at_progress();
      case 2: {
        cumulet_interpolation interpolation{};
        check(cumulet_get_interpolation(viewer_.get(), &interpolation));
        return check(cumulet_get_bounds(viewer_.get(), low, high));
      }
      case 3: {
        std::array<cumulet_volume_info, 2> info{};
        info[0] = described<cumulet_volume_info>();
        cumulet_volume_get_info(volume_.get(), info.data());
        double scale = 0.0;
        cumulet_volume_suggest_density_scale(volume_.get(), &scale);
        return;
      }
      case 4: {
        std::array<cumulet_surfaces_info, 2> info{};
        info[0] = described<cumulet_surfaces_info>();
        cumulet_surfaces_get_info(surfaces_.get(), info.data());
        return;
      }
      default:
        return check(cumulet_frame_all(viewer_.get()));
    }
  }

  CameraRef camera() {
    cumulet_camera* camera = nullptr;
    check(cumulet_get_camera(viewer_.get(), &camera));
    return CameraRef(camera);
  }

  void call() {
    cumulet_viewer* viewer = viewer_.get();
    switch (input.ConsumeIntegralInRange(0, 37)) {
      case 0:
        return make_dense();
      case 1:
        return make_sparse();
      case 2:
        return make_triangles();
      case 3:
        return check(cumulet_set_volume(viewer, volume_.get()));
      case 4:
        return check(cumulet_set_surfaces(viewer, surfaces_.get()));
      case 5:
        return set<cumulet_grid_desc>(cumulet_set_grid);
      case 6:
        return set<cumulet_medium_desc>(cumulet_set_medium);
      case 7:
        return set<cumulet_sun_sky_desc>(cumulet_set_sun_sky);
      case 8:
        return set<cumulet_sampling_desc>(cumulet_set_sampling);
      case 9:
        return set<cumulet_display_desc>(cumulet_set_display);
      case 10:
        return set<cumulet_surface_settings_desc>(cumulet_set_surface_settings);
      case 11:
        return set<cumulet_navigation_desc>(cumulet_set_navigation);
      case 12: {
        auto event = described<cumulet_event>();
        std::int32_t handled = 0;
        return check(cumulet_input(viewer, &event, &handled));
      }
      case 13:
      case 14:
        return render();
      case 15:
        return look();
      case 16:
        return steer_camera(*this, camera().get());
      case 17:
        return ask();
      case 18:
        return check(cumulet_wait(viewer, input.ConsumeIntegralInRange(0, 20)));
      case 19:
        return cumulet_cancel(viewer);
      case 20:
        return check(cumulet_rebuild(viewer));
      case 21:
        return warm_up();
      case 22:
        return check(cumulet_use_surface_camera(viewer, input.ConsumeIntegralInRange(0U, 2U)));
      case 23:
        return check(set_ramp(viewer));
      case 24:
        return make_environment();
      case 25:
        return check(cumulet_set_environment(viewer, environment_.get()));
      case 26:
        return check(cumulet_load_environment(viewer, input.ConsumeBool() ? "/dev/null" : "/dev/null/nowhere.exr"));
      case 27:
        return set<cumulet_environment_settings_desc>(cumulet_set_environment_settings);
      case 28:
        return change_instances();
      case 29:
        return change_sequence();
      case 30:
      case 31:
        return change_models();
      case 32:
      case 33:
      case 34:
        return change_live();
      case 35:
        return focus_camera(*this, camera().get());
      case 36:
        return set_transforms();
      default:
        check(cumulet_detach(viewer));
        if (draws_ && input.ConsumeBool()) check(cumulet_attach(viewer, Context::get_proc, &context()));
    }
  }

  bool draws_ = false;
  ProgramsRef programs_;
  VolumeRef volume_;
  SurfacesRef surfaces_;
  EnvironmentRef environment_;
  InstanceRef instance_;
  ModelRef model_;
  LiveRef live_;
  SequenceRef sequence_;
  ViewerPtr viewer_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Program(data, size).run();
  return 0;
}
