// Cumulet in a VTK 9 window: VTK draws its actors, and at the end of each frame of its renderer Cumulet draws the
// volume over them, into the same framebuffer, with VTK's camera and hidden by VTK's depth. Copy VolumeLayer.
//
//     cumulet-embed-vtk --volume FILE [--test OUT_DIR]
//
// The mouse moves VTK's camera, Q quits. --test: writes pictures of the scene with and without the volume.
#include <vtkActor.h>
#include <vtkAxesActor.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkCommand.h>
#include <vtkCylinderSource.h>
#include <vtkInteractorStyleTrackballCamera.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkOpenGLFramebufferObject.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkPNGWriter.h>
#include <vtkPolyDataMapper.h>
#include <vtkPropCollection.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkRenderer.h>
#include <vtkSphereSource.h>
#include <vtkTransform.h>
#include <vtkWindowToImageFilter.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cumulet/cumulet.hpp>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include <GL/glx.h>  // last: X11 defines macros with common names

namespace {

[[noreturn]] void fail(const std::string& cause) {
  std::fprintf(stderr, "cumulet-embed-vtk: %s\n", cause.c_str());
  std::exit(1);
}

template <class T>
T must(cumulet::Result<T> result) {
  if (!result) fail(result.error().message.c_str());
  return std::move(result).value();
}

void must(const cumulet::Result<>& result) {
  if (!result) fail(result.error().message.c_str());
}

/// VTK's matrices are row-major.
cumulet::Matrix column_major(vtkMatrix4x4& matrix) {
  cumulet::Matrix columns{};
  auto* element = columns.data();
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row) *element++ = matrix.GetElement(row, column);
  return columns;
}

/// Observer of a renderer's EndEvent that draws a volume over the renderer's actors. The render window's context must
/// be current when it is created and destroyed.
class VolumeLayer final : public vtkCommand {
 public:
  static VolumeLayer* New() { return new VolumeLayer; }

  /// The volume is thin enough for actors inside to be seen.
  void show(const cumulet::Volume& volume, std::uint32_t samples, double budget_ms) {
    constexpr double of_suggested = 0.2;
    must(viewer_.set_sampling({.samples = samples}));
    must(viewer_.set_medium({.density_scale = of_suggested * must(volume.suggest_density_scale())}));
    must(viewer_.set_volume(volume));
    budget_ms_ = budget_ms;
  }
  /// Ends the viewer before its context.
  void close() {
    visible_ = false;
    viewer_ = {};
    frame_ = {};
    changed_ = false;
  }
  void set_visible(bool visible) { visible_ = visible; }
  /// True if another frame of the renderer would show more than the last one.
  [[nodiscard]] bool wants_frame() { return frame_.has(cumulet::RenderFlags::incomplete) || changed_.exchange(false); }
  /// True if the last frame shows the image with all its samples.
  [[nodiscard]] bool converged() const { return frame_.has(cumulet::RenderFlags::converged); }

  void Execute(vtkObject* caller, unsigned long, void*) override {
    auto* renderer = vtkRenderer::SafeDownCast(caller);
    auto* window = renderer == nullptr ? nullptr : vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow());
    if (window != nullptr && visible_) draw(*renderer, *window);
  }

 private:
  VolumeLayer() {
    const auto get_proc = [](const char* name) {
      return reinterpret_cast<void*>(glXGetProcAddressARB(reinterpret_cast<const GLubyte*>(name)));
    };
    // GlStatePolicy::restore, the default: VTK keeps a copy of the GL state, which stays true.
    viewer_ = must(
        cumulet::Viewer::create({.get_proc = get_proc, .update = [this] { changed_ = true; }}));  // from any thread
    must(viewer_.set_sun_sky({.sun_azimuth_degrees = 60.0F,
                              .sun_elevation_degrees = 40.0F,
                              .sun_irradiance = {2.6F, 2.5F, 2.3F},
                              .sky_radiance = {0.2F, 0.3F, 0.5F}}));
    must(viewer_.set_display({.background = cumulet::Background::transparent}));  // VTK's own background stays
    camera_ = must(viewer_.get_camera());
  }

  void draw(vtkRenderer& renderer, vtkOpenGLRenderWindow& window) {
    vtkCamera* camera = renderer.GetActiveCamera();
    must(camera_.set_matrices(
        {.view = column_major(*camera->GetModelViewTransformMatrix()),
         .projection = column_major(*camera->GetProjectionTransformMatrix(renderer.GetTiledAspectRatio(), -1.0, 1.0))},
        cumulet::ClipSpace::negative_one_to_one));
    std::array<int, 4> viewport{};
    renderer.GetTiledSizeAndOrigin(&viewport[2], &viewport[3], viewport.data(), &viewport[1]);
    // VTK draws into this framebuffer, often a multisampled one, and copies it to the screen later.
    const int* size = window.GetRenderFramebuffer()->GetLastSize();
    const unsigned int framebuffer = window.GetRenderFramebuffer()->GetFBOIndex();
    frame_ = must(viewer_.render({.budget_ms = budget_ms_,
                                  .framebuffer = framebuffer,
                                  .width = static_cast<std::uint32_t>(size[0]),
                                  .height = static_cast<std::uint32_t>(size[1]),
                                  .viewport = viewport,
                                  .depth_source = cumulet::DepthSource::framebuffer,
                                  .depth_name = framebuffer}));
    if (frame_.has(cumulet::RenderFlags::failed)) fail(must(viewer_.get_progress()).message.c_str());
  }

  std::atomic<bool> changed_ = true;  // before viewer_, which sets it until it is destroyed
  cumulet::Viewer viewer_;
  cumulet::Camera camera_;
  cumulet::FrameResult frame_;
  double budget_ms_ = 0.0;
  bool visible_ = true;
};

// ---- VTK's own scene ------------------------------------------------------------------------------------------------

struct Box {
  std::array<double, 3> center{};
  std::array<double, 3> size{};

  [[nodiscard]] double largest() const { return *std::max_element(size.begin(), size.end()); }
};

Box box_of(const cumulet::Bounds& bounds) {
  Box box;
  for (std::size_t i = 0; i < 3; ++i) {
    box.center[i] = 0.5 * (bounds.min[i] + bounds.max[i]);
    box.size[i] = bounds.max[i] - bounds.min[i];
  }
  return box;
}

void add(vtkRenderer& renderer, vtkPolyDataAlgorithm& source, const std::array<double, 3>& position, double tilt,
         const std::array<double, 3>& color) {
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputConnection(source.GetOutputPort());
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  actor->SetPosition(position[0], position[1], position[2]);
  actor->RotateZ(tilt);
  actor->GetProperty()->SetColor(color[0], color[1], color[2]);
  renderer.AddActor(actor);
}

/// Adds an orange sphere in front of the volume, a blue one behind it, a red rod through it, and axes at its center.
void add_actors(vtkRenderer& renderer, const Box& box) {
  const auto at = [&box](double x, double y, double z) {
    return std::array{box.center[0] + x * box.size[0], box.center[1] + y * box.size[1],
                      box.center[2] + z * box.size[2]};
  };
  vtkNew<vtkSphereSource> sphere;
  sphere->SetRadius(0.1 * box.largest());
  sphere->SetThetaResolution(48);
  sphere->SetPhiResolution(48);
  add(renderer, *sphere, at(-0.2, -0.1, 0.9), 0.0, {1.0, 0.55, 0.1});
  add(renderer, *sphere, at(0.2, -0.2, -0.9), 0.0, {0.1, 0.3, 1.0});

  vtkNew<vtkCylinderSource> rod;
  rod->SetHeight(1.5 * box.size[0]);
  rod->SetRadius(0.04 * box.largest());
  rod->SetResolution(48);
  add(renderer, *rod, at(0.0, 0.0, 0.0), 80.0, {0.9, 0.1, 0.1});

  vtkNew<vtkAxesActor> axes;
  axes->SetTotalLength(0.7 * box.size[0], 0.9 * box.size[1], 0.7 * box.size[2]);
  axes->SetShaftTypeToCylinder();
  axes->AxisLabelsOff();
  vtkNew<vtkTransform> to_center;
  to_center->Translate(box.center.data());
  axes->SetUserTransform(to_center);
  renderer.AddActor(axes);
}

void set_actors_visible(vtkRenderer& renderer, bool visible) {
  vtkPropCollection* actors = renderer.GetViewProps();
  actors->InitTraversal();
  while (vtkProp* actor = actors->GetNextProp()) actor->SetVisibility(visible ? 1 : 0);
}

void place_camera(vtkRenderer& renderer, const Box& box) {
  std::array<double, 6> bounds{};
  for (std::size_t i = 0; i < 6; ++i) bounds[i] = box.center[i / 2] + (i % 2 == 0 ? -0.5 : 0.5) * box.size[i / 2];
  renderer.GetActiveCamera()->Elevation(12.0);
  renderer.ResetCamera(bounds.data());
  renderer.ResetCameraClippingRange();  // to the actors; Cumulet needs only their depth
}

// ---- Program --------------------------------------------------------------------------------------------------------

/// Renders until the volume has all samples, and writes the window's content.
void write_picture(vtkRenderWindow& window, const VolumeLayer* layer, const std::string& path) {
  do window.Render();
  while (layer != nullptr && !layer->converged());
  vtkNew<vtkWindowToImageFilter> content;
  content->SetInput(&window);
  content->ReadFrontBufferOff();
  content->ShouldRerenderOff();
  vtkNew<vtkPNGWriter> writer;
  writer->SetFileName(path.c_str());
  writer->SetInputConnection(content->GetOutputPort());
  writer->Write();
  if (writer->GetErrorCode() != 0) fail(path + ": cannot be written");
}

/// Writes the actors alone, all, the volume alone, and the actors alone again.
void write_pictures(vtkRenderWindow& window, vtkRenderer& renderer, VolumeLayer& layer, const std::string& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) fail(folder + ": " + failed.message());
  layer.set_visible(false);
  write_picture(window, nullptr, folder + "/actors.png");
  layer.set_visible(true);
  write_picture(window, &layer, folder + "/all.png");
  set_actors_visible(renderer, false);
  write_picture(window, &layer, folder + "/volume.png");
  set_actors_visible(renderer, true);
  layer.set_visible(false);
  write_picture(window, nullptr, folder + "/actors_again.png");
  window.MakeCurrent();
  layer.close();
}

/// Shows the window until the user closes it. Frames are drawn while there is something new.
void run(vtkRenderWindow& window, VolumeLayer& layer) {
  vtkNew<vtkRenderWindowInteractor> interactor;
  vtkNew<vtkInteractorStyleTrackballCamera> style;
  interactor->SetRenderWindow(&window);
  interactor->SetInteractorStyle(style);
  interactor->Initialize();
  struct Shown {
    vtkRenderWindow* window;
    VolumeLayer* layer;
  } shown{&window, &layer};
  vtkNew<vtkCallbackCommand> tick;
  tick->SetClientData(&shown);
  tick->SetCallback([](vtkObject*, unsigned long, void* data, void*) {
    const auto* scene = static_cast<Shown*>(data);
    if (scene->layer->wants_frame()) scene->window->Render();
  });
  interactor->AddObserver(vtkCommand::TimerEvent, tick);
  interactor->CreateRepeatingTimer(20);

  // Without this observer VTK 9.1 destroys the window and its context before the loop ends.
  vtkNew<vtkCallbackCommand> leave;
  leave->SetCallback([](vtkObject* caller, unsigned long, void*, void*) {
    static_cast<vtkRenderWindowInteractor*>(caller)->SetDone(true);
  });
  interactor->AddObserver(vtkCommand::ExitEvent, leave);
  window.Render();
  interactor->Start();
  window.MakeCurrent();
  layer.close();
}

}  // namespace

int main(int argc, char** argv) {
  std::string path, folder;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::string(argv[i]) == "--volume") path = argv[i + 1];
    if (std::string(argv[i]) == "--test") folder = argv[i + 1];
  }
  if (path.empty()) fail("usage: cumulet-embed-vtk --volume FILE [--test OUT_DIR]");
  const bool test = !folder.empty();
  const cumulet::Volume volume = must(cumulet::Volume::open(path));
  const Box box = box_of(must(volume.info()).bounds);

  vtkNew<vtkRenderer> renderer;
  renderer->SetBackground(0.25, 0.3, 0.38);
  add_actors(*renderer, box);
  vtkNew<vtkRenderWindow> window;
  window->SetWindowName("Cumulet in VTK");
  window->SetSize(test ? 240 : 1280, test ? 180 : 800);
  window->SetOffScreenRendering(test ? 1 : 0);
  window->AddRenderer(renderer);
  place_camera(*renderer, box);
  window->Render();  // creates the context

  vtkNew<VolumeLayer> layer;
  layer->show(volume, test ? 8U : 0U, test ? 200.0 : 15.0);
  renderer->AddObserver(vtkCommand::EndEvent, layer);
  if (test) {
    write_pictures(*window, *renderer, *layer, folder);
  } else {
    run(*window, *layer);
  }
  return 0;
}
