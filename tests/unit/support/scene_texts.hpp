#pragma once

// Texts of scene files, and the errors of invalid ones.

#include <gtest/gtest.h>

#include <scene_file.hpp>
#include <stdexcept>
#include <string>

namespace cumulet::test {

/// The error message for this text, "" if it is valid.
inline std::string error_of(const std::string& text) {
  try {
    static_cast<void>(demo::parse_scene(text, "dir/s.json"));
    return "";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error.what();
  }
}

/// A scene with one more section.
inline std::string with(const std::string& more) { return R"({"cumulet_scene": 1, )" + more + "}"; }

/// The error message for a scene of version 2 with these sections.
inline std::string section_error(const std::string& sections) {
  return error_of(R"({"cumulet_scene": 2, )" + sections + "}");
}

}  // namespace cumulet::test
