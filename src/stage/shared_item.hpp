#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "assets/instance.hpp"
#include "stage/stage_host.hpp"

namespace cumulet::viewer {

/// An object that the host has added to the viewer, with its settings when they were last read.
template <class Settings>
struct SharedItem {
  std::shared_ptr<Shared<Settings>> object;
  std::uint64_t id = 0;  ///< number in snapshots
  Settings settings = {};

  SharedItem(std::shared_ptr<Shared<Settings>> added, std::uint64_t number, StageHost& host)
      : object(std::move(added)), id(number), listener_(object->listen([&host] { host.notify(); })) {}

  /// Reads the settings. Returns true if they were edited since the last call; the first call returns true.
  bool read_settings() {
    const std::uint64_t revision = object->revision();
    if (revision == revision_) return false;
    settings = object->get();
    revision_ = revision;
    return true;
  }

 private:
  std::shared_ptr<void> listener_;
  std::uint64_t revision_ = 0;  // of settings
};

}  // namespace cumulet::viewer
