#include "volume/value_unit.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <vector>

#include "base/progress_part.hpp"

namespace cumulet::volume {

double value_unit(float max_value) {
  constexpr float least = 0x1p-32F;
  constexpr float most = 0x1p32F;
  if (max_value == 0.0F || (max_value >= least && max_value <= most)) return 1.0;
  return std::ldexp(1.0, std::ilogb(max_value));
}

ScalarVolume in_units_of(double unit, ScalarVolume volume, const Progress* progress) {
  if (unit == 1.0) return volume;
  const double inverse = 1.0 / unit;
  const auto convert = [&](float& value) { value = static_cast<float>(value * inverse); };
  std::vector<float>& values = volume.brick_values.as_floats();
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, values.size(), 64 * brick_voxels), [&](const auto& range) {
    check(progress);
    for (std::size_t i = range.begin(); i != range.end(); ++i) convert(values[i]);
  });
  for (Tile& tile : volume.tiles) convert(tile.value);
  convert(volume.background);
  convert(volume.max_value);
  return volume;
}

}  // namespace cumulet::volume
