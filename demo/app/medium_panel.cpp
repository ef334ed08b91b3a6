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

using Desc = cumulet_medium_desc;

bool has_grid(const Fields& fields, cumulet_ramp grid) { return fields[static_cast<std::size_t>(grid)].most > 0.0f; }

bool has_fire(const Fields& fields) {
  return has_grid(fields, CUMULET_RAMP_TEMPERATURE) || has_grid(fields, CUMULET_RAMP_FLAME);
}

/// Returns what is known about a volume other than the first one; null before it is open.
const OtherVolume* find_other(const Status& status, const VolumeFile& file) {
  const auto found = std::ranges::find(status.others, file, &OtherVolume::file);
  return found == status.others.end() ? nullptr : &*found;
}

/// Returns a function that draws the row of a field of the medium.
auto row_of(Rows& rows, Desc& medium) {
  return [&rows, &medium](auto field) {
    settings::with(field, [&](const auto& setting) { rows.draw(setting, medium.*field); });
  };
}

}  // namespace

void Panel::medium(Model& model, std::size_t index, std::vector<Command>& commands) {
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
  if (ui_.choose("Preset", "Preset of the material; does not change the density and the ramps.", presets, chosen))
    apply(static_cast<Preset>(chosen), medium);
  bool suggests = false;
  ui_.group("Density", true, "Material/Density", [&] {
    settings::with(&Desc::density_scale, [&](auto setting) {
      if (!first && volume.auto_density_scale) setting.row.zero = "auto";
      rows_.draw(setting, medium.density_scale);
    });
    if (other != nullptr || (first && model.status.has_volume))
      suggests =
          ui_.button("Auto density", "Sets a density that suits the volume: a mean optical depth of 8.", {-1.0f, 0.0f});
  });
  ui_.group("Scattering", true, "Material/Scattering", [&] { scattering(medium); });
  if (has_fire(fields)) ui_.group("Fire", true, "Material/Fire", [&] { fire(medium, volume, fields); });
  const bool glows = medium.emission[0] > 0.0f || medium.emission[1] > 0.0f || medium.emission[2] > 0.0f;
  const auto row = row_of(rows_, medium);
  ui_.group("Emission", glows, "Material/Emission", [&] { row(&Desc::emission); });
  const bool is_hot = has_grid(fields, CUMULET_RAMP_TEMPERATURE) && medium.blackbody > 0.0f;
  // The first volume's maximum applies to all.
  if (first || is_hot)
    ui_.group("Advanced", false, "Material/Advanced", [&] {
      if (first) row(&Desc::max_bounces);
      if (is_hot) row(&Desc::temperature_offset);
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
  const auto any = [](const auto& all) {
    return std::ranges::any_of(all, [](const auto& one) { return !one.empty(); });
  };
  const bool has_ramps = any(volume.ramps) || any(volume.color_ramps);
  const bool can_have = std::ranges::any_of(fields, [](const FieldValues& field) { return field.most > 0.0f; });
  if (has_ramps || can_have)
    ui_.group("Curves and color ramps", has_ramps, "Material/Ramps", [&] { ramps(model, volume, fields); });
}

void Panel::scattering(Desc& medium) {
  const auto row = row_of(rows_, medium);
  row(&Desc::coalbedo);
  absorption(medium.coalbedo);
  row(&Desc::phase);
  if (medium.phase == CUMULET_PHASE_MIE) return row(&Desc::droplet_diameter);
  row(&Desc::anisotropy);
  if (medium.phase != CUMULET_PHASE_TWO_LOBE) return;
  row(&Desc::second_anisotropy);
  row(&Desc::second_weight);
}

void Panel::fire(Desc& medium, const SceneVolume& volume, const Fields& fields) {
  const auto row = row_of(rows_, medium);
  if (has_grid(fields, CUMULET_RAMP_TEMPERATURE)) {
    row(&Desc::blackbody);
    // Without brightness nothing else has an effect.
    if (medium.blackbody > 0.0f) {
      row(&Desc::blackbody_tint);
      row(&Desc::temperature_scale);
    }
  }
  if (!has_grid(fields, CUMULET_RAMP_FLAME)) return;
  row(&Desc::flame_strength);
  // A color ramp replaces the color.
  if (volume.color_ramps[CUMULET_RAMP_FLAME].empty()) row(&Desc::flame_color);
}

/// Draws a slider for the absorption. A cloud's absorption is far below the resolution of a color field.
void Panel::absorption(float (&coalbedo)[3]) {
  float mean = (coalbedo[0] + coalbedo[1] + coalbedo[2]) / 3.0f;
  const float before = mean;
  if (!ui_.slider("Absorption", "Fraction of the light that the medium absorbs, on average. The rest is scattered.",
                  mean, 0.0f, 1.0f, "%.4g", ImGuiSliderFlags_Logarithmic))
    return;
  for (float& one : coalbedo) one = before > 0.0f ? std::min(one * mean / before, 1.0f) : mean;
}

}  // namespace cumulet::demo
