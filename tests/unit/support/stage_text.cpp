#include "support/stage_text.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <numeric>
#include <string_view>

#include "scene/channels.hpp"

namespace cumulet::test {

namespace {

using glm::dvec3;
using test::text_of;

// Joins the words that are not empty with spaces.
std::string joined(std::initializer_list<std::string> words) {
  std::string text;
  for (const std::string& word : words) {
    if (!word.empty()) text.append(text.empty() ? "" : " ").append(word);
  }
  return text;
}

std::string if_set(bool is_set, const char* word) { return is_set ? word : ""; }

std::string rounded(double value, const char* format) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), format, std::abs(value) < 1e-12 ? 0.0 : value);
  return text.data();
}

std::string text_of(float value) { return text_of(double{value}); }

// Computed colors: their last digits depend on the C library.
std::string computed(const glm::vec3& color) {
  std::string text = "(";
  for (int i = 0; i < 3; ++i) text.append(i > 0 ? ", " : "").append(rounded(double{color[i]}, "%.5g"));
  return text + ")";
}

std::string text_of(const volume::Ramp& ramp) {
  std::string text;
  for (const glm::vec2& point : ramp.points()) {
    text += text.empty() ? "" : ", ";
    text += text_of(point.x) + ": " + text_of(point.y);
  }
  return "{" + text + "}";
}

std::string text_of(const volume::ColorRamp& ramp) {
  std::string text;
  for (const glm::vec4& stop : ramp.stops()) {
    text += text.empty() ? "" : ", ";
    text += text_of(stop.x) + ": " + text_of(dvec3(stop.y, stop.z, stop.w));
  }
  return "{" + text + "}";
}

std::string text_of(const scene::Phase& phase) {
  if (phase == scene::Phase{}) return "isotropic";
  return "phase " + text_of(phase.anisotropy) + " " + text_of(phase.second_anisotropy) + " " +
         text_of(phase.second_bend) + " " + text_of(phase.second_weight);
}

std::string text_of(const scene::Medium& medium) {
  return joined({"density scale", text_of(medium.density_scale), "albedo", text_of(dvec3(medium.albedo)),
                 text_of(medium.phase),
                 medium.emission == glm::vec3(0.0F) ? "" : "emission " + text_of(dvec3(medium.emission)),
                 medium.group == 0 ? "" : "group " + std::to_string(medium.group), if_set(medium.holdout, "holdout")});
}

std::string text_of(const scene::Emission& e) {
  return joined({"emission: flame", text_of(e.flame_strength), text_of(dvec3(e.flame_color)), "temperature",
                 e.temperature_scale ? text_of(*e.temperature_scale) : "auto", text_of(e.temperature_offset),
                 "black body", text_of(e.blackbody), text_of(dvec3(e.blackbody_tint)),
                 e.temperature_ramp.empty() ? "" : "temperature ramp " + text_of(e.temperature_ramp),
                 e.flame_ramp.empty() ? "" : "flame ramp " + text_of(e.flame_ramp),
                 e.temperature_colors.empty() ? "" : "temperature colors " + text_of(e.temperature_colors),
                 e.flame_colors.empty() ? "" : "flame colors " + text_of(e.flame_colors)});
}

std::string text_of(const scene::ShutterTransforms& ends) {
  return "from " + text_of(ends.open) + " to " + text_of(ends.close);
}

std::string text_of(const scene::InstanceTransform& transform) {
  return joined({text_of(transform.to_world), transform.ends ? text_of(*transform.ends) : ""});
}

std::string text_of(const scene::ClipPlanes& clip) {
  std::string text;
  for (const glm::dvec4& plane : clip)
    text.append(text.empty() ? "clip " : ", ").append(text_of(dvec3(plane))).append(" ").append(text_of(plane.w));
  return text;
}

std::string text_of(const scene::Viewpoint& view) {
  return joined({"eye", text_of(view.eye), "forward", text_of(view.forward), "right", text_of(view.right), "up",
                 text_of(view.up), if_set(view.orthographic, "orthographic"),
                 view.lens_radius > 0.0 ? "lens " + text_of(view.lens_radius) + " focus " + text_of(view.focus) : ""});
}

std::string text_of(const std::optional<scene::Viewpoint>& view) { return view ? text_of(*view) : "none"; }

std::string text_of(const std::optional<scene::ViewEnds>& ends) {
  return ends ? "from " + text_of(ends->open) + " to " + text_of(ends->close) : "none";
}

std::string text_of(const std::optional<scene::Ground>& ground) {
  if (!ground) return "none";
  return "height " + text_of(ground->height) + " albedo " + text_of(dvec3(ground->albedo)) + " reach " +
         text_of(ground->reach) + (ground->shadow_catcher ? " shadow catcher" : "");
}

std::string text_of(const light::DistantLights& lights) {
  return joined({"to sun", text_of(lights.to_sun), "irradiance", computed(lights.sun_irradiance), "angle",
                 text_of(lights.sun_angle_degrees), "sky", text_of(dvec3(lights.sky_radiance))});
}

std::string text_of(const light::AnalyticLight& light) {
  constexpr std::array kinds{"point", "spot", "disk", "rectangle", "distant"};
  return joined({kinds.at(static_cast<std::size_t>(light.kind)), "at", text_of(light.position), "towards",
                 text_of(light.direction), "power", text_of(dvec3(light.power)), "size", text_of(light.width),
                 text_of(light.height), "angle", text_of(light.angle),
                 light.group == 0 ? "" : "group " + std::to_string(light.group)});
}

std::string text_of(const light::AnalyticLights& lights) {
  std::string text = std::to_string(lights.size());
  for (const light::AnalyticLight& light : lights) text += "; " + text_of(light);
  return text;
}

std::string text_of(const grid::RefineCamera& camera) {
  std::string text = joined({"for a view: eye", text_of(camera.eye), "forward", text_of(camera.forward), "up",
                             text_of(camera.up), "tangents", text_of(camera.tan_half_x), text_of(camera.tan_half_y),
                             "pixels", text_of(camera.pixels_per_radian), "transforms"});
  for (const glm::dmat4& transform : camera.transforms) text += " " + text_of(transform);
  return text;
}

std::string text_of(const grid::RefineSettings& refine) {
  constexpr std::array criteria{"deviation", "range/mean", "transmittance"};
  const grid::RefineSettings usual;
  constexpr std::array cells{"linear", "constant", "trilinear"};
  return joined({cells.at(static_cast<std::size_t>(refine.cells)),
                 criteria.at(static_cast<std::size_t>(refine.criterion)), text_of(refine.threshold), "density scale",
                 text_of(refine.density_scale),
                 refine.anisotropy == 0.0 ? "" : "anisotropy " + text_of(refine.anisotropy),
                 refine.max_cells == usual.max_cells ? "" : "cells up to " + std::to_string(refine.max_cells),
                 refine.pixel_size == usual.pixel_size ? "" : "pixel size " + text_of(refine.pixel_size),
                 refine.camera ? text_of(*refine.camera) : ""});
}

const char* name_of(scene::March march) {
  constexpr std::array names{"tetrahedra", "dense", "bricks"};
  return names.at(static_cast<std::size_t>(march));
}

// Contents of a grid that was built, without the cells themselves.
std::string contents_of(const scene::MarchSource& source) {
  std::string size;
  if (source.grid) {
    size = std::to_string(source.grid->cells.size()) + " cells, " + std::to_string(source.grid->levels) + " levels" +
           if_set(source.grid->limited, ", limited");
  } else if (source.plan) {
    const auto& levels = source.plan->levels;
    size = "planned, up to " + std::to_string(source.plan->max_cells) + " cells, " + std::to_string(levels.size()) +
           " nodes, sum of levels " + std::to_string(std::accumulate(levels.begin(), levels.end(), std::uint64_t{0}));
  } else {
    size = "voxels " + text_of(dvec3(source.box_size)) + ", " + std::to_string(source.brick_slots.size()) + " slots";
  }
  return joined({name_of(source.march),
                 if_set(source.march == scene::March::tet, source.linear ? "linear" : "constant"),
                 if_set(source.trilinear, "trilinear"), size + ", max", text_of(source.max_value),
                 if_set(source.emits(), "emission"), if_set(source.colored(), "color"),
                 if_set(source.anisotropic(), "anisotropy"), if_set(source.moves(), "velocity"),
                 if_set(source.changes(), "change")});
}

std::string contents_of(const scene::ModelSource& source) {
  std::size_t moving = 0;
  for (const scene::ModelMesh& mesh : source.meshes)
    moving += mesh.ends.has_value() || !mesh.shutter_transforms.empty() ? 1U : 0U;
  return joined({std::to_string(source.scene->triangle_count()), "triangles at", text_of(source.pose.time), "s, bounds",
                 text_of(source.pose.low), text_of(source.pose.high),
                 moving == 0 ? "" : std::to_string(moving) + " meshes move", std::to_string(source.pose.lights.size()),
                 "lights", if_set(source.pose.double_sided, "double-sided"),
                 if_set(!source.pose.chosen.empty(), "variant")});
}

std::string text_of(const viewer::Sampling& s) {
  return joined({std::to_string(s.samples),
                 "samples, seed",
                 std::to_string(s.seed),
                 "first",
                 std::to_string(s.first_sample),
                 "view",
                 std::to_string(static_cast<int>(s.options.view)),
                 if_set(s.options.preview, "preview"),
                 if_set(s.options.separate_volume_aov, "separate"),
                 if_set(s.options.adaptive, "adaptive"),
                 s.noise_target ? "noise " + text_of(*s.noise_target) : "",
                 "groups",
                 std::to_string(s.options.light_groups),
                 "shutter",
                 text_of(s.shutter_seconds),
                 "region",
                 text_of(s.options.region.corner.x),
                 text_of(s.options.region.corner.y),
                 text_of(s.options.region.extent.x),
                 text_of(s.options.region.extent.y)});
}

std::string text_of(const viewer::SurfaceSettings& s) {
  return joined({text_of(s.choice), "light", std::to_string(static_cast<int>(s.light)), "roughness",
                 text_of(s.indirect_roughness), "group", std::to_string(s.group), if_set(s.holdout, "holdout")});
}

std::string text_of(const viewer::DisplaySettings& d) {
  return joined({"exposure", text_of(d.exposure_stops), "tone map", std::to_string(static_cast<int>(d.tone_map)),
                 if_set(d.transparent, "transparent"), d.backdrop ? "background " + text_of(dvec3(*d.backdrop)) : "",
                 if_set(d.denoise, "denoise")});
}

}  // namespace

Identities::Found Identities::find(const std::weak_ptr<const void>& object) {
  const auto [entry, is_new] = numbers_.try_emplace(object, numbers_.size() + 1);
  return {entry->second, is_new};
}

std::string text_of(double value) { return rounded(value, "%.9g"); }

std::string text_of(const glm::dvec3& v) {
  return "(" + text_of(v.x) + ", " + text_of(v.y) + ", " + text_of(v.z) + ")";
}

std::string text_of(const glm::dmat4& m) {
  if (m == glm::dmat4(1.0)) return "identity";
  const std::string moved = "at " + text_of(dvec3(m[3]));
  if (glm::dmat3(m) == glm::dmat3(1.0)) return moved;
  return "axes " + text_of(dvec3(m[0])) + " " + text_of(dvec3(m[1])) + " " + text_of(dvec3(m[2])) + " " + moved;
}

std::string text_of(const Error& error) {
  constexpr std::array codes{"invalid argument", "unsupported", "file",         "out of memory", "GL",
                             "internal",         "cancelled",   "context lost", "detached",      "timeout"};
  return std::string(codes.at(static_cast<std::size_t>(error.code()))) + ": " + error.what();
}

std::string text_of(Progress::Stage stage) {
  constexpr std::array stages{"idle", "loading", "statistics", "refining", "records", "uploading"};
  return stages.at(static_cast<std::size_t>(stage));
}

std::string text_of(const viewer::SurfaceChoice& choice) {
  return joined({"animation", std::to_string(choice.animation), "at", text_of(choice.time), "s",
                 if_set(choice.double_sided, "double-sided"),
                 choice.variant == 0 ? "" : "variant " + std::to_string(choice.variant),
                 choice.shutter_seconds == 0.0 ? "" : "shutter " + text_of(choice.shutter_seconds)});
}

std::string text_of(const light::Day& day) {
  return joined({"turbidity", text_of(day.model.turbidity), "albedo", text_of(day.model.ground_albedo), "elevation",
                 text_of(day.sun_elevation_degrees), if_set(day.above_alone, "black below the horizon")});
}

// ---- objects ----

std::string StageText::volume(const viewer::VolumeAssetPtr& volume) {
  if (!volume) return "no volume";
  return "volume " + std::to_string(volumes_.find(volume).number) + " \"" + volume->name() + "\"";
}

std::string StageText::asset(const std::shared_ptr<const viewer::SurfaceAsset>& asset) {
  return asset ? "surfaces " + std::to_string(assets_.find(asset).number) : "no surfaces";
}

std::string StageText::live(const std::shared_ptr<viewer::Live>& live) {
  return live ? "dynamic volume " + std::to_string(lives_.find(live).number) : "no dynamic volume";
}

std::string StageText::plan(const scene::GridPlanPtr& plan) {
  return plan ? "plan " + std::to_string(plans_.find(plan).number) : "";
}

std::string StageText::environment(const light::EnvironmentPtr& environment) {
  if (!environment) return "none";
  return std::to_string(environments_.find(environment).number) + ", " + std::to_string(environment->width) + " x " +
         std::to_string(environment->height);
}

std::string StageText::settings(const viewer::BuildSettings& s) {
  const bool is_tet = s.march == scene::March::tet;
  return joined({name_of(s.march), if_set(is_tet && s.on == viewer::BuildOn::gpu, "by the GPU"), text_of(s.refine),
                 s.density_ramp.empty() ? "" : "ramp " + text_of(s.density_ramp),
                 s.density_colors.empty() ? "" : "colors " + text_of(s.density_colors),
                 s.emission == scene::Emission{} ? "" : text_of(s.emission), if_set(!s.anisotropic, "no anisotropy"),
                 s.shutter_seconds == 0.0 ? "" : "shutter " + text_of(s.shutter_seconds)});
}

std::string StageText::settings(const std::optional<viewer::BuildSettings>& s) {
  return s ? settings(*s) : "settings of a later view";
}

std::string StageText::request(const viewer::GridRequest& request) {
  const bool is_limited = request.gl_bytes != viewer::ResourceLimits::no_limit;
  return joined({volume(request.volume) + ":", settings(request.settings),
                 is_limited ? "within " + std::to_string(request.gl_bytes) : ""});
}

std::string StageText::request(const viewer::PoseRequest& request) {
  return asset(request.surfaces) + ": " + text_of(request.choice);
}

std::string StageText::request(const viewer::FrameRequest& request) {
  constexpr std::array between{"", "blended", "advected"};
  std::string order;
  for (const std::uint32_t step : request.order) order += (order.empty() ? "" : " ") + std::to_string(step);
  const viewer::FrameSteps& steps = request.steps;
  return joined({"files", std::to_string(files_.find(request.files).number) + ", steps", order + ",",
                 steps.a_frame == 1 ? "" : std::to_string(steps.a_frame) + " per frame",
                 between.at(static_cast<std::size_t>(steps.between)),
                 steps.seconds == 0.0 ? "" : "over " + text_of(steps.seconds) + " s",
                 "memory " + std::to_string(request.memory_bytes) + ",", settings(request.settings),
                 if_set(!request.takes_suggested, "own density scale")});
}

std::string StageText::player(viewer::JobLog::Player player) {
  return player == 0 ? "" : " " + std::to_string(players_[player]);
}

std::string StageText::source(const scene::MarchSourcePtr& source) {
  const auto [number, is_new] = sources_.find(source);
  std::string text = "grid " + std::to_string(number);
  if (!is_new) return text;
  if (source->plan) text += " of lattice " + std::to_string(lattices_.find(source->plan->lattice).number);
  return text + " (" + contents_of(*source) + ")";
}

std::string StageText::source(const scene::ModelSourcePtr& source) {
  const auto [number, is_new] = models_.find(source);
  const std::string text = "pose " + std::to_string(number);
  return is_new ? text + " (" + contents_of(*source) + ")" : text;
}

std::string StageText::object(std::uint64_t id) { return id == 0 ? "own" : "object " + std::to_string(objects_[id]); }

std::string StageText::frame(const scene::SequenceFrame& frame) {
  return joined({"frame", std::to_string(frame.number), frame.part == 0.0 ? "" : "+ " + text_of(frame.part), "of",
                 std::to_string(sequences_[frame.sequence]) + ", taken as", std::to_string(taken_[frame.taken])});
}

// ---- scenes ----

std::string StageText::volume(const scene::Volume& volume, const scene::Snapshot* before) {
  bool has_same_medium = false;
  if (before != nullptr) {
    for (const scene::Volume& other : before->volumes)
      has_same_medium = has_same_medium || (other.id == volume.id && other.medium == volume.medium);
  }
  return joined({"volume", object(volume.id) + ":", source(volume.source), text_of(volume.transform),
                 volume.frame ? frame(*volume.frame) : "",
                 volume.previous ? "previously " + text_of(*volume.previous) : "", text_of(volume.clip),
                 has_same_medium ? "same medium" : text_of(*volume.medium)});
}

std::string StageText::model(const scene::Model& model) {
  return joined({"model", object(model.id) + ":", source(model.source), text_of(model.to_world),
                 model.ends ? text_of(*model.ends) : "", if_set(model.shadow_only, "shadow only"),
                 if_set(model.holdout, "holdout"), model.group == 0 ? "" : "group " + std::to_string(model.group),
                 model.previous ? "previously " + text_of(*model.previous) : "",
                 model.previous_source ? "previously " + source(model.previous_source) : ""});
}

StageText::Lines StageText::scene(const scene::Snapshot& now, const scene::Snapshot* before) {
  Lines lines;
  if (before == nullptr || before->origin != now.origin) lines.push_back("origin " + text_of(now.origin));
  if (before == nullptr || before->volumes != now.volumes) {
    lines.push_back(std::to_string(now.volumes.size()) + " volumes");
    for (const scene::Volume& one : now.volumes) lines.push_back(volume(one, before));
  }
  if (before == nullptr || before->models != now.models) {
    lines.push_back(std::to_string(now.models.size()) + " models");
    for (const scene::Model& one : now.models) lines.push_back(model(one));
  }
  const auto add = [&](const char* name, const auto& part, const auto& text) {
    if (before == nullptr || !(*before.*part == now.*part))
      lines.push_back(std::string(name) + ": " + text(*(now.*part)));
  };
  const auto plain = [](const auto& value) { return text_of(value); };
  add("sun and sky", &scene::Snapshot::lights, plain);
  add("environment", &scene::Snapshot::surroundings, [&](const light::Surroundings& surroundings) {
    return environment(surroundings.environment) + ", rotation " + text_of(surroundings.rotation_degrees) +
           ", strength " + text_of(surroundings.strength);
  });
  add("lights", &scene::Snapshot::analytic_lights, plain);
  add("ground", &scene::Snapshot::ground, plain);
  add("view", &scene::Snapshot::view, plain);
  add("views at the shutter's ends", &scene::Snapshot::view_ends, plain);
  add("previous view", &scene::Snapshot::previous, [](const scene::Previous& previous) {
    return text_of(previous.view) + ", " + text_of(previous.seconds) + " s ago";
  });
  return lines;
}

std::map<std::string, std::string> texts_of(const viewer::Shot& shot) {
  return {{"image", joined({std::to_string(shot.size.x), "x", std::to_string(shot.size.y), "depth",
                            text_of(shot.depth_a), text_of(shot.depth_b), if_set(shot.view_rests, "at rest"),
                            if_set(shot.held, "dragged"), "bounces", std::to_string(shot.max_bounces), "groups",
                            std::to_string(shot.sun_group), std::to_string(shot.sky_group)})},
          {"sampling", text_of(shot.sampling)},
          {"surfaces", text_of(shot.surfaces)},
          {"display", text_of(shot.display)},
          {"settings", std::to_string(shot.settings)}};
}

}  // namespace cumulet::test
