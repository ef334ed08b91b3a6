// Display LUTs of .cube files.

#include <gtest/gtest.h>

#include <cube_lut.hpp>
#include <sstream>
#include <stdexcept>
#include <string>

namespace {

using cumulet::demo::DisplayLut;

DisplayLut read(const std::string& text) {
  std::istringstream file(text);
  return cumulet::demo::read_cube_lut(file, "look.cube");
}

std::string refusal(const std::string& text) {
  try {
    read(text);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no error";
}

const std::string points = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 0 1\n1 0 1\n0 1 1\n1 1 0.5\n";

TEST(CubeLut, AreRead) {
  DisplayLut lut =
      read("# made by hand\r\nTITLE \"a look\"\nLUT_3D_SIZE 2\nDOMAIN_MIN -1 -1 -1\nDOMAIN_MAX 2 2 2\n\n" + points);
  EXPECT_EQ(lut.size, 2U);
  EXPECT_EQ(lut.domain_min, -1.0F);
  EXPECT_EQ(lut.domain_max, 2.0F);
  ASSERT_EQ(lut.values.size(), 24U);
  EXPECT_EQ(lut.values[3], 1.0F);  // red is fastest
  EXPECT_EQ(lut.values[23], 0.5F);
  lut.shaper = CUMULET_LUT_SHAPER_LOG2;
  const cumulet_display_lut_desc desc = cumulet::demo::desc_of(lut);
  EXPECT_EQ(desc.value_count, 24U);
  EXPECT_EQ(desc.shaper, CUMULET_LUT_SHAPER_LOG2);
}

TEST(CubeLut, BadFilesAreOneLine) {
  EXPECT_EQ(refusal(""), "look.cube: it has no LUT_3D_SIZE");
  EXPECT_EQ(refusal("LUT_3D_SIZE 2\n0 0 0\n"), "look.cube: it has 1 points, not 8");
  EXPECT_EQ(refusal("LUT_3D_SIZE 2\n" + points + "1 1 1\n"), "look.cube: it has 9 points, not 8");
  EXPECT_EQ(refusal("LUT_3D_SIZE 2\n0 0\n"), "look.cube: line 2: it does not have three numbers");
  EXPECT_EQ(refusal("LUT_1D_SIZE 16\n"), "look.cube: line 1: 1D LUTs are not supported");
  EXPECT_EQ(refusal("LUT_3D_SIZE\n"), "look.cube: line 1: LUT_3D_SIZE has no number");
  EXPECT_EQ(refusal("LUT_3D_SIZE 2\nDOMAIN_MIN 0 0 0.5\n"), "look.cube: line 2: the domains of the channels differ");
  EXPECT_EQ(refusal("LUT_3D_SIZE 2\nDOMAIN_MIN 1 1 1\n" + points),
            "look.cube: its DOMAIN_MIN is not below its DOMAIN_MAX");
  EXPECT_EQ(refusal("LUT_3D_SIZE 200\n").rfind("look.cube: line 1: LUT_3D_SIZE: ", 0), 0U);
  EXPECT_EQ(refusal("LUT_3D_SIZE 2\n0 nan 0\n").rfind("look.cube: line 2: ", 0), 0U);
  EXPECT_EQ(refusal(std::string("LUT_3D_SIZE 2\n\0", 15)), "look.cube: line 2: it is not a text");
  EXPECT_THROW(static_cast<void>(cumulet::demo::read_cube_lut("no such.cube")), std::runtime_error);
}

}  // namespace
