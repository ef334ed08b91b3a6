#include "recent_thumbnails.hpp"

#include <fcntl.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): kill() is POSIX
#include <spawn.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <program.hpp>
#include <system_error>
#include <utility>
#include <vector>

#include "model.hpp"

namespace cumulet::demo {
namespace {

namespace fs = std::filesystem;

constexpr int low_priority = 10;  // the user's work comes first

}  // namespace

RecentThumbnails::RecentThumbnails(std::string program, std::string folder)
    : program_(std::move(program)), folder_(std::move(folder)) {}

RecentThumbnails::~RecentThumbnails() { stop(); }

void RecentThumbnails::stop() {
  if (!making_) return;
  ::kill(making_->process, SIGKILL);
  while (::waitpid(making_->process, nullptr, 0) < 0 && errno == EINTR) {
  }
  std::error_code error;
  fs::remove(making_->unfinished, error);
  making_.reset();
}

std::string RecentThumbnails::path_for(const std::string& file) const {
  struct stat status {};
  if (is_environment(file) || ::stat(file.c_str(), &status) != 0) return "";
  const std::string version = file + '\n' + std::to_string(status.st_mtim.tv_sec) + '.' +
                              std::to_string(status.st_mtim.tv_nsec) + '\n' + std::to_string(status.st_size);
  std::array<char, 24> name{};
  std::snprintf(name.data(), name.size(), "%016llx.png", static_cast<unsigned long long>(fnv1a(version)));
  return (fs::path(folder_) / name.data()).string();
}

std::string RecentThumbnails::find(const std::string& file) const {
  if (folder_.empty()) return "";
  const std::string picture = path_for(file);
  std::error_code error;
  return !picture.empty() && fs::is_regular_file(picture, error) ? picture : "";
}

bool RecentThumbnails::follow(std::span<const std::string> files) {
  if (program_.empty() || folder_.empty()) return false;
  bool made = false;
  if (making_) {
    int status = 0;
    const pid_t ended = ::waitpid(making_->process, &status, WNOHANG);
    if (ended == 0 || (ended < 0 && errno == EINTR)) return false;
    std::error_code error;
    made = WIFEXITED(status) && WEXITSTATUS(status) == 0;
    if (made) fs::rename(making_->unfinished, making_->picture, error);
    if (!made || error) {
      failed_[making_->file] = making_->picture;
      fs::remove(making_->unfinished, error);
    }
    making_.reset();
  }
  for (const std::string& file : files) {
    const std::string picture = path_for(file);
    std::error_code error;
    if (picture.empty() || fs::exists(picture, error)) continue;
    const auto failed = failed_.find(file);
    if (failed != failed_.end() && failed->second == picture) continue;
    begin(file, picture);
    break;
  }
  return made;
}

void RecentThumbnails::begin(const std::string& file, const std::string& picture) {
  std::error_code error;
  fs::create_directories(folder_, error);
  const std::string unfinished = picture + '.' + std::to_string(::getpid()) + ".part";
  std::vector<std::string> texts = {program_, "--thumbnail", std::to_string(side), "-o", unfinished};
  if (has_ending(file, ".json")) texts.emplace_back("--scene");
  texts.push_back(file);
  std::vector<char*> arguments;
  arguments.reserve(texts.size() + 1);
  for (std::string& text : texts) arguments.push_back(text.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions{};
  ::posix_spawn_file_actions_init(&actions);
  for (const int output : {STDOUT_FILENO, STDERR_FILENO})
    ::posix_spawn_file_actions_addopen(&actions, output, "/dev/null", O_WRONLY, 0);
  pid_t process = 0;
  const int failure = ::posix_spawn(&process, program_.c_str(), &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failure != 0) {
    failed_[file] = picture;
    return;
  }
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(process), low_priority);
  making_ = Making{process, file, picture, unfinished};
}

std::string thumbnail_program() {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  if (error) return "";
  const fs::path program = self.parent_path() / "cumulet-render";
  return fs::is_regular_file(program, error) ? program.string() : "";
}

std::string thumbnail_folder() {
  const std::string cache = user_folder("XDG_CACHE_HOME", ".cache");
  return cache.empty() ? "" : cache + "/cumulet/thumbnails";
}

}  // namespace cumulet::demo
