// Scripts: sequences and dynamic volumes, as the viewer's own volume and in instances.

#include <array>
#include <filesystem>
#include <limits>
#include <utility>

#include "stage_scripts/scripts.hpp"

namespace cumulet::test {

namespace {

using InstancePtr = std::shared_ptr<viewer::Instance>;
using SequencePtr = std::shared_ptr<viewer::Sequence>;
using LivePtr = std::shared_ptr<viewer::Live>;

constexpr int count = 5;  // frames of a sequence
constexpr std::uint64_t plenty = std::uint64_t{1} << 32U;

void set_grid(StageRecorder& r, const std::string& name, const viewer::GridSettings& settings) {
  r.call(name, [&] { r.viewer().set_grid(settings); });
}

void add(StageRecorder& r, const std::string& name, const InstancePtr& instance) {
  r.call("add " + name, [&] { r.viewer().add_instance(instance); });
}

void edit(StageRecorder& r, const std::string& name, const InstancePtr& instance,
          const std::function<void(viewer::InstanceSettings&)>& change) {
  r.call(name, [&] { instance->edit(change); });
  r.wait();
  r.frame();
}

viewer::GridSettings for_views() {
  viewer::GridSettings settings;
  settings.camera_adaptive = true;
  return settings;
}

void simulate_display(StageRecorder& r, bool displays) {
  r.call(displays ? "frames are displayed" : "no frame is displayed", [&] {
    viewer::Viewer::SimulatedGl gl;
    gl.displays_frames = displays;
    r.viewer().simulate_gl(gl);
  });
}

// ---- sequences ----

SequencePtr sequence_of(const std::vector<std::string>& paths, std::uint64_t memory_bytes = plenty,
                        bool suggested = false) {
  auto files = std::make_shared<viewer::FrameFiles>();
  files->paths = paths;
  files->shown.suggested_density_scale = suggested;
  viewer::SequenceState state;
  state.playback.count = files->count();
  state.memory_bytes = memory_bytes;
  return std::make_shared<viewer::Sequence>(std::move(files), state);
}

void set_sequence(StageRecorder& r, const SequencePtr& sequence) {
  r.call(sequence ? "set the sequence" : "remove the sequence", [&] { r.viewer().set_sequence(sequence); });
}

// Shows a frame when it is ready.
void show_position(StageRecorder& r, const SequencePtr& sequence, double position) {
  r.call("position " + text_of(position), [&] { sequence->set_position(position); });
  r.wait();
  r.frame();
}

// Shows the frame of a time, in frames.
void show_time(StageRecorder& r, const SequencePtr& sequence, double frames) {
  r.call("time of frame " + text_of(frames), [&] { sequence->set_time(frames / 24.0); });
  r.wait();
  r.frame();
  r.sequence();
}

void set_playback(StageRecorder& r, const std::string& name, const SequencePtr& sequence,
                  const std::function<void(scene::Playback&)>& change) {
  r.call(name, [&] {
    scene::Playback playback = sequence->get().playback;
    change(playback);
    sequence->set_playback(playback);
  });
}

void sequence_played_forward(StageRecorder& r) {
  const SequencePtr sequence = sequence_of(write_clip(r, count));
  set_sequence(r, sequence);
  r.wait();
  r.frame();
  r.contents();
  r.settle_frames(count);
  r.frames();
  for (const double frame : {0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0}) show_time(r, sequence, frame);
}

void sequence_played_backward(StageRecorder& r) {
  const SequencePtr sequence = sequence_of(write_clip(r, count));
  r.call("position 4", [&] { sequence->set_position(4.0); });
  set_sequence(r, sequence);
  r.wait();
  r.frame();
  r.settle_frames(count);
  for (const double frame : {4.0, 3.0, 2.5, 2.0, 3.0, 1.0}) show_time(r, sequence, frame);
}

void sequence_repeated(StageRecorder& r) {
  const SequencePtr sequence = sequence_of(write_clip(r, count));
  set_playback(r, "loop", sequence, [](scene::Playback& playback) { playback.repeat = scene::Repeat::loop; });
  set_sequence(r, sequence);
  r.wait();
  r.frame();
  r.settle_frames(count);
  for (const double frame : {3.0, 6.0, 9.0, -1.0}) show_time(r, sequence, frame);
  set_playback(r, "ping-pong", sequence, [](scene::Playback& playback) { playback.repeat = scene::Repeat::ping_pong; });
  for (const double frame : {3.0, 6.0, 9.0}) show_time(r, sequence, frame);
  set_playback(r, "frames 1 to 3", sequence, [](scene::Playback& playback) {
    playback.repeat = scene::Repeat::hold;
    playback.first = 1;
    playback.count = 3;
  });
  for (const double frame : {0.0, 2.0, 4.0}) show_time(r, sequence, frame);
}

// Frames 0 and 1 are ready while frame 3 is requested.
void sequence_sought_while_reading(StageRecorder& r) {
  const std::vector<std::string> paths = write_clip(r, count);
  const SequencePtr sequence = sequence_of(paths);
  r.hold("ended " + paths[1] + ".");
  set_sequence(r, sequence);
  r.held();
  r.frame();
  r.frames();
  r.call("position 3", [&] { sequence->set_position(3.0); });
  r.frame();
  r.frames();
  r.call("position 4", [&] { sequence->set_position(4.0); });
  r.frame();
  r.release();
  r.wait();
  r.frame();
  r.settle_frames(count);
  r.frames();
}

void sequence_interpolated(StageRecorder& r) {
  const SequencePtr sequence = sequence_of(write_clip(r, 3));
  const auto interpolate = [&](const char* name, scene::Between between, std::uint32_t steps) {
    set_playback(r, name, sequence, [&](scene::Playback& playback) {
      playback.between = between;
      playback.steps = steps;
    });
    r.wait();
    r.frame();
    r.sequence();
  };
  set_sequence(r, sequence);
  r.wait();
  r.frame();
  interpolate("blend", scene::Between::blend, 4);
  for (const double position : {0.5, 0.6, 1.75, 1.0}) show_position(r, sequence, position);
  interpolate("advect", scene::Between::advect, 2);
  show_position(r, sequence, 0.5);
  interpolate("no interpolation", scene::Between::none, 1);
  show_position(r, sequence, 1.5);
}

void sequence_with_missing_frames(StageRecorder& r) {
  const std::vector<std::string> paths = write_clip(r, count);
  std::filesystem::remove(paths[2]);
  write_text(paths[3], "no volume");
  const SequencePtr sequence = sequence_of(paths);
  set_sequence(r, sequence);
  r.settle_frames(count);
  r.wait();
  r.frame();
  r.frames();
  for (const double position : {2.0, 3.0, 4.0}) show_position(r, sequence, position);
  for (const std::uint32_t frame : {0U, 2U, 3U, 99U}) r.frame_failure(frame);
  r.status();
  write_ball(paths[2], 2);
  r.call("rebuild", [&] { r.viewer().rebuild(); });
  r.settle_frames(count);
  r.wait();
  r.frames();
  show_position(r, sequence, 2.0);
}

void sequence_without_readable_frames(StageRecorder& r) {
  const SequencePtr sequence = sequence_of({r.path("none.0.vdb"), r.path("none.1.vdb")});
  set_sequence(r, sequence);
  r.wait();
  r.status();
  r.frame();
  r.frame_failure(1);
  r.call("set a volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.status();
  r.frame();
}

void sequence_takes_the_suggested_density_scale(StageRecorder& r) {
  const SequencePtr sequence = sequence_of(write_clip(r, count), plenty, true);
  set_sequence(r, sequence);
  r.wait();
  r.frame();
  r.sequence();
  r.call("set the density scale", [&] { r.viewer().set_medium(medium_of(3.0)); });
  r.wait();
  r.frame();
  show_position(r, sequence, 2.0);
}

void sequence_with_other_settings(StageRecorder& r) {
  const SequencePtr sequence = sequence_of(write_clip(r, 3));
  set_sequence(r, sequence);
  r.wait();
  r.frame();
  viewer::GridSettings settings;
  settings.build.march = scene::March::brick;
  set_grid(r, "bricks", settings);
  r.wait();
  r.frame();
  set_grid(r, "tetrahedra", {});
  r.wait();
  r.frame();
  r.call("ramp", [&] { r.viewer().set_ramps({.density = volume::Ramp({{0.0F, 0.0F}, {1.0F, 2.0F}})}); });
  r.wait();
  r.frame();
  r.call("medium", [&] { r.viewer().set_medium(medium_of(2.0)); });
  r.wait();
  r.frame();
  r.call("open the shutter", [&] {
    viewer::Sampling sampling;
    sampling.shutter_seconds = 0.5;
    r.viewer().set_sampling(sampling);
  });
  r.wait();
  r.frame();
  r.call("rebuild", [&] { r.viewer().rebuild(); });
  r.wait();
  r.frame();
  r.call("limit the memory", [&] {
    viewer::Viewer::Limits limits;
    limits.memory_bytes = 1'000'000'000;
    r.viewer().set_limits(limits);
  });
  r.wait();
  r.frame();
}

// The sequence continues until the load has ended.
void sequence_replaced_by_a_load(StageRecorder& r) {
  write_slow_ball(r.path("slow.vdb"));
  const SequencePtr sequence = sequence_of(write_clip(r, count));
  set_sequence(r, sequence);
  r.wait();
  r.frame();
  r.settle_frames(count);
  r.hold(negative_voxel);
  r.load("slow.vdb", [](viewer::VolumeFile& file) { file.min_proxy_bricks = 1; });
  r.held();
  r.frame();
  r.call("position 2", [&] { sequence->set_position(2.0); });
  r.frame();
  r.release();
  r.wait();
  r.frame();
  r.sequence();
}

void sequence_replaced(StageRecorder& r) {
  const std::vector<std::string> paths = write_clip(r, 4);
  const SequencePtr first = sequence_of({paths[0], paths[1]});
  const SequencePtr second = sequence_of({paths[2], paths[3]});
  r.call("remove no sequence", [&] { r.viewer().set_sequence(nullptr); });
  for (const SequencePtr& sequence : {first, second, first}) {
    set_sequence(r, sequence);
    r.wait();
    r.frame();
  }
  r.call("set a volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  set_sequence(r, second);
  r.wait();
  r.frame();
  set_sequence(r, nullptr);
  r.wait();
  r.frame();
}

void sequence_of_instances(StageRecorder& r) {
  const SequencePtr sequence = sequence_of(write_clip(r, count));
  const auto instance = [&](double x) {
    return std::make_shared<viewer::Instance>(
        viewer::InstanceSettings{.volume = nullptr, .sequence = sequence, .to_world = moved(x)});
  };
  const InstancePtr a = instance(0.0);
  const InstancePtr b = instance(40.0);
  const InstancePtr c = instance(80.0);
  c->edit([](auto& settings) { settings.ramps.density = volume::Ramp({{0.0F, 0.0F}, {1.0F, 2.0F}}); });
  add(r, "a", a);
  add(r, "b", b);
  add(r, "c, with a ramp", c);
  r.wait();
  r.frame();
  r.contents();
  r.settle_frames(count, a.get());
  r.settle_frames(count, c.get());
  r.frames(a.get());
  show_position(r, sequence, 2.0);
  r.sequence(b.get());
  edit(r, "hide b", b, [](auto& settings) { settings.hidden = true; });
  r.sequence(b.get());
  show_position(r, sequence, 3.0);
  edit(r, "show b", b, [](auto& settings) { settings.hidden = false; });
  edit(r, "c without the ramp", c, [](auto& settings) { settings.ramps = {}; });
  edit(r, "a shows a volume", a, [](auto& settings) {
    settings.sequence = nullptr;
    settings.volume = cloud(16, 1);
  });
  r.call("remove b", [&] { r.viewer().remove_instance(*b); });
  r.wait();
  r.frame();
}

void sequence_beside_instances(StageRecorder& r) {
  const SequencePtr sequence = sequence_of(write_clip(r, count));
  set_sequence(r, sequence);
  add(r, "a",
      std::make_shared<viewer::Instance>(
          viewer::InstanceSettings{.volume = cloud(16, 1, "a"), .to_world = moved(40.0)}));
  r.wait();
  r.frame();
  r.settle_frames(count);
  for (const double frame : {1.0, 2.0, 3.0}) show_time(r, sequence, frame);
  add(r, "the sequence",
      std::make_shared<viewer::Instance>(
          viewer::InstanceSettings{.volume = nullptr, .sequence = sequence, .to_world = moved(80.0)}));
  r.wait();
  r.frame();
}

void sequence_of_little_memory(StageRecorder& r) {
  const SequencePtr sequence = sequence_of(write_clip(r, count), 1);
  set_sequence(r, sequence);
  r.wait();
  r.frame();
  r.frames();
  show_position(r, sequence, 3.0);
  r.frames();
}

// A frame that was taken stays until it is displayed.
void sequence_waits_for_the_display(StageRecorder& r) {
  const SequencePtr sequence = sequence_of(write_clip(r, count));
  simulate_display(r, true);
  set_sequence(r, sequence);
  r.settle_frames(count);
  r.frame();
  simulate_display(r, false);
  r.call("position 1", [&] { sequence->set_position(1.0); });
  r.frame();
  r.call("position 2", [&] { sequence->set_position(2.0); });
  r.frame();
  simulate_display(r, true);
  r.frame();
  r.frame();
  simulate_display(r, false);
  r.call("no previews", [&] {
    viewer::Sampling sampling;
    sampling.options.preview = false;
    r.viewer().set_sampling(sampling);
  });
  r.call("position 3", [&] { sequence->set_position(3.0); });
  r.frame();
}

void sequence_for_views(StageRecorder& r) {
  const SequencePtr sequence = sequence_of(write_clip(r, 3));
  set_grid(r, "grids for views", for_views());
  set_sequence(r, sequence);
  r.wait();
  r.frame();
  r.wait();
  r.frame();
  show_position(r, sequence, 1.0);
  r.look({0.0, 5.0, 60.0}, {0.0, 0.0, 0.0});
  r.frame();
  r.frame();
  r.wait();
  r.frame();
}

// ---- dynamic volumes ----

// Values of a ball that moves and has another size in each state.
std::vector<float> ball(int state) {
  constexpr int side = 16;
  std::vector<float> values;
  for (int i = 0; i < side * side * side; ++i) {
    const glm::vec3 p(i % side, i / side % side, i / (side * side));
    values.push_back(std::max(0.0F, 0.5F - glm::distance(p, glm::vec3(6 + state, 8, 8)) / float(10 + state)));
  }
  return values;
}

volume::MemoryField field_of(const std::vector<float>& values) {
  return {volume::Channel::density, volume::DenseVoxels{.values = values, .size = glm::ivec3(16)}};
}

void submit(StageRecorder& r, const LivePtr& live, int state) {
  r.call("submit state " + std::to_string(state), [&] {
    const std::vector<float> values = ball(state);
    live->set({field_of(values)}, "state");
  });
}

void show_state(StageRecorder& r, const LivePtr& live, int state) {
  submit(r, live, state);
  r.wait();
  r.frame();
}

void set_live(StageRecorder& r, const LivePtr& live) {
  r.call(live ? "set the dynamic volume" : "remove the dynamic volume", [&] { r.viewer().set_live(live); });
}

LivePtr make_live() { return std::make_shared<viewer::Live>(std::nullopt); }

void dynamic_volume(StageRecorder& r) {
  const LivePtr live = make_live();
  set_live(r, live);
  r.wait();
  r.frame();
  r.states();
  for (const int state : {1, 2, 3}) {
    show_state(r, live, state);
    r.states();
  }
  r.frame();
  r.contents();
}

void dynamic_volume_with_bounds(StageRecorder& r) {
  const auto live = std::make_shared<viewer::Live>(viewer::Bounds{glm::dvec3(0.0), glm::dvec3(20.0)});
  set_live(r, live);
  r.frame();
  r.contents();
  show_state(r, live, 1);
  r.contents();
}

// States that arrive while one is being built: only the newest is built next.
void dynamic_volume_changes_while_building(StageRecorder& r) {
  const LivePtr live = make_live();
  set_grid(r, "set the grid", limited_grid());
  set_live(r, live);
  r.hold(limited_cells);
  submit(r, live, 1);
  r.held();
  submit(r, live, 2);
  submit(r, live, 3);
  r.states();
  r.frame();
  r.release();
  r.wait();
  r.frame();
  r.states();
}

void dynamic_volume_cancelled(StageRecorder& r) {
  const LivePtr live = make_live();
  set_grid(r, "set the grid", limited_grid());
  set_live(r, live);
  r.hold(limited_cells);
  submit(r, live, 1);
  r.held();
  r.call("cancel", [&] { r.viewer().cancel(); });
  r.release();
  r.wait();
  r.frame();
  show_state(r, live, 2);
  r.states();
}

void dynamic_volume_with_refused_states(StageRecorder& r) {
  const LivePtr live = make_live();
  std::vector<float> values = ball(2);
  values[7] = std::numeric_limits<float>::infinity();
  set_live(r, live);
  show_state(r, live, 1);
  r.call("submit a state of another size", [&] {
    const std::vector<float> few(8, 1.0F);
    live->set({field_of(few)}, "state");
  });
  r.call("submit a copied state that is not finite", [&] { live->set({field_of(values)}, "state"); });
  r.wait();
  r.frame();
  r.states();
  // Its voxels are read by the worker.
  r.call("lend a state that is not finite",
         [&] { live->set({field_of(values)}, "state", [] { return std::make_shared<int>(0); }); });
  r.wait();
  r.status();
  r.frame();
  r.states();
  show_state(r, live, 3);
  r.status();
}

void dynamic_volume_updated(StageRecorder& r) {
  const LivePtr live = make_live();
  const std::array<std::int32_t, 3> origin{8, 8, 8};
  const std::vector<float> brick(512, 0.25F);
  const auto update = [&] {
    r.call("update a brick", [&] {
      live->update(
          {{volume::Channel::density,
            volume::SparseVoxels{.brick_origins = origin, .brick_values = brick, .brick_active = {}, .tiles = {}}}},
          "state");
    });
  };
  set_live(r, live);
  update();
  show_state(r, live, 1);
  update();
  r.wait();
  r.frame();
  r.states();
}

void dynamic_volume_of_instances(StageRecorder& r) {
  const LivePtr live = make_live();
  const auto instance = [&](double x) {
    return std::make_shared<viewer::Instance>(
        viewer::InstanceSettings{.volume = nullptr, .live = live, .to_world = moved(x)});
  };
  const InstancePtr a = instance(0.0);
  const InstancePtr b = instance(40.0);
  const InstancePtr c = instance(80.0);
  c->edit([](auto& settings) { settings.ramps.density = volume::Ramp({{0.0F, 0.0F}, {1.0F, 2.0F}}); });
  add(r, "a", a);
  r.frame();
  show_state(r, live, 1);
  add(r, "b", b);
  add(r, "c, with a ramp", c);
  r.wait();
  r.frame();
  show_state(r, live, 2);
  r.states(a.get());
  r.states(c.get());
  edit(r, "hide a", a, [](auto& settings) { settings.hidden = true; });
  r.states(a.get());
  show_state(r, live, 3);
  edit(r, "show a", a, [](auto& settings) { settings.hidden = false; });
  edit(r, "b shows a volume", b, [](auto& settings) {
    settings.live = nullptr;
    settings.volume = cloud(16, 1);
  });
  r.call("remove c", [&] { r.viewer().remove_instance(*c); });
  r.wait();
  r.frame();
}

// A state that was taken stays until it is displayed, except during a wait.
void dynamic_volume_waits_for_the_display(StageRecorder& r) {
  const LivePtr live = make_live();
  simulate_display(r, true);
  set_live(r, live);
  show_state(r, live, 1);
  simulate_display(r, false);
  submit(r, live, 2);
  r.settle();
  r.frame();
  r.states();
  simulate_display(r, true);
  r.frame();
  r.states();
  simulate_display(r, false);
  submit(r, live, 3);
  r.wait();
  r.states();
  r.frame();
}

void dynamic_volume_replaced(StageRecorder& r) {
  const LivePtr live = make_live();
  const SequencePtr sequence = sequence_of(write_clip(r, 2));
  write_ball(r.path("a.vdb"), 0);
  r.call("remove no dynamic volume", [&] { r.viewer().set_live(nullptr); });
  set_live(r, live);
  show_state(r, live, 1);
  r.call("set a volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  r.states();
  set_live(r, live);
  r.wait();
  r.frame();
  set_sequence(r, sequence);
  r.wait();
  r.frame();
  set_live(r, live);
  r.wait();
  r.frame();
  r.load("a.vdb");
  r.wait();
  r.frame();
  set_live(r, live);
  r.wait();
  set_live(r, nullptr);
  r.wait();
  r.frame();
}

void dynamic_volume_with_other_settings(StageRecorder& r) {
  const LivePtr live = make_live();
  set_live(r, live);
  show_state(r, live, 1);
  viewer::GridSettings settings;
  settings.build.march = scene::March::brick;
  set_grid(r, "bricks", settings);
  r.wait();
  r.frame();
  r.call("medium", [&] { r.viewer().set_medium(medium_of(2.0)); });
  r.wait();
  r.frame();
  r.call("ramp", [&] { r.viewer().set_ramps({.density = volume::Ramp({{0.0F, 0.0F}, {1.0F, 2.0F}})}); });
  r.wait();
  r.frame();
  r.call("rebuild", [&] { r.viewer().rebuild(); });
  r.wait();
  r.frame();
  r.call("two transforms", [&] { r.viewer().set_transforms({{moved(0.0)}, {moved(40.0)}}); });
  r.frame();
}

// States from main memory are built as those of any dynamic volume.
void dynamic_volume_that_may_stay_in_gl(StageRecorder& r) {
  const auto live = std::make_shared<viewer::Live>(std::nullopt, true);
  set_grid(r, "set the grid", limited_grid());
  set_live(r, live);
  show_state(r, live, 1);
  show_state(r, live, 2);
  r.states();
}

void dynamic_volume_for_views(StageRecorder& r) {
  const LivePtr live = make_live();
  set_grid(r, "grids for views", for_views());
  set_live(r, live);
  show_state(r, live, 1);
  r.wait();
  r.frame();
  r.wait();
  r.frame();
  show_state(r, live, 2);
  r.look({8.0, 8.0, 80.0}, {8.0, 8.0, 8.0});
  r.frame();
  r.frame();
  r.wait();
  r.frame();
}

}  // namespace

std::vector<StageScript> sequence_scripts() {
  return {{"sequence_played_forward", sequence_played_forward},
          {"sequence_played_backward", sequence_played_backward},
          {"sequence_repeated", sequence_repeated},
          {"sequence_sought_while_reading", sequence_sought_while_reading},
          {"sequence_interpolated", sequence_interpolated},
          {"sequence_with_missing_frames", sequence_with_missing_frames},
          {"sequence_without_readable_frames", sequence_without_readable_frames},
          {"sequence_takes_the_suggested_density_scale", sequence_takes_the_suggested_density_scale},
          {"sequence_with_other_settings", sequence_with_other_settings},
          {"sequence_replaced_by_a_load", sequence_replaced_by_a_load},
          {"sequence_replaced", sequence_replaced},
          {"sequence_of_instances", sequence_of_instances},
          {"sequence_beside_instances", sequence_beside_instances},
          {"sequence_of_little_memory", sequence_of_little_memory},
          {"sequence_waits_for_the_display", sequence_waits_for_the_display},
          {"sequence_for_views", sequence_for_views}};
}

std::vector<StageScript> dynamic_volume_scripts() {
  return {{"dynamic_volume", dynamic_volume},
          {"dynamic_volume_with_bounds", dynamic_volume_with_bounds},
          {"dynamic_volume_changes_while_building", dynamic_volume_changes_while_building},
          {"dynamic_volume_cancelled", dynamic_volume_cancelled},
          {"dynamic_volume_with_refused_states", dynamic_volume_with_refused_states},
          {"dynamic_volume_updated", dynamic_volume_updated},
          {"dynamic_volume_of_instances", dynamic_volume_of_instances},
          {"dynamic_volume_waits_for_the_display", dynamic_volume_waits_for_the_display},
          {"dynamic_volume_replaced", dynamic_volume_replaced},
          {"dynamic_volume_with_other_settings", dynamic_volume_with_other_settings},
          {"dynamic_volume_that_may_stay_in_gl", dynamic_volume_that_may_stay_in_gl},
          {"dynamic_volume_for_views", dynamic_volume_for_views}};
}

}  // namespace cumulet::test
