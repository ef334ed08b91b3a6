#pragma once

#include <cstdint>
#include <vector>

#include "session.hpp"

namespace cumulet::demo {

/// The window's side of the exchange with the viewer's thread: the requests, and which of them are answered.
struct Exchange {
  DesiredState desired;             // last sent; camera, volume and surfaces as the viewer has them
  std::vector<ViewerInput> inputs;  // for the next request
  std::vector<Request> requests;    // for the next request
  std::uint64_t answered = 0;       // number of the last answered request
  std::uint64_t drawn = 0;          // latest request with a drawn image
  Edits answered_edits;             // of the last answer
  bool loads = false;               // the viewer loads a file or fits its first camera

  /// Returns true if the latest request is answered.
  [[nodiscard]] bool settled() const { return answered >= desired.number; }
  /// Returns true if a load is pending, also if the viewer has not received it yet.
  [[nodiscard]] bool waiting() const { return loads || !answered_edits.same_files(desired.edits); }
};

}  // namespace cumulet::demo
