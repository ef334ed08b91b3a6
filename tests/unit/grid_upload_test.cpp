// Grids of a set share buffers. Shaders find each grid's data for any neighbors and any number of pages, and grids that
// are already uploaded are not uploaded again.

#include "render/scene/march_data.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <random>
#include <string>

#include "base/error.hpp"
#include "gl/bindings.hpp"
#include "render/film/path_features.hpp"
#include "support/fake_gl.hpp"
#include "support/gl_compute.hpp"
#include "support/gl_state.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::uvec4;
using render::Deadline;
using render::MarchData;
using render::MarchUpload;
using scene::MarchSourcePtr;
using Sources = MarchUpload::Sources;
using Words = std::vector<uvec4>;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  std::uint32_t operator()() { return static_cast<std::uint32_t>(engine_()); }
  // Random data of a record type. Shaders read its bits unchanged.
  template <class T>
  std::vector<T> records(std::size_t count) {
    std::vector<T> all(count);
    for (T& record : all) {
      std::array<std::uint32_t, (sizeof(T) + 3) / 4> words{};
      for (std::uint32_t& word : words)
        word = (*this)() & 0xbfffffffU;  // floats that are not NaN, because drivers change NaN bits
      std::memcpy(static_cast<void*>(&record), words.data(), sizeof record);
    }
    return all;
  }

 private:
  std::mt19937 engine_;
};

struct Sizes {
  std::size_t cells = 0, emission = 0, glowing = 0, color = 0, anisotropy = 0, velocity = 0, tree = 1, corners = 0;
};

MarchSourcePtr source_of(const Sizes& sizes, unsigned seed) {
  Random random(seed);
  auto grid = std::make_shared<grid::TetGrid>();
  grid->cells = random.records<grid::CellRecord>(sizes.cells);
  grid->channels.emission = random.records<grid::EmissionRecord>(sizes.emission);
  grid->channels.color = random.records<std::uint32_t>(sizes.color);
  grid->channels.anisotropy = random.records<std::int16_t>(sizes.anisotropy);
  grid->channels.velocity = random.records<glm::uvec2>(sizes.velocity);
  grid->tree = random.records<std::uint32_t>(sizes.tree);
  grid->corners = random.records<uvec4>(sizes.corners);
  for (grid::RootEntry& root : grid->roots) root = {random(), random()};
  grid->levels = seed;
  grid->content_min = glm::vec3(static_cast<float>(seed));
  grid->content_max = grid->content_min + 5.0F;
  auto source = std::make_shared<scene::MarchSource>();
  source->emissive.cells = random.records<scene::GlowingCell>(sizes.glowing);
  source->trilinear = !grid->corners.empty();
  source->grid = std::move(grid);
  source->linear = true;
  return source;
}

// A grid's cells, channels, tree and roots as shaders read them, in the order of `kinds`.
constexpr std::array kinds{"records",  "emission", "glow",  "colour", "anisotropy",
                           "velocity", "tree",     "roots", "corners"};
std::array<Words, kinds.size()> expected_of(const MarchSourcePtr& source) {
  const grid::TetGrid& grid = *source->grid;
  std::array<Words, kinds.size()> words;
  for (const grid::CellRecord& cell : grid.cells) words[0].insert(words[0].end(), {cell.links, cell.data});
  // If a grid has none, data() may be null, which memcpy does not allow.
  const auto copy_words = [](Words& to, const void* from, std::size_t count) {
    to.resize(count);
    if (count > 0) std::memcpy(to.data(), from, count * sizeof to.front());
  };
  copy_words(words[1], grid.channels.emission.data(), grid.channels.emission.size());
  copy_words(words[2], source->emissive.cells.data(), source->emissive.cells.size() * 2);
  for (const std::uint32_t word : grid.channels.color) words[3].emplace_back(word, 0, 0, 0);
  for (const std::int16_t half : grid.channels.anisotropy)
    words[4].emplace_back(static_cast<std::uint16_t>(half), 0, 0, 0);
  for (const glm::uvec2& halves : grid.channels.velocity) words[5].emplace_back(halves, 0, 0);
  for (const std::uint32_t word : grid.tree) words[6].emplace_back(word, 0, 0, 0);
  for (const grid::RootEntry& root : grid.roots) words[7].emplace_back(root.first_leaf, root.first_internal, 0, 0);
  words[8] = grid.corners;
  return words;
}

class GridSetUploads : public test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (IsSkipped()) return;
    fake_ = std::make_unique<test::FakeGl>(headless::Context::get_proc, context_.get());
    gl_ = gl::load_functions(test::FakeGl::get_proc, fake_.get());
    heap_ = std::make_unique<gl::WordHeap>(gl_, gl::WordHeap::Sizes{});
  }
  void TearDown() override {
    heap_.reset();
    GlTest::TearDown();
    gl_.reset();
  }

  MarchData upload(const Sources& sources, std::int64_t page_texels, const MarchData* before = nullptr) {
    MarchUpload work(gl_, gl::query_limits(*gl_), *heap_, sources, before, page_texels);
    while (!work.advance(Deadline::min())) {
    }
    return work.take();
  }

  // Reads the data with a compute shader that uses the library's accessors.
  Words read(const MarchData& data, const core::CmGrid& grid, std::size_t kind, std::size_t count) {
    std::string text = "#version 450\nlayout(local_size_x = 64) in;\n#define CM_CHANNELS 1\n#define CM_VELOCITY 1\n";
    for (const std::string& define : render::grid_macros(render::grid_features(data, false)))
      text += "#define " + define + "\n";
    for (const char* file : {"common/shared.glsl", "common/bindings.glsl", "common/parameters.glsl", "grid/cell.glsl",
                             "common/buffers.glsl"})
      text += test::glsl_file(file);
    const std::array<const char*, kinds.size()> values{
        "cm_record(i >> 1, i & 1u)",
        "cm_emission_record(i)",
        "cm_emissive_word(i)",
        "uvec4(cm_color_record(i), 0u, 0u, 0u)",
        "uvec4((cm_anisotropy_record(i) >> (16u * (i & 1u))) & 65535u, 0u, 0u, 0u)",
        "uvec4(cm_velocity_record(i), 0u, 0u)",
        "uvec4(cm_tree(i), 0u, 0u, 0u)",
        "uvec4(cm_root_leaf(i), cm_root_node(i), 0u, 0u)",
        "cm_corners_record(i)"};
    text += "layout(std430, binding = 0) buffer Words { uvec4 words[]; };\nvoid main() {\n";
    text += "  uint i = gl_GlobalInvocationID.x;\n  if (i < uint(words.length())) words[i] = ";
    text += std::string(values[kind]) + ";\n}\n";
    const gl::Object program = test::compute_program(gl_, text);
    core::CmParameters parameters{};
    parameters.grid = grid;
    Words words(count);
    const gl::Object uniforms = gl::make_buffer(gl_, sizeof parameters, &parameters, 0, "parameters");
    const gl::Object out = gl::make_buffer(gl_, count * sizeof(uvec4), words.data(), 0, "words");
    gl_->UseProgram(program.name());
    data.bind(*gl_);
    gl_->BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_PARAMETERS, uniforms.name());
    gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, out.name());
    gl_->DispatchCompute(static_cast<GLuint>((count + 63) / 64), 1, 1);
    gl_->MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl_->GetNamedBufferSubData(out.name(), 0, static_cast<GLsizeiptr>(count * sizeof(uvec4)), words.data());
    return words;
  }

  void expect_whole(const MarchData& data, const Sources& sources, const std::string& what) {
    ASSERT_EQ(data.size(), sources.size());
    for (std::size_t s = 0; s < sources.size(); ++s) {
      const core::CmGrid* grid = data.grid(*sources[s]);
      ASSERT_EQ(grid, &data.grid(s));
      EXPECT_EQ(grid->levels, sources[s]->grid->levels);
      EXPECT_EQ(grid->box_min, sources[s]->grid->content_min);
      EXPECT_EQ(grid->box_max, sources[s]->grid->content_max);
      EXPECT_EQ(grid->glowing, sources[s]->emissive.cells.size());
      EXPECT_EQ(grid->moves, sources[s]->grid->channels.velocity.empty() ? 0U : 1U);
      const auto expected = expected_of(sources[s]);
      for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
        if (expected[kind].empty()) continue;
        const Words found = read(data, *grid, kind, expected[kind].size());
        const auto wrong = std::ranges::mismatch(found, expected[kind]);
        EXPECT_EQ(wrong.in1 - found.begin(), static_cast<std::ptrdiff_t>(found.size()))
            << what << ", grid " << s << ": " << kinds[kind];
      }
    }
  }

  std::uint64_t bytes_of(const MarchSourcePtr& source) { return upload({source}, 0).bytes(); }

  std::unique_ptr<test::FakeGl> fake_;
  std::unique_ptr<gl::WordHeap> heap_;
  // Odd sizes: inside one page, across two, and at the end of the last.
  const MarchSourcePtr plain_ = source_of({.cells = 1900, .tree = 301}, 1);
  const MarchSourcePtr colored_ = source_of(
      {.cells = 301, .emission = 301, .glowing = 31, .color = 301, .anisotropy = 301, .velocity = 301, .tree = 99}, 2);
  const MarchSourcePtr glowing_ = source_of({.cells = 399, .emission = 250, .glowing = 3, .tree = 1}, 3);
  const MarchSourcePtr other_ = source_of({.cells = 333, .color = 333, .tree = 55}, 4);
  const Sources three_{plain_, colored_, glowing_};
};
CUMULET_ON_BACKENDS(GridSetUploads);

constexpr std::int64_t one_page = 0;
constexpr std::int64_t three_pages = 2048;  // of 1024 cells
constexpr std::int64_t six_pages = 1024;

std::string pages_of(const MarchData& data) { return render::grid_macros(render::grid_features(data, false)).at(2); }

TEST_P(GridSetUploads, ShadersReadEachGrid) {
  for (const auto& [texels, pages] :
       {std::pair(one_page, "CM_PAGES 1"), std::pair(three_pages, "CM_PAGES 6"), std::pair(six_pages, "CM_PAGES 6")}) {
    const MarchData data = upload(three_, texels);
    EXPECT_EQ(pages_of(data), pages);
    expect_whole(data, three_, pages);
    const MarchData reversed = upload({glowing_, colored_, plain_}, texels);
    expect_whole(reversed, {glowing_, colored_, plain_}, std::string(pages) + " reversed");
    EXPECT_EQ(data.bytes(), bytes_of(plain_) + bytes_of(colored_) + bytes_of(glowing_));
    EXPECT_EQ(data.grid(*other_), nullptr);
  }
}

TEST_P(GridSetUploads, ReplacingUploadsOnlyNewGrids) {
  for (const std::int64_t from : {one_page, three_pages, six_pages}) {
    for (const std::int64_t to : {one_page, three_pages, six_pages}) {
      const std::string what = std::to_string(from) + " to " + std::to_string(to);
      const MarchData before = upload(three_, from);
      const Sources sources{glowing_, other_, plain_};
      const std::uint64_t uploaded = fake_->uploaded();
      const MarchData after = upload(sources, to, &before);
      const std::uint64_t brought = fake_->uploaded() - uploaded;
      EXPECT_GE(brought, bytes_of(other_) - 15) << what;  // whole texels
      EXPECT_LE(brought, bytes_of(other_)) << what;
      expect_whole(after, sources, what);
      expect_whole(before, three_, what + ", what was before");
      const std::uint64_t copied = fake_->uploaded();
      const MarchData moved = upload({plain_, glowing_, other_}, to, &after);
      EXPECT_EQ(fake_->uploaded(), copied) << what;
      expect_whole(moved, {plain_, glowing_, other_}, what + ", moved");
    }
  }
}

TEST_P(GridSetUploads, ShadersReadTheCornersOfTrilinearCells) {
  const MarchSourcePtr first = source_of({.cells = 1900, .tree = 301, .corners = 1900}, 6);
  const MarchSourcePtr second = source_of(
      {.cells = 301, .emission = 301, .glowing = 31, .color = 301, .anisotropy = 301, .velocity = 301, .corners = 301},
      7);
  const MarchSourcePtr third = source_of({.cells = 333, .corners = 333}, 8);
  const MarchData data = upload({first, second}, one_page);
  EXPECT_EQ(render::grid_macros(render::grid_features(data, false)),
            (std::vector<std::string>{"CM_MARCH 0", "CM_LINEAR 2", "CM_PAGES 6"}));
  expect_whole(data, {first, second}, "two grids");
  const MarchData after = upload({third, second}, one_page, &data);
  expect_whole(after, {third, second}, "another first grid");
  EXPECT_EQ(bytes_of(third), 333U * (32 + 16) + 4 + 52 * 4);
  EXPECT_THROW(upload({first, plain_}, one_page), Error) << "kernels for fits do not read corners";
}

// A set of one grid is laid out as a grid without sets, except for its roots.
TEST_P(GridSetUploads, LargeGridsAreUploadedInPieces) {
  const MarchSourcePtr large = source_of({.cells = 200000, .tree = 200000}, 5);  // 6.4 MB and 0.8 MB
  MarchUpload work(gl_, gl::query_limits(*gl_), *heap_, {plain_, large});
  std::uint64_t most = 0;
  for (bool done = false; !done;) {
    const std::uint64_t before = fake_->uploaded();
    done = work.advance(Deadline::min());
    most = std::max(most, fake_->uploaded() - before);
  }
  EXPECT_EQ(most, render::Upload::piece_bytes);
  const MarchData data = work.take();
  expect_whole(data, {plain_, large}, "large");
  MarchUpload copy(gl_, gl::query_limits(*gl_), *heap_, {large, plain_}, &data);
  int steps = 1;
  while (!copy.advance(Deadline::min())) ++steps;
  EXPECT_GE(steps, 4 + 2 + 3) << "of 2 MiB";
  expect_whole(copy.take(), {large, plain_}, "copied");
}

// Velocity of a voxel grid needs a dense texture of the whole bounds. If it does not fit, a sparse volume is still
// accepted.
TEST_P(GridSetUploads, VelocityIsDroppedIfItDoesNotFit) {
  const auto brick_source = [](int size, bool moves) {
    const volume::ScalarVolume ends =
        test::make_volume(glm::ivec3(8), glm::ivec3(0), [](const glm::ivec3& p) { return p.x == 0 ? 1.0F : 0.5F; });
    auto voxels = std::make_shared<volume::ScalarVolume>(ends);
    voxels->brick_origins.emplace_back((size - 1) & ~7);
    std::vector<float>& values = voxels->brick_values.as_floats();
    values.resize(2 * values.size());
    values[512] = 1.0F;
    voxels->bounds_max = voxels->brick_origins.back();
    const grid::Cube cube = grid::fit_cube(*voxels);
    grid::Channels channels;
    const grid::MomentumField::Values momentum{{*voxels, *voxels, *voxels}, 1.0F};
    if (moves) channels.momentum = std::make_shared<const grid::MomentumField>(momentum, cube);
    auto statistics = std::make_shared<const grid::Statistics>(*voxels, cube);
    return std::make_shared<const scene::MarchSource>(
        scene::make_voxel_source(scene::March::brick, voxels, statistics, channels));
  };
  const auto look = [&](int size, int texture_size) {
    gl::Limits limits = gl::query_limits(*gl_);
    if (texture_size > 0) limits.texture_size_3d = texture_size;
    std::array<std::uint64_t, 2> bytes{};
    std::uint32_t moves = 0;
    for (const bool moving : {false, true}) {
      MarchUpload work(gl_, limits, *heap_, {brick_source(size, moving)});
      while (!work.advance(Deadline::min())) {
      }
      const MarchData data = work.take();
      bytes[moving ? 1 : 0] = data.bytes();
      moves = data.grid().moves;
    }
    EXPECT_EQ(bytes[1] > bytes[0], moves == 1) << size;
    return moves;
  };
  EXPECT_EQ(look(100, 0), 1U);
  EXPECT_EQ(look(100, 64), 0U) << "wider than a texture";
  EXPECT_EQ(look(521, 0), 0U) << "521 cubed is more than 2^27";
}

TEST_P(GridSetUploads, TooLargeGridsAreRejectedByName) {
  const auto refused = [&](const Sources& sources, std::int64_t page_texels) -> std::string {
    try {
      const MarchUpload work(gl_, gl::query_limits(*gl_), *heap_, sources, nullptr, page_texels);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::unsupported);
      return error.what();
    }
    return "taken";
  };
  EXPECT_EQ(refused(three_, 900),
            "2600 cells need more than 6 texture buffers of this driver's GL_MAX_TEXTURE_BUFFER_SIZE, 900 texels");
  EXPECT_EQ(refused({colored_}, 900), "taken");
  EXPECT_EQ(refused({colored_, glowing_}, 800),
            "the channels of 700 cells need more than one texture buffer of this driver's GL_MAX_TEXTURE_BUFFER_SIZE, "
            "800 texels");
  auto constant = std::make_shared<scene::MarchSource>(*plain_);
  constant->linear = false;
  EXPECT_EQ(refused({plain_, constant}, 0), "grids of different types cannot be shown together");
  for (const scene::March march : {scene::March::dense, scene::March::brick}) {
    auto voxels = std::make_shared<scene::MarchSource>();
    voxels->march = march;
    const std::string name = march == scene::March::dense ? "dense" : "brick";
    EXPECT_EQ(refused({voxels, std::make_shared<scene::MarchSource>(*voxels)}, 0),
              "the " + name + " grid type supports one grid, not 2; only tetrahedral grids support several");
    EXPECT_EQ(refused({plain_, voxels}, 0), "grids of different types cannot be shown together");
  }
}

}  // namespace
