#pragma once

// States of dynamic volumes from a host's textures and buffers, and viewers that show them.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <glm/gtc/packing.hpp>
#include <string>
#include <utility>
#include <vector>

#include "support/c_host.hpp"
#include "support/c_playback.hpp"
#include "support/fake_gl.hpp"
#include "support/live_volumes.hpp"
#include "support/simulated.hpp"

namespace cumulet::test {

/// A number as a format stores it: its bits and its value.
struct Kept {
  std::vector<std::byte> bits;
  float value = 0.0F;
};
template <class Number>
Kept kept(Number number, float value) {
  Kept k{std::vector<std::byte>(sizeof number), value};
  std::memcpy(k.bits.data(), &number, sizeof number);
  return k;
}
inline Kept keep(cumulet_voxel_format format, float v) {
  const float unit = std::clamp(v, 0.0F, 1.0F);
  switch (format) {
    case CUMULET_VOXEL_FORMAT_R16F: {
      const std::uint16_t half = glm::packHalf1x16(v);
      return kept(half, glm::unpackHalf1x16(half));
    }
    case CUMULET_VOXEL_FORMAT_R16: {
      const auto code = static_cast<std::uint16_t>(std::lround(unit * 65535.0F));
      return kept(code, static_cast<float>(code / 65535.0));
    }
    case CUMULET_VOXEL_FORMAT_R8: {
      const auto code = static_cast<std::uint8_t>(std::lround(unit * 255.0F));
      return kept(code, static_cast<float>(code / 255.0));
    }
    default:
      return kept(v, v);
  }
}

/// An array in a format, and its values.
struct Array {
  std::vector<std::byte> bytes;
  std::vector<float> values;
  Array(cumulet_voxel_format format, const std::vector<float>& from) {
    for (const float v : from) {
      const Kept k = keep(format, v);
      bytes.insert(bytes.end(), k.bits.begin(), k.bits.end());
      values.push_back(k.value);
    }
  }
};

/// A format and the GL enums of textures with it.
struct VoxelType {
  cumulet_voxel_format format;
  GLenum internal;
  GLenum type;
};
constexpr auto voxel_types = std::to_array<VoxelType>({{CUMULET_VOXEL_FORMAT_R32F, GL_R32F, GL_FLOAT},
                                                       {CUMULET_VOXEL_FORMAT_R16F, GL_R16F, GL_HALF_FLOAT},
                                                       {CUMULET_VOXEL_FORMAT_R16, GL_R16, GL_UNSIGNED_SHORT},
                                                       {CUMULET_VOXEL_FORMAT_R8, GL_R8, GL_UNSIGNED_BYTE}});

/// Textures and buffers of a host.
class Objects {
 public:
  explicit Objects(const GladGLContext& gl) : gl_(gl) {}
  Objects(const Objects&) = delete;
  Objects& operator=(const Objects&) = delete;
  ~Objects() {
    for (const GLuint name : textures_) gl_.DeleteTextures(1, &name);
    for (const GLuint name : buffers_) gl_.DeleteBuffers(1, &name);
  }
  GLuint texture(const Sides& size, GLenum internal, GLenum format, GLenum type, const void* pixels) {
    GLuint name = 0;
    gl_.CreateTextures(GL_TEXTURE_3D, 1, &name);
    textures_.push_back(name);
    gl_.TextureStorage3D(name, 1, internal, size[0], size[1], size[2]);
    put(name, size, format, type, pixels);
    return name;
  }
  GLuint texture(const Sides& size, const VoxelType& type, const Array& array) {
    return texture(size, type.internal, GL_RED, type.type, array.bytes.data());
  }
  void put(GLuint name, const Sides& size, GLenum format, GLenum type, const void* pixels) const {
    GLint alignment = 0;
    gl_.GetIntegerv(GL_UNPACK_ALIGNMENT, &alignment);
    gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    gl_.TextureSubImage3D(name, 0, 0, 0, 0, size[0], size[1], size[2], format, type, pixels);
    gl_.PixelStorei(GL_UNPACK_ALIGNMENT, alignment);
  }
  GLuint buffer(const std::vector<std::byte>& bytes) {
    GLuint name = 0;
    gl_.CreateBuffers(1, &name);
    buffers_.push_back(name);
    gl_.NamedBufferData(name, static_cast<GLsizeiptr>((bytes.size() + 3) / 4 * 4), nullptr, GL_DYNAMIC_COPY);
    gl_.NamedBufferSubData(name, 0, static_cast<GLsizeiptr>(bytes.size()), bytes.data());
    return name;
  }

 private:
  const GladGLContext& gl_;
  std::vector<GLuint> textures_, buffers_;
};

inline cumulet_gl_field field_at(cumulet_channel channel, const Sides& size) {
  auto field = make_desc<cumulet_gl_field>();
  field.channel = channel;
  const auto transform = simulated_transform(size);
  std::copy(transform.begin(), transform.end(), field.index_to_world);
  return field;
}
inline cumulet_gl_field in_texture(cumulet_channel channel, const Sides& size, GLuint name,
                                   std::uint32_t component = 0) {
  cumulet_gl_field field = field_at(channel, size);
  field.texture = name;
  field.component = component;
  return field;
}
inline cumulet_gl_field in_buffer(cumulet_channel channel, const Sides& size, GLuint name,
                                  cumulet_voxel_format format) {
  cumulet_gl_field field = field_at(channel, size);
  field.buffer = name;
  field.format = format;
  std::copy(size.begin(), size.end(), field.size);
  return field;
}

inline cumulet_gl_volume_desc state_of(const std::vector<cumulet_gl_field>& fields) {
  auto desc = make_desc<cumulet_gl_volume_desc>();
  desc.fields = fields.data();
  desc.field_count = fields.size();
  desc.name = "smoke";
  return desc;
}

inline State dense(const Sides& size, const std::vector<float>& values) {
  return std::move(State().dense(CUMULET_CHANNEL_DENSITY, size, values));
}

/// A host whose viewer uses a FakeGl and shows a dynamic volume without a state.
class LiveStatesFromGl : public testing::Test {
 protected:
  using Picture = std::vector<std::uint8_t>;

  // Grids that are built on the GPU are not interpolated, so that volumes in main memory look like GPU-resident ones.
  ViewerPtr make(cumulet_build_device build = CUMULET_BUILD_CPU) {
    const bool on_gpu = build == CUMULET_BUILD_GPU;
    return make_viewer({.get_proc = FakeGl::get_proc,
                        .user = &fake_,
                        .samples = 2,
                        .build = build,
                        .interpolation = on_gpu ? CUMULET_INTERPOLATION_NEAREST : CUMULET_INTERPOLATION_AUTO});
  }
  void hand_over(const std::vector<cumulet_gl_field>& fields) {
    const cumulet_gl_volume_desc desc = state_of(fields);
    ASSERT_EQ(cumulet_dynamic_volume_set_gl(v_, live_.get(), &desc), CUMULET_OK) << cumulet_last_error(v_);
  }
  void hand_over(const std::vector<cumulet_gl_field>& fields, const std::vector<cumulet_voxel_box>& changed) {
    cumulet_gl_volume_desc desc = state_of(fields);
    desc.changed = changed.data();
    desc.changed_count = changed.size();
    ASSERT_EQ(cumulet_dynamic_volume_set_gl(v_, live_.get(), &desc), CUMULET_OK) << cumulet_last_error(v_);
  }
  std::string refusal(const cumulet_gl_volume_desc& desc, cumulet_status status) {
    EXPECT_EQ(cumulet_dynamic_volume_set_gl(v_, live_.get(), &desc), status);
    return cumulet_last_error(v_);
  }
  std::uint64_t handed() {
    auto info = make_desc<cumulet_dynamic_volume_info>();
    EXPECT_EQ(cumulet_get_dynamic_volume_info(v_, &info), CUMULET_OK) << cumulet_last_error(v_);
    return info.submitted_update;
  }
  // Renders frames that draw nothing until `done` returns true, at most 30 s.
  void render_until(const std::function<bool()>& done) {
    cumulet_frame_desc frame = target_.frame();
    frame.target = CUMULET_TARGET_NONE;
    frame.budget_ms = 5.0;
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!done() && std::chrono::steady_clock::now() < until)
      EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK) << cumulet_last_error(v_);
  }
  // Renders until `count` states have arrived, and some more frames. Returns the number of arrived states.
  std::uint64_t arrive(std::uint64_t count = 1) {
    const std::uint64_t before = handed();
    int more = 0;
    render_until([&] {
      if (handed() >= before + count) ++more;
      return more == 3;
    });
    return handed() - before;
  }
  // Renders until main memory has the voxels of the newest state.
  void wait_for_voxels(const LiveRef& live) {
    cumulet_volume* volume = nullptr;
    render_until([&] { return cumulet_dynamic_volume_get_volume(live.get(), &volume, nullptr, 0) == CUMULET_OK; });
    cumulet_volume_release(volume);
  }
  Picture picture() { return drawn_once(v_, target_); }
  // Returns the first failing frame's status. The target holds that frame's image.
  cumulet_status frames_until_failure() {
    const cumulet_frame_desc frame = target_.frame();
    cumulet_status status = CUMULET_OK;
    for (int i = 0; i < 100 && status == CUMULET_OK; ++i) {
      target_.clear({0.0F, 0.0F, 0.0F, 0.0F});
      status = cumulet_render(v_, &frame, nullptr);
    }
    return status;
  }

  headless::Context context_ = headless::Context::create(headless::Backend::automatic);
  FakeGl fake_{headless::Context::get_proc, &context_};
  const GladGLContext& gl_ = fake_.real();
  HostTarget target_{gl_, 32, 32};
  Objects objects_{gl_};
  LiveRef live_ = make_live();
  ViewerPtr viewer_ = make();
  cumulet_viewer* v_ = viewer_.get();

  void SetUp() override { ASSERT_EQ(cumulet_set_dynamic_volume(v_, live_.get()), CUMULET_OK); }
};

/// A GPU-resident dynamic volume and a viewer that builds grids on the GPU.
class LiveStatesOnGpu : public LiveStatesFromGl {
 protected:
  void SetUp() override {
    auto desc = make_desc<cumulet_dynamic_volume_desc>();
    desc.gpu_resident = 1;
    live_ = make_live(desc);
    viewer_ = make(CUMULET_BUILD_GPU);
    v_ = viewer_.get();
    ASSERT_EQ(cumulet_set_dynamic_volume(v_, live_.get()), CUMULET_OK);
  }
  // The image of the same values from main memory, made by another viewer.
  Picture reference(const std::vector<float>& values,
                    cumulet_interpolation interpolation = CUMULET_INTERPOLATION_NEAREST) {
    const ViewerPtr other = make(CUMULET_BUILD_GPU);
    if (interpolation != CUMULET_INTERPOLATION_NEAREST) interpolate(other.get(), interpolation);
    return picture_of(other.get(), alone(dense(odd, values)).get(), target_);
  }
  // Sets the interpolation of grids that are built on the GPU if possible.
  static void interpolate(cumulet_viewer* viewer, cumulet_interpolation interpolation) {
    auto grid = make_desc<cumulet_grid_desc>();
    grid.build_device = CUMULET_BUILD_GPU;
    grid.interpolation = interpolation;
    EXPECT_EQ(cumulet_set_grid(viewer, &grid), CUMULET_OK);
  }
  void hand_over_density(const Array& array, const VoxelType& type) {
    hand_over({in_texture(CUMULET_CHANNEL_DENSITY, odd, objects_.texture(odd, type, array))});
  }
  std::string get_volume(cumulet_status status) {
    std::array<char, 256> error{};
    cumulet_volume* volume = nullptr;
    EXPECT_EQ(cumulet_dynamic_volume_get_volume(live_.get(), &volume, error.data(), error.size()), status);
    EXPECT_EQ(volume, nullptr);
    return error.data();
  }
  [[nodiscard]] bool shows_voxels() const {
    cumulet_volume* volume = nullptr;
    EXPECT_EQ(cumulet_get_volume(v_, &volume), CUMULET_OK);
    const VolumeRef kept(volume);
    return volume != nullptr;
  }
};

}  // namespace cumulet::test
