#include "recording.hpp"

#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>

#include "asset.hpp"
#include "grid/grid_builder.hpp"
#include "subject.hpp"
#include "support/still.hpp"

namespace cumulet::bench {

namespace {

RecordingOptions recording_options(int argc, char** argv) {
  RecordingOptions options;
  for (int i = 1; i < argc; ++i) {
    const std::string flag = argv[i];
    const auto value = [&] {
      if (i + 1 >= argc) throw std::invalid_argument(flag + " needs a value");
      return std::string(argv[++i]);
    };
    if (flag == "--threshold")
      options.threshold = std::stod(value());
    else if (flag == "--optical-depth")
      options.optical_depth = std::stod(value());
    else if (flag == "--size")
      options.size = static_cast<std::uint32_t>(std::stoul(value()));
    else if (flag == "--samples")
      options.samples = static_cast<std::uint32_t>(std::stoul(value()));
    else if (!flag.starts_with("--"))
      options.files.emplace_back(flag);
    else
      throw std::invalid_argument(flag + " is no option here");
  }
  return options;
}

void record(headless::Context& context, const std::filesystem::path& file, const RecordingOptions& options,
            const UseRecording& use) {
  Input input;
  input.file = file;
  input.grid = "density";
  const Asset asset = load_asset(input);
  const double density_scale = asset.density_scale(options.optical_depth);
  test::Still still(context);
  still.viewer().camera()->frame(asset.volume->bounds(), 1.0);
  still.set_volume(asset.volume);
  still.set_light(bench_light());
  viewer::Medium medium;
  medium.density_scale = density_scale;
  still.set_medium(medium);
  viewer::GridSettings grid_settings;
  grid_settings.build.refine.criterion = grid::Criterion::transmittance;
  grid_settings.build.refine.threshold = options.threshold;
  still.set_grid(grid_settings);
  still.set_image({options.size, options.size, 1, 0});
  still.build();
  while (!still.render(500.0)) {
  }

  grid::RefineSettings refine = grid_settings.build.refine;
  refine.density_scale = density_scale;
  const volume::ScalarVolume& volume = asset.volume->volume();
  const grid::Statistics statistics(volume, grid::fit_cube(volume));
  const grid::DiamondSet diamonds(statistics, refine);
  grid::GridBuilder builder(statistics, diamonds);
  builder.bisect();
  const grid::TetGrid grid = builder.records(refine.cells, volume.max_value);
  if (grid.cells.size() != still.viewer().stats().cells) throw std::runtime_error("this is not the viewer's grid");

  core::Recording recording;
  recording.cm = still.viewer().trace_parameters();
  recording.cm.dispatch.samples = options.samples;
  recording.grid = &grid;
  use(recording, file, options);
}

}  // namespace

int record_files(int argc, char** argv, const char* program, const UseRecording& use) {
  try {
    const RecordingOptions options = recording_options(argc, argv);
    headless::Context context = headless::Context::create(headless::Backend::automatic);
    for (const std::filesystem::path& file : options.files) record(context, file, options, use);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", program, error.what());
    return 1;
  }
  return 0;
}

}  // namespace cumulet::bench
