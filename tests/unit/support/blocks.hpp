#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "support/gl_viewer.hpp"

/// Tests whether two sets of noisy images have the same mean.
namespace cumulet::test {

/// Means of blocks of 4 x 4 pixels over several images, and the variance of each mean.
struct Blocks {
  std::vector<glm::dvec3> mean;
  std::vector<glm::dvec3> variance;  // of the mean
};

/// Averages `pictures` square images; picture_of(i) renders image i.
template <class PictureOf>
Blocks blocks_of(unsigned pictures, const PictureOf& picture_of) {
  Blocks blocks;
  std::vector<glm::dvec3> square;
  for (unsigned k = 0; k < pictures; ++k) {
    const Picture picture = picture_of(k);
    const std::uint32_t across = picture.width / 4;
    std::vector<glm::dvec3> of_this(std::size_t{across} * across);
    for (std::uint32_t i = 0; i < picture.pixels.size(); ++i)
      of_this[i / picture.width / 4 * across + i % picture.width / 4] += glm::dvec3(picture.pixels[i]) / 16.0;
    blocks.mean.resize(of_this.size());
    square.resize(of_this.size());
    for (std::size_t i = 0; i < of_this.size(); ++i) {
      blocks.mean[i] += of_this[i] / double(pictures);
      square[i] += of_this[i] * of_this[i] / double(pictures);
    }
  }
  for (std::size_t i = 0; i < square.size(); ++i)
    blocks.variance.push_back(glm::max(square[i] - blocks.mean[i] * blocks.mean[i], 1e-12) / double(pictures - 1));
  return blocks;
}

/// Expects that each pair of blocks differs by less than 7 standard errors, and the sum over all blocks by less than
/// 4.5.
inline void expect_alike(const Blocks& a, const Blocks& b) {
  glm::dvec3 apart(0.0);
  glm::dvec3 spread(0.0);
  for (std::size_t i = 0; i < a.mean.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const double sigma = std::sqrt(a.variance[i][c] + b.variance[i][c]);
      EXPECT_NEAR(a.mean[i][c], b.mean[i][c], 7.0 * sigma + 2e-3) << "block " << i << ", component " << c;
    }
    apart += a.mean[i] - b.mean[i];
    spread += a.variance[i] + b.variance[i];
  }
  for (int c = 0; c < 3; ++c) EXPECT_LT(std::abs(apart[c]), 4.5 * std::sqrt(spread[c]) + 1e-3) << "component " << c;
}

}  // namespace cumulet::test
