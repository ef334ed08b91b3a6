#include "support/flip.hpp"

#include <gtest/gtest.h>

#include <random>

namespace {

using cumulet::test::Flip;
using Bytes = std::vector<std::uint8_t>;

constexpr int side = 40;

Bytes filled(std::uint8_t red, std::uint8_t green, std::uint8_t blue) {
  Bytes picture;
  for (int i = 0; i < side * side; ++i) picture.insert(picture.end(), {red, green, blue, 255});
  return picture;
}

Bytes noise(unsigned seed) {
  std::mt19937 engine(seed);
  Bytes picture(4 * side * side);
  for (std::uint8_t& byte : picture) byte = static_cast<std::uint8_t>(engine() & 255U);
  return picture;
}

// Black left of x, white right of it.
Bytes step(int x) {
  Bytes picture;
  for (int i = 0; i < side * side; ++i) {
    const std::uint8_t value = i % side < x ? 0 : 255;
    picture.insert(picture.end(), {value, value, value, 255});
  }
  return picture;
}

double mean(const Bytes& a, const Bytes& b) { return Flip(side, side).mean(a, b); }

TEST(Flip, IdenticalImagesHaveNoDifference) {
  for (const Bytes& picture : {filled(0, 0, 0), filled(200, 30, 90), noise(1), step(20)})
    EXPECT_EQ(mean(picture, picture), 0.0);
}

// Computed by hand from the paper's definitions. For uniform colors, filters and features have no effect. Black and
// white differ by a lightness of 100: 100^0.7 = 25.119. The maximum is that of green and blue, 203.30^0.7 = 41.277. The
// result is 0.95 + 0.05 (25.119 - 0.4 x 41.277) / (0.6 x 41.277) = 0.96738.
TEST(Flip, UniformColorsDifferByTheirColorDistance) {
  EXPECT_NEAR(mean(filled(0, 0, 0), filled(255, 255, 255)), 0.96738, 2e-5);
  EXPECT_NEAR(mean(filled(0, 255, 0), filled(0, 0, 255)), 1.0, 1e-9);
  // Grays of lightness 53.585 and 53.977, difference 0.3916: 0.95 x 0.3916^0.7 / (0.4 x 41.277).
  EXPECT_NEAR(mean(filled(128, 128, 128), filled(129, 129, 129)), 0.02988, 2e-4);
}

// Reference value of an independent Python program with two-dimensional kernels and the rounded matrices of the
// authors' documentation.
TEST(Flip, DetailedImageMatchesTheReferenceImplementation) {
  constexpr int width = 24;
  constexpr int height = 20;
  Bytes a;
  Bytes b;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 4; ++c) {
        const auto value = static_cast<std::uint8_t>((x * 7 + y * 13 + c * 50) % 256);
        const bool other = (x / 6 + y / 5) % 2 == 1;
        a.push_back(value);
        b.push_back(other ? static_cast<std::uint8_t>((x * 11 + y * 5 + c * 80 + 40) % 256) : value);
      }
    }
  }
  EXPECT_NEAR(Flip(width, height).mean(a, b), 0.599686, 2e-5);
}

TEST(Flip, IsSymmetric) {
  EXPECT_NEAR(mean(noise(1), noise(2)), mean(noise(2), noise(1)), 1e-12);
  EXPECT_NEAR(mean(noise(1), filled(90, 90, 90)), mean(filled(90, 90, 90), noise(1)), 1e-12);
}

// An edge that only one image has counts, equally in both directions.
TEST(Flip, EdgesCountMoreThanColors) {
  const Bytes other = step(20);
  const std::vector<double> differences = Flip(side, side).map(filled(0, 0, 0), other);
  const auto at = [&](int x, int y) { return differences[static_cast<std::size_t>(y * side + x)]; };
  EXPECT_GT(at(20, 20), at(39, 20));
  EXPECT_EQ(at(0, 20), 0.0);
  Bytes turned(other.size());
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      for (int c = 0; c < 4; ++c) {
        turned[static_cast<std::size_t>(4 * (y * side + x) + c)] =
            other[static_cast<std::size_t>(4 * (x * side + y) + c)];
      }
    }
  }
  EXPECT_NEAR(mean(filled(0, 0, 0), other), mean(filled(0, 0, 0), turned), 1e-12);
}

// From far away a checkerboard looks gray.
TEST(Flip, FineDetailIsBlurredByDistance) {
  Bytes checks;
  for (int i = 0; i < side * side; ++i) {
    const std::uint8_t value = (i % side + i / side) % 2 == 0 ? 0 : 255;
    checks.insert(checks.end(), {value, value, value, 255});
  }
  const Bytes grey = filled(188, 188, 188);  // half of white's light
  EXPECT_GT(Flip(side, side, 5.0).mean(grey, checks), 0.3);
  EXPECT_LT(Flip(side, side, 67.0).mean(grey, checks), 0.05);
}

TEST(Flip, ImagesOfDifferentSizesAreRejected) {
  EXPECT_THROW((void)mean(filled(0, 0, 0), Bytes(16)), std::invalid_argument);
}

}  // namespace
