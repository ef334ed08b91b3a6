// The inspector of a volume's medium.

#include <algorithm>
#include <cstddef>
#include <optional>
#include <presets.hpp>
#include <settings.hpp>
#include <vector>

#include "panel.hpp"

namespace cumulet::demo {
namespace {

/// Returns true if the setting has an effect: the phase function has it, and the volume has the grid that it scales.
/// flame_colors: a color ramp replaces the color of flames.
template <class Setting>
bool acts(const Setting& setting, const cumulet_medium_desc& medium, const Fields& fields, bool flame_colors) {
  using Desc = cumulet_medium_desc;
  if (setting.is(&Desc::second_anisotropy) || setting.is(&Desc::second_weight))
    return medium.phase == CUMULET_PHASE_TWO_LOBE;
  if (setting.is(&Desc::droplet_diameter)) return medium.phase == CUMULET_PHASE_MIE;
  if (setting.is(&Desc::anisotropy)) return medium.phase != CUMULET_PHASE_MIE;
  const auto has = [&](cumulet_ramp grid) { return fields[static_cast<std::size_t>(grid)].most > 0.0f; };
  if (setting.is(&Desc::flame_color) && flame_colors) return false;
  if (setting.is(&Desc::flame_strength) || setting.is(&Desc::flame_color)) return has(CUMULET_RAMP_FLAME);
  const bool of_heat = setting.is(&Desc::temperature_scale) || setting.is(&Desc::temperature_offset) ||
                       setting.is(&Desc::blackbody) || setting.is(&Desc::blackbody_tint);
  return !of_heat || has(CUMULET_RAMP_TEMPERATURE);
}

/// Returns what is known about a volume other than the first one; null before it is open.
const OtherVolume* find_other(const Status& status, const VolumeFile& file) {
  const auto found = std::ranges::find(status.others, file, &OtherVolume::file);
  return found == status.others.end() ? nullptr : &*found;
}

}  // namespace

void Panel::medium(Model& model, std::size_t index, std::vector<Command>& commands) {
  using Desc = cumulet_medium_desc;
  SceneVolume& volume = volume_at(model.scene, index);
  const bool first = index == 0;
  const OtherVolume* const other = first ? nullptr : find_other(model.status, volume);
  static const Fields unknown;
  const Fields& fields = first ? model.status.fields : other != nullptr ? other->fields : unknown;
  // The file of another volume suggests values. They become the scene's when the user changes one.
  const Desc before = other != nullptr ? medium_of(volume, other->open) : volume.medium;
  Desc medium = before;
  std::vector<Choice> presets;
  presets.reserve(preset_choices.size());
  for (const settings::Choice& preset : preset_choices) presets.push_back({preset.label, preset.value, preset.tip});
  const std::optional<Preset> now = preset_of(medium);
  int chosen = now ? static_cast<int>(*now) : -1;
  if (ui_.choose("Preset", "Preset of the medium; does not change the density scale and the ramps.", presets, chosen))
    apply(static_cast<Preset>(chosen), medium);
  bool suggests = false;
  settings::for_each<Desc>([&](auto setting) {
    // The first volume's maximum applies to all.
    if (!first && setting.is(&Desc::max_bounces)) return;
    if (!acts(setting, medium, fields, !volume.color_ramps[CUMULET_RAMP_FLAME].empty())) return;
    if (!first && setting.is(&Desc::density_scale) && volume.auto_density_scale) setting.row.zero = "auto";
    rows_.draw(setting, medium.*setting.field);
    if (setting.is(&Desc::density_scale) && (other != nullptr || (first && model.status.has_volume)))
      suggests = ui_.button("Auto density", "Sets the density scale to a mean optical depth of 8.", {-1.0f, 0.0f});
    if (setting.is(&Desc::coalbedo)) absorption(medium.coalbedo);
  });
  volume.albedo_given |= !std::ranges::equal(medium.coalbedo, before.coalbedo);
  if (first) {
    volume.medium = medium;
    if (suggests) commands.push_back({Action::auto_density});
  } else if (suggests) {
    medium.density_scale = other->open.density_scale;
  }
  if (!first && !settings::same(medium, before)) {
    medium.max_bounces = volume.medium.max_bounces;
    volume.medium = medium;
    if (medium.density_scale > 0.0) volume.auto_density_scale = false;
  }
  ramps(model, volume, fields);
}

/// Draws a slider for the absorption. A cloud's absorption is far below the resolution of a color field.
void Panel::absorption(float (&coalbedo)[3]) {
  float mean = (coalbedo[0] + coalbedo[1] + coalbedo[2]) / 3.0f;
  const float before = mean;
  if (!ui_.slider("Absorption", "Mean fraction of light that is absorbed: 1 - albedo.", mean, 0.0f, 1.0f, "%.4g",
                  ImGuiSliderFlags_Logarithmic))
    return;
  for (float& one : coalbedo) one = before > 0.0f ? std::min(one * mean / before, 1.0f) : mean;
}

}  // namespace cumulet::demo
