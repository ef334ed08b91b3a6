// Cryptomatte: ids, and coverages compared with closed forms.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "base/murmur_hash.hpp"
#include "support/c_viewer.hpp"

namespace {

using namespace cumulet::test;
using cumulet::headless::Backend;
using cumulet::headless::Context;

constexpr std::uint32_t side = 16;
constexpr std::size_t count = std::size_t{side} * side;
constexpr std::size_t middle = count / 2 + side / 2;

// From the algorithm's own test vectors and from files of other renderers.
TEST(CryptomatteId, IsMurmurHash3) {
  EXPECT_EQ(cumulet::murmur_hash_3(""), 0U);
  EXPECT_EQ(cumulet::murmur_hash_3("a"), 0x3c2569b2U);
  EXPECT_EQ(cumulet::murmur_hash_3("test"), 0xba6bd213U);
  EXPECT_EQ(cumulet::murmur_hash_3("hello"), 0x248bfa47U);
  EXPECT_EQ(cumulet::murmur_hash_3("hello, world"), 0x149bbb7fU);
  EXPECT_EQ(cumulet::murmur_hash_3("Hello, world!"), 0xc0363e43U);
  EXPECT_EQ(cumulet::murmur_hash_3("The quick brown fox jumps over the lazy dog"), 0x2e4ff723U);
  EXPECT_EQ(cumulet::murmur_hash_3("crypto_object") >> 4U, 0xf834d0aU) << "a well-known layer's";
  EXPECT_EQ(cumulet_cryptomatte_id("bunny"), 0x13851a76U);
  EXPECT_EQ(cumulet_cryptomatte_id("default"), 0x42c9679fU);
  EXPECT_EQ(cumulet_cryptomatte_id("/GAFFERBOT/C_torso_GRP/C_head_GRP/C_head_CPT/C_head001_REN"), 4226998693U);
  EXPECT_EQ(cumulet_cryptomatte_id("\xc3\xa4\xf0\x9f\x90\xb0"), cumulet::cryptomatte_id("\u00e4\U0001f430")) << "bytes";
}

TEST(CryptomatteId, IsAFiniteFloat) {
  EXPECT_EQ(cumulet::murmur_hash_3("n17"), 0x000738c5U) << "a denormal number";
  EXPECT_EQ(cumulet_cryptomatte_id("n17"), 0x008738c5U);
  EXPECT_EQ(cumulet::murmur_hash_3("n535"), 0xff8d97efU) << "no number";
  EXPECT_EQ(cumulet_cryptomatte_id("n535"), 0xff0d97efU);
  EXPECT_EQ(cumulet_cryptomatte_id(""), 0x00800000U);
  EXPECT_EQ(cumulet_cryptomatte_id(nullptr), 0U);
  for (int i = 0; i < 20000; ++i) {
    const std::uint32_t id = cumulet::cryptomatte_id(std::string("n").append(std::to_string(i)));
    ASSERT_EQ(std::fpclassify(std::bit_cast<float>(id)), FP_NORMAL) << i;
  }
}

struct Told {
  cumulet_object_kind kind;
  std::uint64_t tag;
  std::uint32_t transform_index;
  bool operator==(const Told&) const = default;
};

// A rectangle at z = 0 between these x, taller than the view.
SurfacesRef make_wall(float from, float to, float coverage = 1.0F) {
  constexpr float far = 400.0F;
  const std::array<float, 18> corners{from, -far, 0, to, -far, 0, to, far, 0, from, -far, 0, to, far, 0, from, far, 0};
  auto mesh = make_desc<cumulet_mesh_desc>();
  mesh.positions = corners.data();
  mesh.vertex_count = 6;
  mesh.double_sided = 1;
  const std::array<float, 4> grey{0.5F, 0.5F, 0.5F, coverage};
  std::ranges::copy(grey, mesh.base_color);
  return make_surfaces({&mesh, 1});
}

// 8 x 8 x 8 voxels of value 1 around the origin.
VolumeRef make_block() {
  const std::vector<float> values(512, 1.0F);
  auto desc = make_desc<cumulet_dense_desc>();
  desc.values = values.data();
  desc.value_count = values.size();
  for (int& edge : desc.size) edge = 8;
  for (int i = 0; i < 4; ++i) desc.index_to_world[i * 5] = 1.0;
  for (int i = 0; i < 3; ++i) desc.index_to_world[12 + i] = -3.5;
  return make_dense(desc);
}

// One pixel per unit. The origin is between pixels 7 and 8, and +x is to the right.
class Cryptomatte : public CViewerTest {
 protected:
  Cryptomatte() : CViewerTest(side, side) {}
  void SetUp() override {
    CViewerTest::SetUp();
    if (!IsSkipped()) look(side);
  }

  void look(double height) {
    auto stand = make_desc<cumulet_camera_desc>();
    stand.eye[2] = 50.0;
    stand.orthographic_height = height;
    cumulet::test::look(v_, stand);
  }
  ModelRef add_model(cumulet_surfaces* surfaces, std::uint64_t tag, cumulet_model_desc desc = {}) {
    desc.struct_size = sizeof desc;
    desc.surfaces = surfaces;
    desc.tag = tag;
    cumulet_model* made = nullptr;
    EXPECT_EQ(cumulet_model_create(&desc, &made, nullptr, 0), CUMULET_OK);
    EXPECT_EQ(cumulet_add_model(v_, made), CUMULET_OK);
    return ModelRef(made);
  }
  InstanceRef add_instance(cumulet_volume* volume, std::uint64_t tag, double density_scale, double z,
                           bool holdout = false) {
    auto medium = make_desc<cumulet_medium_desc>();
    medium.density_scale = density_scale;
    medium.holdout = holdout ? 1 : 0;
    auto desc = make_desc<cumulet_instance_desc>();
    desc.volume = volume;
    desc.medium = &medium;
    std::ranges::copy(at(0.0, 0.0, z), desc.to_world);
    desc.tag = tag;
    InstanceRef made = cumulet::test::make_instance(desc);
    EXPECT_EQ(cumulet_add_instance(v_, made.get()), CUMULET_OK);
    return made;
  }
  void march(cumulet_grid_type march) {
    auto grid = make_desc<cumulet_grid_desc>();
    grid.type = march;
    grid.cells = CUMULET_CELLS_CONSTANT;
    grid.criterion = CUMULET_CRITERION_DEVIATION;
    grid.threshold = 1e-6F;
    grid.interpolation = CUMULET_INTERPOLATION_NEAREST;
    ASSERT_EQ(cumulet_set_grid(v_, &grid), CUMULET_OK);
  }

  /// Pairs of an id and a coverage; names_ gives the names.
  std::vector<std::pair<std::uint32_t, float>> read(std::uint32_t ranks) {
    asked_.clear();
    const auto name = [](void* user, cumulet_object_kind kind, std::uint64_t tag, std::uint32_t transform_index) {
      auto& test = *static_cast<Cryptomatte*>(user);
      test.asked_.push_back({kind, tag, transform_index});
      double noise = 0.0;
      EXPECT_NE(cumulet_measure_noise(test.v_, &noise), CUMULET_OK) << "from within";
      const auto found = test.names_.find({kind, tag});
      return found == test.names_.end() ? nullptr : found->second.c_str();
    };
    std::vector<float> values(count * 2 * ranks, -1.0F);
    EXPECT_EQ(cumulet_read_cryptomatte(v_, name, this, ranks, values.data(), values.size()), CUMULET_OK)
        << cumulet_last_error(v_);
    std::vector<std::pair<std::uint32_t, float>> pairs;
    for (std::size_t i = 0; i < values.size(); i += 2)
      pairs.emplace_back(std::bit_cast<std::uint32_t>(values[i]), values[i + 1]);
    return pairs;
  }
  /// Coverage of this name at each pixel.
  std::vector<float> coverage(const char* name) {
    std::vector<float> coverages(count, 0.0F);
    const auto pairs = read(6);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      EXPECT_EQ(pairs[i].first == 0U, pairs[i].second == 0.0F) << i;
      if (pairs[i].first == cumulet_cryptomatte_id(name)) coverages[i / 6] += pairs[i].second;
    }
    return coverages;
  }

  std::map<std::pair<cumulet_object_kind, std::uint64_t>, std::string> names_;
  std::vector<Told> asked_;
};
CUMULET_ON_BACKENDS(Cryptomatte);

TEST_P(Cryptomatte, CoverageOfAWall) {
  const SurfacesRef wall = make_wall(-400.0F, 0.25F);
  ASSERT_EQ(cumulet_set_surfaces(v_, wall.get()), CUMULET_OK);
  names_[{CUMULET_OBJECT_SURFACES, 0}] = "wall";
  make();
  const std::vector<float> covered = coverage("wall");
  EXPECT_EQ(asked_, (std::vector<Told>{{CUMULET_OBJECT_SURFACES, 0, 0}})) << "there is no volume";
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t x = i % side;
    if (x == 8) {
      EXPECT_NEAR(covered[i], 0.25F, 0.02F) << i;
    } else {
      EXPECT_NEAR(covered[i], x < 8 ? 1.0F : 0.0F, 1e-5F) << i;
    }
  }
  // Coverage by stochastic alpha.
  const SurfacesRef veil = make_wall(-400.0F, 400.0F, 0.5F);
  ASSERT_EQ(cumulet_set_surfaces(v_, veil.get()), CUMULET_OK);
  make();
  double mean = 0.0;
  for (const float share : coverage("wall")) mean += double(share) / count;
  EXPECT_NEAR(mean, 0.5, 0.02);
}

// Along the ray: the other volume, both, the first volume, then a wall.
TEST_P(Cryptomatte, CoverageOfOverlappingVolumes) {
  constexpr double one = 0.1;
  constexpr double other = 0.3;
  const VolumeRef block = make_block();
  const SurfacesRef wall = make_wall(-400.0F, 400.0F);
  auto desc = make_desc<cumulet_model_desc>();
  std::ranges::copy(at(0.0, 0.0, -20.0), desc.to_world);
  const ModelRef model = add_model(wall.get(), 7, desc);
  ASSERT_EQ(cumulet_set_volume(v_, block.get()), CUMULET_OK);
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = one;
  ASSERT_EQ(cumulet_set_medium(v_, &medium), CUMULET_OK);
  const InstanceRef instance = add_instance(block.get(), 5, other, 4.0);
  names_ = {{{CUMULET_OBJECT_VOLUME, 0}, "one"},
            {{CUMULET_OBJECT_VOLUME, 5}, "other"},
            {{CUMULET_OBJECT_SURFACES, 7}, "wall"}};
  const double first = std::exp(-4.0 * other);
  const double both = std::exp(-4.0 * (one + other));
  const double last = std::exp(-4.0 * one);
  const double of_other = 1.0 - first + first * (1.0 - both) * other / (one + other);
  const double of_one = first * (1.0 - both) * one / (one + other) + first * both * (1.0 - last);
  for (const cumulet_grid_type kind : {CUMULET_GRID_TETRAHEDRAL, CUMULET_GRID_DENSE, CUMULET_GRID_BRICKS}) {
    SCOPED_TRACE(kind);
    march(kind);
    make();
    EXPECT_NEAR(coverage("one")[middle], of_one, 2e-5);
    EXPECT_NEAR(coverage("other")[middle], of_other, 2e-5);
    EXPECT_NEAR(coverage("wall")[middle], first * both * last, 2e-5);
    EXPECT_NEAR(coverage("wall")[0], 1.0, 1e-5) << "beside them";
    const auto pairs = read(6);
    for (std::size_t rank = 1; rank < 6; ++rank)
      EXPECT_LE(pairs[middle * 6 + rank].second, pairs[middle * 6 + rank - 1].second);
  }
  EXPECT_EQ(asked_.size(), 3U);
}

// The coverages add up to the sampled alpha.
TEST_P(Cryptomatte, AddsUpToAlpha) {
  const VolumeRef ball = make_ball(16, 0.3F);
  ASSERT_EQ(cumulet_set_volume(v_, ball.get()), CUMULET_OK);
  const SurfacesRef panes = make_panes(4.0F);
  ASSERT_EQ(cumulet_set_surfaces(v_, panes.get()), CUMULET_OK);
  auto ground = make_desc<cumulet_ground_desc>();
  ground.mode = CUMULET_GROUND_AT_HEIGHT;
  ground.height = -6.0;
  ASSERT_EQ(cumulet_set_ground(v_, &ground), CUMULET_OK);
  auto stand = make_desc<cumulet_camera_desc>();
  stand.eye[1] = 3.0;
  stand.eye[2] = 40.0;
  cumulet::test::look(v_, stand);
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 128;
  sampling.preview = CUMULET_PREVIEW_OFF;
  ASSERT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK);
  names_ = {{{CUMULET_OBJECT_VOLUME, 0}, "ball"},
            {{CUMULET_OBJECT_SURFACES, 0}, "panes"},
            {{CUMULET_OBJECT_GROUND, 0}, "ground"}};
  make();
  const std::vector<float> alpha = aov(CUMULET_AOV_BEAUTY, 4);
  const auto pairs = read(6);
  std::map<std::uint32_t, double> sums;
  for (std::size_t i = 0; i < count; ++i) {
    double sum = 0.0;
    for (std::size_t rank = 0; rank < 6; ++rank) {
      sum += double(pairs[6 * i + rank].second);
      sums[pairs[6 * i + rank].first] += double(pairs[6 * i + rank].second);
    }
    EXPECT_NEAR(sum, double(alpha[4 * i + 3]), 0.2) << i;
    sums[1] += sum - double(alpha[4 * i + 3]);
  }
  EXPECT_NEAR(sums[1] / count, 0.0, 0.01);
  for (const auto& [key, name] : names_) EXPECT_GT(sums[cumulet_cryptomatte_id(name.c_str())], 1.0) << name;
  EXPECT_EQ(sums.size(), 5U) << "these, none, and how far the sum is off";
}

// Instances with one name share one matte. Hidden objects are excluded. A holdout occludes and has no matte.
TEST_P(Cryptomatte, ObjectsWithOneNameShareAMatte) {
  const VolumeRef block = make_block();
  constexpr double extinction = 0.05;
  const InstanceRef near = add_instance(block.get(), 1, extinction, 10.0);
  const InstanceRef far = add_instance(block.get(), 2, extinction, -10.0);
  names_ = {{{CUMULET_OBJECT_VOLUME, 1}, "smoke"},
            {{CUMULET_OBJECT_VOLUME, 2}, "smoke"},
            {{CUMULET_OBJECT_VOLUME, 3}, "hole"},
            {{CUMULET_OBJECT_SURFACES, 4}, "wall"}};
  march(CUMULET_GRID_DENSE);
  make();
  EXPECT_NEAR(coverage("smoke")[middle], 1.0 - std::exp(-16.0 * extinction), 2e-5);
  EXPECT_EQ(read(6)[6 * middle + 1].first, 0U) << "one matte";
  EXPECT_EQ(asked_, (std::vector<Told>{{CUMULET_OBJECT_VOLUME, 1, 0}, {CUMULET_OBJECT_VOLUME, 2, 0}}));
  const InstanceRef hole = add_instance(block.get(), 3, extinction, 0.0, true);
  make();
  EXPECT_NEAR(coverage("smoke")[middle], (1.0 - std::exp(-8.0 * extinction)) * (1.0 + std::exp(-16.0 * extinction)),
              2e-5);
  EXPECT_EQ(asked_.size(), 2U) << "of a hole nothing is asked";
  ASSERT_EQ(cumulet_remove_instance(v_, hole.get()), CUMULET_OK);
  // Hidden.
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = extinction;
  auto desc = make_desc<cumulet_instance_desc>();
  desc.volume = block.get();
  desc.medium = &medium;
  desc.tag = 2;
  desc.hidden = 1;
  ASSERT_EQ(cumulet_instance_set(far.get(), &desc), CUMULET_OK);
  make();
  EXPECT_NEAR(coverage("smoke")[middle], 1.0 - std::exp(-8.0 * extinction), 2e-5);
  EXPECT_EQ(asked_.size(), 1U);
  // Models: a holdout, one that is invisible to cameras, and one without a name.
  const SurfacesRef wall = make_wall(-400.0F, 400.0F);
  for (const bool holdout : {true, false}) {
    auto model = make_desc<cumulet_model_desc>();
    std::ranges::copy(at(0.0, 0.0, 3.0), model.to_world);
    (holdout ? model.holdout : model.shadow_only) = 1;
    const ModelRef made = add_model(wall.get(), 4, model);
    make();
    EXPECT_EQ(coverage("wall")[middle], 0.0F);
    EXPECT_GT(coverage("smoke")[middle], 0.1F);
    EXPECT_EQ(asked_.size(), 1U);
    ASSERT_EQ(cumulet_remove_model(v_, made.get()), CUMULET_OK);
  }
  const ModelRef nameless = add_model(wall.get(), 9);
  make();
  EXPECT_EQ(read(6)[6 * middle].first, cumulet_cryptomatte_id("smoke"));
  EXPECT_EQ(read(6)[6 * middle + 1].first, 0U);
  EXPECT_EQ(asked_.size(), 2U);
}

TEST_P(Cryptomatte, InstancesOfTheVolumeAreSeparate) {
  const VolumeRef block = make_block();
  ASSERT_EQ(cumulet_set_volume(v_, block.get()), CUMULET_OK);
  std::vector<double> transforms;
  for (const double x : {-4.0, 4.0}) {
    const auto transform = at(x, 0.0, 0.0);
    transforms.insert(transforms.end(), transform.begin(), transform.end());
  }
  ASSERT_EQ(cumulet_set_volume_transforms(v_, transforms.data(), 2), CUMULET_OK);
  names_[{CUMULET_OBJECT_VOLUME, 0}] = "block";
  make();
  const std::vector<float> covered = coverage("block");
  EXPECT_EQ(asked_, (std::vector<Told>{{CUMULET_OBJECT_VOLUME, 0, 0}, {CUMULET_OBJECT_VOLUME, 0, 1}}));
  EXPECT_NEAR(covered[middle - 2], covered[middle + 1], 1e-4F);
  EXPECT_GT(covered[middle + 1], 0.9F);
}

std::string strip_name(std::uint64_t width) { return std::string("strip ").append(std::to_string(width)); }

// A pixel with strips of widths 1, 2, ... 8: the smallest are dropped, and the rest is exact.
TEST_P(Cryptomatte, KeepsTheLargestCoverages) {
  look(side * 36.0);
  std::vector<SurfacesRef> strips;
  std::vector<ModelRef> models;
  float from = 0.0F;
  for (std::uint64_t i = 1; i <= 8; ++i) {
    const float to = from + static_cast<float>(i);
    strips.push_back(make_wall(from, to));
    models.push_back(add_model(strips.back().get(), i));
    names_[{CUMULET_OBJECT_SURFACES, i}] = strip_name(i);
    from = to;
  }
  make();
  const auto all = read(16);
  for (const std::uint32_t ranks : {1U, 5U, 6U}) {
    const auto some = read(ranks);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t rank = 0; rank < ranks; ++rank) ASSERT_EQ(some[i * ranks + rank], all[i * 16 + rank]) << i;
    }
  }
  const auto* const pixel = &all[16 * middle];
  double sum = 0.0;
  for (std::uint64_t width = 1; width <= 8; ++width) {
    const std::uint32_t id = cumulet_cryptomatte_id(strip_name(width).c_str());
    const auto* const found = std::find_if(pixel, pixel + 16, [&](const auto& rank) { return rank.first == id; });
    ASSERT_NE(found, pixel + 16) << width;
    EXPECT_NEAR(double(found->second), double(width) / 36.0, 0.025) << width;
    sum += double(found->second);
  }
  EXPECT_NEAR(sum, 1.0, 1e-5);
  for (std::size_t rank = 1; rank < 16; ++rank) EXPECT_LE(pixel[rank].second, pixel[rank - 1].second);
  EXPECT_EQ(pixel[8], std::pair(0U, 0.0F));
}

// An edge that moves over eight pixels during the shutter interval covers each for its fraction of that time.
TEST_P(Cryptomatte, CoverageIsAveragedOverTheShutter) {
  const SurfacesRef wall = make_wall(-400.0F, 0.0F);
  auto desc = make_desc<cumulet_model_desc>();
  std::ranges::copy(at(-4.0, 0.0, 0.0), desc.open_to_world);
  std::ranges::copy(at(4.0, 0.0, 0.0), desc.close_to_world);
  const ModelRef model = add_model(wall.get(), 1, desc);
  names_[{CUMULET_OBJECT_SURFACES, 1}] = "wall";
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 4;
  sampling.preview = CUMULET_PREVIEW_OFF;
  sampling.shutter_seconds = 0.02F;
  ASSERT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK);
  make();
  const std::vector<float> covered = coverage("wall");
  for (std::size_t x = 0; x < side; ++x) {
    const double expected = std::clamp((11.5 - double(x)) / 8.0, 0.0, 1.0);
    EXPECT_NEAR(double(covered[count / 2 + x]), expected, 0.04) << x;
  }
}

TEST_P(Cryptomatte, InvalidInputGivesAOneLineError) {
  std::vector<float> values(count * 2);
  const auto name = [](void*, cumulet_object_kind, std::uint64_t, std::uint32_t) { return "a"; };
  const auto read = [&](std::uint32_t ranks, std::size_t room) {
    return cumulet_read_cryptomatte(v_, name, nullptr, ranks, values.data(), room);
  };
  EXPECT_EQ(read(1, values.size()), CUMULET_ERROR_INVALID_ARGUMENT) << "before the first picture";
  const VolumeRef block = make_block();
  ASSERT_EQ(cumulet_set_volume(v_, block.get()), CUMULET_OK);
  make();
  EXPECT_EQ(read(1, values.size()), CUMULET_OK);
  EXPECT_EQ(read(1, values.size() - 1), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(cumulet_last_error(v_), "the image needs 512 floats");
  EXPECT_EQ(read(0, values.size()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(read(17, values.size()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_read_cryptomatte(v_, nullptr, nullptr, 1, values.data(), values.size()),
            CUMULET_ERROR_INVALID_ARGUMENT);
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.view = CUMULET_VIEW_CELLS;
  ASSERT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK);
  make();
  EXPECT_EQ(read(1, values.size()), CUMULET_ERROR_INVALID_ARGUMENT);
}

}  // namespace
