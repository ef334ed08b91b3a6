#include "render/march_data.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <glm/gtc/packing.hpp>
#include <unordered_map>

#include "base/error.hpp"

namespace cumulet::render {

namespace {

using glm::ivec3;
using glm::vec3;

constexpr std::int64_t max_pages = 8;
constexpr GLuint tree_unit = 12;

struct VoxelBox {
  ivec3 low;  // cube space
  ivec3 size;
};

VoxelBox voxel_box(const grid::Statistics& statistics, const volume::ScalarVolume& volume) {
  const ivec3 low = volume.bounds_min - statistics.cube().origin;
  return {low, volume.bounds_max - volume.bounds_min + 1};
}

void require_3d(const gl::Limits& limits, const ivec3& size, const char* what) {
  const int widest = std::max({size.x, size.y, size.z});
  if (widest > limits.texture_size_3d) {
    throw Error(ErrorCode::unsupported, std::string(what) + " needs a 3D texture " + std::to_string(widest) +
                                            " wide; this driver's GL_MAX_3D_TEXTURE_SIZE is " +
                                            std::to_string(limits.texture_size_3d));
  }
}

float relative_scale(const volume::ScalarVolume& volume) {
  return volume.max_value > 0.0F ? 1.0F / volume.max_value : 1.0F;
}

}  // namespace

MarchData MarchData::upload_tet(const gl::FunctionsPtr& gl, const gl::Limits& limits, const grid::TetGrid& grid,
                                bool linear, std::int64_t page_texels) {
  MarchData data;
  data.march_ = March::tet;
  data.linear_ = linear;
  data.box_min_ = grid.content_min;
  data.box_max_ = grid.content_max;
  const auto cells = static_cast<std::int64_t>(grid.cells.size());
  data.cube_ = {static_cast<unsigned>(grid.cube.log2_size - 1), static_cast<unsigned>(cells),
                static_cast<unsigned>(grid.tree.size()), grid.levels};

  const std::int64_t texels = page_texels > 0 ? page_texels : limits.texture_buffer_texels;
  std::int64_t page_cells = texels / 2;
  if (page_cells < cells)
    page_cells = static_cast<std::int64_t>(std::bit_floor(static_cast<std::uint64_t>(page_cells)));
  data.log2_page_cells_ = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(page_cells))) - 1;
  const std::int64_t tree_texels = (static_cast<std::int64_t>(grid.tree.size()) + 3) / 4;
  if (cells > page_cells * max_pages || tree_texels > limits.texture_buffer_texels) {
    throw Error(ErrorCode::unsupported, std::to_string(cells) + " cells need more than " + std::to_string(max_pages) +
                                            " texture buffers of this driver's GL_MAX_TEXTURE_BUFFER_SIZE, " +
                                            std::to_string(texels) + " texels");
  }
  const auto add = [&](const void* bytes, std::size_t size, GLenum format, const char* what) {
    data.buffers_.push_back(gl::make_buffer(gl, size, bytes, 0, what));
    data.bytes_ += size;
    return gl::make_texture_buffer(gl, format, data.buffers_.back(), what);
  };
  for (std::int64_t first = 0; first < cells; first += page_cells) {
    const std::int64_t count = std::min(page_cells, cells - first);
    data.pages_.push_back(add(grid.cells.data() + first, static_cast<std::size_t>(count) * sizeof(grid::CellRecord),
                              GL_RGBA32UI, "uploading cell records"));
  }
  std::vector<std::uint32_t> tree = grid.tree;
  tree.resize(static_cast<std::size_t>(std::max<std::int64_t>(tree_texels, 1)) * 4);
  data.textures_[0] = add(tree.data(), tree.size() * 4, GL_RGBA32UI, "uploading the point-location tree");
  std::array<grid::RootEntry, 26> roots{};
  std::copy(grid.roots.begin(), grid.roots.end(), roots.begin());
  data.roots_ = gl::make_buffer(gl, sizeof(roots), roots.data(), 0, "uploading the root cells");
  data.bytes_ += sizeof(roots);
  return data;
}

MarchData MarchData::upload_dense(const gl::FunctionsPtr& gl, const gl::Limits& limits,
                                  const grid::Statistics& statistics, const volume::ScalarVolume& volume) {
  MarchData data;
  data.march_ = March::dense;
  const VoxelBox box = voxel_box(statistics, volume);
  require_3d(limits, box.size, "the dense march");
  data.box_min_ = vec3(box.low);
  data.box_max_ = vec3(box.low + box.size);
  data.textures_[1] =
      gl::make_texture_3d(gl, GL_R16F, box.size.x, box.size.y, box.size.z, "creating the dense texture");
  const float scale = relative_scale(volume);
  // One layer of bricks at a time: bounded memory.
  const auto row = static_cast<std::size_t>(box.size.x);
  const std::size_t slice = row * static_cast<std::size_t>(box.size.y);
  std::vector<std::uint16_t> slab(slice * volume::brick_size);
  for (int z = box.low.z & ~7; z < box.low.z + box.size.z; z += volume::brick_size) {
    const int first = std::max(z, box.low.z);
    const int last = std::min(z + volume::brick_size, box.low.z + box.size.z);
    const int bricks_y = ((box.low.y + box.size.y + 7) >> 3) - (box.low.y >> 3);
    tbb::parallel_for(0, bricks_y, [&](int by) {
      const int y = ((box.low.y >> 3) + by) * 8;
      for (int x = box.low.x & ~7; x < box.low.x + box.size.x; x += volume::brick_size) {
        const grid::Statistics::Node& node = statistics.node_at({x, y, z});
        const float* values = node.is_uniform() ? nullptr : statistics.values(node);
        const ivec3 from = glm::max(ivec3(x, y, z), box.low);
        const ivec3 to = glm::min(ivec3(x, y, z) + 8, box.low + box.size);
        for (int k = from.z; k < to.z; ++k) {
          for (int j = from.y; j < to.y; ++j) {
            for (int i = from.x; i < to.x; ++i) {
              const float value = values == nullptr ? node.uniform : values[(i & 7) * 64 + (j & 7) * 8 + (k & 7)];
              slab[static_cast<std::size_t>(k - first) * slice + static_cast<std::size_t>(j - box.low.y) * row +
                   static_cast<std::size_t>(i - box.low.x)] = glm::packHalf1x16(value * scale);
            }
          }
        }
      }
    });
    gl->PixelStorei(GL_UNPACK_ALIGNMENT, 2);
    gl->TextureSubImage3D(data.textures_[1].name(), 0, 0, 0, first - box.low.z, box.size.x, box.size.y, last - first,
                          GL_RED, GL_HALF_FLOAT, slab.data());
  }
  gl::check(*gl, "uploading the dense texture");
  data.bytes_ = slice * static_cast<std::size_t>(box.size.z) * 2;
  return data;
}

MarchData MarchData::upload_brick(const gl::FunctionsPtr& gl, const gl::Limits& limits,
                                  const grid::Statistics& statistics, const volume::ScalarVolume& volume) {
  MarchData data;
  data.march_ = March::brick;
  const VoxelBox box = voxel_box(statistics, volume);
  data.box_min_ = vec3(box.low);
  data.box_max_ = vec3(box.low + box.size);
  const ivec3 first = box.low >> 3;
  const ivec3 bricks = ((box.low + box.size + 7) >> 3) - first;
  require_3d(limits, bricks, "the brick march");
  constexpr std::uint32_t empty = 0xfffffffeU;
  std::vector<std::uint32_t> slots;
  std::vector<std::uint16_t> values;
  std::unordered_map<float, std::uint32_t> uniform_slots;
  const float scale = relative_scale(volume);
  std::uint32_t count = 0;
  for (int z = 0; z < bricks.z; ++z) {
    for (int y = 0; y < bricks.y; ++y) {
      for (int x = 0; x < bricks.x; ++x) {
        const grid::Statistics::Node& node = statistics.node_at((first + ivec3(x, y, z)) * 8);
        if (node.is_uniform() && node.uniform == 0.0F) {
          slots.push_back(empty);
          continue;
        }
        if (node.is_uniform()) {
          const auto [found, added] = uniform_slots.emplace(node.uniform, count);
          slots.push_back(found->second);
          if (!added) continue;
        } else {
          slots.push_back(count);
        }
        ++count;
        const float* source = node.is_uniform() ? nullptr : statistics.values(node);
        for (int i = 0; i < volume::brick_voxels; ++i) {
          values.push_back(glm::packHalf1x16((source == nullptr ? node.uniform : source[i]) * scale));
        }
      }
    }
  }
  if (static_cast<std::int64_t>(values.size()) > limits.texture_buffer_texels) {
    throw Error(ErrorCode::unsupported, "the brick march needs " + std::to_string(values.size()) +
                                            " texels; this driver's GL_MAX_TEXTURE_BUFFER_SIZE is " +
                                            std::to_string(limits.texture_buffer_texels));
  }
  if (values.empty()) values.resize(volume::brick_voxels);
  data.buffers_.push_back(gl::make_buffer(gl, values.size() * 2, values.data(), 0, "uploading bricks"));
  data.textures_[1] = gl::make_texture_buffer(gl, GL_R16F, data.buffers_.back(), "uploading bricks");
  data.textures_[2] = gl::make_texture_3d(gl, GL_R32UI, bricks.x, bricks.y, bricks.z, "creating the brick slots");
  gl->PixelStorei(GL_UNPACK_ALIGNMENT, 4);
  gl->TextureSubImage3D(data.textures_[2].name(), 0, 0, 0, 0, bricks.x, bricks.y, bricks.z, GL_RED_INTEGER,
                        GL_UNSIGNED_INT, slots.data());
  gl::check(*gl, "uploading the brick slots");
  data.bytes_ = values.size() * 2 + slots.size() * 4;
  return data;
}

std::vector<std::string> MarchData::defines() const {
  return {"CM_MARCH " + std::to_string(static_cast<int>(march_)), std::string("CM_LINEAR ") + (linear_ ? "1" : "0"),
          "CM_PAGES " + std::to_string(std::max<std::size_t>(pages_.size(), 1))};
}

void MarchData::bind(const gl::Functions& gl) const {
  for (std::size_t i = 0; i < pages_.size(); ++i) gl.BindTextureUnit(static_cast<GLuint>(i), pages_[i].name());
  for (std::size_t i = 0; i < textures_.size(); ++i) {
    if (textures_[i]) gl.BindTextureUnit(tree_unit + static_cast<GLuint>(i), textures_[i].name());
  }
  if (roots_) gl.BindBufferBase(GL_UNIFORM_BUFFER, 1, roots_.name());
}

void MarchData::describe(core::CmParameters& parameters) const {
  parameters.box_min = glm::vec4(box_min_, 0.0F);
  parameters.box_max = glm::vec4(box_max_, 0.0F);
  parameters.cube = cube_;
  parameters.march.z = static_cast<unsigned>(log2_page_cells_);
}

}  // namespace cumulet::render
