// The points of the embedding contract about targets, images, depth and colors.
#include <gtest/gtest.h>

#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "cumulet/cumulet.hpp"
#include "settings/aov_table.hpp"
#include "support/c_host.hpp"
#include "support/contract.hpp"

namespace {

using cumulet::test::CameraRef;
using cumulet::test::Contract;
using cumulet::test::converge;
using cumulet::test::difference;
using cumulet::test::HostTarget;
using cumulet::test::make_desc;
using cumulet::test::picture_of;
using cumulet::test::ViewerPtr;

TEST_F(Contract, Contract09TheTargetIsGivenWithEveryFrame) {
  const Picture picture = picture_of(v_, volume_.get(), target_);
  const HostTarget second(gl_, side, side);
  converge(v_, second.frame());
  EXPECT_EQ(difference(second.pixels(), picture), "");
  const HostTarget wide(gl_, 2 * side, side, GL_RGBA16F);
  converge(v_, wide.frame());
  const auto wide_pixels = wide.floats();
  // The image is rendered for the new size, not stretched: the colors of the middle column are the same.
  converge(v_, target_.frame());
  EXPECT_EQ(difference(target_.pixels(), picture), "") << "the first target's again";
  EXPECT_GT(std::ranges::max(wide_pixels), 0.3F);
}

TEST_F(Contract, Contract10FramebufferZeroIsNotAssumed) {
  gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
  picture_of(v_, volume_.get(), target_);
  EXPECT_GT(std::ranges::max(target_.pixels()), 60);
  // An incomplete or foreign framebuffer is an error; nothing is drawn elsewhere.
  GLuint empty = 0;
  gl_.CreateFramebuffers(1, &empty);
  auto frame = target_.frame();
  frame.framebuffer = empty;
  EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(std::string(cumulet_last_error(v_)).find(std::to_string(empty)), std::string::npos);
  gl_.DeleteFramebuffers(1, &empty);
}

TEST_F(Contract, Contract11ViewerOwnedTexture) {
  const Picture picture = picture_of(v_, volume_.get(), target_);
  for (const GLenum format : {GL_RGBA8, GL_RGBA16F, GL_RGBA32F}) {
    auto frame = target_.frame();
    frame.target = CUMULET_TARGET_TEXTURE;
    frame.format = format;
    frame.write_depth = 1;
    const auto result = converge(v_, frame);
    ASSERT_EQ(gl_.IsTexture(result.texture), GL_TRUE);
    GLint width = 0;
    GLint internal = 0;
    gl_.GetTextureLevelParameteriv(result.texture, 0, GL_TEXTURE_WIDTH, &width);
    gl_.GetTextureLevelParameteriv(result.texture, 0, GL_TEXTURE_INTERNAL_FORMAT, &internal);
    EXPECT_EQ(width, side);
    EXPECT_EQ(static_cast<GLenum>(internal), format);
    gl_.GetTextureLevelParameteriv(result.depth_texture, 0, GL_TEXTURE_INTERNAL_FORMAT, &internal);
    EXPECT_EQ(internal, GL_DEPTH_COMPONENT32F);
    Picture pixels(picture.size());
    gl_.GetTextureImage(result.texture, 0, GL_RGBA, GL_UNSIGNED_BYTE, static_cast<GLsizei>(pixels.size()),
                        pixels.data());
    int largest = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) largest = std::max(largest, std::abs(pixels[i] - picture[i]));
    EXPECT_LE(largest, 1);
  }
  auto frame = target_.frame();
  frame.target = CUMULET_TARGET_TEXTURE;
  frame.format = GL_R8;
  EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(Contract, Contract12FlippedAndInARectangle) {
  const Picture picture = picture_of(v_, volume_.get(), target_);
  auto frame = target_.frame();
  frame.flip_y = 1;
  converge(v_, frame);
  const Picture turned = cumulet::test::upside_down(picture, side);
  EXPECT_EQ(difference(target_.pixels(), turned), "");
  EXPECT_NE(difference(picture, turned), "");

  const HostTarget larger(gl_, side + 20, side + 10);
  larger.clear({1.0F, 0.0F, 1.0F, 1.0F});
  frame = larger.frame();
  frame.viewport[0] = 13;
  frame.viewport[1] = 3;
  frame.viewport[2] = frame.viewport[3] = side;
  converge(v_, frame);
  const Picture pixels = larger.pixels();
  Picture inside;
  int outside_changed = 0;
  for (int y = 0; y < side + 10; ++y) {
    for (int x = 0; x < side + 20; ++x) {
      const auto pixel = pixels.begin() + (y * (side + 20) + x) * 4;
      if (x >= 13 && x < 13 + side && y >= 3 && y < 3 + side) {
        inside.insert(inside.end(), pixel, pixel + 4);
      } else {
        outside_changed += pixel[0] == 255 && pixel[1] == 0 && pixel[2] == 255 ? 0 : 1;
      }
    }
  }
  EXPECT_EQ(outside_changed, 0);
  EXPECT_EQ(difference(inside, picture), "");
  frame.viewport[0] = 21;
  EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_ERROR_INVALID_ARGUMENT) << "not inside the target";
}

TEST_F(Contract, AovsAreReadThroughTheAbi) {
  show(v_, CUMULET_BACKGROUND_TRANSPARENT);
  std::vector<float> values(std::size_t{4} * side * side);
  EXPECT_EQ(cumulet_read_aov(v_, CUMULET_AOV_NORMAL, values.data(), values.size()), CUMULET_ERROR_INVALID_ARGUMENT)
      << "nothing was rendered";
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 4;
  sampling.preview = CUMULET_PREVIEW_OFF;
  sampling.separate_volume_aov = 2;
  EXPECT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_ERROR_INVALID_ARGUMENT);
  sampling.separate_volume_aov = 1;
  ASSERT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK);
  picture_of(v_, volume_.get(), target_);
  for (const cumulet::settings::Aov& aov : cumulet::settings::aovs) {
    const std::size_t floats = aov.channels.size() * side * side;
    EXPECT_EQ(cumulet_read_aov(v_, aov.value, values.data(), floats), CUMULET_OK) << aov.name;
    EXPECT_EQ(cumulet_read_aov(v_, aov.value, values.data(), floats - 1), CUMULET_ERROR_INVALID_ARGUMENT) << aov.name;
  }
  const auto unknown = static_cast<std::uint32_t>(cumulet::settings::aovs.size());
  EXPECT_EQ(cumulet_read_aov(v_, std::bit_cast<cumulet_aov>(unknown), values.data(), values.size()),
            CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_read_aov(v_, CUMULET_AOV_NORMAL, nullptr, values.size()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_read_aov(v_, CUMULET_AOV_NORMAL, values.data(), 3), CUMULET_ERROR_INVALID_ARGUMENT);
  // Without surfaces the beauty layer is the volume, and its alpha is 1 - transmittance.
  std::vector<float> beauty(values.size());
  std::vector<float> passes(values.size() / 4);
  ASSERT_EQ(cumulet_read_aov(v_, CUMULET_AOV_BEAUTY, beauty.data(), beauty.size()), CUMULET_OK);
  ASSERT_EQ(cumulet_read_aov(v_, CUMULET_AOV_VOLUME, values.data(), values.size()), CUMULET_OK);
  EXPECT_EQ(beauty, values);
  ASSERT_EQ(cumulet_read_aov(v_, CUMULET_AOV_TRANSMITTANCE, passes.data(), passes.size()), CUMULET_OK);
  double difference = 0.0;
  for (std::size_t i = 0; i < passes.size(); ++i) difference += (1.0 - passes[i] - values[4 * i + 3]) / (side * side);
  EXPECT_NEAR(difference, 0.0, 0.02);
  // A frame of size 0 discards the view but keeps the image.
  auto frame = target_.frame();
  frame.width = frame.height = 0;
  ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
  EXPECT_EQ(cumulet_read_aov(v_, CUMULET_AOV_SURFACE_DEPTH, passes.data(), passes.size()), CUMULET_OK);
  // AOVs of an image are not read with another grid type's data.
  auto grid = make_desc<cumulet_grid_desc>();
  grid.type = CUMULET_GRID_DENSE;
  ASSERT_EQ(cumulet_set_grid(v_, &grid), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(v_, -1.0), CUMULET_OK);
  frame.budget_ms = 1e3;
  ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);  // uploads, traces nothing
  EXPECT_EQ(cumulet_read_aov(v_, CUMULET_AOV_TRANSMITTANCE, passes.data(), passes.size()),
            CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(std::string(cumulet_last_error(v_)).find("render"), std::string::npos);
  EXPECT_EQ(cumulet_detach(v_), CUMULET_OK);
  EXPECT_EQ(cumulet_read_aov(v_, CUMULET_AOV_TRANSMITTANCE, passes.data(), passes.size()), CUMULET_ERROR_DETACHED);
}

TEST_F(Contract, AccumulationContinuesInAnotherViewer) {
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 40;
  sampling.preview = CUMULET_PREVIEW_OFF;
  const auto begun = [&](double budget_ms) {
    ViewerPtr own = viewer();
    show(own.get(), CUMULET_BACKGROUND_TRANSPARENT);
    EXPECT_EQ(cumulet_set_sampling(own.get(), &sampling), CUMULET_OK);
    EXPECT_EQ(cumulet_set_volume(own.get(), volume_.get()), CUMULET_OK);
    EXPECT_EQ(cumulet_wait(own.get(), -1.0), CUMULET_OK);
    auto frame = target_.frame();
    frame.budget_ms = budget_ms;
    // The first frames upload the grid and wait for the driver's compiler. Stop there.
    std::size_t size = 0;
    for (int i = 0; i < 60000; ++i) {
      EXPECT_EQ(cumulet_render(own.get(), &frame, nullptr), CUMULET_OK);
      if (cumulet_read_accumulation(own.get(), nullptr, &size) == CUMULET_OK) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return own;
  };
  const auto whole = [&](cumulet_viewer* v) {
    converge(v, target_.frame());
    std::vector<float> rgba(std::size_t{4} * side * side);
    EXPECT_EQ(cumulet_read_linear(v, rgba.data(), rgba.size()), CUMULET_OK);
    return rgba;
  };
  std::size_t size = 7;
  EXPECT_EQ(cumulet_read_accumulation(v_, nullptr, &size), CUMULET_ERROR_INVALID_ARGUMENT) << "nothing was rendered";
  EXPECT_EQ(size, 7u);
  std::vector<std::byte> bytes;
  {
    const ViewerPtr first = begun(3.0);
    EXPECT_EQ(cumulet_read_accumulation(first.get(), nullptr, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
    ASSERT_EQ(cumulet_read_accumulation(first.get(), nullptr, &size), CUMULET_OK);
    EXPECT_EQ(size, 32U + 44U * side * side);
    bytes.resize(size);
    size -= 1;
    EXPECT_EQ(cumulet_read_accumulation(first.get(), bytes.data(), &size), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(size, bytes.size()) << "the size that it needs is reported";
    ASSERT_EQ(cumulet_read_accumulation(first.get(), bytes.data(), &size), CUMULET_OK);
  }
  const ViewerPtr second = begun(1.0);
  EXPECT_EQ(cumulet_restore_accumulation(second.get(), nullptr, size), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_restore_accumulation(second.get(), bytes.data(), size - 1), CUMULET_ERROR_INVALID_ARGUMENT);
  ASSERT_EQ(cumulet_restore_accumulation(second.get(), bytes.data(), size), CUMULET_OK);
  EXPECT_EQ(whole(second.get()), whole(begun(5.0).get()));
  ASSERT_EQ(cumulet_detach(second.get()), CUMULET_OK);
  EXPECT_EQ(cumulet_read_accumulation(second.get(), bytes.data(), &size), CUMULET_ERROR_DETACHED);
  EXPECT_EQ(cumulet_restore_accumulation(second.get(), bytes.data(), size), CUMULET_ERROR_DETACHED);
}

// Conventions, multisampling and real geometry: tests/embed/reversed_z.cpp.
TEST_F(Contract, Contract13HostDepthHidesWhatIsBehindIt) {
  show(v_, CUMULET_BACKGROUND_TRANSPARENT);
  const Picture picture = picture_of(v_, volume_.get(), target_);
  const Picture nothing(picture.size(), 0);
  for (const cumulet_depth_convention convention : {CUMULET_DEPTH_STANDARD, CUMULET_DEPTH_REVERSED}) {
    cumulet_camera* camera = nullptr;
    ASSERT_EQ(cumulet_get_camera(v_, &camera), CUMULET_OK);
    const CameraRef owner(camera);
    auto pose = make_desc<cumulet_camera_desc>();
    ASSERT_EQ(cumulet_camera_get(camera, &pose), CUMULET_OK);
    pose.depth = convention;
    ASSERT_EQ(cumulet_camera_set(camera, &pose), CUMULET_OK);
    const bool reversed = convention == CUMULET_DEPTH_REVERSED;
    auto frame = target_.frame();
    frame.depth_source = CUMULET_DEPTH_SOURCE_TEXTURE;
    frame.depth_name = target_.depth_texture();
    // First without host geometry, then with some directly in front of the eye.
    for (const bool near : {false, true}) {
      frame.target = CUMULET_TARGET_NONE;
      target_.clear({}, near != reversed ? 0.0F : 1.0F);
      converge(v_, frame);
      frame.target = CUMULET_TARGET_FRAMEBUFFER;
      ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
      EXPECT_EQ(difference(target_.pixels(), near ? nothing : picture), "") << (near ? "near" : "far");
    }
  }
}

TEST_F(Contract, Contract14PremultipliedAlphaAndDepthOut) {
  show(v_, CUMULET_BACKGROUND_TRANSPARENT);
  const HostTarget black(gl_, side, side, GL_RGBA32F);
  const HostTarget white(gl_, side, side, GL_RGBA32F);
  ASSERT_EQ(cumulet_set_volume(v_, volume_.get()), CUMULET_OK);
  auto frame = black.frame();
  frame.color = CUMULET_COLOR_LINEAR;
  frame.target = CUMULET_TARGET_NONE;
  frame.write_depth = 1;
  converge(v_, frame);
  frame.target = CUMULET_TARGET_FRAMEBUFFER;
  black.clear({0.0F, 0.0F, 0.0F, 0.0F});
  white.clear({1.0F, 1.0F, 1.0F, 1.0F});
  ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
  frame.framebuffer = white.framebuffer();
  ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
  const auto over_black = black.floats();
  const auto over_white = white.floats();
  int partly = 0;
  for (std::size_t i = 0; i < over_black.size(); i += 4) {
    const float alpha = over_black[i + 3];
    partly += alpha > 0.05F && alpha < 0.95F ? 1 : 0;
    for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(over_white[i + c], over_black[i + c] + 1.0F - alpha, 1e-5F);
  }
  EXPECT_GT(partly, 10);

  // The written depth equals the pick's where the image is half opaque. Elsewhere it is not written.
  const auto depths = black.depths();
  auto pick = make_desc<cumulet_pick>();
  ASSERT_EQ(cumulet_pick_at(v_, side / 2.0, side / 2.0, &pick), CUMULET_OK);
  ASSERT_EQ(pick.hit, 1);
  cumulet_camera* camera = nullptr;
  ASSERT_EQ(cumulet_get_camera(v_, &camera), CUMULET_OK);
  const CameraRef owner(camera);
  std::array<double, 16> view{}, projection{};
  ASSERT_EQ(cumulet_camera_get_matrices(camera, 1.0, CUMULET_CLIP_NEGATIVE_ONE_TO_ONE, view.data(), projection.data()),
            CUMULET_OK);
  const auto multiply = [](const std::array<double, 16>& m, const std::array<double, 4>& v) {
    std::array<double, 4> r{};
    for (std::size_t row = 0; row < 4; ++row)
      for (std::size_t k = 0; k < 4; ++k) r[row] += m[k * 4 + row] * v[k];
    return r;
  };
  const auto clip = multiply(projection, multiply(view, {pick.position[0], pick.position[1], pick.position[2], 1.0}));
  const double expected = 0.5 + 0.5 * clip[2] / clip[3];
  // Pixel (16, 16) from the top is row 15 from the bottom.
  EXPECT_NEAR(depths[static_cast<std::size_t>((side - 1 - side / 2) * side + side / 2)], expected, 1e-5);
  EXPECT_EQ(depths[0], 1.0F);
}

TEST_F(Contract, Contract15Colors) {
  ASSERT_EQ(cumulet_set_volume(v_, volume_.get()), CUMULET_OK);
  const auto draw = [&](cumulet_color_encoding color, GLenum format) {
    const HostTarget target(gl_, side, side, format);
    auto frame = target.frame();
    frame.color = color;
    converge(v_, frame);
    return target.floats();  // decoded if the format is sRGB
  };
  const auto decode = [](float e) { return e <= 0.04045F ? e / 12.92F : std::pow((e + 0.055F) / 1.055F, 2.4F); };
  const auto linear = draw(CUMULET_COLOR_LINEAR, GL_RGBA32F);
  const auto encoded = draw(CUMULET_COLOR_SRGB, GL_RGBA32F);
  const auto by_gl = draw(CUMULET_COLOR_SRGB_FRAMEBUFFER, GL_SRGB8_ALPHA8);
  const auto hdr = draw(CUMULET_COLOR_HDR, GL_RGBA32F);
  for (std::size_t i = 0; i < linear.size(); ++i) {
    if (i % 4 == 3) continue;
    ASSERT_NEAR(decode(encoded[i]), linear[i], 1e-4F);
    // Half a step of the 8 bits of a stored color. (Reading back may decode it or not.)
    const float half_a_step = 0.5F / 255.0F + 1e-3F;
    ASSERT_TRUE(std::abs(by_gl[i] - encoded[i]) < half_a_step || std::abs(decode(encoded[i]) - by_gl[i]) < 0.005F);
  }
  EXPECT_LE(std::ranges::max(linear), 1.0F);
  // Exposure doubles values without a tone map and does not restart sampling.
  auto display = make_desc<cumulet_display_desc>();
  display.exposure_stops = 1.0F;
  auto stats = make_desc<cumulet_stats>();
  ASSERT_EQ(cumulet_get_stats(v_, &stats), CUMULET_OK);
  const std::uint64_t samples = stats.samples;
  ASSERT_EQ(cumulet_set_display(v_, &display), CUMULET_OK);
  const auto exposed = draw(CUMULET_COLOR_HDR, GL_RGBA32F);
  for (std::size_t i = 0; i < hdr.size(); ++i) {
    const float factor = i % 4 == 3 ? 1.0F : 2.0F;
    ASSERT_NEAR(exposed[i], factor * hdr[i], 1e-4F + 1e-4F * hdr[i]);
  }
  ASSERT_EQ(cumulet_get_stats(v_, &stats), CUMULET_OK);
  EXPECT_EQ(stats.samples, samples);
  EXPECT_EQ(gl_.IsEnabled(GL_FRAMEBUFFER_SRGB), GL_FALSE);
}

TEST_F(Contract, Contract16SizesArePhysicalAndMayBeZero) {
  const Picture picture = picture_of(v_, volume_.get(), target_);
  auto frame = target_.frame();
  frame.scale = 2.0;
  target_.clear({});
  converge(v_, frame);
  EXPECT_EQ(difference(target_.pixels(), picture), "") << "a scale changes no pixel of a shaded picture";
  for (const auto& [width, height] : {std::pair(0, 0), {0, side}, {side, 0}}) {
    frame = target_.frame();
    frame.width = static_cast<std::uint32_t>(width);
    frame.height = static_cast<std::uint32_t>(height);
    EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK) << width << " x " << height;
  }
  target_.clear({});
  converge(v_, target_.frame());
  EXPECT_EQ(difference(target_.pixels(), picture), "");
}

}  // namespace
