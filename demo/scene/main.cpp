// cumulet-scene: writes the sample scene.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <scene_file.hpp>
#include <stdexcept>

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

int run(int argc, char** argv) {
  std::string folder;
  std::string only;
  bool full = false;
  double voxels = 0.0;
  std::uint32_t seed = 1;
  CLI::App app{
      "Writes Cumulet's sample scene: cumulus.vdb (density), mountains.glb (the ground, a tower) and sample.json, "
      "which shows both; and fire.vdb (density, temperature)"};
  app.add_option("OUT_DIR", folder, "folder to write to, made if it is missing")->required();
  app.add_flag("--full", full, "the detailed setting: over 20 million active voxels in the cumulus");
  app.add_option("--voxels", voxels, "about how many active voxels, in place of the setting's")
      ->check(CLI::Range(1000.0, 1e9));
  app.add_option("--seed", seed, "another cloud, other mountains, another fire");
  app.add_option("--only", only, "write one of them")->check(CLI::IsMember({"cumulus", "mountains", "fire"}));
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
    const auto wanted = [&](const char* part) { return only.empty() || only == part; };
    if (wanted("cumulus")) {
      const double count = voxels > 0.0 ? voxels : (full ? 22e6 : 1.2e6);
      write_grids(path(folder) / "cumulus.vdb", {cumulet::scene::make_cumulus({count, seed})});
    }
    if (wanted("mountains")) write_surfaces(path(folder) / "mountains.glb", seed);
    if (only.empty()) write_scene(folder);
    if (wanted("fire")) {
      const double count = voxels > 0.0 ? voxels : (full ? 4e6 : 0.4e6);
      openvdb::GridPtrVec grids;
      for (const auto& grid : cumulet::scene::make_fire({count, seed})) grids.push_back(grid);
      write_grids(path(folder) / "fire.vdb", grids);
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
