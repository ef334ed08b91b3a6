#include "dropped_files.hpp"

#include <algorithm>
#include <frame_row.hpp>
#include <optional>

namespace cumulet::demo {
namespace {

/// Returns the pattern of the sequence that all files belong to; nullopt if there is none.
std::optional<std::string> common_sequence(const std::vector<std::string>& volumes) {
  if (volumes.size() < 2) return std::nullopt;
  const std::optional<FrameRow> row = FrameRow::around(volumes.front());
  if (!row) return std::nullopt;
  std::vector<std::string> frames = row->files();
  std::ranges::sort(frames);
  const auto is_frame = [&](const std::string& file) { return std::ranges::binary_search(frames, file); };
  if (!std::ranges::all_of(volumes, is_frame)) return std::nullopt;
  return row->pattern().text();
}

}  // namespace

DroppedFiles open_dropped(const std::vector<std::string>& files) {
  std::vector<std::string> scenes;
  std::vector<std::string> environments;
  std::vector<std::string> models;
  std::vector<std::string> volumes;
  for (const std::string& file : files) {
    std::vector<std::string>& kind = has_ending(file, ".json") ? scenes
                                     : is_environment(file)    ? environments
                                     : is_model(file)          ? models
                                                               : volumes;
    kind.push_back(file);
  }
  DroppedFiles dropped;
  if (const auto sequence = common_sequence(volumes)) {
    volumes = {*sequence};
    dropped.plays = scenes.empty();
  }
  // A scene replaces everything, so it comes first.
  for (std::vector<std::string>* const kind : {&scenes, &environments}) {
    if (kind->empty()) continue;
    dropped.commands.push_back({Action::open, kind->front()});
    dropped.left_out.insert(dropped.left_out.end(), kind->begin() + 1, kind->end());
  }
  // The objects of a dropped scene stay.
  const auto add_all = [&](const std::vector<std::string>& kind, Action add) {
    for (const std::string& file : kind) {
      const bool opens = scenes.empty() && &file == &kind.front();
      dropped.commands.push_back({opens ? Action::open : add, file});
    }
  };
  add_all(volumes, Action::add_volume);
  add_all(models, Action::add_model);
  return dropped;
}

}  // namespace cumulet::demo
