#include "desktop_dialog.hpp"

#include <fcntl.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): signals of POSIX
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <system_error>
#include <utility>

namespace cumulet::demo {
namespace {

/// A pipe whose ends are closed with it, unless they were taken.
struct Pipe {
  // Reads do not wait: programs that the writer has started may keep the other end open.
  Pipe() { made = ::pipe2(ends.data(), O_CLOEXEC) == 0 && ::fcntl(ends[0], F_SETFL, O_NONBLOCK) == 0; }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  ~Pipe() {
    if (!made) return;
    ::close(ends[1]);
    if (!taken) ::close(ends[0]);
  }
  std::array<int, 2> ends{};
  bool made = false;
  bool taken = false;  // the read end
};

}  // namespace

DesktopDialog::Stream::~Stream() { ::close(pipe_); }

void DesktopDialog::Stream::read() {
  constexpr std::size_t most = 1 << 16;  // a path is shorter
  std::array<char, 4096> part{};
  for (int i = 0; i < 64; ++i) {  // a program may write for ever
    const ssize_t bytes = ::read(pipe_, part.data(), part.size());
    if (bytes < 0 && errno == EINTR) continue;
    if (bytes <= 0) return;
    text_.append(part.data(), static_cast<std::size_t>(bytes));
    if (text_.size() > most) text_.erase(0, text_.size() - most);
  }
}

std::string DesktopDialog::Stream::text() const {
  std::string text = text_;
  if (text.ends_with('\n')) text.pop_back();
  return text;
}

bool DesktopDialog::open(const Request& request) {
  Pipe output;
  Pipe errors;
  if (!output.made || !errors.made) return false;
  std::vector<std::string> arguments = {
      program_, request.saves ? "save" : "open", request.title, request.parent, request.folder, request.name};
  arguments.insert(arguments.end(), request.extensions.begin(), request.extensions.end());
  try {
    open_.emplace(
        std::make_unique<ChildProcess>(std::move(arguments), ChildProcess::Streams{output.ends[1], errors.ends[1]}),
        output.ends[0], errors.ends[0]);
  } catch (const std::system_error&) {
    return false;
  }
  output.taken = errors.taken = true;
  return true;
}

std::optional<DesktopDialog::Result> DesktopDialog::take() {
  if (!open_) return std::nullopt;
  const auto status = open_->process->status();
  // Also while the program runs, or it would wait once a pipe is full.
  open_->output.read();
  open_->errors.read();
  return status ? std::optional(end(*status)) : std::nullopt;
}

DesktopDialog::Result DesktopDialog::end(int status) {
  constexpr int closed = 1;  // exit statuses of cumulet-file-dialog
  constexpr int unusable = 4;
  Result result;
  result.path = open_->output.text();
  result.cause = open_->errors.text();
  result.cause.erase(0, result.cause.rfind('\n') + 1);  // warnings of libraries come before it
  open_.reset();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0 && !result.path.empty())
    result.outcome = Result::Outcome::chosen;
  else if (WIFEXITED(status) && WEXITSTATUS(status) == closed)
    result.outcome = Result::Outcome::closed;
  else if (WIFEXITED(status) && WEXITSTATUS(status) == unusable)
    result.outcome = Result::Outcome::unusable;
  else if (result.cause.empty())
    result.cause = program_ + " ended unexpectedly";
  return result;
}

void DesktopDialog::close() {
  if (!open_) return;
  // The portal closes the dialog when its caller leaves the bus.
  open_->process->end(SIGTERM);
  static_cast<void>(end(*open_->process->status()));
}

std::string desktop_dialog_program() {
  return find_program("cumulet-file-dialog", "../" CUMULET_LIBEXEC_DIR "/cumulet");
}

}  // namespace cumulet::demo
