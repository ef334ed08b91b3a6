#include <cstdio>
#include <functional>
#include <memory>

#include "denoise.hpp"
#include "judged.hpp"
#include "judging.hpp"
#include "measure.hpp"
#include "plot.hpp"
#include "statistics.hpp"
#include "support/flip.hpp"

namespace cumulet::bench {

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr int steps = 20;  // of one degree, one frame each; then everything is at rest
constexpr double rest_seconds = 2.0;

struct Change {
  const char* name;
  std::function<bool(Stage&, double)> turn;  // by this many degrees; returns false if the scene has nothing to rotate
};
std::vector<Change> changes() {
  return {{"orbit",
           [](Stage& stage, double degrees) {
             stage.orbit(degrees);
             return true;
           }},
          {"sun", [](Stage& stage, double degrees) { return stage.turn_sun(static_cast<float>(degrees)); }}};
}

/// Times of the evaluations, in seconds since the last step began, each 1.5 times the previous one.
std::vector<double> moments(double seconds) {
  std::vector<double> result;
  for (double at = 0.02; at < 1.001 * seconds; at *= 1.5) result.push_back(at);
  return result;
}

/// The displayed image at each of the times. The clock is paused while images are read.
struct Watched {
  std::vector<Bytes> pictures;
  std::vector<double> frames;  // seconds each
};

Watched watch(Stage& stage, const Change& change, const std::vector<double>& at, double budget_ms) {
  bool more = true;
  change.turn(stage, -steps);
  for (double clock = 0.0; clock < rest_seconds;) clock += stage.frame(budget_ms, more);
  Watched watched;
  for (int step = 0; step < steps; ++step) {
    change.turn(stage, 1.0);
    // The frame of the last step is the first one to be evaluated.
    if (step + 1 < steps) stage.frame(budget_ms, more);
  }
  Bytes shown = stage.drawn();
  Bytes next = shown;  // drawn after the current clock time
  double clock = 0.0;
  more = true;
  for (const double moment : at) {
    while (clock <= moment && more) {
      shown = next;
      watched.frames.push_back(stage.frame(budget_ms, more));
      clock += watched.frames.back();
      next = stage.drawn();
    }
    if (clock <= moment) shown = next;
    watched.pictures.push_back(shown);
  }
  return watched;
}

struct Course {
  std::string scene;
  std::string change;
  std::string denoise;
  std::vector<double> at;
  std::vector<std::vector<double>> root;  // one per repeat
  std::vector<std::vector<double>> flip;
  std::vector<double> frames;
};

struct Goal {
  std::array<std::vector<double>, 2> halves;  // displayed luminance
  Bytes picture;
};

Goal goal_of(Stage& stage, std::uint32_t samples) {
  const std::array<std::vector<float>, 2> halves = stage.reference(samples);
  return {{display_luminances(stage.displayed(halves[0])), display_luminances(stage.displayed(halves[1]))},
          stage.displayed(mean_of(halves))};
}

void look(Stage& stage, const Change& change, const Goal& goal, const Options& options, std::uint32_t seed,
          Course& course) {
  const auto side = static_cast<int>(options.size);
  const test::Flip flip(side, side);
  stage.sample(options.reference_samples, seed, CUMULET_PREVIEW_AUTO);
  const Watched watched = watch(stage, change, course.at, options.budget_ms);
  std::vector<double> root;
  std::vector<double> flips;
  for (const Bytes& picture : watched.pictures) {
    root.push_back(root_error(display_luminances(picture), goal.halves[0], goal.halves[1]));
    flips.push_back(flip.mean(goal.picture, picture));
  }
  course.root.push_back(std::move(root));
  course.flip.push_back(std::move(flips));
  course.frames.insert(course.frames.end(), watched.frames.begin(), watched.frames.end());
}

/// Runs without and with the filter in turn, so that both have the same machine load.
std::vector<Course> courses_of(headless::Context& context, const JudgedScene& scene, const Change& change,
                               const Goal& goal, const Options& options) {
  std::vector<Course> courses;
  std::vector<std::unique_ptr<Stage>> stages;
  for (const bool filtered : {false, true}) {
    Stage& stage = *stages.emplace_back(std::make_unique<Stage>(context, scene, options.size));
    stage.filter(filtered ? CUMULET_DENOISE_FAST : CUMULET_DENOISE_OFF);
    if (!change.turn(stage, 0.0)) return {};
    Course& course = courses.emplace_back();
    course.scene = scene.name;
    course.change = change.name;
    course.denoise = filtered ? "fast" : "off";
    course.at = moments(options.seconds_a_run);
  }
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    for (std::size_t i = 0; i < stages.size(); ++i)
      look(*stages[i], change, goal, options, static_cast<std::uint32_t>(repeat), courses[i]);
  }
  return courses;
}

double median_at(const std::vector<std::vector<double>>& repeats, std::size_t moment) {
  std::vector<double> values;
  for (const std::vector<double>& repeat : repeats) values.push_back(repeat[moment]);
  return spread_of(values).median;
}

/// Indices of the times in the table.
std::vector<std::size_t> columns_of(const std::vector<double>& at) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < at.size(); i += 3) result.push_back(i);
  return result;
}

void print(const std::vector<Course>& courses, const Options& options) {
  if (courses.empty()) return;
  std::printf(
      "\n%u x %u pixels, %g ms a frame, after %d steps of 1 degree, medians of %d\n\n| Scene | Change | Denoise |",
      options.size, options.size, options.budget_ms, steps, options.repeats);
  const std::vector<std::size_t> columns = columns_of(courses.front().at);
  for (const char* what : {"Error, %", "FLIP"}) {
    for (const std::size_t i : columns) {
      std::printf("%s%.2g s |", i == columns.front() ? (std::string(" ") + what + ", after ").c_str() : " ",
                  courses.front().at[i]);
    }
  }
  std::printf(" A frame, ms |\n|---|---|---|");
  for (std::size_t i = 0; i < 2 * columns.size() + 1; ++i) std::printf("--:|");
  std::printf("\n");
  for (const Course& course : courses) {
    std::printf("| %s | %s | %s |", course.scene.c_str(), course.change.c_str(), course.denoise.c_str());
    for (const std::size_t i : columns) std::printf(" %.1f |", 100.0 * median_at(course.root, i));
    for (const std::size_t i : columns) std::printf(" %.3f |", median_at(course.flip, i));
    std::printf(" %.1f |\n", 1e3 * spread_of(course.frames).median);
  }
  std::fflush(stdout);
}

void plot(const std::string& scene, const std::vector<Course>& courses, const Options& options) {
  std::vector<Series> series;
  for (const Course& course : courses) {
    if (course.scene != scene) continue;
    Series s;
    s.label.append(course.change).append(", denoise ").append(course.denoise);
    s.color = course.denoise == "off" ? 0 : 1;
    s.dashed = course.change != "orbit";
    for (std::size_t i = 0; i < course.at.size(); ++i) s.points.emplace_back(course.at[i], median_at(course.flip, i));
    series.push_back(std::move(s));
  }
  write_file(
      options.out / ("settle-" + scene + ".svg"),
      line_plot(scene + ": what is drawn after a change", "seconds since", "FLIP to the converged picture", series));
}

}  // namespace

void measure_settle(headless::Context& context, const Options& options) {
  std::vector<std::string> skipped;
  std::vector<Course> courses;
  for (const JudgedScene& scene : judged_scenes(options, skipped)) {
    progress(scene.name);
    Stage still(context, scene, options.size);
    const Goal goal = goal_of(still, options.reference_samples);
    progress("    reference");
    for (const Change& change : changes()) {
      for (Course& course : courses_of(context, scene, change, goal, options)) courses.push_back(std::move(course));
      progress(std::string("    ") + change.name);
    }
    plot(scene.name, courses, options);
  }
  print(courses, options);
  for (const std::string& line : skipped) std::printf("\nSkipped: %s\n", line.c_str());
}

}  // namespace cumulet::bench
