#include "denoise.hpp"

#include <chrono>
#include <cstdio>
#include <denoised.hpp>
#include <fstream>
#include <functional>
#include <image.hpp>
#include <map>
#include <stdexcept>

#include "format.hpp"
#include "judged.hpp"
#include "judging.hpp"
#include "measure.hpp"
#include "plot.hpp"
#include "statistics.hpp"
#include "support/flip.hpp"

namespace cumulet::bench {

namespace {

using Bytes = std::vector<std::uint8_t>;

enum class Method { raw = 0, fast = 1, high = 2 };
constexpr std::array method_names{"raw", "fast", "high"};

constexpr std::uint32_t judged_samples_most = 64;
constexpr std::uint32_t pictured_samples = 16;

/// Error of a method per sample count.
struct Curve {
  std::map<std::uint32_t, std::vector<double>> relative;  // relMSE without fireflies, one per seed
  std::map<std::uint32_t, std::vector<double>> specks;    // fraction of the error in fireflies
  std::map<std::uint32_t, std::vector<double>> flip;
};

struct Judgement {
  std::string name;
  std::array<Curve, 3> curves;  // indexed by Method
  double floor = 0.0;           // FLIP of the reference's halves
  std::array<std::optional<double>, 3> flicker;
  std::array<std::vector<double>, 3> seconds;  // per sample and pixel; per denoising pass
};

std::vector<std::uint32_t> counts_of(const Options& options) {
  std::vector<std::uint32_t> counts;
  for (std::uint32_t count = 1; count <= std::max(options.raw_samples, judged_samples_most); count *= 4)
    counts.push_back(count);
  return counts;
}

/// Images of the scene by each method. The viewer already has the samples.
class Pictures {
 public:
  Pictures(Stage& stage, std::string network) : stage_(stage), network_(std::move(network)) {}

  [[nodiscard]] bool has(Method method) const { return method != Method::high || !network_.empty(); }
  /// seconds: receives the time for denoising, unless null.
  std::vector<float> take(Method method, std::vector<double>* seconds = nullptr) {
    if (method == Method::raw) return stage_.linear();
    const auto start = std::chrono::steady_clock::now();
    std::vector<float> rgba =
        demo::denoised(stage_.viewer(), {.network = method == Method::high ? network_ : ""}, stage_.floats());
    if (seconds != nullptr)
      seconds->push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    return rgba;
  }

 private:
  Stage& stage_;
  std::string network_;
};

constexpr std::array methods{Method::raw, Method::fast, Method::high};
std::size_t index(Method method) { return static_cast<std::size_t>(method); }

/// Writes images side by side, in rows.
void write_sheet(const std::filesystem::path& file, const std::vector<std::vector<Bytes>>& rows, std::uint32_t size) {
  std::size_t across = 0;
  for (const std::vector<Bytes>& row : rows) across = std::max(across, row.size());
  const std::size_t width = across * size;
  Bytes sheet(4 * width * size * rows.size(), 255);
  for (std::size_t y = 0; y < rows.size() * size; ++y) {
    const std::vector<Bytes>& row = rows[y / size];
    for (std::size_t x = 0; x < row.size() * size; ++x) {
      const Bytes& picture = row[x / size];
      std::copy_n(&picture[4 * ((y % size) * size + x % size)], 3, &sheet[4 * (y * width + x)]);
    }
  }
  image::write_png(file.string(), static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(rows.size() * size),
                   sheet);
}

void judge_stills(Stage& stage, Pictures& pictures, const Options& options, Judgement& judgement) {
  const std::array<std::vector<float>, 2> halves = stage.reference(options.reference_samples);
  const Bytes reference = stage.displayed(mean_of(halves));
  const auto side = static_cast<int>(options.size);
  const test::Flip flip(side, side);
  judgement.floor = flip.mean(stage.displayed(halves[0]), stage.displayed(halves[1]));
  progress("    reference");
  for (const Method method : methods) {
    if (pictures.has(method)) pictures.take(method);  // compiles
  }
  std::vector<std::vector<Bytes>> rows;
  for (std::uint32_t part = 0; part < options.error_parts; ++part) {
    for (const std::uint32_t count : counts_of(options)) {
      if (part > 0 && count > judged_samples_most) break;  // skips the most expensive counts
      stage.sample(count, 1000 + part);
      const double traced = stage.converge_undrawn();
      if (count == judged_samples_most) judgement.seconds[0].push_back(traced / count);
      std::vector<Bytes> row;
      for (const Method method : methods) {
        if (!pictures.has(method) || (method != Method::raw && count > judged_samples_most)) continue;
        const std::vector<float> picture = pictures.take(method, &judgement.seconds.at(index(method)));
        Curve& curve = judgement.curves.at(index(method));
        row.push_back(stage.displayed(picture));
        const RelativeSquareError error = relative_square_error(picture, halves, stage.exposure());
        curve.relative[count].push_back(error.most);
        curve.specks[count].push_back(error.specks);
        curve.flip[count].push_back(flip.mean(reference, row.back()));
      }
      row.push_back(reference);
      if (part == 0 && count <= pictured_samples) rows.push_back(std::move(row));
    }
  }
  write_sheet(options.out / ("denoise-" + judgement.name + ".png"), rows, options.size);
}

// Displayed luminance of the images of an orbit.
using Film = std::vector<std::vector<double>>;

constexpr double orbit_step_degrees = 0.5;

/// Frames of one viewer, one after another.
Film orbit(Stage& stage, std::uint32_t frames, const std::function<Bytes()>& picture) {
  Film film;
  for (std::uint32_t frame = 0; frame < frames; ++frame) {
    film.push_back(display_luminances(picture()));
    stage.orbit(orbit_step_degrees);
  }
  stage.orbit(-orbit_step_degrees * frames);
  return film;
}

std::vector<double> change(const Film& film, std::size_t frame) {
  std::vector<double> result(film[frame].size());
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = film[frame + 1][i] - film[frame][i];
  return result;
}

/// RMS over frames and pixels of the change that converged images do not have.
double flicker_of(const Film& film, const std::array<Film, 2>& converged) {
  double square = 0.0;
  for (std::size_t frame = 0; frame + 1 < film.size(); ++frame) {
    const double error = root_error(change(film, frame), change(converged[0], frame), change(converged[1], frame));
    square += error * error / static_cast<double>(film.size() - 1);
  }
  return std::sqrt(square);
}

void judge_flicker(Stage& stage, Pictures& pictures, const Options& options, Judgement& judgement) {
  std::array<Film, 2> converged;
  for (std::uint32_t half = 0; half < 2; ++half) {
    stage.sample(options.flicker_reference_samples / 2, 80001 + half);
    converged.at(half) = orbit(stage, options.frames, [&] {
      stage.converge_undrawn();
      return stage.displayed(stage.linear());
    });
  }
  // While the camera moves, hosts display drawn frames. Networks are only applied to images that are read back.
  for (const Method method : methods) {
    if (!pictures.has(method)) continue;
    stage.filter(method == Method::fast ? CUMULET_DENOISE_FAST : CUMULET_DENOISE_OFF);
    stage.sample(options.flicker_samples, 3);
    const Film film = orbit(stage, options.frames, [&] {
      if (method == Method::high) {
        stage.converge_undrawn();
        return stage.displayed(pictures.take(method));
      }
      stage.converge();
      return stage.drawn();
    });
    judgement.flicker.at(index(method)) = flicker_of(film, converged);
  }
  stage.filter(CUMULET_DENOISE_OFF);
}

std::string as_good(const Curve& raw, const Curve& curve, std::uint32_t samples, bool flip) {
  const auto& errors = flip ? raw.flip : raw.relative;
  std::vector<std::pair<double, double>> points;
  for (const auto& [count, values] : errors) points.emplace_back(count, estimate_of(values).mean);
  const double error = estimate_of((flip ? curve.flip : curve.relative).at(samples)).mean;
  const std::optional<double> count = count_as_good(points, error);
  if (!count) return format("> %.0f", points.back().first);
  if (*count <= 1.0 && error > points.front().second) return "< 1";
  return format("%.3g", *count);
}

std::string quality_rows(const Judgement& judgement) {
  std::string rows;
  for (const Method method : methods) {
    const Curve& curve = judgement.curves.at(index(method));
    if (curve.relative.empty()) {
      rows += format("| %s | high | no network | | | | | | | | | | | | | | |\n", judgement.name.c_str());
      continue;
    }
    rows += format("| %s | %s |", judgement.name.c_str(), method_names.at(index(method)));
    double uncertain = 0.0;
    for (std::uint32_t count = 1; count <= judged_samples_most; count *= 4) {
      const Estimate e = estimate_of(curve.relative.at(count));
      rows += format(" %.3g |", e.mean);
      if (e.mean > 0.0) uncertain = std::max(uncertain, e.standard_error / e.mean);
    }
    rows += format(" %.0f | %.0f |", 100.0 * uncertain, 100.0 * estimate_of(curve.specks.at(pictured_samples)).mean);
    for (std::uint32_t count = 1; count <= judged_samples_most; count *= 4)
      rows += format(" %.3f |", estimate_of(curve.flip.at(count)).mean);
    for (const bool flip : {false, true}) {
      for (const std::uint32_t count : {4U, 16U}) {
        rows += method == Method::raw ? std::string(" |")
                                      : format(" %s |", as_good(judgement.curves[0], curve, count, flip).c_str());
      }
    }
    const std::optional<double>& flicker = judgement.flicker.at(index(method));
    rows += flicker ? format(" %.2f |\n", 100.0 * *flicker) : std::string(" |\n");
  }
  return rows;
}

void print(const std::vector<Judgement>& judgements, const Options& options) {
  std::printf("\n%u x %u pixels, reference of %u samples, %u seeds\n\n", options.size, options.size,
              options.reference_samples, options.error_parts);
  std::printf(
      "| Scene | | relMSE at 1 | 4 | 16 | 64 | +- %% | Specks at 16, %% | FLIP at 1 | 4 | 16 | 64 | 4 as raw of, "
      "relMSE | 16 | 4, FLIP | "
      "16 | Flicker, %% |\n|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
  for (const Judgement& judgement : judgements) std::printf("%s", quality_rows(judgement).c_str());
  std::printf(
      "\n| Scene | FLIP of the reference's halves | A sample per pixel, ms | fast, ms | high, ms "
      "|\n|---|--:|--:|--:|--:|\n");
  for (const Judgement& judgement : judgements) {
    std::printf("| %s | %.3f |", judgement.name.c_str(), judgement.floor);
    for (const std::vector<double>& seconds : judgement.seconds) {
      if (seconds.empty()) {
        std::printf(" |");
      } else {
        std::printf(" %.1f |", 1e3 * spread_of(seconds).median);
      }
    }
    std::printf("\n");
  }
  std::fflush(stdout);
}

void plot(const Judgement& judgement, const Options& options) {
  std::vector<Series> relative;
  std::vector<Series> flips;
  for (const Method method : methods) {
    const Curve& curve = judgement.curves.at(index(method));
    if (curve.relative.empty()) continue;
    const auto series = [&](const std::map<std::uint32_t, std::vector<double>>& errors) {
      Series s{method_names.at(index(method)), static_cast<int>(index(method)), false, {}};
      for (const auto& [count, values] : errors) s.points.emplace_back(count, estimate_of(values).mean);
      return s;
    };
    relative.push_back(series(curve.relative));
    flips.push_back(series(curve.flip));
  }
  write_file(options.out / ("denoise-" + judgement.name + "-relmse.svg"),
             line_plot(judgement.name + ": relMSE", "samples per pixel", "relMSE", relative));
  write_file(options.out / ("denoise-" + judgement.name + "-flip.svg"),
             line_plot(judgement.name + ": FLIP", "samples per pixel", "FLIP", flips));
}

/// All scenes in one plot: the number of samples that noisy images would need.
void plot_all(const std::vector<Judgement>& judgements, const Options& options) {
  std::vector<BarGroup> groups;
  for (const Judgement& judgement : judgements) {
    BarGroup group{judgement.name, {}};
    for (const Method method : methods) {
      const Curve& curve = judgement.curves.at(index(method));
      if (!curve.flip.empty()) group.values.push_back(estimate_of(curve.flip.at(pictured_samples)).mean);
    }
    groups.push_back(std::move(group));
  }
  const std::vector<std::string> bars(method_names.begin(), method_names.end());
  write_file(options.out / "denoise.svg", bar_plot("16 samples per pixel, raw and denoised", "FLIP", bars, groups));
}

/// The network's path; "" after a message if there is none.
std::string network_of(const Options& options) {
  try {
    return demo::find_network(options.oidn_weights);
  } catch (const std::exception& error) {
    progress(std::string("no network: ") + error.what());
    return "";
  }
}

}  // namespace

void measure_denoise(headless::Context& context, const Options& options) {
  const std::string network = network_of(options);
  std::vector<std::string> skipped;
  std::vector<Judgement> judgements;
  for (const JudgedScene& scene : judged_scenes(options, skipped)) {
    progress(scene.name);
    Stage stage(context, scene, options.size);
    Pictures pictures(stage, network);
    Judgement judgement;
    judgement.name = scene.name;
    judge_stills(stage, pictures, options, judgement);
    progress("    stills");
    if (options.frames > 1) judge_flicker(stage, pictures, options, judgement);
    progress("    flicker");
    plot(judgement, options);
    judgements.push_back(std::move(judgement));
    plot_all(judgements, options);
    std::fprintf(stderr, "%s",
                 quality_rows(judgements.back()).c_str());  // prints completed results in case of a later failure
  }
  print(judgements, options);
  for (const std::string& line : skipped) std::printf("\nSkipped: %s\n", line.c_str());
}

}  // namespace cumulet::bench
