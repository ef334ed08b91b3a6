#include "light/exr_channels.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace cumulet::light {

namespace {

using Names = std::array<std::string_view, 3>;

bool has(const Imf::ChannelList& channels, const std::string& name) { return channels.findChannel(name) != nullptr; }

std::optional<ExrChannels> find_in(const Imf::ChannelList& channels, const std::string& layer, ExrChannels::Kind kind,
                                   const Names& names) {
  ExrChannels found{kind, layer, {}};
  for (std::size_t c = 0; c < found.count(); ++c) {
    found.names[c] = layer.empty() ? std::string(names[c]) : layer + "." + std::string(names[c]);
    if (!has(channels, found.names[c])) return std::nullopt;
  }
  return found;
}

std::optional<ExrChannels> find_rgb(const Imf::ChannelList& channels, const std::string& layer) {
  for (const Names& names : {Names{"R", "G", "B"}, Names{"r", "g", "b"}, Names{"red", "green", "blue"}}) {
    if (auto found = find_in(channels, layer, ExrChannels::Kind::rgb, names)) return found;
  }
  return std::nullopt;
}

/// Whether the layer has a name that programs give to the layer of the final image.
bool is_main(std::string_view layer) {
  std::string last(layer.substr(layer.rfind('.') + 1));
  std::ranges::transform(last, last.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array<std::string_view, 5> names = {"combined", "composite", "beauty", "rgba", "rgb"};
  return std::ranges::find(names, last) != names.end();
}

}  // namespace

std::optional<ExrChannels> find_colors(const Imf::ChannelList& channels) {
  using Kind = ExrChannels::Kind;
  if (auto found = find_rgb(channels, "")) return found;
  if (auto found = find_in(channels, "", Kind::luminance_chroma, {"Y", "RY", "BY"})) return found;
  if (auto found = find_in(channels, "", Kind::xyz, {"X", "Y", "Z"})) return found;
  const bool others =
      has(channels, "R") || has(channels, "G") || has(channels, "B") || has(channels, "RY") || has(channels, "BY");
  if (!others) {
    if (auto found = find_in(channels, "", Kind::luminance, {"Y", {}, {}})) return found;
  }
  std::optional<ExrChannels> first;
  for (auto channel = channels.begin(); channel != channels.end(); ++channel) {
    const std::string_view name = channel.name();
    const std::size_t dot = name.rfind('.');
    if (dot == std::string_view::npos || dot == 0) continue;
    const std::string layer(name.substr(0, dot));
    if (first && first->layer == layer) continue;
    auto found = find_rgb(channels, layer);
    if (found && is_main(layer)) return found;
    if (found && !first) first = std::move(found);
  }
  return first;
}

std::string missing_channel(const Imf::ChannelList& channels) {
  if (has(channels, "RY") || has(channels, "BY")) {
    for (const char* name : {"Y", "RY", "BY"}) {
      if (!has(channels, name)) return name;
    }
  }
  for (const char* name : {"R", "G", "B"}) {
    if (!has(channels, name)) return name;
  }
  return "Y";
}

}  // namespace cumulet::light
