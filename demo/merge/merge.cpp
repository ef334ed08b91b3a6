#include "merge.hpp"

#include <algorithm>
#include <aov_table.hpp>
#include <array>
#include <attributes.hpp>
#include <cmath>
#include <layers.hpp>
#include <limits>
#include <luminance.hpp>
#include <optional>
#include <span>
#include <stdexcept>
#include <string_view>
#include <variant>

namespace cumulet::demo {
namespace {

namespace attributes = image::attributes;
namespace layers = image::layers;

[[noreturn]] void refuse(const std::string& path, const std::string& cause) {
  throw std::runtime_error(path + ": " + cause);
}

template <class Value>
std::optional<Value> find(const image::Contents& contents, std::string_view name) {
  const auto found = std::ranges::find(contents.attributes, name, &image::Attribute::name);
  if (found == contents.attributes.end()) return std::nullopt;
  const auto* value = std::get_if<Value>(&found->value);
  return value != nullptr ? std::optional(*value) : std::nullopt;
}

/// A file and its sample range.
struct Part {
  std::string path;
  image::Contents contents;
  std::uint64_t first = 0;
  std::uint64_t samples = 0;
  [[nodiscard]] std::uint64_t end() const { return first + samples; }
};

std::string range_text(std::uint64_t first, std::uint64_t end) {
  if (end - first == 1) return "sample " + std::to_string(first);
  return "samples " + std::to_string(first) + " to " + std::to_string(end - 1);
}

std::uint64_t whole(const Part& part, std::string_view name) {
  const auto number = find<double>(part.contents, name);
  constexpr double most = 4294967296.0;
  if (!number || !(*number >= 0.0) || *number > most || *number != std::floor(*number)) {
    refuse(part.path, "is not a partial render: it has no valid sample range (" + std::string(name) +
                          "); it may have been interrupted");
  }
  return static_cast<std::uint64_t>(*number);
}

Part open(const std::string& path) {
  Part part{path, image::read_contents(path)};
  for (const std::string_view name : {attributes::version, attributes::scene})
    if (!find<std::string>(part.contents, name))
      refuse(path, "is not an image of cumulet-render: it has no attribute " + std::string(name));
  part.first = whole(part, attributes::first_sample);
  part.samples = whole(part, attributes::samples);
  if (part.samples == 0) refuse(path, "is not a partial render: it has no samples");
  return part;
}

/// Returns the Cryptomatte manifest; nullopt if there is none.
std::string manifest_of(const Part& part) {
  const auto found = std::ranges::find_if(part.contents.attributes, [](const image::Attribute& attribute) {
    return attribute.name.starts_with("cryptomatte/") && attribute.name.ends_with("/manifest");
  });
  const auto* text = found == part.contents.attributes.end() ? nullptr : std::get_if<std::string>(&found->value);
  return text == nullptr ? std::string() : *text;
}

template <class Value>
void check_same(const Part& a, const Part& b, std::string_view name, const char* what) {
  if (find<Value>(a.contents, name) != find<Value>(b.contents, name))
    refuse(b.path, std::string("has ") + what + " than " + a.path);
}

void check_together(const Part& a, const Part& b) {
  const image::Windows& of_a = a.contents.windows;
  const image::Windows& of_b = b.contents.windows;
  const auto size = [](const image::Windows& windows) {
    return std::to_string(windows.width) + "x" + std::to_string(windows.height);
  };
  if (size(of_a) != size(of_b)) refuse(b.path, "has " + size(of_b) + " pixels, but " + a.path + " has " + size(of_a));
  if (of_a != of_b) refuse(b.path, "has another render region than " + a.path);
  check_same<std::string>(a, b, attributes::version, "another version of Cumulet");
  check_same<double>(a, b, attributes::seed, "another seed");
  check_same<std::string>(a, b, attributes::grid_type, "another grid type");
  check_same<std::string>(a, b, attributes::scene, "another scene");
  if (a.contents.channels != b.contents.channels) refuse(b.path, "has other layers than " + a.path);
  if (manifest_of(a) != manifest_of(b)) refuse(b.path, "has other Cryptomatte names than " + a.path);
}

/// Opens all files and sorts them by sample range. Throws if they do not belong together.
std::vector<Part> open_all(const std::vector<std::string>& paths) {
  if (paths.empty()) throw std::runtime_error("there are no files to merge");
  std::vector<Part> parts;
  parts.reserve(paths.size());
  for (const std::string& path : paths) {
    parts.push_back(open(path));
    check_together(parts.front(), parts.back());
  }
  std::ranges::stable_sort(parts, {}, &Part::first);
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const Part& before = parts[i - 1];
    const Part& after = parts[i];
    if (after.first < before.end()) {
      refuse(after.path, "has " + range_text(after.first, after.end()) + ", overlapping those of " + before.path +
                             ": " + range_text(before.first, before.end()));
    }
    if (after.first > before.end()) {
      throw std::runtime_error("between " + before.path + " and " + after.path + " no file has " +
                               range_text(before.end(), after.first));
    }
  }
  return parts;
}

bool has(const image::Contents& contents, const image::LayerName& layer) {
  return std::ranges::any_of(layer.channels, [&](char letter) {
    std::string name(layer.name);
    if (!name.empty()) name += '.';
    return std::ranges::find(contents.channels, name + letter) != contents.channels.end();
  });
}

/// Calls visit with each layer whose name begins with `prefix` and that has a channel R.
template <class Visit>
void for_each_layer(const image::Contents& contents, std::string_view prefix, std::string_view channels,
                    Visit&& visit) {
  for (const std::string& channel : contents.channels) {
    const std::string_view name = std::string_view(channel).substr(0, channel.rfind('.'));
    if (name.starts_with(prefix) && channel.ends_with(".R")) visit(image::LayerName{name, channels});
  }
}

std::size_t pixels_of(const Part& part) {
  return std::size_t{part.contents.windows.width} * part.contents.windows.height;
}

/// Returns the mean over all samples: the parts' means, weighted by their numbers of samples.
std::vector<float> mean(const std::vector<Part>& parts, const image::LayerName& layer) {
  std::vector<double> sums;
  double samples = 0.0;
  for (const Part& part : parts) {
    const image::Pixels pixels = image::read_exr(part.path, layer);
    sums.resize(pixels.values.size());
    const auto weight = static_cast<double>(part.samples);
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += weight * double{pixels.values[i]};
    samples += weight;
  }
  std::vector<float> means(sums.size());
  std::ranges::transform(sums, means.begin(), [&](double sum) { return static_cast<float>(sum / samples); });
  return means;
}

/// Returns the standard error of the mean luminance over all samples. It is combined from the parts' means and sums of
/// squared deviations (Chan, Golub and LeVeque, "Updating formulae and a pairwise algorithm for computing sample
/// variances", 1979).
std::vector<float> error_of(const std::vector<Part>& parts) {
  struct Moments {
    double samples = 0.0;
    double mean = 0.0;
    double squares = 0.0;
  };
  std::vector<Moments> all(pixels_of(parts.front()));
  for (const Part& part : parts) {
    const std::vector<float> rgba = image::read_exr(part.path, layers::beauty).values;
    const std::vector<float> errors = image::read_exr(part.path, layers::error).values;
    const auto n = static_cast<double>(part.samples);
    for (std::size_t i = 0; i < all.size(); ++i) {
      Moments& pixel = all[i];
      const double away = image::luminance(std::span(rgba).subspan(4 * i, 4)) - pixel.mean;
      const double together = pixel.samples + n;
      if (part.samples > 1) pixel.squares += n * (n - 1.0) * double{errors[i]} * double{errors[i]};
      pixel.squares += away * away * pixel.samples * n / together;
      pixel.mean += away * n / together;
      pixel.samples = together;
    }
  }
  std::vector<float> errors(all.size(), std::numeric_limits<float>::infinity());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double n = all[i].samples;
    if (n >= 2.0) errors[i] = static_cast<float>(std::sqrt(all[i].squares / (n * (n - 1.0))));
  }
  return errors;
}

/// Returns the relative noise as defined in docs/aovs.md; nullopt if it is unknown.
std::optional<double> noise_of(std::span<const float> rgba, std::span<const float> errors) {
  double squares = 0.0;
  double bright = 0.0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    squares += double{errors[i]} * double{errors[i]};
    bright += image::luminance(rgba.subspan(4 * i, 4));
  }
  const auto pixels = static_cast<double>(errors.size());
  if (pixels == 0.0 || !std::isfinite(squares) || !std::isfinite(bright)) return std::nullopt;
  return bright > 0.0 ? std::sqrt(squares / pixels) / (bright / pixels) : 0.0;
}

void set(std::vector<image::Attribute>& all, image::Attribute attribute) {
  const auto found = std::ranges::find(all, attribute.name, &image::Attribute::name);
  if (found != all.end()) {
    *found = std::move(attribute);
  } else {
    all.push_back(std::move(attribute));
  }
}

}  // namespace

Merged merge(const std::vector<std::string>& paths, const std::string& output) {
  const std::vector<Part> parts = open_all(paths);
  const image::Contents& first = parts.front().contents;
  Merged merged{parts.front().first, parts.back().end() - parts.front().first};
  merged.without_denoised = has(first, layers::denoised);
  const auto background = find<std::string>(first, attributes::background);
  const bool sky = background && *background == attributes::sky_background;
  const bool with_error = has(first, layers::error);
  merged.without_error = with_error && !sky;

  std::vector<std::pair<image::LayerName, std::vector<float>>> made;
  for (const settings::Aov& aov : settings::aovs) {
    const image::LayerName layer = image::layer_of(aov);
    if (aov.kind == settings::AovKind::mean && has(first, layer)) made.emplace_back(layer, mean(parts, layer));
  }
  for_each_layer(first, layers::light_group_prefix, layers::light_group_channels,
                 [&](const image::LayerName& layer) { made.emplace_back(layer, mean(parts, layer)); });
  const auto take_first = [&](const image::LayerName& layer) {
    made.emplace_back(layer, image::read_exr(parts.front().path, layer).values);
  };
  for (const settings::Aov& aov : settings::aovs) {
    const bool is_feature = aov.kind == settings::AovKind::feature || aov.kind == settings::AovKind::depth;
    if (is_feature && has(first, image::layer_of(aov))) take_first(image::layer_of(aov));
  }
  // Cryptomatte does not depend on the samples either, and IDs cannot be averaged.
  for_each_layer(first, layers::cryptomatte_prefix, layers::cryptomatte_channels, take_first);

  std::vector<image::Attribute> said = first.attributes;
  const auto samples = static_cast<double>(merged.samples);
  std::erase_if(said, [](const image::Attribute& a) { return a.name == attributes::noise; });
  set(said, {std::string(attributes::samples), samples});
  set(said, {std::string(attributes::comments),
             attributes::comments_text(*find<std::string>(first, attributes::version), samples)});
  if (with_error && sky) {
    made.emplace_back(layers::error, error_of(parts));
    if (const auto noise = noise_of(made[0].second, made.back().second))
      set(said, {std::string(attributes::noise), *noise});
  }
  std::vector<image::Layer> written;
  written.reserve(made.size());
  for (const auto& [name, values] : made) written.push_back({name, values});
  image::write_exr(output, first.windows, written, said);
  return merged;
}

}  // namespace cumulet::demo
