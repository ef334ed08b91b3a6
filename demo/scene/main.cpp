// cumulet-scene: writes the sample scene.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <optional>
#include <options.hpp>
#include <program.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "scene.hpp"
#include "surfaces.hpp"

namespace {

using std::filesystem::path;

// Whole, or not at all.
void replace(const path& file, const std::function<void(const path&)>& write) {
  const path unfinished = file.string() + ".part";
  write(unfinished);
  std::filesystem::rename(unfinished, file);
}

void write_grids(const path& file, const openvdb::GridPtrVec& grids) {
  replace(file, [&](const path& unfinished) {
    openvdb::io::File out(unfinished.string());
    out.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK | openvdb::io::COMPRESS_ZIP);
    out.write(grids);
    out.close();
  });
  std::printf("%s:", file.string().c_str());
  for (const auto& grid : grids) {
    std::printf(" %s %llu active voxels", grid->getName().c_str(),
                static_cast<unsigned long long>(grid->activeVoxelCount()));
  }
  std::printf("\n");
}

void write_surfaces(const path& file, std::uint32_t seed) {
  const std::string glb = cumulet::scene::make_surfaces(seed);
  replace(file, [&](const path& unfinished) {
    std::ofstream out(unfinished, std::ios::binary);
    if (!(out << glb).flush()) throw std::runtime_error("cannot write " + unfinished.string());
  });
  std::printf("%s: %zu bytes\n", file.string().c_str(), glb.size());
}

// Cumulus and mountains as README shows them.
void write_scene(const path& folder) {
  cumulet::demo::SceneOptions scene;
  scene.volume = (folder / "cumulus.vdb").string();
  scene.surfaces = (folder / "mountains.glb").string();
  scene.surface.indirect_roughness = 0.4F;  // or the sun in lake and windows makes specks
  const cumulet::scene::View view;
  for (glm::length_t i = 0; i < 3; ++i) {
    scene.camera.eye[i] = view.eye[i];
    scene.camera.target[i] = view.target[i];
  }
  scene.camera.fovy_degrees = view.fovy_degrees;
  scene.medium.density_scale = 0.7;
  scene.medium.max_bounces = 16;
  scene.display.exposure_stops = 0.5F;
  scene.light.sun_azimuth_degrees = -68.0F;
  scene.light.sun_elevation_degrees = 24.0F;
  std::copy_n(std::array{4.6F, 3.75F, 2.9F}.begin(), 3, scene.light.sun_irradiance);
  std::copy_n(std::array{0.10F, 0.18F, 0.34F}.begin(), 3, scene.light.sky_radiance);
  scene.grid.threshold = 0.01;
  scene.width = 800;
  scene.height = 450;
  scene.sampling.samples = 64;
  const path file = folder / "sample.json";
  cumulet::demo::save_scene(scene, file.string());
  std::printf("%s\n", file.string().c_str());
}

struct Wanted {
  std::string folder;
  std::string only;
  double voxels = 0.0;  // 0: the setting's
  bool full = false;
  std::uint32_t seed = 1;
};

/// Nothing after --help or --version.
std::optional<Wanted> parse(std::vector<std::string> arguments) {
  Wanted wanted;
  CLI::App app(
      "Writes Cumulet's sample scene: cumulus.vdb (density), mountains.glb (the ground, a tower) and sample.json, "
      "which shows both; and fire.vdb (density, temperature).",
      "cumulet-scene");
  app.footer("Exit status: 0 done; 1 failed, one line on standard error says why; 2 wrong usage.");
  app.add_option("OUT_DIR", wanted.folder, "Folder to write to, made if it is missing")->required()->type_name("DIR");
  app.add_flag("--full", wanted.full, "The detailed setting: over 20 million active voxels in the cumulus");
  app.add_option("--voxels", wanted.voxels, "About how many active voxels, in place of the setting's")
      ->check(CLI::Range(1000.0, 1e9).description(""))
      ->type_name("N");
  app.add_option("--seed", wanted.seed, "Another cloud, other mountains, another fire (default: 1)")->type_name("S");
  app.add_option("--only", wanted.only, "Write one of them")
      ->check(CLI::IsMember({"cumulus", "mountains", "fire"}).description(""))
      ->type_name("cumulus|mountains|fire");
  if (!cumulet::demo::parse_arguments(app, std::move(arguments), std::cout)) return std::nullopt;
  return wanted;
}

void write_all(const Wanted& options) {
  const path folder = options.folder;
  openvdb::initialize();
  std::filesystem::create_directories(folder);
  const auto wanted = [&](const char* part) { return options.only.empty() || options.only == part; };
  const auto voxels = [&](double full, double usual) {
    if (options.voxels > 0.0) return options.voxels;
    return options.full ? full : usual;
  };
  if (wanted("cumulus"))
    write_grids(folder / "cumulus.vdb", {cumulet::scene::make_cumulus({voxels(22e6, 1.2e6), options.seed})});
  if (wanted("mountains")) write_surfaces(folder / "mountains.glb", options.seed);
  if (options.only.empty()) write_scene(folder);
  if (wanted("fire")) {
    openvdb::GridPtrVec grids;
    for (const auto& grid : cumulet::scene::make_fire({voxels(4e6, 0.4e6), options.seed})) grids.push_back(grid);
    write_grids(folder / "fire.vdb", grids);
  }
}

}  // namespace

int main(int argc, char** argv) {
  return cumulet::demo::run_program("cumulet-scene", [&] {
    const auto wanted = parse({argv + std::min(argc, 1), argv + argc});
    if (!wanted) return;
    try {
      write_all(*wanted);
    } catch (const std::exception& error) {
      throw std::runtime_error(wanted->folder + ": " + error.what());
    }
  });
}
