#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "volume/frame.hpp"
#include "volume/import_detail.hpp"

namespace cumulet::volume {

using namespace detail;

namespace {

constexpr std::array<std::string_view, 3> temperature_names = {"temperature", "heat", "temp"};
constexpr std::array<std::string_view, 5> flame_names = {"flame", "flames", "fire", "burn", "fuel"};
constexpr std::array<std::string_view, 3> colour_names = {"cd", "color", "colour"};
constexpr const char* no_grid = "none";

/// Places in the file's list of grids.
struct Chosen {
  std::optional<std::size_t> density, temperature, flame;
  std::vector<std::size_t> colour;  ///< none, or red, green and blue

  [[nodiscard]] std::vector<std::size_t> all() const {
    std::vector<std::size_t> out = colour;
    for (const auto& field : {density, temperature, flame}) {
      if (field) out.push_back(*field);
    }
    return out;
  }
};

bool by_name(const std::string& name) { return name.empty(); }

/// The grids of three channels of one name.
std::vector<std::size_t> channels(const std::vector<GridInfo>& grids, const std::string& name) {
  std::vector<std::size_t> found;
  for (const char* suffix : {"_r", "_g", "_b"}) {
    const std::string channel = lower_case(name) + suffix;
    const auto grid = first_fog(grids, std::array<std::string_view, 1>{channel});
    if (!grid) return {};
    found.push_back(*grid);
  }
  return found;
}

std::vector<std::size_t> choose_colour(const std::vector<GridInfo>& grids, const std::string& name) {
  if (name == no_grid) return {};
  if (!by_name(name)) {
    std::vector<std::size_t> found = channels(grids, name);
    if (found.empty()) {
      fail_without(grids, "has no grid of vectors \"" + name + "\", nor all of \"" + name + "_r\", \"" + name +
                              "_g\" and \"" + name + "_b\"; it has ");
    }
    return found;
  }
  for (const std::string_view likely : colour_names) {
    std::vector<std::size_t> found = channels(grids, std::string(likely));
    if (!found.empty()) return found;
  }
  return {};
}

Chosen choose(const std::vector<GridInfo>& grids, const GridNames& names) {
  if (grids.empty()) fail("holds no grids");
  // What is named for one field is not found for another.
  std::vector<std::size_t> taken;
  const auto asked = [&](const std::string& name) -> std::optional<std::size_t> {
    if (by_name(name) || name == no_grid) return std::nullopt;
    taken.push_back(choose_grid(grids, name));
    return taken.back();
  };
  Chosen out{asked(names.density), asked(names.temperature), asked(names.flame), choose_colour(grids, names.colour)};
  const auto find = [&](std::optional<std::size_t>& field, const std::string& name,
                        std::span<const std::string_view> likely) {
    if (by_name(name)) field = first_fog(grids, likely, taken);
  };
  find(out.density, names.density, density_names);
  find(out.temperature, names.temperature, temperature_names);
  find(out.flame, names.flame, flame_names);
  const bool nothing = !out.density && !out.temperature && !out.flame;
  if (nothing && !by_name(names.density)) fail_without(grids, "every field is left out; it has ");
  if (nothing) out.density = choose_grid(grids, {});
  return out;
}

double voxel_size(const ScalarVolume& field) { return std::abs(glm::determinant(glm::dmat3(field.index_to_world))); }

/// The field that the lattice is taken from where there is no density: of the smallest voxels, then of the most.
bool finer(const ScalarVolume& a, const ScalarVolume& b) {
  constexpr double alike = 1e-6;
  const double size_a = voxel_size(a);
  const double size_b = voxel_size(b);
  if (std::abs(size_a - size_b) > alike * size_b) return size_a < size_b;
  return a.active_voxels > b.active_voxels;
}

/// Whether voxels of both lie in the same places, within a thousandth of a voxel.
bool same_lattice(const glm::dmat4& field, const glm::dmat4& lattice, const Box& voxels) {
  const glm::dmat4 to_field = glm::inverse(field) * lattice;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec4 p((corner & 1) != 0 ? voxels.max.x : voxels.min.x, (corner & 2) != 0 ? voxels.max.y : voxels.min.y,
                       (corner & 4) != 0 ? voxels.max.z : voxels.min.z, 1.0);
    const glm::dvec4 moved = glm::abs(to_field * p - p);
    if (!(std::max({moved.x, moved.y, moved.z}) < 1e-3)) return false;
  }
  return true;
}

void put_on(const glm::dmat4& lattice, ScalarVolume& field) {
  if (!same_lattice(field.index_to_world, lattice, {field.bounds_min, field.bounds_max})) {
    fail("is on another lattice than the file's other fields");
  }
  field.index_to_world = lattice;
}

}  // namespace

VolumeFrame import_frame(const std::filesystem::path& file, const GridNames& names, const Log& log,
                         Progress* progress) {
  return naming(file.string(), [&] {
    const std::unique_ptr<Reader> reader = open(file, progress);
    const std::vector<GridInfo>& grids = reader->grids();
    const Chosen chosen = choose(grids, names);
    const std::vector<std::size_t> shown = chosen.all();
    if (by_name(names.density) && chosen.density) {
      const std::string remark = remark_on_choice(grids, *chosen.density, shown);
      if (!remark.empty()) log.warning(one_line(file.string() + ": " + remark));
    }

    const Portion whole{reader->opened(), 1.0};
    const double share = 1.0 / static_cast<double>(shown.size());
    std::size_t done = 0;
    const auto import = [&](std::size_t grid) {
      const double from = share * static_cast<double>(done++);
      return import_grid(*reader, grid, file.string(), log, progress, whole.part(from, from + share));
    };
    VolumeFrame out;
    if (chosen.density) out.density = import(*chosen.density);
    if (chosen.temperature) out.temperature = import(*chosen.temperature);
    if (chosen.flame) out.flame = import(*chosen.flame);
    if (!chosen.colour.empty()) {
      auto& colour = out.colour.emplace();
      for (std::size_t i = 0; i < colour.size(); ++i) colour[i] = import(chosen.colour[i]);
    }

    if (!chosen.density) {
      const bool by_flame = out.flame && (!out.temperature || finer(*out.flame, *out.temperature));
      out.density.index_to_world = (by_flame ? *out.flame : *out.temperature).index_to_world;
      out.density.bounds_max = out.density.bounds_min;
    }
    const auto place = [&](ScalarVolume& field) {
      naming(one_line(file.string() + ": grid \"" + field.name + "\""),
             [&] { put_on(out.density.index_to_world, field); });
    };
    if (out.temperature) place(*out.temperature);
    if (out.flame) place(*out.flame);
    if (out.colour) std::ranges::for_each(*out.colour, place);
    return out;
  });
}

}  // namespace cumulet::volume
