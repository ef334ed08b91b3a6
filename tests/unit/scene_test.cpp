#include <gtest/gtest.h>
#include <openvdb/tools/Count.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "mesh.hpp"
#include "scene.hpp"
#include "support/folder.hpp"
#include "support/gltf_check.hpp"
#include "surface/bvh_rays.hpp"
#include "surface/winding.hpp"
#include "surfaces.hpp"

namespace {

using namespace cumulet;

openvdb::FloatGrid::Ptr cumulus(double voxels, std::uint32_t seed = 1) {
  openvdb::initialize();
  return scene::make_cumulus({voxels, seed});
}

bool same(const openvdb::FloatGrid& a, const openvdb::FloatGrid& b) {
  if (a.activeVoxelCount() != b.activeVoxelCount()) return false;
  auto accessor = b.getConstAccessor();
  for (auto i = a.cbeginValueOn(); i; ++i) {
    if (accessor.getValue(i.getCoord()) != *i) return false;
  }
  return true;
}

TEST(Cumulus, IsIdenticalForAnyThreadCount) {
  openvdb::FloatGrid::Ptr one;
  {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 1);
    one = cumulus(60000);
  }
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 4);
  EXPECT_TRUE(same(*one, *cumulus(60000)));
  EXPECT_FALSE(same(*one, *cumulus(60000, 2)));
}

TEST(Cumulus, HasTheRequestedVoxelCountAndShape) {
  const auto grid = cumulus(100000);
  EXPECT_EQ(grid->getName(), "density");
  EXPECT_EQ(grid->getGridClass(), openvdb::GRID_FOG_VOLUME);
  const auto count = static_cast<double>(grid->activeVoxelCount());
  EXPECT_GT(count, 60000);
  EXPECT_LT(count, 180000);
  double top = 0.0;
  double bottom = 0.0;
  double mass = 0.0;
  for (auto i = grid->cbeginValueOn(); i; ++i) {
    ASSERT_TRUE(std::isfinite(*i));
    ASSERT_GT(*i, 0.0F);
    ASSERT_LE(*i, 1.0F);
    const auto p = grid->indexToWorld(i.getCoord());
    mass += *i;
    (p.y() > 25.0 ? top : bottom) += *i;
    ASSERT_GT(p.y(), -3.0);
  }
  // Wider below than above, flat at the base.
  EXPECT_GT(bottom, top);
  const double voxel = grid->voxelSize().x();
  // In meters: opaque through the middle (tens of optical depths), but not solid.
  const double mean_depth = mass * voxel * voxel * voxel / (75.0 * 45.0);
  EXPECT_GT(mean_depth, 5.0);
  EXPECT_LT(mean_depth, 80.0);
}

TEST(Cumulus, GainsDetailWithResolution) {
  // Active voxels with an inactive neighbor: their number grows faster than that of a smooth shape.
  const auto border = [](const openvdb::FloatGrid& grid) {
    auto accessor = grid.getConstAccessor();
    double n = 0.0;
    for (auto i = grid.cbeginValueOn(); i; ++i) {
      const openvdb::Coord c = i.getCoord();
      bool edge = false;
      for (int axis = 0; axis < 3; ++axis) {
        openvdb::Coord step(0);
        step[axis] = 1;
        edge = edge || !accessor.isValueOn(c + step) || !accessor.isValueOn(c - step);
      }
      n += edge ? 1.0 : 0.0;
    }
    return n * grid.voxelSize().x() * grid.voxelSize().x();
  };
  EXPECT_GT(border(*cumulus(400000)), 1.12 * border(*cumulus(50000)));
}

struct Burning {
  double soot = 0.0;    // voxels
  double height = 0.0;  // of the soot's center
  double width = 0.0;
  double hottest = 0.0;
  double flames = 0.0;
};

Burning burning(int frame) {
  openvdb::initialize();
  const auto grids = scene::make_explosion({60000, 1}, frame);
  Burning found;
  std::vector<std::string> names;
  for (const auto& grid : grids) names.push_back(grid->getName());
  EXPECT_EQ(names, std::vector<std::string>({"density", "temperature", "flame"}));
  double low = 1e9;
  double high = -1e9;
  for (auto i = grids[0]->cbeginValueOn(); i; ++i) {
    EXPECT_TRUE(*i > 0.0F && *i <= 1.0F) << *i;
    const auto p = grids[0]->indexToWorld(i.getCoord());
    EXPECT_GT(p.y(), 0.0) << "the ground";
    found.soot += 1.0;
    found.height += p.y();
    low = std::min(low, p.x());
    high = std::max(high, p.x());
  }
  found.height /= found.soot;
  found.width = high - low;
  for (auto i = grids[1]->cbeginValueOn(); i; ++i) found.hottest = std::max(found.hottest, double{*i});
  for (auto i = grids[2]->cbeginValueOn(); i; ++i) {
    EXPECT_TRUE(*i > 0.0F && *i <= 1.0F) << *i;
    found.flames += 1.0;
  }
  return found;
}

TEST(Explosion, ExpandsRisesAndCools) {
  const Burning early = burning(3);
  const Burning middle = burning(scene::shown_frame);
  const Burning late = burning(scene::explosion_frames);
  EXPECT_GT(early.hottest, 1.2) << "1800 K";
  EXPECT_LT(early.hottest, 1.7);
  EXPECT_GT(early.hottest, middle.hottest);
  EXPECT_GT(middle.hottest, late.hottest);
  EXPECT_GT(late.hottest, 0.7) << "it glows in its cracks to the end";
  EXPECT_LT(2.0 * early.width, middle.width);
  EXPECT_LT(early.height + 1.0, middle.height);
  EXPECT_LT(middle.height + 1.0, late.height);
  EXPECT_GT(early.flames / early.soot, 2.0 * late.flames / late.soot);
  EXPECT_GT(late.flames, 0.0) << "no frame has an empty grid";
  EXPECT_NEAR(late.soot, 60000.0, 20000.0);
}

TEST(Explosion, IsIdenticalForAnyThreadCount) {
  openvdb::initialize();
  std::vector<openvdb::FloatGrid::Ptr> one;
  {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 1);
    one = scene::make_explosion({30000, 1}, 7);
  }
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 4);
  const auto four = scene::make_explosion({30000, 1}, 7);
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_TRUE(same(*one[i], *four[i])) << one[i]->getName();
  EXPECT_FALSE(same(*one[0], *scene::make_explosion({30000, 2}, 7)[0]));
  EXPECT_THROW((void)scene::make_explosion({30000, 1}, 0), std::runtime_error);
  EXPECT_THROW((void)scene::make_explosion({30000, 1}, 21), std::runtime_error);
}

// The mountains as imported, and the names of their nodes.
class Mountains : public testing::Test {
 protected:
  Mountains() {
    const test::Folder folder;
    const std::filesystem::path file = folder / "mountains.glb";
    std::ofstream(file, std::ios::binary) << glb_;
    const Log log([this](LogLevel level, const char* line) {
      if (level >= LogLevel::warning) warnings_.emplace_back(line);
    });
    scene_ = surface::import_gltf(file.string(), log);
    pose_ = scene_->pose(0.0);
    std::uint32_t length = 0;
    std::memcpy(&length, glb_.data() + 12, sizeof length);
    json_ = nlohmann::json::parse(glb_.substr(20, length));
  }

  [[nodiscard]] std::optional<std::uint32_t> node(const char* name) const {
    for (std::uint32_t i = 0; i < json_["nodes"].size(); ++i) {
      if (json_["nodes"][i]["name"] == name) return i;
    }
    return std::nullopt;
  }

  // Positions of the triangles of a node, or of one material of it, in file order.
  [[nodiscard]] std::vector<glm::vec3> points(const char* name, const surface::Pose& pose,
                                              const std::string& material = "") const {
    std::vector<glm::vec3> found;
    for (const surface::Draw& draw : scene_->draws) {
      if (draw.node != node(name)) continue;
      if (!material.empty() && scene_->materials[draw.material].name != material) continue;
      for (std::size_t i = 0; i < draw.index_count; ++i) {
        found.push_back(pose.vertices[scene_->indices[draw.first_index + i]].position);
      }
    }
    return found;
  }

  std::string glb_ = scene::make_surfaces(1);
  nlohmann::json json_;
  std::vector<std::string> warnings_;
  surface::ScenePtr scene_;
  surface::Pose pose_;
};

TEST_F(Mountains, AreDeterministic) {
  EXPECT_TRUE(glb_ == scene::make_surfaces(1));
  EXPECT_FALSE(glb_ == scene::make_surfaces(2));
  EXPECT_LT(glb_.size(), 20000000U);
}

TEST(Mesh, PartsFaceOutward) {
  scene::Mesh mesh;
  mesh.box({1, 2, 3}, {1, 2, 3}, 0.3F);
  const auto area = [&] { return surface::detail::winding_of(mesh.position, mesh.index).area; };
  EXPECT_NEAR(area(), 88.0, 1e-3);
  mesh.bar({9, 0, 0}, {9, 5, 0}, 0.5F);
  mesh.bar({9, 9, 0}, {12, 7, 4}, 0.5F);
  mesh.turned({-9, 0, 0}, {{0.0F, 0.0F}, {2.0F, 1.0F}, {0.0F, 3.0F}}, 12);
  EXPECT_GT(area(), 88.0 + 12.0 + 12.0 + 10.0);
  EXPECT_EQ(surface::detail::winding_of(mesh.position, mesh.index).inward, 0.0);
  // The normals agree with the winding.
  for (std::size_t i = 0; i + 2 < mesh.index.size(); i += 3) {
    const auto at = [&](std::size_t k) { return mesh.position[mesh.index[i + k]]; };
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_GT(glm::dot(glm::cross(at(1) - at(0), at(2) - at(0)), mesh.normal[mesh.index[i + k]]), 0.0F);
    }
  }
}

// From around the tower, the first hit is always a front face. From above it may not be, because the roofs are
// overhanging sheets.
TEST_F(Mountains, FaceTheCamera) {
  std::vector<std::uint32_t> flags(scene_->triangle_count(), 0);  // rays hit back faces too
  const surface::Bvh bvh = surface::Bvh::build(pose_.vertices, scene_->indices, flags);
  core::BvhRays rays{&bvh};
  const auto corner = [&](std::size_t triangle, std::size_t k) {
    return pose_.vertices[scene_->indices[3 * triangle + k]].position;
  };
  EXPECT_EQ(pose_.flipped, std::vector<std::uint8_t>(scene_->draws.size(), 0));
  std::vector<bool> building(scene_->triangle_count(), false);
  std::vector<surface::Draw> draws;
  for (const surface::Draw& draw : scene_->draws) {
    if (draw.node != node("Tower") && draw.node != node("Station") && draw.node != node("Lantern")) continue;
    std::fill_n(building.begin() + draw.first_index / 3, draw.index_count / 3, true);
    draws.push_back(draw);
  }
  std::size_t seen = 0;
  std::size_t backs = 0;
  for (const surface::Draw& draw : draws) {
    for (std::size_t t = draw.first_index / 3; t < (draw.first_index + draw.index_count) / 3; ++t) {
      const glm::vec3 target = (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3.0F;
      for (int way = 0; way < 5; ++way) {
        const float angle = 1.2566371F * static_cast<float>(way) + 0.1F * static_cast<float>(t);
        const glm::vec3 back = glm::normalize(glm::vec3(std::cos(angle), 1.2F, std::sin(angle)));
        core::BvhRays::CmHit hit{};
        if (!rays.cm_bvh_closest(target + 120.0F * back, -back, 0.0F, 121.0F, hit)) continue;
        if (!building[hit.triangle]) continue;  // the ground may hide it, seen from within
        ++seen;
        const glm::vec3 normal = glm::cross(corner(hit.triangle, 1) - corner(hit.triangle, 0),
                                            corner(hit.triangle, 2) - corner(hit.triangle, 0));
        backs += glm::dot(normal, back) < 0.0F ? 1 : 0;
      }
    }
  }
  EXPECT_GT(seen, 10000U);
  // Except for windows, flat in front of a slanted wall: some are seen edge-on from behind. Inverted winding would give
  // about a half.
  EXPECT_LT(200 * backs, seen);
}

TEST_F(Mountains, AreImportedWithoutAWarning) {
  EXPECT_EQ(warnings_, std::vector<std::string>());
  EXPECT_EQ(test::broken(*scene_), "");
  EXPECT_EQ(test::broken(*scene_, pose_), "");
  for (const char* name : {"Terrain", "Forest", "Lake", "Tower", "Station", "Lantern"}) {
    EXPECT_FALSE(points(name, pose_).empty()) << name;
  }
  bool glows = false;
  bool metal = false;
  for (const surface::Material& material : scene_->materials) {
    glows = glows || material.emission.x > 1.0F;
    metal = metal || material.metallic == 1.0F;
  }
  EXPECT_TRUE(glows);
  EXPECT_TRUE(metal);
  // Requirements of glTF for writers that the importer does not check.
  for (const nlohmann::json& mesh : json_["meshes"]) {
    for (const nlohmann::json& primitive : mesh["primitives"]) {
      const nlohmann::json& positions = json_["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
      ASSERT_EQ(positions["min"].size(), 3U);
      ASSERT_EQ(positions["max"].size(), 3U);
      EXPECT_EQ(positions["count"], json_["accessors"][primitive["attributes"]["NORMAL"].get<std::size_t>()]["count"]);
    }
  }
  EXPECT_EQ(json_["extensionsUsed"], nlohmann::json({"KHR_materials_emissive_strength"}));
}

TEST_F(Mountains, ContainTheSceneFilesCameraAndARotatingLantern) {
  ASSERT_EQ(pose_.cameras.size(), 1U);
  const surface::SceneCamera& camera = pose_.cameras[0];
  const scene::View view;
  EXPECT_NEAR(camera.vertical_fov, glm::radians(view.fovy_degrees), 1e-6);
  EXPECT_LT(glm::distance(glm::dvec3(camera.to_world[3]), glm::dvec3(view.eye)), 1e-6);
  const glm::dvec3 ahead = glm::normalize(glm::dvec3(view.target) - glm::dvec3(view.eye));
  EXPECT_LT(glm::distance(-glm::dvec3(camera.to_world[2]), ahead), 1e-5);

  ASSERT_EQ(scene_->animations.size(), 1U);
  EXPECT_DOUBLE_EQ(scene_->animations[0].duration, 6.0);
  const surface::Pose later = scene_->pose(1.5);
  const std::vector<glm::vec3> before = points("Lantern", pose_);
  const std::vector<glm::vec3> after = points("Lantern", later);
  // A quarter turn about the tower: +X moves to -Z.
  for (std::size_t i = 0; i < before.size(); ++i) {
    const glm::vec3 from = before[i] - scene::tower_foot;
    const glm::vec3 to = after[i] - scene::tower_foot;
    ASSERT_LT(glm::distance(to, glm::vec3(from.z, from.y, -from.x)), 1e-3F);
  }
  EXPECT_EQ(points("Tower", pose_), points("Tower", later));
}

TEST_F(Mountains, ReachIntoTheCloud) {
  const auto cloud = cumulus(100000);
  auto accessor = cloud->getConstAccessor();
  const auto density = [&](const glm::vec3& p) {
    return accessor.getValue(openvdb::Coord::round(cloud->worldToIndex(openvdb::Vec3d(p.x, p.y, p.z))));
  };
  const openvdb::CoordBBox voxels = cloud->evalActiveVoxelBoundingBox();
  const openvdb::Vec3d low = cloud->indexToWorld(voxels.min());
  const openvdb::Vec3d high = cloud->indexToWorld(voxels.max());

  glm::vec3 bottom(1e9F);
  glm::vec3 top(-1e9F);
  int covered = 0;
  const std::vector<glm::vec3> tower = points("Tower", pose_);
  for (const glm::vec3& p : tower) {
    bottom = glm::min(bottom, p);
    top = glm::max(top, p);
    covered += density(p) > 0.1F ? 1 : 0;
  }
  EXPECT_GT(bottom.x, low.x());
  EXPECT_LT(top.x, high.x());
  EXPECT_GT(bottom.z, low.z());
  EXPECT_LT(top.z, high.z());
  EXPECT_LT(bottom.y, low.y());
  const std::vector<glm::vec3> roofs = points("Tower", pose_, "copper");
  ASSERT_FALSE(roofs.empty());
  for (const glm::vec3& p : roofs) {
    ASSERT_GT(p.y, low.y());
    ASSERT_LT(p.y, high.y());
  }
  // A part of the tower is in the cloud, its top and foot are outside.
  EXPECT_GT(covered, static_cast<int>(tower.size() / 20));
  EXPECT_LT(covered, static_cast<int>(tower.size() / 2));

  // The ground is level below the tower, and reaches up into the cloud elsewhere.
  int level = 0;
  int clouded = 0;
  for (const glm::vec3& p : points("Terrain", pose_)) {
    clouded += density(p) > 0.1F ? 1 : 0;
    if (glm::distance(glm::vec2(p.x, p.z), glm::vec2(scene::tower_foot.x, scene::tower_foot.z)) > 8.0F) continue;
    EXPECT_NEAR(p.y, scene::tower_foot.y, 0.1F);
    ++level;
  }
  EXPECT_GT(level, 100);
  EXPECT_GT(clouded, 100);
}

}  // namespace
