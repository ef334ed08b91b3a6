// OpenEXR files as environments: interpretation of pixels as declared in their headers.

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineOutputFile.h>
#include <ImfEnvmap.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfRgbaFile.h>
#include <ImfStandardAttributes.h>
#include <ImfTileDescriptionAttribute.h>
#include <ImfTiledOutputFile.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "light/environment_file.hpp"
#include "light/primaries.hpp"
#include "support/folder.hpp"
#include "support/refusal.hpp"

namespace {

using namespace cumulet;
using glm::vec3;
using light::EnvironmentPixels;

constexpr double pi = std::numbers::pi;

/// Colors of the pixels of a window. Coordinates may be negative.
using Colors = std::function<vec3(int x, int y)>;

vec3 smooth(int x, int y) {
  const auto wave = [](double at) { return static_cast<float>(1.0 + 0.8 * std::sin(at)); };
  return {wave(0.2 * x), wave(0.3 * y + 1.0), wave(0.15 * (x + y) + 2.0)};
}

struct Channel {
  std::string name;
  Imf::PixelType type = Imf::FLOAT;
  std::function<float(int x, int y)> value;
  int step = 1;
};

/// The values of a header's data window, as a frame buffer of the types in which they are written.
class Samples {
 public:
  Samples(Imf::Header& header, const std::vector<Channel>& channels) {
    for (const Channel& channel : channels) add(header, channel);
  }
  [[nodiscard]] const Imf::FrameBuffer& frame() const { return frame_; }

 private:
  void add(Imf::Header& header, const Channel& channel) {
    header.channels().insert(channel.name, Imf::Channel(channel.type, channel.step, channel.step));
    const Imath::Box2i& window = header.dataWindow();
    const std::size_t size = channel.type == Imf::HALF ? 2 : 4;
    const int width = (window.max.x - window.min.x + 1) / channel.step;
    std::vector<char>& bytes = bytes_.emplace_back();
    for (int y = window.min.y; y <= window.max.y; y += channel.step) {
      for (int x = window.min.x; x <= window.max.x; x += channel.step) {
        const float value = channel.value(x, y);
        const Imath::half half(value);
        const auto integer = static_cast<std::uint32_t>(value);
        const void* from = &value;
        if (channel.type == Imf::HALF) from = &half;
        if (channel.type == Imf::UINT) from = &integer;
        bytes.insert(bytes.end(), static_cast<const char*>(from), static_cast<const char*>(from) + size);
      }
    }
    const auto row = static_cast<std::ptrdiff_t>(size) * width;
    const std::ptrdiff_t first =
        window.min.y / channel.step * row + window.min.x / channel.step * static_cast<std::ptrdiff_t>(size);
    frame_.insert(channel.name, Imf::Slice(channel.type, bytes.data() - first, size, static_cast<std::size_t>(row),
                                           channel.step, channel.step));
  }

  std::vector<std::vector<char>> bytes_;
  Imf::FrameBuffer frame_;
};

std::vector<Channel> rgb(const Colors& colors, Imf::PixelType type = Imf::FLOAT, const std::string& prefix = "") {
  std::vector<Channel> channels;
  for (int c = 0; c < 3; ++c) {
    channels.push_back({prefix + std::string(1, "RGB"[c]), type, [=](int x, int y) { return colors(x, y)[c]; }, 1});
  }
  return channels;
}

class ExrEnvironment : public ::testing::Test {
 protected:
  static constexpr int width = 64;
  static constexpr int height = 32;

  [[nodiscard]] std::string path() const { return (folder_ / "sky.exr").string(); }
  EnvironmentPixels written(Imf::Header header, const std::vector<Channel>& channels) const {
    const Samples samples(header, channels);
    {
      Imf::OutputFile file(path().c_str(), header);
      file.setFrameBuffer(samples.frame());
      const Imath::Box2i& window = header.dataWindow();
      file.writePixels(window.max.y - window.min.y + 1);
    }
    return read();
  }
  [[nodiscard]] EnvironmentPixels read() const { return light::read_environment(path()); }
  [[nodiscard]] std::string refusal() const {
    return test::refusal([this] { static_cast<void>(read()); });
  }
  static void expect_near(const EnvironmentPixels& pixels, const Colors& colors, float within) {
    for (std::uint32_t y = 0; y < pixels.height; ++y) {
      for (std::uint32_t x = 0; x < pixels.width; ++x) {
        const vec3 expected = colors(static_cast<int>(x), static_cast<int>(y));
        const vec3 got = pixels.values.at(std::size_t{y} * pixels.width + x);
        const float most = std::max({expected.x, expected.y, expected.z, 1e-3F});
        ASSERT_LT(glm::length(got - expected), within * most)
            << x << ' ' << y << ": " << got.x << ' ' << got.y << ' ' << got.z;
      }
    }
  }
  static void expect_remark(const EnvironmentPixels& pixels, const std::string& part) {
    ASSERT_EQ(pixels.remarks.size(), 1U);
    EXPECT_NE(pixels.remarks[0].find(part), std::string::npos) << pixels.remarks[0];
  }

  test::Folder folder_;
};

TEST_F(ExrEnvironment, LuminanceAndSubsampledChromaAreColors) {
  // Values change by a few hundredths per pixel: chroma has half of the resolution, and linear interpolation follows
  // that. The last columns and rows are constant, because no sample lies beyond them.
  const Colors colors = [](int x, int y) {
    const auto wave = [](double at) { return static_cast<float>(1.0 + 0.8 * std::sin(at)); };
    const int i = std::min(x, width - 6);
    const int j = std::min(y, height - 6);
    return vec3(wave(0.05 * i), wave(0.07 * j + 1.0), wave(0.04 * (i + j) + 2.0));
  };
  std::vector<Imf::Rgba> pixels;
  for (int i = 0; i < width * height; ++i) {
    const vec3 color = colors(i % width, i / width);
    pixels.emplace_back(color.x, color.y, color.z);
  }
  for (const Imf::RgbaChannels channels : {Imf::WRITE_YC, Imf::WRITE_Y}) {
    {
      Imf::RgbaOutputFile file(path().c_str(), width, height, channels);
      file.setFrameBuffer(pixels.data(), 1, width);
      file.writePixels(height);
    }
    const EnvironmentPixels got = read();
    EXPECT_TRUE(got.remarks.empty());
    if (channels == Imf::WRITE_YC) {
      expect_near(got, colors, 0.04F);
    } else {
      const auto gray = [&](int x, int y) { return vec3(glm::dot(colors(x, y), vec3(0.2126F, 0.7152F, 0.0722F))); };
      expect_near(got, gray, 2e-3F);
    }
  }
}

TEST_F(ExrEnvironment, ChromaDoesNotBleedAcrossEdges) {
  const Colors halves = [](int x, int y) {
    return x < 15 && y < 17 ? vec3(8.0F, 7.0F, 6.0F) : vec3(0.05F, 0.1F, 0.4F);
  };
  const auto part = [&](int c) {
    return [=](int x, int y) {
      const vec3 color = halves(x, y);
      const float luminance = glm::dot(color, vec3(0.2126F, 0.7152F, 0.0722F));
      return c == 0 ? luminance : color[c == 1 ? 0 : 2] / luminance - 1.0F;
    };
  };
  expect_near(written(Imf::Header(width, height),
                      {{"Y", Imf::FLOAT, part(0), 1}, {"RY", Imf::HALF, part(1), 2}, {"BY", Imf::HALF, part(2), 2}}),
              halves, 0.03F);
}

TEST_F(ExrEnvironment, ChromaSupportsAnySubsamplingAndPrimaries) {
  const Imf::Chromaticities p3({0.680F, 0.320F}, {0.265F, 0.690F}, {0.150F, 0.060F}, {0.3127F, 0.3290F});
  for (const int step : {1, 2, 4}) {
    SCOPED_TRACE(step);
    Imf::Header header(width, height);
    Imf::addChromaticities(header, p3);
    const glm::dmat3 to_p3 =
        glm::inverse(light::rec709_matrix({{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}}).value());
    const vec3 weights(0.22897F, 0.69174F, 0.07929F);
    const auto part = [=](int c) {
      return [=](int x, int y) {
        // Smooth enough for samples that are far from each other.
        const vec3 color(to_p3 * glm::dvec3(smooth(x / 8, y / 8)));
        const float luminance = glm::dot(color, weights);
        if (c == 0) return luminance;
        return (c == 1 ? color.x : color.z) / luminance - 1.0F;
      };
    };
    const EnvironmentPixels got = written(
        header, {{"Y", Imf::HALF, part(0), 1}, {"RY", Imf::HALF, part(1), step}, {"BY", Imf::HALF, part(2), step}});
    expect_remark(got, "converted from Display P3 primaries");
    expect_near(
        got, [](int x, int y) { return smooth(x / 8, y / 8); }, step == 1 ? 0.01F : 0.25F);
  }
}

TEST_F(ExrEnvironment, DataWindowIsPlacedInTheDisplayWindow) {
  const Imath::Box2i display({0, 0}, {width - 1, height - 1});
  Imf::Header smaller(display, Imath::Box2i({10, 4}, {29, 19}));
  EnvironmentPixels got = written(smaller, rgb(smooth));
  ASSERT_EQ(got.width, unsigned{width});
  ASSERT_EQ(got.height, unsigned{height});
  expect_near(
      got, [](int x, int y) { return x >= 10 && x <= 29 && y >= 4 && y <= 19 ? smooth(x, y) : vec3(0.0F); }, 1e-6F);
  expect_remark(got, "pixels outside are black");

  got = written(Imf::Header(display, Imath::Box2i({-7, -3}, {width + 4, height + 8})), rgb(smooth));
  ASSERT_EQ(got.width, unsigned{width});
  expect_near(got, smooth, 1e-6F);
  EXPECT_TRUE(got.remarks.empty());

  const Imath::Box2i moved({-100, 50}, {-100 + width - 1, 50 + height - 1});
  got = written(Imf::Header(moved, moved), rgb([](int x, int y) { return smooth(x + 100, y - 50); }));
  expect_near(got, smooth, 1e-6F);

  EXPECT_EQ(test::refusal([&] {
              written(Imf::Header(display, Imath::Box2i({200, 0}, {209, 9})), rgb(smooth));
            }),
            path() + ": has no pixels in its display window");
  EXPECT_EQ(test::refusal([&] {
              written(Imf::Header(Imath::Box2i({0, 0}, {99999, 9}), Imath::Box2i({0, 0}, {9, 9})), rgb(smooth));
            }),
            path() + ": the environment has 100000x10 pixels; the limit is 16384 per side");
}

vec3 of_direction(const vec3& w) { return vec3(1.5F) + w; }

TEST_F(ExrEnvironment, CubeMapFollowsTheOpenExrConvention) {
  constexpr int side = 24;
  Imf::Header header(side, 6 * side);
  Imf::addEnvmap(header, Imf::ENVMAP_CUBE);
  const Imath::Box2i window = header.dataWindow();
  const auto colors = [&](int x, int y) {
    // OpenEXR has no inverse of pixelPosition().
    vec3 color(-1.0F);
    for (int i = 0; i < side * side && color.x < 0.0F; ++i) {
      const auto face = static_cast<Imf::CubeMapFace>(y / side);
      const Imath::V2f within(static_cast<float>(i % side), static_cast<float>(std::div(i, side).quot));
      const Imath::V2f at = Imf::CubeMap::pixelPosition(face, window, within);
      if (std::abs(at.x - float(x)) > 0.1F || std::abs(at.y - float(y)) > 0.1F) continue;
      const Imath::V3f w = Imf::CubeMap::direction(face, window, within).normalized();
      color = of_direction({w.x, w.y, w.z});
    }
    return color;
  };
  const EnvironmentPixels got = written(header, rgb(colors));
  ASSERT_EQ(got.width, 4U * side);
  ASSERT_EQ(got.height, 2U * side);
  expect_near(
      got,
      [](int x, int y) {
        const double azimuth = 2.0 * pi * (0.5 - (x + 0.5) / (4 * side));
        const double down = pi * (y + 0.5) / (2 * side);
        return of_direction({std::sin(down) * std::sin(azimuth), std::cos(down), std::sin(down) * std::cos(azimuth)});
      },
      0.01F);

  Imf::Header wrong(width, height);
  Imf::addEnvmap(wrong, Imf::ENVMAP_CUBE);
  EXPECT_EQ(test::refusal([&] { written(wrong, rgb(smooth)); }),
            path() + ": the cube map has 64x32 pixels, which are not six square faces");
  Imf::Header plain(width, height);
  Imf::addEnvmap(plain, Imf::ENVMAP_LATLONG);
  expect_near(written(plain, rgb(smooth)), smooth, 1e-6F);
  expect_remark(written(Imf::Header(4, 24), rgb(smooth)), "shape of a cube map");
}

// Compared with the published matrices of each color space, with Bradford adaptation.
TEST(Primaries, AreConvertedToRec709) {
  struct Case {
    light::Primaries primaries;
    std::array<double, 9> rows;
  };
  const glm::dvec2 d60(0.32168, 0.33767);
  for (const Case& c : {Case{light::aces_primaries,
                             {2.52169, -1.13413, -0.38756, -0.27648, 1.37272, -0.09624, -0.01538, -0.15298, 1.16835}},
                        Case{{{0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, d60},
                             {1.70505, -0.62179, -0.08326, -0.13026, 1.14080, -0.01055, -0.02400, -0.12897, 1.15297}},
                        Case{{{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}},
                             {1.66049, -0.58764, -0.07285, -0.12455, 1.13290, -0.00835, -0.01815, -0.10058, 1.11873}},
                        Case{{}, {1, 0, 0, 0, 1, 0, 0, 0, 1}}}) {
    const glm::dmat3 matrix = light::rec709_matrix(c.primaries).value();
    for (int i = 0; i < 9; ++i) EXPECT_NEAR(matrix[i % 3][i / 3], c.rows[static_cast<std::size_t>(i)], 3e-4) << i;
  }
  for (const light::Primaries& bad :
       {light::Primaries{{0, 0}, {0, 0}, {0, 0}, {0, 0}}, light::Primaries{{0.6, 0.3}, {0.6, 0.3}, {0.1, 0.1}},
        light::Primaries{{NAN, 0.3}}, light::Primaries{{0.64, 0.33}, {0.3, 0.6}, {0.15, 0.06}, {0.9, 0.05}}}) {
    EXPECT_FALSE(light::rec709_matrix(bad).has_value());
  }
}

TEST(Primaries, ColorsOutsideKeepTheirLuminance) {
  const vec3 kept = light::into_gamut({2.0F, -0.5F, 1.0F});
  EXPECT_GE(std::min({kept.x, kept.y, kept.z}), 0.0F);
  const vec3 weights(0.2126F, 0.7152F, 0.0722F);
  EXPECT_NEAR(glm::dot(kept, weights), glm::dot(vec3(2.0F, -0.5F, 1.0F), weights), 1e-5F);
  EXPECT_EQ(light::into_gamut({1.0F, 0.0F, 2.0F}), vec3(1.0F, 0.0F, 2.0F));
  EXPECT_EQ(light::into_gamut({-1.0F, 0.0F, 0.0F}), vec3(-1.0F, 0.0F, 0.0F));
  EXPECT_TRUE(std::isnan(light::into_gamut({NAN, 1.0F, -1.0F}).x));
}

TEST_F(ExrEnvironment, ChromaticitiesAreConverted) {
  const Imf::Chromaticities ap0({0.7347F, 0.2653F}, {0.0F, 1.0F}, {0.0001F, -0.077F}, {0.32168F, 0.33767F});
  const glm::dmat3 from_rec709 = glm::inverse(light::rec709_matrix(light::aces_primaries).value());
  const Colors in_ap0 = [=](int x, int y) { return vec3(from_rec709 * glm::dvec3(smooth(x, y))); };
  Imf::Header header(width, height);
  Imf::addChromaticities(header, ap0);
  EnvironmentPixels got = written(header, rgb(in_ap0));
  expect_near(got, smooth, 1e-4F);
  expect_remark(got, "converted from ACES AP0 primaries to linear Rec. 709");
  // White stays white, even if the adopted neutral differs from the white point of the primaries.
  Imf::addAdoptedNeutral(header, {0.3457F, 0.3585F});
  const auto white = [](int, int) { return vec3(2.0F); };
  expect_near(written(header, rgb(white)), white, 1e-4F);
  // Colors outside of the Rec. 709 gamut are reported.
  got = written(header, rgb([](int x, int) { return x == 3 ? vec3(0.0F, 1.0F, 0.0F) : vec3(1.0F); }));
  expect_remark(got, "which desaturates 32 pixels outside its gamut");
  for (const vec3& value : got.values) EXPECT_GE(std::min({value.x, value.y, value.z}), 0.0F);

  Imf::Header plain(width, height);
  Imf::addChromaticities(plain, Imf::Chromaticities());
  got = written(plain, rgb(smooth));
  EXPECT_TRUE(got.remarks.empty());
  expect_near(got, smooth, 1e-6F);
  Imf::Header zeros(width, height);
  Imf::addChromaticities(zeros, Imf::Chromaticities({0, 0}, {0, 0}, {0, 0}, {0, 0}));
  got = written(zeros, rgb(smooth));
  expect_remark(got, "Rec. 709 is assumed");
  expect_near(got, smooth, 1e-6F);
}

TEST_F(ExrEnvironment, XyzIsConverted) {
  const glm::dmat3 to_xyz = light::xyz_matrix({}).value();
  std::vector<Channel> channels;
  for (int c = 0; c < 3; ++c) {
    channels.push_back({std::string(1, "XYZ"[c]), Imf::FLOAT,
                        [=](int x, int y) { return vec3(to_xyz * glm::dvec3(smooth(x, y)))[c]; }, 1});
  }
  const EnvironmentPixels got = written(Imf::Header(width, height), channels);
  expect_near(got, smooth, 1e-4F);
  expect_remark(got, "CIE XYZ");
}

TEST_F(ExrEnvironment, EveryCompressionAndTypeIsRead) {
  for (int c = 0; c < Imf::NUM_COMPRESSION_METHODS; ++c) {
    SCOPED_TRACE(c);
    Imf::Header header(width, height);
    header.compression() = static_cast<Imf::Compression>(c);
    const bool lossy = c >= Imf::PXR24_COMPRESSION;
    expect_near(written(header, rgb(smooth, Imf::HALF)), smooth, lossy ? 0.06F : 1e-3F);
    expect_near(written(header, rgb(smooth, Imf::FLOAT)), smooth, lossy ? 0.06F : 1e-6F);
  }
  const Colors whole = [](int x, int y) { return vec3(x, y, 7 * x); };
  expect_near(written(Imf::Header(width, height), rgb(whole, Imf::UINT)), whole, 1e-6F);
  for (const Imf::LineOrder order : {Imf::INCREASING_Y, Imf::DECREASING_Y}) {
    Imf::Header header(width, height);
    header.lineOrder() = order;
    expect_near(written(header, rgb(smooth)), smooth, 1e-6F);
  }
}

TEST_F(ExrEnvironment, TilesOfAnyLevelsAreRead) {
  for (const Imf::LevelMode mode : {Imf::ONE_LEVEL, Imf::MIPMAP_LEVELS, Imf::RIPMAP_LEVELS}) {
    SCOPED_TRACE(mode);
    const Imath::Box2i display({0, 0}, {width - 1, height - 1});
    Imf::Header header(display, Imath::Box2i({-3, -2}, {width + 1, height}));
    header.setTileDescription(Imf::TileDescription(16, 12, mode));
    const Samples samples(header, rgb(smooth));
    {
      Imf::TiledOutputFile file(path().c_str(), header);
      file.setFrameBuffer(samples.frame());
      for (int y = 0; y < file.numYLevels(); ++y) {
        for (int x = 0; x < file.numXLevels(); ++x) {
          if (file.isValidLevel(x, y)) file.writeTiles(0, file.numXTiles(x) - 1, 0, file.numYTiles(y) - 1, x, y);
        }
      }
    }
    expect_near(read(), smooth, 1e-6F);
  }
}

TEST_F(ExrEnvironment, SelectedPartAndLayerAreReported) {
  const auto other = [](int, int) { return vec3(9.0F); };
  std::vector<Imf::Header> headers(3, Imf::Header(width, height));
  std::vector<std::vector<Channel>> channels = {
      {{"Z", Imf::FLOAT, [](int, int) { return 3.0F; }, 1}}, rgb(smooth), rgb(other)};
  const char* names[] = {"depth", "picture", "more"};
  std::vector<Samples> samples;
  for (std::size_t i = 0; i < headers.size(); ++i) {
    headers[i].setName(names[i]);
    headers[i].setType(Imf::SCANLINEIMAGE);
    samples.emplace_back(headers[i], channels[i]);
  }
  {
    Imf::MultiPartOutputFile file(path().c_str(), headers.data(), static_cast<int>(headers.size()));
    for (int i = 0; i < 3; ++i) {
      Imf::OutputPart part(file, i);
      part.setFrameBuffer(samples[static_cast<std::size_t>(i)].frame());
      part.writePixels(height);
    }
  }
  expect_near(read(), smooth, 1e-6F);
  expect_remark(read(), "part 2 (picture) of 3 is used");

  std::vector<Channel> layers = rgb(other, Imf::HALF, "albedo.");
  for (const Channel& channel : rgb(smooth, Imf::FLOAT, "View Layer.Combined.")) layers.push_back(channel);
  EnvironmentPixels got = written(Imf::Header(width, height), layers);
  expect_near(got, smooth, 1e-6F);
  expect_remark(got, "layer View Layer.Combined is used");
  for (const Channel& channel : rgb(smooth)) layers.push_back(channel);
  layers.erase(layers.begin() + 3, layers.begin() + 6);
  got = written(Imf::Header(width, height), layers);
  expect_near(got, smooth, 1e-6F);
  EXPECT_TRUE(got.remarks.empty());
}

TEST_F(ExrEnvironment, ImageWithoutColorsGivesAOneLineError) {
  const auto without = [&](const std::vector<std::string>& names) {
    std::vector<Channel> channels;
    for (const std::string& name : names) channels.push_back({name, Imf::HALF, [](int, int) { return 1.0F; }, 1});
    return test::refusal([&] { written(Imf::Header(width, height), channels); });
  };
  EXPECT_EQ(without({"Z"}), path() + ": has no channel R");
  EXPECT_EQ(without({"R", "G"}), path() + ": has no channel B");
  EXPECT_EQ(without({"B", "Y"}), path() + ": has no channel R");
  EXPECT_EQ(without({"Y", "RY"}), path() + ": has no channel BY");
  EXPECT_EQ(without({"layer.R"}), path() + ": has no channel R");

  Imf::Header deep(4, 4);
  deep.setType(Imf::DEEPSCANLINE);
  deep.compression() = Imf::ZIPS_COMPRESSION;
  deep.channels().insert("R", Imf::Channel(Imf::HALF));
  {
    const std::vector<unsigned> counts(16, 0);
    std::vector<Imath::half*> pointers(16, nullptr);
    Imf::DeepFrameBuffer frame;
    frame.insertSampleCountSlice(Imf::Slice(Imf::UINT, reinterpret_cast<char*>(const_cast<unsigned*>(counts.data())),
                                            sizeof(unsigned), 4 * sizeof(unsigned)));
    frame.insert("R", Imf::DeepSlice(Imf::HALF, reinterpret_cast<char*>(pointers.data()), sizeof(Imath::half*),
                                     4 * sizeof(Imath::half*), sizeof(Imath::half)));
    Imf::DeepScanLineOutputFile file(path().c_str(), deep);
    file.setFrameBuffer(frame);
    file.writePixels(4);
  }
  EXPECT_EQ(refusal(), path() + ": deep OpenEXR images are not supported");

  written(Imf::Header(width, height), rgb(smooth));
  const auto size = std::filesystem::file_size(path());
  for (const auto part : {size / 40, size / 3, size - 5}) {
    std::filesystem::resize_file(path(), part);
    EXPECT_EQ(refusal().find(path() + ": not a readable OpenEXR file: "), 0U) << part;
    written(Imf::Header(width, height), rgb(smooth));
  }
}

TEST_F(ExrEnvironment, SharedTestImagesHaveTheExpectedRadiance) {
  const std::filesystem::path trials = std::filesystem::path(CUMULET_SHARED_DATA) / "trials" / "exr-luma-chroma";
  if (!std::filesystem::exists(trials)) GTEST_SKIP() << "no shared data";
  const auto of = [&](const char* name) { return light::read_environment((trials / name).string()); };
  const EnvironmentPixels plain = of("rgb.exr");
  for (const char* name : {"yc.exr", "yc_full.exr"}) {
    const EnvironmentPixels got = of(name);
    ASSERT_EQ(got.values.size(), plain.values.size());
    // Pixels at edges of colors lie between samples of chroma and may differ.
    std::size_t wrong = 0;
    glm::dvec3 all(0.0);
    glm::dvec3 expected(0.0);
    for (std::size_t i = 0; i < got.values.size(); ++i) {
      const vec3& color = plain.values[i];
      if (glm::length(got.values[i] - color) > 0.03F * std::max({color.x, color.y, color.z})) ++wrong;
      all += glm::dvec3(got.values[i]);
      expected += glm::dvec3(color);
    }
    EXPECT_LT(wrong, got.values.size() / 50) << name;
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(all[c] / expected[c], 1.0, 0.03) << name << ' ' << c;
  }
  for (const vec3& value : of("y.exr").values) ASSERT_EQ(value, vec3(value.x));
}

}  // namespace
