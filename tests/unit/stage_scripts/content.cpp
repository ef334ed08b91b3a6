// Volumes, files and surfaces for the scripts.

#include <fstream>
#include <glm/gtc/matrix_transform.hpp>

#include "base/error.hpp"
#include "stage_scripts/scripts.hpp"
#include "support/clip.hpp"
#include "support/gltf_model.hpp"
#include "support/radiance.hpp"

namespace cumulet::test {

using glm::ivec3;

namespace {

constexpr ivec3 size(16);

volume::ScalarVolume noise(int seed) { return noise_volume(size, ivec3(0), seed); }

volume::ScalarVolume constant(float value) {
  return make_volume(size, ivec3(0), [=](const ivec3& /*p*/) { return value; });
}

viewer::VolumeAssetPtr asset_of(volume::VolumeFrame frame) {
  return std::make_shared<const viewer::VolumeAsset>(std::move(frame));
}

}  // namespace

// ---- volumes in memory ----

viewer::VolumeAssetPtr cloud(int side, int seed, const std::string& name) {
  volume::ScalarVolume density = noise_volume(ivec3(side), ivec3(0), seed);
  density.name = name;
  return std::make_shared<const viewer::VolumeAsset>(std::move(density));
}

viewer::VolumeAssetPtr fire() {
  volume::VolumeFrame frame{.density = noise(1)};
  frame.temperature = noise(2);
  frame.flame = noise(3);
  return asset_of(std::move(frame));
}

viewer::VolumeAssetPtr wind() {
  volume::VolumeFrame frame{.density = noise(1)};
  volume::Velocity velocity;
  for (std::size_t part = 0; part < velocity.parts.size(); ++part)
    velocity.parts[part] = constant(part == 0 ? 16.0F : 0.0F);
  frame.velocity = std::move(velocity);
  return asset_of(std::move(frame));
}

viewer::VolumeAssetPtr haze() {
  volume::VolumeFrame frame{.density = noise(1)};
  frame.anisotropy = {constant(0.5F), constant(0.0F)};
  for (volume::ScalarVolume& part : *frame.anisotropy) part.name = "g";
  return asset_of(std::move(frame));
}

viewer::VolumeAssetPtr nothing() {
  volume::ScalarVolume empty;
  empty.name = "empty";
  empty.bounds_max = empty.bounds_min;
  return std::make_shared<const viewer::VolumeAsset>(std::move(empty));
}

viewer::Medium medium_of(double density_scale) {
  viewer::Medium medium;
  medium.density_scale = density_scale;
  return medium;
}

viewer::GridSettings limited_grid() {
  viewer::GridSettings settings = fine_grid();
  settings.build.refine.max_cells = 200;
  return settings;
}

viewer::GridSettings adaptive_grid() {
  viewer::GridSettings settings;
  settings.camera_adaptive = true;
  return settings;
}

viewer::GridSettings fine_grid() {
  viewer::GridSettings settings;
  settings.build.refine.threshold = -1.0;
  return settings;
}

glm::dmat4 moved(double x, double y, double z) { return glm::translate(glm::dmat4(1.0), glm::dvec3(x, y, z)); }

glm::dmat4 scaled(double factor) { return glm::scale(glm::dmat4(1.0), glm::dvec3(factor)); }

// ---- files ----

void write_ball(const std::string& path, int frame) {
  openvdb::initialize();
  write_frame(path, {clip_ball(frame)});
}

void write_slow_ball(const std::string& path) {
  openvdb::initialize();
  const auto grid = fog("density");
  grid->sparseFill({{-24, -24, -24}, {23, 23, 23}}, 0.5F);
  grid->tree().voxelizeActiveTiles();
  grid->tree().setValueOn(openvdb::Coord(0, 0, 0), -1.0F);
  write_frame(path, {grid});
}

void write_grids(const std::string& path, const std::vector<std::string>& names) {
  openvdb::initialize();
  openvdb::GridCPtrVec grids;
  for (std::size_t i = 0; i < names.size(); ++i) grids.push_back(clip_ball(static_cast<int>(i), names[i]));
  write_frame(path, grids);
}

std::vector<std::string> write_clip(const StageRecorder& recorder, int frames) {
  std::vector<std::string> paths;
  for (int frame = 0; frame < frames; ++frame) {
    paths.push_back(recorder.path("clip." + std::to_string(frame) + ".vdb"));
    write_ball(paths.back(), frame);
  }
  return paths;
}

void write_text(const std::string& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

void write_model(const std::string& path, bool slow) {
  GltfModel model;
  const int node = model.show({{"attributes", {{"POSITION", model.triangle()}}}});
  model.add(
      "animations",
      {{"samplers", json::array({{{"input", model.scalars({0, 2})}, {"output", model.vec3({0, 0, 0, 4, 0, 0})}}})},
       {"channels", json::array({{{"sampler", 0}, {"target", {{"node", node}, {"path", "translation"}}}}})}});
  const int camera = model.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 0.5}, {"znear", 0.1}}}});
  const int eye = model.add("nodes", {{"camera", camera}, {"translation", {0, 1, 8}}});
  model.root["scenes"] = json::array({{{"nodes", {node, eye}}}});
  model.root["scene"] = 0;
  if (slow) model.root["extensionsUsed"] = {"NONE_of_them"};
  const Bytes bytes = model.gltf();
  write_text(path, std::string(bytes.begin(), bytes.end()));
}

void write_radiance(const std::string& path, unsigned width) { write_text(path, radiance_file(width, width / 2)); }

// ---- surfaces in memory ----

surface::Pose GatedScene::pose(double time, std::size_t animation, const Progress* progress) const {
  gate_.pass("pose at " + text_of(time) + ".");
  return StillScene::pose(time, animation, progress);
}

surface::Pose MovingScene::pose(double time, std::size_t animation, const Progress* progress) const {
  if (time < 0.0) throw Error(ErrorCode::unsupported, "there is no pose at negative times");
  surface::Pose posed = StillScene::pose(time, animation, progress);
  for (surface::PosedVertex& vertex : posed.vertices) vertex.position.x += static_cast<float>(time);
  posed.low.x += time;
  posed.high.x += time;
  return posed;
}

std::optional<surface::PoseEnds> MovingScene::pose_ends(double time, std::size_t animation, double seconds,
                                                        const Progress* progress) const {
  return surface::PoseEnds{pose(time - 0.5 * seconds, animation, progress),
                           pose(time + 0.5 * seconds, animation, progress)};
}

}  // namespace cumulet::test
