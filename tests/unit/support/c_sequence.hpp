#pragma once

// The fixture of tests of sequences through the C API.

#include <cumulet/cumulet.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "support/c_playback.hpp"
#include "support/clip.hpp"

namespace cumulet::test {

/// Makes a sequence of these files.
inline SequenceRef make_sequence(const std::vector<std::string>& files,
                                 const cumulet_volume_file_desc* file = nullptr) {
  std::vector<const char*> paths;
  for (const std::string& path : files) paths.push_back(path.c_str());
  auto desc = make_desc<cumulet_sequence_desc>();
  desc.paths = paths.data();
  desc.count = paths.size();
  desc.file = file;
  return made_by<SequenceRef>(cumulet_sequence_create, desc);
}

/// A viewer and a clip of seven frames.
class CSequence : public CPlaybackTest {
 protected:
  static constexpr int count = 7;
  static cumulet_sequence_info info_of(cumulet_viewer* viewer) {
    auto info = make_desc<cumulet_sequence_info>();
    EXPECT_EQ(cumulet_get_sequence_info(viewer, &info, nullptr, 0), CUMULET_OK) << cumulet_last_error(viewer);
    return info;
  }
  // Waits until all frames are ready or failed. Returns false after a minute.
  static bool is_cached(cumulet_viewer* viewer) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    for (;;) {
      const cumulet_sequence_info info = info_of(viewer);
      if (info.ready_frames + info.failed_frames == info.frames) return true;
      if (std::chrono::steady_clock::now() > until) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  // The image of this file, loaded by a new viewer.
  std::vector<std::uint8_t> alone(int frame) {
    const ViewerPtr viewer = make();
    EXPECT_EQ(cumulet_load_volume(viewer.get(), clip_.path(frame).c_str(), nullptr), CUMULET_OK);
    return picture(viewer.get());
  }

  Clip clip_{count};
};

}  // namespace cumulet::test
