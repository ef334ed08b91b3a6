#include "file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace cumulet::image {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& path, const std::string& cause) {
  throw std::runtime_error(path + ": " + cause);
}
[[noreturn]] void fail(const std::string& path, int error) {
  fail(path, std::error_code(error, std::generic_category()).message());
}

/// A file descriptor, optionally with a temporary file that is deleted unless it is renamed.
class Descriptor {
 public:
  explicit Descriptor(int descriptor, std::string temporary = {})
      : descriptor_(descriptor), temporary_(std::move(temporary)) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
  }

  /// Returns false and sets errno on failure.
  [[nodiscard]] bool write(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
      if (written < 0) {
        if (errno == EINTR) continue;
        return false;
      }
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return true;
  }
  [[nodiscard]] bool close() { return ::close(std::exchange(descriptor_, -1)) == 0; }
  /// Calls fsync first: a file system may store the new name before the data, and may report "no space" only then.
  [[nodiscard]] bool rename(const std::string& path) {
    if (::fsync(descriptor_) != 0 || !close() || ::rename(temporary_.c_str(), path.c_str()) != 0) return false;
    temporary_.clear();
    return true;
  }

 private:
  int descriptor_;
  std::string temporary_;
};

/// Destination of a write: the path after following links, and whether it is a device or pipe.
struct Target {
  std::string path;
  bool special = false;
  mode_t mode = 0666;
};

Target resolve(const std::string& path) {
  if (path.empty()) throw std::runtime_error("the name of the file to write is empty");
  Target target{path};
  std::error_code error;
  if (fs::is_symlink(path, error)) {
    target.path = fs::weakly_canonical(path, error).string();
    if (error) fail(path, error.message());
  }
  struct stat status {};
  if (::stat(target.path.c_str(), &status) != 0) {
    if (errno != ENOENT) fail(path, errno);
    return target;
  }
  if (S_ISDIR(status.st_mode)) fail(path, EISDIR);
  // Checked explicitly, because a rename ignores the write protection of the existing file.
  if (::access(target.path.c_str(), W_OK) != 0) fail(path, errno);
  target.special = !S_ISREG(status.st_mode);
  target.mode = status.st_mode & 0777;
  return target;
}

Descriptor open_sibling(const std::string& path, const Target& target) {
  // mkstemp would make the file private; here the user's umask applies.
  for (int attempt = 0;; ++attempt) {
    std::string name = target.path + ".tmp" + std::to_string(::getpid()) + "-" + std::to_string(attempt);
    const int descriptor = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, target.mode);
    if (descriptor >= 0) return Descriptor(descriptor, std::move(name));
    if (errno != EEXIST || attempt == 100) fail(path, errno);
  }
}

}  // namespace

void check_writable(const std::string& path) {
  const Target target = resolve(path);
  if (!target.special) open_sibling(path, target);
}

void replace_file(const std::string& path, std::string_view bytes) {
  const Target target = resolve(path);
  if (target.special) {
    Descriptor device(::open(target.path.c_str(), O_WRONLY | O_CLOEXEC));
    if (!device.write(bytes) || !device.close()) fail(path, errno);
    return;
  }
  Descriptor sibling = open_sibling(path, target);
  if (!sibling.write(bytes) || !sibling.rename(target.path)) fail(path, errno);
}

std::string read_file(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) fail(path, errno);
  const Descriptor file(descriptor);
  std::string bytes;
  for (std::array<char, 1 << 16> block;;) {
    const ssize_t count = ::read(descriptor, block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(path, errno);
    if (count == 0) return bytes;
    bytes.append(block.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace cumulet::image
