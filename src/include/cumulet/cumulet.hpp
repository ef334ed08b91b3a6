/**
 * @file
 * The C++20 interface of Cumulet: a thin, header-only layer over cumulet.h with no features of its own. Classes release
 * the handles that they own. Spans replace pointer and count, enum classes enums, std::array C arrays, and a Result the
 * status.
 *
 * Names:
 *
 * - Each function and member has its documentation in cumulet.h, with meaning, units, threads and the [GL] mark:
 *   Viewer::set_grid is cumulet_set_grid, and GridDesc::threshold is cumulet_grid_desc.threshold.
 * - Members are initialized to zero, which means the default as in C. Descriptors convert to their C counterparts, with
 *   struct_size filled in:
 *
 *       viewer.set_medium({.density_scale = 4, .anisotropy = 0.7F}).value();
 *
 * - The build generates cumulet_descriptors.hpp from cumulet.h. It has enums, descriptors and result structs, field for
 *   field.
 * - Paths are UTF-8.
 *
 * Errors:
 *
 * - No function of this header throws, so that it also works without exceptions. A function that can fail returns a
 *   Result, which is [[nodiscard]]. value() of a failed one calls std::terminate.
 * - With an empty handle (default constructed or moved from) every call fails with StatusCode::invalid_argument.
 *
 * Callbacks:
 *
 * - Callbacks are function objects. The viewer keeps them until it is destroyed, at an address that does not change
 *   when the viewer is moved. cumulet.h says when and on which thread they are called.
 * - A callback that throws ends the program.
 */
#ifndef CUMULET_CUMULET_HPP
#define CUMULET_CUMULET_HPP

#if defined(_MSVC_LANG)
#define CUMULET_CPLUSPLUS _MSVC_LANG /* __cplusplus is 199711 there, unless /Zc:__cplusplus is given */
#else
#define CUMULET_CPLUSPLUS __cplusplus
#endif
#if CUMULET_CPLUSPLUS <= 201703L
#error "cumulet.hpp needs C++20: compile with -std=c++20 (MSVC: /std:c++20), or include cumulet.h, which is C"
#else

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "cumulet.h"

namespace cumulet {
// Parts of one program may be compiled against different versions of this header: their inline functions are separate.
inline namespace v0_2 {
static_assert(CUMULET_VERSION_MAJOR == 0 && CUMULET_VERSION_MINOR == 2, "the namespace names the version");

// ---- Enums ----------------------------------------------------------------------------------------------------------

/// cumulet_status. The name Status is a macro of Xlib.
enum class StatusCode {
  ok = CUMULET_OK,
  invalid_argument = CUMULET_ERROR_INVALID_ARGUMENT,
  unsupported = CUMULET_ERROR_UNSUPPORTED,
  file = CUMULET_ERROR_FILE,
  out_of_memory = CUMULET_ERROR_OUT_OF_MEMORY,
  gl = CUMULET_ERROR_GL,
  internal = CUMULET_ERROR_INTERNAL,
  cancelled = CUMULET_ERROR_CANCELLED,
  context_lost = CUMULET_ERROR_CONTEXT_LOST,
  detached = CUMULET_ERROR_DETACHED,
  timeout = CUMULET_ERROR_TIMEOUT
};
/// cumulet_key. Letters and digits are their upper-case ASCII codes: Key{'A'}.
enum class Key : std::int32_t {
  none = CUMULET_KEY_NONE,
  home = CUMULET_KEY_HOME,
  keypad_0 = CUMULET_KEY_KEYPAD_0,
  keypad_1,
  keypad_2,
  keypad_3,
  keypad_4,
  keypad_5,
  keypad_6,
  keypad_7,
  keypad_8,
  keypad_9,
  keypad_period = CUMULET_KEY_KEYPAD_PERIOD,
  left = CUMULET_KEY_LEFT,
  right = CUMULET_KEY_RIGHT,
  up = CUMULET_KEY_UP,
  down = CUMULET_KEY_DOWN
};
/// CUMULET_MODIFIER_* bits, combined with |.
enum class Modifiers : std::uint32_t {
  none = 0,
  shift = CUMULET_MODIFIER_SHIFT,
  ctrl = CUMULET_MODIFIER_CTRL,
  alt = CUMULET_MODIFIER_ALT
};
/// CUMULET_RENDER_* bits, combined with |.
enum class RenderFlags : std::uint32_t {
  none = 0,
  incomplete = CUMULET_RENDER_INCOMPLETE,
  converged = CUMULET_RENDER_CONVERGED,
  loading = CUMULET_RENDER_LOADING,
  failed = CUMULET_RENDER_FAILED,
  preview = CUMULET_RENDER_PREVIEW,
  new_image = CUMULET_RENDER_NEW_IMAGE,
  denoised = CUMULET_RENDER_DENOISED
};

[[nodiscard]] constexpr Modifiers operator|(Modifiers a, Modifiers b) noexcept {
  return Modifiers{static_cast<std::uint32_t>(a) | static_cast<std::uint32_t>(b)};
}
[[nodiscard]] constexpr RenderFlags operator|(RenderFlags a, RenderFlags b) noexcept {
  return RenderFlags{static_cast<std::uint32_t>(a) | static_cast<std::uint32_t>(b)};
}

// ---- Types of the generated header ----------------------------------------------------------------------------------

using Rgb = std::array<float, 3>;
using Vector = std::array<double, 3>;
/// 4x4, column-major.
using Matrix = std::array<double, 16>;

/// A bounding box in world space.
struct Bounds {
  Vector min{};
  Vector max{};
};

/// Zero-terminated text in a fixed array, cut to fit.
template <std::size_t Size>
class Text {
 public:
  constexpr Text() noexcept = default;
  constexpr explicit Text(std::string_view text) noexcept {
    std::copy_n(text.data(), text.size() < Size ? text.size() : Size - 1, chars_.data());
  }
  [[nodiscard]] constexpr const char* c_str() const noexcept { return chars_.data(); }
  [[nodiscard]] constexpr std::string_view view() const noexcept { return chars_.data(); }
  [[nodiscard]] constexpr bool empty() const noexcept { return chars_[0] == '\0'; }

 private:
  std::array<char, Size> chars_{};
};

}  // namespace v0_2
}  // namespace cumulet

#include <cumulet/cumulet_descriptors.hpp>

namespace cumulet {
inline namespace v0_2 {

// ---- Results --------------------------------------------------------------------------------------------------------

/// Why a call failed: a status, and one line that names the cause, and the file if there is one.
struct Error {
  StatusCode status = StatusCode::ok;
  Text<512> message;
};

/// A value or an error: a small std::expected for C++20.
template <class T = void>
class [[nodiscard]] Result {
 public:
  Result(T value) noexcept : value_(std::move(value)) {}
  Result(const Error& error) noexcept : error_(error) {}

  [[nodiscard]] bool has_value() const noexcept { return value_.has_value(); }
  [[nodiscard]] explicit operator bool() const noexcept { return has_value(); }
  /// Returns the value. Calls std::terminate if there is none; so do * and ->.
  [[nodiscard]] T& value() & noexcept {
    if (!value_) std::terminate();
    return *value_;
  }
  [[nodiscard]] const T& value() const& noexcept {
    if (!value_) std::terminate();
    return *value_;
  }
  [[nodiscard]] T value() && noexcept { return std::move(value()); }
  [[nodiscard]] T& operator*() & noexcept { return value(); }
  [[nodiscard]] const T& operator*() const& noexcept { return value(); }
  [[nodiscard]] T operator*() && noexcept { return std::move(value()); }
  [[nodiscard]] T* operator->() noexcept { return &value(); }
  [[nodiscard]] const T* operator->() const noexcept { return &value(); }
  /// Returns the error; StatusCode::ok and "" if there is a value.
  [[nodiscard]] const Error& error() const& noexcept { return error_; }
  [[nodiscard]] Error error() && noexcept { return error_; }

 private:
  std::optional<T> value_;
  Error error_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() noexcept = default;
  Result(const Error& error) noexcept : error_(error) {}

  [[nodiscard]] bool has_value() const noexcept { return error_.status == StatusCode::ok; }
  [[nodiscard]] explicit operator bool() const noexcept { return has_value(); }
  /// Calls std::terminate if the call failed.
  void value() const noexcept {
    if (!has_value()) std::terminate();
  }
  /// Returns the error; StatusCode::ok and "" if the call succeeded.
  [[nodiscard]] const Error& error() const& noexcept { return error_; }
  [[nodiscard]] Error error() && noexcept { return error_; }

 private:
  Error error_;
};

[[nodiscard]] inline const char* status_text(StatusCode status) noexcept {
  return cumulet_status_text(static_cast<cumulet_status>(status));
}
/// Returns the library's version as major * 10000 + minor * 100 + patch.
[[nodiscard]] inline std::uint32_t version() noexcept { return cumulet_version(); }
/// Number of light groups.
inline constexpr std::uint32_t light_group_count = CUMULET_LIGHT_GROUPS;
/// Returns GLSL for the host's shaders, zero-terminated.
[[nodiscard]] inline const char* transmittance_map_glsl() noexcept { return cumulet_transmittance_map_glsl(); }

namespace detail {

[[nodiscard]] inline Result<> result(cumulet_status status, const char* cause) noexcept {
  if (status == CUMULET_OK) return {};
  return Error{static_cast<StatusCode>(status), Text<512>(cause)};
}
/// For functions without a viewer that return only a status.
[[nodiscard]] inline Result<> result(cumulet_status status) noexcept {
  if (status == CUMULET_OK) return {};
  const char* const cause = cumulet_last_error(nullptr);
  return result(status, *cause != '\0' ? cause : cumulet_status_text(status));
}

/// For functions that create a handle and write the cause to a buffer: make(&out, error, error_size).
template <class Owner, class Make>
[[nodiscard]] Result<Owner> made(Make&& make) noexcept {
  decltype(std::declval<Owner>().handle()) out = nullptr;
  std::array<char, 512> cause{};
  const cumulet_status status = make(&out, cause.data(), cause.size());
  if (auto done = result(status, cause.data()); !done) return done.error();
  return Owner::adopt(out);
}

/// Returns an empty struct for the library to fill.
template <class Desc>
[[nodiscard]] Desc sized() noexcept {
  Desc desc{};
  desc.struct_size = sizeof desc;
  return desc;
}

/// Returns the stream of read(position, std::span<std::byte>), which must outlive it.
template <class Read>
[[nodiscard]] cumulet_stream_desc stream_of(std::uint64_t size, Read& read) noexcept {
  const auto call = [](void* user, std::uint64_t position, void* to, std::uint64_t count) noexcept -> std::uint64_t {
    return (*static_cast<Read*>(user))(
        position, std::span<std::byte>(static_cast<std::byte*>(to), static_cast<std::size_t>(count)));
  };
  return {.struct_size = sizeof(cumulet_stream_desc),
          .size = size,
          .read = call,
          .read_user = const_cast<void*>(static_cast<const void*>(std::addressof(read)))};
}

[[nodiscard]] inline const char* or_null(const std::string& text) noexcept {
  return text.empty() ? nullptr : text.c_str();
}

}  // namespace detail

/// Returns the pixels of a region: x, y, width and height.
[[nodiscard]] inline Result<std::array<std::uint32_t, 4>> region_pixels(const std::array<float, 4>& region,
                                                                        std::uint32_t width,
                                                                        std::uint32_t height) noexcept {
  std::array<std::uint32_t, 4> pixels{};
  if (auto done = detail::result(cumulet_region_pixels(region.data(), width, height, pixels.data())); !done)
    return done.error();
  return pixels;
}

// ---- Volumes --------------------------------------------------------------------------------------------------------

struct DenseDesc {
  std::span<const float> values{};
  std::array<std::int32_t, 3> size{};
  Matrix index_to_world{};
  const char* name = nullptr;

  operator cumulet_dense_desc() const noexcept {
    cumulet_dense_desc c{.struct_size = sizeof c,
                         .values = values.data(),
                         .value_count = values.size(),
                         .size = {size[0], size[1], size[2]},
                         .index_to_world = {},
                         .name = name};
    std::ranges::copy(index_to_world, c.index_to_world);
    return c;
  }
};

/// Bricks and tiles. brick_count is brick_origins.size() / 3, and Volume::from_sparse checks the sizes of the other
/// spans. Tiles have the C type, with active 0 or 1, so that they need not be copied.
struct SparseDesc {
  std::span<const std::int32_t> brick_origins{};
  std::span<const float> brick_values{};
  std::span<const std::uint64_t> brick_active{};
  std::span<const cumulet_tile> tiles{};
  float background = 0.0F;
  Matrix index_to_world{};
  const char* name = nullptr;

  operator cumulet_sparse_desc() const noexcept {
    cumulet_sparse_desc c{.struct_size = sizeof c,
                          .brick_origins = brick_origins.data(),
                          .brick_values = brick_values.data(),
                          .brick_active = brick_active.data(),
                          .brick_count = brick_origins.size() / 3,
                          .tiles = tiles.data(),
                          .tile_count = tiles.size(),
                          .background = background,
                          .index_to_world = {},
                          .name = name};
    std::ranges::copy(index_to_world, c.index_to_world);
    return c;
  }
};

/// A reference to an immutable volume; a copy adds a reference.
class Volume {
 public:
  Volume() noexcept = default;
  Volume(const Volume& other) noexcept : handle_(cumulet_volume_retain(other.handle_)) {}
  Volume(Volume&& other) noexcept : handle_(other.release()) {}
  Volume& operator=(Volume other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Volume() { cumulet_volume_release(handle_); }

  [[nodiscard]] static Result<Volume> open(const std::string& path, const std::string& grid_name = {}) noexcept {
    return detail::made<Volume>([&](cumulet_volume** out, char* error, std::size_t size) {
      return cumulet_volume_open(path.c_str(), detail::or_null(grid_name), out, error, size);
    });
  }
  [[nodiscard]] static Result<Volume> open(const VolumeFileDesc& desc) noexcept {
    const cumulet_volume_file_desc c = desc;
    return detail::made<Volume>([&](cumulet_volume** out, char* error, std::size_t size) {
      return cumulet_volume_open_file(&c, out, error, size);
    });
  }
  /// Reads the bytes of a file. desc.path: name in messages; NULL: "memory".
  [[nodiscard]] static Result<Volume> from_memory(std::span<const std::byte> bytes,
                                                  const VolumeFileDesc& desc = {}) noexcept {
    const cumulet_volume_file_desc c = desc;
    return detail::made<Volume>([&](cumulet_volume** out, char* error, std::size_t size) {
      return cumulet_volume_from_memory(bytes.data(), bytes.size(), &c, out, error, size);
    });
  }
  /// Reads a file of `file_size` bytes by read(position, std::span<std::byte>), which returns the number of bytes read.
  template <class Read>
  [[nodiscard]] static Result<Volume> from_stream(std::uint64_t file_size, Read&& read,
                                                  const VolumeFileDesc& desc = {}) noexcept {
    const cumulet_volume_file_desc c = desc;
    const cumulet_stream_desc stream = detail::stream_of(file_size, read);
    return detail::made<Volume>([&](cumulet_volume** out, char* error, std::size_t size) {
      return cumulet_volume_from_stream(&stream, &c, out, error, size);
    });
  }
  [[nodiscard]] static Result<Volume> from_dense(const DenseDesc& desc) noexcept {
    const cumulet_dense_desc c = desc;
    return detail::made<Volume>([&](cumulet_volume** out, char* error, std::size_t size) {
      return cumulet_volume_from_dense(&c, out, error, size);
    });
  }
  [[nodiscard]] static Result<Volume> from_sparse(const SparseDesc& desc) noexcept {
    const cumulet_sparse_desc c = desc;
    if (desc.brick_origins.size() % 3 != 0 || desc.brick_values.size() / 512 != c.brick_count ||
        desc.brick_values.size() % 512 != 0 ||
        (!desc.brick_active.empty() && desc.brick_active.size() != c.brick_count * 8)) {
      return Error{StatusCode::invalid_argument,
                   Text<512>("a brick is 3 brick_origins, 512 brick_values and 8 brick_active (or none at all)")};
    }
    return detail::made<Volume>([&](cumulet_volume** out, char* error, std::size_t size) {
      return cumulet_volume_from_sparse(&c, out, error, size);
    });
  }

  [[nodiscard]] Result<VolumeInfo> info() const noexcept {
    auto c = detail::sized<cumulet_volume_info>();
    if (auto done = detail::result(cumulet_volume_get_info(handle_, &c)); !done) return done.error();
    return VolumeInfo::of(c);
  }
  [[nodiscard]] Result<HistogramInfo> histogram(Ramp ramp) const noexcept {
    auto c = detail::sized<cumulet_histogram_info>();
    const cumulet_status status = cumulet_volume_get_histogram(handle_, static_cast<cumulet_ramp>(ramp), &c);
    if (auto done = detail::result(status); !done) return done.error();
    return HistogramInfo::of(c);
  }
  [[nodiscard]] Result<double> suggest_density_scale() const noexcept {
    double scale = 0.0;
    if (auto done = detail::result(cumulet_volume_suggest_density_scale(handle_, &scale)); !done) return done.error();
    return scale;
  }

  [[nodiscard]] explicit operator bool() const noexcept { return handle_ != nullptr; }
  /// Returns the handle, which this object still owns.
  [[nodiscard]] cumulet_volume* handle() const noexcept { return handle_; }
  /// Returns the handle, which the caller owns now.
  [[nodiscard]] cumulet_volume* release() noexcept { return std::exchange(handle_, nullptr); }
  /// Takes over the caller's reference.
  [[nodiscard]] static Volume adopt(cumulet_volume* handle) noexcept {
    Volume volume;
    volume.handle_ = handle;
    return volume;
  }

 private:
  cumulet_volume* handle_ = nullptr;
};

/// Calls visit(name, type, unsupported_reason) with three const char* for each grid of the file.
template <class Visit>
[[nodiscard]] Result<> list_grids(const std::string& path, Visit&& visit) noexcept {
  std::array<char, 512> cause{};
  const auto call = [](void* user, const char* name, const char* type, const char* unsupported_reason) noexcept {
    (*static_cast<std::remove_reference_t<Visit>*>(user))(name, type, unsupported_reason);
  };
  void* user = const_cast<void*>(static_cast<const void*>(std::addressof(visit)));
  const cumulet_status status = cumulet_list_grids(path.c_str(), call, user, cause.data(), cause.size());
  return detail::result(status, cause.data());
}

/// The contents of a volume file. Texts in its structs are valid as long as this object.
class Inspection {
 public:
  Inspection() noexcept = default;
  Inspection(const Inspection&) = delete;
  Inspection(Inspection&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Inspection& operator=(Inspection other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Inspection() { cumulet_inspection_release(handle_); }

  [[nodiscard]] static Result<Inspection> of(const std::string& path) noexcept {
    return detail::made<Inspection>([&](cumulet_inspection** out, char* error, std::size_t size) {
      return cumulet_inspect_volume_file(path.c_str(), out, error, size);
    });
  }

  [[nodiscard]] Result<VolumeFileInfo> file() const noexcept {
    auto c = detail::sized<cumulet_volume_file_info>();
    if (auto done = detail::result(cumulet_inspection_get_file(handle_, &c)); !done) return done.error();
    return VolumeFileInfo::of(c);
  }
  [[nodiscard]] Result<GridInfo> grid(std::uint32_t index) const noexcept {
    auto c = detail::sized<cumulet_grid_info>();
    if (auto done = detail::result(cumulet_inspection_get_grid(handle_, index, &c)); !done) return done.error();
    return GridInfo::of(c);
  }
  /// Returns a metadata entry of a grid; grid -1: of the whole file.
  [[nodiscard]] Result<Metadata> metadata(std::int32_t grid, std::uint32_t index) const noexcept {
    auto c = detail::sized<cumulet_metadata>();
    if (auto done = detail::result(cumulet_inspection_get_metadata(handle_, grid, index, &c)); !done)
      return done.error();
    return Metadata::of(c);
  }

  [[nodiscard]] explicit operator bool() const noexcept { return handle_ != nullptr; }
  /// Returns the handle, which this object still owns.
  [[nodiscard]] cumulet_inspection* handle() const noexcept { return handle_; }
  /// Returns the handle, which the caller owns now.
  [[nodiscard]] cumulet_inspection* release() noexcept { return std::exchange(handle_, nullptr); }
  /// Takes over the caller's handle.
  [[nodiscard]] static Inspection adopt(cumulet_inspection* handle) noexcept {
    Inspection inspection;
    inspection.handle_ = handle;
    return inspection;
  }

 private:
  cumulet_inspection* handle_ = nullptr;
};

// ---- Surfaces -------------------------------------------------------------------------------------------------------

/// Triangles of one material. vertex_count is positions.size() / 3, and Surfaces::from_triangles checks the sizes of
/// the other spans.
struct MeshDesc {
  std::span<const float> positions{};
  std::span<const float> normals{};
  std::span<const float> colors{};
  std::span<const std::uint32_t> indices{};
  Matrix to_world{};
  std::array<float, 4> base_color{};
  float metallic = 0.0F;
  float smoothness = 0.0F;
  Rgb emission{};
  bool double_sided = false;
  std::span<const float> velocities{};

  operator cumulet_mesh_desc() const noexcept {
    cumulet_mesh_desc c{.struct_size = sizeof c,
                        .positions = positions.data(),
                        .normals = normals.empty() ? nullptr : normals.data(),
                        .colors = colors.empty() ? nullptr : colors.data(),
                        .vertex_count = positions.size() / 3,
                        .indices = indices.data(),
                        .index_count = indices.size(),
                        .to_world = {},
                        .base_color = {base_color[0], base_color[1], base_color[2], base_color[3]},
                        .metallic = metallic,
                        .smoothness = smoothness,
                        .emission = {emission[0], emission[1], emission[2]},
                        .double_sided = double_sided,
                        .velocities = velocities.empty() ? nullptr : velocities.data()};
    std::ranges::copy(to_world, c.to_world);
    return c;
  }
};

/// The host's meshes. It does not convert to cumulet_triangles_desc, whose meshes have the C type: use
/// Surfaces::from_triangles.
struct TrianglesDesc {
  std::span<const MeshDesc> meshes{};
  const char* name = nullptr;
};

/// A reference to immutable surfaces; a copy adds a reference.
class Surfaces {
 public:
  Surfaces() noexcept = default;
  Surfaces(const Surfaces& other) noexcept : handle_(cumulet_surfaces_retain(other.handle_)) {}
  Surfaces(Surfaces&& other) noexcept : handle_(other.release()) {}
  Surfaces& operator=(Surfaces other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Surfaces() { cumulet_surfaces_release(handle_); }

  [[nodiscard]] static Result<Surfaces> open(const std::string& path) noexcept {
    return detail::made<Surfaces>([&](cumulet_surfaces** out, char* error, std::size_t size) {
      return cumulet_surfaces_open(path.c_str(), out, error, size);
    });
  }
  /// Reads the bytes of a glTF file. base_directory NULL: references to other files are errors.
  [[nodiscard]] static Result<Surfaces> from_memory(std::span<const std::byte> bytes,
                                                    const char* base_directory = nullptr,
                                                    const char* name = nullptr) noexcept {
    return detail::made<Surfaces>([&](cumulet_surfaces** out, char* error, std::size_t size) {
      return cumulet_surfaces_from_memory(bytes.data(), bytes.size(), base_directory, name, out, error, size);
    });
  }
  [[nodiscard]] static Result<Surfaces> from_triangles(const TrianglesDesc& desc) noexcept {
    const std::unique_ptr<cumulet_mesh_desc[]> meshes(new (std::nothrow) cumulet_mesh_desc[desc.meshes.size()]);
    if (!meshes) return detail::result(CUMULET_ERROR_OUT_OF_MEMORY).error();
    for (std::size_t i = 0; i < desc.meshes.size(); ++i) {
      const MeshDesc& mesh = desc.meshes[i];
      const std::size_t count = mesh.positions.size() / 3;
      if (mesh.positions.size() % 3 != 0 || (!mesh.normals.empty() && mesh.normals.size() != 3 * count) ||
          (!mesh.colors.empty() && mesh.colors.size() != 4 * count) ||
          (!mesh.velocities.empty() && mesh.velocities.size() != 3 * count)) {
        return Error{StatusCode::invalid_argument,
                     Text<512>("a vertex is 3 positions, 3 normals (or none at all), 4 colors (or none at all) and "
                               "3 velocities (or none at all)")};
      }
      meshes[i] = mesh;
    }
    const cumulet_triangles_desc c{
        .struct_size = sizeof c, .meshes = meshes.get(), .mesh_count = desc.meshes.size(), .name = desc.name};
    return detail::made<Surfaces>([&](cumulet_surfaces** out, char* error, std::size_t size) {
      return cumulet_surfaces_from_triangles(&c, out, error, size);
    });
  }

  [[nodiscard]] Result<SurfacesInfo> info() const noexcept {
    auto c = detail::sized<cumulet_surfaces_info>();
    if (auto done = detail::result(cumulet_surfaces_get_info(handle_, &c)); !done) return done.error();
    return SurfacesInfo::of(c);
  }
  [[nodiscard]] Result<AnimationInfo> animation(std::uint32_t index) const noexcept {
    auto c = detail::sized<cumulet_animation_info>();
    if (auto done = detail::result(cumulet_surfaces_get_animation(handle_, index, &c)); !done) return done.error();
    return AnimationInfo::of(c);
  }
  [[nodiscard]] Result<VariantInfo> variant(std::uint32_t index) const noexcept {
    auto c = detail::sized<cumulet_variant_info>();
    if (auto done = detail::result(cumulet_surfaces_get_variant(handle_, index, &c)); !done) return done.error();
    return VariantInfo::of(c);
  }

  [[nodiscard]] explicit operator bool() const noexcept { return handle_ != nullptr; }
  /// Returns the handle, which this object still owns.
  [[nodiscard]] cumulet_surfaces* handle() const noexcept { return handle_; }
  /// Returns the handle, which the caller owns now.
  [[nodiscard]] cumulet_surfaces* release() noexcept { return std::exchange(handle_, nullptr); }
  /// Takes over the caller's reference.
  [[nodiscard]] static Surfaces adopt(cumulet_surfaces* handle) noexcept {
    Surfaces surfaces;
    surfaces.handle_ = handle;
    return surfaces;
  }

 private:
  cumulet_surfaces* handle_ = nullptr;
};

// ---- Display LUTs
// ----------------------------------------------------------------------------------------------------

struct DisplayLutDesc {
  std::span<const float> values{};  ///< 3 per point, red fastest
  std::uint32_t size = 0;           ///< points per axis
  LutShaper shaper{};
  float domain_min = 0.0F;
  float domain_max = 0.0F;

  operator cumulet_display_lut_desc() const noexcept {
    return {.struct_size = sizeof(cumulet_display_lut_desc),
            .values = values.data(),
            .value_count = values.size(),
            .size = size,
            .shaper = static_cast<cumulet_lut_shaper>(shaper),
            .domain_min = domain_min,
            .domain_max = domain_max};
  }
};

// ---- Environments ---------------------------------------------------------------------------------------------------

struct EnvironmentDesc {
  std::span<const float> values;  ///< 3 per pixel
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  const char* name = nullptr;
};

/// A reference to an immutable environment; a copy adds a reference.
class Environment {
 public:
  Environment() noexcept = default;
  Environment(const Environment& other) noexcept : handle_(cumulet_environment_retain(other.handle_)) {}
  Environment(Environment&& other) noexcept : handle_(other.release()) {}
  Environment& operator=(Environment other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Environment() { cumulet_environment_release(handle_); }

  [[nodiscard]] static Result<Environment> open(const std::string& path) noexcept {
    return detail::made<Environment>([&](cumulet_environment** out, char* error, std::size_t size) {
      return cumulet_environment_open(path.c_str(), out, error, size);
    });
  }
  /// Reads the bytes of a file. name: in messages; NULL: "memory".
  [[nodiscard]] static Result<Environment> from_memory(std::span<const std::byte> bytes,
                                                       const char* name = nullptr) noexcept {
    return detail::made<Environment>([&](cumulet_environment** out, char* error, std::size_t size) {
      return cumulet_environment_from_memory(bytes.data(), bytes.size(), name, out, error, size);
    });
  }
  /// Reads a file of `file_size` bytes by read(position, std::span<std::byte>), which returns the number of bytes read.
  template <class Read>
  [[nodiscard]] static Result<Environment> from_stream(std::uint64_t file_size, Read&& read,
                                                       const char* name = nullptr) noexcept {
    const cumulet_stream_desc stream = detail::stream_of(file_size, read);
    return detail::made<Environment>([&](cumulet_environment** out, char* error, std::size_t size) {
      return cumulet_environment_from_stream(&stream, name, out, error, size);
    });
  }
  [[nodiscard]] static Result<Environment> from_pixels(const EnvironmentDesc& desc) noexcept {
    const cumulet_environment_desc c{.struct_size = sizeof c,
                                     .values = desc.values.data(),
                                     .value_count = desc.values.size(),
                                     .width = desc.width,
                                     .height = desc.height,
                                     .name = desc.name};
    return detail::made<Environment>([&](cumulet_environment** out, char* error, std::size_t size) {
      return cumulet_environment_from_pixels(&c, out, error, size);
    });
  }

  /// Writes the environment at this size, 3 floats per pixel.
  [[nodiscard]] Result<> get_pixels(std::uint32_t width, std::uint32_t height, std::span<float> rgb) const noexcept {
    return detail::result(cumulet_environment_get_pixels(handle_, width, height, rgb.data(), rgb.size()));
  }
  [[nodiscard]] Result<EnvironmentInfo> info() const noexcept {
    auto c = detail::sized<cumulet_environment_info>();
    if (auto done = detail::result(cumulet_environment_get_info(handle_, &c)); !done) return done.error();
    return EnvironmentInfo::of(c);
  }

  [[nodiscard]] explicit operator bool() const noexcept { return handle_ != nullptr; }
  /// Returns the handle, which this object still owns.
  [[nodiscard]] cumulet_environment* handle() const noexcept { return handle_; }
  /// Returns the handle, which the caller owns now.
  [[nodiscard]] cumulet_environment* release() noexcept { return std::exchange(handle_, nullptr); }
  /// Takes over the caller's reference.
  [[nodiscard]] static Environment adopt(cumulet_environment* handle) noexcept {
    Environment environment;
    environment.handle_ = handle;
    return environment;
  }

 private:
  cumulet_environment* handle_ = nullptr;
};

// ---- Sequences ------------------------------------------------------------------------------------------------------

struct SequenceDesc {
  std::span<const char* const> paths{};
  VolumeFileDesc file = {};
  std::uint64_t memory_bytes = 0;
};

/// A reference to a sequence of volumes; a copy adds a reference to the same sequence. Any thread.
class Sequence {
 public:
  Sequence() noexcept = default;
  Sequence(const Sequence& other) noexcept : handle_(cumulet_sequence_retain(other.handle_)) {}
  Sequence(Sequence&& other) noexcept : handle_(other.release()) {}
  Sequence& operator=(Sequence other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Sequence() { cumulet_sequence_release(handle_); }

  [[nodiscard]] static Result<Sequence> create(const SequenceDesc& desc) noexcept {
    const cumulet_volume_file_desc file = desc.file;
    const cumulet_sequence_desc c{.struct_size = sizeof c,
                                  .paths = desc.paths.data(),
                                  .count = desc.paths.size(),
                                  .file = &file,
                                  .memory_bytes = desc.memory_bytes};
    return detail::made<Sequence>([&](cumulet_sequence** out, char* error, std::size_t size) {
      return cumulet_sequence_create(&c, out, error, size);
    });
  }
  [[nodiscard]] Result<> set_playback(const PlaybackDesc& desc) const noexcept {
    const cumulet_playback_desc c = desc;
    return detail::result(cumulet_sequence_set_playback(handle_, &c));
  }
  [[nodiscard]] Result<> set_time(double seconds) const noexcept {
    return detail::result(cumulet_sequence_set_time(handle_, seconds));
  }
  [[nodiscard]] Result<> set_frame(double frame) const noexcept {
    return detail::result(cumulet_sequence_set_frame(handle_, frame));
  }
  [[nodiscard]] Result<std::uint32_t> get_frame_at(double seconds) const noexcept {
    std::uint32_t frame = 0;
    if (auto done = detail::result(cumulet_sequence_get_frame_at(handle_, seconds, &frame)); !done) return done.error();
    return frame;
  }
  [[nodiscard]] Result<double> get_time_of(std::uint32_t frame) const noexcept {
    double seconds = 0.0;
    if (auto done = detail::result(cumulet_sequence_get_time_of(handle_, frame, &seconds)); !done) return done.error();
    return seconds;
  }

  [[nodiscard]] explicit operator bool() const noexcept { return handle_ != nullptr; }
  /// Returns the handle, which this object still owns.
  [[nodiscard]] cumulet_sequence* handle() const noexcept { return handle_; }
  /// Returns the handle, which the caller owns now.
  [[nodiscard]] cumulet_sequence* release() noexcept { return std::exchange(handle_, nullptr); }
  /// Takes over the caller's reference.
  [[nodiscard]] static Sequence adopt(cumulet_sequence* handle) noexcept {
    Sequence sequence;
    sequence.handle_ = handle;
    return sequence;
  }

 private:
  cumulet_sequence* handle_ = nullptr;
};

// ---- Dynamic volumes
// ---------------------------------------------------------------------------------------------------

/// The voxels of one channel: a dense array, or bricks.
class Field {
 public:
  Field(Channel channel, const DenseDesc& dense) noexcept : channel_(channel), dense_(dense), is_dense_(true) {}
  Field(Channel channel, const SparseDesc& sparse) noexcept : channel_(channel), sparse_(sparse) {}

  /// The result is valid as long as this object.
  operator cumulet_field() const noexcept {
    return {.struct_size = sizeof(cumulet_field),
            .channel = static_cast<cumulet_channel>(channel_),
            .dense = is_dense_ ? &dense_ : nullptr,
            .sparse = is_dense_ ? nullptr : &sparse_};
  }

 private:
  Channel channel_;
  cumulet_dense_desc dense_{};
  cumulet_sparse_desc sparse_{};
  bool is_dense_ = false;
};

/// The fields of a simulation state. They are used only during the call.
struct VolumeFieldsDesc {
  std::span<const Field> fields{};
  const char* name = nullptr;
  cumulet_release_fn release = nullptr;
  void* release_user = nullptr;
};

/// The voxels of one channel in GL: a component of a texture, or if texture is 0, numbers in a buffer.
struct GlField {
  Channel channel = Channel::density;
  std::uint32_t texture = 0;
  std::uint32_t component = 0;
  std::uint32_t buffer = 0;
  VoxelFormat format = VoxelFormat::r32f;
  std::uint64_t offset = 0;
  std::array<std::uint64_t, 3> strides{};
  std::array<int, 3> size{};
  Matrix index_to_world{};

  operator cumulet_gl_field() const noexcept {
    cumulet_gl_field c{.struct_size = sizeof(cumulet_gl_field),
                       .channel = static_cast<cumulet_channel>(channel),
                       .texture = texture,
                       .component = component,
                       .buffer = buffer,
                       .format = static_cast<cumulet_voxel_format>(format),
                       .offset = offset,
                       .strides = {strides[0], strides[1], strides[2]},
                       .size = {size[0], size[1], size[2]},
                       .index_to_world = {}};
    std::copy(index_to_world.begin(), index_to_world.end(), c.index_to_world);
    return c;
  }
};

/// The fields of a simulation state in GL. changed: boxes of voxels (both ends inclusive) that differ from the last
/// state; nullopt: a complete state.
struct GlVolumeDesc {
  std::span<const GlField> fields{};
  std::optional<std::span<const cumulet_voxel_box>> changed{};
  void* wait = nullptr;  ///< A GLsync, or null.
  const char* name = nullptr;
};

namespace detail {

/// Calls `call` with the C descriptor of a state.
template <class Call>
auto with_fields(const VolumeFieldsDesc& desc, Call&& call) {
  // One more than there are channels: with more fields one channel occurs twice, which the library refuses.
  constexpr std::size_t most = CUMULET_CHANNEL_VELOCITY_Z + 2;
  std::array<cumulet_field, most> fields{};
  const std::size_t count = std::min(desc.fields.size(), most);
  for (std::size_t i = 0; i < count; ++i) fields[i] = desc.fields[i];
  const cumulet_volume_fields_desc c{.struct_size = sizeof c,
                                     .fields = fields.data(),
                                     .field_count = count,
                                     .name = desc.name,
                                     .release = desc.release,
                                     .release_user = desc.release_user};
  return call(c);
}

} /* namespace detail */

/// Creates a volume with several channels, which are copied.
[[nodiscard]] inline Result<Volume> volume_from_fields(const VolumeFieldsDesc& desc) noexcept {
  return detail::with_fields(desc, [](const cumulet_volume_fields_desc& c) {
    return detail::made<Volume>([&](cumulet_volume** out, char* error, std::size_t size) {
      return cumulet_volume_from_fields(&c, out, error, size);
    });
  });
}

/// A reference to a dynamic volume; a copy adds a reference to the same volume. Any thread.
class DynamicVolume {
 public:
  DynamicVolume() noexcept = default;
  DynamicVolume(const DynamicVolume& other) noexcept : handle_(cumulet_dynamic_volume_retain(other.handle_)) {}
  DynamicVolume(DynamicVolume&& other) noexcept : handle_(other.release()) {}
  DynamicVolume& operator=(DynamicVolume other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~DynamicVolume() { cumulet_dynamic_volume_release(handle_); }

  [[nodiscard]] static Result<DynamicVolume> create(const DynamicVolumeDesc& desc = {}) noexcept {
    const cumulet_dynamic_volume_desc c = desc;
    return detail::made<DynamicVolume>([&](cumulet_dynamic_volume** out, char* error, std::size_t size) {
      return cumulet_dynamic_volume_create(&c, out, error, size);
    });
  }
  /// Submits a complete state.
  [[nodiscard]] Result<> set(const VolumeFieldsDesc& desc) const noexcept {
    return hand_over(desc, cumulet_dynamic_volume_set);
  }
  /// Submits the last state with these bricks replaced.
  [[nodiscard]] Result<> update(const VolumeFieldsDesc& desc) const noexcept {
    return hand_over(desc, cumulet_dynamic_volume_update);
  }
  /// Returns the newest state; an empty object before the first one.
  [[nodiscard]] Result<Volume> get_volume() const noexcept {
    return detail::made<Volume>([&](cumulet_volume** out, char* error, std::size_t size) {
      return cumulet_dynamic_volume_get_volume(handle_, out, error, size);
    });
  }

  [[nodiscard]] explicit operator bool() const noexcept { return handle_ != nullptr; }
  /// Returns the handle, which this object still owns.
  [[nodiscard]] cumulet_dynamic_volume* handle() const noexcept { return handle_; }
  /// Returns the handle, which the caller owns now.
  [[nodiscard]] cumulet_dynamic_volume* release() noexcept { return std::exchange(handle_, nullptr); }
  /// Takes over the caller's reference.
  [[nodiscard]] static DynamicVolume adopt(cumulet_dynamic_volume* handle) noexcept {
    DynamicVolume volume;
    volume.handle_ = handle;
    return volume;
  }

 private:
  template <class Call>
  Result<> hand_over(const VolumeFieldsDesc& desc, Call* call) const noexcept {
    return detail::with_fields(desc, [&](const cumulet_volume_fields_desc& c) {
      std::array<char, 512> cause{};
      const cumulet_status status = call(handle_, &c, cause.data(), cause.size());
      return detail::result(status, cause.data());
    });
  }
  cumulet_dynamic_volume* handle_ = nullptr;
};

// ---- Clips ----------------------------------------------------------------------------------------------------------

/// Maximum number of planes of a ClipDesc.
inline constexpr std::uint64_t max_clip_planes = CUMULET_CLIP_PLANES;

/// The part of a volume that is shown: the intersection of a box and of half-spaces a x + b y + c z + d >= 0.
struct ClipDesc {
  std::optional<Bounds> box = {};
  std::span<const std::array<double, 4>> planes = {};

  operator cumulet_clip_desc() const noexcept {
    cumulet_clip_desc c{};
    c.struct_size = sizeof c;
    c.box = box ? 1 : 0;
    for (std::size_t axis = 0; axis < 3 && box; ++axis) {
      c.box_min[axis] = box->min[axis];
      c.box_max[axis] = box->max[axis];
    }
    c.planes = planes.empty() ? nullptr : planes.front().data();
    c.plane_count = planes.size();
    return c;
  }
};

// ---- Instances ------------------------------------------------------------------------------------------------------

/// Content, transform and medium of an instance. At most one of volume, sequence and dynamic_volume is set.
struct InstanceDesc {
  Volume volume;
  std::array<double, 16> to_world{};
  MediumDesc medium = {};
  bool hidden = false;
  std::uint64_t tag = 0;
  Sequence sequence = {};
  DynamicVolume dynamic_volume = {};
  std::array<double, 16> open_to_world{};
  std::array<double, 16> close_to_world{};
};

/// A reference to an instance; a copy adds a reference to the same instance. Any thread.
class Instance {
 public:
  Instance() noexcept = default;
  Instance(const Instance& other) noexcept : handle_(cumulet_instance_retain(other.handle_)) {}
  Instance(Instance&& other) noexcept : handle_(other.release()) {}
  Instance& operator=(Instance other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Instance() { cumulet_instance_release(handle_); }

  [[nodiscard]] static Result<Instance> create(const InstanceDesc& desc) noexcept {
    const cumulet_medium_desc medium = desc.medium;
    const cumulet_instance_desc c = described(desc, medium);
    return detail::made<Instance>([&](cumulet_instance** out, char* error, std::size_t size) {
      return cumulet_instance_create(&c, out, error, size);
    });
  }
  [[nodiscard]] Result<> set(const InstanceDesc& desc) const noexcept {
    const cumulet_medium_desc medium = desc.medium;
    const cumulet_instance_desc c = described(desc, medium);
    return detail::result(cumulet_instance_set(handle_, &c));
  }
  [[nodiscard]] Result<> set_to_world(const std::array<double, 16>& to_world) const noexcept {
    return detail::result(cumulet_instance_set_to_world(handle_, to_world.data()));
  }
  /// Sets the transform in the previous frame. Null: it has not moved.
  [[nodiscard]] Result<> set_previous(const std::array<double, 16>* to_world) const noexcept {
    return detail::result(cumulet_instance_set_previous(handle_, to_world != nullptr ? to_world->data() : nullptr));
  }
  [[nodiscard]] Result<> set_ramp(Ramp ramp, std::span<const std::array<float, 2>> points) const noexcept {
    const float* first = points.empty() ? nullptr : points.front().data();
    return detail::result(cumulet_instance_set_ramp(handle_, static_cast<cumulet_ramp>(ramp), first, points.size()));
  }
  [[nodiscard]] Result<> set_color_ramp(Ramp ramp, std::span<const std::array<float, 4>> stops) const noexcept {
    const float* first = stops.empty() ? nullptr : stops.front().data();
    return detail::result(
        cumulet_instance_set_color_ramp(handle_, static_cast<cumulet_ramp>(ramp), first, stops.size()));
  }
  /// An empty descriptor removes the clip.
  [[nodiscard]] Result<> set_clip(const ClipDesc& desc) const noexcept {
    const cumulet_clip_desc c = desc;
    return detail::result(cumulet_instance_set_clip(handle_, &c));
  }

  [[nodiscard]] explicit operator bool() const noexcept { return handle_ != nullptr; }
  /// Returns the handle, which this object still owns.
  [[nodiscard]] cumulet_instance* handle() const noexcept { return handle_; }
  /// Returns the handle, which the caller owns now.
  [[nodiscard]] cumulet_instance* release() noexcept { return std::exchange(handle_, nullptr); }
  /// Takes over the caller's reference.
  [[nodiscard]] static Instance adopt(cumulet_instance* handle) noexcept {
    Instance instance;
    instance.handle_ = handle;
    return instance;
  }

 private:
  static cumulet_instance_desc described(const InstanceDesc& desc, const cumulet_medium_desc& medium) noexcept {
    cumulet_instance_desc c{.struct_size = sizeof c,
                            .volume = desc.volume.handle(),
                            .to_world = {},
                            .medium = &medium,
                            .hidden = desc.hidden ? 1 : 0,
                            .tag = desc.tag,
                            .sequence = desc.sequence.handle(),
                            .dynamic_volume = desc.dynamic_volume.handle(),
                            .open_to_world = {},
                            .close_to_world = {}};
    std::ranges::copy(desc.to_world, c.to_world);
    std::ranges::copy(desc.open_to_world, c.open_to_world);
    std::ranges::copy(desc.close_to_world, c.close_to_world);
    return c;
  }
  cumulet_instance* handle_ = nullptr;
};

// ---- Models ---------------------------------------------------------------------------------------------------------

/// Content, transform and pose of a model.
struct ModelDesc {
  Surfaces surfaces;
  std::array<double, 16> to_world{};
  double time = 0.0;
  std::uint32_t animation = 0;
  std::uint32_t variant = 0;
  bool double_sided = false;
  bool hidden = false;
  bool shadow_only = false;
  std::uint64_t tag = 0;
  std::uint32_t group = 0;
  bool holdout = false;
  std::array<double, 16> open_to_world{};
  std::array<double, 16> close_to_world{};
};

/// A reference to a model; a copy adds a reference to the same model. Any thread.
class Model {
 public:
  Model() noexcept = default;
  Model(const Model& other) noexcept : handle_(cumulet_model_retain(other.handle_)) {}
  Model(Model&& other) noexcept : handle_(other.release()) {}
  Model& operator=(Model other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Model() { cumulet_model_release(handle_); }

  [[nodiscard]] static Result<Model> create(const ModelDesc& desc) noexcept {
    const cumulet_model_desc c = described(desc);
    return detail::made<Model>(
        [&](cumulet_model** out, char* error, std::size_t size) { return cumulet_model_create(&c, out, error, size); });
  }
  [[nodiscard]] Result<> set(const ModelDesc& desc) const noexcept {
    const cumulet_model_desc c = described(desc);
    return detail::result(cumulet_model_set(handle_, &c));
  }
  [[nodiscard]] Result<> set_to_world(const std::array<double, 16>& to_world) const noexcept {
    return detail::result(cumulet_model_set_to_world(handle_, to_world.data()));
  }
  [[nodiscard]] Result<> set_time(double time) const noexcept {
    return detail::result(cumulet_model_set_time(handle_, time));
  }
  /// Sets transform and time in the previous frame. Null: they have not changed.
  [[nodiscard]] Result<> set_previous(const std::array<double, 16>* to_world, const double* time) const noexcept {
    return detail::result(cumulet_model_set_previous(handle_, to_world != nullptr ? to_world->data() : nullptr, time));
  }

  [[nodiscard]] explicit operator bool() const noexcept { return handle_ != nullptr; }
  /// Returns the handle, which this object still owns.
  [[nodiscard]] cumulet_model* handle() const noexcept { return handle_; }
  /// Returns the handle, which the caller owns now.
  [[nodiscard]] cumulet_model* release() noexcept { return std::exchange(handle_, nullptr); }
  /// Takes over the caller's reference.
  [[nodiscard]] static Model adopt(cumulet_model* handle) noexcept {
    Model model;
    model.handle_ = handle;
    return model;
  }

 private:
  static cumulet_model_desc described(const ModelDesc& desc) noexcept {
    cumulet_model_desc c{.struct_size = sizeof c,
                         .surfaces = desc.surfaces.handle(),
                         .to_world = {},
                         .time = desc.time,
                         .animation = desc.animation,
                         .variant = desc.variant,
                         .double_sided = desc.double_sided ? 1 : 0,
                         .hidden = desc.hidden ? 1 : 0,
                         .shadow_only = desc.shadow_only ? 1 : 0,
                         .tag = desc.tag,
                         .group = desc.group,
                         .holdout = desc.holdout ? 1 : 0,
                         .open_to_world = {},
                         .close_to_world = {}};
    std::ranges::copy(desc.to_world, c.to_world);
    std::ranges::copy(desc.open_to_world, c.open_to_world);
    std::ranges::copy(desc.close_to_world, c.close_to_world);
    return c;
  }
  cumulet_model* handle_ = nullptr;
};

// ---- Camera and input -----------------------------------------------------------------------------------------------

struct CameraMatrices {
  Matrix view{};
  Matrix projection{};
};

/// A camera. Move-only; viewers that use it keep it alive.
class Camera {
 public:
  Camera() noexcept = default;

  [[nodiscard]] static Result<Camera> create(const CameraDesc& desc = {}) noexcept {
    const cumulet_camera_desc c = desc;
    cumulet_camera* out = nullptr;
    if (auto done = detail::result(cumulet_camera_create(&c, &out)); !done) return done.error();
    return adopt(out);
  }

  // NOLINTBEGIN(readability-make-member-function-const): what they change is behind the handle
  [[nodiscard]] Result<> set(const CameraDesc& desc) noexcept {
    const cumulet_camera_desc c = desc;
    return detail::result(cumulet_camera_set(handle(), &c));
  }
  [[nodiscard]] Result<CameraDesc> get() const noexcept {
    auto c = detail::sized<cumulet_camera_desc>();
    if (auto done = detail::result(cumulet_camera_get(handle(), &c)); !done) return done.error();
    return CameraDesc::of(c);
  }
  [[nodiscard]] Result<> set_matrices(const CameraMatrices& matrices, ClipSpace clip) noexcept {
    return detail::result(cumulet_camera_set_matrices(handle(), matrices.view.data(), matrices.projection.data(),
                                                      static_cast<cumulet_clip_space>(clip)));
  }
  /// Sets the camera at shutter open and close. Null: as at the frame time.
  [[nodiscard]] Result<> set_shutter(const CameraDesc* open, const CameraDesc* close) noexcept {
    const cumulet_camera_desc at_open = open != nullptr ? *open : CameraDesc();
    const cumulet_camera_desc at_close = close != nullptr ? *close : CameraDesc();
    return detail::result(cumulet_camera_set_shutter(handle(), open != nullptr ? &at_open : nullptr,
                                                     close != nullptr ? &at_close : nullptr));
  }
  [[nodiscard]] Result<CameraMatrices> get_matrices(double aspect, ClipSpace clip) const noexcept {
    CameraMatrices matrices;
    if (auto done = detail::result(cumulet_camera_get_matrices(handle(), aspect, static_cast<cumulet_clip_space>(clip),
                                                               matrices.view.data(), matrices.projection.data()));
        !done) {
      return done.error();
    }
    return matrices;
  }

  [[nodiscard]] Result<> orbit(double yaw, double pitch) noexcept {
    return detail::result(cumulet_camera_orbit(handle(), yaw, pitch));
  }
  [[nodiscard]] Result<> look(double yaw, double pitch) noexcept {
    return detail::result(cumulet_camera_look(handle(), yaw, pitch));
  }
  [[nodiscard]] Result<> roll(double angle) noexcept { return detail::result(cumulet_camera_roll(handle(), angle)); }
  [[nodiscard]] Result<> pan(double right, double up) noexcept {
    return detail::result(cumulet_camera_pan(handle(), right, up));
  }
  [[nodiscard]] Result<> dolly(double factor) noexcept {
    return detail::result(cumulet_camera_dolly(handle(), factor));
  }
  [[nodiscard]] Result<> fly(double right, double up, double forward) noexcept {
    return detail::result(cumulet_camera_fly(handle(), right, up, forward));
  }
  [[nodiscard]] Result<> frame(const Bounds& box, double aspect) noexcept {
    return detail::result(cumulet_camera_frame(handle(), box.min.data(), box.max.data(), aspect));
  }
  // NOLINTEND(readability-make-member-function-const)

  [[nodiscard]] explicit operator bool() const noexcept { return handle_ != nullptr; }
  /// Returns the handle, which this object still owns.
  [[nodiscard]] cumulet_camera* handle() const noexcept { return handle_.get(); }
  /// Returns the handle, which the caller owns now.
  [[nodiscard]] cumulet_camera* release() noexcept { return handle_.release(); }
  /// Takes over the caller's handle.
  [[nodiscard]] static Camera adopt(cumulet_camera* handle) noexcept {
    Camera camera;
    camera.handle_.reset(handle);
    return camera;
  }

 private:
  struct Release {
    void operator()(cumulet_camera* handle) const noexcept { cumulet_camera_release(handle); }
  };
  std::unique_ptr<cumulet_camera, Release> handle_;
};

struct Event {
  EventType type{};
  double x = 0.0;
  double y = 0.0;
  double wheel = 0.0;
  Button button{};
  Key key{};
  Modifiers modifiers{};

  operator cumulet_event() const noexcept {
    return {.struct_size = sizeof(cumulet_event),
            .type = static_cast<cumulet_event_type>(type),
            .x = x,
            .y = y,
            .wheel = wheel,
            .button = static_cast<cumulet_button>(button),
            .key = static_cast<std::int32_t>(key),
            .modifiers = static_cast<std::uint32_t>(modifiers)};
  }
};

// ---- Frames ---------------------------------------------------------------------------------------------------------

struct FrameResult {
  RenderFlags flags{};
  double progress = 0.0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t texture = 0;
  std::uint32_t depth_texture = 0;

  /// Returns whether any of these flags is set.
  [[nodiscard]] constexpr bool has(RenderFlags any) const noexcept {
    return (static_cast<std::uint32_t>(flags) & static_cast<std::uint32_t>(any)) != 0;
  }
};

// ---- Viewer ---------------------------------------------------------------------------------------------------------

/// Loads OpenGL functions. It holds any callable that takes a name and returns an address, as void* or as pointer to
/// function (glfwGetProcAddress, eglGetProcAddress, a lambda), or the C callback and user pointer. Empty: no context.
class GetProc {
 public:
  GetProc() noexcept = default;
  GetProc(cumulet_get_proc_fn get_proc, void* user) noexcept
      : find_(get_proc == nullptr ? decltype(find_)()
                                  : [get_proc, user](const char* name) { return get_proc(user, name); }) {}
  template <class Find>
  requires std::is_invocable_v<Find&, const char*> GetProc(Find find)
      : find_([find = std::move(find)](const char* name) mutable { return address(find(name)); }) {}

  [[nodiscard]] explicit operator bool() const noexcept { return static_cast<bool>(find_); }

 private:
  friend class Viewer;
  template <class Pointer>
  static void* address(Pointer* pointer) noexcept {
    return reinterpret_cast<void*>(pointer);
  }
  [[nodiscard]] cumulet_get_proc_fn function() const noexcept {
    if (!find_) return nullptr;
    return [](void* user, const char* name) noexcept { return static_cast<const GetProc*>(user)->find_(name); };
  }
  [[nodiscard]] void* user() const noexcept { return const_cast<GetProc*>(this); }

  std::function<void*(const char*)> find_;
};

struct ShaderCacheDesc {
  const char* folder = nullptr;
  const char* shaders = nullptr;

  operator cumulet_shader_cache_desc() const noexcept {
    return {.struct_size = sizeof(cumulet_shader_cache_desc), .folder = folder, .shaders = shaders};
  }
};

/// A reference to shared programs and GL memory; a copy adds a reference. Empty: the viewer has its own.
class ShaderCache {
 public:
  ShaderCache() noexcept = default;
  ShaderCache(const ShaderCache& other) noexcept : handle_(cumulet_shader_cache_retain(other.handle_)) {}
  ShaderCache(ShaderCache&& other) noexcept : handle_(other.release()) {}
  ShaderCache& operator=(ShaderCache other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~ShaderCache() { cumulet_shader_cache_release(handle_); }

  [[nodiscard]] static Result<ShaderCache> create(const ShaderCacheDesc& desc = {}) noexcept {
    const cumulet_shader_cache_desc c = desc;
    return detail::made<ShaderCache>([&](cumulet_shader_cache** out, char* error, std::size_t size) {
      return cumulet_shader_cache_create(&c, out, error, size);
    });
  }

  [[nodiscard]] explicit operator bool() const noexcept { return handle_ != nullptr; }
  /// Returns the handle, which this object still owns.
  [[nodiscard]] cumulet_shader_cache* handle() const noexcept { return handle_; }
  /// Returns the handle, which the caller owns now.
  [[nodiscard]] cumulet_shader_cache* release() noexcept { return std::exchange(handle_, nullptr); }
  /// Takes over the caller's reference.
  [[nodiscard]] static ShaderCache adopt(cumulet_shader_cache* handle) noexcept {
    ShaderCache cache;
    cache.handle_ = handle;
    return cache;
  }

 private:
  cumulet_shader_cache* handle_ = nullptr;
};

struct CreateDesc {
  GetProc get_proc{};
  std::function<void(LogLevel, std::string_view)> log{};
  std::function<void()> update{};
  GlStatePolicy gl_state{};
  /// Receives name, begin and end in seconds, see cumulet_trace_fn.
  std::function<void(std::string_view, double, double)> trace{};
  ShaderCache shader_cache{};
};

/// A viewer. Move-only.
class Viewer {
 public:
  Viewer() noexcept = default;
  Viewer(Viewer&&) noexcept = default;
  Viewer& operator=(Viewer&& other) noexcept {
    handle_ = std::move(other.handle_);  // first, because the old viewer uses the old callbacks until it is destroyed
    callbacks_ = std::move(other.callbacks_);
    return *this;
  }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;
  /// [GL] if attached. Destroys the viewer, see cumulet_destroy.
  ~Viewer() = default;

  [[nodiscard]] static Result<Viewer> create(CreateDesc desc = {}) noexcept {
    std::unique_ptr<Callbacks> callbacks(
        new (std::nothrow) Callbacks{std::move(desc.log), std::move(desc.update), std::move(desc.trace)});
    if (!callbacks) return detail::result(CUMULET_ERROR_OUT_OF_MEMORY).error();
    const cumulet_create_desc c{.struct_size = sizeof c,
                                .get_proc = desc.get_proc.function(),
                                .get_proc_user = desc.get_proc.user(),
                                .log = callbacks->log ? Callbacks::call_log : nullptr,
                                .log_user = callbacks.get(),
                                .update = callbacks->update ? Callbacks::call_update : nullptr,
                                .update_user = callbacks.get(),
                                .gl_state = static_cast<cumulet_gl_state_policy>(desc.gl_state),
                                .trace = callbacks->trace ? Callbacks::call_trace : nullptr,
                                .trace_user = callbacks.get(),
                                .shader_cache = desc.shader_cache.handle()};
    auto viewer = detail::made<Viewer>(
        [&](cumulet_viewer** out, char* error, std::size_t size) { return cumulet_create(&c, out, error, size); });
    if (viewer) viewer->callbacks_ = std::move(callbacks);
    return viewer;
  }

  [[nodiscard]] Result<> attach(const GetProc& get_proc) noexcept {
    return result(cumulet_attach(handle(), get_proc.function(), get_proc.user()));
  }
  [[nodiscard]] Result<> detach() noexcept { return result(cumulet_detach(handle())); }
  [[nodiscard]] Result<> context_lost() noexcept { return result(cumulet_context_lost(handle())); }

  [[nodiscard]] Result<> load_volume(const std::string& path, const std::string& grid_name = {}) noexcept {
    return result(cumulet_load_volume(handle(), path.c_str(), detail::or_null(grid_name)));
  }
  [[nodiscard]] Result<> load_volume(const VolumeFileDesc& desc) noexcept {
    const cumulet_volume_file_desc c = desc;
    return result(cumulet_load_volume_file(handle(), &c));
  }
  /// Shows a volume; an empty object shows nothing.
  [[nodiscard]] Result<> set_volume(const Volume& volume) noexcept {
    return result(cumulet_set_volume(handle(), volume.handle()));
  }
  /// Sets the instance transforms of the volume, column-major and affine; an empty span is one identity.
  [[nodiscard]] Result<> set_volume_transforms(std::span<const std::array<double, 16>> to_world) noexcept {
    const double* first = to_world.empty() ? nullptr : to_world.front().data();
    return result(cumulet_set_volume_transforms(handle(), first, static_cast<uint32_t>(to_world.size())));
  }
  /// Sets the transforms at shutter open and close, one per instance transform; empty: as at the frame time.
  [[nodiscard]] Result<> set_volume_shutter_transforms(std::span<const std::array<double, 16>> open,
                                                       std::span<const std::array<double, 16>> close) noexcept {
    const auto first = [](const auto& matrices) { return matrices.empty() ? nullptr : matrices.front().data(); };
    const bool differ = !open.empty() && !close.empty() && open.size() != close.size();  // the library refuses 0
    const std::size_t count = differ ? 0 : std::max(open.size(), close.size());
    return result(
        cumulet_set_volume_shutter_transforms(handle(), first(open), first(close), static_cast<uint32_t>(count)));
  }
  /// Shows a sequence; an empty object shows none.
  [[nodiscard]] Result<> set_sequence(const Sequence& sequence) noexcept {
    return result(cumulet_set_sequence(handle(), sequence.handle()));
  }
  /// Returns the state of the sequence. states: room for a FrameState per frame, or empty.
  [[nodiscard]] Result<SequenceInfo> get_sequence_info(std::span<std::uint8_t> states = {}) noexcept {
    auto c = detail::sized<cumulet_sequence_info>();
    std::uint8_t* const first = states.empty() ? nullptr : states.data();
    if (auto done = result(cumulet_get_sequence_info(handle(), &c, first, states.size())); !done) return done.error();
    return SequenceInfo::of(c);
  }
  /// Returns why a frame failed; "" if it did not.
  [[nodiscard]] Result<Text<512>> get_sequence_frame(std::uint32_t frame) noexcept {
    std::array<char, 512> cause{};
    if (auto done = result(cumulet_get_sequence_frame(handle(), frame, cause.data(), cause.size())); !done)
      return done.error();
    return Text<512>(cause.data());
  }
  [[nodiscard]] Result<> add_model(const Model& model) noexcept {
    return result(cumulet_add_model(handle(), model.handle()));
  }
  [[nodiscard]] Result<> remove_model(const Model& model) noexcept {
    return result(cumulet_remove_model(handle(), model.handle()));
  }
  /// Shows a dynamic volume; an empty object shows none.
  [[nodiscard]] Result<> set_dynamic_volume(const DynamicVolume& dynamic_volume) noexcept {
    return result(cumulet_set_dynamic_volume(handle(), dynamic_volume.handle()));
  }
  /// [GL] Submits a state of a dynamic volume from voxels in GL.
  [[nodiscard]] Result<> dynamic_volume_set_gl(const DynamicVolume& dynamic_volume, const GlVolumeDesc& desc) noexcept {
    constexpr std::size_t most = CUMULET_CHANNEL_VELOCITY_Z + 2;
    constexpr cumulet_voxel_box none{};
    std::array<cumulet_gl_field, most> fields{};
    const std::size_t count = std::min(desc.fields.size(), most);
    for (std::size_t i = 0; i < count; ++i) fields[i] = desc.fields[i];
    const bool some = desc.changed && !desc.changed->empty();
    const cumulet_gl_volume_desc c{.struct_size = sizeof c,
                                   .fields = fields.data(),
                                   .field_count = count,
                                   .changed = some ? desc.changed->data() : (desc.changed ? &none : nullptr),
                                   .changed_count = some ? desc.changed->size() : 0,
                                   .wait = desc.wait,
                                   .name = desc.name};
    return result(cumulet_dynamic_volume_set_gl(handle(), dynamic_volume.handle(), &c));
  }
  [[nodiscard]] Result<DynamicVolumeInfo> get_dynamic_volume_info() noexcept {
    auto c = detail::sized<cumulet_dynamic_volume_info>();
    if (auto done = result(cumulet_get_dynamic_volume_info(handle(), &c)); !done) return done.error();
    return DynamicVolumeInfo::of(c);
  }
  /// Sets limits on threads and memory.
  [[nodiscard]] Result<> set_limits(const LimitsDesc& desc) noexcept {
    const cumulet_limits_desc c = desc;
    return result(cumulet_set_limits(handle(), &c));
  }
  [[nodiscard]] Result<> add_instance(const Instance& instance) noexcept {
    return result(cumulet_add_instance(handle(), instance.handle()));
  }
  [[nodiscard]] Result<> remove_instance(const Instance& instance) noexcept {
    return result(cumulet_remove_instance(handle(), instance.handle()));
  }
  /// Returns the state of an instance's sequence. states: room for a FrameState per frame, or empty.
  [[nodiscard]] Result<SequenceInfo> get_instance_sequence_info(const Instance& instance,
                                                                std::span<std::uint8_t> states = {}) noexcept {
    auto c = detail::sized<cumulet_sequence_info>();
    std::uint8_t* const first = states.empty() ? nullptr : states.data();
    if (auto done = result(cumulet_get_instance_sequence_info(handle(), instance.handle(), &c, first, states.size()));
        !done) {
      return done.error();
    }
    return SequenceInfo::of(c);
  }
  [[nodiscard]] Result<Text<512>> get_instance_sequence_frame(const Instance& instance, std::uint32_t frame) noexcept {
    std::array<char, 512> cause{};
    if (auto done =
            result(cumulet_get_instance_sequence_frame(handle(), instance.handle(), frame, cause.data(), cause.size()));
        !done) {
      return done.error();
    }
    return Text<512>(cause.data());
  }
  /// Returns the state numbers of an instance's dynamic volume.
  [[nodiscard]] Result<DynamicVolumeInfo> get_instance_dynamic_volume_info(const Instance& instance) noexcept {
    auto c = detail::sized<cumulet_dynamic_volume_info>();
    if (auto done = result(cumulet_get_instance_dynamic_volume_info(handle(), instance.handle(), &c)); !done)
      return done.error();
    return DynamicVolumeInfo::of(c);
  }
  /// Returns the volume; an empty object if there is none.
  [[nodiscard]] Result<Volume> get_volume() noexcept {
    cumulet_volume* out = nullptr;
    if (auto done = result(cumulet_get_volume(handle(), &out)); !done) return done.error();
    return Volume::adopt(out);
  }
  void cancel() const noexcept { cumulet_cancel(handle()); }
  [[nodiscard]] Result<Progress> get_progress() const noexcept {
    auto c = detail::sized<cumulet_progress>();
    // Any thread may call this, so the last error must not be read.
    if (auto done = detail::result(cumulet_get_progress(handle(), &c)); !done) return done.error();
    return Progress::of(c);
  }
  [[nodiscard]] Result<> wait(double timeout_ms = -1.0) noexcept { return result(cumulet_wait(handle(), timeout_ms)); }
  [[nodiscard]] Result<> rebuild() noexcept { return result(cumulet_rebuild(handle())); }

  [[nodiscard]] Result<> set_grid(const GridDesc& desc) noexcept { return set(cumulet_set_grid, desc); }
  [[nodiscard]] Result<> set_medium(const MediumDesc& desc) noexcept { return set(cumulet_set_medium, desc); }
  /// Sets a ramp from pairs of value and result; an empty span removes it.
  [[nodiscard]] Result<> set_ramp(Ramp ramp, std::span<const std::array<float, 2>> points) noexcept {
    const float* first = points.empty() ? nullptr : points.front().data();
    return result(cumulet_set_ramp(handle(), static_cast<cumulet_ramp>(ramp), first, points.size()));
  }
  /// Sets a color ramp from stops of value, red, green and blue; an empty span removes it.
  [[nodiscard]] Result<> set_color_ramp(Ramp ramp, std::span<const std::array<float, 4>> stops) noexcept {
    const float* first = stops.empty() ? nullptr : stops.front().data();
    return result(cumulet_set_color_ramp(handle(), static_cast<cumulet_ramp>(ramp), first, stops.size()));
  }
  /// Clips the viewer's own volume; an empty descriptor removes the clip.
  [[nodiscard]] Result<> set_clip(const ClipDesc& desc) noexcept {
    const cumulet_clip_desc c = desc;
    return result(cumulet_set_clip(handle(), &c));
  }
  [[nodiscard]] Result<> load_surfaces(const std::string& path) noexcept {
    return result(cumulet_load_surfaces(handle(), path.c_str()));
  }
  /// Shows surfaces; an empty object shows none.
  [[nodiscard]] Result<> set_surfaces(const Surfaces& surfaces) noexcept {
    return result(cumulet_set_surfaces(handle(), surfaces.handle()));
  }
  /// Returns the surfaces; an empty object if there are none.
  [[nodiscard]] Result<Surfaces> get_surfaces() noexcept {
    cumulet_surfaces* out = nullptr;
    if (auto done = result(cumulet_get_surfaces(handle(), &out)); !done) return done.error();
    return Surfaces::adopt(out);
  }
  [[nodiscard]] Result<> set_surface_settings(const SurfaceSettingsDesc& desc) noexcept {
    return set(cumulet_set_surface_settings, desc);
  }
  [[nodiscard]] Result<> use_surface_camera(std::uint32_t index) noexcept {
    return result(cumulet_use_surface_camera(handle(), index));
  }
  [[nodiscard]] Result<> set_sun_sky(const SunSkyDesc& desc) noexcept { return set(cumulet_set_sun_sky, desc); }
  /// Replaces the analytic lights; an empty span removes all.
  [[nodiscard]] Result<> set_lights(std::span<const LightDesc> lights) noexcept {
    const std::unique_ptr<cumulet_light_desc[]> c(new (std::nothrow) cumulet_light_desc[lights.size()]);
    if (!c) return Error{StatusCode::out_of_memory, Text<512>("out of memory")};
    std::ranges::copy(lights, c.get());
    return result(cumulet_set_lights(handle(), c.get(), lights.size()));
  }
  [[nodiscard]] Result<> load_environment(const std::string& path) noexcept {
    return result(cumulet_load_environment(handle(), path.c_str()));
  }
  /// Sets the environment; an empty object selects the sky of the light.
  [[nodiscard]] Result<> set_environment(const Environment& environment) noexcept {
    return result(cumulet_set_environment(handle(), environment.handle()));
  }
  /// Returns the environment; an empty object if there is none.
  [[nodiscard]] Result<Environment> get_environment() noexcept {
    cumulet_environment* out = nullptr;
    if (auto done = result(cumulet_get_environment(handle(), &out)); !done) return done.error();
    return Environment::adopt(out);
  }
  [[nodiscard]] Result<> set_environment_settings(const EnvironmentSettingsDesc& desc) noexcept {
    return set(cumulet_set_environment_settings, desc);
  }
  [[nodiscard]] Result<> set_ground(const GroundDesc& desc) noexcept { return set(cumulet_set_ground, desc); }
  [[nodiscard]] Result<> set_sampling(const SamplingDesc& desc) noexcept { return set(cumulet_set_sampling, desc); }
  [[nodiscard]] Result<> set_display(const DisplayDesc& desc) noexcept { return set(cumulet_set_display, desc); }
  [[nodiscard]] Result<> set_display_lut(const DisplayLutDesc& desc) noexcept {
    const cumulet_display_lut_desc c = desc;
    return result(cumulet_set_display_lut(handle(), &c));
  }
  [[nodiscard]] Result<> remove_display_lut() noexcept { return result(cumulet_set_display_lut(handle(), nullptr)); }

  [[nodiscard]] Result<> set_camera(const Camera& camera) noexcept {
    return result(cumulet_set_camera(handle(), camera.handle()));
  }
  /// Sets the camera of the previous frame; an empty object: it has not moved.
  [[nodiscard]] Result<> set_previous_camera(const Camera& camera, double seconds) noexcept {
    return result(cumulet_set_previous_camera(handle(), camera.handle(), seconds));
  }
  [[nodiscard]] Result<> set_previous_volume_transforms(std::span<const std::array<double, 16>> to_world) noexcept {
    const double* first = to_world.empty() ? nullptr : to_world.front().data();
    return result(cumulet_set_previous_volume_transforms(handle(), first, static_cast<std::uint32_t>(to_world.size())));
  }
  [[nodiscard]] Result<Camera> get_camera() noexcept {
    cumulet_camera* out = nullptr;
    if (auto done = result(cumulet_get_camera(handle(), &out)); !done) return done.error();
    return Camera::adopt(out);
  }
  [[nodiscard]] Result<> frame_all() noexcept { return result(cumulet_frame_all(handle())); }
  [[nodiscard]] Result<> set_navigation(const NavigationDesc& desc) noexcept {
    return set(cumulet_set_navigation, desc);
  }
  /// Returns whether the event was used.
  [[nodiscard]] Result<bool> input(const Event& event) noexcept {
    const cumulet_event c = event;
    std::int32_t handled = 0;
    if (auto done = result(cumulet_input(handle(), &c, &handled)); !done) return done.error();
    return handled != 0;
  }

  [[nodiscard]] Result<FrameResult> render(const FrameDesc& frame) noexcept {
    const cumulet_frame_desc desc = frame;
    auto c = detail::sized<cumulet_frame_result>();
    if (auto done = result(cumulet_render(handle(), &desc, &c)); !done) return done.error();
    const auto& [struct_size, flags, progress, width, height, texture, depth_texture] = c;
    return FrameResult{.flags = RenderFlags{flags},
                       .progress = progress,
                       .width = width,
                       .height = height,
                       .texture = texture,
                       .depth_texture = depth_texture};
  }
  [[nodiscard]] Result<WarmUpResult> warm_up(const FrameDesc& frame, WarmUpScope scope = {}) noexcept {
    const cumulet_frame_desc desc = frame;
    auto c = detail::sized<cumulet_warm_up_result>();
    if (auto done = result(cumulet_warm_up(handle(), &desc, static_cast<cumulet_warm_up_scope>(scope), &c)); !done) {
      return done.error();
    }
    return WarmUpResult::of(c);
  }
  [[nodiscard]] Result<TransmittanceMap> update_transmittance_map(const TransmittanceMapDesc& desc) noexcept {
    const cumulet_transmittance_map_desc wanted = desc;
    auto c = detail::sized<cumulet_transmittance_map>();
    if (auto done = result(cumulet_update_transmittance_map(handle(), &wanted, &c)); !done) return done.error();
    return TransmittanceMap::of(c);
  }
  [[nodiscard]] Result<> destroy_transmittance_map(std::uint32_t slot) noexcept {
    return result(cumulet_destroy_transmittance_map(handle(), slot));
  }
  [[nodiscard]] Result<Pick> pick_at(double x, double y) noexcept {
    auto c = detail::sized<cumulet_pick>();
    if (auto done = result(cumulet_pick_at(handle(), x, y, &c)); !done) return done.error();
    return Pick::of(c);
  }
  [[nodiscard]] Result<Interpolation> get_interpolation() noexcept {
    auto used = CUMULET_INTERPOLATION_AUTO;
    if (auto done = result(cumulet_get_interpolation(handle(), &used)); !done) return done.error();
    return static_cast<Interpolation>(used);
  }
  [[nodiscard]] Result<Bounds> get_bounds() noexcept {
    Bounds bounds;
    if (auto done = result(cumulet_get_bounds(handle(), bounds.min.data(), bounds.max.data())); !done) {
      return done.error();
    }
    return bounds;
  }
  [[nodiscard]] Result<> read_linear(std::span<float> rgba) noexcept {
    return result(cumulet_read_linear(handle(), rgba.data(), rgba.size()));
  }
  [[nodiscard]] Result<> read_denoised(const DenoiseDesc& desc, std::span<float> rgba) noexcept {
    const cumulet_denoise_desc c = desc;
    return result(cumulet_read_denoised(handle(), &c, rgba.data(), rgba.size()));
  }
  [[nodiscard]] Result<> encode_display(std::span<const float> linear, std::span<std::uint8_t> rgba) noexcept {
    const std::size_t count = std::min(linear.size(), rgba.size());
    return result(cumulet_encode_display(handle(), linear.data(), rgba.data(), count));
  }
  [[nodiscard]] Result<> read_display(std::span<std::uint8_t> rgba) noexcept {
    return result(cumulet_read_display(handle(), rgba.data(), rgba.size()));
  }
  [[nodiscard]] Result<> read_aov(Aov aov, std::span<float> values) noexcept {
    return result(cumulet_read_aov(handle(), static_cast<cumulet_aov>(aov), values.data(), values.size()));
  }
  [[nodiscard]] Result<> read_light_group(std::uint32_t group, std::span<float> rgb) noexcept {
    return result(cumulet_read_light_group(handle(), group, rgb.data(), rgb.size()));
  }
  /// Begins to read without waiting. Returns the number of the read.
  [[nodiscard]] Result<std::uint64_t> begin_read(const ReadDesc& desc) noexcept {
    const cumulet_read_desc c = desc;
    std::uint64_t read = 0;
    if (auto done = result(cumulet_begin_read(handle(), &c, &read)); !done) return done.error();
    return read;
  }
  /// Fills `values` if the read is ready, which ends it. An empty span: the read is only looked at.
  [[nodiscard]] Result<ReadInfo> finish_read(std::uint64_t read, std::span<float> values) noexcept {
    auto c = detail::sized<cumulet_read_info>();
    if (auto done =
            result(cumulet_finish_read(handle(), read, values.empty() ? nullptr : values.data(), values.size(), &c));
        !done) {
      return done.error();
    }
    return ReadInfo::of(c);
  }
  [[nodiscard]] Result<> cancel_read(std::uint64_t read) noexcept {
    return result(cumulet_cancel_read(handle(), read));
  }
  /// `name` is called as name(ObjectKind, tag, transform_index) and returns const char*, see cumulet_object_name_fn. It
  /// must not throw.
  template <class Name>
  [[nodiscard]] Result<> read_cryptomatte(Name&& name, std::uint32_t ranks, std::span<float> values) noexcept {
    const auto call = [](void* user, cumulet_object_kind kind, std::uint64_t tag,
                         std::uint32_t transform_index) noexcept -> const char* {
      return (*static_cast<std::remove_reference_t<Name>*>(user))(static_cast<ObjectKind>(kind), tag, transform_index);
    };
    void* user = const_cast<void*>(static_cast<const void*>(std::addressof(name)));
    return result(cumulet_read_cryptomatte(handle(), call, user, ranks, values.data(), values.size()));
  }
  /// Returns the Cryptomatte id of a name. Any thread.
  [[nodiscard]] static std::uint32_t cryptomatte_id(const std::string& name) noexcept {
    return cumulet_cryptomatte_id(name.c_str());
  }
  /// Returns the noise; nullopt while it is unknown, for example with one sample per pixel.
  [[nodiscard]] Result<std::optional<double>> measure_noise() noexcept {
    double noise = 0.0;
    if (auto done = result(cumulet_measure_noise(handle(), &noise)); !done) return done.error();
    return std::isfinite(noise) ? std::optional<double>(noise) : std::nullopt;
  }
  /// Returns the number of bytes that read_accumulation() needs.
  [[nodiscard]] Result<std::size_t> accumulation_size() noexcept {
    std::size_t size = 0;
    if (auto done = result(cumulet_read_accumulation(handle(), nullptr, &size)); !done) return done.error();
    return size;
  }
  /// Writes the accumulation into `bytes` and returns its size.
  [[nodiscard]] Result<std::size_t> read_accumulation(std::span<std::byte> bytes) noexcept {
    std::size_t size = bytes.size();
    if (auto done = result(cumulet_read_accumulation(handle(), bytes.data(), &size)); !done) return done.error();
    return size;
  }
  [[nodiscard]] Result<> restore_accumulation(std::span<const std::byte> bytes) noexcept {
    return result(cumulet_restore_accumulation(handle(), bytes.data(), bytes.size()));
  }
  [[nodiscard]] Result<Stats> get_stats() const noexcept {
    auto c = detail::sized<cumulet_stats>();
    if (auto done = result(cumulet_get_stats(handle(), &c)); !done) return done.error();
    return Stats::of(c);
  }

  [[nodiscard]] explicit operator bool() const noexcept { return handle_ != nullptr; }
  /// Returns the handle, which this object still owns.
  [[nodiscard]] cumulet_viewer* handle() const noexcept { return handle_.get(); }
  /// Takes over the caller's viewer; its callbacks still belong to the caller. There is no release(), because this
  /// object owns its callbacks.
  [[nodiscard]] static Viewer adopt(cumulet_viewer* handle) noexcept {
    Viewer viewer;
    viewer.handle_.reset(handle);
    return viewer;
  }

 private:
  struct Callbacks {
    std::function<void(LogLevel, std::string_view)> log;
    std::function<void()> update;
    std::function<void(std::string_view, double, double)> trace;

    static void call_log(void* user, cumulet_log_level level, const char* message) noexcept {
      static_cast<const Callbacks*>(user)->log(static_cast<LogLevel>(level), message);
    }
    static void call_update(void* user) noexcept { static_cast<const Callbacks*>(user)->update(); }
    static void call_trace(void* user, const char* name, double begin, double end) noexcept {
      static_cast<const Callbacks*>(user)->trace(name, begin, end);
    }
  };
  struct Destroy {
    void operator()(cumulet_viewer* handle) const noexcept { cumulet_destroy(handle); }
  };

  [[nodiscard]] Result<> result(cumulet_status status) const noexcept {
    return detail::result(status, cumulet_last_error(handle()));
  }
  template <class Desc>
  [[nodiscard]] Result<> set(cumulet_status (*setter)(cumulet_viewer*, const Desc*),
                             const std::type_identity_t<Desc>& desc) noexcept {
    return result(setter(handle(), &desc));
  }

  std::unique_ptr<Callbacks> callbacks_;  // must outlive the viewer below
  std::unique_ptr<cumulet_viewer, Destroy> handle_;
};

}  // namespace v0_2
}  // namespace cumulet

#endif /* C++20 */
#undef CUMULET_CPLUSPLUS

#endif
