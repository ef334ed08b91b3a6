#include "desktop_dialog.hpp"

#include <fcntl.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): kill() is POSIX
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

namespace cumulet::demo {
namespace {

namespace fs = std::filesystem;

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

int wait_for(pid_t process) {
  int status = 0;
  while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

}  // namespace

bool DesktopDialog::open(const Request& request) {
  std::array<int, 2> output{};
  std::array<int, 2> errors{};
  if (::pipe2(output.data(), O_CLOEXEC) != 0) return false;
  if (::pipe2(errors.data(), O_CLOEXEC) != 0) {
    ::close(output[0]);
    ::close(output[1]);
    return false;
  }
  std::vector<std::string> texts = {
      program_, request.saves ? "save" : "open", request.title, request.parent, request.folder, request.name};
  texts.insert(texts.end(), request.extensions.begin(), request.extensions.end());
  std::vector<char*> arguments;
  arguments.reserve(texts.size() + 1);
  for (std::string& text : texts) arguments.push_back(text.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions{};
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, output[1], STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, errors[1], STDERR_FILENO);
  pid_t process = 0;
  const int failure = ::posix_spawn(&process, program_.c_str(), &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(output[1]);
  ::close(errors[1]);
  if (failure != 0) {
    ::close(output[0]);
    ::close(errors[0]);
    return false;
  }
  process_ = Process{process, output[0], errors[0]};
  return true;
}

std::optional<DesktopDialog::Result> DesktopDialog::take() {
  if (!process_) return std::nullopt;
  int status = 0;
  const pid_t ended = ::waitpid(process_->id, &status, WNOHANG);
  if (ended == 0 || (ended < 0 && errno == EINTR)) return std::nullopt;
  return end(status);
}

DesktopDialog::Result DesktopDialog::end(int status) {
  constexpr int closed = 1;  // exit status of cumulet-file-dialog
  const Process process = *std::exchange(process_, std::nullopt);
  Result result;
  result.path = take_text(process.output);
  result.cause = take_text(process.errors);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0 && !result.path.empty())
    result.outcome = Result::Outcome::chosen;
  else if (WIFEXITED(status) && WEXITSTATUS(status) == closed)
    result.outcome = Result::Outcome::closed;
  else if (result.cause.empty())
    result.cause = program_ + " ended unexpectedly";
  return result;
}

void DesktopDialog::close() {
  if (!process_) return;
  // The portal closes the dialog when its caller leaves the bus.
  ::kill(process_->id, SIGTERM);
  static_cast<void>(end(wait_for(process_->id)));
}

std::string desktop_dialog_program() {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  if (error) return "";
  constexpr const char* name = "cumulet-file-dialog";
  for (const fs::path& folder : {self.parent_path(), self.parent_path() / ".." / CUMULET_LIBEXEC_DIR / "cumulet"})
    if (fs::is_regular_file(folder / name, error)) return (folder / name).lexically_normal().string();
  return "";
}

}  // namespace cumulet::demo
