// Measures the cost of many instances of one cloud: creating and building, uploading, tracing, and moving one of them.
// The instances form a layer of constant density, each rotated and scaled differently; some overlap. The camera at the
// layer's edge sees all of it. Then it sees one cloud, with the rest behind it. Run by hand:
//
//     cumulet-bench-instances CLOUD.vdb OUT_FOLDER [COUNT]...
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <image.hpp>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "c_viewer.hpp"

namespace {

using cumulet::bench::must;
using cumulet::headless::Context;
using cumulet::test::make_desc;
using Transform = std::array<double, 16>;

constexpr std::uint32_t width = 240;
constexpr std::uint32_t height = 135;
constexpr std::uint32_t samples = 2;

/// CPU time of all threads of the process, including the driver's shader threads. It depends little on the machine's
/// load.
double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }
double milliseconds_since(double start) { return 1e3 * (processor_seconds() - start); }

void check(cumulet_status status, const char* cause) {
  if (status != CUMULET_OK) throw std::runtime_error(*cause != '\0' ? cause : cumulet_status_text(status));
}

/// Transforms for a cloud of width `size`: a square from the origin away from the camera, towards -Z.
std::vector<Transform> layer(int count, double size) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> part(-1.0, 1.0);
  const int side = static_cast<int>(std::ceil(std::sqrt(count)));
  std::vector<Transform> transforms;
  for (int i = 0; i < count; ++i) {
    // The nearest first, from the center to the sides.
    const int row = i / side;
    const int column = i % side;
    const int beside = (column % 2 == 0 ? 1 : -1) * ((column + 1) / 2);
    const double angle = std::numbers::pi * part(random);
    const double scale = std::exp(0.4 * part(random));
    const double c = scale * std::cos(angle);
    const double s = scale * std::sin(angle);
    const double flat = scale * (0.8 + 0.2 * part(random));
    constexpr double spacing = 1.3;
    constexpr double jitter = 0.45;
    transforms.push_back({c, 0.0, -s, 0.0, 0.0, flat, 0.0, 0.0, s, 0.0, c, 0.0,
                          size * (spacing * beside + jitter * part(random)), size * 0.15 * part(random),
                          size * (-spacing * row + jitter * part(random)), 1.0});
  }
  return transforms;
}

class Bench {
 public:
  explicit Bench(const char* path) {
    auto desc = make_desc<cumulet_shader_cache_desc>();
    cumulet_shader_cache* programs = nullptr;
    std::array<char, 256> error{};
    check(cumulet_shader_cache_create(&desc, &programs, error.data(), error.size()), error.data());
    programs_.reset(programs);
    auto file = make_desc<cumulet_volume_file_desc>();
    file.path = path;
    cumulet_volume* volume = nullptr;
    check(cumulet_volume_open_file(&file, &volume, error.data(), error.size()), error.data());
    volume_.reset(volume);
    medium_ = make_desc<cumulet_medium_desc>();
    check(cumulet_volume_suggest_density_scale(volume, &medium_.density_scale), "");
    medium_.anisotropy = 0.6F;
    auto info = make_desc<cumulet_volume_info>();
    check(cumulet_volume_get_info(volume, &info), "");
    size_ = std::max(info.bounds_max[0] - info.bounds_min[0], info.bounds_max[2] - info.bounds_min[2]);
  }

  struct Cost {
    double add = 0.0, build = 0.0, upload = 0.0, move = 0.0;  // milliseconds of CPU time
    double rate = 0.0, steps = 0.0;                           // samples per second of CPU time; steps per sample
    double rate_of_one = 0.0;
    cumulet_stats stats = make_desc<cumulet_stats>();
  };

  Cost measure(int count, const std::string& picture) {
    Cost cost;
    begin();
    double begun = processor_seconds();
    std::vector<cumulet::test::InstanceRef> instances;
    const std::vector<Transform> transforms = layer(count, size_);
    for (const Transform& transform : transforms) instances.push_back(add(transform));
    cost.add = milliseconds_since(begun);
    begun = processor_seconds();
    must(viewer_.get(), cumulet_wait(viewer_.get(), -1.0));
    cost.build = milliseconds_since(begun);
    look({0.0, 0.9 * size_, 2.2 * size_}, {0.0, 0.1 * size_, -4.0 * size_});
    begun = processor_seconds();
    auto result = make_desc<cumulet_frame_result>();
    do result = render(16.0);
    while ((result.flags & CUMULET_RENDER_LOADING) != 0);
    cost.upload = milliseconds_since(begun);
    cost.rate = rate();
    must(viewer_.get(), cumulet_get_stats(viewer_.get(), &cost.stats));
    cost.steps = static_cast<double>(cost.stats.steps) / static_cast<double>(cost.stats.samples);
    if (!picture.empty()) write(picture);
    cost.move = move(instances.front().get(), transforms.front());
    // Looks at a single instance, away from the layer.
    const Transform alone{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 8.0 * size_, 1};
    check(cumulet_instance_set_to_world(instances.front().get(), alone.data()), "");
    look({0.0, 0.3 * size_, 6.2 * size_}, {0.0, 0.3 * size_, 8.0 * size_});
    cost.rate_of_one = rate();
    return cost;
  }

 private:
  void begin() {
    auto create = make_desc<cumulet_create_desc>();
    create.get_proc = Context::get_proc;
    create.get_proc_user = &context_;
    create.shader_cache = programs_.get();
    viewer_ = cumulet::test::make_plain_viewer(create);
    light_ = make_desc<cumulet_sun_sky_desc>();
    light_.sky = CUMULET_SKY_PHYSICAL;
    light_.sun_azimuth_degrees = 110.0F;
    light_.sun_elevation_degrees = 30.0F;
    must(viewer_.get(), cumulet_set_sun_sky(viewer_.get(), &light_));
    auto ground = make_desc<cumulet_ground_desc>();
    ground.mode = CUMULET_GROUND_BELOW;
    must(viewer_.get(), cumulet_set_ground(viewer_.get(), &ground));
    auto display = make_desc<cumulet_display_desc>();
    display.denoise = CUMULET_DENOISE_FAST;
    must(viewer_.get(), cumulet_set_display(viewer_.get(), &display));
    auto sampling = make_desc<cumulet_sampling_desc>();
    sampling.samples = samples;
    sampling.preview = CUMULET_PREVIEW_OFF;
    must(viewer_.get(), cumulet_set_sampling(viewer_.get(), &sampling));
  }

  cumulet::test::InstanceRef add(const Transform& transform) {
    auto desc = make_desc<cumulet_instance_desc>();
    desc.volume = volume_.get();
    desc.medium = &medium_;
    std::ranges::copy(transform, desc.to_world);
    cumulet_instance* made = nullptr;
    std::array<char, 256> error{};
    check(cumulet_instance_create(&desc, &made, error.data(), error.size()), error.data());
    cumulet::test::InstanceRef instance(made);
    must(viewer_.get(), cumulet_add_instance(viewer_.get(), made));
    return instance;
  }

  void look(const std::array<double, 3>& eye, const std::array<double, 3>& target) {
    auto desc = make_desc<cumulet_camera_desc>();
    std::ranges::copy(eye, desc.eye);
    std::ranges::copy(target, desc.target);
    desc.fovy_degrees = 50.0;
    cumulet_camera* camera = nullptr;
    must(viewer_.get(), cumulet_get_camera(viewer_.get(), &camera));
    const cumulet::test::CameraRef held(camera);
    check(cumulet_camera_set(camera, &desc), "the camera is refused");
  }

  cumulet_frame_result render(double budget_ms) {
    auto frame = make_desc<cumulet_frame_desc>();
    frame.width = width;
    frame.height = height;
    frame.target = CUMULET_TARGET_NONE;
    frame.budget_ms = budget_ms;
    auto result = make_desc<cumulet_frame_result>();
    must(viewer_.get(), cumulet_render(viewer_.get(), &frame, &result));
    return result;
  }

  /// Samples per second of CPU time.
  double rate() {
    light_.sun_azimuth_degrees += 0.25F;  // restarts the image
    must(viewer_.get(), cumulet_set_sun_sky(viewer_.get(), &light_));
    must(viewer_.get(), cumulet_wait(viewer_.get(), -1.0));
    const double begun = processor_seconds();
    while ((render(1000.0).flags & CUMULET_RENDER_CONVERGED) == 0) continue;
    const double seconds = processor_seconds() - begun;
    double noise = 0.0;  // also updates the statistics
    must(viewer_.get(), cumulet_measure_noise(viewer_.get(), &noise));
    return static_cast<double>(width) * height * samples / seconds;
  }

  /// Additional time of a call after one instance has moved. The call traces almost nothing.
  double move(cumulet_instance* instance, Transform transform) {
    constexpr double min_budget = 0.01;
    constexpr int times = 7;
    std::vector<double> moved;
    std::vector<double> still;
    for (int i = 0; i < 2 * times; ++i) {
      transform[13] += 1e-3 * size_;
      if (i % 2 == 0) check(cumulet_instance_set_to_world(instance, transform.data()), "");
      const double begun = processor_seconds();
      render(min_budget);
      (i % 2 == 0 ? moved : still).push_back(milliseconds_since(begun));
    }
    return *std::ranges::min_element(moved) - *std::ranges::min_element(still);
  }

  void write(const std::string& path) {
    std::vector<std::uint8_t> bytes(std::size_t{4} * width * height);
    must(viewer_.get(), cumulet_read_display(viewer_.get(), bytes.data(), bytes.size()));
    cumulet::image::Image picture{width, height, {}};
    picture.rgba.resize(bytes.size());
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      const float value = static_cast<float>(bytes[i]) / 255.0F;
      picture.rgba[i] = i % 4 == 3 ? value : cumulet::image::srgb_decode(value);
    }
    cumulet::image::PngOptions png;
    png.tone_mapping = cumulet::image::ToneMapping::none;
    cumulet::image::write_png(path, picture, png);
  }

  Context context_ = Context::create(cumulet::headless::Backend::automatic);
  cumulet::test::ProgramsRef programs_;
  cumulet::test::VolumeRef volume_;
  cumulet_medium_desc medium_{};
  double size_ = 0.0;
  cumulet_sun_sky_desc light_{};
  cumulet::test::ViewerPtr viewer_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: cumulet-bench-instances CLOUD.vdb OUT_FOLDER [COUNT]...\n");
    return 2;
  }
  try {
    std::vector<int> counts;
    for (int i = 3; i < argc; ++i) counts.push_back(std::atoi(argv[i]));
    if (counts.empty()) counts = {1, 10, 100, 1000};
    const std::filesystem::path folder(argv[2]);
    std::filesystem::create_directories(folder);
    Bench bench(argv[1]);
    std::printf(
        "| Instances | Added, ms | Built, ms | Uploaded, ms | Moved, ms | Cells | GL, MB | Steps a sample | Samples/s "
        "| of one, the others behind |\n|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    // Compiles the programs for one instance and for several.
    static_cast<void>(bench.measure(1, ""));
    static_cast<void>(bench.measure(2, ""));
    for (const int count : counts) {
      const Bench::Cost cost = bench.measure(count, (folder / ("sky" + std::to_string(count) + ".png")).string());
      std::printf("| %d | %.1f | %.0f | %.0f | %.1f | %llu | %.1f | %.1f | %.0fk | %.0fk |\n", count, cost.add,
                  cost.build, cost.upload, cost.move, static_cast<unsigned long long>(cost.stats.cells),
                  static_cast<double>(cost.stats.gl_bytes) / 1e6, cost.steps, cost.rate / 1e3, cost.rate_of_one / 1e3);
      std::fflush(stdout);
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cumulet-bench-instances: %s\n", error.what());
    return 1;
  }
}
