#include "options.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>

namespace cumulet::bench {

namespace {

Input parse_input(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    throw CLI::ValidationError("--input", "\"" + text + "\" is not NAME=FILE[:GRID] or NAME=@noise:SIZE");
  }
  Input input;
  input.name = text.substr(0, equals);
  for (char& c : input.name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
    if (!plain) c = '_';  // used in file names
  }
  std::string rest = text.substr(equals + 1);
  const std::string noise = "@noise:";
  if (rest.rfind(noise, 0) == 0) {
    try {
      input.noise_size = std::stoi(rest.substr(noise.size()));
    } catch (const std::exception&) {
      input.noise_size = 0;
    }
    if (input.noise_size < 8 || input.noise_size > 2048) {
      throw CLI::ValidationError("--input", "a noise volume has 8 to 2048 voxels a side");
    }
    return input;
  }
  const std::size_t colon = rest.rfind(':');
  if (colon != std::string::npos && rest.find('/', colon) == std::string::npos) {
    input.grid = rest.substr(colon + 1);
    rest.resize(colon);
  }
  input.file = rest;
  return input;
}

ShaderVariant parse_variant(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw CLI::ValidationError("--variant", "\"" + text + "\" is not NAME=DIR[:constant]");
  std::string folder = text.substr(equals + 1);
  const std::string_view constant = ":constant";
  const bool constant_cells = folder.ends_with(constant);
  if (constant_cells) folder.resize(folder.size() - constant.size());
  return {text.substr(0, equals), folder, constant_cells};
}

void add_interpolation(CLI::App& app, Options& options) {
  const std::map<std::string, grid::Interpolation> names{{"nearest", grid::Interpolation::nearest},
                                                         {"linear", grid::Interpolation::linear}};
  app.add_option("--interpolation", options.interpolations,
                 "nearest|linear, of all grids (default: nearest); with --peers also both, in one run")
      ->transform(CLI::CheckedTransformer(names))
      ->expected(1, 2);
  app.final_callback([&options] {
    if (options.interpolations.size() != 1 && !options.peers)
      throw CLI::ValidationError("--interpolation", "only --peers compares two");
  });
}

void add_peer_options(CLI::App& app, Options& options) {
  const auto take = [&options](const std::vector<std::string>& texts) {
    for (const std::string& text : texts) options.variants.push_back(parse_variant(text));
  };
  app.add_option_function<std::vector<std::string>>(
      "--variant", take,
      "With --peers: NAME=DIR[:constant], shaders of a folder (a copy of glsl/ with changes) on the same cells, or on "
      "constant ones; can be repeated");
  app.add_option(
      "--block-bytes", options.block_bytes,
      "With --peers: assumed size of storage blocks, instead of the driver's limit (llvmpipe reports 128 MiB "
      "and accepts more)");
  app.add_flag("--by-clock", options.by_clock,
               "With --peers: the clock's time, as of a GPU, instead of the processors'");
  add_interpolation(app, options);
}

}  // namespace

ParseResult parse(int argc, char** argv, const std::vector<std::string>& scenes) {
  ParseResult result;
  Options& o = result.options;
  CLI::App app(
      "Measures the marches against each other: one run, ratios, medians of interleaved repeats.\n"
      "Writes report.md, results.csv and plots (SVG).");
  std::vector<std::string> inputs;
  std::string shared_data = "../shared/data";
  std::string samples = "build/sample-full";
  o.usual_dir = "build/sample";
  std::string backend = "auto";
  app.add_option("--input", inputs,
                 "NAME=FILE[:GRID] or NAME=@noise:SIZE, again and again (default: disney, cumulus, explosion)");
  app.add_option("--sample-dir", samples, "What cumulet-scene --full wrote (default: build/sample-full)");
  app.add_option("--usual-dir", o.usual_dir,
                 "With --denoise and --settle: what cumulet-scene wrote without (default: build/sample)");
  app.add_option("--data-dir", shared_data, "Holds vdb/wdas/wdas_cloud_sixteenth.vdb (default: ../shared/data)");
  app.add_option("--out", o.out, "Folder for what is written (default: bench-out)");
  app.add_option("--update-readme", o.readme, "Put the main table between this file's bench:begin and bench:end");
  app.add_option("--surfaces-only", o.surfaces_threshold,
                 "Only what surfaces cost, on a linear grid of that threshold, to standard error")
      ->check(CLI::PositiveNumber);
  app.add_flag("--defaults", o.defaults,
               "Only how far pictures of grids by default are from the voxels', with all of a file's fields");
  app.add_flag("--costs", o.costs, "Only what each channel and each kind of light costs, and its noise");
  app.add_option("--color-grid", o.color_grid, "With --costs: the volume's grid of colours");
  app.add_option("--environment", o.environment, "With --costs: a .hdr or .exr");
  app.add_flag("--equal-error", o.equal_error,
               "Only what each march takes to --target of a fire's picture, its grid's error and its noise together");
  add_peer_options(app, o);
  app.add_flag("--peers", o.peers,
               "Only what marches take to equal variance, those through NanoVDB grids among them, on the coarsest of "
               "--threshold's grids within --target of the voxels' picture");
  auto* few = app.add_option("--samples", o.fewest_samples, "A pixel, at least, in a timed run (default: 8; quick: 4)");
  few->check(CLI::Range(1U, 1024U));
  app.add_option("--threshold", o.thresholds,
                 "With --defaults, --equal-error and --peers: these thresholds instead of the default ones");
  app.add_option("--deviation", o.deviations, "With --defaults: these of the deviation criterion too");
  app.add_flag(
      "--denoise", o.denoise,
      "Only how good pictures of 1 to 64 samples are, raw and denoised, on eight scenes, how they flicker, and "
      "what it takes; --input NAME=FILE puts a file into a scene");
  app.add_flag("--settle", o.settle,
               "Only how far what is drawn is from the converged picture after a change, by time; --seconds of it");
  app.add_flag("--adaptive", o.adaptive,
               "Only what adaptive sampling takes to each --target of a picture's noise, over even, on these scenes; "
               "pictures of --repeats seeds against --reference-samples");
  app.add_flag("--techniques", o.techniques,
               "Only whether pictures of --reference-samples have the same means with each technique off, on them");
  app.add_option("--scene", o.scenes, "With these: cloud, full, fire, explosion, model, terrain, fog, lamp")
      ->check(CLI::IsMember(scenes));
  app.add_option("--oidn-weights", o.oidn_weights, "Folder of Open Image Denoise's networks (as of cumulet-render)");
  app.add_option("--reference-samples", o.reference_samples, "Of the pictures to come near (default: 8192)")
      ->check(CLI::Range(2U, 1U << 20U));
  app.add_option("--raw-samples", o.raw_samples, "Up to which raw pictures are judged (default: 256)")
      ->check(CLI::Range(64U, 1U << 16U));
  app.add_option("--frames", o.frames, "Of the orbit whose flicker is measured (default: 30; 0: none)")
      ->check(CLI::Range(0U, 1000U));
  app.add_option("--flicker-samples", o.flicker_samples, "A pixel, in each of these (default: 4)")
      ->check(CLI::Range(1U, 1024U));
  app.add_option("--flicker-reference-samples", o.flicker_reference_samples,
                 "A pixel, in each of those that they are held against (default: 256)")
      ->check(CLI::Range(2U, 1U << 16U));
  app.add_option("--budget", o.budget_ms, "With --settle: milliseconds a frame (default: 10)")
      ->check(CLI::PositiveNumber);
  const std::map<std::string, headless::Backend> backends{
      {"auto", headless::Backend::automatic}, {"egl", headless::Backend::egl}, {"osmesa", headless::Backend::osmesa}};
  app.add_option("--backend", backend, "auto|egl|osmesa")->check(CLI::IsMember({"auto", "egl", "osmesa"}));
  app.add_flag("--quick", o.quick, "A rougher look, in at most three minutes");
  auto* targets = app.add_option("--target", o.targets, "Image errors to match (default: 0.03; also 0.01)");
  targets->check(CLI::Range(1e-4, 0.5));
  auto* size = app.add_option("--size", o.size, "Pixels each way (default: 256; quick: 128)");
  size->check(CLI::Range(8U, 4096U));
  app.add_option("--optical-depth", o.optical_depth, "Mean optical depth of each asset (default: 10)")
      ->check(CLI::PositiveNumber);
  app.add_option("--albedo", o.albedo, "Single-scattering albedo (default: 1)")->check(CLI::Range(0.0F, 1.0F));
  auto* repeats = app.add_option("--repeats", o.repeats, "Interleaved repeats (default: 5; quick: 3)");
  repeats->check(CLI::Range(1, 99));
  auto* seconds =
      app.add_option("--seconds", o.seconds_a_run, "About, for one run of one march (default: 10; quick: 1)");
  auto* error_samples =
      app.add_option("--error-samples", o.error_samples, "Samples per pixel in each part of the error's estimate");
  error_samples->check(CLI::Range(1U, 4096U));
  app.add_option("--error-parts", o.error_parts, "Its independent parts: more are less noise (default: 2)")
      ->check(CLI::Range(2U, 1000U));
  app.add_option("--max-bounces", o.max_bounces, "Events of a path at most (default: no limit)");
  auto* sweep_cells = app.add_option("--sweep-cells", o.sweep_cells, "Where a sweep of thresholds ends");
  app.add_option("--max-cells", o.max_cells, "Most cells of a matched grid (default: 5400000)");
  auto* build_cells = app.add_option("--build-cells", o.build_cells, "Cells of the timed build (default: 5000000)");
  auto* triangles = app.add_option("--triangles", o.tree_triangles,
                                   "Triangles of each mesh that trees are built over (default: 1000000)");
  triangles->check(CLI::Range(100, 20'000'000));
  try {
    app.parse(argc, argv);
    for (const std::string& text : inputs) o.inputs.push_back(parse_input(text));
  } catch (const CLI::Error& error) {
    result.status = app.exit(error) == 0 ? 0 : 2;
    return result;
  }
  o.backend = backends.at(backend);
  if ((o.costs || o.equal_error || o.peers) && !repeats->empty() && o.repeats < 2) {
    std::fprintf(stderr,
                 "cumulet-bench: --costs, --equal-error and --peers take their noise from two --repeats or more\n");
    result.status = 2;
    return result;
  }
  if (o.quick) {
    if (size->empty()) o.size = 128;
    if (repeats->empty()) o.repeats = 3;
    if (seconds->empty()) o.seconds_a_run = 1.0;
    if (sweep_cells->empty()) o.sweep_cells = 300'000;
    if (build_cells->empty()) o.build_cells = 1'000'000;
    if (triangles->empty()) o.tree_triangles = 100'000;
    o.evaluations = 4;
    if (few->empty()) o.fewest_samples = 4;
    o.sweep_factor = 4.0;
  }
  o.sample_dir = samples;
  if (inputs.empty() && !o.denoise && !o.settle && !o.adaptive && !o.techniques) {
    const std::filesystem::path sample_dir(samples);
    o.inputs = {
        {"disney", std::filesystem::path(shared_data) / "vdb/wdas/wdas_cloud_sixteenth.vdb", "density", 0, true},
        {"cumulus", sample_dir / "cumulus.vdb", "density", 0, true},
        {"explosion", sample_dir / "explosion_0012.vdb", "density", 0, true}};
  }
  o.command = "cumulet-bench";
  for (int i = 1; i < argc; ++i) o.command += std::string(" ") + argv[i];
  return result;
}

}  // namespace cumulet::bench
