// Simulates a host's days repeatedly: viewers are created and destroyed, load, change settings, orbit, resize, save.
// The library's memory must not grow. Usage: soak [SECONDS].
//
// Days are of a few kinds. Each kind always does the same work by its own random numbers, so that memory after an early
// day can be compared with memory after a late day of the same kind. One viewer persists, and ends each day with the
// same image.

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/fake_gl.hpp"
#include "support/folder.hpp"
#include "support/gltf_seeds.hpp"
#include "support/openvdb.hpp"
#include "unit/support/c_host.hpp"

namespace {

using namespace cumulet::test;
using cumulet::headless::Backend;
using cumulet::headless::Context;

constexpr unsigned kinds = 6;
constexpr unsigned min_days = 6 * kinds;

unsigned failures = 0;
void expect(bool holds, const std::string& what) {
  if (holds) return;
  std::printf("FAILED: %s\n", what.c_str());
  ++failures;
}

/// Resident memory without free memory that malloc keeps.
double resident_megabytes() {
  malloc_trim(0);
  std::ifstream statm("/proc/self/statm");
  double pages = 0.0;
  statm >> pages >> pages;
  return pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1048576.0;
}

void write_volume(const std::string& path, float radius) {
  auto grid = openvdb::FloatGrid::create();
  grid->setName("density");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  auto access = grid->getAccessor();
  const int reach = static_cast<int>(radius);
  for (int z = -reach; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const float r = std::sqrt(static_cast<float>(x * x + y * y + z * z)) / radius;
        if (r < 1.0F) access.setValue({x, y, z}, 1.0F - r);
      }
    }
  }
  openvdb::io::File(path).write({grid});
}

/// Files for loading.
struct Files {
  Folder folder;
  std::string small = (folder.path() / "small.vdb").string();
  std::string large = (folder.path() / "large.vdb").string();
  std::string model = (folder.path() / "model.glb").string();
  Files() {
    openvdb::initialize();
    write_volume(small, 9.0F);
    write_volume(large, 24.0F);
    const Bytes bytes = seed_animated().glb();
    std::ofstream(model, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
};

struct Held {
  std::size_t objects = 0;  ///< GL objects without programs, because each new variant adds programs
  std::uint64_t bytes = 0;  ///< GL bytes, as reported by the persistent viewer
  double resident = 0.0;
};

class Host {
 public:
  explicit Host(const Files& files) : files_(files) {
    auto desc = make_desc<cumulet_shader_cache_desc>();
    cumulet_shader_cache* programs = nullptr;
    std::array<char, 256> error{};
    if (cumulet_shader_cache_create(&desc, &programs, error.data(), error.size()) != CUMULET_OK)
      throw std::runtime_error(error.data());
    programs_.reset(programs);
    stays_ = viewer(programs_.get());
  }

  Held day(unsigned kind) {
    std::mt19937 random(kind);
    const std::size_t before = objects();
    {
      // One kind has programs of its own, which are destroyed with its viewer.
      const ViewerPtr guest = viewer(kind == 0 ? nullptr : programs_.get());
      for (int step = 0; step < 12; ++step) act(guest.get(), random);
    }
    expect(objects() == before,
           std::to_string(objects()) + " objects of GL after a viewer, " + std::to_string(before) + " before it");
    for (int step = 0; step < 4; ++step) act(stays_.get(), random);
    return rest();
  }

  /// Destroys everything.
  void end() {
    stays_.reset();
    programs_.reset();
    for (const auto& [kind, count] : fake_.alive())
      expect(false, std::to_string(count) + " of " + kind + " are left at the end");
    expect(fake_.wrong_deletes() == 0 && FakeGl::strays() == 0, "objects of others were deleted");
  }

 private:
  [[nodiscard]] std::size_t objects() const {
    std::size_t count = 0;
    for (const auto& [kind, alive] : fake_.alive()) count += kind == "Program" ? 0 : alive;
    return count;
  }

  [[nodiscard]] ViewerPtr viewer(cumulet_shader_cache* programs) {
    auto desc = make_desc<cumulet_create_desc>();
    desc.get_proc = FakeGl::get_proc;
    desc.get_proc_user = &fake_;
    desc.shader_cache = programs;
    return make_plain_viewer(desc);
  }

  static void ok(cumulet_viewer* viewer, cumulet_status status) {
    if (status != CUMULET_OK) throw std::runtime_error(cumulet_last_error(viewer));
  }
  template <class Desc, class Set, class Change>
  static void set(cumulet_viewer* viewer, Set setter, Change change) {
    auto desc = make_desc<Desc>();
    change(desc);
    ok(viewer, setter(viewer, &desc));
  }

  void frames(cumulet_viewer* viewer, int count) {
    auto frame = make_desc<cumulet_frame_desc>();
    frame.budget_ms = 15.0;
    frame.target = CUMULET_TARGET_TEXTURE;
    frame.width = size_[0];
    frame.height = size_[1];
    for (int i = 0; i < count; ++i) ok(viewer, cumulet_render(viewer, &frame, nullptr));
  }

  /// A random action of a host, and a few frames after it.
  void act(cumulet_viewer* viewer, std::mt19937& random) {
    const auto one_of = [&](unsigned count) { return static_cast<unsigned>(random() % count); };
    switch (one_of(16)) {
      case 0:
      case 1:
        ok(viewer, cumulet_load_volume(viewer, (one_of(2) == 0 ? files_.small : files_.large).c_str(), nullptr));
        if (one_of(4) == 0) cumulet_cancel(viewer);
        break;
      case 2:
        ok(viewer, cumulet_set_volume(viewer, make_ball(static_cast<int>(12 + one_of(20))).get()));
        break;
      case 3:
        ok(viewer, cumulet_load_surfaces(viewer, files_.model.c_str()));
        break;
      case 4:
        ok(viewer, cumulet_set_surfaces(viewer, one_of(3) == 0 ? nullptr : make_panes(6.0F).get()));
        break;
      case 5:
        ok(viewer, cumulet_set_environment(viewer, one_of(3) == 0 ? nullptr : make_environment(64, 32).get()));
        break;
      case 6:
        size_ = {32 + 48 * one_of(4), 24 + 40 * one_of(4)};
        break;
      case 7:
      case 8:
        orbit(viewer, 0.1 * one_of(20));
        break;
      case 9:
        set<cumulet_medium_desc>(viewer, cumulet_set_medium, [&](auto& desc) { desc.density_scale = 0.5 + one_of(4); });
        break;
      case 10:
        set<cumulet_grid_desc>(viewer, cumulet_set_grid, [&](auto& desc) {
          desc.type = static_cast<cumulet_grid_type>(one_of(3));
          desc.threshold = 0.05 * (1 + one_of(4));
        });
        break;
      case 11:
        set<cumulet_display_desc>(viewer, cumulet_set_display,
                                  [&](auto& desc) { desc.denoise = static_cast<cumulet_denoise>(one_of(2)); });
        break;
      case 12:
        set<cumulet_sampling_desc>(viewer, cumulet_set_sampling, [&](auto& desc) {
          desc.samples = 4;
          desc.view = static_cast<cumulet_view_mode>(one_of(3) == 0 ? one_of(5) : 0);
        });
        break;
      case 13:
        analytic_lights(viewer, one_of(3));
        break;
      case 14:
        save(viewer);
        break;
      default:
        ok(viewer, cumulet_detach(viewer));
        ok(viewer, cumulet_attach(viewer, FakeGl::get_proc, &fake_));
    }
    if (one_of(2) == 0) wait(viewer);
    frames(viewer, 1 + static_cast<int>(one_of(5)));
  }

  /// Cancelled work may return CUMULET_ERROR_CANCELLED.
  static void wait(cumulet_viewer* viewer) {
    const cumulet_status status = cumulet_wait(viewer, -1.0);
    if (status != CUMULET_ERROR_CANCELLED) ok(viewer, status);
  }

  static void orbit(cumulet_viewer* viewer, double angle) {
    cumulet_camera* raw = nullptr;
    ok(viewer, cumulet_get_camera(viewer, &raw));
    const CameraRef camera(raw);
    if (cumulet_camera_orbit(raw, angle, 0.05) != CUMULET_OK) throw std::runtime_error("no orbit");
  }

  static void analytic_lights(cumulet_viewer* viewer, unsigned count) {
    std::vector<cumulet_light_desc> analytic_lights(count, make_desc<cumulet_light_desc>());
    for (cumulet_light_desc& analytic_light : analytic_lights) {
      analytic_light.position[1] = 20.0;
      analytic_light.power = 1000.0F;
    }
    ok(viewer, cumulet_set_lights(viewer, analytic_lights.data(), analytic_lights.size()));
  }

  /// If there is an image: saves its samples, restores them, and saves a file.
  static void save(cumulet_viewer* viewer) {
    std::size_t size = 0;
    if (cumulet_read_accumulation(viewer, nullptr, &size) != CUMULET_OK) return;
    std::vector<std::uint8_t> bytes(size);
    ok(viewer, cumulet_read_accumulation(viewer, bytes.data(), &size));
    ok(viewer, cumulet_restore_accumulation(viewer, bytes.data(), size));
  }

  /// The persistent viewer shows the same scene as at the end of every day.
  Held rest() {
    cumulet_viewer* viewer = stays_.get();
    size_ = {64, 48};
    ok(viewer, cumulet_set_surfaces(viewer, nullptr));
    ok(viewer, cumulet_set_environment(viewer, nullptr));
    ok(viewer, cumulet_set_volume(viewer, make_ball(20).get()));
    analytic_lights(viewer, 0);
    set<cumulet_medium_desc>(viewer, cumulet_set_medium, [](auto&) {});
    set<cumulet_grid_desc>(viewer, cumulet_set_grid, [](auto&) {});
    set<cumulet_display_desc>(viewer, cumulet_set_display, [](auto&) {});
    set<cumulet_sampling_desc>(viewer, cumulet_set_sampling, [](auto& desc) { desc.samples = 4; });
    auto stand = make_desc<cumulet_camera_desc>();
    stand.eye[2] = 40.0;
    cumulet_camera* camera = nullptr;
    if (cumulet_camera_create(&stand, &camera) != CUMULET_OK) throw std::runtime_error("no camera");
    const CameraRef owner(camera);
    ok(viewer, cumulet_set_camera(viewer, camera));
    auto frame = make_desc<cumulet_frame_desc>();
    frame.budget_ms = 50.0;
    frame.target = CUMULET_TARGET_TEXTURE;
    frame.width = size_[0];
    frame.height = size_[1];
    wait(viewer);
    auto result = make_desc<cumulet_frame_result>();
    const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(2);
    while ((result.flags & CUMULET_RENDER_CONVERGED) == 0) {
      ok(viewer, cumulet_render(viewer, &frame, &result));
      if (std::chrono::steady_clock::now() > until) throw std::runtime_error("does not converge");
    }
    auto stats = make_desc<cumulet_stats>();
    ok(viewer, cumulet_get_stats(viewer, &stats));
    return {objects(), stats.gl_bytes, resident_megabytes()};
  }

  const Files& files_;
  Context context_ = Context::create(Backend::automatic);
  FakeGl fake_{Context::get_proc, &context_};
  ProgramsRef programs_;
  ViewerPtr stays_;
  std::array<std::uint32_t, 2> size_{64, 48};
};

/// The minimum over these days: a leak is in each of them, memory kept for reuse is not.
double least(const std::vector<Held>& days, std::size_t from, std::size_t to, double (*what)(const Held&)) {
  double result = what(days.at(from));
  for (std::size_t i = from; i < to; ++i) result = std::min(result, what(days.at(i)));
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 180.0;
  const Files files;
  const auto begun = std::chrono::steady_clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count(); };
  try {
    Host host(files);
    std::vector<Held> days;
    while (days.size() < min_days || elapsed() < seconds) {
      days.push_back(host.day(static_cast<unsigned>(days.size()) % kinds));
      const Held& held = days.back();
      if (days.size() % kinds == 0)
        std::printf("%5.0f s, day %zu: %zu objects, %.2f MB of GL, %.0f MB resident\n", elapsed(), days.size(),
                    held.objects, static_cast<double>(held.bytes) / 1048576.0, held.resident);
      std::fflush(stdout);
    }
    host.end();
    // One-time allocations are complete before the middle third.
    const std::size_t third = days.size() / 3;
    const std::size_t last = days.size() - third;
    const auto compare = [&](const char* name, double slack, double (*what)(const Held&)) {
      const double middle = least(days, third, last, what);
      const double end = least(days, last, days.size(), what);
      std::printf("%s: at least %.1f in the middle third, %.1f in the last\n", name, middle, end);
      expect(end <= middle + slack, std::string(name) + " grow");
    };
    compare("objects of GL", 0.0, [](const Held& held) { return static_cast<double>(held.objects); });
    compare("megabytes of GL", 1.0, [](const Held& held) { return static_cast<double>(held.bytes) / 1048576.0; });
    compare("resident megabytes", 16.0, [](const Held& held) { return held.resident; });
  } catch (const std::exception& error) {
    expect(false, error.what());
  }
  return failures == 0 ? 0 : 1;
}
