#include "desktop.hpp"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <system_error>

namespace cumulet::demo {

bool show_in_folder(const std::string& path) {
  std::error_code error;
  std::string folder = std::filesystem::absolute(path, error).parent_path().string();
  if (error) return false;
  // The shell starts the program in the background, and ends at once.
  std::string shell = "sh";
  std::string option = "-c";
  std::string script = "command -v xdg-open >/dev/null || exit 1; xdg-open \"$1\" >/dev/null 2>&1 &";
  std::array<char*, 6> arguments = {shell.data(), option.data(), script.data(), shell.data(), folder.data(), nullptr};
  pid_t process = 0;
  if (::posix_spawnp(&process, shell.c_str(), nullptr, nullptr, arguments.data(), environ) != 0) return false;
  int status = 0;
  while (::waitpid(process, &status, 0) < 0)
    if (errno != EINTR) return false;
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace cumulet::demo
