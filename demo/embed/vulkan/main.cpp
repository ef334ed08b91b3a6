// Cumulet in a Vulkan program on Linux, without a window: Vulkan draws boxes, a viewer in an OpenGL context beside it
// draws the volume into an image of Vulkan, hidden by Vulkan's depth, and Vulkan composites that image over the boxes.
// Copy OpenGl, SharedImage and Handshake. docs/howto/vulkan.md describes the steps.
//
//     cumulet-embed-vulkan --volume FILE [--test OUT_DIR]      writes vulkan.ppm to OUT_DIR or the current folder
//
// --test: also writes vulkan_boxes.ppm, the picture without the volume.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cumulet/cumulet.hpp>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "device.hpp"
#include "opengl.hpp"
#include "scene.hpp"
#include "sharing.hpp"

namespace {

using vulkan_host::fail;
using Vector = std::array<double, 3>;

constexpr VkExtent2D picture_size{240, 180};

template <class T>
T must(cumulet::Result<T> result) {
  if (!result) fail(result.error().message.c_str());
  return std::move(result).value();
}

void must(const cumulet::Result<>& result) {
  if (!result) fail(result.error().message.c_str());
}

// ---- Matrices, column-major -----------------------------------------------------------------------------------------

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vector normalized(const Vector& a) {
  const double length = std::sqrt(dot(a, a));
  return {a[0] / length, a[1] / length, a[2] / length};
}

cumulet::Matrix product(const cumulet::Matrix& a, const cumulet::Matrix& b) {
  cumulet::Matrix c{};
  for (std::size_t column = 0; column < 4; ++column)
    for (std::size_t row = 0; row < 4; ++row)
      for (std::size_t i = 0; i < 4; ++i) c[4 * column + row] += a[4 * i + row] * b[4 * column + i];
  return c;
}

cumulet::Matrix look_at(const Vector& eye, const Vector& target) {
  const Vector back = normalized({eye[0] - target[0], eye[1] - target[1], eye[2] - target[2]});
  const Vector right = normalized(cross({0.0, 1.0, 0.0}, back));
  const Vector up = cross(back, right);
  return {right[0], up[0], back[0], 0.0, right[1],         up[1],         back[1],         0.0,
          right[2], up[2], back[2], 0.0, -dot(right, eye), -dot(up, eye), -dot(back, eye), 1.0};
}

/// Vulkan's depth, from 0 at `near` to 1 at `far`, with +Y up.
cumulet::Matrix perspective(double height_at_one, double aspect, double near, double far) {
  const double y = 2.0 / height_at_one;
  cumulet::Matrix matrix{};
  matrix[0] = y / aspect;
  matrix[5] = y;
  matrix[10] = far / (near - far);
  matrix[11] = -1.0;
  matrix[14] = near * far / (near - far);
  return matrix;
}

// ---- The scene ------------------------------------------------------------------------------------------------------

struct View {
  cumulet::Matrix view{}, projection{};
};

struct Placed {
  Vector center{}, half_size{};  ///< relative to the volume's box: -1 to 1, and half its size
  std::array<float, 4> color{};
};

/// An orange box in front of the volume, a blue one behind it, a red beam through it, and a floor.
constexpr std::array<Placed, 4> placed{{{{-0.3, -0.35, 1.5}, {0.13, 0.35, 0.13}, {1.0F, 0.45F, 0.08F, 1.0F}},
                                        {{0.55, 0.1, -1.7}, {0.35, 1.2, 0.2}, {0.1F, 0.25F, 0.9F, 1.0F}},
                                        {{0.0, 0.05, 0.0}, {1.7, 0.08, 0.08}, {0.85F, 0.08F, 0.08F, 1.0F}},
                                        {{0.0, -1.2, -0.3}, {1.9, 0.04, 2.1}, {0.3F, 0.3F, 0.32F, 1.0F}}}};

View view_of(const cumulet::Bounds& bounds) {
  Vector center{}, half{};
  for (std::size_t i = 0; i < 3; ++i) {
    center[i] = 0.5 * (bounds.min[i] + bounds.max[i]);
    half[i] = 0.5 * (bounds.max[i] - bounds.min[i]);
  }
  const double radius = std::max({half[0], half[1], half[2]});
  const Vector eye{center[0] + 0.4 * radius, center[1] + 0.8 * radius, center[2] + 4.6 * radius};
  return {.view = look_at(eye, center),
          .projection = perspective(0.72, static_cast<double>(picture_size.width) / picture_size.height, 0.1 * radius,
                                    20.0 * radius)};
}

std::vector<vulkan_host::Box> boxes_around(const cumulet::Bounds& bounds, const View& view) {
  const cumulet::Matrix to_clip = product(view.projection, view.view);
  std::vector<vulkan_host::Box> boxes;
  for (const Placed& from : placed) {
    cumulet::Matrix to_world{};
    to_world[15] = 1.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double half = 0.5 * (bounds.max[i] - bounds.min[i]);
      to_world[5 * i] = from.half_size[i] * half;
      to_world[12 + i] = 0.5 * (bounds.min[i] + bounds.max[i]) + from.center[i] * half;
    }
    const cumulet::Matrix box_to_clip = product(to_clip, to_world);
    vulkan_host::Box& box = boxes.emplace_back();
    std::transform(box_to_clip.begin(), box_to_clip.end(), box.to_clip.begin(),
                   [](double element) { return static_cast<float>(element); });
    box.color = from.color;
  }
  return boxes;
}

// ---- The volume -----------------------------------------------------------------------------------------------------

/// A viewer that draws into an image of Vulkan.
class VolumeLayer {
 public:
  VolumeLayer(const vulkan_host::OpenGl& gl, const cumulet::Volume& volume, const View& view)
      : gl_(gl), viewer_(must(cumulet::Viewer::create({.get_proc = vulkan_host::OpenGl::get_proc}))) {
    must(viewer_.set_sun_sky({.sun_azimuth_degrees = 60.0F,
                              .sun_elevation_degrees = 40.0F,
                              .sun_irradiance = {2.6F, 2.5F, 2.3F},
                              .sky_radiance = {0.2F, 0.3F, 0.5F}}));
    must(viewer_.set_display({.background = cumulet::Background::transparent}));  // Vulkan has drawn its own
    must(viewer_.set_sampling({.samples = 32}));
    constexpr double of_suggested = 0.3;  // thin enough for the beam inside to be seen
    must(viewer_.set_medium({.density_scale = of_suggested * must(volume.suggest_density_scale())}));
    must(viewer_.set_volume(volume));
    must(must(viewer_.get_camera())
             .set_matrices({.view = view.view, .projection = view.projection}, cumulet::ClipSpace::zero_to_one));
    gl_.create_framebuffers(1, &framebuffer_);
  }
  VolumeLayer(const VolumeLayer&) = delete;
  VolumeLayer& operator=(const VolumeLayer&) = delete;
  ~VolumeLayer() { gl_.delete_framebuffers(1, &framebuffer_); }

  /// Draws the newest image. `depth` has the depth of the opaque scene.
  void draw(const vulkan_host::SharedImage& image, const vulkan_host::SharedImage& depth) {
    gl_.framebuffer_texture(framebuffer_, GL_COLOR_ATTACHMENT0, image.texture(), 0);
    frame_ = must(viewer_.render({.budget_ms = 20.0,
                                  .framebuffer = framebuffer_,
                                  .width = picture_size.width,
                                  .height = picture_size.height,
                                  .flip_y = true,
                                  .color = cumulet::ColorEncoding::linear,
                                  .blend = cumulet::BlendMode::replace,
                                  .depth_source = cumulet::DepthSource::texture,
                                  .depth_name = depth.texture(),
                                  .depth_flip_y = true,
                                  .depth_unchanged = drawn_}));
    drawn_ = true;
    if (frame_.has(cumulet::RenderFlags::failed)) fail(must(viewer_.get_progress()).message.c_str());
  }
  /// True if the last image has all its samples.
  [[nodiscard]] bool converged() const { return frame_.has(cumulet::RenderFlags::converged); }

 private:
  const vulkan_host::OpenGl& gl_;
  cumulet::Viewer viewer_;
  cumulet::FrameResult frame_;
  GLuint framebuffer_ = 0;
  bool drawn_ = false;
};

// ---- Program --------------------------------------------------------------------------------------------------------

void write_picture(const std::vector<std::uint8_t>& pixels, const std::string& path) {
  std::ofstream file(path, std::ios::binary);
  file << "P6\n" << picture_size.width << ' ' << picture_size.height << "\n255\n";
  for (std::size_t i = 0; i < pixels.size(); i += 4) file.write(reinterpret_cast<const char*>(&pixels[i]), 3);
  if (!file.flush()) fail(path + ": cannot be written");
}

}  // namespace

int main(int argc, char** argv) {
  std::string path, folder = ".";
  bool test = false;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::string(argv[i]) == "--volume") path = argv[i + 1];
    if (std::string(argv[i]) == "--test") {
      folder = argv[i + 1];
      test = true;
    }
  }
  if (path.empty()) fail("usage: cumulet-embed-vulkan --volume FILE [--test OUT_DIR]");
  const cumulet::Volume volume = must(cumulet::Volume::open(path));
  const cumulet::Bounds bounds = must(volume.info()).bounds;
  const View view = view_of(bounds);
  const std::vector<vulkan_host::Box> boxes = boxes_around(bounds, view);

  const vulkan_host::Device device;
  const vulkan_host::OpenGl gl(device);
  const vulkan_host::SharedImage image(device, gl, VK_FORMAT_R16G16B16A16_SFLOAT, GL_RGBA16F, picture_size);
  const vulkan_host::SharedImage depth(device, gl, VK_FORMAT_R32_SFLOAT, GL_R32F, picture_size);
  const vulkan_host::Handshake handshake(device, gl, {image.texture(), depth.texture()});
  std::printf("%s: %s\n", device.name().c_str(),
              handshake.uses_semaphores() ? "images and semaphores are shared"
                                          : "images are shared, and the processor waits, because semaphores cannot be");
  vulkan_host::Scene scene(device, picture_size);
  VkCommandBuffer draw_boxes = device.create_commands();
  VkCommandBuffer draw_volume = device.create_commands();
  VolumeLayer layer(gl, volume, view);

  bool first = true;
  do {
    vulkan_host::Device::begin(draw_boxes);
    if (first) vulkan_host::Scene::record_clear(draw_boxes, image);  // the viewer draws nothing before its first image
    scene.record_boxes(draw_boxes, boxes, depth, image);
    handshake.give_to_gl(draw_boxes);
    if (!first || !test) layer.draw(image, depth);
    vulkan_host::Device::begin(draw_volume);
    scene.record_volume(draw_volume, image);
    handshake.take_from_gl(draw_volume);
    if (first && test) write_picture(scene.read_picture(), folder + "/vulkan_boxes.ppm");
    first = false;
  } while (!layer.converged());
  write_picture(scene.read_picture(), folder + "/vulkan.ppm");
  return 0;
}
