// libFuzzer over cumulet.h: a program of calls with descriptors of arbitrary numbers. No call may crash, hang, leak or
// fail without a one-line error message. Pointers and counts are valid, because C cannot check those. See README.md.

#include <fuzzer/FuzzedDataProvider.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "cumulet/cumulet.h"
#include "headless.hpp"
#include "unit/support/c_host.hpp"

namespace {

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

[[noreturn]] void fail(const std::string& why) {
  std::fprintf(stderr, "api_fuzz: %s\n", why.c_str());
  std::abort();
}

void check_line(const char* line) {
  if (line == nullptr || *line == '\0') fail("an error without a cause");
  if (std::strpbrk(line, "\n\r") != nullptr) fail(std::string("not one line: ") + line);
  if (std::string(line).starts_with("internal error")) fail(line);
}

/// One context for all inputs; viewers come and go in it.
Context& context() {
  static Context made = Context::create(cumulet::headless::Backend::osmesa);
  return made;
}

class Program {
 public:
  Program(const std::uint8_t* data, std::size_t size) : data_(data, size) {}

  void run() {
    auto desc = described<cumulet_create_desc>();
    desc.struct_size = sizeof desc;
    draws_ = data_.ConsumeIntegralInRange(0, 7) == 7;
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
    for (int calls = 0; calls < 40 && data_.remaining_bytes() > 0; ++calls) call();
  }

 private:
  /// Fills each 8 bytes with numbers of all kinds. Most are harmless, otherwise all calls would be rejected at once.
  template <class Desc>
  Desc described() {
    Desc desc{};
    std::array<std::uint64_t, sizeof(Desc) / 8> words{};
    for (std::uint64_t& word : words) word = number();
    std::memcpy(static_cast<void*>(&desc), words.data(), sizeof words);
    desc.struct_size = data_.ConsumeIntegralInRange(0, 15) == 0 ? data_.ConsumeIntegral<std::uint16_t>() : sizeof desc;
    // Not larger than the struct and the space after it, because the library writes there.
    if (desc.struct_size > sizeof desc) desc.struct_size = sizeof desc + 8;
    return desc;
  }

  std::uint64_t number() {
    const auto one_float = [this] {
      constexpr std::array numbers = {0.0F,
                                      1.0F,
                                      0.5F,
                                      -1.0F,
                                      1e-30F,
                                      1e30F,
                                      std::numeric_limits<float>::infinity(),
                                      std::numeric_limits<float>::quiet_NaN(),
                                      3.0F};
      return bits<std::uint32_t>(data_.PickValueInArray(numbers));
    };
    switch (data_.ConsumeIntegralInRange(0, 11)) {
      case 0:
        return data_.ConsumeIntegral<std::uint64_t>();
      case 1:
      case 2:
        return bits<std::uint64_t>(data_.PickValueInArray({1.0, -1.0, 0.5, 10.0, 45.0, 1e-300, 1e300, 1e9,
                                                           std::numeric_limits<double>::infinity(),
                                                           std::numeric_limits<double>::quiet_NaN()}));
      case 3:
      case 4:
        return one_float() | std::uint64_t{one_float()} << 32U;
      case 5:
      case 6:
        return data_.ConsumeIntegralInRange<std::uint32_t>(0, 4) |
               std::uint64_t{data_.ConsumeIntegralInRange<std::uint32_t>(0, 4)} << 32U;
      default:
        return 0;
    }
  }

  template <class To, class From>
  static To bits(From value) {
    static_assert(sizeof(To) == sizeof(From));
    To out;
    std::memcpy(&out, &value, sizeof out);
    return out;
  }

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
    desc.folder = data_.ConsumeBool() ? "/dev/null/nowhere" : nullptr;
    desc.shaders = data_.ConsumeIntegralInRange(0, 7) == 7 ? "/dev/null/nowhere" : nullptr;
    cumulet_shader_cache* programs = nullptr;
    made([&](char* error, std::size_t size) { return cumulet_shader_cache_create(&desc, &programs, error, size); });
    programs_.reset(programs);
  }

  /// values: keeps the voxels that the descriptor refers to.
  cumulet_dense_desc dense(std::vector<float>& values) {
    auto desc = described<cumulet_dense_desc>();
    const std::size_t count = data_.ConsumeIntegralInRange<std::size_t>(0, 600);
    values.resize(count);
    for (float& value : values) value = bits<float>(static_cast<std::uint32_t>(number()));
    if (data_.ConsumeBool()) {
      desc.size[0] = data_.ConsumeIntegralInRange(1, 9);
      desc.size[1] = data_.ConsumeIntegralInRange(1, 9);
      desc.size[2] = static_cast<int>(count) / (desc.size[0] * desc.size[1]);
      values.resize(static_cast<std::size_t>(desc.size[0] * desc.size[1] * desc.size[2]));
    }
    desc.values = values.data();
    desc.value_count = values.size();
    desc.name = data_.ConsumeBool() ? "dense\nthing" : nullptr;
    return desc;
  }

  void make_dense() {
    std::vector<float> values;
    const cumulet_dense_desc desc = dense(values);
    cumulet_volume* volume = nullptr;
    made([&](char* error, std::size_t size) { return cumulet_volume_from_dense(&desc, &volume, error, size); });
    if (volume != nullptr) volume_.reset(volume);
  }

  struct Sparse {
    std::vector<std::int32_t> origins;
    std::vector<float> values;
    std::vector<std::uint64_t> active;
    std::vector<cumulet_tile> tiles;
  };

  /// kept: owns the bricks and tiles that the descriptor refers to.
  cumulet_sparse_desc sparse(Sparse& kept) {
    auto desc = described<cumulet_sparse_desc>();
    const std::size_t bricks = data_.ConsumeIntegralInRange<std::size_t>(0, 3);
    auto& [origins, values, active, tiles] = kept;
    for (std::size_t i = 0; i < 3 * bricks; ++i) {
      origins.push_back(data_.ConsumeBool() ? 8 * data_.ConsumeIntegralInRange(-4, 4)
                                            : data_.ConsumeIntegral<std::int32_t>());
    }
    values.assign(512 * bricks, 0.5F);
    for (std::size_t i = 0; i < values.size(); i += 61) values[i] = bits<float>(static_cast<std::uint32_t>(number()));
    active.resize(8 * bricks);
    for (std::uint64_t& word : active) word = number();
    tiles.resize(data_.ConsumeIntegralInRange<std::size_t>(0, 3));
    for (cumulet_tile& tile : tiles) {
      for (int axis = 0; axis < 3; ++axis) {
        tile.min[axis] =
            data_.ConsumeBool() ? 8 * data_.ConsumeIntegralInRange(-4, 4) : data_.ConsumeIntegral<std::int32_t>();
        tile.max[axis] = data_.ConsumeBool() ? tile.min[axis] / 2 + data_.ConsumeIntegralInRange(0, 64)
                                             : data_.ConsumeIntegral<std::int32_t>();
      }
      tile.value = bits<float>(static_cast<std::uint32_t>(number()));
      tile.active = data_.ConsumeIntegralInRange(0, 2);
    }
    desc.brick_origins = origins.data();
    desc.brick_values = values.data();
    desc.brick_active = data_.ConsumeBool() ? active.data() : nullptr;
    desc.brick_count = bricks;
    desc.tiles = tiles.data();
    desc.tile_count = tiles.size();
    desc.name = nullptr;
    return desc;
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
    const std::size_t vertices = data_.ConsumeIntegralInRange<std::size_t>(0, 12);
    const auto floats = [&](std::size_t count) {
      std::vector<float> values(count);
      for (float& value : values) value = bits<float>(static_cast<std::uint32_t>(number()));
      return values;
    };
    const std::vector<float> positions = floats(3 * vertices);
    const std::vector<float> normals = floats(3 * vertices);
    const std::vector<float> colors = floats(4 * vertices);
    std::vector<std::uint32_t> indices(data_.ConsumeIntegralInRange<std::size_t>(0, 12));
    for (std::uint32_t& index : indices) index = data_.ConsumeIntegralInRange<std::uint32_t>(0, 13);
    mesh.positions = positions.data();
    mesh.normals = data_.ConsumeBool() ? normals.data() : nullptr;
    mesh.colors = data_.ConsumeBool() ? colors.data() : nullptr;
    mesh.velocities = data_.ConsumeBool() ? normals.data() : nullptr;
    mesh.vertex_count = vertices;
    mesh.indices = indices.data();
    mesh.index_count = indices.size();
    auto desc = described<cumulet_triangles_desc>();
    desc.meshes = &mesh;
    desc.mesh_count = data_.ConsumeBool() ? 1 : 0;
    desc.name = nullptr;
    cumulet_surfaces* surfaces = nullptr;
    made([&](char* error, std::size_t size) { return cumulet_surfaces_from_triangles(&desc, &surfaces, error, size); });
    if (surfaces != nullptr) surfaces_.reset(surfaces);
  }

  /// Writes a matrix, usually a valid transform; sometimes leaves it unchanged.
  void put_transform(double* to_world) {
    const int kind = data_.ConsumeIntegralInRange(0, 7);
    if (kind == 0) return;
    std::fill_n(to_world, 16, 0.0);
    if (kind == 1) return;
    for (int axis = 0; axis < 3; ++axis) {
      to_world[5 * axis] = data_.PickValueInArray({1.0, -1.0, 0.5, 2.0});
      to_world[12 + axis] = data_.ConsumeIntegralInRange(-20, 20);
    }
    to_world[1] = data_.PickValueInArray({0.0, 0.5, 1.0});
    to_world[15] = 1.0;
  }

  void set_transforms() {
    constexpr std::uint32_t most = 3;
    std::array<double, std::size_t{16} * most> transforms{};
    const auto all = [&] {
      for (std::size_t i = 0; i < most; ++i) put_transform(&transforms[16 * i]);
      return transforms;
    };
    const auto count = data_.ConsumeIntegralInRange(0U, most);
    check(cumulet_set_volume_transforms(viewer_.get(), all().data(), count));
    const auto open = all();
    const auto close = all();
    check(cumulet_set_volume_shutter_transforms(viewer_.get(), data_.ConsumeBool() ? open.data() : nullptr,
                                                data_.ConsumeBool() ? close.data() : nullptr,
                                                data_.ConsumeBool() ? count : most - count));
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
    desc[0].medium = data_.ConsumeBool() ? &medium : nullptr;
    if (medium.struct_size > sizeof medium) medium.struct_size = sizeof medium;
    switch (data_.ConsumeIntegralInRange(0, 4)) {
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
    switch (data_.ConsumeIntegralInRange(0, 6)) {
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

  /// A state of some fields, kept until it is no longer needed.
  struct State {
    std::array<std::vector<float>, 3> dense_values;
    std::array<Sparse, 3> sparse_values;
    std::array<cumulet_dense_desc, 3> dense{};
    std::array<cumulet_sparse_desc, 3> sparse{};
    std::array<cumulet_field, 3> fields{};
    cumulet_volume_fields_desc desc{};
  };

  std::unique_ptr<State> make_state() {
    auto state = std::make_unique<State>();
    state->desc = described<cumulet_volume_fields_desc>();
    const std::size_t count = data_.ConsumeIntegralInRange<std::size_t>(0, 3);
    for (std::size_t i = 0; i < count; ++i) {
      cumulet_field& field = state->fields[i];
      field.struct_size = sizeof field;
      field.channel = static_cast<cumulet_channel>(data_.ConsumeIntegralInRange(0, 10));
      const int kind = data_.ConsumeIntegralInRange(0, 7);
      // Usually one of the two.
      if (kind < 4 || kind == 7) {
        state->dense[i] = dense(state->dense_values[i]);
        field.dense = &state->dense[i];
      }
      if (kind >= 4 && kind < 7) {
        state->sparse[i] = sparse(state->sparse_values[i]);
        field.sparse = &state->sparse[i];
      }
      if (kind == 7) field.sparse = &state->sparse[i];
    }
    state->desc.fields = state->fields.data();
    state->desc.field_count = count;
    state->desc.name = data_.ConsumeBool() ? "a state\nof lines" : nullptr;
    state->desc.release = nullptr;
    state->desc.release_user = nullptr;
    return state;
  }

  void set_live() {
    auto state = make_state();
    if (data_.ConsumeBool()) {
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
    if (data_.ConsumeBool()) {
      for (cumulet_gl_field& field : fields) {
        field.struct_size = sizeof field;
        field.texture = data_.ConsumeBool() ? data_.ConsumeIntegralInRange<std::uint32_t>(0, 40) : 0;
        field.buffer = field.texture == 0 ? data_.ConsumeIntegralInRange<std::uint32_t>(0, 40) : 0;
        for (std::int32_t& side : field.size) side = data_.ConsumeIntegralInRange(-1, 20);
      }
    }
    std::array<cumulet_voxel_box, 2> boxes{};
    for (cumulet_voxel_box& box : boxes) {
      for (std::int32_t& at : box.min) at = data_.ConsumeIntegral<std::int32_t>();
      for (std::int32_t& at : box.max) at = data_.ConsumeIntegral<std::int32_t>();
    }
    auto desc = described<cumulet_gl_volume_desc>();
    desc.fields = fields.data();
    desc.field_count = data_.ConsumeIntegralInRange<std::uint64_t>(0, fields.size());
    desc.changed = data_.ConsumeBool() ? boxes.data() : nullptr;
    desc.changed_count = desc.changed != nullptr ? data_.ConsumeIntegralInRange<std::uint64_t>(0, boxes.size()) : 0;
    desc.wait = nullptr;
    desc.name = data_.ConsumeBool() ? "a state\nof lines" : nullptr;
    check(cumulet_dynamic_volume_set_gl(viewer_.get(), live_.get(), &desc));
  }

  void change_live() {
    switch (data_.ConsumeIntegralInRange(0, 10)) {
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
        return check(cumulet_set_dynamic_volume(viewer_.get(), data_.ConsumeBool() ? live_.get() : nullptr));
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
          return cumulet_dynamic_volume_create(data_.ConsumeBool() ? &desc : nullptr, &live, error, size);
        });
        if (live != nullptr) live_.reset(live);
      }
    }
  }

  /// A valid camera except for its lens, which sometimes is valid too.
  void focus() {
    cumulet_camera* raw = nullptr;
    check(cumulet_get_camera(viewer_.get(), &raw));
    const CameraRef camera(raw);
    auto desc = cumulet::test::make_desc<cumulet_camera_desc>();
    if (cumulet_camera_get(camera.get(), &desc) != CUMULET_OK) fail("a camera that cannot be read");
    const bool right = data_.ConsumeBool();
    desc.lens_radius = right ? data_.ConsumeFloatingPointInRange(0.0, 2.0) : bits<double>(number());
    desc.focus_distance = right ? data_.ConsumeFloatingPointInRange(0.0, 50.0) : bits<double>(number());
    if (cumulet_camera_set(camera.get(), &desc) != CUMULET_OK) {
      if (right) fail("a lens that is right is refused");
      return;
    }
    auto seen = cumulet::test::make_desc<cumulet_camera_desc>();
    if (cumulet_camera_get(camera.get(), &seen) != CUMULET_OK || seen.lens_radius != desc.lens_radius ||
        seen.focus_distance != desc.focus_distance)
      fail("a lens that is not what it was set to");
  }

  void change_sequence() {
    auto playback = described<cumulet_playback_desc>();
    std::uint32_t frame = 0;
    double seconds = 0.0;
    switch (data_.ConsumeIntegralInRange(0, 7)) {
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
        return check(cumulet_set_sequence(viewer_.get(), data_.ConsumeBool() ? sequence_.get() : nullptr));
      case 5: {
        std::array<cumulet_sequence_info, 2> info{};
        info[0] = described<cumulet_sequence_info>();
        std::array<std::uint8_t, 4> states{};
        return check(cumulet_get_sequence_info(viewer_.get(), info.data(), states.data(), states.size()));
      }
      case 6: {
        std::array<char, 64> cause{};
        check(cumulet_get_sequence_frame(viewer_.get(), data_.ConsumeIntegralInRange(0U, 4U), cause.data(),
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
        desc.count = data_.ConsumeIntegralInRange(0U, 3U);
        desc.file = data_.ConsumeBool() ? &file : nullptr;
        cumulet_sequence* sequence = nullptr;
        made([&](char* error, std::size_t size) { return cumulet_sequence_create(&desc, &sequence, error, size); });
        if (sequence != nullptr) sequence_.reset(sequence);
      }
    }
  }

  void make_environment() {
    auto desc = described<cumulet_environment_desc>();
    desc.width = data_.ConsumeIntegralInRange<std::uint32_t>(0, 9);
    desc.height = data_.ConsumeIntegralInRange<std::uint32_t>(0, 9);
    std::vector<float> values(std::size_t{3} * desc.width * desc.height);
    for (float& value : values) value = bits<float>(static_cast<std::uint32_t>(number()));
    desc.values = values.data();
    desc.value_count = values.size();
    desc.name = data_.ConsumeBool() ? "an environment\nof lines" : nullptr;
    cumulet_environment* environment = nullptr;
    made([&](char* error, std::size_t size) {
      return cumulet_environment_from_pixels(&desc, &environment, error, size);
    });
    if (environment != nullptr) environment_.reset(environment);
    std::array<float, 27> seen{};
    const auto side = [&] { return data_.ConsumeIntegralInRange<std::uint32_t>(0, 4); };
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

  cumulet_frame_desc small_frame() {
    auto frame = described<cumulet_frame_desc>();
    frame.budget_ms = data_.PickValueInArray({-1.0, 0.0, 2.0});
    frame.width = data_.ConsumeIntegralInRange<std::uint32_t>(0, 33);
    frame.height = data_.ConsumeIntegralInRange<std::uint32_t>(0, 33);
    if (data_.ConsumeBool()) std::memset(frame.viewport, 0, sizeof frame.viewport);
    return frame;
  }

  void warm_up() {
    const cumulet_frame_desc frame = small_frame();
    std::array<cumulet_warm_up_result, 2> result{};
    result[0] = described<cumulet_warm_up_result>();
    check(cumulet_warm_up(viewer_.get(), &frame, static_cast<cumulet_warm_up_scope>(data_.ConsumeIntegralInRange(0, 2)),
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
    switch (data_.ConsumeIntegralInRange(0, 9)) {
      case 9: {
        const auto name = [](void*, cumulet_object_kind kind, std::uint64_t, std::uint32_t) {
          return kind == CUMULET_OBJECT_GROUND ? nullptr : "object";
        };
        return check(cumulet_read_cryptomatte(viewer_.get(), name, nullptr, data_.ConsumeIntegralInRange(0U, 17U),
                                              values.data(), values.size()));
      }
      case 8:
        return check(cumulet_destroy_transmittance_map(viewer_.get(), data_.ConsumeIntegralInRange(0U, 17U)));
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
        return check(cumulet_read_aov(viewer_.get(), static_cast<cumulet_aov>(data_.ConsumeIntegralInRange(0, 10)),
                                      values.data(), values.size()));
      case 3:
        return check(cumulet_measure_noise(viewer_.get(), &noise));
      default:
        return check(cumulet_pick_at(viewer_.get(), bits<double>(number()), bits<double>(number()), pick.data()));
    }
  }

  void steer() {
    cumulet_camera* raw = nullptr;
    check(cumulet_get_camera(viewer_.get(), &raw));
    const CameraRef camera(raw);
    const double a = bits<double>(number());
    const double b = bits<double>(number());
    const double c = bits<double>(number());
    std::array<double, 16> view{};
    std::array<double, 16> projection{};
    for (double& value : view) value = bits<double>(number());
    for (double& value : projection) value = bits<double>(number());
    const auto desc = described<cumulet_camera_desc>();
    const auto clip = static_cast<cumulet_clip_space>(data_.ConsumeIntegralInRange(0, 1));
    switch (data_.ConsumeIntegralInRange(0, 10)) {
      case 0:
        cumulet_camera_orbit(camera.get(), a, b);
        break;
      case 1:
        cumulet_camera_look(camera.get(), a, b);
        break;
      case 2:
        cumulet_camera_roll(camera.get(), a);
        break;
      case 3:
        cumulet_camera_pan(camera.get(), a, b);
        break;
      case 4:
        cumulet_camera_dolly(camera.get(), a);
        break;
      case 5:
        cumulet_camera_fly(camera.get(), a, b, c);
        break;
      case 6:
        cumulet_camera_set(camera.get(), &desc);
        break;
      case 7:
        cumulet_camera_set_matrices(camera.get(), view.data(), projection.data(), clip);
        break;
      case 8:
        cumulet_camera_get_matrices(camera.get(), a, clip, view.data(), projection.data());
        break;
      case 9:
        cumulet_camera_set_shutter(camera.get(), clip == CUMULET_CLIP_ZERO_TO_ONE ? &desc : nullptr, &desc);
        break;
      default:
        cumulet_camera_frame(camera.get(), view.data(), projection.data(), a);
        break;
    }
    // In any state, it can be read and set again.
    auto told_desc = cumulet::test::make_desc<cumulet_camera_desc>();
    if (cumulet_camera_get(camera.get(), &told_desc) != CUMULET_OK) fail("a camera that cannot be read");
    for (const double value : told_desc.eye) {
      if (value != value) fail("a camera at NaN");
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
    switch (data_.ConsumeIntegralInRange(0, 5)) {
      case 0:
        return get<cumulet_stats>(cumulet_get_stats);
      case 1:
        return look_at_progress();
      case 2:
        return check(cumulet_get_bounds(viewer_.get(), low, high));
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

  void call() {
    cumulet_viewer* viewer = viewer_.get();
    switch (data_.ConsumeIntegralInRange(0, 37)) {
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
        return steer();
      case 17:
        return ask();
      case 18:
        return check(cumulet_wait(viewer, data_.ConsumeIntegralInRange(0, 20)));
      case 19:
        return cumulet_cancel(viewer);
      case 20:
        return check(cumulet_rebuild(viewer));
      case 21:
        return warm_up();
      case 22:
        return check(cumulet_use_surface_camera(viewer, data_.ConsumeIntegralInRange(0U, 2U)));
      case 23: {
        std::array<float, 8> points{};
        for (float& one : points) one = data_.ConsumeFloatingPoint<float>();
        const auto which = static_cast<cumulet_ramp>(data_.ConsumeIntegralInRange(0U, 3U));
        return check(cumulet_set_ramp(viewer, which, points.data(), data_.ConsumeIntegralInRange(0U, 4U)));
      }
      case 24:
        return make_environment();
      case 25:
        return check(cumulet_set_environment(viewer, environment_.get()));
      case 26:
        return check(cumulet_load_environment(viewer, data_.ConsumeBool() ? "/dev/null" : "/dev/null/nowhere.exr"));
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
        return focus();
      case 36:
        return set_transforms();
      default:
        check(cumulet_detach(viewer));
        if (draws_ && data_.ConsumeBool()) check(cumulet_attach(viewer, Context::get_proc, &context()));
    }
  }

  FuzzedDataProvider data_;
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
