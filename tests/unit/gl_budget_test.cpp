// Shares of the GPU memory for volumes, without GL.

#include "stage/gl_budget.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>

namespace {

using cumulet::viewer::Built;
using cumulet::viewer::GlBudget;
using cumulet::viewer::ResourceLimits;

constexpr std::uint64_t no_limit = ResourceLimits::no_limit;
constexpr std::uint64_t gib = std::uint64_t{1} << 30U;
constexpr std::uint64_t step = std::uint64_t{1} << 18U;

class GlBudgetTest : public testing::Test {
 protected:
  GlBudget budget_{std::make_shared<ResourceLimits>()};
};

TEST_F(GlBudgetTest, HasNoLimitAtFirst) {
  EXPECT_FALSE(budget_.is_limited());
  EXPECT_FALSE(budget_.cells_are_due());
  budget_.set_grids(3);
  EXPECT_EQ(budget_.part(), no_limit);
  EXPECT_EQ(budget_.limits().gl_bytes(), no_limit);
}

TEST_F(GlBudgetTest, LimitsAreRenewedOnlyIfTheyDiffer) {
  EXPECT_TRUE(budget_.set_limits(2, no_limit, gib));
  EXPECT_TRUE(budget_.is_limited());
  EXPECT_EQ(budget_.part(), gib);
  EXPECT_FALSE(budget_.set_limits(4, no_limit, gib));
  EXPECT_TRUE(budget_.set_limits(4, gib, gib));
  EXPECT_EQ(budget_.limits().memory_bytes(), gib);
}

TEST_F(GlBudgetTest, CellsAreDueAfterOtherLimits) {
  budget_.set_limits(0, no_limit, gib);
  EXPECT_TRUE(budget_.cells_are_due());
  budget_.note_cells();
  EXPECT_FALSE(budget_.cells_are_due());
  budget_.set_limits(0, no_limit, gib);
  EXPECT_FALSE(budget_.cells_are_due());
}

TEST_F(GlBudgetTest, GridsShareEqually) {
  budget_.set_limits(0, no_limit, gib);
  budget_.set_grids(4);
  EXPECT_EQ(budget_.part(), gib / 4);
  EXPECT_EQ(budget_.limits().gl_bytes(), gib / 4);
  budget_.set_grids(0);
  EXPECT_EQ(budget_.part(), gib);
}

TEST_F(GlBudgetTest, OtherMemoryIsRoundedUp) {
  budget_.set_limits(0, no_limit, gib);
  budget_.set_bytes_beside(1);
  EXPECT_EQ(budget_.limits().gl_bytes(), gib - step);
  budget_.set_bytes_beside(step);
  EXPECT_EQ(budget_.limits().gl_bytes(), gib - step);
  budget_.set_bytes_beside(2 * gib);
  EXPECT_EQ(budget_.limits().gl_bytes(), 0U);
}

TEST_F(GlBudgetTest, TheFirstFrameLimitsGridsOnce) {
  EXPECT_FALSE(budget_.set_bytes_beside(step));
  GlBudget limited(std::make_shared<ResourceLimits>());
  limited.set_limits(0, no_limit, gib);
  EXPECT_TRUE(limited.set_bytes_beside(step));
  EXPECT_FALSE(limited.set_bytes_beside(2 * step));
}

TEST_F(GlBudgetTest, SharesStayWhileImagesVaryALittle) {
  budget_.set_limits(0, no_limit, gib);
  budget_.note_cells();
  budget_.set_bytes_beside(gib / 16);
  budget_.set_grids(1);
  EXPECT_EQ(budget_.part(), gib);
  EXPECT_FALSE(budget_.cells_are_due());
  budget_.set_bytes_beside(gib / 2);
  budget_.set_grids(1);
  EXPECT_EQ(budget_.part(), gib / 2);
  EXPECT_TRUE(budget_.cells_are_due());
}

TEST_F(GlBudgetTest, OnlyGridsOfCellsHaveTooManyCells) {
  budget_.set_limits(0, no_limit, 1);
  EXPECT_FALSE(is_of_cells(Built{}));
  EXPECT_TRUE(budget_.fits(Built{}));
}

}  // namespace
