// cumulet-scene: writes the sample scene.

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>

#include "scene.hpp"

namespace {

void write(const std::filesystem::path& file, const openvdb::GridPtrVec& grids) {
  const std::filesystem::path unfinished = file.string() + ".part";
  openvdb::io::File out(unfinished.string());
  out.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK | openvdb::io::COMPRESS_ZIP);
  out.write(grids);
  out.close();
  std::filesystem::rename(unfinished, file);
  std::printf("%s:", file.string().c_str());
  for (const auto& grid : grids) {
    std::printf(" %s %llu active voxels", grid->getName().c_str(),
                static_cast<unsigned long long>(grid->activeVoxelCount()));
  }
  std::printf("\n");
}

int run(int argc, char** argv) {
  std::string folder;
  std::string only;
  bool full = false;
  double voxels = 0.0;
  std::uint32_t seed = 1;
  CLI::App app{"Writes Cumulet's sample scene: cumulus.vdb (density) and fire.vdb (density, temperature)"};
  app.add_option("OUT_DIR", folder, "folder to write to, made if it is missing")->required();
  app.add_flag("--full", full, "the detailed setting: over 20 million active voxels in the cumulus");
  app.add_option("--voxels", voxels, "about how many active voxels, in place of the setting's")
      ->check(CLI::Range(1000.0, 1e9));
  app.add_option("--seed", seed, "another cloud, another fire");
  app.add_option("--only", only, "write one of them")->check(CLI::IsMember({"cumulus", "fire"}));
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::cerr << "cumulet-scene: " << error.what() << "\n";
    return 2;
  }
  try {
    openvdb::initialize();
    std::filesystem::create_directories(folder);
    if (only != "fire") {
      const double count = voxels > 0.0 ? voxels : (full ? 22e6 : 1.2e6);
      write(std::filesystem::path(folder) / "cumulus.vdb", {cumulet::scene::make_cumulus({count, seed})});
    }
    if (only != "cumulus") {
      const double count = voxels > 0.0 ? voxels : (full ? 4e6 : 0.4e6);
      openvdb::GridPtrVec grids;
      for (const auto& grid : cumulet::scene::make_fire({count, seed})) grids.push_back(grid);
      write(std::filesystem::path(folder) / "fire.vdb", grids);
    }
  } catch (const std::exception& error) {
    std::cerr << "cumulet-scene: " << folder << ": " << error.what() << "\n";
    return 1;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (...) {
    return 1;
  }
}
