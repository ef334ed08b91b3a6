#pragma once

#include <filesystem>

#include "base/file_path.hpp"
#include "denoise/network.hpp"

namespace cumulet::denoise {

/// Keeps the network that was used last.
class NetworkCache {
 public:
  /// Returns the network of a file, which is read only if it is another one. Throws Error(file) if it is invalid.
  NetworkPtr get(const FilePath& file) {
    if (network_ == nullptr || file_ != file.absolute()) {
      network_ = make_network(read_tza(file), file.given());
      file_ = file.absolute();
    }
    return network_;
  }

 private:
  NetworkPtr network_;
  std::filesystem::path file_;
};

}  // namespace cumulet::denoise
