// Measures the benefit of fitting the grid to the view: errors at equal time during a flight into a volume, or with
// --orbit how much errors change from frame to frame. Run by hand:
//
//     cumulet-bench-flight [--views N] [--to DISTANCE] [--size P] [--samples S] [--threshold T] [--max-cells N]
//     [--optical-depth D] [--max-bounces B] [--interpolation linear] [--orbit DEGREES] FILE
//
// The camera distance decreases by the same factor per view. Each view is rendered with the voxels (the brick grid) and
// with three grids of the same threshold and cell limit: refitted to each view on the GPU, fitted to the first view
// only, and fitted to no view. All use the same random numbers, twice. The product of two independent differences to
// the voxels estimates the squared error of a grid, and the difference of the two images its noise. Time is CPU time of
// the process.
//
// With --orbit the camera circles the center at the last distance, by so many degrees in all views together. Flicker is
// the change of a grid's error between two views: the grid's frame-to-frame change beyond that of the voxels. It is
// estimated from two independent changes. A grid that does not change flickers only as its errors move past the camera.

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
  double orbit = 0.0;          // degrees; 0: a flight
  grid::Interpolation interpolation = grid::Interpolation::nearest;
  std::uint32_t max_bounces = 0;
  double threshold = 0.02;
  std::uint64_t max_cells = 300'000;
  double optical_depth = 10.0;
  std::string file;
};

double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

viewer::CameraPose pose_at(const viewer::VolumeAsset& volume, double distance, double degrees = 0.0) {
  const auto& bounds = volume.bounds();
  const glm::dvec3 centre = 0.5 * (bounds.min + bounds.max);
  const double radius = 0.5 * glm::length(bounds.max - bounds.min);
  viewer::CameraPose pose;
  const double angle = std::atan2(0.5, 0.9) + glm::radians(degrees);
  const double level = std::hypot(0.9, 0.5);
  pose.eye =
      centre + distance * radius * glm::normalize(glm::dvec3(level * std::cos(angle), 0.25, level * std::sin(angle)));
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
    medium.max_bounces = options.max_bounces;
    still_.set_medium(medium);
    const bool orbits = options.orbit != 0.0;
    const viewer::CameraPose first = pose_at(*asset.volume, orbits ? options.last_distance : first_distance);
    viewer::GridSettings settings;
    settings.build.interpolation = options.interpolation;
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

/// The error of a grid in one view, each part with its own noise.
using Wrong = std::array<std::vector<double>, parts>;

Wrong wrong_of(const Pictures& pictures, const Pictures& voxels) {
  Wrong wrong;
  for (std::size_t part = 0; part < parts; ++part) {
    for (std::size_t i = 0; i < voxels.alpha.size(); ++i)
      wrong[part].push_back(double{pictures.luminances[part][i]} - voxels.luminances[part][i]);
  }
  return wrong;
}

/// Errors of a grid along an orbit, and their changes from view to view. Sums of squares over pixels.
class Flicker {
 public:
  void add(const Pictures& pictures, const Pictures& voxels, double refit_seconds) {
    Wrong wrong = wrong_of(pictures, voxels);
    for (std::size_t i = 0; i < voxels.alpha.size(); ++i) {
      pixels_ += 1.0;
      mean_ += 0.5 * (double{voxels.luminances[0][i]} + voxels.luminances[1][i]);
      wrong_ += wrong[0][i] * wrong[1][i];
    }
    if (!before_[0].empty()) {
      double change = 0.0;
      for (std::size_t i = 0; i < voxels.alpha.size(); ++i)
        change += (wrong[0][i] - before_[0][i]) * (wrong[1][i] - before_[1][i]);
      changes_.push_back(change / static_cast<double>(voxels.alpha.size()));
    }
    before_ = std::move(wrong);
    cells_.push_back(static_cast<double>(pictures.cells));
    seconds_ += refit_seconds;
  }
  void print(const char* name) const {
    const double mean = mean_ / pixels_;
    double sum = 0.0;
    for (const double change : changes_) sum += change / static_cast<double>(changes_.size());
    const auto percent = [&](double square) { return 100.0 * std::sqrt(std::max(0.0, square)) / mean; };
    const auto [fewest, most] = std::ranges::minmax(cells_);
    std::printf("| %s | %.0f to %.0f | %.2f | %.2f | %.2f | %.2f |\n", name, fewest, most,
                seconds_ / static_cast<double>(cells_.size()), percent(wrong_ / pixels_), percent(sum),
                percent(std::ranges::max(changes_)));
  }

 private:
  Wrong before_;
  std::vector<double> changes_;  // per view after the first
  std::vector<double> cells_;
  double pixels_ = 0.0;
  double mean_ = 0.0;
  double wrong_ = 0.0;
  double seconds_ = 0.0;
};

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

void orbit(const std::vector<std::unique_ptr<Flyer>>& flyers, const bench::Asset& asset, const FlightOptions& options) {
  std::vector<Flicker> flickers(flyers.size());
  for (int view = 0; view < options.views; ++view) {
    const double degrees = options.orbit * view / (options.views - 1);
    for (const auto& flyer : flyers) flyer->fly_to(pose_at(*asset.volume, options.last_distance, degrees));
    for (std::size_t part = 0; part < parts; ++part) {
      for (const auto& flyer : flyers) flyer->trace(part);
    }
    for (std::size_t i = 0; i < flyers.size(); ++i) {
      const Pictures& pictures = flyers[i]->pictures();
      flickers[i].add(pictures, flyers[0]->pictures(), pictures.refit_seconds);
    }
    std::fprintf(stderr, "view %d\n", view);
  }
  std::printf("| Through | Cells | Fitted in, s | Wrong, %% | Flicker, %% | Largest flicker, %% |\n");
  std::printf("|---|--:|--:|--:|--:|--:|\n");
  for (std::size_t i = 1; i < flyers.size(); ++i) flickers[i].print(name_of(flyers[i]->fit()));
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
  if (options.orbit != 0.0) {
    orbit(flyers, asset, options);
    return;
  }
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
  std::string interpolation = "nearest";
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
    } else if (argument == "--orbit" && more) {
      options.orbit = std::atof(argv[++i]);
    } else if (argument == "--max-bounces" && more) {
      options.max_bounces = static_cast<std::uint32_t>(std::atoi(argv[++i]));
    } else if (argument == "--interpolation" && more) {
      interpolation = argv[++i];
    } else if (argument == "--optical-depth" && more) {
      options.optical_depth = std::atof(argv[++i]);
    } else {
      options.file = argument;
    }
  }
  if (interpolation == "linear") options.interpolation = grid::Interpolation::linear;
  const bool known = interpolation == "linear" || interpolation == "nearest";
  if (options.file.empty() || !known || (options.orbit != 0.0 && options.views < 2)) {
    std::fputs(
        "usage: cumulet-bench-flight [--views N] [--to DISTANCE] [--size P] [--samples S] [--threshold T]\n"
        "                            [--max-cells N] [--optical-depth D] [--max-bounces B]\n"
        "                            [--interpolation nearest|linear] [--orbit DEGREES] FILE\n",
        stderr);
    return 2;
  }
  run(options);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "cumulet-bench-flight: %s\n", error.what());
  return 1;
}
