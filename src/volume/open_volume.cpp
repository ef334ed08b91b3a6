// Recognizes the format of a volume file.

#include <array>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "volume/array_file.hpp"
#include "volume/import_detail.hpp"
#include "volume/source_file.hpp"

namespace cumulet::volume {

using namespace detail;

namespace {

bool begins_with(ByteSource& content, std::string_view magic) {
  std::string head(magic.size(), '\0');
  head.resize(content.read(0, head.data(), head.size()));
  return head == magic;
}

bool is_nrrd(ByteSource& content) { return begins_with(content, "NRRD0"); }

bool is_vtk(ByteSource& content) {
  std::string head(256, '\0');
  head.resize(content.read(0, head.data(), head.size()));
  return head.find("<VTKFile") != std::string::npos;
}

}  // namespace

std::unique_ptr<Reader> detail::open(const std::filesystem::path& file, Progress* progress) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (status.type() == fs::file_type::not_found) fail("no such file");
  if (status.type() == fs::file_type::none) fail(error.message());
  if (status.type() == fs::file_type::directory) fail("is a directory");
  if (status.type() != fs::file_type::regular) fail("is not a regular file");
  std::unique_ptr<ByteSource> content = open_file(file);
  if (const auto description = raw_description_of(file)) return open_raw(std::move(content), *description, progress);
  if (is_nrrd(*content)) return open_nrrd(std::move(content), file.parent_path(), progress);
  if (file.extension() == ".raw" && !begins_with(*content, "NanoVDB") && !begins_with(*content, " BDV")) {
    const std::string name = file.filename().string();
    fail("has no description beside it: " + name + ".json or " + file.stem().string() + ".json");
  }
  return open(std::move(content), progress);
}

std::unique_ptr<Reader> detail::open(std::unique_ptr<ByteSource> content, Progress* progress) {
  if (is_nrrd(*content)) return open_nrrd(std::move(content), std::nullopt, progress);
  if (is_vtk(*content)) return open_vti(std::move(content), progress);
  // Recognized by content: a wrong file extension is no error.
  std::array<char, 8> magic{};
  const std::size_t got = content->read(0, magic.data(), magic.size());
  const std::string_view head(magic.data(), got);
  if (got == 0) fail("is empty");
  if (head.starts_with("NanoVDB")) return open_nanovdb(std::move(content), progress);
  if (head == std::string_view(" BDV\0\0\0\0", 8)) return open_vdb(std::move(content), progress);
  if (head.ends_with("BDVonaN")) fail("is a NanoVDB file in big-endian byte order, which is not supported");
  if (head == std::string_view("\0\0\0\0VDB ", 8)) {
    fail("is an OpenVDB file in big-endian byte order, which is not supported");
  }
  if (got < magic.size()) fail("is too short to be a VDB, NanoVDB or NRRD file");
  fail("is not a VDB, NanoVDB or NRRD file");
}

}  // namespace cumulet::volume
