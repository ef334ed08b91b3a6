#include "child_process.hpp"

#include <fcntl.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): kill() is POSIX
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>

namespace cumulet::demo {
namespace {

// The status if the system has none, because this program was started so that it ignores the end of children: that of a
// failure.
constexpr int lost = 127 << 8;

void set_stream(posix_spawn_file_actions_t& actions, int stream, std::optional<int> descriptor) {
  if (descriptor)
    ::posix_spawn_file_actions_adddup2(&actions, *descriptor, stream);
  else
    ::posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_WRONLY, 0);
}

}  // namespace

ChildProcess::ChildProcess(std::vector<std::string> arguments, const Streams& streams) {
  std::vector<char*> pointers;
  pointers.reserve(arguments.size() + 1);
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  posix_spawn_file_actions_t actions{};
  ::posix_spawn_file_actions_init(&actions);
  set_stream(actions, STDOUT_FILENO, streams.output);
  set_stream(actions, STDERR_FILENO, streams.errors);
  const int failure = ::posix_spawn(&process_, pointers.front(), &actions, nullptr, pointers.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failure != 0) throw std::system_error(failure, std::generic_category(), arguments.front());
}

ChildProcess::~ChildProcess() { end(SIGTERM); }

std::optional<int> ChildProcess::status() {
  if (status_) return status_;
  int status = 0;
  const pid_t ended = ::waitpid(process_, &status, WNOHANG);
  if (ended > 0) status_ = status;
  if (ended < 0 && errno != EINTR) status_ = lost;
  return status_;
}

void ChildProcess::end(int signal) {
  if (status_) return;
  ::kill(process_, signal);
  int status = lost;
  while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  status_ = status;
}

void ChildProcess::yield(int niceness) const { ::setpriority(PRIO_PROCESS, static_cast<id_t>(process_), niceness); }

std::string find_program(const std::string& name, const std::string& other_folder) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  if (error) return "";
  for (const fs::path& folder : {self.parent_path(), self.parent_path() / other_folder})
    if (fs::is_regular_file(folder / name, error)) return (folder / name).lexically_normal().string();
  return "";
}

}  // namespace cumulet::demo
