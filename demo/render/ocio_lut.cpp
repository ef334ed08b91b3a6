#include "ocio_lut.hpp"

#include <OpenColorIO/OpenColorIO.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace cumulet::demo {

namespace {

namespace ocio = OCIO_NAMESPACE;

// log2 of radiance. The points are 0.3 stops apart, and 1.0, where views without a tone map clip, is one of them.
constexpr std::uint32_t points = 65;
constexpr float domain_min = -13.2F;
constexpr float domain_max = 6.0F;

// Names of linear Rec. 709 in configurations of ACES, of OpenColorIO, of Blender and of The Foundry. OpenColorIO
// ignores case and knows aliases.
constexpr std::array rec709_names = {"Linear Rec.709 (sRGB)",
                                     "lin_rec709_srgb",
                                     "lin_rec709",
                                     "lin_srgb",
                                     "Linear Rec.709",
                                     "Linear BT.709",
                                     "Linear sRGB",
                                     "srgb_linear",
                                     "Utility - Linear - Rec.709",
                                     "Utility - Linear - sRGB"};
// Some configurations, of ACES for example, give this name to other primaries.
constexpr const char* unsure_name = "linear";

std::string quoted(const std::string& text) { return "'" + text + "'"; }

/// Lists the names that a function of the index returns.
template <class Name>
std::string list(int count, Name name) {
  std::string text;
  for (int i = 0; i < count; ++i) text += (i > 0 ? ", " : "") + std::string(name(i));
  return text;
}

std::string display_of(const ocio::Config& config, const OcioView& view) {
  if (config.getNumDisplays() == 0) throw std::runtime_error("it has no displays");
  if (view.display.empty()) return config.getDefaultDisplay();
  for (int i = 0; i < config.getNumDisplays(); ++i)
    if (view.display == config.getDisplay(i)) return view.display;
  throw std::runtime_error("--ocio-display: " + quoted(view.display) + " is not one of " +
                           list(config.getNumDisplays(), [&](int i) { return config.getDisplay(i); }));
}

std::string view_of(const ocio::Config& config, const std::string& display, const OcioView& view) {
  if (view.view.empty()) return config.getDefaultView(display.c_str());
  const int count = config.getNumViews(display.c_str());
  const auto name = [&](int i) { return config.getView(display.c_str(), i); };
  for (int i = 0; i < count; ++i)
    if (view.view == name(i)) return view.view;
  throw std::runtime_error("--ocio-view: " + quoted(view.view) + " of the display " + quoted(display) +
                           " is not one of " + list(count, name));
}

/// Appends the conversion of linear Rec. 709 to ACES2065-1.
void append_rec709_to_aces(ocio::GroupTransform& group) {
  const auto append = [&group](const char* style, ocio::TransformDirection direction) {
    const auto step = ocio::BuiltinTransform::Create();
    step->setStyle(style);
    step->setDirection(direction);
    group.appendTransform(step);
  };
  append("UTILITY - ACES-AP1_to_LINEAR-REC709_BFD", ocio::TRANSFORM_DIR_INVERSE);
  append("UTILITY - ACES-AP1_to_CIE-XYZ-D65_BFD", ocio::TRANSFORM_DIR_FORWARD);
  append("UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD", ocio::TRANSFORM_DIR_INVERSE);
}

/// Returns the color space in which radiance enters the view, after the conversions that it appends to the group.
std::string input_of(const ocio::Config& config, const OcioView& view, ocio::GroupTransform& group) {
  if (!view.input.empty()) {
    if (config.getColorSpace(view.input.c_str()) == nullptr)
      throw std::runtime_error("--ocio-input: it has no color space " + quoted(view.input));
    return view.input;
  }
  for (const char* name : rec709_names)
    if (config.getColorSpace(name) != nullptr) return name;
  if (config.hasRole(ocio::ROLE_INTERCHANGE_SCENE)) {
    append_rec709_to_aces(group);
    return ocio::ROLE_INTERCHANGE_SCENE;
  }
  if (config.getColorSpace(unsure_name) != nullptr) return unsure_name;
  throw std::runtime_error("it names no color space of linear Rec. 709: choose one by --ocio-input");
}

ocio::ConstCPUProcessorRcPtr processor_of(const OcioView& view, std::string* note) {
  const ocio::ConstConfigRcPtr config = ocio::Config::CreateFromFile(view.config.c_str());
  const std::string display = display_of(*config, view);
  const auto group = ocio::GroupTransform::Create();
  const auto to_display = ocio::DisplayViewTransform::Create();
  const std::string input = input_of(*config, view, *group);
  if (note != nullptr && view.input.empty())
    *note = "--ocio " + view.config + ": radiance enters by the color space " + quoted(input);
  to_display->setSrc(input.c_str());
  to_display->setDisplay(display.c_str());
  to_display->setView(view_of(*config, display, view).c_str());
  group->appendTransform(to_display);
  return config->getProcessor(group)->getDefaultCPUProcessor();
}

}  // namespace

const OcioDisplay* OcioDisplays::find(const std::string& name) const {
  const auto found = std::ranges::find(displays, name.empty() ? default_display : name, &OcioDisplay::name);
  return found == displays.end() ? nullptr : &*found;
}

OcioDisplays ocio_displays(const std::string& file) {
  OcioDisplays result{.config = file};
  try {
    ocio::SetLoggingLevel(ocio::LOGGING_LEVEL_NONE);  // errors are exceptions
    const ocio::ConstConfigRcPtr config = ocio::Config::CreateFromFile(file.c_str());
    result.default_display = display_of(*config, {});
    for (int i = 0; i < config->getNumDisplays(); ++i) {
      OcioDisplay& display = result.displays.emplace_back(OcioDisplay{config->getDisplay(i)});
      const char* const name = display.name.c_str();
      for (int k = 0; k < config->getNumViews(name); ++k) display.views.emplace_back(config->getView(name, k));
      display.default_view = config->getDefaultView(name);
    }
    for (int i = 0; i < config->getNumColorSpaces(); ++i)
      result.color_spaces.emplace_back(config->getColorSpaceNameByIndex(i));
  } catch (const std::exception& error) {
    throw std::runtime_error("--ocio " + file + ": " + error.what());
  }
  return result;
}

DisplayLut bake_ocio_view(const OcioView& view, std::string* note) {
  DisplayLut lut{.size = points,
                 .shaper = CUMULET_LUT_SHAPER_LOG2,
                 .domain_min = domain_min,
                 .domain_max = domain_max,
                 .values = {}};
  std::array<float, points> axis{};
  // The first point is black, so that black stays the configuration's black.
  for (std::uint32_t i = 1; i < points; ++i)
    axis.at(i) = std::exp2(domain_min + (domain_max - domain_min) * static_cast<float>(i) / (points - 1));
  lut.values.reserve(std::size_t{3} * points * points * points);
  for (const float blue : axis)
    for (const float green : axis)
      for (const float red : axis) lut.values.insert(lut.values.end(), {red, green, blue});
  try {
    ocio::SetLoggingLevel(ocio::LOGGING_LEVEL_NONE);  // errors are exceptions
    ocio::PackedImageDesc image(lut.values.data(), points, long{points} * points, 3);
    processor_of(view, note)->apply(image);
  } catch (const std::exception& error) {
    throw std::runtime_error("--ocio " + view.config + ": " + error.what());
  }
  for (const float value : lut.values)
    if (!std::isfinite(value))
      throw std::runtime_error("--ocio " + view.config + ": the view has values that are not finite");
  return lut;
}

}  // namespace cumulet::demo
