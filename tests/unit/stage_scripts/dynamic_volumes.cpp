// Scripts of dynamic volumes.

#include <array>
#include <limits>

#include "stage_scripts/scripts.hpp"

namespace cumulet::test {

namespace {

using LivePtr = std::shared_ptr<viewer::Live>;

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
  set_grid(r, "grids for views", adaptive_grid());
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
