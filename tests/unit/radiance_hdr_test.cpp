// Radiance images as environments: headers and encodings of many programs.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "light/environment_file.hpp"
#include "light/primaries.hpp"
#include "light/radiance_file.hpp"
#include "support/refusal.hpp"

namespace {

using namespace cumulet;
using glm::vec3;
using light::EnvironmentPixels;

constexpr const char* format = "FORMAT=32-bit_rle_rgbe\n";

EnvironmentPixels read(const std::string& file) {
  return light::read_radiance({reinterpret_cast<const std::uint8_t*>(file.data()), file.size()}, "sky.hdr");
}

std::string refusal(const std::string& file) {
  return test::refusal([&] { read(file); });
}

/// 2 x 1 pixels: (1, 0.5, 0.25) and (2, 2, 2).
const std::string two_pixels("\x80\x40\x20\x81\x80\x80\x80\x82", 8);

std::string with_header(const std::string& header) { return header + "\n-Y 1 +X 2\n" + two_pixels; }

void expect_two(const EnvironmentPixels& got, const vec3& factor = vec3(1.0F)) {
  ASSERT_EQ(got.values.size(), 2U);
  const vec3 expected = vec3(1.0F, 0.5F, 0.25F) * factor;
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(got.values[0][c], expected[c], 1e-5F);
    EXPECT_NEAR(got.values[1][c], 2.0F * factor[c], 1e-5F);
  }
}

TEST(RadianceHdr, AcceptsDifferentHeaders) {
  for (const std::string& header :
       {std::string("#?RADIANCE\n") + format, std::string("#?AUTOPANO\n") + format, std::string("#?\n") + format,
        std::string("#?RGBE\n# made by me\n"), std::string("#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\n"),
        std::string("#?RADIANCE\nFORMAT = 32-bit_rle_rgbe\t \n"), std::string("#?RADIANCE\n") + format + "GAMMA=1.0\n",
        std::string("#?RADIANCE\npcomb -e 'x=1'\n") + format + "EXPOSURE= +1.000000e+00 \n",
        std::string("#?RADIANCE\n") + format + "EXPOSURE=4\n  EXPOSURE= .25\nPIXASPECT=2\nVIEW= -vta\n"}) {
    SCOPED_TRACE(header);
    const EnvironmentPixels got = read(with_header(header));
    expect_two(got);
    EXPECT_TRUE(got.remarks.empty());
  }
  expect_two(read("#?RADIANCE\r\n\r\n-Y 1 +X 2\r\n" + two_pixels));
  expect_two(read("#?RADIANCE\n \t\n  -Y  1\t+X 2 \n" + two_pixels));
}

TEST(RadianceHdr, ExposuresAndColorCorrectionsAreDividedOut) {
  const std::string start = std::string("#?RADIANCE\n") + format;
  expect_two(read(with_header(start + "EXPOSURE=2\nEXPOSURE=+0.25\n")), vec3(2.0F));
  const EnvironmentPixels got = read(with_header(start + "COLORCORR= 2.0 1 +0.5\nEXPOSURE=2\nCOLORCORR=1 1 4\n"));
  expect_two(got, vec3(0.25F, 0.5F, 0.25F));
  ASSERT_EQ(got.remarks.size(), 2U);
  EXPECT_EQ(got.remarks[0], "COLORCORR 2.0 1 +0.5 is removed from the colors");
  const EnvironmentPixels gamma = read(with_header(start + "GAMMA=2.2\n"));
  ASSERT_EQ(gamma.remarks.size(), 1U);
  EXPECT_EQ(gamma.remarks[0], "GAMMA 2.2 is ignored");
  const auto why = [&](const std::string& line) { return refusal(with_header(start + line + "\n")); };
  EXPECT_EQ(why("EXPOSURE=0"), "sky.hdr: EXPOSURE=0 is not above 0");
  EXPECT_EQ(why("EXPOSURE=-1"), "sky.hdr: EXPOSURE=-1 is not above 0");
  EXPECT_EQ(why("EXPOSURE=inf"), "sky.hdr: cannot read EXPOSURE=inf");
  EXPECT_EQ(why("EXPOSURE=1,5"), "sky.hdr: cannot read EXPOSURE=1,5");
  EXPECT_EQ(why("COLORCORR=1 1"), "sky.hdr: cannot read COLORCORR=1 1");
  EXPECT_EQ(why("EXPOSURE=1e300\nEXPOSURE=1e300"), "sky.hdr: exposures out of range");
  EXPECT_EQ(why("FORMAT=32-bit_rle_luv"), "sky.hdr: has FORMAT=32-bit_rle_luv, not 32-bit_rle_rgbe or 32-bit_rle_xyze");
}

TEST(RadianceHdr, PrimariesAndXyzAreConverted) {
  const std::string start = "#?RADIANCE\n";
  const auto expect_converted = [&](const std::string& header, const glm::dmat3& matrix, const std::string& remark) {
    const EnvironmentPixels got = read(with_header(start + header));
    ASSERT_EQ(got.remarks.size(), 1U);
    EXPECT_NE(got.remarks[0].find(remark), std::string::npos) << got.remarks[0];
    const vec3 expected = light::into_gamut(vec3(matrix * glm::dvec3(1.0, 0.5, 0.25)));
    EXPECT_LT(glm::length(got.values.at(0) - expected), 1e-5F);
  };
  expect_converted("FORMAT=32-bit_rle_xyze\n", light::rec709_matrix_of_xyz(), "converted from CIE XYZ");
  const light::Primaries p3{{0.68, 0.32}, {0.265, 0.69}, {0.15, 0.06}};
  expect_converted("PRIMARIES= 0.68 0.32 0.265 0.69 0.15 0.06 0.3127 0.329\n", light::rec709_matrix(p3).value(),
                   "converted from Display P3 primaries");
  expect_converted("PRIMARIES=0 0 0 0 0 0 0 0\n", glm::dmat3(1.0), "Rec. 709 is assumed");
  expect_converted("PRIMARIES=0.64 0.33\n", glm::dmat3(1.0), "Rec. 709 is assumed");
  EXPECT_TRUE(read(with_header(start + "PRIMARIES=0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329\n")).remarks.empty());
}

TEST(RadianceHdr, AllEightOrientationsGiveTheSameImage) {
  constexpr int width = 3;
  constexpr int height = 2;
  const auto red = [](int x, int y) { return static_cast<char>(16 * (1 + x + 3 * y)); };
  for (int i = 0; i < 8; ++i) {
    const bool columns = (i & 1) != 0;
    const bool up = (i & 2) != 0;
    const bool left = (i & 4) != 0;
    const std::string rows = std::string(up ? "+" : "-") + "Y 2";
    const std::string across = std::string(left ? "-" : "+") + "X 3";
    const std::string resolution = columns ? across + " " + rows : rows + " " + across;
    SCOPED_TRACE(resolution);
    std::string body;
    for (int line = 0; line < (columns ? width : height); ++line) {
      for (int at = 0; at < (columns ? height : width); ++at) {
        const int x = columns ? line : at;
        const int y = columns ? at : line;
        body += std::string({red(left ? width - 1 - x : x, up ? height - 1 - y : y), '\0', '\0', '\x81'});
      }
    }
    const EnvironmentPixels got = read("#?RADIANCE\n\n" + resolution + "\n" + body);
    ASSERT_EQ(got.width, 3U);
    ASSERT_EQ(got.height, 2U);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        EXPECT_EQ(got.values[static_cast<std::size_t>(y * width + x)].x, float(1 + x + 3 * y) / 8.0F) << x << ' ' << y;
      }
    }
  }
  for (const char* bad : {"-Y 2 -Y 3", "Y 2 X 3", "-Y 2", "-Y two +X 3", "-Y 2 +X 3 +Z 4", "-Y -2 +X 3", ""}) {
    EXPECT_NE(refusal("#?RADIANCE\n\n" + std::string(bad) + "\n" + two_pixels).find("sky.hdr: has the resolution '"),
              std::string::npos)
        << bad;
  }
}

/// `count` gray pixels of this value, uncompressed.
std::string flat(std::size_t count, char value) {
  std::string pixels;
  for (std::size_t i = 0; i < count; ++i) pixels += std::string({value, value, value, '\x81'});
  return pixels;
}

TEST(RadianceHdr, FlatImagesMayResembleRunLengthEncodedOnes) {
  const std::string header = "#?RADIANCE\n\n-Y 2 +X 64\n";
  // Pixels that look like the start of a coded line of another width, of the right width, and like an old run.
  for (const std::string& pixel :
       {std::string("\x02\x02\x04\x78", 4), std::string("\x02\x02\x00\x40", 4), std::string("\x01\x01\x01\x20", 4)}) {
    for (const std::size_t at : {std::size_t{0}, std::size_t{64}}) {
      std::string body = flat(128, '\x40');
      body.replace(4 * at, 4, pixel);
      const EnvironmentPixels got = read(header + body);
      ASSERT_EQ(got.values.size(), 128U);
      for (std::size_t i = 0; i < 128; ++i) {
        if (i != at) {
          ASSERT_EQ(got.values[i], vec3(0.5F)) << at << ' ' << i;
        }
      }
    }
  }
  // An image that is not uncompressed stays invalid.
  EXPECT_EQ(refusal(header + std::string("\x02\x02\x04\x78", 4) + flat(128, '\x40')),
            "sky.hdr: a row has the wrong width");
}

TEST(RadianceHdr, ReadsOldRunLengthsAndNarrowImages) {
  const std::string run("\x01\x01\x01\x2c\x01\x01\x01\x01", 8);  // 44 + 256 more
  const EnvironmentPixels old = read("#?RADIANCE\n\n-Y 1 +X 301\n" + flat(1, '\x40') + run);
  ASSERT_EQ(old.values.size(), 301U);
  for (const vec3& value : old.values) EXPECT_EQ(value, vec3(0.5F));
  // Images narrower than 8 pixels are never coded by channel.
  const EnvironmentPixels narrow =
      read("#?RADIANCE\n\n-Y 1 +X 7\n" + std::string("\x02\x02\x00\x07", 4) + flat(6, '\x40'));
  ASSERT_EQ(narrow.values.size(), 7U);
  EXPECT_EQ(refusal("#?RADIANCE\n\n-Y 1 +X 40000\n" + flat(1, '\x40')),
            "sky.hdr: the environment has 40000x1 pixels; the limit is 16384 per side");
  EXPECT_EQ(refusal("#?RADIANCE\n\n-Y 1 +X 4\n" + flat(3, '\x40')), "sky.hdr: truncated Radiance file");
}

TEST(RadianceHdr, SharedTestImagesGiveTheSameEnvironment) {
  const std::filesystem::path trials = std::filesystem::path(CUMULET_SHARED_DATA) / "trials" / "hdr-headers";
  if (!std::filesystem::exists(trials)) GTEST_SKIP() << "no shared data";
  const auto of = [&](const char* name) { return light::read_environment((trials / name).string()); };
  const EnvironmentPixels plain = of("plain.hdr");
  for (const char* name : {"rle.hdr", "crlf.hdr", "noformat.hdr", "autopano.hdr", "fmtspace.hdr", "fmttrail.hdr",
                           "exp_plus.hdr", "flip.hdr", "mirror.hdr"}) {
    const EnvironmentPixels got = of(name);
    EXPECT_TRUE(got.remarks.empty()) << name;
    EXPECT_EQ(got.width, plain.width) << name;
    const std::string file = name;
    if (file != "flip.hdr" && file != "mirror.hdr") {
      EXPECT_EQ(got.values, plain.values) << name;
    }
  }
  EXPECT_EQ(of("colorcorr.hdr").remarks.size(), 1U);
  EXPECT_EQ(of("flat_like_coded.hdr").values.size(), plain.values.size());
}

}  // namespace
