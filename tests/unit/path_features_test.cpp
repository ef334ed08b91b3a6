// The programs that follow from the features of a picture are variants that the shaders declare.

#include "render/film/path_features.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <string>
#include <vector>

#include "gl/shader_sources.hpp"
#include "shader_macros.hpp"

namespace {

namespace gl = cumulet::gl;
using namespace cumulet::render;
using cumulet::scene::March;
using Macros = std::vector<std::string>;

std::string text_of(const gl::ProgramKey& key) {
  std::string text = key.name;
  for (const std::string& define : key.defines) text += ", " + define;
  return text;
}

bool is_declared(const gl::ProgramKey& key) {
  const gl::Shader* shader = gl::find_shader(key.name);
  return shader != nullptr && shader->has_variant(key.defines);
}

// Returns the first program of a picture that is not declared; empty: all are.
std::string undeclared(const PathFeatures& features) {
  std::vector<gl::ProgramKey> keys{trace_key(features)};
  if (features.has_stages()) {
    const StageKeys stages = stage_keys(features);
    keys = {stages.begin, stages.travel, stages.intersect, stages.shade, stages.camera};
  }
  for (const gl::ProgramKey& key : keys) {
    if (!is_declared(key)) return text_of(key);
  }
  return {};
}

// Features as path_features() may return them.
bool is_possible(const PathFeatures& f) {
  const bool emitting = f.triangles == PathTriangles::emitting;
  if ((f.volume_holdout || f.motion || f.grid.clipped) && !f.grid.several) return false;
  if (!f.anisotropic && (f.ground_or_disk || f.grid.several || f.second_lobe)) return false;
  if (!f.ground_or_disk && f.shadow_catcher) return false;
  if (!f.shadow_catcher && (f.grid.several || f.layered != Layered::no || f.has_stages() || f.channels ||
                            f.analytic_lights || f.separate_volume_aov || f.light_groups > 0))
    return false;
  if (f.clear_surfaces && f.extended_bsdf == 0) return false;
  if (!f.has_stages() && (f.extended_bsdf > 0 || f.model_holdout)) return false;
  if (f.has_stages() && !emitting && (f.extended_bsdf > 0 || f.light_groups > 0)) return false;
  return !f.equiangular || (f.analytic_lights && !f.separate_volume_aov && f.extended_bsdf == 0 && !f.volume_holdout &&
                            !f.model_holdout && (f.has_stages() || f.layered == Layered::no));
}

TEST(PathFeatures, NeedOnlyDeclaredVariants) {
  int pictures = 0;
  for (const bool several : {false, true}) {
    for (const PathTriangles triangles : {PathTriangles::none, PathTriangles::hit, PathTriangles::emitting}) {
      for (unsigned bits = 0; bits < 1U << 18U; ++bits) {
        const auto bit = [&](unsigned i) { return (bits >> i & 1U) != 0; };
        PathFeatures features;
        features.grid = {March::dense, false, 1, false, several, false, bit(14)};
        features.layered = bit(0) ? Layered::within : Layered::no;
        features.triangles = triangles;
        features.light_groups = bit(1) ? 2 : 0;
        features.second_lobe = bit(2);
        features.channels = bit(3);
        features.environment = bit(4);
        features.analytic_lights = bit(5);
        features.equiangular = bit(6);
        features.extended_bsdf = bit(7) ? (bit(15) ? 2 : 1) : 0;
        features.clear_surfaces = bit(16);
        features.volume_holdout = bit(8);
        features.model_holdout = bit(9);
        features.motion = bit(10);
        features.separate_volume_aov = bit(11);
        features.ground_or_disk = !bit(12);
        features.anisotropic = !bit(13);
        features.shadow_catcher = !bit(17);
        if (!is_possible(features)) continue;
        ASSERT_EQ(undeclared(features), "");
        ++pictures;
      }
    }
  }
  EXPECT_GT(pictures, 1000);
}

TEST(PathFeatures, NeedOnlyDeclaredVariantsForEachGrid) {
  std::vector<GridFeatures> grids;
  for (const bool linear : {false, true}) {
    for (const std::size_t pages : {1, 2, 6}) grids.push_back({March::tet, linear, pages, false, false});
    grids.push_back({March::tet, linear, 6, true, false});
    for (const bool clipped : {false, true}) {
      for (const bool wide : {false, true}) grids.push_back({March::tet, linear, 6, wide, true, false, clipped});
    }
  }
  for (const bool wide : {false, true}) {
    for (const bool several : {false, true}) grids.push_back({March::tet, true, 6, wide, several, true});
  }
  for (const March march : {March::dense, March::brick}) {
    for (const bool linear : {false, true}) {
      for (const bool several : {false, true}) grids.push_back({march, linear, 1, false, several});
    }
  }
  for (const GridFeatures& grid : grids) {
    for (const bool motion : {false, true}) {
      if (motion && !grid.several) continue;
      PathFeatures features;
      features.grid = grid;
      features.motion = motion;
      EXPECT_EQ(undeclared(features), "");
      features.triangles = PathTriangles::hit;
      EXPECT_EQ(undeclared(features), "");
    }
  }
}

TEST(PathFeatures, PlainPathsLeaveOutUnusedGroundsAndDisks) {
  PathFeatures features;
  features.grid = {March::tet, true, 1, false, false};
  const std::string general = text_of(trace_key(features));
  EXPECT_EQ(general, "trace.comp, CM_MARCH 0, CM_LINEAR 1, CM_PAGES 1");
  features.shadow_catcher = false;
  EXPECT_EQ(text_of(trace_key(features)), general + ", CM_SHADOW_CATCHER 0");
  features.ground_or_disk = false;
  EXPECT_EQ(text_of(trace_key(features)), general + ", CM_GROUND 0, CM_SUN_DISK 0");
  features.anisotropic = false;
  EXPECT_EQ(text_of(trace_key(features)), general + ", CM_GROUND 0, CM_SUN_DISK 0, CM_ISOTROPIC 1");
}

TEST(PathFeatures, MacrosOfAGridHaveOneOrder) {
  EXPECT_EQ(grid_macros({March::tet, true, 6, true, true}, true),
            (Macros{"CM_MARCH 0", "CM_LINEAR 1", "CM_PAGES 6", "CM_INSTANCES 1", "CM_MOTION 1", "CM_WIDE 1"}));
  EXPECT_EQ(grid_macros({March::tet, true, 6, false, false, true}),
            (Macros{"CM_MARCH 0", "CM_LINEAR 2", "CM_PAGES 6"}));
  EXPECT_EQ(grid_macros({March::brick, false, 1, false, false}), (Macros{"CM_MARCH 2", "CM_LINEAR 0", "CM_PAGES 1"}));
}

TEST(ShaderMacros, HaveANameAndAValue) {
  EXPECT_EQ(gl::macros::halves(true), "CM_HALVES 1");
  EXPECT_EQ(gl::macros::surfaces(2), "CM_SURFACES 2");
  EXPECT_EQ(gl::macros::encode("false"), "CM_ENCODE false");
}

}  // namespace
