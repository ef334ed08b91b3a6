// Measures the benefit of fitting the grid to the view: errors at equal time during a flight into a volume. Run by
// hand:
//
//     cumulet-bench-flight [--views N] [--to DISTANCE] [--size P] [--samples S] [--threshold T] [--max-cells N]
//     [--optical-depth D] FILE
//
// The camera distance decreases by the same factor per view. Each view is rendered with the voxels (the brick grid) and
// with three grids of the same threshold and cell limit: refitted to each view on the GPU, fitted to the first view
// only, and fitted to no view. All use the same random numbers, twice. The product of two independent differences to
// the voxels estimates the squared error of a grid, and the difference of the two images its noise. Time is CPU time of
// the process.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "asset.hpp"
#include "base/luminance.hpp"
#include "subject.hpp"

namespace {

using namespace cumulet;

constexpr std::size_t parts = 2;
constexpr std::array<double, 2> times{4.0, 64.0};  // per view, in seconds
constexpr double first_distance = 2.4;             // of half the diagonal of the bounds

struct FlightOptions {
  int views = 5;
  std::uint32_t size = 96;
  std::uint32_t samples = 48;  // per pixel, each time
  double last_distance = 0.6;  // of half the diagonal
  double threshold = 0.02;
  std::uint64_t max_cells = 300'000;
  double optical_depth = 10.0;
  std::string file;
};

double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

viewer::CameraPose pose_at(const viewer::VolumeAsset& volume, double distance) {
  const auto& bounds = volume.bounds();
  const glm::dvec3 centre = 0.5 * (bounds.min + bounds.max);
  const double radius = 0.5 * glm::length(bounds.max - bounds.min);
  viewer::CameraPose pose;
  pose.eye = centre + distance * radius * glm::normalize(glm::dvec3(0.9, 0.25, 0.5));
  pose.target = centre;
  return pose;
}

grid::RefineCamera camera_of(const viewer::CameraPose& pose, std::uint32_t size) {
  grid::RefineCamera camera;
  camera.eye = pose.eye;
  camera.forward = glm::normalize(pose.target - pose.eye);
  camera.right = glm::normalize(glm::cross(camera.forward, pose.up));
  camera.up = glm::cross(camera.right, camera.forward);
  camera.tan_half_x = camera.tan_half_y = std::tan(glm::radians(0.5 * pose.fovy_degrees));
  camera.pixels_per_radian = size / (2.0 * camera.tan_half_y);
  return camera;
}

enum class Fit { voxels, each_view, first_view, no_view };
constexpr std::array all_fits{Fit::voxels, Fit::each_view, Fit::first_view, Fit::no_view};

const char* name_of(Fit fit) {
  switch (fit) {
    case Fit::voxels:
      return "voxels";
    case Fit::each_view:
      return "a grid of each view";
    case Fit::first_view:
      return "the first view's grid";
    case Fit::no_view:
      break;
  }
  return "a grid of no view";
}

/// Images of one view.
struct Pictures {
  double refit_seconds = 0.0;
  double seconds = 0.0;  ///< of all parts
  std::uint64_t cells = 0;
  std::array<std::vector<float>, parts> luminances;
  std::vector<float> alpha;
};

class Flyer {
 public:
  Flyer(headless::Context& context, const bench::Asset& asset, Fit fit, const FlightOptions& options)
      : still_(context), options_(options), fit_(fit) {
    still_.set_volume(asset.volume);
    still_.set_light(bench::bench_light());
    viewer::Medium medium;
    medium.density_scale = asset.density_scale(options.optical_depth);
    still_.set_medium(medium);
    const viewer::CameraPose first = pose_at(*asset.volume, first_distance);
    viewer::GridSettings settings;
    grid::RefineSettings& refine = settings.build.refine;
    refine.criterion = grid::Criterion::transmittance;
    refine.threshold = options.threshold;
    refine.max_cells = options.max_cells;
    if (fit == Fit::voxels) settings.build.march = render::March::brick;
    if (fit == Fit::first_view) refine.camera = camera_of(first, options.size);
    settings.camera_adaptive = fit == Fit::each_view;
    if (fit == Fit::each_view) settings.build.on = viewer::BuildOn::gpu;
    still_.set_grid(settings);
    // Costs paid only once: drivers compile, and the lattice is made.
    fly_to(pose_at(*asset.volume, 1.1 * first_distance));
    bench::trace(still_, image(1, 0));
  }

  void fly_to(const viewer::CameraPose& pose) {
    still_.set_image(image(options_.samples, 0));
    const double begun = processor_seconds();
    still_.set_camera(pose);
    still_.build();
    pictures_ = {};
    pictures_.refit_seconds = processor_seconds() - begun;
    if (fit_ != Fit::voxels) pictures_.cells = still_.viewer().stats().cells;
  }
  void trace(std::size_t part) {
    const bench::Run run = bench::trace(still_, image(options_.samples, static_cast<std::uint32_t>(101 * (part + 1))));
    pictures_.seconds += run.processor_seconds;
    std::vector<float>& to = pictures_.luminances[part];
    to.clear();
    pictures_.alpha.clear();
    for (std::size_t i = 0; i < run.rgba.size(); i += 4) {
      to.push_back(luminance(glm::vec3(run.rgba[i], run.rgba[i + 1], run.rgba[i + 2])));
      pictures_.alpha.push_back(run.rgba[i + 3]);
    }
  }
  [[nodiscard]] const Pictures& pictures() const { return pictures_; }
  [[nodiscard]] Fit fit() const { return fit_; }

 private:
  [[nodiscard]] test::Image image(std::uint32_t samples, std::uint32_t seed) const {
    return {options_.size, options_.size, samples, seed};
  }

  test::Still still_;
  FlightOptions options_;
  Fit fit_;
  Pictures pictures_;
};

/// Root mean squares, relative to the mean of the pixels that show the medium.
struct Errors {
  double wrong = 0.0;  ///< independent of the number of samples
  double noise = 0.0;  ///< of one sample per pixel
};

Errors errors_of(const Pictures& pictures, const Pictures& voxels, std::uint32_t samples) {
  double mean = 0.0;
  double product = 0.0;
  double square = 0.0;
  double shown = 0.0;
  for (std::size_t i = 0; i < voxels.alpha.size(); ++i) {
    if (!(voxels.alpha[i] > 0.0F)) continue;
    shown += 1.0;
    mean += 0.5 * (double{voxels.luminances[0][i]} + voxels.luminances[1][i]);
    product += (double{pictures.luminances[0][i]} - voxels.luminances[0][i]) *
               (double{pictures.luminances[1][i]} - voxels.luminances[1][i]);
    const double apart = double{pictures.luminances[0][i]} - pictures.luminances[1][i];
    square += 0.5 * apart * apart;
  }
  mean /= shown;
  return {std::sqrt(std::max(0.0, product / shown)) / mean, std::sqrt(square / shown * samples) / mean};
}

void print_head() {
  std::printf("| Distance | Through | Cells | Fitted in, s | Samples a s | Noise of one | Wrong, %% |");
  for (const double seconds : times) std::printf(" Error in %.0f s, %% |", seconds);
  std::printf("\n|--:|---|--:|--:|--:|--:|--:|");
  for (std::size_t i = 0; i < times.size(); ++i) std::printf("--:|");
  std::printf("\n");
}

void print_row(double distance, const Flyer& flyer, const Pictures& voxels, const FlightOptions& options) {
  const Pictures& pictures = flyer.pictures();
  const Errors errors = errors_of(pictures, voxels, options.samples);
  const double rate = static_cast<double>(parts) * options.samples / pictures.seconds;  // samples per pixel
  const double refit = flyer.fit() == Fit::each_view ? pictures.refit_seconds : 0.0;
  std::printf("| %.2f | %s | %llu | %.2f | %.2f | %.2f | %.2f |", distance, name_of(flyer.fit()),
              static_cast<unsigned long long>(pictures.cells), refit, rate, errors.noise, 100.0 * errors.wrong);
  for (const double seconds : times) {
    const double count = (seconds - refit) * rate;
    if (count > 0.0) {
      std::printf(" %.2f |", 100.0 * std::hypot(errors.wrong, errors.noise / std::sqrt(count)));
    } else {
      std::printf(" - |");
    }
  }
  std::printf("\n");
}

void run(const FlightOptions& options) {
  headless::Context context = headless::Context::create(headless::Backend::automatic);
  bench::Input input;
  input.name = "volume";
  input.file = options.file;
  input.grid = "density";
  const bench::Asset asset = bench::load_asset(input);
  std::vector<std::unique_ptr<Flyer>> flyers;
  for (const Fit fit : all_fits) flyers.push_back(std::make_unique<Flyer>(context, asset, fit, options));
  print_head();
  for (int view = 0; view < options.views; ++view) {
    const double along = options.views > 1 ? static_cast<double>(view) / (options.views - 1) : 0.0;
    const double distance = first_distance * std::pow(options.last_distance / first_distance, along);
    for (const auto& flyer : flyers) flyer->fly_to(pose_at(*asset.volume, distance));
    for (std::size_t part = 0; part < parts; ++part) {
      for (const auto& flyer : flyers) flyer->trace(part);
    }
    for (const auto& flyer : flyers) print_row(distance, *flyer, flyers[0]->pictures(), options);
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  FlightOptions options;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const bool more = i + 1 < argc;
    if (argument == "--views" && more) {
      options.views = std::atoi(argv[++i]);
    } else if (argument == "--size" && more) {
      options.size = static_cast<std::uint32_t>(std::atoi(argv[++i]));
    } else if (argument == "--samples" && more) {
      options.samples = static_cast<std::uint32_t>(std::atoi(argv[++i]));
    } else if (argument == "--to" && more) {
      options.last_distance = std::atof(argv[++i]);
    } else if (argument == "--threshold" && more) {
      options.threshold = std::atof(argv[++i]);
    } else if (argument == "--max-cells" && more) {
      options.max_cells = std::strtoull(argv[++i], nullptr, 10);
    } else if (argument == "--optical-depth" && more) {
      options.optical_depth = std::atof(argv[++i]);
    } else {
      options.file = argument;
    }
  }
  if (options.file.empty()) {
    std::fputs(
        "usage: cumulet-bench-flight [--views N] [--to DISTANCE] [--size P] [--samples S] [--threshold T]\n"
        "                            [--max-cells N] [--optical-depth D] FILE\n",
        stderr);
    return 2;
  }
  run(options);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "cumulet-bench-flight: %s\n", error.what());
  return 1;
}
