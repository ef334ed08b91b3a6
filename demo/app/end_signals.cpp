#include "end_signals.hpp"

#include <fcntl.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): signals of POSIX
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

namespace cumulet::demo {
namespace {

constexpr std::array signals = {SIGTERM, SIGINT, SIGHUP};
constexpr char arrived = 's';
constexpr char closing = 'c';

std::atomic<int> write_end = -1;

void handle(int) {
  // Only functions that a handler may call.
  const int error = errno;
  static_cast<void>(!::write(write_end, &arrived, 1));
  errno = error;
}

}  // namespace

EndSignals::EndSignals(std::function<void()> wake) : wake_(std::move(wake)) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
  read_ = ends[0];
  write_end = ends[1];
  thread_ = std::thread([this] { wait(); });
  struct sigaction action {};
  action.sa_handler = handle;
  action.sa_flags = static_cast<int>(SA_RESTART | SA_RESETHAND);
  for (const int signal : signals) {
    struct sigaction before {};
    // A signal that is ignored, as by nohup, stays so.
    if (::sigaction(signal, nullptr, &before) == 0 && before.sa_handler != SIG_IGN)
      ::sigaction(signal, &action, nullptr);
  }
}

EndSignals::~EndSignals() {
  struct sigaction action {};
  action.sa_handler = SIG_DFL;
  for (const int signal : signals) {
    struct sigaction now {};
    if (::sigaction(signal, nullptr, &now) == 0 && now.sa_handler == handle) ::sigaction(signal, &action, nullptr);
  }
  static_cast<void>(!::write(write_end, &closing, 1));
  thread_.join();
  ::close(read_);
  ::close(write_end.exchange(-1));
}

void EndSignals::wait() {
  for (char byte = 0; byte != closing;) {
    if (::read(read_, &byte, 1) != 1) {
      if (errno == EINTR) continue;
      return;
    }
    if (byte != arrived || received_.exchange(true)) continue;
    wake_();
  }
}

}  // namespace cumulet::demo
