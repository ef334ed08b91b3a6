// Tensor archives of Open Image Denoise and the networks that they describe.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "denoise/network.hpp"
#include "denoise/tza.hpp"
#include "support/folder.hpp"
#include "support/refusal.hpp"
#include "support/tza.hpp"

namespace {

using cumulet::Error;
using cumulet::ErrorCode;
using cumulet::denoise::make_network;
using cumulet::denoise::NetworkPtr;
using cumulet::denoise::read_tza;
using cumulet::denoise::Tensor;
using cumulet::denoise::TensorArchive;
using cumulet::test::base_widths;
using cumulet::test::random_archive;
using cumulet::test::refusal;
using cumulet::test::small_widths;
using cumulet::test::tza_file;
using cumulet::test::TzaBytes;
using Bytes = std::vector<std::uint8_t>;
namespace fs = std::filesystem;

std::string refusal(const Bytes& bytes) {
  return refusal([&] { static_cast<void>(read_tza(bytes, "x.tza")); });
}

std::string network_refusal(const TensorArchive& archive) {
  return refusal([&] { static_cast<void>(make_network(archive, "x.tza")); });
}

// A file with one record of eight halves; its table is at offset 28.
Bytes one(const std::string& name, const std::vector<std::uint32_t>& shape, char type, std::uint64_t offset,
          std::uint32_t count = 1) {
  TzaBytes file;
  file.header(28).values(std::vector<float>(8, 0.25F), 'h').number(count, 4);
  return file.record(name, shape, std::string(shape.size(), 'x'), type, offset).bytes();
}

TEST(TzaArchive, RoundTrips) {
  const TensorArchive archive{{"a", {{2, 3}, "oi", {0.0F, 1.0F, -2.5F, 65504.0F, 6e-8F, 0.1F}}},
                              {"b.c", {{1}, "x", {-3.0F}}}};
  for (const char type : {'h', 'f'}) {
    const TensorArchive read = read_tza(tza_file(archive, type), "x.tza");
    ASSERT_EQ(read.size(), 2U);
    EXPECT_EQ(read.at("a").shape, (std::vector<std::uint32_t>{2, 3}));
    EXPECT_EQ(read.at("a").layout, "oi");
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_NEAR(read.at("a").values.at(i), archive.at("a").values[i], type == 'h' ? 5e-5F : 0.0F);
    }
    EXPECT_EQ(read.at("b.c").values, std::vector<float>{-3.0F});
  }
}

TEST(TzaArchive, InvalidFilesGiveAOneLineError) {
  EXPECT_EQ(refusal(Bytes{}), "x.tza: is not a tensor archive (.tza) of Open Image Denoise");
  EXPECT_EQ(refusal(Bytes{'P', 'K', 3, 4}), "x.tza: is not a tensor archive (.tza) of Open Image Denoise");
  EXPECT_EQ(refusal(Bytes{0xD7, 0x41, 2, 0}), "x.tza: is truncated: incomplete header");
  EXPECT_EQ(refusal(TzaBytes().number(0x41D7, 2).number(1, 1).number(0, 9).bytes()),
            "x.tza: is a tensor archive of version 1, not 2");
  EXPECT_EQ(refusal(TzaBytes().header(13).bytes()), "x.tza: is truncated: no tensor table");
  EXPECT_EQ(refusal(TzaBytes().header(~std::uint64_t{0}).bytes()), "x.tza: is truncated: no tensor table");
  EXPECT_EQ(refusal(TzaBytes().header(12).bytes()), "x.tza: is truncated: incomplete tensor table");
  EXPECT_EQ(refusal(one("a", {8}, 'h', 12)), "");
  EXPECT_EQ(refusal(one("a", {8}, 'h', 12, 2)), "x.tza: is truncated: incomplete tensor table");
  EXPECT_EQ(refusal(one("a", {8}, 'h', 12, ~0U)), "x.tza: is truncated: incomplete tensor table");
  EXPECT_EQ(refusal(one("a", {}, 'h', 12)), "x.tza: tensor 'a' has 0 dimensions");
  EXPECT_EQ(refusal(one("a", std::vector<std::uint32_t>(5, 1), 'h', 12)), "x.tza: tensor 'a' has 5 dimensions");
  EXPECT_EQ(refusal(one("a\nb", {8}, 'd', 12)),
            "x.tza: tensor 'a b' has a data type other than half ('h') or float ('f')");
  EXPECT_EQ(refusal(one("a", {8, 0}, 'h', 12)), "x.tza: tensor 'a' is empty");
  EXPECT_EQ(refusal(one("a", {80}, 'h', 12)), "x.tza: tensor 'a' exceeds the end of the file");
  EXPECT_EQ(refusal(one("a", {8}, 'h', ~std::uint64_t{0})), "x.tza: tensor 'a' exceeds the end of the file");
  const std::uint32_t many = ~0U;
  EXPECT_EQ(refusal(one("a", {many, many, many, many}, 'f', 12)), "x.tza: tensor 'a' exceeds the end of the file");
  EXPECT_EQ(refusal(one("a", {65536, 65536, 65536, 65536}, 'h', 12)), "x.tza: tensor 'a' exceeds the end of the file");
}

TEST(TzaArchive, SmallFileDoesNotAllocateMuchMemory) {
  TzaBytes file;
  constexpr std::size_t numbers = 1000;
  file.header(12 + 2 * numbers).values(std::vector<float>(numbers, 1.0F), 'h').number(100, 4);
  for (int i = 0; i < 100; ++i) file.record(std::to_string(i), {numbers}, "x", 'h', 12);
  EXPECT_EQ(refusal(file.bytes()), "x.tza: tensor '1' overlaps another tensor");
}

TEST(TzaArchive, NonFiniteValuesAndInvalidNamesAreRejected) {
  for (const float value : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    for (const char type : {'h', 'f'}) {
      EXPECT_EQ(refusal(tza_file({{"a", {{2}, "x", {1.0F, value}}}}, type)),
                "x.tza: tensor 'a' contains a non-finite value");
    }
  }
  TzaBytes file;
  file.header(16).values({1.0F, 1.0F}, 'h').number(2, 4).record("a", {1}, "x", 'h', 12);
  EXPECT_EQ(refusal(file.record("a", {1}, "x", 'h', 14).bytes()), "x.tza: tensor 'a' occurs twice");
}

TEST(TzaArchive, ReadsFilesByPath) {
  const cumulet::test::Folder folder;
  const std::string missing = (folder / "none.tza").string();
  const auto message = [](const std::string& path) { return refusal([&] { static_cast<void>(read_tza(path)); }); };
  EXPECT_EQ(message(missing), missing + ": No such file or directory");
  EXPECT_TRUE(message(folder.path().string()).starts_with(folder.path().string() + ": "));
  EXPECT_EQ(message("/dev/zero"), "/dev/zero: is larger than 64 MiB, the maximum for a network");
  const std::string path = (folder / "a.tza").string();
  const Bytes bytes = tza_file({{"a", {{2}, "x", {1.0F, 2.0F}}}});
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  EXPECT_EQ(read_tza(path).at("a").values, (std::vector<float>{1.0F, 2.0F}));
}

// Damaged files: for any bytes, the reader returns tensors of the declared sizes or a one-line error.
TEST(TzaArchive, DamagedFilesAreReadOrGiveAOneLineError) {
  cumulet::test::NetworkWidths narrow;
  narrow.fill(1);
  narrow.back() = 3;
  const Bytes whole = tza_file(random_archive(narrow, 3));
  ASSERT_TRUE(make_network(read_tza(whole, "x.tza"), "x.tza"));
  const auto check = [](const Bytes& bytes) {
    try {
      for (const auto& [name, tensor] : read_tza(bytes, "x.tza")) {
        std::size_t count = 1;
        for (const std::uint32_t extent : tensor.shape) count *= extent;
        EXPECT_EQ(tensor.values.size(), count);
      }
      static_cast<void>(make_network(read_tza(bytes, "x.tza"), "x.tza"));
    } catch (const Error& error) {
      const std::string line = error.what();
      EXPECT_TRUE(line.starts_with("x.tza: ") && line.find_first_of("\n\r") == std::string::npos) << line;
    }
  };
  for (std::size_t size = 0; size < whole.size(); ++size)
    check({whole.begin(), whole.begin() + static_cast<int>(size)});
  std::mt19937 random(3);
  for (int i = 0; i < 20000; ++i) {
    Bytes bytes = whole;
    const int changes = 1 + static_cast<int>(random() % 4);
    for (int j = 0; j < changes; ++j) {
      // Mostly in the table, where each byte matters.
      const std::size_t from = i % 4 == 0 ? 0 : bytes.size() / 2;
      const std::uint8_t odd[] = {0, 1, 0x7F, 0x80, 0xFF, static_cast<std::uint8_t>(random())};
      bytes[from + random() % (bytes.size() - from)] = odd[random() % 6];
    }
    check(bytes);
  }
}

TEST(DenoiserNetwork, ConvolutionsMatchItsTensors) {
  for (const std::uint32_t inputs : {3U, 9U}) {
    const TensorArchive archive = random_archive(base_widths, inputs);
    const NetworkPtr network = make_network(archive, "x.tza");
    EXPECT_EQ(network->inputs, inputs);
    const auto& convolutions = network->convolutions;
    EXPECT_EQ(convolutions[13].name, "dec_conv1a");
    EXPECT_EQ(convolutions[13].inputs, 64 + inputs);
    EXPECT_EQ(convolutions[13].weights, archive.at("dec_conv1a.weight").values);
    EXPECT_EQ(convolutions[7].inputs, 160U);
    EXPECT_EQ(convolutions[7].level, 3U);
    EXPECT_EQ(convolutions[15].biases.size(), 3U);
    // Upper bound of the receptive radius: filter radii at all levels and the offsets inside pooled blocks.
    unsigned reach = (1U << 4U) - 1;
    for (const auto& convolution : convolutions) reach += 1U << convolution.level;
    EXPECT_LE(reach, cumulet::denoise::Network::reach);
  }
  EXPECT_NEAR(make_network(random_archive(base_widths, 9), "x")->multiply_adds(), 125e3, 15e3);
  EXPECT_LT(make_network(random_archive(small_widths, 9), "x")->multiply_adds(), 75e3);
}

TEST(DenoiserNetwork, MissingOrMisshapenTensorsAreNamed) {
  const auto changed = [](const std::function<void(TensorArchive&)>& change) {
    TensorArchive archive = random_archive(small_widths, 9);
    change(archive);
    return network_refusal(archive);
  };
  EXPECT_EQ(changed([](TensorArchive&) {}), "");
  EXPECT_EQ(network_refusal({}), "x.tza: has no tensor 'enc_conv0.weight'");
  EXPECT_EQ(changed([](TensorArchive& a) { a.erase("dec_conv2b.bias"); }), "x.tza: has no tensor 'dec_conv2b.bias'");
  EXPECT_EQ(changed([](TensorArchive& a) { a["enc_conv3.weight"].layout = "hwio"; }),
            "x.tza: tensor 'enc_conv3.weight' is not laid out as oihw");
  EXPECT_EQ(changed([](TensorArchive& a) {
              a["dec_conv1a.weight"] = {{32, 35, 3, 3}, "oihw", {}};
            }),
            "x.tza: tensor 'dec_conv1a.weight' is 32x35x3x3, not 32x41x3x3");
  EXPECT_EQ(changed([](TensorArchive& a) {
              a["dec_conv1a.bias"] = {{31}, "x", {}};
            }),
            "x.tza: tensor 'dec_conv1a.bias' is 31, not 32");
  EXPECT_EQ(changed([](TensorArchive& a) {
              a["enc_conv0.weight"] = {{32, 6, 3, 3}, "oihw", {}};
            }),
            "x.tza: tensor 'enc_conv0.weight' is 32x6x3x3, not with 3 or 9 inputs");
  EXPECT_EQ(changed([](TensorArchive& a) {
              a["dec_conv0.weight"] = {{4, 32, 3, 3}, "oihw", {}}, a["dec_conv0.bias"] = {{4}, "x", {}};
            }),
            "x.tza: tensor 'dec_conv0.weight' is 4x32x3x3, not with 3 outputs");
  EXPECT_EQ(changed([](TensorArchive& a) {
              a["enc_conv0.weight"] = {{4000000000U, 9, 3, 3}, "oihw", {}};
            }),
            "x.tza: tensor 'enc_conv0.weight' is 4000000000x9x3x3, not with at most 512 outputs");
}

TEST(DenoiserNetwork, ReadsThePublishedNetworks) {
  const fs::path data = CUMULET_SHARED_DATA "/oidn_weights";
  if (!fs::exists(data)) GTEST_SKIP() << "no " << data;
  int count = 0;
  for (const auto& entry : fs::directory_iterator(data)) {
    if (entry.path().extension() != ".tza") continue;
    ++count;
    const std::string path = entry.path().string();
    const NetworkPtr network = make_network(read_tza(path), path);
    const bool guided = path.find("nrm.") != std::string::npos || path.find("nrm_small") != std::string::npos;
    EXPECT_EQ(network->inputs, guided && path.find("rt_nrm") == std::string::npos ? 9U : 3U) << path;
  }
  EXPECT_GT(count, 0);
}

}  // namespace
