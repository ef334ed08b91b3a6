#pragma once

// Parses command lines of cumulet-render.

#include <gtest/gtest.h>

#include <options.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace cumulet::test {

using Arguments = std::vector<std::string>;

/// Adds the required arguments.
inline Arguments with(const Arguments& more) {
  Arguments all = {"--volume", "cloud.vdb", "-o", "out.png"};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

inline void expect_rgb(const float (&rgb)[3], float r, float g, float b) {
  EXPECT_FLOAT_EQ(rgb[0], r);
  EXPECT_FLOAT_EQ(rgb[1], g);
  EXPECT_FLOAT_EQ(rgb[2], b);
}

/// Parses these arguments and the required ones.
inline demo::RenderOptions parse(const Arguments& more) {
  std::ostringstream out;
  auto options = demo::parse_render_options(with(more), out);
  if (!options) throw std::logic_error("help instead of options");
  EXPECT_EQ(out.str(), "");
  return *options;
}

/// The error message for these arguments, "" if they are valid.
inline std::string usage_error(const Arguments& all) {
  std::ostringstream out;
  try {
    static_cast<void>(demo::parse_render_options(all, out));
    return "";
  } catch (const demo::UsageError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error.what();
  }
}

}  // namespace cumulet::test
