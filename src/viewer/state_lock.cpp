#include "viewer/state_lock.hpp"

namespace cumulet::viewer {

StateLock::Held::~Held() {
  const Collected collected = std::exchange(lock_.collected_, {});
  lock_.mutex_.unlock();
  try {
    for (const Line& line : collected.lines) lock_.log_.write(line.level, line.text);
    if (collected.update) lock_.update_();
  } catch (...) {  // callbacks of C hosts do not throw
  }
}

Log StateLock::log() {
  return Log([this](LogLevel level, const char* text) {
    if (mutex_.is_mine()) {
      collected_.lines.push_back({level, text});
    } else {
      log_.write(level, text);
    }
  });
}

void StateLock::notify() {
  if (mutex_.is_mine()) {
    collected_.update = true;
  } else {
    update_();
  }
}

}  // namespace cumulet::viewer
