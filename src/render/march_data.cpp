#include "render/march_data.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/gtc/packing.hpp>
#include <span>

#include "base/error.hpp"
#include "base/luminance.hpp"
#include "gl/bindings.hpp"

namespace cumulet::render {

namespace {

using glm::ivec3;
using glm::vec3;

constexpr std::int64_t max_pages = 6;

void require_3d(const gl::Limits& limits, const ivec3& size, const char* what) {
  const int widest = std::max({size.x, size.y, size.z});
  if (widest > limits.texture_size_3d) {
    throw Error(ErrorCode::unsupported, std::string(what) + " needs a 3D texture " + std::to_string(widest) +
                                            " wide; this driver's GL_MAX_3D_TEXTURE_SIZE is " +
                                            std::to_string(limits.texture_size_3d));
  }
}

// Slices first to last (not included) of a dense volume: put(place in them, value) for each voxel.
template <class Put>
void for_slab(const scene::MarchSource& source, const grid::Statistics& statistics, int first, int last,
              const Put& put) {
  const ivec3 low = source.box_low;
  const ivec3 high = low + source.box_size;
  const auto row = static_cast<std::size_t>(source.box_size.x);
  const std::size_t slice = row * static_cast<std::size_t>(source.box_size.y);
  tbb::parallel_for(low.y >> 3, (high.y + 7) >> 3, [&](int by) {
    for (int x = low.x & ~7; x < high.x; x += volume::brick_size) {
      const grid::Statistics::Node& node = statistics.node_at({x, by * 8, first & ~7});
      const float* values = node.is_uniform() ? nullptr : statistics.values(node);
      const ivec3 from = glm::max(ivec3(x, by * 8, first), low);
      const ivec3 to = glm::min(ivec3(x + 8, by * 8 + 8, last), high);
      for (int k = from.z; k < to.z; ++k) {
        for (int j = from.y; j < to.y; ++j) {
          for (int i = from.x; i < to.x; ++i) {
            const float value = values == nullptr ? node.uniform : values[(i & 7) * 64 + (j & 7) * 8 + (k & 7)];
            const std::size_t at = static_cast<std::size_t>(k - first) * slice +
                                   static_cast<std::size_t>(j - low.y) * row + static_cast<std::size_t>(i - low.x);
            put(at, value);
          }
        }
      }
    }
  });
}

// Slices of what scatters at each voxel.
std::vector<float> scattering_slab(const scene::MarchSource& source, std::size_t voxels, int first, int last) {
  std::vector<float> slab(voxels);
  const auto add = [&](const grid::Statistics& statistics, float weight) {
    for_slab(source, statistics, first, last, [&](std::size_t at, float value) { slab[at] += weight * value; });
  };
  const grid::RgbField* coloured = source.channels.scattering.get();
  if (coloured == nullptr) add(*source.statistics, 1.0F);
  for (std::size_t i = 0; coloured != nullptr && i < 3; ++i)
    add(coloured->component(i), luminance(vec3(glm::mat3(1.0F)[static_cast<int>(i)])));
  return slab;
}

// No vector of length 1 is shorter after it: one over a bound of the inverse's norm.
float least_stretch(const glm::dmat3& linear) {
  const glm::dmat3 inverse = glm::inverse(linear);
  const auto widest_column = [](const glm::dmat3& m) {
    const auto sum = [](const glm::dvec3& v) { return glm::dot(glm::abs(v), glm::dvec3(1.0)); };
    return std::max({sum(m[0]), sum(m[1]), sum(m[2])});
  };
  return static_cast<float>(1.0 / std::sqrt(widest_column(inverse) * widest_column(glm::transpose(inverse))));
}

}  // namespace

core::CmGrid grid_parameters(const grid::Cube& cube, const vec3& low, const vec3& high) {
  const glm::dmat3 from_cube(cube.to_world);
  const glm::dmat3 to_cube(glm::inverse(cube.to_world));
  core::CmGrid grid{};
  grid.to_cube_x = vec3(to_cube[0]);
  grid.to_cube_y = vec3(to_cube[1]);
  grid.to_cube_z = vec3(to_cube[2]);
  grid.from_cube_x = vec3(from_cube[0]);
  grid.from_cube_y = vec3(from_cube[1]);
  grid.from_cube_z = vec3(from_cube[2]);
  grid.cube_origin = vec3(cube.to_world[3]);
  grid.unit_volume = static_cast<float>(std::abs(glm::determinant(from_cube)));
  grid.box_min = low;
  grid.box_max = high;
  grid.root_exponent = static_cast<std::uint32_t>(cube.log2_size - 1);
  return grid;
}

MarchUpload::MarchUpload(gl::FunctionsPtr gl, const gl::Limits& limits, gl::WordHeap& heap,
                         scene::MarchSourcePtr source, std::int64_t page_texels)
    : gl_(std::move(gl)), limits_(limits), source_(std::move(source)), upload_(gl_, "uploading the volume") {
  data_.march_ = source_->march;
  if (source_->march == March::tet) {
    plan_tet(heap, page_texels);
  } else {
    data_.grid_ = grid_parameters(source_->cube, vec3(source_->box_low), vec3(source_->box_low + source_->box_size));
    source_->march == March::dense ? plan_dense() : plan_brick();
    plan_channel_voxels();
  }
}

void MarchUpload::plan_tet(gl::WordHeap& heap, std::int64_t page_texels) {
  const grid::TetGrid& grid = *source_->grid;
  data_.linear_ = source_->linear;
  data_.grid_ = grid_parameters(grid.cube, grid.content_min, grid.content_max);
  data_.grid_.levels = grid.levels;
  const auto cells = static_cast<std::int64_t>(grid.cells.size());
  const std::int64_t texels = page_texels > 0 ? page_texels : limits_.texture_buffer_texels;
  std::int64_t page_cells = texels / 2;
  if (page_cells < cells)
    page_cells = static_cast<std::int64_t>(std::bit_floor(static_cast<std::uint64_t>(page_cells)));
  data_.grid_.page_shift = static_cast<std::uint32_t>(std::bit_width(static_cast<std::uint64_t>(page_cells))) - 1;
  if (cells > page_cells * max_pages) {
    throw Error(ErrorCode::unsupported, std::to_string(cells) + " cells need more than " + std::to_string(max_pages) +
                                            " texture buffers of this driver's GL_MAX_TEXTURE_BUFFER_SIZE, " +
                                            std::to_string(texels) + " texels");
  }
  for (std::int64_t first = 0; first < cells; first += page_cells) {
    const std::int64_t count = std::min(page_cells, cells - first);
    const std::size_t bytes = static_cast<std::size_t>(count) * sizeof(grid::CellRecord);
    const std::size_t index = data_.cells_.size();
    data_.cells_.emplace_back();
    data_.bytes_ += bytes;
    // Of several pages each is whole: shaders find a record's by its number alone.
    const bool alone = cells > page_cells;
    upload_.add([this, &heap, index, bytes, alone] {
      const char* what = "creating the pages of cell records";
      gl::WordHeap::Span& span = data_.cells_[index] = alone ? heap.take_page(bytes, what) : heap.take(bytes, what);
      data_.grid_.first_cell = static_cast<std::uint32_t>(span.offset() / sizeof(grid::CellRecord));
    });
    upload_.add_bytes(
        [this, index] {
          return Upload::Place{data_.cells_[index].buffer(), data_.cells_[index].offset()};
        },
        grid.cells.data() + first, bytes);
  }
  const std::size_t emission_bytes = grid.emission.size() * sizeof(grid::EmissionRecord);
  const scene::GlowTable& glow = source_->glow;
  const std::size_t glow_bytes = glow.cells.size() * sizeof(scene::GlowingCell);
  const std::size_t colour_bytes = grid.colour.size() * sizeof(std::uint32_t);
  const std::size_t anisotropy_bytes = grid.anisotropy.size() * sizeof(std::int16_t);
  const std::size_t first_anisotropy = emission_bytes + glow_bytes + colour_bytes;
  const std::size_t channel_bytes = first_anisotropy + (anisotropy_bytes + 3) / 4 * 4;  // whole words
  if (channel_bytes > 0) {
    if (static_cast<std::int64_t>(channel_bytes / 16) >= texels) {
      throw Error(ErrorCode::unsupported, "the channels of " + std::to_string(cells) +
                                              " cells need more than one texture buffer of this driver's "
                                              "GL_MAX_TEXTURE_BUFFER_SIZE, " +
                                              std::to_string(texels) + " texels");
    }
    data_.bytes_ += channel_bytes;
    upload_.add([this, &heap, emission_bytes, glow_bytes, first_anisotropy, channel_bytes] {
      data_.channels_ = heap.take(channel_bytes, "creating the cells' channels");
      const std::size_t first = data_.channels_.offset();
      data_.grid_.first_emission = static_cast<std::uint32_t>(first / 16);
      data_.grid_.first_glowing = static_cast<std::uint32_t>((first + emission_bytes) / 16);
      data_.grid_.first_colour = static_cast<std::uint32_t>((first + emission_bytes + glow_bytes) / 4);
      data_.grid_.first_anisotropy = static_cast<std::uint32_t>((first + first_anisotropy) / 4);
    });
    const auto add = [this](std::size_t at, const void* bytes, std::size_t count) {
      upload_.add_bytes(
          [this, at] {
            return Upload::Place{data_.channels_.buffer(), data_.channels_.offset() + at};
          },
          bytes, count);
    };
    add(0, grid.emission.data(), emission_bytes);
    add(emission_bytes, glow.cells.data(), glow_bytes);
    add(emission_bytes + glow_bytes, grid.colour.data(), colour_bytes);
    add(first_anisotropy, grid.anisotropy.data(), anisotropy_bytes);
    if (!glow.cells.empty()) {
      data_.grid_.glowing = static_cast<std::uint32_t>(glow.cells.size());
      data_.grid_.glow_density = static_cast<float>(1.0 / glow.power);
      data_.grid_.glow_length = static_cast<float>(glow.length);
      data_.grid_.least_stretch = least_stretch(glm::dmat3(grid.cube.to_world));
    }
  }
  const std::size_t tree_bytes = grid.tree.size() * sizeof(std::uint32_t);
  data_.bytes_ += tree_bytes;
  upload_.add([this, &heap, tree_bytes] {
    data_.tree_ = heap.take(tree_bytes, "creating the point-location tree");
    data_.grid_.tree = static_cast<std::uint32_t>(data_.tree_.offset() / sizeof(std::uint32_t));
  });
  upload_.add_bytes(
      [this] {
        return Upload::Place{data_.tree_.buffer(), data_.tree_.offset()};
      },
      grid.tree.data(), tree_bytes);
  data_.bytes_ += 26 * sizeof(grid::RootEntry);
  upload_.add([this] {
    std::array<grid::RootEntry, 26> roots{};
    std::copy(source_->grid->roots.begin(), source_->grid->roots.end(), roots.begin());
    data_.roots_ = gl::make_buffer(gl_, sizeof(roots), roots.data(), 0, "uploading the root cells");
  });
}

void MarchUpload::plan_dense() {
  const ivec3 size = source_->box_size;
  require_3d(limits_, size, "the dense march");
  plan_voxels(data_.textures_[0], {&*source_->statistics}, GL_R16F, GL_RED, source_->density_a_value(),
              "creating the dense texture");
}

void MarchUpload::plan_channel_voxels() {
  const auto plan = [this](gl::Object& texture, const grid::RgbField& field, float unit, const char* what) {
    require_3d(limits_, source_->box_size, "colour a voxel");
    plan_voxels(texture, {&field.component(0), &field.component(1), &field.component(2), nullptr}, GL_RGBA16F, GL_RGBA,
                1.0F / unit, what);
  };
  if (const grid::RgbField* emission = source_->channels.emission.get()) {
    data_.grid_.emission_unit = emission->max_value();
    plan(data_.emission_voxels_, *emission, data_.grid_.emission_unit, "creating what voxels give off");
  }
  // In units of density 1, so that the colour is this over the density.
  if (const grid::RgbField* scattering = source_->channels.scattering.get())
    plan(data_.scattering_voxels_, *scattering, source_->max_value, "creating what voxels scatter");
  if (const grid::ScalarField* forward = source_->channels.forward.get()) {
    require_3d(limits_, source_->box_size, "anisotropy a voxel");
    plan_slabs(data_.anisotropy_voxels_, {GL_R16_SNORM, GL_RED, GL_SHORT, 1}, "creating voxels' anisotropy",
               [this, forward](std::span<std::uint16_t> slab, int first, int last) {
                 const std::vector<float> scattering = scattering_slab(*source_, slab.size(), first, last);
                 for_slab(*source_, forward->statistics(), first, last, [&](std::size_t at, float value) {
                   slab[at] = static_cast<std::uint16_t>(grid::pack_anisotropy(value, scattering[at]));
                 });
               });
  }
}

void MarchUpload::plan_voxels(gl::Object& texture, const std::vector<const grid::Statistics*>& components,
                              GLenum format, GLenum channels, float scale, const char* what) {
  const std::size_t stride = components.size();
  plan_slabs(texture, {format, channels, GL_HALF_FLOAT, stride}, what,
             [this, components, scale, stride](std::span<std::uint16_t> slab, int first, int last) {
               for (std::size_t i = 0; i < stride; ++i) {
                 if (components[i] == nullptr) continue;
                 for_slab(*source_, *components[i], first, last, [&](std::size_t at, float value) {
                   slab[at * stride + i] = glm::packHalf1x16(value * scale);
                 });
               }
             });
}

void MarchUpload::plan_slabs(gl::Object& texture, const Texels& texels, const char* what, const FillSlab& fill) {
  const ivec3 size = source_->box_size;
  data_.bytes_ += static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y) *
                  static_cast<std::uint64_t>(size.z) * 2 * texels.count;
  upload_.add([this, &texture, size, texels, what] {
    texture = gl::make_texture_3d(gl_, texels.stored, size.x, size.y, size.z, what);
  });
  // One layer of bricks at a time: bounded memory.
  const int low = source_->box_low.z;
  for (int z = low & ~7; z < low + size.z; z += volume::brick_size) {
    const int first = std::max(z, low);
    const int last = std::min(z + volume::brick_size, low + size.z);
    upload_.add([this, &texture, texels, size, fill, low, first, last] {
      std::vector<std::uint16_t> slab(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) *
                                      static_cast<std::size_t>(last - first) * texels.count);
      fill(slab, first, last);
      gl_->PixelStorei(GL_UNPACK_ALIGNMENT, 2);
      gl_->TextureSubImage3D(texture.name(), 0, 0, 0, first - low, size.x, size.y, last - first, texels.format,
                             texels.type, slab.data());
      gl_->PixelStorei(GL_UNPACK_ALIGNMENT, 4);
    });
  }
}

void MarchUpload::plan_brick() {
  const ivec3 bricks = source_->brick_count;
  require_3d(limits_, bricks, "the brick march");
  if (static_cast<std::int64_t>(source_->brick_values.size()) > limits_.texture_buffer_texels) {
    throw Error(ErrorCode::unsupported, "the brick march needs " + std::to_string(source_->brick_values.size()) +
                                            " texels; this driver's GL_MAX_TEXTURE_BUFFER_SIZE is " +
                                            std::to_string(limits_.texture_buffer_texels));
  }
  const std::size_t bytes = source_->brick_values.size() * 2;
  data_.bytes_ += bytes;
  upload_.add([this, bytes] {
    const char* what = "creating the buffer of bricks";
    data_.brick_values_ = gl::make_buffer(gl_, bytes, nullptr, GL_DYNAMIC_STORAGE_BIT, what);
    data_.textures_[0] = gl::make_texture_buffer(gl_, GL_R16F, data_.brick_values_, what);
  });
  upload_.add_bytes(
      [this] {
        return Upload::Place{data_.brick_values_.name(), 0};
      },
      source_->brick_values.data(), bytes);
  data_.bytes_ += source_->brick_slots.size() * 4;
  upload_.add([this, bricks] {
    data_.textures_[1] = gl::make_texture_3d(gl_, GL_R32UI, bricks.x, bricks.y, bricks.z, "creating the brick slots");
    gl_->PixelStorei(GL_UNPACK_ALIGNMENT, 4);
    gl_->TextureSubImage3D(data_.textures_[1].name(), 0, 0, 0, 0, bricks.x, bricks.y, bricks.z, GL_RED_INTEGER,
                           GL_UNSIGNED_INT, source_->brick_slots.data());
  });
}

std::vector<std::string> MarchData::defines() const {
  return {"CM_MARCH " + std::to_string(static_cast<int>(march_)), std::string("CM_LINEAR ") + (linear_ ? "1" : "0"),
          "CM_PAGES " + std::to_string(std::max<std::size_t>(cells_.size(), 1))};
}

void MarchData::bind(const gl::Functions& gl) const {
  for (std::size_t i = 0; i < cells_.size(); ++i)
    gl.BindTextureUnit(core::CM_UNIT_CELLS + static_cast<GLuint>(i), cells_[i].texture());
  constexpr std::array<GLuint, 2> units{core::CM_UNIT_VOXELS, core::CM_UNIT_BRICK_SLOTS};
  for (std::size_t i = 0; i < textures_.size(); ++i) {
    if (textures_[i]) gl.BindTextureUnit(units[i], textures_[i].name());
  }
  if (scattering_voxels_) gl.BindTextureUnit(core::CM_UNIT_SCATTERING_VOXELS, scattering_voxels_.name());
  if (anisotropy_voxels_) gl.BindTextureUnit(core::CM_UNIT_ANISOTROPY_VOXELS, anisotropy_voxels_.name());
  if (emission_voxels_) gl.BindTextureUnit(core::CM_UNIT_CHANNELS, emission_voxels_.name());
  if (channels_) gl.BindTextureUnit(core::CM_UNIT_CHANNELS, channels_.texture());
  if (tree_) gl.BindTextureUnit(core::CM_UNIT_TREE, tree_.texture());
  if (roots_) gl.BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_ROOTS, roots_.name());
}
}  // namespace cumulet::render
