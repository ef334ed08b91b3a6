// Display settings of the C ABI.

#include <memory>

#include "render/passes/display_lut.hpp"
#include "viewer/c_settings.hpp"
#include "viewer/c_viewer.hpp"

namespace {

using namespace cumulet::c_abi;
namespace core = cumulet::viewer;
namespace render = cumulet::render;

constexpr std::uint32_t min_points = 2;
constexpr std::uint32_t max_points = 65;

render::DisplayLutPtr display_lut_of(const cumulet_display_lut_desc& d) {
  require(number(d.shaper) <= CUMULET_LUT_SHAPER_SRGB, "shaper is unknown");
  require(d.size >= min_points && d.size <= max_points, "size is not from 2 to 65");
  const auto values = array_of(d.values, d.value_count, 1, "values");
  if (d.value_count != std::uint64_t{3} * d.size * d.size * d.size) refuse("value_count is not 3 x size^3");
  require(all_finite(values), "values are not finite");
  const bool default_domain = d.domain_min == 0.0F && d.domain_max == 0.0F;
  require(default_domain ||
              (in_range(d.domain_min, -1e6, 1e6) && in_range(d.domain_max, -1e6, 1e6) && d.domain_min < d.domain_max),
          "domain_min is not below domain_max, or one is not from -1e6 to 1e6");
  auto lut = std::make_shared<render::DisplayLut>();
  lut->shaper = static_cast<render::LutShaper>(number(d.shaper));
  lut->domain = default_domain ? glm::vec2(0.0F, 1.0F) : glm::vec2(d.domain_min, d.domain_max);
  lut->size = static_cast<int>(d.size);
  lut->points.reserve(values.size() / 3);
  for (std::size_t i = 0; i < values.size(); i += 3) lut->points.emplace_back(values[i], values[i + 1], values[i + 2]);
  return lut;
}

}  // namespace

cumulet_status cumulet_set_display(cumulet_viewer* viewer, const cumulet_display_desc* desc) {
  return with_state(viewer, [&](core::Viewer& v) { v.set_display(core::DisplaySettings::of(read_settings(desc))); });
}

cumulet_status cumulet_set_display_lut(cumulet_viewer* viewer, const cumulet_display_lut_desc* desc) {
  return with_state(viewer, [&](core::Viewer& v) {
    v.set_display_lut(desc == nullptr ? nullptr : display_lut_of(read_desc(desc, "cumulet_display_lut_desc")));
  });
}
