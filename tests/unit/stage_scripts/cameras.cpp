// Scripts: cameras, grids for views, the frame's size and settings, update callbacks, errors and GL contexts.

#include <exception>
#include <glm/gtc/matrix_transform.hpp>
#include <optional>
#include <utility>

#include "headless.hpp"
#include "stage_scripts/scripts.hpp"

namespace cumulet::test {

namespace {

using glm::dvec3;

viewer::GridSettings for_views() {
  viewer::GridSettings settings = adaptive_grid();
  settings.build.refine.threshold = 0.1;
  return settings;
}

void set_volume(StageRecorder& r, const viewer::VolumeAssetPtr& volume) {
  r.call("set the volume", [&] { r.viewer().set_volume(volume); });
}

void set_preview(StageRecorder& r, bool preview) {
  r.call(preview ? "previews" : "no previews", [&] {
    viewer::Sampling sampling;
    sampling.options.preview = preview;
    r.viewer().set_sampling(sampling);
  });
}

// Lets the request of a frame be built, and shows it.
void build(StageRecorder& r) {
  r.frame();
  r.wait();
  r.frame();
}

// ---- cameras ----

void camera_fits_the_scene(StageRecorder& r) {
  r.frame();
  set_volume(r, cloud(16, 1));
  r.wait();
  r.frame();
  r.frame({30, 90});
  r.look({100.0, 50.0, 0.0}, {0.0, 0.0, 0.0});
  r.frame();
  r.call("fit", [&] { r.viewer().frame_all(); });
  r.frame();
  r.call("a waiting camera", [&] { r.viewer().camera()->set({}); });
  r.frame();
}

void camera_operations(StageRecorder& r) {
  set_volume(r, cloud(16, 1));
  r.wait();
  r.frame();
  const std::shared_ptr<viewer::Camera> first = r.viewer().camera();  // the viewer releases it below
  viewer::Camera& camera = *first;
  const auto show = [&](const char* name, const std::function<void()>& operation) {
    r.call(name, operation);
    r.frame();
  };
  show("orbit", [&] { camera.orbit(0.25, 0.125); });
  show("dolly", [&] { camera.dolly(2.0); });
  show("orthographic", [&] { camera.toggle_orthographic(r.viewer().bounds()); });
  show("matrices", [&] {
    camera.set_matrices(glm::lookAt(dvec3(8, 8, 60), dvec3(8, 8, 8), dvec3(0, 1, 0)),
                        glm::frustum(-0.05, 0.1, -0.05, 0.05, 0.1, 500.0), viewer::ClipDepth::negative_one_to_one);
  });
  show("lens", [&] {
    viewer::CameraPose pose = camera.pose();
    pose.lens_radius = 0.5;
    pose.focus_distance = 40.0;
    camera.set(pose);
  });
  show("another camera", [&] {
    viewer::CameraPose pose;
    pose.eye = {8.0, 8.0, 90.0};
    pose.target = {8.0, 8.0, 8.0};
    r.viewer().set_camera(std::make_shared<viewer::Camera>(pose));
  });
  show("the camera before has no effect", [&] { camera.orbit(1.0, 0.0); });
}

void camera_moves_while_the_shutter_is_open(StageRecorder& r) {
  set_volume(r, cloud(16, 1));
  r.wait();
  r.look({8.0, 8.0, 60.0}, {8.0, 8.0, 8.0});
  viewer::CameraPose open = r.viewer().camera()->pose();
  open.eye.x -= 1.0;
  viewer::CameraPose close = open;
  close.eye.x += 2.0;
  r.call("set the shutter's views", [&] { r.viewer().camera()->set_shutter(open, close); });
  r.frame();
  r.call("open the shutter", [&] {
    viewer::Sampling sampling;
    sampling.shutter_seconds = 0.5;
    r.viewer().set_sampling(sampling);
  });
  r.frame();
  const auto previous = std::make_shared<viewer::Camera>(open);
  r.call("set the previous camera", [&] { r.viewer().set_previous_camera(previous, 0.125); });
  r.frame();
  r.call("move the previous camera", [&] { previous->orbit(0.5, 0.0); });
  r.frame();
  r.call("no previous camera", [&] { r.viewer().set_previous_camera(nullptr, 0.0); });
  r.frame();
}

void input_drags_the_camera(StageRecorder& r) {
  using Type = viewer::InputEvent::Type;
  set_volume(r, cloud(16, 1));
  r.wait();
  r.frame();
  const auto send = [&](const char* name, const viewer::InputEvent& event) {
    r.call(name, [&] { r.viewer().input(event); });
    r.frame();
  };
  send("press", {.type = Type::button_down, .x = 10.0, .y = 10.0});
  send("drag", {.type = Type::pointer_move, .x = 20.0, .y = 14.0});
  send("release", {.type = Type::button_up, .x = 20.0, .y = 14.0});
  send("move", {.type = Type::pointer_move, .x = 30.0, .y = 30.0});
  send("wheel", {.type = Type::wheel, .x = 30.0, .y = 30.0, .wheel = 1.0});
}

// ---- grids for views ----

void grid_for_views(StageRecorder& r) {
  set_grid(r, "grids for views", for_views());
  set_volume(r, cloud(24, 1));
  r.wait();
  build(r);
  r.frame();
  r.look({12.0, 12.0, 60.0}, {12.0, 12.0, 12.0});
  build(r);
  r.frame({32, 32});
  r.wait();
  r.frame({32, 32});
  r.wait();
  r.frame({32, 32});
  r.call("other transform", [&] { r.viewer().set_transforms({{moved(5.0)}}); });
  r.frame({32, 32});
  r.wait();
  r.frame({32, 32});
  r.wait();
  r.frame({32, 32});
  r.call("orthographic", [&] { r.viewer().camera()->toggle_orthographic(r.viewer().bounds()); });
  r.frame({32, 32});
  r.wait();
  r.frame({32, 32});
  r.wait();
  r.frame({32, 32});
  set_grid(r, "any view", {});
  r.wait();
  r.frame({32, 32});
}

// While the camera moves, no grid is requested, except without previews.
void grid_for_views_in_motion(StageRecorder& r) {
  set_grid(r, "grids for views", for_views());
  set_volume(r, cloud(24, 1));
  r.look({12.0, 12.0, 60.0}, {12.0, 12.0, 12.0});
  build(r);
  for (const double x : {13.0, 14.0, 15.0}) {
    r.look({x, 12.0, 60.0}, {12.0, 12.0, 12.0});
    r.frame();
  }
  r.frame({64, 48}, -1.0);
  build(r);
  set_preview(r, false);
  for (const double x : {16.0, 17.0}) {
    r.look({x, 12.0, 60.0}, {12.0, 12.0, 12.0});
    build(r);
  }
}

void grid_for_views_by_the_gpu(StageRecorder& r) {
  viewer::GridSettings settings = for_views();
  settings.build.on = viewer::BuildOn::gpu;
  set_grid(r, "grids for views", settings);
  set_volume(r, cloud(24, 1));
  r.look({12.0, 12.0, 60.0}, {12.0, 12.0, 12.0});
  build(r);
  r.look({12.0, 12.0, 30.0}, {12.0, 12.0, 12.0});
  build(r);
  settings.build.refine.pixel_size = 4.0;
  set_grid(r, "larger cells", settings);
  build(r);
}

void grid_for_views_of_instances(StageRecorder& r) {
  const viewer::VolumeAssetPtr volume = cloud(16, 1);
  const auto instance = [&](double x) {
    return std::make_shared<viewer::Instance>(viewer::InstanceSettings{.volume = volume, .to_world = moved(x)});
  };
  const auto a = instance(0.0);
  const auto b = instance(40.0);
  set_grid(r, "grids for views", for_views());
  r.call("add a", [&] { r.viewer().add_instance(a); });
  r.call("add b", [&] { r.viewer().add_instance(b); });
  r.wait();
  build(r);
  r.look({20.0, 8.0, 90.0}, {20.0, 8.0, 8.0});
  build(r);
  r.call("move b", [&] { b->edit([](auto& settings) { settings.to_world = moved(60.0); }); });
  build(r);
  r.call("set the volume", [&] { r.viewer().set_volume(cloud(16, 2, "own")); });
  build(r);
  r.look({20.0, 8.0, 60.0}, {20.0, 8.0, 8.0});
  build(r);
}

// The grid of the loaded volume is for the view after the load.
void grid_for_views_while_reading(StageRecorder& r) {
  write_slow_ball(r.path("slow.vdb"));
  set_grid(r, "grids for views", for_views());
  set_volume(r, cloud(16, 1));
  r.call("add an instance", [&] {
    r.viewer().add_instance(std::make_shared<viewer::Instance>(
        viewer::InstanceSettings{.volume = cloud(16, 2, "a"), .to_world = moved(40.0)}));
  });
  build(r);
  r.hold(negative_voxel);
  r.load("slow.vdb", [](viewer::VolumeFile& file) { file.min_proxy_bricks = 1; });
  r.held();
  r.look({12.0, 12.0, 90.0}, {12.0, 12.0, 12.0});
  r.release();
  r.wait();
  build(r);
  r.frame();
}

// A cancelled load leaves the volume without a grid for the new view, which a later frame requests.
void grid_for_views_after_a_cancelled_load(StageRecorder& r) {
  write_slow_ball(r.path("slow.vdb"));
  set_grid(r, "grids for views", for_views());
  set_volume(r, cloud(16, 1));
  r.look({8.0, 8.0, 60.0}, {8.0, 8.0, 8.0});
  build(r);
  r.hold(negative_voxel);
  r.load("slow.vdb");
  r.held();
  r.look({8.0, 8.0, 90.0}, {8.0, 8.0, 8.0});
  r.frame();
  r.frame();
  r.call("cancel", [&] { r.viewer().cancel(); });
  r.release();
  r.wait();
  build(r);
}

// ---- frames ----

void frame_without_pixels(StageRecorder& r) {
  r.frame({0, 0});
  set_volume(r, cloud(16, 1));
  r.wait();
  r.frame({0, 0});
  r.frame();
  r.frame({64, 0});
  r.frame({0, 48}, -1.0);
  r.frame();
}

void sampling_and_display(StageRecorder& r) {
  set_volume(r, cloud(16, 1));
  r.wait();
  r.frame();
  viewer::Sampling sampling;
  sampling.samples = 16;
  sampling.seed = 3;
  sampling.first_sample = 4;
  sampling.options.region = {{0.25F, 0.25F}, {0.5F, 0.5F}};
  r.call("region", [&] { r.viewer().set_sampling(sampling); });
  r.frame();
  sampling.noise_target = 0.01;
  sampling.options.adaptive = true;
  sampling.options.light_groups = 3;
  sampling.options.separate_volume_aov = true;
  sampling.options.view = render::View::cells;
  r.call("noise target", [&] { r.viewer().set_sampling(sampling); });
  r.frame();
  viewer::DisplaySettings display;
  display.exposure_stops = 1.5F;
  display.transparent = true;
  display.denoise = true;
  r.call("display", [&] { r.viewer().set_display(display); });
  r.frame();
  r.frame();
}

void update_callbacks(StageRecorder& r) {
  const auto instance = std::make_shared<viewer::Instance>(viewer::InstanceSettings{.volume = nullptr});
  r.updates();
  r.call("set the display", [&] { r.viewer().set_display({}); });
  r.updates();
  r.frame();
  r.updates();
  r.call("set the display", [&] { r.viewer().set_display({}); });
  r.call("set it again", [&] { r.viewer().set_display({}); });
  r.updates();
  r.frame();
  r.call("move the camera", [&] { r.viewer().camera()->orbit(0.5, 0.0); });
  r.updates();
  r.look({0.0, 0.0, 9.0}, {0.0, 0.0, 0.0});
  r.updates();
  r.frame();
  r.call("add an instance", [&] { r.viewer().add_instance(instance); });
  r.updates();
  r.frame();
  r.call("edit it", [&] { instance->edit([](auto& settings) { settings.tag = 1; }); });
  r.updates();
  r.frame();
  r.call("remove it", [&] { r.viewer().remove_instance(*instance); });
  r.updates();
  r.frame();
  r.call("edit it", [&] { instance->edit([](auto& settings) { settings.tag = 2; }); });
  r.updates();
  // The end of a job.
  set_grid(r, "set the grid", limited_grid());
  r.frame();
  r.updates();
  r.hold(limited_cells);
  set_volume(r, cloud(24, 1));
  r.held();
  r.updates();
  r.frame();
  r.updates();
  r.release();
  r.wait_for_update();
  r.wait();
  r.frame();
  r.updates();
}

// ---- errors ----

viewer::Frame small_frame() {
  viewer::Frame frame;
  frame.target = viewer::Target::none;
  frame.size = {16, 16};
  frame.viewport = {0, 0, 16, 16};
  frame.budget_ms = 1e3;
  return frame;
}

// A call that throws changes nothing, so that the frame after it has the same scene.
void errors_change_nothing(StageRecorder& r) {
  const auto instance = std::make_shared<viewer::Instance>(viewer::InstanceSettings{.volume = cloud(16, 2, "a")});
  const auto other = std::make_shared<viewer::Instance>(viewer::InstanceSettings{.volume = nullptr});
  const auto model = std::make_shared<viewer::ModelInstance>(viewer::ModelSettings{});
  const auto other_model = std::make_shared<viewer::ModelInstance>(viewer::ModelSettings{});
  viewer::Viewer& viewer = r.viewer();
  r.call("fit nothing", [&] { viewer.frame_all(); });
  r.call("bounds of nothing", [&] { viewer.bounds(); });
  set_volume(r, cloud(16, 1));
  r.call("add an instance", [&] { viewer.add_instance(instance); });
  r.call("add a model", [&] { viewer.add_model(model); });
  r.wait();
  r.frame();
  r.frame();
  const auto refuse = [&](const char* name, const std::function<void()>& function) {
    r.call(name, function);
    r.wait();
    r.frame();
  };
  refuse("add the instance again", [&] { viewer.add_instance(instance); });
  refuse("remove an instance that is not shown", [&] { viewer.remove_instance(*other); });
  refuse("add the model again", [&] { viewer.add_model(model); });
  refuse("remove a model that is not shown", [&] { viewer.remove_model(*other_model); });
  refuse("use a camera of no surfaces", [&] { viewer.use_surface_camera(0); });
  refuse("matrices that are no view",
         [&] { viewer.camera()->set_matrices(glm::dmat4(0.0), glm::dmat4(0.0), viewer::ClipDepth::zero_to_one); });
  refuse("status of no sequence", [&] { viewer.sequence(); });
  refuse("status of no dynamic volume", [&] { viewer.live(); });
  refuse("failure of no sequence", [&] { static_cast<void>(viewer.frame_failure(0)); });
  refuse("sequence of an instance with a volume", [&] { viewer.sequence(*instance); });
  refuse("dynamic volume of an instance with a volume", [&] { viewer.live(*instance); });
  refuse("sequence of an instance that is not shown", [&] { viewer.sequence(*other); });
}

void calls_without_a_context(StageRecorder& r) {
  viewer::Viewer& viewer = r.viewer();
  set_volume(r, cloud(16, 1));
  r.wait();
  r.frame();
  r.frame();
  std::vector<float> values(4096);
  std::vector<std::byte> bytes(16);
  const auto refuse = [&](const char* name, const std::function<void()>& function) {
    r.call(name, function);
    r.frame();
  };
  refuse("attach without functions",
         [&] { viewer.attach([](void*, const char*) -> void* { return nullptr; }, nullptr); });
  refuse("render", [&] { viewer.render(small_frame()); });
  refuse("warm up", [&] { viewer.warm_up(small_frame(), false); });
  refuse("pick", [&] { viewer.pick(1.0, 1.0); });
  refuse("update a map", [&] { viewer.update_map({}); });
  refuse("drop a map", [&] { viewer.drop_map(0); });
  refuse("read radiance", [&] { viewer.read_linear(values.data(), values.size()); });
  refuse("read an AOV", [&] { viewer.read_aov(viewer::Aov::normal, values.data(), values.size()); });
  refuse("measure the noise", [&] { viewer.measure_noise(); });
  refuse("size of the samples", [&] { viewer.accumulation_bytes(); });
  refuse("restore samples", [&] { viewer.restore_accumulation(bytes); });
  refuse("submit a state from GL", [&] { viewer.set_live_gl(std::make_shared<viewer::Live>(std::nullopt), {}); });
  r.call("detach", [&] { viewer.detach(); });
  r.call("lose no context", [&] { viewer.context_lost(); });
  r.frame();
}

void wait_times_out(StageRecorder& r) {
  set_grid(r, "set the grid", limited_grid());
  r.hold(limited_cells);
  set_volume(r, cloud(24, 1));
  r.held();
  r.call("wait for no time", [&] { r.viewer().wait(0.0); });
  r.frame();
  r.release();
  r.wait();
  r.frame();
}

// Grids and poses are uploaded again, without a request. This script needs a GL driver.
void context_made_again(StageRecorder& r) {
  struct Detach {
    viewer::Viewer& viewer;
    ~Detach() { viewer.context_lost(); }
  };
  std::optional<headless::Context> context;
  const Detach detach{r.viewer()};
  const auto render = [&] {
    context.emplace(headless::Context::create(headless::Backend::automatic));
    r.call("attach", [&] { r.viewer().attach(headless::Context::get_proc, &*context); });
    bool converged = false;
    r.call("render", [&] {
      for (int i = 0; i < 10'000 && !converged; ++i) converged = r.viewer().render(small_frame()).converged;
    });
    r.call(converged ? "it has converged" : "it has not converged", [] {});
    r.call("lose the context", [&] { r.viewer().context_lost(); });
    r.frame({16, 16});
  };
  set_volume(r, cloud(16, 1));
  r.call("add an instance", [&] {
    r.viewer().add_instance(std::make_shared<viewer::Instance>(
        viewer::InstanceSettings{.volume = cloud(16, 2, "a"), .to_world = moved(30.0)}));
  });
  r.call("set the surfaces", [&] { r.viewer().set_surfaces(surfaces_of(std::make_shared<const MovingScene>())); });
  r.call("four samples", [&] { r.viewer().set_sampling({4, 0, {render::View::shaded, false}}); });
  r.wait();
  r.frame({16, 16});
  try {
    render();
    render();
  } catch (const std::exception& error) {
    r.skip(error.what());
  }
}

}  // namespace

std::vector<StageScript> camera_scripts() {
  return {{"camera_fits_the_scene", camera_fits_the_scene},
          {"camera_operations", camera_operations},
          {"camera_moves_while_the_shutter_is_open", camera_moves_while_the_shutter_is_open},
          {"input_drags_the_camera", input_drags_the_camera},
          {"grid_for_views", grid_for_views},
          {"grid_for_views_in_motion", grid_for_views_in_motion},
          {"grid_for_views_by_the_gpu", grid_for_views_by_the_gpu},
          {"grid_for_views_of_instances", grid_for_views_of_instances},
          {"grid_for_views_while_reading", grid_for_views_while_reading},
          {"grid_for_views_after_a_cancelled_load", grid_for_views_after_a_cancelled_load},
          {"frame_without_pixels", frame_without_pixels},
          {"sampling_and_display", sampling_and_display},
          {"update_callbacks", update_callbacks}};
}

std::vector<StageScript> error_scripts() {
  return {{"errors_change_nothing", errors_change_nothing},
          {"calls_without_a_context", calls_without_a_context},
          {"wait_times_out", wait_times_out},
          {"context_made_again", context_made_again}};
}

}  // namespace cumulet::test
