#include "desktop_dialog.hpp"

#include <fcntl.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): signals of POSIX
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

namespace cumulet::demo {
namespace {

/// Reads a pipe whose writer has ended. Returns the text without its last line break, and closes the pipe.
std::string take_text(int pipe) {
  std::string text;
  std::array<char, 4096> part{};
  ssize_t read = 0;
  while ((read = ::read(pipe, part.data(), part.size())) > 0 || (read < 0 && errno == EINTR))
    if (read > 0) text.append(part.data(), static_cast<std::size_t>(read));
  ::close(pipe);
  if (text.ends_with('\n')) text.pop_back();
  return text;
}

/// A pipe whose ends are closed with it, unless they were taken.
struct Pipe {
  Pipe() { made = ::pipe2(ends.data(), O_CLOEXEC) == 0; }
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

bool DesktopDialog::open(const Request& request) {
  Pipe output;
  Pipe errors;
  if (!output.made || !errors.made) return false;
  std::vector<std::string> arguments = {
      program_, request.saves ? "save" : "open", request.title, request.parent, request.folder, request.name};
  arguments.insert(arguments.end(), request.extensions.begin(), request.extensions.end());
  try {
    open_ = Open{
        std::make_unique<ChildProcess>(std::move(arguments), ChildProcess::Streams{output.ends[1], errors.ends[1]}),
        output.ends[0], errors.ends[0]};
  } catch (const std::system_error&) {
    return false;
  }
  output.taken = errors.taken = true;
  return true;
}

std::optional<DesktopDialog::Result> DesktopDialog::take() {
  if (!open_) return std::nullopt;
  const auto status = open_->process->status();
  return status ? std::optional(end(*status)) : std::nullopt;
}

DesktopDialog::Result DesktopDialog::end(int status) {
  constexpr int closed = 1;  // exit status of cumulet-file-dialog
  Result result;
  result.path = take_text(open_->output);
  result.cause = take_text(open_->errors);
  open_.reset();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0 && !result.path.empty())
    result.outcome = Result::Outcome::chosen;
  else if (WIFEXITED(status) && WEXITSTATUS(status) == closed)
    result.outcome = Result::Outcome::closed;
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
