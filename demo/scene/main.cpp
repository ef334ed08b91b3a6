// cumulet-scene: writes the sample scenes.

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
#include <presets.hpp>
#include <program.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "scene.hpp"
#include "surfaces.hpp"

namespace {

using std::filesystem::path;

// Writes a file atomically.
void replace(const path& file, const std::function<void(const path&)>& write) {
  const path unfinished = file.string() + ".part";
  write(unfinished);
  std::filesystem::rename(unfinished, file);
}

template <class Grids>
void write_grids(const path& file, const Grids& grids) {
  replace(file, [&](const path& unfinished) {
    openvdb::io::File out(unfinished.string());
    out.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK | openvdb::io::COMPRESS_ZIP);
    out.write(openvdb::GridCPtrVec(grids.begin(), grids.end()));
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

void save(const cumulet::demo::SceneOptions& scene, const path& file) {
  // Version 1, so that programs for scene files of Cumulet 0.1 can read the samples too.
  cumulet::demo::save_scene(scene, file.string(), cumulet::demo::SceneFormat::first);
  std::printf("%s\n", file.string().c_str());
}

void look(cumulet_camera_desc& camera, const cumulet::scene::View& view) {
  for (glm::length_t i = 0; i < 3; ++i) {
    camera.eye[i] = view.eye[i];
    camera.target[i] = view.target[i];
  }
  camera.fovy_degrees = view.fovy_degrees;
}

// Writes the cumulus and the mountains as shown in README.
void write_scene(const path& folder) {
  cumulet::demo::SceneOptions scene;
  scene.volume = (folder / "cumulus.vdb").string();
  scene.surfaces = (folder / "mountains.glb").string();
  scene.surface.indirect_roughness = 0.4F;  // avoids fireflies from the sun's reflections in lake and windows
  look(scene.camera, {});
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
  save(scene, folder / "sample.json");
}

path explosion_file(const path& folder, int frame) {
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "explosion_%04d.vdb", frame);
  return folder / name.data();
}

// Writes the explosion in evening light, at the frame shown in README: half fire, half soot.
void write_explosion_scene(const path& folder, int frame) {
  cumulet::demo::SceneOptions scene;
  scene.volume = explosion_file(folder, frame).string();
  look(scene.camera, {{4.0F, 2.2F, 22.0F}, {0.3F, 4.6F, 0.0F}, 33.0});
  scene.medium.density_scale = 9.0;
  cumulet::demo::apply(cumulet::demo::Preset::explosion, scene.medium);
  scene.light.sky = CUMULET_SKY_PHYSICAL;
  scene.light.turbidity = 3.0F;
  scene.light.ground_albedo = 0.2F;
  scene.light.sun_azimuth_degrees = 62.0F;
  scene.light.sun_elevation_degrees = 13.0F;
  scene.display.exposure_stops = 0.3F;
  scene.display.tone_map = CUMULET_TONE_MAP_FILMIC;
  scene.width = 800;
  scene.height = 500;
  scene.sampling.samples = 64;
  save(scene, folder / "sample_explosion.json");
}

struct Wanted {
  std::string folder;
  std::string only;
  double voxels = 0.0;  // 0: the default of Settings
  int frame = 0;        // frame of the explosion; 0: all
  bool full = false;
  std::uint32_t seed = 1;
};

/// Parses the arguments; nullopt after --help or --version.
std::optional<Wanted> parse(std::vector<std::string> arguments) {
  Wanted wanted;
  CLI::App app(
      "Writes Cumulet's sample scenes. sample.json shows cumulus.vdb (density) and mountains.glb (landscape and "
      "tower); sample_explosion.json shows a frame of explosion_0001.vdb to explosion_0020.vdb (density, temperature, "
      "flame).",
      "cumulet-scene");
  app.footer("Exit status: 0 success; 1 failure, with one line on standard error; 2 wrong usage.");
  app.add_option("OUT_DIR", wanted.folder, "Output folder; created if it does not exist")->required()->type_name("DIR");
  app.add_flag("--full", wanted.full, "High detail: over 20 million active voxels in the cumulus");
  app.add_option("--voxels", wanted.voxels, "Approximate number of active voxels; overrides --full")
      ->check(CLI::Range(1000.0, 1e9).description(""))
      ->type_name("N");
  app.add_option("--seed", wanted.seed, "Random seed for the shapes of cloud, mountains and explosion (default: 1)")
      ->type_name("S");
  app.add_option("--only", wanted.only, "Write only this part of the sample scenes")
      ->check(CLI::IsMember({"cumulus", "mountains", "explosion"}).description(""))
      ->type_name("cumulus|mountains|explosion");
  app.add_option("--frame", wanted.frame,
                 "Write only this frame of the explosion; the scene file shows it (default: all frames; the scene file "
                 "shows 12)")
      ->check(CLI::Range(1, cumulet::scene::explosion_frames).description(""))
      ->type_name("N");
  if (!cumulet::demo::parse_arguments(app, std::move(arguments), std::cout)) return std::nullopt;
  if (wanted.frame > 0 && !wanted.only.empty() && wanted.only != "explosion")
    throw cumulet::demo::UsageError("--frame needs the explosion, but --only " + wanted.only + " excludes it");
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
    write_grids(folder / "cumulus.vdb", std::array{cumulet::scene::make_cumulus({voxels(22e6, 1.2e6), options.seed})});
  if (wanted("mountains")) write_surfaces(folder / "mountains.glb", options.seed);
  if (options.only.empty()) {
    write_scene(folder);
    write_explosion_scene(folder, options.frame > 0 ? options.frame : cumulet::scene::shown_frame);
  }
  if (wanted("explosion")) {
    const cumulet::scene::Settings settings{voxels(6e6, 1e6), options.seed};
    for (int frame = 1; frame <= cumulet::scene::explosion_frames; ++frame) {
      if (options.frame > 0 && frame != options.frame) continue;
      write_grids(explosion_file(folder, frame), cumulet::scene::make_explosion(settings, frame));
    }
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
