#pragma once

#include <glad/gl.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "cumulet/cumulet.h"
#include "headless.hpp"

/// Helpers for tests that use the library only through cumulet.h.
namespace cumulet::test {

template <class Desc>
Desc make_desc() {
  Desc desc{};
  desc.struct_size = sizeof(Desc);
  return desc;
}

struct DestroyViewer {
  void operator()(cumulet_viewer* viewer) const { cumulet_destroy(viewer); }
};
using ViewerPtr = std::unique_ptr<cumulet_viewer, DestroyViewer>;
struct ReleaseVolume {
  void operator()(cumulet_volume* volume) const { cumulet_volume_release(volume); }
};
struct ReleaseSurfaces {
  void operator()(cumulet_surfaces* surfaces) const { cumulet_surfaces_release(surfaces); }
};
using SurfacesRef = std::unique_ptr<cumulet_surfaces, ReleaseSurfaces>;
using VolumeRef = std::unique_ptr<cumulet_volume, ReleaseVolume>;
struct ReleaseEnvironment {
  void operator()(cumulet_environment* environment) const { cumulet_environment_release(environment); }
};
using EnvironmentRef = std::unique_ptr<cumulet_environment, ReleaseEnvironment>;
struct ReleaseInstance {
  void operator()(cumulet_instance* instance) const { cumulet_instance_release(instance); }
};
using InstanceRef = std::unique_ptr<cumulet_instance, ReleaseInstance>;

struct ReleaseModel {
  void operator()(cumulet_model* model) const { cumulet_model_release(model); }
};
using ModelRef = std::unique_ptr<cumulet_model, ReleaseModel>;
struct ReleaseSequence {
  void operator()(cumulet_sequence* sequence) const { cumulet_sequence_release(sequence); }
};
using SequenceRef = std::unique_ptr<cumulet_sequence, ReleaseSequence>;
struct ReleaseLive {
  void operator()(cumulet_dynamic_volume* live) const { cumulet_dynamic_volume_release(live); }
};
using LiveRef = std::unique_ptr<cumulet_dynamic_volume, ReleaseLive>;
struct ReleasePrograms {
  void operator()(cumulet_shader_cache* programs) const { cumulet_shader_cache_release(programs); }
};
using ProgramsRef = std::unique_ptr<cumulet_shader_cache, ReleasePrograms>;
struct ReleaseCamera {
  void operator()(cumulet_camera* camera) const { cumulet_camera_release(camera); }
};
using CameraRef = std::unique_ptr<cumulet_camera, ReleaseCamera>;

/// An instance transform that translates by (x, y, z).
inline std::array<double, 16> at(double x, double y, double z) {
  return {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1};
}

/// Calls a create function of the C API and returns its object. Throws std::runtime_error with the error message.
template <class Ref, class Create, class Desc>
Ref made_by(Create create, const Desc& desc) {
  typename Ref::pointer out = nullptr;
  std::array<char, 256> error{};
  if (create(&desc, &out, error.data(), error.size()) != CUMULET_OK) throw std::runtime_error(error.data());
  return Ref(out);
}

inline VolumeRef make_dense(const cumulet_dense_desc& desc) {
  return made_by<VolumeRef>(cumulet_volume_from_dense, desc);
}

inline InstanceRef make_instance(const cumulet_instance_desc& desc) {
  return made_by<InstanceRef>(cumulet_instance_create, desc);
}

/// A lumpy ball of size^3 voxels centered on the origin, as a dense array.
inline VolumeRef make_ball(int size, float density = 0.4F) {
  std::vector<float> values;
  const float middle = 0.5F * static_cast<float>(size - 1);
  for (int z = 0; z < size; ++z) {
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const std::array<float, 3> p{static_cast<float>(x) - middle, static_cast<float>(y) - middle,
                                     static_cast<float>(z) - middle};
        const float radius = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) / (middle + 0.5F);
        const float lumps = 1.0F + 0.3F * std::sin(p[0]) * std::sin(1.3F * p[1]) * std::sin(0.7F * p[2]);
        values.push_back(radius < 1.0F ? density * lumps * (1.0F - radius * radius) : 0.0F);
      }
    }
  }
  auto desc = make_desc<cumulet_dense_desc>();
  desc.values = values.data();
  desc.value_count = values.size();
  for (int& side : desc.size) side = size;
  for (int i = 0; i < 4; ++i) desc.index_to_world[i * 5] = 1.0;
  for (int i = 0; i < 3; ++i) desc.index_to_world[12 + i] = -middle;
  desc.name = "ball";
  return make_dense(desc);
}

/// An environment with a bright patch on one side and another color elsewhere, so that rotating it changes the image.
/// Throws std::runtime_error.
inline EnvironmentRef make_environment(std::uint32_t width, std::uint32_t height, float bright = 6.0F) {
  std::vector<float> values;
  for (std::uint32_t i = 0; i < width * height; ++i) {
    const bool sun = i % width < width / 8 && i / width < height / 2;
    for (const float c : {1.0F, 0.6F, 0.3F}) values.push_back(sun ? c * bright : 0.3F * (1.3F - c));
  }
  auto desc = make_desc<cumulet_environment_desc>();
  desc.values = values.data();
  desc.value_count = values.size();
  desc.width = width;
  desc.height = height;
  cumulet_environment* out = nullptr;
  std::array<char, 256> error{};
  if (cumulet_environment_from_pixels(&desc, &out, error.data(), error.size()) != CUMULET_OK)
    throw std::runtime_error(error.data());
  return EnvironmentRef(out);
}

/// Reads surfaces from the bytes of a file. Throws std::runtime_error.
inline SurfacesRef read_surfaces(const std::vector<std::uint8_t>& file) {
  cumulet_surfaces* out = nullptr;
  std::array<char, 256> error{};
  if (cumulet_surfaces_from_memory(file.data(), file.size(), nullptr, nullptr, &out, error.data(), error.size()) !=
      CUMULET_OK)
    throw std::runtime_error(error.data());
  return SurfacesRef(out);
}

/// Throws std::runtime_error.
inline SurfacesRef make_surfaces(std::span<const cumulet_mesh_desc> meshes) {
  auto desc = make_desc<cumulet_triangles_desc>();
  desc.meshes = meshes.data();
  desc.mesh_count = meshes.size();
  cumulet_surfaces* out = nullptr;
  std::array<char, 256> error{};
  if (cumulet_surfaces_from_triangles(&desc, &out, error.data(), error.size()) != CUMULET_OK)
    throw std::runtime_error(error.data());
  return SurfacesRef(out);
}

/// Two double-sided triangles with these corners in order. `card` gives the other fields of the mesh. Throws
/// std::runtime_error.
inline SurfacesRef make_quad(const std::array<float, 12>& corners,
                             cumulet_mesh_desc card = make_desc<cumulet_mesh_desc>()) {
  const std::array<std::uint32_t, 6> indices{0, 1, 2, 0, 2, 3};
  card.positions = corners.data();
  card.vertex_count = 4;
  card.indices = indices.data();
  card.index_count = indices.size();
  card.double_sided = 1;
  return make_surfaces({&card, 1});
}

/// Two panes that cross a ball of make_ball: an opaque one that extends to `reach`, and one with alpha 0.5.
inline SurfacesRef make_panes(float reach) {
  const std::array<float, 9> opaque{-reach, -reach, 0.0F, reach, -reach, 0.0F, 0.0F, reach + 1.0F, 1.0F};
  const std::array<float, 9> veil{-9.0F, -2.0F, 9.0F, 9.0F, -2.0F, 9.0F, 0.0F, 2.0F, 9.0F};
  std::array<cumulet_mesh_desc, 2> meshes{make_desc<cumulet_mesh_desc>(), make_desc<cumulet_mesh_desc>()};
  for (std::size_t i = 0; i < 2; ++i) {
    meshes.at(i).positions = i == 0 ? opaque.data() : veil.data();
    meshes.at(i).vertex_count = 3;
    meshes.at(i).double_sided = 1;
  }
  const std::array<float, 4> half{0.9F, 0.2F, 0.1F, 0.5F};
  std::copy(half.begin(), half.end(), meshes[1].base_color);
  return make_surfaces(meshes);
}

inline GladGLContext load_gl(cumulet_get_proc_fn get_proc, void* user) {
  std::pair<cumulet_get_proc_fn, void*> loader(get_proc, user);
  GladGLContext gl{};
  const auto load = [](void* l, const char* name) {
    const auto& [function, its_user] = *static_cast<std::pair<cumulet_get_proc_fn, void*>*>(l);
    return reinterpret_cast<GLADapiproc>(function(its_user, name));
  };
  if (gladLoadGLContextUserPtr(&gl, load, &loader) == 0) throw std::runtime_error("no OpenGL");
  return gl;
}

/// A host's framebuffer with color and depth. pixels() reads it back as bytes from the bottom row up.
class HostTarget {
 public:
  HostTarget(const GladGLContext& gl, int width, int height, GLenum format = GL_RGBA8)
      : gl_(gl), width_(width), height_(height) {
    gl_.CreateTextures(GL_TEXTURE_2D, 1, &color_);
    gl_.TextureStorage2D(color_, 1, format, width, height);
    gl_.CreateTextures(GL_TEXTURE_2D, 1, &depth_);
    gl_.TextureStorage2D(depth_, 1, GL_DEPTH_COMPONENT32F, width, height);
    gl_.CreateFramebuffers(1, &framebuffer_);
    gl_.NamedFramebufferTexture(framebuffer_, GL_COLOR_ATTACHMENT0, color_, 0);
    gl_.NamedFramebufferTexture(framebuffer_, GL_DEPTH_ATTACHMENT, depth_, 0);
    clear({0.0F, 0.0F, 0.0F, 0.0F}, 1.0F);
  }
  HostTarget(const HostTarget&) = delete;
  HostTarget& operator=(const HostTarget&) = delete;
  ~HostTarget() {
    gl_.DeleteFramebuffers(1, &framebuffer_);
    gl_.DeleteTextures(1, &color_);
    gl_.DeleteTextures(1, &depth_);
  }

  void clear(const std::array<float, 4>& color, float depth = 1.0F) const {
    gl_.ClearNamedFramebufferfv(framebuffer_, GL_COLOR, 0, color.data());
    gl_.ClearNamedFramebufferfv(framebuffer_, GL_DEPTH, 0, &depth);
  }
  /// A frame descriptor that covers the whole framebuffer.
  [[nodiscard]] cumulet_frame_desc frame() const {
    auto desc = make_desc<cumulet_frame_desc>();
    desc.budget_ms = 50.0;
    desc.framebuffer = framebuffer_;
    desc.width = static_cast<std::uint32_t>(width_);
    desc.height = static_cast<std::uint32_t>(height_);
    return desc;
  }
  [[nodiscard]] std::vector<std::uint8_t> pixels() const {
    std::vector<std::uint8_t> bytes(std::size_t(width_) * std::size_t(height_) * 4);
    gl_.GetTextureImage(color_, 0, GL_RGBA, GL_UNSIGNED_BYTE, static_cast<GLsizei>(bytes.size()), bytes.data());
    return bytes;
  }
  [[nodiscard]] std::vector<float> floats() const {
    std::vector<float> values(std::size_t(width_) * std::size_t(height_) * 4);
    gl_.GetTextureImage(color_, 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(values.size() * sizeof(float)),
                        values.data());
    return values;
  }
  [[nodiscard]] std::vector<float> depths() const {
    std::vector<float> values(std::size_t(width_) * std::size_t(height_));
    gl_.GetTextureImage(depth_, 0, GL_DEPTH_COMPONENT, GL_FLOAT, static_cast<GLsizei>(values.size() * sizeof(float)),
                        values.data());
    return values;
  }
  [[nodiscard]] GLuint framebuffer() const { return framebuffer_; }
  [[nodiscard]] GLuint color_texture() const { return color_; }
  [[nodiscard]] GLuint depth_texture() const { return depth_; }

 private:
  const GladGLContext& gl_;
  int width_;
  int height_;
  GLuint color_ = 0;
  GLuint depth_ = 0;
  GLuint framebuffer_ = 0;
};

struct ViewerOptions {
  cumulet_get_proc_fn get_proc = nullptr;
  void* user = nullptr;
  cumulet_update_fn update = nullptr;
  void* update_user = nullptr;
  cumulet_log_fn log = nullptr;
  void* log_user = nullptr;
  cumulet_gl_state_policy gl_state = CUMULET_GL_STATE_RESTORE;
  std::uint32_t samples = 4;
  cumulet_shader_cache* programs = nullptr;
  cumulet_build_device build = CUMULET_BUILD_CPU;
  cumulet_interpolation interpolation = CUMULET_INTERPOLATION_AUTO;
};

/// A viewer with the default settings of the library.
inline ViewerPtr make_plain_viewer(const cumulet_create_desc& desc) { return made_by<ViewerPtr>(cumulet_create, desc); }

/// Sets a new camera with this pose on the viewer. Throws std::runtime_error.
inline void look(cumulet_viewer* viewer, const cumulet_camera_desc& stand) {
  cumulet_camera* camera = nullptr;
  if (cumulet_camera_create(&stand, &camera) != CUMULET_OK) throw std::runtime_error("no camera");
  const CameraRef owner(camera);
  if (cumulet_set_camera(viewer, camera) != CUMULET_OK) throw std::runtime_error(cumulet_last_error(viewer));
}

/// Reverses the order of rows. `width` is in pixels of 4 bytes.
inline std::vector<std::uint8_t> upside_down(const std::vector<std::uint8_t>& rgba, std::size_t width) {
  std::vector<std::uint8_t> turned;
  for (auto row = rgba.end(); row != rgba.begin();) {
    row -= static_cast<std::ptrdiff_t>(4 * width);
    turned.insert(turned.end(), row, row + static_cast<std::ptrdiff_t>(4 * width));
  }
  return turned;
}

/// A viewer with light, a camera in front of make_ball, few samples per pixel and no preview. Throws
/// std::runtime_error.
inline ViewerPtr make_viewer(const ViewerOptions& options) {
  auto create = make_desc<cumulet_create_desc>();
  create.get_proc = options.get_proc;
  create.get_proc_user = options.user;
  create.update = options.update;
  create.update_user = options.update_user;
  create.log = options.log;
  create.log_user = options.log_user;
  create.gl_state = options.gl_state;
  create.shader_cache = options.programs;
  ViewerPtr viewer = make_plain_viewer(create);
  cumulet_viewer* const out = viewer.get();
  auto light = make_desc<cumulet_sun_sky_desc>();
  light.sun_azimuth_degrees = 60.0F;
  light.sun_elevation_degrees = 40.0F;
  for (float& value : light.sun_irradiance) value = 2.5F;
  for (float& value : light.sky_radiance) value = 0.3F;
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = options.samples;
  sampling.preview = CUMULET_PREVIEW_OFF;
  auto stand = make_desc<cumulet_camera_desc>();
  stand.eye[1] = 6.0;
  stand.eye[2] = 32.0;
  auto grid = make_desc<cumulet_grid_desc>();
  grid.build_device = options.build;
  grid.interpolation = options.interpolation;
  if (cumulet_set_sun_sky(out, &light) != CUMULET_OK || cumulet_set_sampling(out, &sampling) != CUMULET_OK ||
      cumulet_set_grid(out, &grid) != CUMULET_OK)
    throw std::runtime_error(cumulet_last_error(out));
  look(out, stand);
  return viewer;
}

/// Renders until the image has all its samples. Throws std::runtime_error after an error or after two minutes.
inline cumulet_frame_result converge(cumulet_viewer* viewer, const cumulet_frame_desc& frame) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(120);
  constexpr std::uint32_t moving = CUMULET_RENDER_INCOMPLETE | CUMULET_RENDER_LOADING | CUMULET_RENDER_CONVERGED;
  auto result = make_desc<cumulet_frame_result>();
  if (cumulet_wait(viewer, -1.0) != CUMULET_OK) throw std::runtime_error(cumulet_last_error(viewer));
  do {
    if (cumulet_render(viewer, &frame, &result) != CUMULET_OK) throw std::runtime_error(cumulet_last_error(viewer));
    if ((result.flags & moving) == 0) throw std::runtime_error("gives up before it converges");
    if (std::chrono::steady_clock::now() > until) throw std::runtime_error("does not converge");
  } while ((result.flags & CUMULET_RENDER_CONVERGED) == 0);
  return result;
}

/// Describes the difference of two images. Returns "" if they are equal.
inline std::string difference(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  if (a.size() != b.size()) return "their sizes";
  std::size_t bytes = 0;
  int largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    bytes += a[i] != b[i] ? 1U : 0U;
    largest = std::max(largest, std::abs(int{a[i]} - int{b[i]}));
  }
  if (bytes == 0) return "";
  return std::to_string(bytes) + " of " + std::to_string(a.size()) + " bytes, by at most " + std::to_string(largest);
}

/// Renders all samples without drawing, then draws once and returns the bytes of the target. Drawing intermediate
/// frames would show through transparent pixels, and their number depends on timing.
inline std::vector<std::uint8_t> drawn_once(cumulet_viewer* viewer, const HostTarget& target) {
  auto frame = target.frame();
  frame.target = CUMULET_TARGET_NONE;
  converge(viewer, frame);
  frame.target = CUMULET_TARGET_FRAMEBUFFER;
  target.clear({0.0F, 0.0F, 0.0F, 0.0F});
  if (cumulet_render(viewer, &frame, nullptr) != CUMULET_OK) throw std::runtime_error(cumulet_last_error(viewer));
  return target.pixels();
}
/// Returns drawn_once() for this volume.
inline std::vector<std::uint8_t> picture_of(cumulet_viewer* viewer, cumulet_volume* volume, const HostTarget& target) {
  if (cumulet_set_volume(viewer, volume) != CUMULET_OK) throw std::runtime_error(cumulet_last_error(viewer));
  return drawn_once(viewer, target);
}

}  // namespace cumulet::test
