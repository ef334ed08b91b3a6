// Sequences of the C ABI. cumulet.h documents the calls.

#include <memory>

#include "assets/sequence.hpp"
#include "viewer/c_handles.hpp"
#include "viewer/c_settings.hpp"
#include "viewer/c_support.hpp"

namespace {

using namespace cumulet::c_abi;
using cumulet::scene::Playback;
using cumulet::viewer::FrameFiles;
using cumulet::viewer::Sequence;
using cumulet::viewer::SequenceState;

constexpr std::uint64_t max_frames = 1'000'000;
constexpr std::uint32_t max_subframes = 1000;
constexpr std::uint64_t default_memory = std::uint64_t{2} << 30U;
constexpr double max_seconds = 1e9;
constexpr std::uint64_t max_steps = 1'000'000;

Playback playback_of(const cumulet_playback_desc* desc, std::uint32_t frames) {
  cumulet_playback_desc d = read_settings(desc);
  const auto there = [&](std::uint32_t from) { return std::to_string(from) + ": it has " + std::to_string(frames); };
  if (d.first_frame >= frames) refuse("the sequence has no frame " + there(d.first_frame));
  const std::uint32_t rest = frames - d.first_frame;
  if (d.frame_count > rest) refuse("the sequence has too few frames from " + there(d.first_frame));
  const bool steps = d.interpolation != CUMULET_FRAME_INTERPOLATION_NONE;
  require(d.subframes <= max_subframes, "cumulet_playback_desc.subframes is not from 0 to 1000");
  // The default is lower for sequences so long that it would exceed the maximum.
  if (read_desc(desc, "cumulet_playback_desc").subframes == 0)
    d.subframes = std::min(d.subframes, static_cast<std::uint32_t>(max_steps / frames));
  if (steps && std::uint64_t{frames} * d.subframes > max_steps)
    refuse("cumulet_playback_desc.subframes gives more than 1000000 interpolated frames for " + std::to_string(frames) +
           " frames");
  return {.frames_per_second = d.frames_per_second,
          .offset_seconds = d.offset_seconds,
          .repeat = static_cast<cumulet::scene::Repeat>(d.repeat),
          .first = d.first_frame,
          .count = d.frame_count == 0 ? rest : d.frame_count,
          .between = static_cast<cumulet::scene::Between>(d.interpolation),
          .steps = steps ? d.subframes : 1,
          .velocity_scale = d.velocity_scale};
}

Playback default_playback(std::uint32_t frames) {
  cumulet_playback_desc desc{};
  desc.struct_size = sizeof desc;
  return playback_of(&desc, frames);
}

std::shared_ptr<Sequence> sequence_of(const cumulet_sequence_desc* desc) {
  const cumulet_sequence_desc d = read_desc(desc, "cumulet_sequence_desc");
  require(d.count >= 1 && d.count <= max_frames, "cumulet_sequence_desc.count is not from 1 to 1000000");
  auto files = std::make_shared<FrameFiles>();
  for (const char* path : array_of(d.paths, d.count, 1, "paths")) {
    if (path == nullptr || *path == '\0')
      refuse("cumulet_sequence_desc.paths[" + std::to_string(files->paths.size()) + "] is NULL or empty");
    files->paths.emplace_back(path);
  }
  cumulet_volume_file_desc file{};
  file.struct_size = sizeof file;
  if (d.file != nullptr) file = read_desc(d.file, "cumulet_volume_file_desc");
  file.struct_size = sizeof file;
  file.path = d.paths[0];
  files->shown = to_volume_file(&file);
  const std::uint32_t frames = files->count();
  return std::make_shared<Sequence>(
      std::move(files),
      SequenceState{default_playback(frames), d.memory_bytes == 0 ? default_memory : d.memory_bytes, {}, true});
}

void require_seconds(double seconds) {
  require(in_range(seconds, -max_seconds, max_seconds), "seconds is not from -1e9 to 1e9");
}

}  // namespace

cumulet_status cumulet_sequence_create(const cumulet_sequence_desc* desc, cumulet_sequence** out, char* error,
                                       size_t error_size) {
  return make_handle(out, error, error_size, [&] { return sequence_of(desc); });
}

cumulet_sequence* cumulet_sequence_retain(cumulet_sequence* sequence) { return retain(sequence); }

void cumulet_sequence_release(cumulet_sequence* sequence) { release(sequence); }

cumulet_status cumulet_sequence_set_playback(cumulet_sequence* sequence, const cumulet_playback_desc* desc) {
  return on(sequence, "sequence", [&](Sequence& s) { s.set_playback(playback_of(desc, s.files()->count())); });
}

cumulet_status cumulet_sequence_set_time(cumulet_sequence* sequence, double seconds) {
  return on(sequence, "sequence", [&](Sequence& s) {
    require_seconds(seconds);
    s.set_time(seconds);
  });
}

cumulet_status cumulet_sequence_set_frame(cumulet_sequence* sequence, double frame) {
  return on(sequence, "sequence", [&](Sequence& s) {
    require(in_range(frame, 0.0, s.files()->count() - 1.0), "frame is not a frame of the sequence");
    s.set_position(frame);
  });
}

cumulet_status cumulet_sequence_get_frame_at(const cumulet_sequence* sequence, double seconds, uint32_t* frame) {
  return on(sequence, "sequence", [&](const Sequence& s) {
    require_seconds(seconds);
    require(frame != nullptr, "frame is NULL");
    const Playback playback = s.get().playback;
    *frame = cumulet::scene::frame_of(playback, cumulet::scene::moment_at(playback, seconds));
  });
}

cumulet_status cumulet_sequence_get_time_of(const cumulet_sequence* sequence, uint32_t frame, double* seconds) {
  return on(sequence, "sequence", [&](const Sequence& s) {
    require(frame < s.files()->count(), "frame is not a frame of the sequence");
    require(seconds != nullptr, "seconds is NULL");
    *seconds = cumulet::scene::time_of(s.get().playback, frame);
  });
}
