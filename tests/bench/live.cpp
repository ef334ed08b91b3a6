// Measures the time from the submission of a live state to its image, by stage. The state is a plume in a dense array
// with SIDE voxels per side, copied or held, as bricks, as a tenth of its bricks, or as textures. Textures are passed
// directly, or read back by the host through a pixel buffer and held. An image counts when a frame draws it, possibly
// coarse because of the budget. Fire has a temperature in addition to density; colored and moving states have color and
// velocity. Run by hand:
//
//     cumulet-bench-live [SIDE [STATES]]...
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "c_viewer.hpp"
#include "support/simulated.hpp"

namespace {

using cumulet::bench::must;
using cumulet::headless::Context;
using cumulet::test::make_desc;
using cumulet::test::Sides;
using cumulet::test::State;
using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  return 1e3 * std::chrono::duration<double>(Clock::now() - start).count();
}

// A column that widens and winds, with lumps of a few voxels: about a sixth of the box.
std::vector<float> plume(int side, int step) {
  std::vector<float> values(static_cast<std::size_t>(side) * static_cast<std::size_t>(side) *
                            static_cast<std::size_t>(side));
  const auto slices = [&](int first, int last) {
    for (int z = first; z < last; ++z) {
      for (int y = 0; y < side; ++y) {
        const float height = static_cast<float>(y) / static_cast<float>(side);
        const float turn = 7.0F * height - 0.15F * static_cast<float>(step);
        const float middle = 0.5F * static_cast<float>(side);
        const float x0 = middle + 0.12F * static_cast<float>(side) * std::sin(turn);
        const float z0 = middle + 0.12F * static_cast<float>(side) * std::cos(turn);
        const float radius = static_cast<float>(side) * (0.08F + 0.22F * height);
        for (int x = 0; x < side; ++x) {
          const float dx = static_cast<float>(x) - x0;
          const float dz = static_cast<float>(z) - z0;
          const float in = 1.0F - (dx * dx + dz * dz) / (radius * radius);
          if (in <= 0.0F) continue;
          const float lumps = std::sin(0.31F * static_cast<float>(x)) *
                              std::sin(0.27F * static_cast<float>(y) - static_cast<float>(step)) *
                              std::sin(0.23F * static_cast<float>(z));
          values[State::at({x, y, z}, {side, side, side})] = std::max(0.0F, in * (0.5F + 0.5F * lumps));
        }
      }
    }
  };
  std::thread half(slices, 0, side / 2);
  slices(side / 2, side);
  half.join();
  return values;
}

struct Spent {
  double copy = 0.0, read = 0.0, statistics = 0.0, refine = 0.0, records = 0.0, upload = 0.0, rest = 0.0, all = 0.0;
};

// The minimum, because a busy machine only increases times.
double least(const std::vector<Spent>& spent, double Spent::*part) {
  return (*std::ranges::min_element(spent, {}, part)).*part;
}

// A simulation's texture, the states that it alternates between, and a pixel buffer of the host.
class Textures {
 public:
  Textures(const GladGLContext& gl, int side, GLenum format, const std::vector<float> (&values)[2])
      : gl_(gl), side_(side) {
    gl_.CreateTextures(GL_TEXTURE_3D, 3, names_);
    for (const GLuint name : names_) gl_.TextureStorage3D(name, 1, format, side, side, side);
    for (int i = 0; i < 2; ++i)
      gl_.TextureSubImage3D(names_[1 + i], 0, 0, 0, 0, side, side, side, GL_RED, GL_FLOAT, values[i].data());
    constexpr GLbitfield mapped = GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    const auto bytes = static_cast<GLsizeiptr>(values[0].size() * sizeof(float));
    gl_.CreateBuffers(1, &buffer_);
    gl_.NamedBufferStorage(buffer_, bytes, nullptr, mapped | GL_CLIENT_STORAGE_BIT);
    read_ = static_cast<const float*>(gl_.MapNamedBufferRange(buffer_, 0, bytes, mapped));
  }
  Textures(const Textures&) = delete;
  Textures& operator=(const Textures&) = delete;
  ~Textures() {
    gl_.DeleteTextures(3, names_);
    gl_.DeleteBuffers(1, &buffer_);
  }
  void step(int i) const {
    gl_.CopyImageSubData(names_[1 + i % 2], GL_TEXTURE_3D, 0, 0, 0, 0, names_[0], GL_TEXTURE_3D, 0, 0, 0, 0, side_,
                         side_, side_);
  }
  [[nodiscard]] GLsync read_back() const {
    gl_.BindBuffer(GL_PIXEL_PACK_BUFFER, buffer_);
    gl_.GetTextureImage(names_[0], 0, GL_RED, GL_FLOAT, 4 * side_ * side_ * side_, nullptr);
    gl_.BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    const GLsync read = gl_.FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl_.Flush();
    return read;
  }
  void describe(cumulet_dense_desc& dense) const {
    dense.values = read_;
    dense.value_count = static_cast<std::uint64_t>(side_) * static_cast<std::uint64_t>(side_ * side_);
    for (int& s : dense.size) s = side_;
    std::ranges::copy(cumulet::test::simulated_transform({side_, side_, side_}), dense.index_to_world);
  }
  [[nodiscard]] cumulet_gl_field field(cumulet_channel channel) const {
    auto field = make_desc<cumulet_gl_field>();
    field.channel = channel;
    field.texture = names_[0];
    std::ranges::copy(cumulet::test::simulated_transform({side_, side_, side_}), field.index_to_world);
    return field;
  }
  // A tenth of the volume, around the middle of its height.
  [[nodiscard]] cumulet_voxel_box tenth() const {
    return {{0, side_ / 2 - side_ / 20, 0}, {side_ - 1, side_ / 2 + side_ / 20, side_ - 1}};
  }

 private:
  const GladGLContext& gl_;
  int side_;
  GLuint names_[3]{};
  GLuint buffer_ = 0;
  const float* read_ = nullptr;
};

class Bench {
 public:
  explicit Bench(double density_scale, cumulet_build_device build = CUMULET_BUILD_CPU, bool gpu_resident = false)
      : gl_(cumulet::test::load_gl(Context::get_proc, &context_)), target_(gl_, 640, 360) {
    viewer_ = cumulet::bench::make_viewer(context_);
    auto medium = make_desc<cumulet_medium_desc>();
    medium.density_scale = density_scale;
    medium.blackbody = 1.0F;
    must(viewer_.get(), cumulet_set_medium(viewer_.get(), &medium));
    auto sampling = make_desc<cumulet_sampling_desc>();
    sampling.samples = 1;  // so that no other work is pending when the next state arrives
    must(viewer_.get(), cumulet_set_sampling(viewer_.get(), &sampling));
    auto grid = make_desc<cumulet_grid_desc>();
    grid.build_device = build;
    grid.interpolation = CUMULET_INTERPOLATION_NEAREST;  // as in older results
    must(viewer_.get(), cumulet_set_grid(viewer_.get(), &grid));
    auto desc = make_desc<cumulet_dynamic_volume_desc>();
    desc.gpu_resident = gpu_resident ? 1 : 0;
    for (double& x : desc.bounds_min) x = -8.0;
    for (double& x : desc.bounds_max) x = 8.0;
    live_ = cumulet::test::make_live(desc);
    must(viewer_.get(), cumulet_set_dynamic_volume(viewer_.get(), live_.get()));
    frame_ = target_.frame();
    frame_.budget_ms = 16.0;
  }

  void warm_up(const State& state) {
    hand_over(state, cumulet_dynamic_volume_set, false);
    must(viewer_.get(), cumulet_wait(viewer_.get(), -1.0));
    auto result = make_desc<cumulet_warm_up_result>();
    do must(viewer_.get(), cumulet_warm_up(viewer_.get(), &frame_, CUMULET_WARM_UP_SCENE, &result));
    while (result.incomplete != 0);
    settle();
  }

  Spent show(const State& state, decltype(cumulet_dynamic_volume_set)* how, bool held) {
    return show([&] { hand_over(state, how, held); });
  }
  // hand_over: submits a state, or starts to; meanwhile: work of the host between frames.
  Spent show(
      const std::function<void()>& hand_over, const std::function<void()>& meanwhile = [] {}) {
    auto before = make_desc<cumulet_dynamic_volume_info>();
    must(viewer_.get(), cumulet_get_dynamic_volume_info(viewer_.get(), &before));
    const auto begun = Clock::now();
    hand_over();
    Spent spent;
    spent.copy = milliseconds_since(begun);
    auto info = make_desc<cumulet_dynamic_volume_info>();
    for (;;) {
      meanwhile();
      must(viewer_.get(), cumulet_render(viewer_.get(), &frame_, nullptr));
      must(viewer_.get(), cumulet_get_dynamic_volume_info(viewer_.get(), &info));
      if (info.submitted_update > before.submitted_update && info.displayed_update == info.submitted_update) break;
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
    spent.all = milliseconds_since(begun);
    auto stats = make_desc<cumulet_stats>();
    must(viewer_.get(), cumulet_get_stats(viewer_.get(), &stats));
    spent.read = 1e3 * stats.build_seconds_load;
    spent.statistics = 1e3 * stats.build_seconds_statistics;
    spent.refine = 1e3 * stats.build_seconds_refine;
    spent.records = 1e3 * stats.build_seconds_packing;
    spent.upload = 1e3 * stats.build_seconds_upload;
    spent.rest = spent.all - spent.copy - spent.read - spent.statistics - spent.refine - spent.records - spent.upload;
    cells_ = stats.cells;
    settle();
    return spent;
  }
  [[nodiscard]] std::uint64_t cells() const { return cells_; }

  // Submits a texture after copying voxels into it on the GPU, as a simulation step would. channels: all channels of
  // the state.
  Spent show(const Textures& textures, int i, bool changed,
             const std::vector<cumulet_channel>& channels = {CUMULET_CHANNEL_DENSITY}) {
    textures.step(i);
    return show([&] {
      std::vector<cumulet_gl_field> fields;
      for (const cumulet_channel channel : channels) fields.push_back(textures.field(channel));
      auto desc = make_desc<cumulet_gl_volume_desc>();
      desc.fields = fields.data();
      desc.field_count = fields.size();
      const cumulet_voxel_box box = textures.tenth();
      if (changed) {
        desc.changed = &box;
        desc.changed_count = 1;
      }
      must(viewer_.get(), cumulet_dynamic_volume_set_gl(viewer_.get(), live_.get(), &desc));
    });
  }
  // A host that reads back the texture itself without waiting.
  Spent show_read_back(const Textures& textures, int i) {
    textures.step(i);
    GLsync read = nullptr;
    const auto begin = [&] { read = textures.read_back(); };
    const auto look = [&] {
      if (read == nullptr || gl_.ClientWaitSync(read, 0, 0) == GL_TIMEOUT_EXPIRED) return;
      gl_.DeleteSync(std::exchange(read, nullptr));
      auto dense = make_desc<cumulet_dense_desc>();
      textures.describe(dense);
      auto field = make_desc<cumulet_field>();
      field.dense = &dense;
      auto desc = make_desc<cumulet_volume_fields_desc>();
      desc.fields = &field;
      desc.field_count = 1;
      desc.release = [](void*) {};
      char error[256];
      if (cumulet_dynamic_volume_set(live_.get(), &desc, error, sizeof error) != CUMULET_OK)
        throw std::runtime_error(error);
    };
    return show(begin, look);
  }
  [[nodiscard]] const GladGLContext& gl() const { return gl_; }

 private:
  void hand_over(const State& state, decltype(cumulet_dynamic_volume_set)* how, bool held) {
    auto desc = state.desc("plume");
    if (held) desc.release = [](void*) {};
    char error[256];
    if (how(live_.get(), &desc, error, sizeof error) != CUMULET_OK) throw std::runtime_error(error);
  }
  void settle() {
    auto result = make_desc<cumulet_frame_result>();
    do must(viewer_.get(), cumulet_render(viewer_.get(), &frame_, &result));
    while ((result.flags & CUMULET_RENDER_CONVERGED) == 0);
  }

  Context context_ = Context::create(cumulet::headless::Backend::automatic);
  GladGLContext gl_;
  cumulet::test::HostTarget target_;
  cumulet_frame_desc frame_{};
  cumulet::test::ViewerPtr viewer_;
  cumulet::test::LiveRef live_;
  std::uint64_t cells_ = 0;
};

void measure(int side, int count) {
  const Sides size{side, side, side};
  const std::vector<float> values[] = {plume(side, 0), plume(side, 1)};
  const auto sparse = [&](const std::vector<float>& of, const std::vector<Sides>& bricks) {
    return std::move(State().sparse(CUMULET_CHANNEL_DENSITY, size, of, bricks));
  };
  const auto dense = [&](int i) { return std::move(State().dense(CUMULET_CHANNEL_DENSITY, size, values[i])); };
  Bench bench(3.0);
  const auto rows_of = [&](const Bench& with, const char* what, const std::function<Spent(int)>& show) {
    std::vector<Spent> spent;
    for (int i = 0; i < count; ++i) spent.push_back(show(i));
    std::printf("| %d^3 | %s | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | %llu |\n", side, what,
                least(spent, &Spent::copy), least(spent, &Spent::read), least(spent, &Spent::statistics),
                least(spent, &Spent::refine), least(spent, &Spent::records), least(spent, &Spent::upload),
                least(spent, &Spent::rest), least(spent, &Spent::all), static_cast<unsigned long long>(with.cells()));
    std::fflush(stdout);
  };
  const auto rows = [&](const char* what, const std::function<Spent(int)>& show) { rows_of(bench, what, show); };
  const auto row = [&](const char* what, const State(&states)[2], decltype(cumulet_dynamic_volume_set)* how,
                       bool held) { rows(what, [&](int i) { return bench.show(states[i % 2], how, held); }); };
  {
    const State states[] = {dense(0), dense(1)};
    bench.warm_up(states[0]);
    row("dense, copied", states, cumulet_dynamic_volume_set, false);
    row("dense, held", states, cumulet_dynamic_volume_set, true);
  }
  const auto bricks = [&](int i) { return State::bricks(size, values[i]); };
  const State states[] = {sparse(values[0], bricks(0)), sparse(values[1], bricks(1))};
  row("bricks", states, cumulet_dynamic_volume_set, false);
  // Bricks around the middle of the height.
  std::vector<Sides> tenth = bricks(0);
  std::erase_if(tenth, [&](const Sides& origin) { return std::abs(origin[1] - side / 2) > side / 20; });
  const State parts[] = {sparse(values[1], tenth), sparse(values[0], tenth)};
  row("a tenth of the bricks", parts, cumulet_dynamic_volume_update, false);
  const Textures floats(bench.gl(), side, GL_R32F, values);
  rows("in GL, R32F, read back by the host", [&](int i) { return bench.show_read_back(floats, i); });
  rows("in GL, R32F", [&](int i) { return bench.show(floats, i, false); });
  const Textures halves(bench.gl(), side, GL_R16F, values);
  rows("in GL, R16F", [&](int i) { return bench.show(halves, i, false); });
  rows("in GL, R16F, a tenth of it", [&](int i) { return bench.show(halves, i, true); });
  for (const bool stays : {false, true}) {
    Bench built_there(3.0, CUMULET_BUILD_GPU, stays);
    built_there.warm_up(states[0]);
    const Textures there(built_there.gl(), side, GL_R16F, values);
    const auto name = [&](const char* what) { return std::string(what) + (stays ? ", stays there" : ", built there"); };
    const std::pair<const char*, std::vector<cumulet_channel>> kinds[] = {
        {"in GL, R16F", {CUMULET_CHANNEL_DENSITY}},
        {"fire in GL, R16F", {CUMULET_CHANNEL_DENSITY, CUMULET_CHANNEL_TEMPERATURE}},
        {"coloured and moving in GL, R16F",
         {CUMULET_CHANNEL_DENSITY, CUMULET_CHANNEL_RED, CUMULET_CHANNEL_GREEN, CUMULET_CHANNEL_BLUE,
          CUMULET_CHANNEL_VELOCITY_X, CUMULET_CHANNEL_VELOCITY_Y, CUMULET_CHANNEL_VELOCITY_Z}}};
    for (const auto& [what, channels] : kinds) {
      try {
        built_there.show(there, 0, false, channels);  // the emission is requested first
        rows_of(built_there, name(what).c_str(), [&](int i) { return built_there.show(there, i, false, channels); });
        rows_of(built_there, name((std::string(what) + ", a tenth of it").c_str()).c_str(),
                [&](int i) { return built_there.show(there, i, true, channels); });
      } catch (const std::exception& error) {
        std::fprintf(stderr, "%s: %s\n", name(what).c_str(), error.what());  // beyond a driver's limits
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    std::printf(
        "| voxels | handed over | copy | reading | statistics | refinement | cells | upload | samples, waiting | all | "
        "cells |\n|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    if (argc < 2) {
      for (const int side : {64, 128, 256}) measure(side, 9);
      measure(512, 3);
    }
    for (int i = 1; i < argc; i += 2) measure(std::atoi(argv[i]), i + 1 < argc ? std::atoi(argv[i + 1]) : 9);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cumulet-bench-live: %s\n", error.what());
    return 1;
  }
}
