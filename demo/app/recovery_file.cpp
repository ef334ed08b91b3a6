#include "recovery_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <exception>
#include <file.hpp>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace cumulet::demo {
namespace {

namespace fs = std::filesystem;

constexpr int max_files = 64;  // of processes that run at the same time

/// Replaces the content of the lock file, which must keep its lock.
void write_name(int file, const std::string& path, const std::string& name) {
  if (::ftruncate(file, 0) == 0 && ::pwrite(file, name.data(), name.size(), 0) == static_cast<ssize_t>(name.size()))
    return;
  throw std::runtime_error(path + ": " + std::error_code(errno, std::generic_category()).message());
}

}  // namespace

RecoveryFile::RecoveryFile(std::string folder) : folder_(std::move(folder)) {
  if (folder_.empty()) return;
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error || !lock(true)) {
    lock(false);
    return;
  }
  left_ = Left{path_, {}};
  try {
    left_->scene_path = image::read_file(path_ + ".lock");
  } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch): the scene then has no file
  }
}

RecoveryFile::~RecoveryFile() { unlock(); }

bool RecoveryFile::lock(bool with_copy) {
  for (int i = 1; i <= max_files; ++i) {
    const std::string path = folder_ + "/recovery-" + std::to_string(i) + ".json";
    std::error_code error;
    if (with_copy && !fs::exists(path, error)) continue;
    const int file = ::open((path + ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (file < 0) return false;
    // Looked for again under the lock, because the copy's owner may be removing it.
    if (::flock(file, LOCK_EX | LOCK_NB) == 0 && fs::exists(path, error) == with_copy) {
      unlock();
      lock_ = file;
      path_ = path;
      return true;
    }
    ::close(file);
  }
  return false;
}

void RecoveryFile::unlock() {
  if (const auto file = std::exchange(lock_, std::nullopt)) ::close(*file);
}

void RecoveryFile::write(const SceneOptions& scene, const std::string& scene_path) {
  if (left_ && lock(false)) left_.reset();
  if (!lock_ || left_) return;
  image::replace_file(path_, scene_text(scene, path_));
  write_name(*lock_, path_, scene_path.empty() ? "" : fs::absolute(scene_path).string());
}

void RecoveryFile::remove() const {
  std::error_code ignored;
  if (lock_ && !left_) fs::remove(path_, ignored);
}

}  // namespace cumulet::demo
