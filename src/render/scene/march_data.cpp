#include "render/scene/march_data.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/gtc/packing.hpp>
#include <span>
#include <utility>

#include "base/error.hpp"
#include "base/luminance.hpp"
#include "gl/bindings.hpp"
#include "grid/brick_voxels.hpp"
#include "grid/cell.hpp"

namespace cumulet::render {

namespace {

using glm::ivec3;
using glm::vec3;

void require_3d(const gl::Limits& limits, const ivec3& size, const char* what) {
  const int widest = std::max({size.x, size.y, size.z});
  if (widest > limits.texture_size_3d) {
    throw Error(ErrorCode::unsupported, std::string(what) + " needs a 3D texture " + std::to_string(widest) +
                                            " wide; this driver's GL_MAX_3D_TEXTURE_SIZE is " +
                                            std::to_string(limits.texture_size_3d));
  }
}

// Returns whether a velocity texture is made. A picture can do without it, so its 8 bytes per voxel are no reason to
// fail.
bool holds_motion(const gl::Limits& limits, const ivec3& size) {
  constexpr std::int64_t most = std::int64_t{1} << 27;
  const glm::i64vec3 voxels(size);
  return std::max({size.x, size.y, size.z}) <= limits.texture_size_3d && voxels.x * voxels.y * voxels.z <= most;
}

// Calls put(index in the slices, value) for each voxel of the slices [first, last) of a dense volume. Voxels outside
// the cube are 0 and left out.
template <class Put>
void for_slab(const scene::MarchSource& source, const grid::Statistics& statistics, int first, int last,
              const Put& put) {
  const ivec3 low = source.box_low;
  const ivec3 size = source.voxel_count();
  const ivec3 high = glm::min(low + size, ivec3(statistics.cube().size()));
  last = std::min(last, high.z);
  if (first >= last) return;
  const auto row = static_cast<std::size_t>(size.x);
  const std::size_t slice = row * static_cast<std::size_t>(size.y);
  tbb::parallel_for(low.y >> 3, (high.y + 7) >> 3, [&](int by) {
    grid::BrickVoxels brick;
    for (int x = low.x & ~7; x < high.x; x += volume::brick_size) {
      brick.look_up(statistics, {x, by * 8, first & ~7});
      const ivec3 from = glm::max(ivec3(x, by * 8, first), low);
      const ivec3 to = glm::min(ivec3(x + 8, by * 8 + 8, last), high);
      for (int k = from.z; k < to.z; ++k) {
        for (int j = from.y; j < to.y; ++j) {
          for (int i = from.x; i < to.x; ++i) {
            const float value = brick.at(i & 7, j & 7, k & 7);
            const std::size_t at = static_cast<std::size_t>(k - first) * slice +
                                   static_cast<std::size_t>(j - low.y) * row + static_cast<std::size_t>(i - low.x);
            put(at, value);
          }
        }
      }
    }
  });
}

// Returns the scattering coefficient of each voxel of the slices, as luminance if it is colored.
std::vector<float> scattering_slab(const scene::MarchSource& source, std::size_t voxels, int first, int last) {
  std::vector<float> slab(voxels);
  const auto add = [&](const grid::Statistics& statistics, float weight) {
    for_slab(source, statistics, first, last, [&](std::size_t at, float value) { slab[at] += weight * value; });
  };
  const grid::RgbField* colored = source.channels.scattering.get();
  if (colored == nullptr) add(*source.statistics, 1.0F);
  for (std::size_t i = 0; colored != nullptr && i < 3; ++i)
    add(colored->component(i), luminance(vec3(glm::mat3(1.0F)[static_cast<int>(i)])));
  return slab;
}

core::CmGrid parameters_of(const scene::MarchSource& source) {
  core::CmGrid grid{};
  if (source.march != March::tet) {
    grid.box_min = vec3(source.box_low);
    grid.box_max = vec3(source.box_low + source.box_size);
  } else if (source.grid) {
    grid.box_min = source.grid->content_min;
    grid.box_max = source.grid->content_max;
    grid.levels = source.grid->levels;
  }
  grid.moves = source.moves() ? 1U : 0U;
  grid.root_exponent = static_cast<std::uint32_t>(source.cube.log2_size - 1);
  return grid;
}

static_assert(core::CM_UNIT_CHANNEL_VOXELS + CM_CHANNEL_COUNT <= core::CM_UNIT_CHANGE_VOXELS);

// In front of each tree: 25 pairs, and padding.
using Roots = std::array<grid::RootEntry, 26>;
static_assert(sizeof(Roots) == 52 * 4, "glsl/common/buffers.glsl");

// Texels of the pages of channels.
constexpr std::size_t texel_bytes = 16;

// Byte sizes and offsets of the channels of a grid's cells, in descending size of their records, so that each is
// aligned. Behind those of 16 bytes are the table of emissive cells and the corners, behind those of 8 bytes the
// change.
class ChannelBytes {
 public:
  struct Range {
    std::size_t at = 0;
    std::size_t size = 0;
  };
  // cells, glowing: numbers of cells and of emissive cells.
  ChannelBytes(const scene::MarchSource& source, std::size_t cells, std::size_t glowing) {
    const grid::TetGrid* made = source.grid.get();
    const auto size_of = [&](const grid::ChannelRow& row) -> std::size_t {
      if (made != nullptr) return row.records(made->channels).size();
      return row.is_in(source.channels) ? grid::channel_bytes(row.channel, cells) : 0;
    };
    for (const std::size_t record_bytes : {16, 8, 4, 2}) {
      for (const grid::ChannelRow& row : grid::channel_table) {
        if (row.record_bytes == record_bytes) channels_[grid::index_of(row.channel)] = append(size_of(row));
      }
      if (record_bytes == 16) {
        emissive_ = append(glowing * sizeof(scene::GlowingCell));
        corners_ = append(source.trilinear ? cells * sizeof(glm::uvec4) : 0);
      }
      // Grids built on the GPU have none.
      if (record_bytes == 8) change_ = append(made != nullptr ? made->change.size() * sizeof(glm::uvec2) : 0);
    }
  }
  [[nodiscard]] const Range& of(grid::Channel channel) const { return channels_[grid::index_of(channel)]; }
  [[nodiscard]] const Range& emissive() const { return emissive_; }
  [[nodiscard]] const Range& corners() const { return corners_; }
  [[nodiscard]] const Range& change() const { return change_; }
  // Rounded up to whole texels.
  [[nodiscard]] std::size_t all() const { return (end_ + texel_bytes - 1) / texel_bytes * texel_bytes; }

 private:
  Range append(std::size_t size) { return {std::exchange(end_, end_ + size), size}; }

  std::array<Range, grid::channel_table.size()> channels_;
  Range emissive_;
  Range corners_;
  Range change_;
  std::size_t end_ = 0;
};

}  // namespace

bool MarchData::is_of(const std::vector<scene::MarchSourcePtr>& sources, std::int64_t page_texels) const {
  return page_texels_ == page_texels && std::ranges::equal(parts_, sources, {}, &Part::source);
}

const core::CmGrid* MarchData::grid(const scene::MarchSource& source) const {
  const Part* part = part_of(source);
  return part == nullptr ? nullptr : &part->grid;
}

const MarchData::Cells* MarchData::cells(const scene::MarchSource& source) const {
  const Part* part = part_of(source);
  return part == nullptr ? nullptr : &part->cells;
}

const scene::EmissiveSum* MarchData::emissive(const scene::MarchSource& source) const {
  const Part* part = part_of(source);
  return part == nullptr ? nullptr : &part->emissive;
}

const MarchData::Part* MarchData::part_of(const scene::MarchSource& source) const {
  const auto found = std::ranges::find_if(parts_, [&](const Part& part) { return part.source.get() == &source; });
  return found == parts_.end() ? nullptr : &*found;
}

MarchData::Run MarchData::run(std::size_t cell, std::size_t count) const {
  if (cells_.size() == 1) return {0, cell, count};
  const std::size_t page_cells = std::size_t{1} << page_shift_;
  return {cell / page_cells, cell % page_cells, std::min(count, page_cells - cell % page_cells)};
}

Upload::Location MarchData::location_of(const Run& run) const {
  const gl::WordHeap::Span& page = cells_[run.page];
  return {page.buffer(), page.offset() + run.cell * sizeof(grid::CellRecord)};
}

MarchUpload::MarchUpload(gl::FunctionsPtr gl, const gl::Limits& limits, gl::WordHeap& heap, const Sources& sources,
                         const MarchData* before, std::int64_t page_texels, const BuiltGrids* built)
    : gl_(std::move(gl)),
      owner_(heap.functions()),
      limits_(limits),
      before_(before),
      built_(built),
      source_(sources.at(0)),
      upload_(gl_, "uploading the volume") {
  data_.march_ = source_->march;
  data_.page_texels_ = page_texels;
  data_.linear_ = source_->linear;
  data_.trilinear_ = source_->trilinear;
  for (const scene::MarchSourcePtr& source : sources) {
    if (!source->goes_with(*source_)) {
      throw Error(ErrorCode::unsupported, "grids of different types cannot be shown together");
    }
    MarchData::Part& part = data_.parts_.emplace_back();
    part.source = source;
    describe(part);
  }
  if (source_->march == March::tet) {
    plan_tets(heap, page_texels);
    return;
  }
  if (sources.size() > 1) {
    throw Error(ErrorCode::unsupported, std::string("the ") + (source_->march == March::dense ? "dense" : "brick") +
                                            " grid type supports one grid, not " + std::to_string(sources.size()) +
                                            "; only tetrahedral grids support several");
  }
  source_->march == March::dense ? plan_dense() : plan_brick();
  plan_channel_voxels();
}

void MarchUpload::describe(MarchData::Part& part) const {
  const scene::MarchSource& source = *part.source;
  part.grid = parameters_of(source);
  if (source.grid) {
    part.cells = {source.grid->cells.size(), source.grid->limited};
    part.inner = source.grid->tree.size();
    part.emissive = source.emissive;
    part.glowing = source.emissive.cells.size();
  }
  if (!source.plan) return;
  if (const MarchData::Part* old = before_ == nullptr ? nullptr : before_->part_of(source)) {
    part.grid = old->grid;
    part.cells = old->cells;
    part.inner = old->inner;
    part.emissive = old->emissive;
    part.glowing = old->glowing;
    return;
  }
  const BuiltGrid& made = built_->at(part.source);
  part.grid.box_min = made.content_min;
  part.grid.box_max = made.content_max;
  part.grid.levels = made.levels;
  part.cells = {made.count, made.limited, made.grid ? std::optional(made.why_not) : std::nullopt};
  part.inner = made.count - 24;  // each split adds one cell
  part.emissive = made.emissive;
  part.glowing = made.emissive.cells.size();
}

const grid::TetGrid* MarchUpload::grid_of(const MarchData::Part& part) const {
  return part.source->plan ? built_->at(part.source).grid.get() : part.source->grid.get();
}

const scene::EmissiveTable& MarchUpload::emissive_of(const MarchData::Part& part) const {
  return part.source->plan ? built_->at(part.source).emissive : part.source->emissive;
}

void MarchUpload::add_copy(const LocationOf& to, const LocationOf& from, std::size_t bytes) {
  upload_.add_pieces(bytes, [this, to, from](std::size_t first, std::size_t count) {
    const Upload::Location location = to();
    const Upload::Location old = from();
    gl_->CopyNamedBufferSubData(old.buffer, location.buffer, static_cast<GLintptr>(old.offset + first),
                                static_cast<GLintptr>(location.offset + first), static_cast<GLsizeiptr>(count));
  });
}

void MarchUpload::plan_tets(gl::WordHeap& heap, std::int64_t page_texels) {
  const std::int64_t texels = page_texels > 0 ? page_texels : limits_.texture_buffer_texels;
  plan_cells(heap, texels);
  plan_channels(heap, texels);
  plan_trees(heap);
}

void MarchUpload::plan_cells(gl::WordHeap& heap, std::int64_t texels) {
  std::size_t all = 0;
  for (MarchData::Part& part : data_.parts_) {
    part.cell = all;
    all += part.cells.count;
  }
  const auto cells = static_cast<std::int64_t>(all);
  std::int64_t page_cells = texels / 2;
  if (page_cells < cells)
    page_cells = static_cast<std::int64_t>(std::bit_floor(static_cast<std::uint64_t>(page_cells)));
  data_.page_shift_ = static_cast<std::uint32_t>(std::bit_width(static_cast<std::uint64_t>(page_cells))) - 1;
  if (cells > page_cells * static_cast<std::int64_t>(MarchData::max_pages)) {
    throw Error(ErrorCode::unsupported, std::to_string(cells) + " cells need more than " +
                                            std::to_string(MarchData::max_pages) +
                                            " texture buffers of this driver's GL_MAX_TEXTURE_BUFFER_SIZE, " +
                                            std::to_string(texels) + " texels");
  }
  data_.bytes_ += all * sizeof(grid::CellRecord);
  for (std::int64_t first = 0; first < cells; first += page_cells) {
    const std::size_t bytes = static_cast<std::size_t>(std::min(page_cells, cells - first)) * sizeof(grid::CellRecord);
    const std::size_t index = data_.cells_.size();
    data_.cells_.emplace_back();
    // If there are several pages, each is used exclusively, because shaders locate a record only by its number.
    const bool alone = cells > page_cells;
    upload_.add([this, &heap, index, bytes, alone] {
      const char* what = "creating the pages of cell records";
      data_.cells_[index] = alone ? heap.take_page(bytes, what) : heap.take(bytes, what);
    });
  }
  upload_.add([this] {
    const std::size_t first = data_.cells_.size() == 1 ? data_.cells_[0].offset() / sizeof(grid::CellRecord) : 0;
    for (MarchData::Part& part : data_.parts_) {
      part.grid.page_shift = data_.page_shift_;
      part.grid.first_cell = static_cast<std::uint32_t>(first + part.cell);
    }
  });
  for (const MarchData::Part& part : data_.parts_) {
    const MarchData::Part* old = before_ == nullptr ? nullptr : before_->part_of(*part.source);
    for (std::size_t done = 0; done < part.cells.count;) {
      MarchData::Run to = data_.run(part.cell + done, part.cells.count - done);
      const LocationOf location = [this, to] { return data_.location_of(to); };
      if (old != nullptr) {
        const MarchData::Run from = before_->run(old->cell + done, to.count);
        to.count = from.count;
        add_copy(
            location, [this, from] { return before_->location_of(from); }, to.count * sizeof(grid::CellRecord));
      } else if (const grid::TetGrid* grid = grid_of(part)) {
        upload_.add_bytes(location, &grid->cells[done], to.count * sizeof(grid::CellRecord));
      } else {
        const auto from = [buffer = built_->at(part.source).cells.name(), done] {
          return Upload::Location{buffer, done * sizeof(grid::CellRecord)};
        };
        add_copy(location, from, to.count * sizeof(grid::CellRecord));
      }
      done += to.count;
    }
  }
}

void MarchUpload::plan_channels(gl::WordHeap& heap, std::int64_t texels) {
  std::size_t bytes = 0;
  for (MarchData::Part& part : data_.parts_) {
    part.channels = bytes;
    bytes += ChannelBytes(*part.source, part.cells.count, part.glowing).all();
  }
  if (bytes == 0) return;
  if (static_cast<std::int64_t>(bytes / 16) >= texels) {
    std::size_t cells = 0;
    for (const MarchData::Part& part : data_.parts_) cells += part.cells.count;
    throw Error(ErrorCode::unsupported, "the channels of " + std::to_string(cells) +
                                            " cells need more than one texture buffer of this driver's "
                                            "GL_MAX_TEXTURE_BUFFER_SIZE, " +
                                            std::to_string(texels) + " texels");
  }
  data_.bytes_ += bytes;
  upload_.add([this, &heap, bytes] {
    data_.channels_ = heap.take(bytes, "creating the cells' channels");
    for (MarchData::Part& part : data_.parts_) {
      const ChannelBytes channels(*part.source, part.cells.count, part.glowing);
      const std::size_t first = data_.channels_.offset() + part.channels;
      for (const grid::ChannelRow& row : grid::channel_table) {
        const std::size_t unit = row.record_bytes == texel_bytes ? texel_bytes : 4;
        const int index = static_cast<int>(row.channel);
        part.grid.first_records[index / 4][index % 4] =
            static_cast<std::uint32_t>((first + channels.of(row.channel).at) / unit);
      }
      part.grid.first_glowing = static_cast<std::uint32_t>((first + channels.emissive().at) / texel_bytes);
      part.grid.first_corners = static_cast<std::uint32_t>((first + channels.corners().at) / texel_bytes);
      part.grid.first_change = static_cast<std::uint32_t>((first + channels.change().at) / 4);
      part.grid.glowing = static_cast<std::uint32_t>(part.glowing);
    }
  });
  for (const MarchData::Part& part : data_.parts_) {
    const ChannelBytes channels(*part.source, part.cells.count, part.glowing);
    const MarchData::Part* old = before_ == nullptr ? nullptr : before_->part_of(*part.source);
    const auto location_at = [this, first = part.channels](std::size_t at) {
      return [this, offset = first + at] {
        return Upload::Location{data_.channels_.buffer(), data_.channels_.offset() + offset};
      };
    };
    if (old != nullptr) {
      const auto from = [this, first = old->channels] {
        return Upload::Location{before_->channels_.buffer(), before_->channels_.offset() + first};
      };
      add_copy(location_at(0), from, channels.all());
      continue;
    }
    upload_.add_bytes(location_at(channels.emissive().at), emissive_of(part).cells.data(), channels.emissive().size);
    const grid::TetGrid* grid = grid_of(part);
    if (grid == nullptr) {
      const BuiltGrid& made = built_->at(part.source);
      const auto copy = [&](const gl::Object& records, const ChannelBytes::Range& range) {
        const auto from = [buffer = records.name()] { return Upload::Location{buffer, 0}; };
        add_copy(location_at(range.at), from, range.size);
      };
      for (const grid::ChannelRow& row : grid::channel_table)
        copy(made.channels[grid::index_of(row.channel)], channels.of(row.channel));
      copy(made.corners, channels.corners());
      continue;
    }
    for (const grid::ChannelRow& row : grid::channel_table) {
      const ChannelBytes::Range& range = channels.of(row.channel);
      upload_.add_bytes(location_at(range.at), row.records(grid->channels).data(), range.size);
    }
    upload_.add_bytes(location_at(channels.corners().at), grid->corners.data(), channels.corners().size);
    upload_.add_bytes(location_at(channels.change().at), grid->change.data(), channels.change().size);
  }
}

void MarchUpload::plan_trees(gl::WordHeap& heap) {
  const auto bytes_of = [](const MarchData::Part& part) { return sizeof(Roots) + part.inner * sizeof(std::uint32_t); };
  std::size_t bytes = 0;
  for (MarchData::Part& part : data_.parts_) {
    part.tree = bytes;
    bytes += bytes_of(part);
  }
  data_.bytes_ += bytes;
  upload_.add([this, &heap, bytes] {
    data_.trees_ = heap.take(bytes, "creating the point-location tree");
    for (MarchData::Part& part : data_.parts_) {
      part.grid.tree = static_cast<std::uint32_t>((data_.trees_.offset() + part.tree + sizeof(Roots)) / 4);
    }
  });
  for (const MarchData::Part& part : data_.parts_) {
    const MarchData::Part* old = before_ == nullptr ? nullptr : before_->part_of(*part.source);
    const auto location_at = [this, first = part.tree](std::size_t at) {
      return [this, offset = first + at] {
        return Upload::Location{data_.trees_.buffer(), data_.trees_.offset() + offset};
      };
    };
    if (old != nullptr) {
      const auto from = [this, first = old->tree] {
        return Upload::Location{before_->trees_.buffer(), before_->trees_.offset() + first};
      };
      add_copy(location_at(0), from, bytes_of(part));
      continue;
    }
    const grid::TetGrid* grid = grid_of(part);
    if (grid == nullptr) {
      const auto from = [buffer = built_->at(part.source).tree.name()] { return Upload::Location{buffer, 0}; };
      add_copy(location_at(0), from, bytes_of(part));
      continue;
    }
    Roots roots{};
    std::ranges::copy(grid->roots, roots.begin());
    upload_.add([this, location = location_at(0), roots] {
      const Upload::Location to = location();
      gl_->NamedBufferSubData(to.buffer, static_cast<GLintptr>(to.offset), sizeof roots, roots.data());
    });
    upload_.add_bytes(location_at(sizeof roots), grid->tree.data(), grid->tree.size() * sizeof(std::uint32_t));
  }
}

void MarchUpload::plan_dense() {
  require_3d(limits_, source_->voxel_count(), "the dense grid");
  plan_voxels(data_.textures_[0], {&*source_->statistics}, GL_R16F, GL_RED, source_->density_a_value(),
              "creating the dense texture");
}

void MarchUpload::plan_channel_voxels() {
  using grid::Channel;
  const auto texture_of = [this](Channel channel) -> gl::Object& {
    return data_.voxel_channels_[grid::index_of(channel)];
  };
  const auto plan = [this](gl::Object& texture, const grid::RgbField& field, float unit, const char* what) {
    require_3d(limits_, source_->voxel_count(), "creating the voxel colors");
    plan_voxels(texture, {&field.component(0), &field.component(1), &field.component(2), nullptr}, GL_RGBA16F, GL_RGBA,
                1.0F / unit, what);
  };
  if (const grid::RgbField* emission = source_->channels.emission.get()) {
    data_.parts_[0].grid.emission_unit = emission->max_value();
    plan(texture_of(Channel::emission), *emission, data_.parts_[0].grid.emission_unit, "creating the voxel emission");
  }
  // The unit is that of density 1, so that the color is this value divided by the density.
  if (const grid::RgbField* scattering = source_->channels.scattering.get())
    plan(texture_of(Channel::color), *scattering, source_->max_value, "creating the voxel scattering data");
  if (const grid::ScalarField* forward = source_->channels.forward.get()) {
    require_3d(limits_, source_->voxel_count(), "creating the voxel anisotropy");
    plan_slabs(texture_of(Channel::anisotropy), {GL_R16_SNORM, GL_RED, GL_SHORT, 1}, "creating the voxel anisotropy",
               [this, forward](std::span<std::uint16_t> slab, int first, int last) {
                 const std::vector<float> scattering = scattering_slab(*source_, slab.size(), first, last);
                 for_slab(*source_, forward->statistics(), first, last, [&](std::size_t at, float value) {
                   slab[at] = static_cast<std::uint16_t>(grid::pack_anisotropy(value, scattering[at]));
                 });
               });
  }
  if (const grid::DensityEnds* ends = source_->channels.ends.get(); ends != nullptr && source_->march == March::dense) {
    require_3d(limits_, source_->voxel_count(), "creating the voxel changes");
    plan_slabs(data_.changes_, {GL_R16F, GL_RED, GL_HALF_FLOAT, 1}, "creating the voxel changes",
               [this, ends](std::span<std::uint16_t> slab, int first, int last) {
                 std::vector<float> changes(slab.size());
                 const float half = 0.5F * source_->density_a_value();
                 const auto add = [&](const grid::ScalarField& end, float weight) {
                   for_slab(*source_, end.statistics(), first, last,
                            [&](std::size_t at, float value) { changes[at] += weight * value; });
                 };
                 add(ends->open, -half);
                 add(ends->close, half);
                 std::ranges::transform(changes, slab.begin(), [](float value) { return glm::packHalf1x16(value); });
               });
  }
  const bool shows_motion = holds_motion(limits_, source_->voxel_count());
  if (!shows_motion) data_.parts_[0].grid.moves = 0;
  if (const grid::MomentumField* momentum = source_->channels.momentum.get(); momentum != nullptr && shows_motion) {
    plan_slabs(texture_of(Channel::velocity), {GL_RGBA16F, GL_RGBA, GL_HALF_FLOAT, 4}, "creating the voxel velocities",
               [this, momentum](std::span<std::uint16_t> slab, int first, int last) {
                 std::vector<glm::dvec3> sums(slab.size() / 4);
                 for (std::size_t i = 0; i < 3; ++i) {
                   for_slab(*source_, momentum->component(i), first, last,
                            [&](std::size_t at, float value) { sums[at][static_cast<int>(i)] = value; });
                 }
                 for_slab(*source_, *source_->statistics, first, last, [&](std::size_t at, float density) {
                   const glm::uvec2 packed = grid::pack_velocity(sums[at], density, momentum->fastest());
                   std::memcpy(&slab[4 * at], &packed, sizeof packed);
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
  const ivec3 size = source_->voxel_count();
  data_.bytes_ += static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y) *
                  static_cast<std::uint64_t>(size.z) * 2 * texels.count;
  upload_.add([this, &texture, size, texels, what] {
    texture = gl::make_texture_3d(owner_, texels.stored, size.x, size.y, size.z, what);
  });
  // One layer of bricks per step bounds the memory.
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
  require_3d(limits_, bricks, "the brick grid");
  if (static_cast<std::int64_t>(source_->brick_values.size()) > limits_.texture_buffer_texels) {
    throw Error(ErrorCode::unsupported, "the brick grid needs " + std::to_string(source_->brick_values.size()) +
                                            " texels; this driver's GL_MAX_TEXTURE_BUFFER_SIZE is " +
                                            std::to_string(limits_.texture_buffer_texels));
  }
  const std::size_t bytes = source_->brick_values.size() * 2;
  data_.bytes_ += bytes;
  upload_.add([this, bytes] {
    const char* what = "creating the buffer of bricks";
    data_.brick_values_ = gl::make_buffer(owner_, bytes, nullptr, GL_DYNAMIC_STORAGE_BIT, what);
    data_.textures_[0] = gl::make_texture_buffer(owner_, GL_R16F, data_.brick_values_, what);
  });
  upload_.add_bytes(
      [this] {
        return Upload::Location{data_.brick_values_.name(), 0};
      },
      source_->brick_values.data(), bytes);
  if (const std::size_t changes = source_->brick_changes.size() * 2; changes > 0) {
    data_.bytes_ += changes;
    upload_.add([this, changes] {
      const char* what = "creating the buffer of brick changes";
      data_.brick_changes_ = gl::make_buffer(owner_, changes, nullptr, GL_DYNAMIC_STORAGE_BIT, what);
      data_.changes_ = gl::make_texture_buffer(owner_, GL_R16F, data_.brick_changes_, what);
    });
    upload_.add_bytes(
        [this] {
          return Upload::Location{data_.brick_changes_.name(), 0};
        },
        source_->brick_changes.data(), changes);
  }
  data_.bytes_ += source_->brick_slots.size() * 4;
  upload_.add([this, bricks] {
    data_.textures_[1] =
        gl::make_texture_3d(owner_, GL_R32UI, bricks.x, bricks.y, bricks.z, "creating the brick slots");
    gl_->PixelStorei(GL_UNPACK_ALIGNMENT, 4);
    gl_->TextureSubImage3D(data_.textures_[1].name(), 0, 0, 0, 0, bricks.x, bricks.y, bricks.z, GL_RED_INTEGER,
                           GL_UNSIGNED_INT, source_->brick_slots.data());
  });
}

bool MarchData::is_wide() const {
  const auto wide = [](const Part& part) { return core::cm_is_wide(part.grid.root_exponent); };
  return march_ == March::tet && std::ranges::any_of(parts_, wide);
}

void MarchData::bind(const gl::Functions& gl) const {
  // All pages that a program may declare are bound. Extra ones repeat the last page and are not read.
  for (std::size_t i = 0; !cells_.empty() && i < max_pages; ++i)
    cells_[std::min(i, cells_.size() - 1)].bind(gl, core::CM_UNIT_CELLS + static_cast<GLuint>(i));
  const auto bind_texture = [&](GLuint unit, const gl::Object& texture, GLenum target) {
    if (texture) gl.BindTextureUnit(unit, texture.name(), target);
  };
  const GLenum values = march_ == March::brick ? GL_TEXTURE_BUFFER : GL_TEXTURE_3D;
  bind_texture(core::CM_UNIT_VOXELS, textures_[0], values);
  bind_texture(core::CM_UNIT_BRICK_SLOTS, textures_[1], GL_TEXTURE_3D);
  for (std::size_t i = 0; i < voxel_channels_.size(); ++i)
    bind_texture(core::CM_UNIT_CHANNEL_VOXELS + static_cast<GLuint>(i), voxel_channels_[i], GL_TEXTURE_3D);
  bind_texture(core::CM_UNIT_CHANGE_VOXELS, changes_, values);
  if (channels_) channels_.bind(gl, core::CM_UNIT_CHANNELS);
  if (trees_) trees_.bind(gl, core::CM_UNIT_TREE);
}

}  // namespace cumulet::render
