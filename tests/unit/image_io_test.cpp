#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfInputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfVecAttribute.h>
#include <ImfVersion.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <array>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "file.hpp"
#include "image.hpp"
#include "layers.hpp"
#include "support/folder.hpp"

namespace {

namespace fs = std::filesystem;
using namespace cumulet::image;

class ImageIo : public ::testing::Test {
 protected:
  [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }
  /// Number of files in the folder, including temporary files that were left behind.
  [[nodiscard]] std::size_t count() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()));
  }
  cumulet::test::Folder folder_;
};

Image gradient(std::uint32_t width, std::uint32_t height) {
  Image image{width, height, {}};
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x) {
      const auto fx = static_cast<float>(x);
      const auto fy = static_cast<float>(y);
      image.rgba.insert(image.rgba.end(), {fx * 0.25f, fy * 100.0f, -1.5f + fx * fy, 0.5f});
    }
  return image;
}

std::string failure(const auto& action) {
  try {
    action();
    return "";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

void put(const std::string& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

Image pixel(float r, float g, float b, float a) { return {1, 1, {r, g, b, a}}; }

TEST_F(ImageIo, ExrRoundTripIsExact) {
  const Image image = gradient(37, 19);
  write_exr(path("a.exr"), image);
  const Image back = read_exr(path("a.exr"));
  EXPECT_EQ(back.width, 37u);
  EXPECT_EQ(back.height, 19u);
  EXPECT_EQ(back.rgba, image.rgba);
  EXPECT_EQ(count(), 1u);
}

/// Every layer of a rendered image, each with values of its own. Some are hard to store exactly.
struct Rendered {
  static constexpr std::uint32_t width = 13;
  static constexpr std::uint32_t height = 7;
  static constexpr LayerName names[] = {layers::beauty, layers::volume,       layers::transmittance,
                                        layers::depth,  layers::volume_depth, layers::normal,
                                        layers::albedo, layers::error,        layers::velocity};
  std::vector<std::vector<float>> values;
  std::vector<Layer> all;

  Rendered() {
    for (const LayerName& name : names) {
      std::vector<float>& v = values.emplace_back(name.channels.size() * width * height);
      for (std::size_t i = 0; i < v.size(); ++i)
        v[i] = 1e-3f * static_cast<float>(i) + 1000.0f * static_cast<float>(values.size());
      v[0] = no_depth;
      v[1] = 1e-38f;
    }
    for (std::size_t i = 0; i < values.size(); ++i) all.push_back({names[i], values[i]});
  }
};

TEST_F(ImageIo, ExrLayersRoundTripIsExact) {
  const Rendered rendered;
  write_exr(path("a.exr"), Rendered::width, Rendered::height, rendered.all);
  for (const Layer& layer : rendered.all) {
    const Pixels back = read_exr(path("a.exr"), layer.name);
    EXPECT_EQ(back.width, Rendered::width);
    EXPECT_EQ(back.height, Rendered::height);
    EXPECT_TRUE(std::equal(back.values.begin(), back.values.end(), layer.values.begin(), layer.values.end()))
        << layer.name.name;
  }
  // Readers of plain images read only the beauty layer.
  EXPECT_EQ(read_exr(path("a.exr")).rgba, rendered.values[0]);
  EXPECT_EQ(count(), 1u);
}

TEST_F(ImageIo, FilesStoreTheirPrimaries) {
  write_exr(path("a.exr"), gradient(8, 4));
  const Imf::InputFile file(path("a.exr").c_str());
  ASSERT_TRUE(Imf::hasChromaticities(file.header()));
  EXPECT_EQ(Imf::chromaticities(file.header()), Imf::Chromaticities());
  write_png(path("a.png"), gradient(8, 4));
  const std::string png = read_file(path("a.png"));
  // Between IHDR and the pixels. Each chunk has its length before its type, and its checksum after its data.
  const std::string srgb("\0\0\0\1sRGB\0\xae\xce\x1c\xe9", 13);
  const std::string gama("\0\0\0\4gAMA\0\0\xb1\x8f\x0b\xfc\x61\x05", 16);
  const std::string chrm(
      "\0\0\0\x20"
      "cHRM\0\0\x7a\x26\0\0\x80\x84\0\0\xfa\0\0\0\x80\xe8\0\0\x75\x30\0\0\xea\x60\0\0\x3a\x98\0\0\x17\x70"
      "\x9c\xba\x51\x3c",
      44);
  EXPECT_EQ(png.substr(33, srgb.size() + gama.size() + chrm.size()), srgb + gama + chrm);
  EXPECT_EQ(png.find("IDAT"), 33 + srgb.size() + gama.size() + chrm.size() + 4);
}

TEST_F(ImageIo, ExrOfARegionStoresItsWindow) {
  const Rendered rendered;
  const Windows windows{Rendered::width, Rendered::height, 4, 7, 100, 50};
  write_exr(path("a.exr"), windows, rendered.all);
  EXPECT_EQ(read_contents(path("a.exr")).windows, windows);
  const Imf::InputFile file(path("a.exr").c_str());
  EXPECT_EQ(file.header().displayWindow(), Imath::Box2i({0, 0}, {99, 49}));
  EXPECT_EQ(file.header().dataWindow(),
            Imath::Box2i({4, 7}, {3 + static_cast<int>(Rendered::width), 6 + static_cast<int>(Rendered::height)}));
  for (const Layer& layer : rendered.all) {
    const Pixels back = read_exr(path("a.exr"), layer.name);
    EXPECT_TRUE(std::equal(back.values.begin(), back.values.end(), layer.values.begin(), layer.values.end()))
        << layer.name.name;
  }
}

TEST_F(ImageIo, ExrLayersMatchOpenExrsReader) {
  const Rendered rendered;
  write_exr(path("a.exr"), Rendered::width, Rendered::height, rendered.all);
  Imf::InputFile file(path("a.exr").c_str());
  const Imf::Header& header = file.header();
  std::set<std::string> names;
  for (auto i = header.channels().begin(); i != header.channels().end(); ++i) {
    names.insert(i.name());
    EXPECT_EQ(i.channel().type, Imf::FLOAT) << i.name();  // half ends at 65504: no_depth would be infinite
    EXPECT_EQ(i.channel().xSampling, 1);
    EXPECT_EQ(i.channel().ySampling, 1);
  }
  // The names that docs/aovs.md specifies.
  EXPECT_EQ(names, (std::set<std::string>{"R",
                                          "G",
                                          "B",
                                          "A",
                                          "volume.R",
                                          "volume.G",
                                          "volume.B",
                                          "volume.A",
                                          "transmittance.Y",
                                          "depth.Z",
                                          "volume_depth.Z",
                                          "normal.X",
                                          "normal.Y",
                                          "normal.Z",
                                          "albedo.R",
                                          "albedo.G",
                                          "albedo.B",
                                          "error.Y",
                                          "velocity.X",
                                          "velocity.Y",
                                          "velocity.Z"}));
  std::set<std::string> layer_names;
  header.channels().layers(layer_names);
  EXPECT_EQ(layer_names, (std::set<std::string>{"volume", "transmittance", "depth", "volume_depth", "normal", "albedo",
                                                "error", "velocity"}));
  EXPECT_EQ(header.dataWindow(), Imath::Box2i({0, 0}, {12, 6}));
  EXPECT_EQ(header.displayWindow(), header.dataWindow());
  EXPECT_EQ(header.pixelAspectRatio(), 1.0f);
  EXPECT_EQ(header.compression(), Imf::ZIP_COMPRESSION);
  EXPECT_FALSE(header.hasName());  // a single part: Blender would add its name to every layer's
  ASSERT_TRUE(Imf::hasChromaticities(header));
  EXPECT_EQ(Imf::chromaticities(header).red, Imath::V2f(0.64f, 0.33f));
  EXPECT_EQ(Imf::chromaticities(header).white, Imath::V2f(0.3127f, 0.3290f));

  // Read with OpenEXR and not with this library's reader, whose mistakes could cancel the writer's.
  std::vector<float> z(std::size_t{Rendered::width} * Rendered::height);
  Imf::FrameBuffer frame;
  frame.insert("normal.Z", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(z.data()), sizeof(float),
                                      sizeof(float) * Rendered::width));
  file.setFrameBuffer(frame);
  file.readPixels(0, static_cast<int>(Rendered::height) - 1);
  for (std::size_t i = 0; i < z.size(); ++i) EXPECT_EQ(z[i], rendered.values[5][3 * i + 2]) << i;
}

TEST_F(ImageIo, ExrAttributesMatchOpenExrsReader) {
  const std::vector<float> one(6);
  const Layer depth{layers::depth, one};
  std::array<float, 16> matrix{};
  for (std::size_t i = 0; i < 16; ++i) matrix[i] = static_cast<float>(i);
  const Attribute all[] = {{"comments", std::string("a cloud")},
                           {"worldToCamera", matrix},
                           {"screenWindowCenter", std::array{0.25f, -0.5f}},
                           {"screenWindowWidth", 2.5f},
                           {"cumulet:seed", 4294967295.0},
                           {"cumulet:eye", std::array{0.1, 0.2, 1e10}}};
  write_exr(path("a.exr"), 3, 2, {&depth, 1}, all);
  const Imf::InputFile file(path("a.exr").c_str());
  const Imf::Header& header = file.header();
  ASSERT_TRUE(Imf::hasComments(header));
  EXPECT_EQ(Imf::comments(header), "a cloud");
  ASSERT_TRUE(Imf::hasWorldToCamera(header));
  EXPECT_EQ(Imf::worldToCamera(header)[3][1], 13.0f);
  EXPECT_EQ(header.screenWindowCenter(), Imath::V2f(0.25f, -0.5f));
  EXPECT_EQ(header.screenWindowWidth(), 2.5f);
  EXPECT_EQ(header.typedAttribute<Imf::DoubleAttribute>("cumulet:seed").value(), 4294967295.0);
  EXPECT_EQ(header.typedAttribute<Imf::V3dAttribute>("cumulet:eye").value(), Imath::V3d(0.1, 0.2, 1e10));
  EXPECT_EQ(file.version() & Imf::LONG_NAMES_FLAG, 0);
  for (const std::string& name : {std::string(), std::string(32, 'n')}) {
    const Attribute bad{name, 1.0f};
    EXPECT_THROW(write_exr(path("b.exr"), 3, 2, {&depth, 1}, {&bad, 1}), std::logic_error);
  }
  EXPECT_EQ(count(), 1u);
}

TEST_F(ImageIo, ExrLayerErrorsAreReported) {
  const std::vector<float> one(6);
  const auto write = [&](const std::string& to, std::initializer_list<Layer> layers) {
    write_exr(to, 3, 2, std::span<const Layer>(layers.begin(), layers.size()));
  };
  const std::string absent = failure([&] { write(path("absent/a.exr"), {{layers::depth, one}}); });
  EXPECT_EQ(absent.rfind(path("absent/a.exr") + ": ", 0), 0u) << absent;
  EXPECT_EQ(absent.find('\n'), std::string::npos) << absent;

  EXPECT_THROW(write(path("a.exr"), {{layers::depth, one}, {layers::normal, one}}), std::logic_error);
  EXPECT_THROW(write(path("a.exr"), {{layers::depth, one}, {layers::depth, one}}), std::logic_error);
  EXPECT_NE(failure([&] { write_exr(path("a.exr"), 0, 2, {}); }), "");
  EXPECT_EQ(count(), 0u);

  write(path("a.exr"), {{layers::depth, one}});
  const std::string missing = failure([&] { static_cast<void>(read_exr(path("a.exr"), layers::normal)); });
  EXPECT_EQ(missing.rfind(path("a.exr") + ": ", 0), 0u) << missing;
  EXPECT_NE(missing.find("normal.X"), std::string::npos) << missing;
  EXPECT_EQ(missing.find('\n'), std::string::npos) << missing;
}

TEST_F(ImageIo, PfmRoundTripIsExactExceptAlpha) {
  Image image = gradient(5, 4);
  write_pfm(path("a.pfm"), image);
  const Image back = read_pfm(path("a.pfm"));
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 1.0f;
  EXPECT_EQ(back.width, 5u);
  EXPECT_EQ(back.height, 4u);
  EXPECT_EQ(back.rgba, image.rgba);
}

TEST_F(ImageIo, PfmBytesMatchTheFormat) {
  // One column, two rows: the top pixel is (1, 2, -0.5), the bottom one black.
  write_pfm(path("a.pfm"), Image{1, 2, {1.0f, 2.0f, -0.5f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f}});
  std::string expected = "PF\n1 2\n-1.0\n";
  expected += std::string(12, '\0');  // the bottom row comes first
  expected += std::string("\x00\x00\x80\x3f\x00\x00\x00\x40\x00\x00\x00\xbf", 12);
  EXPECT_EQ(read_file(path("a.pfm")), expected);
}

TEST_F(ImageIo, PfmReadsBigEndianAndGrey) {
  put(path("a.pfm"), std::string("Pf\n1 1\n1.0\n\x3f\x80\x00\x00", 15));
  EXPECT_EQ(read_pfm(path("a.pfm")).rgba, (std::vector<float>{1.0f, 1.0f, 1.0f, 1.0f}));
}

TEST_F(ImageIo, DamagedFilesGiveAOneLineErrorWithTheName) {
  write_exr(path("good.exr"), gradient(64, 64));
  write_pfm(path("good.pfm"), gradient(64, 64));
  write_png(path("good.png"), gradient(64, 64));
  for (const char* name : {"good.exr", "good.pfm", "good.png"}) {
    const std::string bytes = read_file(path(name));
    for (const std::string& damaged : {std::string(), bytes.substr(0, bytes.size() / 2), std::string("nonsense")}) {
      put(path("bad"), damaged);
      const std::string error = failure([&] {
        const std::string kind = name + 5;
        if (kind == "exr") static_cast<void>(read_exr(path("bad")));
        if (kind == "pfm") static_cast<void>(read_pfm(path("bad")));
        if (kind == "png") static_cast<void>(read_png(path("bad")));
      });
      EXPECT_NE(error.find(path("bad")), std::string::npos) << name << ": " << error;
      EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    }
  }
  put(path("bad.pfm"), "PF\n100000 100000\n-1.0\n");
  EXPECT_NE(failure([&] { static_cast<void>(read_pfm(path("bad.pfm"))); }), "");
  EXPECT_NE(failure([&] { static_cast<void>(read_exr(path("absent.exr"))); }), "");
}

TEST(ToneMapping, NeutralIsKhronosPbrNeutral) {
  // Below the shoulder only the toe's offset applies.
  const auto grey = tone_map_neutral({0.5f, 0.5f, 0.5f});
  for (const float c : grey) EXPECT_NEAR(c, 0.46f, 1e-6f);
  // Dark: x - (x - 6.25 x^2) for the smallest channel.
  EXPECT_NEAR(tone_map_neutral({0.04f, 0.04f, 0.04f})[0], 6.25f * 0.04f * 0.04f, 1e-6f);
  // White of 1: peak 0.96, 1 - 0.24^2 / (0.96 + 0.24 - 0.76).
  EXPECT_NEAR(tone_map_neutral({1.0f, 1.0f, 1.0f})[1], 1.0f - 0.0576f / 0.44f, 1e-6f);
  // Bright colors lose saturation but keep their order, and stay below 1.
  const auto bright = tone_map_neutral({20.0f, 10.0f, 5.0f});
  EXPECT_LT(bright[0], 1.0f);
  EXPECT_GT(bright[0], bright[1]);
  EXPECT_GT(bright[1], bright[2]);
  EXPECT_GT(bright[2] / bright[0], 5.0f / 20.0f);
}

TEST(ToneMapping, NeutralRisesAndIsContinuous) {
  float last = -1.0f;
  for (int i = 0; i <= 4000; ++i) {
    const float x = static_cast<float>(i) * 0.001f;
    const float y = tone_map_neutral({x, x, x})[0];
    EXPECT_GE(y, last);
    if (i > 0) {
      EXPECT_LT(y - last, 0.0011f) << x;
    }
    last = y;
  }
  EXPECT_EQ(tone_map_neutral({0.0f, 0.0f, 0.0f})[0], 0.0f);
}

TEST(ToneMapping, SrgbCurveInverts) {
  for (int i = 0; i <= 255; ++i) {
    const float v = static_cast<float>(i) / 255.0f;
    EXPECT_NEAR(srgb_encode(srgb_decode(v)), v, 1e-5f);
  }
  EXPECT_NEAR(srgb_encode(0.18f), 0.46136f, 1e-4f);
}

TEST_F(ImageIo, PngAppliesTheToneCurve) {
  const auto byte = [&](const PngOptions& options, float value) {
    write_png(path("a.png"), pixel(value, value, value, 0.25f), options);
    const Image back = read_png(path("a.png"));
    EXPECT_EQ(back.rgba[3], 1.0f);  // opaque by default
    return std::lround(srgb_encode(back.rgba[0]) * 255.0f);
  };
  const auto expected = [](float display) { return std::lround(srgb_encode(display) * 255.0f); };
  EXPECT_EQ(byte({}, 0.0f), 0);
  EXPECT_EQ(byte({}, 0.5f), expected(0.46f));
  EXPECT_EQ(byte({1.0}, 0.25f), expected(0.46f));  // a stop is a factor of 2
  EXPECT_EQ(byte({-1.0}, 1.0f), expected(0.46f));
  EXPECT_EQ(byte({}, 1.0f), expected(1.0f - 0.0576f / 0.44f));
  EXPECT_EQ(byte({}, 1e9f), 255);
  EXPECT_EQ(byte({0.0, ToneMapping::none}, 0.5f), expected(0.5f));
  EXPECT_EQ(byte({0.0, ToneMapping::none}, 3.0f), 255);
}

TEST_F(ImageIo, PngKeepsAlphaWhenAsked) {
  write_png(path("a.png"), pixel(0.5f, 0.5f, 0.5f, 0.2f), {0.0, ToneMapping::neutral, true});
  EXPECT_NEAR(read_png(path("a.png")).rgba[3], 0.2f, 0.5f / 255.0f);
}

TEST_F(ImageIo, PngHandlesNonFiniteValues) {
  const float infinite = std::numeric_limits<float>::infinity();
  const float none = std::numeric_limits<float>::quiet_NaN();
  write_png(path("a.png"), pixel(infinite, none, -1.0f, none), {0.0, ToneMapping::none, true});
  EXPECT_EQ(read_png(path("a.png")).rgba, (std::vector<float>{1.0f, 0.0f, 0.0f, 0.0f}));
  write_png(path("a.png"), pixel(infinite, none, -1.0f, none));
  EXPECT_NEAR(read_png(path("a.png")).rgba[0], 1.0f, 0.01f);
}

TEST_F(ImageIo, PngIsTopDown) {
  write_png(path("a.png"), Image{1, 2, {1.0f, 1.0f, 1.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f}});
  const Image back = read_png(path("a.png"));
  EXPECT_GT(back.rgba[0], 0.5f);
  EXPECT_EQ(back.rgba[4], 0.0f);
}

TEST_F(ImageIo, FailedWriteLeavesTheOldFile) {
  put(path("a.png"), "old");
  // Simulates a full disk with a file size limit, so that writing stops in the middle. The child is a fork and must not
  // run exit handlers: those of linked libraries wait for threads that a fork does not have.
  EXPECT_EXIT(
      {
        std::signal(SIGXFSZ, SIG_IGN);
        rlimit limit{};
        limit.rlim_cur = limit.rlim_max = 4;
        setrlimit(RLIMIT_FSIZE, &limit);
        const std::string error = failure([&] { write_png(path("a.png"), gradient(64, 64)); });
        std::_Exit(error.rfind(path("a.png") + ": ", 0) == 0 && error.find('\n') == std::string::npos ? 0 : 1);
      },
      ::testing::ExitedWithCode(0), "");
  EXPECT_EQ(read_file(path("a.png")), "old");
  EXPECT_EQ(count(), 1u);
}

TEST_F(ImageIo, CheckWritableModifiesNothing) {
  EXPECT_NE(failure([&] { check_writable(path("absent/a.png")); }).find(path("absent/a.png")), std::string::npos);
  EXPECT_NE(failure([&] { check_writable(folder_.path().string()); }), "");
  EXPECT_NE(failure([&] { check_writable(""); }), "");
  put(path("a.png"), "old");
  check_writable(path("a.png"));
  check_writable(path("new.png"));
  EXPECT_EQ(read_file(path("a.png")), "old");
  EXPECT_EQ(count(), 1u);
}

TEST_F(ImageIo, LinksAndPermissionsAreKept) {
  put(path("target"), "old");
  fs::permissions(path("target"), fs::perms{0640});
  fs::create_symlink("target", path("link"));
  replace_file(path("link"), "new");
  EXPECT_TRUE(fs::is_symlink(path("link")));
  EXPECT_EQ(read_file(path("target")), "new");
  EXPECT_EQ(fs::status(path("target")).permissions(), fs::perms{0640});
  replace_file("/dev/null", "new");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

}  // namespace
