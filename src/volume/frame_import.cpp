#include "volume/frame_import.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "base/number_text.hpp"
#include "settings/grid_names.hpp"
#include "volume/bricks.hpp"
#include "volume/coarse_reader.hpp"
#include "volume/resample.hpp"

namespace cumulet::volume {

using namespace detail;

namespace {

using settings::flame_names;
using settings::temperature_names;
constexpr std::array<std::string_view, 3> color_names = {"cd", "color", "colour"};
constexpr std::array<std::string_view, 4> anisotropy_names = {"anisotropy", "scatter_anisotropy", "phase_anisotropy",
                                                              "phase_g"};
constexpr const char* no_grid = "none";

/// The chosen grids, as indices into the file's list.
struct Chosen {
  std::optional<std::size_t> density, temperature, flame, anisotropy;
  std::vector<std::size_t> color;     ///< empty; one vector grid; or red, green and blue
  std::vector<std::size_t> velocity;  ///< empty; one vector grid; or along x, y and z

  [[nodiscard]] std::vector<std::size_t> all() const {
    std::vector<std::size_t> out = color;
    out.insert(out.end(), velocity.begin(), velocity.end());
    for (const auto& field : {density, temperature, flame, anisotropy}) {
      if (field) out.push_back(*field);
    }
    return out;
  }
};

bool by_name(const std::string& name) { return name.empty(); }

/// Returns the three channel grids of this name.
std::vector<std::size_t> channels(const std::vector<GridInfo>& grids, const std::string& name) {
  std::vector<std::size_t> found;
  for (const char* suffix : {"_r", "_g", "_b"}) {
    const std::string channel = name + suffix;
    const auto grid = first_fog(grids, std::array<std::string_view, 1>{channel});
    if (!grid) return {};
    found.push_back(*grid);
  }
  return found;
}

/// Returns why a grid cannot hold colors; empty if it can.
std::string color_refusal(const GridInfo& grid) {
  if (grid.values != Values::lengths || grid.type == "vec3i") return "has type " + grid.type + ", not vec3s or vec3d";
  if (grid.grid_class == "staggered") return "is staggered: it contains velocities, not colors";
  return {};
}

/// Returns why a grid cannot hold velocities; empty if it can.
std::string velocity_refusal(const GridInfo& grid) {
  return grid.values == Values::lengths ? std::string() : "has type " + grid.type + ", not a vector type";
}

/// Returns the vector grid of this name, or else the three scalar grids. parts: their suffixes.
std::vector<std::size_t> choose_vectors(const std::vector<GridInfo>& grids, const std::string& name,
                                        std::string (*refusal)(const GridInfo&), std::vector<std::size_t> three,
                                        const std::array<const char*, 3>& parts) {
  const std::vector<std::size_t> whole = named(grids, name);
  const bool usable = std::ranges::any_of(whole, [&](std::size_t i) { return refusal(grids[i]).empty(); });
  if (!three.empty() && !usable) return three;
  if (whole.empty()) {
    fail_without(grids, "has no vector grid \"" + name + "\", and not all of \"" + name + parts[0] + "\", \"" + name +
                            parts[1] + "\" and \"" + name + parts[2] + "\"; it has ");
  }
  return {choose_named(grids, name, refusal)};
}

std::vector<std::size_t> choose_velocity(const std::vector<GridInfo>& grids, const std::string& name,
                                         std::span<const std::size_t> taken) {
  if (name == no_grid) return {};
  if (!by_name(name)) return choose_vectors(grids, name, velocity_refusal, along_axes(grids, name), {"x", "y", "z"});
  const auto free = [&](std::size_t i) { return std::ranges::find(taken, i) == taken.end(); };
  const auto is_vector = [](const GridInfo& grid) { return velocity_refusal(grid).empty(); };
  for (const std::string_view likely : velocity_names) {
    std::vector<std::size_t> found = called_so(grids, likely, is_vector);
    std::erase_if(found, [&](std::size_t i) { return !free(i); });
    if (!found.empty()) return {found.front()};
    found = along_axes(grids, likely);
    if (!found.empty() && std::ranges::all_of(found, free)) return found;
  }
  for (std::size_t i = 0; i < grids.size(); ++i) {
    if (free(i) && is_vector(grids[i]) && grids[i].grid_class == "staggered") return {i};
  }
  return {};
}

std::vector<std::size_t> choose_color(const std::vector<GridInfo>& grids, const std::string& name) {
  if (name == no_grid) return {};
  if (!by_name(name)) return choose_vectors(grids, name, color_refusal, channels(grids, name), {"_r", "_g", "_b"});
  for (const std::string_view likely : color_names) {
    const auto found = called_so(grids, likely, [](const GridInfo& grid) { return color_refusal(grid).empty(); });
    if (!found.empty()) return {found.front()};
  }
  return {};
}

Chosen choose(const std::vector<GridInfo>& grids, const GridNames& names) {
  if (grids.empty()) fail("contains no grids");
  // A grid that is named for one field is not chosen for another.
  std::vector<std::size_t> taken;
  const auto asked = [&](const std::string& name) -> std::optional<std::size_t> {
    if (by_name(name) || name == no_grid) return std::nullopt;
    taken.push_back(choose_grid(grids, name));
    return taken.back();
  };
  Chosen out{asked(names.density),    asked(names.temperature),         asked(names.flame),
             asked(names.anisotropy), choose_color(grids, names.color), {}};
  if (!by_name(names.color)) taken.insert(taken.end(), out.color.begin(), out.color.end());
  out.velocity = choose_velocity(grids, names.velocity, taken);
  if (!by_name(names.velocity)) taken.insert(taken.end(), out.velocity.begin(), out.velocity.end());
  const auto find = [&](std::optional<std::size_t>& field, const std::string& name,
                        std::span<const std::string_view> likely) {
    if (by_name(name)) field = first_fog(grids, likely, taken);
  };
  find(out.density, names.density, density_names);
  find(out.temperature, names.temperature, temperature_names);
  find(out.flame, names.flame, flame_names);
  find(out.anisotropy, names.anisotropy, anisotropy_names);
  const bool nothing = !out.density && !out.temperature && !out.flame;
  if (nothing && !by_name(names.density)) fail_without(grids, "all fields are excluded; the file has ");
  if (nothing) {
    if (out.anisotropy) taken.push_back(*out.anisotropy);
    const auto left = any_fog(grids, taken);
    out.density = left ? *left : choose_grid(grids, {});
    if (out.density == out.anisotropy) out.anisotropy.reset();
  }
  return out;
}

double voxel_size(const ScalarVolume& field) { return std::abs(glm::determinant(glm::dmat3(field.index_to_world))); }

/// Whether field a is preferred for the lattice if there is no density: smaller voxels, then more voxels.
bool finer(const ScalarVolume& a, const ScalarVolume& b) {
  constexpr double alike = 1e-6;
  const double size_a = voxel_size(a);
  const double size_b = voxel_size(b);
  if (std::abs(size_a - size_b) > alike * size_b) return size_a < size_b;
  return a.active_voxels > b.active_voxels;
}

bool apart(const ScalarVolume& a, const ScalarVolume& b) {
  return Box{a.bounds_min, a.bounds_max}.clipped({b.bounds_min, b.bounds_max}).empty();
}

/// Returns a remark on a temperature whose values are not in the usual range of simulations, 0 to 3. The text is the
/// same for all frames of a sequence.
std::string remark_on_temperature(const ScalarVolume& field) {
  if (field.max_value > max_relative_temperature && field.negative_voxels > 0)
    return "has negative values and values in the hundreds, which may be degrees Celsius; they are read as kelvin. Set "
           "temperature_offset to 273.15 for Celsius";
  if (field.max_value > max_relative_temperature)
    return "has values above 20, which are read as kelvin unless temperature_scale is set";
  if (field.max_value > 0.0F && field.max_value <= 1.0F)
    return "has values from 0 to 1; 1 is read as 1500 kelvin unless temperature_scale is set";
  return {};
}

/// Whether vectors are in their grid's own index space, by OpenVDB's metadata.
bool is_local(const GridInfo& grid) {
  const auto says = [&](std::string_view name, std::string_view value) {
    return std::ranges::any_of(
        grid.metadata, [&](const Metadata& entry) { return entry.name == name && entry.value.starts_with(value); });
  };
  return says("is_local_space", "true") && says("vector_type", "contravariant");
}

class FrameImport {
 public:
  FrameImport(std::string file, const Log& log, Progress* progress)
      : file_(std::move(file)), log_(log), progress_(progress) {}

  VolumeFrame run(Reader& reader, const GridNames& names) {
    for (const std::string& text : reader.remarks()) remark(LogLevel::warning, file_, text);
    const Chosen chosen = choose(reader.grids(), names);
    if (by_name(names.density) && chosen.density) {
      remark(LogLevel::warning, file_, remark_on_choice(reader.grids(), *chosen.density, chosen.all()));
    }
    remark_on_case(reader.grids(), chosen, names);
    if (by_name(names.color) && chosen.color.empty()) remark_on_color(reader.grids());
    const Portion whole{reader.opened(), 1.0};
    velocity_is_named_ = !by_name(names.velocity);
    read(reader, chosen, whole.part(0.0, reading));
    return finish(chosen.density.has_value(), whole.part(reading, 1.0));
  }

  VolumeFrame run(std::span<const MemoryField> fields) {
    velocity_is_named_ = true;
    bool has_density = false;
    Shares shares(Portion{}.part(0.0, reading), fields.size());
    for (const MemoryField& field : fields) {
      has_density = has_density || field.channel == Channel::density;
      const Portion share = shares.next();
      naming(file_ + ": " + cumulet::volume::name_of(field.channel), [&] { take(field, share); });
    }
    return finish(has_density, Portion{}.part(reading, 1.0));
  }

 private:
  static constexpr double reading = 0.8;  // fraction of an import's time

  VolumeFrame finish(bool has_density, Portion portion) {
    const auto any = [](const std::optional<ScalarVolume>& field) { return field && !field->empty(); };
    if (!has_density || (out_.density.empty() && (any(out_.flame) || any(out_.temperature)))) {
      const bool comparable = any(out_.flame) == any(out_.temperature) && out_.flame && out_.temperature;
      const bool by_flame = comparable ? finer(*out_.flame, *out_.temperature) : any(out_.flame) || !out_.temperature;
      out_.density.index_to_world = (by_flame ? *out_.flame : *out_.temperature).index_to_world;
      out_.density.bounds_max = out_.density.bounds_min;
    }
    put_all_on_lattice(portion);
    return std::move(out_);
  }

  void take(const MemoryField& field, Portion portion) {
    constexpr double finding = 0.3;
    SourceGrid source = source_of(field, progress_, portion.part(0.0, finding));
    const std::string name = cumulet::volume::name_of(field.channel);
    const std::string prefix = one_line(file_ + ": " + name) + ": ";
    const auto numbers = [&] {
      ScalarVolume volume = assemble(std::move(source), log_, prefix, progress_, portion.part(finding, 1.0));
      volume.name = name;
      return volume;
    };
    const auto signs = [&] {
      return assemble_signed(std::move(source), name, log_, prefix, progress_, portion.part(finding, 1.0));
    };
    const auto component = [&](Channel first) {
      return static_cast<std::size_t>(field.channel) - static_cast<std::size_t>(first);
    };
    switch (field.channel) {
      case Channel::density:
        out_.density = numbers();
        break;
      case Channel::temperature:
        out_.temperature = numbers();
        break;
      case Channel::flame:
        out_.flame = numbers();
        break;
      case Channel::red:
      case Channel::green:
      case Channel::blue:
        if (!out_.color) out_.color.emplace();
        out_.color->at(component(Channel::red)) = numbers();
        break;
      case Channel::anisotropy:
        out_.anisotropy = signs();
        clamp_anisotropy();
        break;
      case Channel::velocity_x:
      case Channel::velocity_y:
      case Channel::velocity_z:
        if (!out_.velocity) out_.velocity.emplace();
        std::ranges::move(
            signs(), out_.velocity->parts.begin() + static_cast<std::ptrdiff_t>(2 * component(Channel::velocity_x)));
        break;
    }
  }

  /// Splits a range of the load's progress into equal parts.
  class Shares {
   public:
    Shares(Portion portion, std::size_t count) : portion_(portion), share_(1.0 / static_cast<double>(count)) {}
    Portion next() {
      const double from = share_ * done_++;
      return portion_.part(from, from + share_);
    }

   private:
    Portion portion_;
    double share_;
    int done_ = 0;
  };

  void read(Reader& reader, const Chosen& chosen, Portion portion) {
    Shares shares(portion, chosen.all().size());
    const auto field = [&](std::size_t grid) {
      return import_grid(reader, grid, file_, log_, progress_, shares.next());
    };
    if (chosen.density) out_.density = field(*chosen.density);
    if (chosen.temperature) {
      out_.temperature = field(*chosen.temperature);
      remark(LogLevel::info, name_of(*out_.temperature), remark_on_temperature(*out_.temperature));
    }
    if (chosen.flame) out_.flame = field(*chosen.flame);
    if (chosen.anisotropy) {
      out_.anisotropy = import_signed_grid(reader, *chosen.anisotropy, file_, log_, progress_, shares.next());
      clamp_anisotropy();
    }
    if (chosen.color.size() == 1) {
      out_.color = import_vector_grid(reader, chosen.color[0], file_, log_, progress_, shares.next());
    } else if (!chosen.color.empty()) {
      std::ranges::transform(chosen.color, out_.color.emplace().begin(), field);
    }
    if (chosen.velocity.empty()) return;
    try_velocity([&] { out_.velocity = read_velocity(reader, chosen.velocity, shares); });
  }

  /// Images do not need a velocity: one that was not named explicitly is left out if it fails.
  template <class Work>
  void try_velocity(const Work& work) const {
    try {
      work();
    } catch (const Error& error) {
      const bool of_the_grid = error.code() != ErrorCode::cancelled && error.code() != ErrorCode::out_of_memory;
      if (velocity_is_named_ || !of_the_grid) throw;
      remark(LogLevel::warning, error.what(), "the velocity is ignored");
    }
  }

  Velocity read_velocity(Reader& reader, const std::vector<std::size_t>& grids, Shares& shares) const {
    Velocity velocity;
    std::array<std::array<ScalarVolume, 2>, 3> axes;
    if (grids.size() == 1) {
      axes = import_signed_vector_grid(reader, grids[0], file_, log_, progress_, shares.next());
    } else {
      std::ranges::transform(grids, axes.begin(), [&](std::size_t grid) {
        return import_signed_grid(reader, grid, file_, log_, progress_, shares.next());
      });
    }
    const GridInfo& first = reader.grids()[grids[0]];
    if (is_local(first)) velocity.to_index = glm::dmat3(axes[0][0].index_to_world);
    const bool staggered = grids.size() == 1 && first.grid_class == "staggered";
    for (int axis = 0; axis < 3; ++axis) {
      for (std::size_t sign = 0; sign < 2; ++sign) {
        ScalarVolume& part = axes[static_cast<std::size_t>(axis)][sign];
        // The component is on the face shared with the previous voxel.
        if (staggered) part.index_to_world[3] -= 0.5 * part.index_to_world[axis];
        velocity.parts[2 * static_cast<std::size_t>(axis) + sign] = std::move(part);
      }
    }
    return velocity;
  }

  void put_all_on_lattice(Portion portion) {
    Shares shares(portion, out_.beside_density().size());
    std::optional<Velocity> velocity = std::exchange(out_.velocity, std::nullopt);
    const auto put = [&](ScalarVolume& field, const std::optional<Box>& within) {
      const std::string name = name_of(field);
      naming(name, [&] { put_on_lattice(field, within, shares.next()); });
    };
    for (ScalarVolume* field : out_.beside_density()) put(*field, std::nullopt);
    if (out_.temperature) warn_if_apart({&*out_.temperature, 1});
    if (out_.color) warn_if_apart(*out_.color);
    if (out_.anisotropy) warn_if_apart(*out_.anisotropy);
    if (velocity) {
      try_velocity([&] {
        bring_to_index(*velocity);
        // Velocity matters only where matter scatters.
        std::optional<Box> within;
        if (!out_.density.empty()) within = Box{out_.density.bounds_min - 1, out_.density.bounds_max + 1};
        const bool moves = std::ranges::any_of(velocity->parts, [](const auto& part) { return part.max_value > 0.0F; });
        for (ScalarVolume& part : velocity->parts) put(part, within);
        if (moves) warn_if_elsewhere(velocity->parts);
        out_.velocity = std::move(velocity);
      });
    }
  }

  // Clamps values, and returns the number of voxels that were clamped.
  static std::uint64_t clamp_to(float most, std::span<ScalarVolume> parts) {
    std::uint64_t beyond = 0;
    const auto clamp = [&](float& value, std::uint64_t voxels) {
      if (value > most) beyond += voxels;
      value = std::min(value, most);
    };
    for (ScalarVolume& part : parts) {
      if (part.max_value > most) {
        for (float& value : part.brick_values.as_floats()) clamp(value, 1);
      }
      for (Tile& tile : part.tiles) clamp(tile.value, voxels_of(tile));
      clamp(part.background, 0);
      clamp(part.max_value, 0);
    }
    return beyond;
  }

  void clamp_anisotropy() {
    const std::uint64_t beyond = clamp_to(1.0F, *out_.anisotropy);
    if (beyond == 0) return;
    remark(LogLevel::warning, name_of((*out_.anisotropy)[0]),
           std::to_string(beyond) + " voxels clamped to the range from -1 to 1");
  }

  // Converts to_index from the file's world to the lattice, and clamps speeds to the range of half floats.
  void bring_to_index(Velocity& velocity) const {
    velocity.to_index = Velocity::to_index_of(out_.density.index_to_world) * velocity.to_index;
    const std::uint64_t beyond = clamp_to(velocity.most(), velocity.parts);
    if (beyond == 0) return;
    remark(
        LogLevel::warning, name_of(velocity.parts[0]),
        std::to_string(beyond) + " components above " + general_text(fastest_velocity) + " voxels per second clamped");
  }

  void put_on_lattice(ScalarVolume& field, const std::optional<Box>& within, Portion portion) const {
    const glm::dmat4& lattice = out_.density.index_to_world;
    const Box bounds{field.bounds_min, field.bounds_max};
    const bool aligned = field.empty() || same_positions(field.index_to_world, lattice, bounds);
    const bool clipped = within && !within->contains(bounds) && field.background == 0.0F;
    if (!aligned || (clipped && !field.empty())) {
      constexpr double sampling = 0.7;
      SourceGrid source = aligned ? bricks_within(field, *within)
                                  : resample(field, lattice, within, progress_, portion.part(0.0, sampling));
      // Warnings about its values were already logged.
      ScalarVolume volume = assemble(std::move(source), {}, {}, progress_, portion.part(sampling, 1.0));
      volume.name = field.name;
      volume.negative_voxels = field.negative_voxels;
      volume.non_finite_voxels = field.non_finite_voxels;
      volume.huge_voxels = field.huge_voxels;
      field = std::move(volume);
    }
    field.index_to_world = lattice;
  }

  /// Density has its own remark: remark_on_choice().
  void remark_on_case(const std::vector<GridInfo>& grids, const Chosen& chosen, const GridNames& names) const {
    const std::vector<std::size_t> shown = chosen.all();
    const auto remark_on = [&](const char* field, const std::string& name, std::span<const std::size_t> found) {
      if (!by_name(name)) return;
      for (const std::string& text : remarks_on_case(grids, field, found, shown)) {
        remark(LogLevel::warning, file_, text);
      }
    };
    const auto remark_on_one = [&](const char* field, const std::string& name,
                                   const std::optional<std::size_t>& found) {
      if (found) remark_on(field, name, {&*found, 1});
    };
    remark_on_one("temperature", names.temperature, chosen.temperature);
    remark_on_one("flame", names.flame, chosen.flame);
    remark_on_one("anisotropy", names.anisotropy, chosen.anisotropy);
    remark_on("color", names.color, chosen.color);
    remark_on("velocity", names.velocity, chosen.velocity);
  }

  void remark_on_color(const std::vector<GridInfo>& grids) const {
    for (const std::string_view name : color_names) {
      const std::vector<std::size_t> found = channels(grids, std::string(name));
      if (found.empty()) continue;
      remark(LogLevel::info, file_,
             "color can be read from " + describe(grids, found) + ", but only if the grid is named");
      return;
    }
  }

  /// Ignores empty parts of a field, such as the negative part of an anisotropy that is positive everywhere.
  void warn_if_apart(std::span<const ScalarVolume> parts) const {
    if (!std::ranges::all_of(parts, [](const ScalarVolume& part) { return part.empty(); })) warn_if_elsewhere(parts);
  }

  /// Empty parts count as not overlapping.
  void warn_if_elsewhere(std::span<const ScalarVolume> parts) const {
    const auto elsewhere = [&](const ScalarVolume& part) { return part.empty() || apart(part, out_.density); };
    if (out_.density.empty() || !std::ranges::all_of(parts, elsewhere)) return;
    remark(LogLevel::warning, name_of(parts[0]), "does not overlap \"" + out_.density.name + "\"");
  }

  [[nodiscard]] std::string name_of(const ScalarVolume& field) const { return file_ + ": grid \"" + field.name + "\""; }

  void remark(LogLevel level, const std::string& what, const std::string& text) const {
    if (!text.empty()) log_.write(level, one_line(what + ": " + text));
  }

  std::string file_;
  const Log& log_;
  Progress* progress_;
  bool velocity_is_named_ = false;
  VolumeFrame out_;
};

}  // namespace

std::vector<std::string> channels_by_name(const std::vector<GridInfo>& grids) {
  std::vector<std::string> channels(grids.size());
  for (const std::size_t grid : choose_velocity(grids, {}, {})) channels[grid] = "velocity";
  Chosen chosen;
  try {
    chosen = choose(grids, {});
  } catch (const std::runtime_error&) {
    // No grid can be used as density.
  }
  for (const std::size_t grid : chosen.color) channels[grid] = "color";
  const auto name = [&](const std::optional<std::size_t>& grid, const char* field) {
    if (grid) channels[*grid] = field;
  };
  name(chosen.density, "density");
  name(chosen.temperature, "temperature");
  name(chosen.flame, "flame");
  name(chosen.anisotropy, "anisotropy");
  return channels;
}

VolumeFrame import_frame(const FilePath& file, const GridNames& names, const Log& log, Progress* progress) {
  return naming(file.given(),
                [&] { return FrameImport(file.given(), log, progress).run(*open(file.absolute(), progress), names); });
}

namespace {

// Returns nullopt on any failure. If the full-resolution import fails too, it reports the error.
std::optional<Proxy> proxy_of(CoarseReader& coarse, const std::string& file, GridNames names,
                              const Progress* progress) {
  try {
    names.color = names.anisotropy = names.velocity = no_grid;
    const Log silent;
    Proxy made{.frame = FrameImport(file, silent, nullptr).run(coarse, names), .extent = {}};
    made.extent = coarse.extent(made.frame);
    return made;
  } catch (...) {
    check(progress);
    return std::nullopt;
  }
}

// Lower bound of a brick's size in any file: two copies of its mask.
constexpr std::uint64_t min_bytes_per_brick = 128;

}  // namespace

VolumeFrame import_frame(std::unique_ptr<ByteSource> content, const std::string& name, const GridNames& names,
                         const Log& log) {
  return naming(name, [&] { return FrameImport(name, log, nullptr).run(*open(std::move(content), nullptr), names); });
}

VolumeFrame import_frame(const FilePath& file, const GridNames& names, const Log& log, Progress* progress,
                         const ProxyRequest& proxy) {
  return naming(file.given(), [&] {
    const std::filesystem::path path = file.absolute();
    const std::unique_ptr<Reader> reader = open(path, progress);
    FrameImport import(file.given(), log, progress);
    std::error_code unknown;
    const bool is_large = std::filesystem::file_size(path, unknown) / min_bytes_per_brick >= proxy.min_bricks;
    if (!is_large || unknown || !reader->streams()) return import.run(*reader, names);
    CoarseReader coarse(*reader, proxy.min_bricks, progress);
    if (auto made = proxy_of(coarse, file.given(), names, progress)) proxy.take(std::move(*made));
    CoarseReader::Rest rest(coarse);
    return import.run(rest, names);
  });
}

VolumeFrame import_fields(std::span<const MemoryField> fields, const std::string& name, const Log& log,
                          Progress* progress) {
  return naming(name, [&] { return FrameImport(name, log, progress).run(fields); });
}

}  // namespace cumulet::volume
