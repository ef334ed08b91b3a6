// Scripts of sequences.

#include <filesystem>
#include <utility>

#include "stage_scripts/scripts.hpp"

namespace cumulet::test {

namespace {

constexpr int count = 5;  // frames of a sequence

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
  const SequencePtr sequence = sequence_of(write_clip(r, count), std::uint64_t{1} << 32U, true);
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
  set_grid(r, "grids for views", adaptive_grid());
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

}  // namespace cumulet::test
