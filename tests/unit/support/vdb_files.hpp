#pragma once

// For tests that write VDB files and read them back.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/log.hpp"
#include "support/openvdb.hpp"

#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

namespace cumulet::test {

struct Messages {
  std::vector<std::string> warnings;
  std::vector<std::string> hints;  ///< messages of level info
  Log log{[this](LogLevel level, const char* text) {
    if (level == LogLevel::warning) warnings.emplace_back(text);
    if (level == LogLevel::info) hints.emplace_back(text);
  }};
};

/// Returns the error message of reading a file that must fail. Expects one line that begins with the file's name.
template <class Read>
std::string refusal(const std::filesystem::path& file, Read&& read) {
  try {
    read();
  } catch (const Error& e) {
    const std::string what = e.what();
    EXPECT_EQ(e.code(), ErrorCode::file) << what;
    EXPECT_EQ(what.find_first_of("\n\r\t"), std::string::npos) << what;
    EXPECT_EQ(what.rfind(file.string() + ": ", 0), 0U) << what;
    return what;
  }
  ADD_FAILURE() << file << " was accepted";
  return {};
}

inline openvdb::FloatGrid::Ptr fog(const std::string& name, float background = 0.0F) {
  auto grid = openvdb::FloatGrid::create(background);
  grid->setName(name);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  return grid;
}

/// A fog grid of two voxels with different values, so that it is not constant. `value` is the first.
inline openvdb::FloatGrid::Ptr two_voxels(const std::string& name, float value) {
  auto grid = fog(name);
  grid->tree().setValue(openvdb::Coord(1, 2, 3), value);
  grid->tree().setValue(openvdb::Coord(1, 2, 4), 0.5F * value);
  return grid;
}

}  // namespace cumulet::test
