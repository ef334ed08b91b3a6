#pragma once

// Volumes of the C API, and calls that make them or fail.

#include <cumulet/cumulet.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

#include "viewer/c_handles.hpp"
#include "volume/volume.hpp"

#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

namespace cumulet::test {

struct Release {
  void operator()(cumulet_volume* volume) const { cumulet_volume_release(volume); }
};
using Volume = std::unique_ptr<cumulet_volume, Release>;

inline const volume::ScalarVolume& inside(const Volume& volume) { return volume->asset->volume(); }

/// Runs a call that must succeed.
template <class Call>
Volume made(Call&& call) {
  cumulet_volume* volume = nullptr;
  char error[256] = "not touched";
  EXPECT_EQ(call(&volume, error, sizeof error), CUMULET_OK) << error;
  EXPECT_STREQ(error, "");
  EXPECT_NE(volume, nullptr);
  return Volume(volume);
}

/// Runs a call that must fail with this status and a one-line message, which it returns.
template <class Call>
std::string refused(cumulet_status status, Call&& call) {
  int dummy = 0;
  auto* volume = reinterpret_cast<cumulet_volume*>(&dummy);
  char error[256] = "";
  EXPECT_EQ(call(&volume, error, sizeof error), status) << error;
  EXPECT_EQ(volume, nullptr) << error;
  const std::string line = error;
  EXPECT_FALSE(line.empty());
  EXPECT_EQ(line.find_first_of("\n\r\t"), std::string::npos) << line;
  volume = reinterpret_cast<cumulet_volume*>(&dummy);
  EXPECT_EQ(call(&volume, nullptr, 0), status);  // without a buffer
  EXPECT_EQ(volume, nullptr);
  return line;
}

}  // namespace cumulet::test
