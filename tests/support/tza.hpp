#pragma once

// Tensor archives and networks that tests generate.

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <glm/gtc/packing.hpp>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "denoise/network.hpp"
#include "denoise/tza.hpp"

namespace cumulet::test {

/// Writes little-endian bytes.
class TzaBytes {
 public:
  TzaBytes& number(std::uint64_t value, unsigned size) {
    for (unsigned i = 0; i < size; ++i, value >>= 8U) bytes_.push_back(static_cast<std::uint8_t>(value));
    return *this;
  }
  TzaBytes& text(const std::string& letters) {
    bytes_.insert(bytes_.end(), letters.begin(), letters.end());
    return *this;
  }
  TzaBytes& header(std::uint64_t table) { return number(0x41D7, 2).number(2, 1).number(0, 1).number(table, 8); }
  TzaBytes& record(const std::string& name, const std::vector<std::uint32_t>& shape, const std::string& layout,
                   char type, std::uint64_t offset) {
    number(name.size(), 2).text(name).number(shape.size(), 1);
    for (const std::uint32_t extent : shape) number(extent, 4);
    return text(layout).number(static_cast<std::uint8_t>(type), 1).number(offset, 8);
  }
  TzaBytes& values(const std::vector<float>& values, char type) {
    for (const float value : values) {
      std::uint32_t bits = 0;
      std::memcpy(&bits, &value, sizeof(bits));
      type == 'h' ? number(glm::packHalf1x16(value), 2) : number(bits, 4);
    }
    return *this;
  }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// A file of these tensors, all of one type.
inline std::vector<std::uint8_t> tza_file(const denoise::TensorArchive& archive, char type = 'h') {
  const std::uint64_t value_bytes = type == 'h' ? 2 : 4;
  std::uint64_t end = 12;
  for (const auto& [name, tensor] : archive) end += tensor.values.size() * value_bytes;
  TzaBytes file;
  file.header(end);
  for (const auto& [name, tensor] : archive) file.values(tensor.values, type);
  file.number(archive.size(), 4);
  std::uint64_t offset = 12;
  for (const auto& [name, tensor] : archive) {
    file.record(name, tensor.shape, tensor.layout, type, offset);
    offset += tensor.values.size() * value_bytes;
  }
  return file.bytes();
}

/// Output channels of a network's convolutions, in their order.
using NetworkWidths = std::array<std::uint32_t, denoise::Network::convolution_count>;
inline constexpr NetworkWidths base_widths{32, 32, 48, 64, 80, 96, 96, 112, 112, 96, 96, 64, 64, 64, 32, 3};
inline constexpr NetworkWidths small_widths{32, 32, 32, 32, 32, 32, 32, 64, 64, 64, 64, 64, 32, 32, 32, 3};

/// A network of random weights that are exact as half floats. Its activations neither vanish nor grow.
inline denoise::TensorArchive random_archive(const NetworkWidths& widths, std::uint32_t inputs, unsigned seed = 1) {
  static constexpr std::array<const char*, denoise::Network::convolution_count> names{
      "enc_conv0",  "enc_conv1",  "enc_conv2",  "enc_conv3",  "enc_conv4",  "enc_conv5a", "enc_conv5b", "dec_conv4a",
      "dec_conv4b", "dec_conv3a", "dec_conv3b", "dec_conv2a", "dec_conv2b", "dec_conv1a", "dec_conv1b", "dec_conv0"};
  const std::array<std::uint32_t, denoise::Network::convolution_count> from{inputs,     widths[0],
                                                                            widths[1],  widths[2],
                                                                            widths[3],  widths[4],
                                                                            widths[5],  widths[6] + widths[3],
                                                                            widths[7],  widths[8] + widths[2],
                                                                            widths[9],  widths[10] + widths[1],
                                                                            widths[11], widths[12] + inputs,
                                                                            widths[13], widths[14]};
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  const auto half = [](float value) { return glm::unpackHalf1x16(glm::packHalf1x16(value)); };
  denoise::TensorArchive archive;
  for (std::size_t i = 0; i < names.size(); ++i) {
    denoise::Tensor weights{{widths[i], from[i], 3, 3}, "oihw", {}};
    weights.values.resize(std::size_t{widths[i]} * from[i] * 9);
    // He initialization: ReLU halves the mean square.
    const float scale = std::sqrt(2.0F / static_cast<float>(9 * from[i]));
    for (float& value : weights.values) value = half(scale * normal(random));
    denoise::Tensor biases{{widths[i]}, "x", {}};
    biases.values.resize(widths[i]);
    for (float& value : biases.values) value = half(0.1F * normal(random));
    // A bias of 0.5 keeps a part of the output color positive.
    if (i + 1 == names.size()) biases.values.assign(widths[i], 0.5F);
    archive.emplace(std::string(names[i]) + ".weight", std::move(weights));
    archive.emplace(std::string(names[i]) + ".bias", std::move(biases));
  }
  return archive;
}

/// A network whose weights are all 0.
inline denoise::TensorArchive dark_archive(const NetworkWidths& widths, std::uint32_t inputs) {
  denoise::TensorArchive archive = random_archive(widths, inputs);
  for (auto& [name, tensor] : archive) tensor.values.assign(tensor.values.size(), 0.0F);
  return archive;
}

/// A network that returns its input colors.
inline denoise::TensorArchive clear_archive(const NetworkWidths& widths, std::uint32_t inputs) {
  denoise::TensorArchive archive = dark_archive(widths, inputs);
  const auto hand_on = [&](const char* name, std::uint32_t first) {
    denoise::Tensor& weights = archive.at(name);
    constexpr std::uint32_t middle = 4;  // of 3 x 3
    for (std::uint32_t c = 0; c < 3; ++c)
      weights.values.at(9 * (std::size_t{c} * weights.shape[1] + first + c) + middle) = 1.0F;
  };
  hand_on("dec_conv1a.weight", widths[12]);
  hand_on("dec_conv1b.weight", 0);
  hand_on("dec_conv0.weight", 0);
  return archive;
}

}  // namespace cumulet::test
