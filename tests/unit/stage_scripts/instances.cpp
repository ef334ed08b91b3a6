// Scripts: instances of volumes, and limits of memory, cells and threads.

#include <utility>

#include "stage_scripts/scripts.hpp"

namespace cumulet::test {

namespace {

InstancePtr instance_of(viewer::VolumeAssetPtr volume, const glm::dmat4& to_world = glm::dmat4(1.0)) {
  return std::make_shared<viewer::Instance>(
      viewer::InstanceSettings{.volume = std::move(volume), .to_world = to_world});
}

// ---- instances ----

void instances_added_and_removed(StageRecorder& r) {
  const InstancePtr a = instance_of(cloud(16, 1, "a"));
  const InstancePtr b = instance_of(cloud(16, 2, "b"), moved(30.0));
  add(r, "a", a);
  r.wait();
  r.frame();
  add(r, "b", b);
  r.wait();
  r.frame();
  remove(r, "a", a);
  r.wait();
  r.frame();
  add(r, "a", a);
  r.wait();
  r.frame();
  remove(r, "a", a);
  remove(r, "b", b);
  r.wait();
  r.frame();
  r.contents();
}

void instances_share_the_grid_of_a_volume(StageRecorder& r) {
  const viewer::VolumeAssetPtr volume = cloud(16, 1);
  const InstancePtr a = instance_of(volume);
  const InstancePtr b = instance_of(volume, moved(30.0));
  const InstancePtr c = instance_of(volume, moved(60.0) * scaled(0.5));
  add(r, "a", a);
  add(r, "b", b);
  r.wait();
  r.frame();
  add(r, "c", c);
  r.wait();
  r.frame();
  remove(r, "a", a);
  r.wait();
  r.frame();
}

// The grid is as fine as the densest instance needs.
void instances_of_several_media(StageRecorder& r) {
  const viewer::VolumeAssetPtr volume = cloud(16, 1);
  const InstancePtr a = instance_of(volume);
  const InstancePtr b = instance_of(volume, moved(30.0));
  r.call("set the grid", [&] {
    viewer::GridSettings settings;
    settings.build.refine.criterion = grid::Criterion::transmittance;
    settings.build.refine.threshold = 0.1;
    r.viewer().set_grid(settings);
  });
  add(r, "a", a);
  add(r, "b", b);
  r.wait();
  r.frame();
  edit(r, "b is a little denser", b, [](auto& settings) { settings.medium.density_scale = 1.5; });
  edit(r, "b is denser", b, [](auto& settings) { settings.medium.density_scale = 8.0; });
  edit(r, "a is larger", a, [](auto& settings) { settings.to_world = scaled(4.0); });
  edit(r, "b has a ramp", b, [](auto& settings) {
    settings.ramps.density = volume::Ramp({{0.0F, 0.0F}, {1.0F, 2.0F}});
  });
}

void instances_hidden(StageRecorder& r) {
  const InstancePtr a = instance_of(cloud(16, 1, "a"));
  const InstancePtr b = instance_of(cloud(16, 2, "b"), moved(30.0));
  add(r, "a", a);
  add(r, "b", b);
  r.wait();
  r.frame();
  edit(r, "hide a", a, [](auto& settings) { settings.hidden = true; });
  edit(r, "show a", a, [](auto& settings) { settings.hidden = false; });
  edit(r, "hide b", b, [](auto& settings) { settings.hidden = true; });
  r.call("set the grid", [&] { r.viewer().set_grid(limited_grid()); });
  r.wait();
  r.frame();
  edit(r, "show b", b, [](auto& settings) { settings.hidden = false; });
}

void instance_settings(StageRecorder& r) {
  const InstancePtr a = instance_of(cloud(16, 1));
  add(r, "a", a);
  r.wait();
  r.frame();
  edit(r, "nothing", a, [](auto& /*settings*/) {});
  edit(r, "group", a, [](auto& settings) { settings.medium.group = 3; });
  edit(r, "holdout", a, [](auto& settings) { settings.medium.holdout = true; });
  edit(r, "tag", a, [](auto& settings) { settings.tag = 7; });
  edit(r, "previous transform", a, [](auto& settings) { settings.previous = scene::InstanceTransform{moved(-1.0)}; });
  edit(r, "motion", a, [](auto& settings) { settings.ends = scene::ShutterTransforms{moved(-1.0), moved(1.0)}; });
  r.call("open the shutter", [&] {
    viewer::Sampling sampling;
    sampling.shutter_seconds = 0.5;
    r.viewer().set_sampling(sampling);
  });
  r.wait();
  r.frame();
  edit(r, "another volume", a, [](auto& settings) { settings.volume = cloud(16, 2, "b"); });
  edit(r, "no volume", a, [](auto& settings) { settings.volume = nullptr; });
  edit(r, "a volume again", a, [](auto& settings) { settings.volume = cloud(16, 3, "c"); });
}

// A clip changes the scene, and requests no work.
void volumes_clipped(StageRecorder& r) {
  const InstancePtr a = instance_of(cloud(16, 1, "a"), moved(30.0));
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 2, "own")); });
  add(r, "a", a);
  r.wait();
  r.frame();
  r.call("clip the volume", [&] { r.viewer().set_clip({{1.0, 0.0, 0.0, 2.0}, {0.0, -1.0, 0.0, 3.0}}); });
  r.frame();
  edit(r, "clip a", a, [](auto& settings) { settings.clip = {{0.0, 0.0, 1.0, 0.5}}; });
  r.call("no clip of the volume", [&] { r.viewer().set_clip({}); });
  r.frame();
}

// The newest request wins, and the one that was begun is finished.
void instance_changes_while_building(StageRecorder& r) {
  const InstancePtr a = instance_of(cloud(24, 1));
  r.call("set the grid", [&] { r.viewer().set_grid(limited_grid()); });
  r.hold(limited_cells);
  add(r, "a", a);
  r.frame();
  r.held();
  for (const float value : {2.0F, 3.0F}) {
    r.call("ramp to " + text_of(double{value}), [&] {
      a->edit([&](auto& settings) { settings.ramps.density = volume::Ramp({{0.0F, 0.0F}, {1.0F, value}}); });
    });
    r.frame();
  }
  r.release();
  r.wait();
  r.frame();
}

void instance_removed_while_building(StageRecorder& r) {
  const InstancePtr a = instance_of(cloud(24, 1, "a"));
  const InstancePtr b = instance_of(cloud(24, 2, "b"));
  r.call("set the grid", [&] { r.viewer().set_grid(limited_grid()); });
  r.hold(limited_cells);
  add(r, "a", a);
  r.frame();
  r.held();
  remove(r, "a", a);
  add(r, "b", b);
  r.frame();
  r.release();
  r.wait();
  r.frame();
}

void instances_cancelled_while_building(StageRecorder& r) {
  const InstancePtr a = instance_of(cloud(24, 1, "a"));
  r.call("set the grid", [&] { r.viewer().set_grid(limited_grid()); });
  r.hold(limited_cells);
  add(r, "a", a);
  r.frame();
  r.held();
  r.call("cancel", [&] { r.viewer().cancel(); });
  r.release();
  r.wait();
  r.status();
  r.frame();
  r.call("rebuild", [&] { r.viewer().rebuild(); });
  r.wait();
  r.frame();
}

// Instances use the grid of the viewer's own volume.
void instances_of_the_own_volume(StageRecorder& r) {
  const viewer::VolumeAssetPtr volume = cloud(16, 1);
  const InstancePtr a = instance_of(volume, moved(30.0));
  r.call("set the volume", [&] { r.viewer().set_volume(volume); });
  r.wait();
  r.frame();
  add(r, "a", a);
  r.wait();
  r.frame();
  r.call("set the grid", [&] {
    viewer::GridSettings settings;
    settings.build.refine.threshold = 0.1;
    r.viewer().set_grid(settings);
  });
  r.wait();
  r.frame();
  r.call("remove the volume", [&] { r.viewer().set_volume(nullptr); });
  r.wait();
  r.frame();
  r.call("set the volume", [&] { r.viewer().set_volume(volume); });
  r.wait();
  r.frame();
  remove(r, "a", a);
  r.wait();
  r.frame();
}

// The own grid is being built, so that no other one is requested.
void instance_waits_for_the_own_grid(StageRecorder& r) {
  const viewer::VolumeAssetPtr volume = cloud(24, 1);
  r.call("set the grid", [&] { r.viewer().set_grid(limited_grid()); });
  r.hold(limited_cells);
  r.call("set the volume", [&] { r.viewer().set_volume(volume); });
  r.held();
  add(r, "a", instance_of(volume, moved(40.0)));
  r.frame();
  r.release();
  r.wait();
  r.frame();
}

void instances_beside_a_volume(StageRecorder& r) {
  const InstancePtr a = instance_of(cloud(16, 2, "a"), moved(30.0));
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  add(r, "a", a);
  r.wait();
  r.frame();
  viewer::GridSettings settings;
  settings.build.march = scene::March::brick;
  r.call("bricks", [&] { r.viewer().set_grid(settings); });
  r.wait();
  r.frame();
  settings.build.march = scene::March::tet;
  settings.build.on = viewer::BuildOn::gpu;
  r.call("tetrahedra by the GPU", [&] { r.viewer().set_grid(settings); });
  r.wait();
  r.frame();
  r.call("rebuild", [&] { r.viewer().rebuild(); });
  r.wait();
  r.frame();
  r.call("set the medium", [&] { r.viewer().set_medium(medium_of(2.0)); });
  r.frame();
}

// ---- limits ----

viewer::Viewer::Limits gl_limit(std::uint64_t bytes) {
  viewer::Viewer::Limits limits;
  limits.gl_bytes = bytes;
  return limits;
}

void limit_of_cells(StageRecorder& r) {
  viewer::GridSettings settings = limited_grid();
  r.call("set the grid", [&] { r.viewer().set_grid(settings); });
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  settings.build.refine.max_cells = 400;
  r.call("more cells", [&] { r.viewer().set_grid(settings); });
  r.wait();
  r.frame();
  r.call("all cells", [&] { r.viewer().set_grid({}); });
  r.wait();
  r.frame();
}

void limit_of_gl_memory(StageRecorder& r) {
  viewer::GridSettings settings = fine_grid();
  r.call("set the grid", [&] { r.viewer().set_grid(settings); });
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(24, 1)); });
  r.wait();
  r.frame();
  const auto limit = [&](std::uint64_t bytes) {
    r.call("limit GL memory to " + std::to_string(bytes), [&] { r.viewer().set_limits(gl_limit(bytes)); });
    r.wait();
    r.frame();
  };
  limit(600'000);
  limit(600'000);
  limit(300'000);
  limit(viewer::ResourceLimits::no_limit);
  settings.build.on = viewer::BuildOn::gpu;
  r.call("by the GPU", [&] { r.viewer().set_grid(settings); });
  r.wait();
  r.frame();
  limit(16'000'000);
  limit(600'000);
  limit(viewer::ResourceLimits::no_limit);
}

void limit_of_gl_memory_with_images(StageRecorder& r) {
  viewer::Viewer::SimulatedGl gl;
  gl.bytes_beside_volumes = 500'000;
  r.call("simulate GL", [&] { r.viewer().simulate_gl(gl); });
  r.call("set the grid", [&] { r.viewer().set_grid(fine_grid()); });
  r.call("limit GL memory", [&] { r.viewer().set_limits(gl_limit(1'500'000)); });
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(24, 1)); });
  r.wait();
  r.frame();
  add(r, "a", instance_of(cloud(24, 2, "a"), moved(40.0)));
  for (int i = 0; i < 3; ++i) {
    r.wait();
    r.frame();
  }
  gl.bytes_beside_volumes = 900'000;
  r.call("larger images", [&] { r.viewer().simulate_gl(gl); });
  for (int i = 0; i < 3; ++i) {
    r.frame();
    r.wait();
  }
  r.call("rebuild", [&] { r.viewer().rebuild(); });
  r.wait();
  r.frame();
}

void limit_of_gl_memory_is_shared(StageRecorder& r) {
  const InstancePtr b = instance_of(cloud(24, 3, "b"), moved(80.0));
  r.call("set the grid", [&] { r.viewer().set_grid(fine_grid()); });
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(24, 1)); });
  add(r, "a", instance_of(cloud(24, 2, "a"), moved(40.0)));
  r.wait();
  r.frame();
  r.call("limit GL memory", [&] { r.viewer().set_limits(gl_limit(1'200'000)); });
  r.wait();
  r.frame();
  add(r, "b", b);
  r.wait();
  r.frame();
  remove(r, "b", b);
  r.wait();
  r.frame();
  r.call("no limit", [&] { r.viewer().set_limits({}); });
  r.wait();
  r.frame();
}

void limit_of_memory(StageRecorder& r) {
  viewer::Viewer::Limits limits;
  limits.memory_bytes = 1;
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  r.call("limit the memory", [&] { r.viewer().set_limits(limits); });
  r.wait();
  r.frame();
  r.call("set another volume", [&] { r.viewer().set_volume(cloud(16, 2, "other")); });
  r.wait();
  r.status();
  r.frame();
  add(r, "a", instance_of(cloud(16, 3, "a"), moved(30.0)));
  r.wait();
  r.frame();
  r.call("no limit", [&] { r.viewer().set_limits({}); });
  r.call("rebuild", [&] { r.viewer().rebuild(); });
  r.wait();
  r.frame();
}

void limit_of_threads(StageRecorder& r) {
  viewer::Viewer::Limits limits;
  for (const unsigned threads : {1U, 2U}) {
    limits.threads = threads;
    r.call(std::to_string(threads) + " threads", [&] { r.viewer().set_limits(limits); });
    r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
    r.wait();  // which of two grids is built first is not defined
    add(r, "a", instance_of(cloud(16, 2, "a"), moved(30.0)));
    r.wait();
    r.frame();
  }
}

}  // namespace

std::vector<StageScript> instance_scripts() {
  return {{"instances_added_and_removed", instances_added_and_removed},
          {"instances_share_the_grid_of_a_volume", instances_share_the_grid_of_a_volume},
          {"instances_of_several_media", instances_of_several_media},
          {"instances_hidden", instances_hidden},
          {"instance_settings", instance_settings},
          {"volumes_clipped", volumes_clipped},
          {"instance_changes_while_building", instance_changes_while_building},
          {"instance_removed_while_building", instance_removed_while_building},
          {"instances_cancelled_while_building", instances_cancelled_while_building},
          {"instances_of_the_own_volume", instances_of_the_own_volume},
          {"instance_waits_for_the_own_grid", instance_waits_for_the_own_grid},
          {"instances_beside_a_volume", instances_beside_a_volume}};
}

std::vector<StageScript> limit_scripts() {
  return {{"limit_of_cells", limit_of_cells},
          {"limit_of_gl_memory", limit_of_gl_memory},
          {"limit_of_gl_memory_with_images", limit_of_gl_memory_with_images},
          {"limit_of_gl_memory_is_shared", limit_of_gl_memory_is_shared},
          {"limit_of_memory", limit_of_memory},
          {"limit_of_threads", limit_of_threads}};
}

}  // namespace cumulet::test
