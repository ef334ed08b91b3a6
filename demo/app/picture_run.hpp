#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "render_queue.hpp"
#include "session.hpp"

namespace cumulet::demo {

/// Renders the pictures of a job with a session of their own. Call from the thread that has the session's GL context.
class PictureRun {
 public:
  /// All must outlive it.
  PictureRun(Session& session, const PictureJob& job, const PictureWatch& watch);

  /// Renders and writes all pictures. Returns a line about the result, with the notes of the library. A frame of a
  /// sequence that fails does not prevent the others. Throws std::runtime_error, one line, and PictureCancelled.
  [[nodiscard]] std::string run();

 private:
  [[nodiscard]] std::string run_picture();
  [[nodiscard]] std::string run_sequence();
  // Renders a picture and writes it. index: frame of the sequence.
  void make(const std::string& path, std::optional<std::uint32_t> index);
  // Renders until the picture has all samples or its time is over.
  void render(std::optional<std::uint32_t> index);
  // Loads the sequence and returns it.
  [[nodiscard]] Play load_sequence();
  void go_to(const Play& play, std::uint32_t index);
  // Lets the viewer work, and returns its state. Throws the cause if something cannot be loaded.
  [[nodiscard]] Answer turn();
  void report(double part) const;

  Session& session_;
  const PictureJob& job_;
  const PictureWatch& watch_;
  DesiredState desired_;
  std::size_t frames_ = 1;
  std::size_t frames_done_ = 0;
  std::string prefix_;  // of the reported work: the frame
  std::vector<std::string> notes_;
};

}  // namespace cumulet::demo
