// Scripts: the viewer's own volume, from files and from memory, and the settings of its grid.

#include "scene/phase.hpp"
#include "stage_scripts/scripts.hpp"

namespace cumulet::test {

namespace {

// ---- loads ----

void load_file(StageRecorder& r) {
  write_ball(r.path("a.vdb"), 0);
  r.load("a.vdb");
  r.wait();
  r.status();
  r.frame();
  r.frame();
  r.contents();
}

void load_after_load(StageRecorder& r) {
  write_ball(r.path("a.vdb"), 0);
  write_ball(r.path("b.vdb"), 3);
  r.load("a.vdb");
  r.wait();
  r.frame();
  r.load("b.vdb");
  r.wait();
  r.frame();
  r.load("b.vdb");
  r.wait();
  r.frame();
}

void load_replaced_while_reading(StageRecorder& r) {
  write_slow_ball(r.path("slow.vdb"));
  write_ball(r.path("b.vdb"), 1);
  r.hold(negative_voxel);
  r.load("slow.vdb");
  r.held();
  r.frame();
  r.load("b.vdb");
  r.release();
  r.wait();
  r.frame();
  r.status();
}

// The second of three loads never begins.
void load_replaced_twice_while_reading(StageRecorder& r) {
  write_slow_ball(r.path("slow.vdb"));
  write_ball(r.path("b.vdb"), 1);
  write_ball(r.path("c.vdb"), 2);
  r.hold(negative_voxel);
  r.load("slow.vdb");
  r.held();
  r.load("b.vdb");
  r.load("c.vdb");
  r.release();
  r.wait();
  r.frame();
}

void load_replaced_by_memory_while_reading(StageRecorder& r) {
  write_slow_ball(r.path("slow.vdb"));
  r.hold(negative_voxel);
  r.load("slow.vdb");
  r.held();
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.release();
  r.wait();
  r.frame();
  r.status();
}

void load_fails(StageRecorder& r) {
  r.load("missing.vdb");
  r.wait();
  r.status();
  r.frame();
  r.wait();
  write_text(r.path("broken.vdb"), "no volume");
  r.load("broken.vdb");
  r.wait();
  r.frame();
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.status();
  r.frame();
}

void load_fails_and_the_volume_stays(StageRecorder& r) {
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  r.load("missing.vdb");
  r.wait();
  r.frame();
  r.contents();
}

void load_cancelled(StageRecorder& r) {
  write_slow_ball(r.path("slow.vdb"));
  r.hold(negative_voxel);
  r.load("slow.vdb");
  r.held();
  r.call("cancel", [&] { r.viewer().cancel(); });
  r.release();
  r.wait();
  r.status();
  r.frame();
  r.load("slow.vdb");
  r.wait();
  r.frame();
}

void load_by_grid_names(StageRecorder& r) {
  write_grids(r.path("grids.vdb"), {"smoke", "heat", "flames", "other"});
  r.load("grids.vdb");
  r.wait();
  r.frame();
  r.load("grids.vdb", [](viewer::VolumeFile& file) {
    file.grids.density = "other";
    file.grids.temperature = "none";
  });
  r.wait();
  r.frame();
  r.load("grids.vdb", [](viewer::VolumeFile& file) { file.grids.density = "absent"; });
  r.wait();
  r.frame();
}

void load_with_transform(StageRecorder& r) {
  write_ball(r.path("a.vdb"), 0);
  r.load("a.vdb", [](viewer::VolumeFile& file) { file.to_world = moved(5.0) * scaled(0.5); });
  r.wait();
  r.frame();
  r.contents();
}

void load_takes_the_suggested_density_scale(StageRecorder& r) {
  const auto suggested = [](viewer::VolumeFile& file) { file.suggested_density_scale = true; };
  write_ball(r.path("a.vdb"), 0);
  write_ball(r.path("b.vdb"), 4);
  r.load("a.vdb", suggested);
  r.wait();
  r.frame();
  r.call("set the density scale", [&] { r.viewer().set_medium(medium_of(3.0)); });
  r.wait();
  r.frame();
  r.call("double the size", [&] { r.viewer().set_transforms({{scaled(2.0)}}); });
  r.wait();
  r.frame();
  r.load("b.vdb", suggested);
  r.wait();
  r.frame();
  r.load("a.vdb");
  r.wait();
  r.frame();
}

void settings_change_while_reading(StageRecorder& r) {
  write_slow_ball(r.path("slow.vdb"));
  r.hold(negative_voxel);
  r.load("slow.vdb");
  r.held();
  r.call("set the grid", [&] {
    viewer::GridSettings settings;
    settings.build.refine.threshold = 0.1;
    r.viewer().set_grid(settings);
  });
  r.call("set the medium", [&] { r.viewer().set_medium(medium_of(4.0)); });
  r.call("set a ramp", [&] { r.viewer().set_ramps({.density = volume::Ramp({{0.0F, 0.0F}, {1.0F, 2.0F}})}); });
  r.call("open the shutter", [&] {
    viewer::Sampling sampling;
    sampling.shutter_seconds = 0.5;
    r.viewer().set_sampling(sampling);
  });
  r.release();
  r.wait();
  r.frame();
}

// ---- proxies ----

void with_proxy(viewer::VolumeFile& file) { file.min_proxy_bricks = 1; }

void proxy_until_the_load_ends(StageRecorder& r) {
  write_slow_ball(r.path("slow.vdb"));
  r.hold(negative_voxel);
  r.load("slow.vdb", with_proxy);
  r.held();
  r.frame();
  r.frame();
  r.contents();
  r.release();
  r.wait();
  r.frame();
  r.contents();
}

void proxy_leaves_with_a_cancelled_load(StageRecorder& r) {
  write_slow_ball(r.path("slow.vdb"));
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  r.hold(negative_voxel);
  r.load("slow.vdb", with_proxy);
  r.held();
  r.frame();
  r.call("cancel", [&] { r.viewer().cancel(); });
  r.frame();
  r.release();
  r.wait();
  r.frame();
}

void proxy_with_the_suggested_density_scale(StageRecorder& r) {
  write_slow_ball(r.path("slow.vdb"));
  r.hold(negative_voxel);
  r.load("slow.vdb", [](viewer::VolumeFile& file) {
    with_proxy(file);
    file.suggested_density_scale = true;
  });
  r.held();
  r.frame();
  r.release();
  r.wait();
  r.frame();
}

void no_proxy_without_previews(StageRecorder& r) {
  write_slow_ball(r.path("slow.vdb"));
  const auto set_preview = [&](bool preview) {
    r.call(preview ? "previews" : "no previews", [&] {
      viewer::Sampling sampling;
      sampling.options.preview = preview;
      r.viewer().set_sampling(sampling);
    });
  };
  set_preview(false);
  r.hold(negative_voxel);
  r.load("slow.vdb", with_proxy);
  r.held();
  r.frame();
  set_preview(true);
  r.frame();
  r.release();
  r.wait();
  r.frame();
  r.hold(negative_voxel);
  r.load("slow.vdb", with_proxy);
  r.held();
  r.frame();
  set_preview(false);
  r.frame();
  r.release();
  r.wait();
}

// ---- volumes from memory ----

void memory_volume(StageRecorder& r) {
  const viewer::VolumeAssetPtr first = cloud(24, 1);
  r.frame();
  r.call("set the volume", [&] { r.viewer().set_volume(first); });
  r.wait();
  r.frame();
  r.call("set another volume", [&] { r.viewer().set_volume(cloud(16, 2, "other")); });
  r.wait();
  r.frame();
  r.call("set the first again", [&] { r.viewer().set_volume(first); });
  r.wait();
  r.frame();
  r.call("remove the volume", [&] { r.viewer().set_volume(nullptr); });
  r.wait();
  r.frame();
  r.contents();
}

void empty_volume(StageRecorder& r) {
  r.call("set an empty volume", [&] { r.viewer().set_volume(nothing()); });
  r.wait();
  r.frame();
  r.contents();
}

void volume_replaced_while_building(StageRecorder& r) {
  r.call("set the grid", [&] { r.viewer().set_grid(limited_grid()); });
  r.hold(limited_cells);
  r.call("set volume a", [&] { r.viewer().set_volume(cloud(24, 1, "a")); });
  r.held();
  r.call("set volume b", [&] { r.viewer().set_volume(cloud(24, 2, "b")); });
  r.call("set volume c", [&] { r.viewer().set_volume(cloud(24, 3, "c")); });
  r.frame();
  r.release();
  r.wait();
  r.frame();
}

void volume_removed_while_building(StageRecorder& r) {
  r.call("set the grid", [&] { r.viewer().set_grid(limited_grid()); });
  r.hold(limited_cells);
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(24, 1)); });
  r.held();
  r.call("remove the volume", [&] { r.viewer().set_volume(nullptr); });
  r.frame();
  r.release();
  r.wait();
  r.status();
  r.frame();
}

void build_cancelled(StageRecorder& r) {
  r.call("set the grid", [&] { r.viewer().set_grid(limited_grid()); });
  r.hold(limited_cells);
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(24, 1)); });
  r.held();
  r.call("cancel", [&] { r.viewer().cancel(); });
  r.release();
  r.wait();
  r.frame();
  r.call("rebuild", [&] { r.viewer().rebuild(); });
  r.wait();
  r.frame();
}

void rebuild(StageRecorder& r) {
  r.call("rebuild nothing", [&] { r.viewer().rebuild(); });
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  r.call("rebuild", [&] { r.viewer().rebuild(); });
  r.wait();
  r.frame();
}

void transforms_of_the_volume(StageRecorder& r) {
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  r.call("set two transforms", [&] { r.viewer().set_transforms({{moved(0.0)}, {moved(40.0)}}); });
  r.frame();
  r.call("set the previous transform", [&] { r.viewer().set_previous_transforms({{moved(-1.0)}}); });
  r.frame();
  r.call("move both", [&] {
    const scene::ShutterTransforms ends{moved(0.0, 2.0), moved(0.0, 4.0)};
    r.viewer().set_transforms({{moved(0.0, 3.0), ends}, {moved(40.0, 3.0)}});
  });
  r.frame();
  r.call("open the shutter", [&] {
    viewer::Sampling sampling;
    sampling.shutter_seconds = 0.5;
    r.viewer().set_sampling(sampling);
  });
  r.frame();
  r.contents();
}

// ---- settings of the grid ----

void settings_change_while_building(StageRecorder& r) {
  r.call("set the grid", [&] { r.viewer().set_grid(limited_grid()); });
  r.hold(limited_cells);
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(24, 1)); });
  r.held();
  viewer::GridSettings settings = limited_grid();
  settings.build.refine.criterion = grid::Criterion::range_mean;
  r.call("other criterion", [&] { r.viewer().set_grid(settings); });
  settings.build.refine.threshold = 1.0;
  r.call("other threshold", [&] { r.viewer().set_grid(settings); });
  settings.build.on = viewer::BuildOn::gpu;
  r.call("other device", [&] { r.viewer().set_grid(settings); });
  settings.build.march = scene::March::brick;
  r.call("other type", [&] { r.viewer().set_grid(settings); });
  r.frame();
  r.release();
  r.wait();
  r.frame();
}

void types_of_grids(StageRecorder& r) {
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  viewer::GridSettings settings;
  const auto use = [&](const char* name) {
    r.call(name, [&] { r.viewer().set_grid(settings); });
    r.wait();
    r.frame();
  };
  settings.build.march = scene::March::dense;
  use("dense");
  settings.build.march = scene::March::brick;
  use("bricks");
  settings.build.march = scene::March::tet;
  settings.build.refine.cells = grid::CellKind::constant;
  use("constant cells");
  settings.build.on = viewer::BuildOn::gpu;
  use("by the GPU");
  settings.build.refine.threshold = 0.2;
  use("by the GPU, coarse");
}

void opacity_of_the_transmittance_criterion(StageRecorder& r) {
  viewer::GridSettings settings;
  settings.build.refine.criterion = grid::Criterion::transmittance;
  settings.build.refine.threshold = 0.1;
  r.call("set the grid", [&] { r.viewer().set_grid(settings); });
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  viewer::Medium medium;
  const auto use = [&](const char* name) {
    r.call(name, [&] { r.viewer().set_medium(medium); });
    r.wait();
    r.frame();
  };
  medium.density_scale = 1.5;
  use("a little denser");
  medium.density_scale = 4.0;
  use("denser");
  medium.phase.anisotropy = 0.9F;
  use("forward scattering");
  r.call("larger", [&] { r.viewer().set_transforms({{scaled(4.0)}}); });
  r.wait();
  r.frame();
  r.call("set the grid", [&] { r.viewer().set_grid({}); });
  r.wait();
  medium.density_scale = 100.0;
  use("the criterion does not depend on it");
}

void emission_rebuilds_volumes_that_emit(StageRecorder& r) {
  r.call("set a fire", [&] { r.viewer().set_volume(fire()); });
  r.wait();
  r.frame();
  viewer::Medium medium;
  medium.field_emission.flame_strength = 2.0;
  r.call("stronger flame", [&] { r.viewer().set_medium(medium); });
  r.wait();
  r.frame();
  medium.field_emission.blackbody = 1.0;
  r.call("black body", [&] { r.viewer().set_medium(medium); });
  r.wait();
  r.frame();
  r.call("ramp of temperatures", [&] {
    r.viewer().set_ramps({.temperature = volume::Ramp({{0.0F, 0.0F}, {1.0F, 3.0F}})});
  });
  r.wait();
  r.frame();
  r.call("set a cloud", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  medium.field_emission.blackbody = 0.0;
  r.call("no black body", [&] { r.viewer().set_medium(medium); });
  r.wait();
  r.frame();
}

void density_ramp(StageRecorder& r) {
  const viewer::Ramps ramps{.density = volume::Ramp({{0.0F, 0.0F}, {0.5F, 1.0F}, {1.0F, 0.25F}})};
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  r.call("set a ramp", [&] { r.viewer().set_ramps(ramps); });
  r.wait();
  r.frame();
  r.call("set it again", [&] { r.viewer().set_ramps(ramps); });
  r.wait();
  r.frame();
  r.call("ramp of flames", [&] {
    viewer::Ramps both = ramps;
    both.flame = volume::Ramp({{0.0F, 0.0F}, {1.0F, 2.0F}});
    r.viewer().set_ramps(both);
  });
  r.wait();
  r.frame();
}

void anisotropy_grid(StageRecorder& r) {
  r.call("set the volume", [&] { r.viewer().set_volume(haze()); });
  r.wait();
  r.frame();
  viewer::Medium medium;
  medium.phase = scene::mie_phase(10.0F);
  r.call("droplets", [&] { r.viewer().set_medium(medium); });
  r.wait();
  r.frame();
  r.call("set it again", [&] { r.viewer().set_medium(medium); });
  r.call("one lobe", [&] { r.viewer().set_medium({}); });
  r.wait();
  r.frame();
}

void shutter_of_moving_volumes(StageRecorder& r) {
  viewer::Sampling sampling;
  sampling.shutter_seconds = 0.25;
  r.call("set the volume", [&] { r.viewer().set_volume(wind()); });
  r.wait();
  r.frame();
  r.call("open the shutter", [&] { r.viewer().set_sampling(sampling); });
  r.wait();
  r.frame();
  r.call("by the GPU", [&] {
    viewer::GridSettings settings;
    settings.build.on = viewer::BuildOn::gpu;
    r.viewer().set_grid(settings);
  });
  r.wait();
  r.frame();
  r.call("set a volume that rests", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  sampling.shutter_seconds = 0.0;
  r.call("close the shutter", [&] { r.viewer().set_sampling(sampling); });
  r.wait();
  r.frame();
}

void media(StageRecorder& r) {
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  viewer::Medium medium;
  medium.albedo = glm::vec3(0.5F, 0.75F, 1.0F);
  medium.emission = glm::vec3(0.25F, 0.0F, 0.0F);
  medium.group = 2;
  medium.max_bounces = 7;
  r.call("set the medium", [&] { r.viewer().set_medium(medium); });
  r.frame();
  r.call("set it again", [&] { r.viewer().set_medium(medium); });
  r.frame();
  medium.holdout = true;
  r.call("hold it out", [&] { r.viewer().set_medium(medium); });
  r.frame();
}

}  // namespace

std::vector<StageScript> volume_scripts() {
  return {{"load_file", load_file},
          {"load_after_load", load_after_load},
          {"load_replaced_while_reading", load_replaced_while_reading},
          {"load_replaced_twice_while_reading", load_replaced_twice_while_reading},
          {"load_replaced_by_memory_while_reading", load_replaced_by_memory_while_reading},
          {"load_fails", load_fails},
          {"load_fails_and_the_volume_stays", load_fails_and_the_volume_stays},
          {"load_cancelled", load_cancelled},
          {"load_by_grid_names", load_by_grid_names},
          {"load_with_transform", load_with_transform},
          {"load_takes_the_suggested_density_scale", load_takes_the_suggested_density_scale},
          {"settings_change_while_reading", settings_change_while_reading},
          {"proxy_until_the_load_ends", proxy_until_the_load_ends},
          {"proxy_leaves_with_a_cancelled_load", proxy_leaves_with_a_cancelled_load},
          {"proxy_with_the_suggested_density_scale", proxy_with_the_suggested_density_scale},
          {"no_proxy_without_previews", no_proxy_without_previews},
          {"memory_volume", memory_volume},
          {"empty_volume", empty_volume},
          {"volume_replaced_while_building", volume_replaced_while_building},
          {"volume_removed_while_building", volume_removed_while_building},
          {"build_cancelled", build_cancelled},
          {"rebuild", rebuild},
          {"transforms_of_the_volume", transforms_of_the_volume},
          {"settings_change_while_building", settings_change_while_building},
          {"types_of_grids", types_of_grids},
          {"opacity_of_the_transmittance_criterion", opacity_of_the_transmittance_criterion},
          {"emission_rebuilds_volumes_that_emit", emission_rebuilds_volumes_that_emit},
          {"density_ramp", density_ramp},
          {"anisotropy_grid", anisotropy_grid},
          {"shutter_of_moving_volumes", shutter_of_moving_volumes},
          {"media", media}};
}

}  // namespace cumulet::test
