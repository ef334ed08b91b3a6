#pragma once

// For tests that write VDB files and read them back.

#include <openvdb/openvdb.h>

#include <string>
#include <vector>

#include "base/log.hpp"

#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

namespace cumulet::test {

struct Messages {
  std::vector<std::string> warnings;
  std::vector<std::string> hints;  ///< of level info
  Log log{[this](LogLevel level, const char* text) {
    if (level == LogLevel::warning) warnings.emplace_back(text);
    if (level == LogLevel::info) hints.emplace_back(text);
  }};
};

inline openvdb::FloatGrid::Ptr fog(const std::string& name, float background = 0.0F) {
  auto grid = openvdb::FloatGrid::create(background);
  grid->setName(name);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  return grid;
}

}  // namespace cumulet::test
