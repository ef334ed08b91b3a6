#pragma once

// Shared by all files of the C ABI: argument checks, descriptors, and conversion of exceptions to status codes.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/glm.hpp>
#include <limits>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "base/error.hpp"
#include "base/library_thread.hpp"
#include "base/log.hpp"
#include "base/one_line.hpp"
#include "cumulet/cumulet.h"
#include "jobs/worker_pool.hpp"
#include "scene/snapshot.hpp"
#include "scene/space.hpp"
#include "viewer/c_fields.hpp"

namespace cumulet::c_abi {

/// Logs through a host's callback; drops every line if log is null.
inline Log log_of(cumulet_log_fn log, void* user) {
  if (log == nullptr) return {};
  return Log([log, user](LogLevel level, const char* message) {
    const viewer::WorkerPool::InCallback waits;
    log(user, static_cast<cumulet_log_level>(level), message);
  });
}

inline cumulet_status status_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::invalid_argument:
      return CUMULET_ERROR_INVALID_ARGUMENT;
    case ErrorCode::unsupported:
      return CUMULET_ERROR_UNSUPPORTED;
    case ErrorCode::file:
      return CUMULET_ERROR_FILE;
    case ErrorCode::out_of_memory:
      return CUMULET_ERROR_OUT_OF_MEMORY;
    case ErrorCode::gl:
      return CUMULET_ERROR_GL;
    case ErrorCode::cancelled:
      return CUMULET_ERROR_CANCELLED;
    case ErrorCode::context_lost:
      return CUMULET_ERROR_CONTEXT_LOST;
    case ErrorCode::detached:
      return CUMULET_ERROR_DETACHED;
    case ErrorCode::timeout:
      return CUMULET_ERROR_TIMEOUT;
    case ErrorCode::internal:
      break;
  }
  return CUMULET_ERROR_INTERNAL;
}

/// Runs a call and converts any exception to a status and a message of one line.
template <class Call>
cumulet_status guarded(std::string& message, Call&& call) noexcept {
  try {
    try {
      call();
      message.clear();
      return CUMULET_OK;
    } catch (const Error& error) {
      message = error.what();
      return status_of(error.code());
    } catch (const std::bad_alloc&) {
      message = "out of memory";
      return CUMULET_ERROR_OUT_OF_MEMORY;
    } catch (const std::exception& error) {
      message = std::string("internal error: ") + error.what();
      return CUMULET_ERROR_INTERNAL;
    } catch (...) {
      message = "internal error";
      return CUMULET_ERROR_INTERNAL;
    }
  } catch (...) {
    return CUMULET_ERROR_OUT_OF_MEMORY;  // the message could not be stored
  }
}

/// Copies text into a fixed buffer, truncated and zero-terminated.
inline void copy_text(std::string_view text, char* to, size_t size) {
  if (to == nullptr || size == 0) return;
  const size_t length = std::min(text.size(), size - 1);
  std::memcpy(to, text.data(), length);
  to[length] = '\0';
}

/// The line of this thread's last call without a viewer. Threads may use one handle, and handles are small.
void set_thread_line(std::string_view line) noexcept;
[[nodiscard]] const char* thread_line() noexcept;

inline constexpr const char* inside_callback = "called from inside a callback";
inline constexpr const char* process_exits = "the process is exiting";

/// Runs a call without a viewer; writes the message to the caller's buffer and to thread_line(). Refuses calls from
/// inside a callback and while the process exits.
template <class Call>
cumulet_status guarded(char* error, size_t error_size, Call&& call) noexcept {
  if (CallbackScope::inside()) {
    copy_text(inside_callback, error, error_size);
    return CUMULET_ERROR_INVALID_ARGUMENT;
  }
  const HostCall host_call;
  if (host_call.refused()) {
    copy_text(process_exits, error, error_size);
    set_thread_line(process_exits);
    return CUMULET_ERROR_CANCELLED;
  }
  std::string message;
  const cumulet_status status = guarded(message, std::forward<Call>(call));
  copy_text(message, error, error_size);
  set_thread_line(message);
  return status;
}

/// Throws Error(invalid_argument) with a one-line message, even if names from the host contain line breaks.
[[noreturn]] inline void refuse(const std::string& why) { throw Error(ErrorCode::invalid_argument, one_line(why)); }

inline void require(bool condition, const char* what) {
  if (!condition) refuse(what);
}

/// Reads a descriptor. A host built against an older header passes a shorter struct; missing fields are zero. A longer
/// struct is refused, because its unknown fields may request something that must not be ignored.
template <class Desc>
Desc read_desc(const Desc* desc, const char* name) {
  if (desc == nullptr) refuse(std::string(name) + " is NULL");
  const size_t bytes = bytes_of_fields<Desc>(desc->struct_size);
  if (bytes == 0) {
    refuse(std::string(name) + ".struct_size is " + std::to_string(desc->struct_size) + ", not sizeof(" + name + ")");
  }
  Desc copy{};
  std::memcpy(&copy, desc, bytes);
  return copy;
}

/// Writes as much of a caller's struct as its struct_size covers.
template <class Desc>
void write_desc(Desc* out, Desc value, const char* name) {
  read_desc(out, name);
  value.struct_size = out->struct_size;
  std::memcpy(out, &value, bytes_of_fields<Desc>(out->struct_size));
}

/// Returns the number in an enum filled by a C host. Reading it as the enum would be undefined for values that the enum
/// does not have.
template <class Enum>
unsigned number(const Enum& value) {
  unsigned copy = 0;
  static_assert(sizeof copy == sizeof value);
  std::memcpy(&copy, &value, sizeof copy);
  return copy;
}

inline bool in_range(double value, double low, double high) { return value >= low && value <= high; }  // false for NaN

template <class Values>
bool all_finite(const Values& values) {
  return std::ranges::all_of(values, [](auto value) { return std::isfinite(value); });
}

inline glm::vec3 to_vec3(std::span<const float, 3> v) { return {v[0], v[1], v[2]}; }
inline glm::dvec3 to_dvec3(std::span<const double, 3> v) { return {v[0], v[1], v[2]}; }

inline std::string name_or(const char* name, const char* otherwise) {
  return name == nullptr || *name == '\0' ? otherwise : name;
}

inline glm::dmat4 matrix_or_identity(std::span<const double, 16> m) {
  if (std::ranges::all_of(m, [](double value) { return value == 0.0; })) return glm::dmat4(1.0);
  glm::dmat4 matrix;
  for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = m[static_cast<std::size_t>(i)];
  return matrix;
}

/// Throws if the transform is not affine, finite and invertible in float precision. what: prefix of the message.
inline void require_transform(const glm::dmat4& m, const std::string& what = "") {
  constexpr double most = 1e15;
  const auto all = [](const glm::dmat4& matrix, auto holds) {
    for (int i = 0; i < 16; ++i) {
      if (!holds(matrix[i / 4][i % 4])) return false;
    }
    return true;
  };
  if (!all(m, [](double x) { return std::isfinite(x); })) refuse(what + "to_world is not finite");
  if (m[0].w != 0.0 || m[1].w != 0.0 || m[2].w != 0.0 || m[3].w != 1.0) refuse(what + "to_world is not affine");
  if (!std::isnormal(glm::determinant(glm::dmat3(m)))) refuse(what + "to_world is singular");
  const auto moderate = [](double x) { return std::abs(x) <= most; };
  if (!all(m, moderate) || !all(glm::inverse(m), moderate))
    refuse(what + "to_world or its inverse has values above 1e15");
}

/// Returns the transforms at shutter open and close; zeros select `transform`, the transform at the frame time. Returns
/// nullopt if both equal `transform`. Throws as require_transform(), and if an interpolated transform would be
/// singular. what: prefix of the message.
inline std::optional<scene::ShutterTransforms> shutter_transforms_of(std::span<const double, 16> open,
                                                                     std::span<const double, 16> close,
                                                                     const glm::dmat4& transform,
                                                                     const std::string& what = "") {
  const auto end = [&](std::span<const double, 16> m, const char* which) {
    if (std::ranges::all_of(m, [](double value) { return value == 0.0; })) return transform;
    const glm::dmat4 matrix = matrix_or_identity(m);
    require_transform(matrix, what + which);
    return matrix;
  };
  const scene::ShutterTransforms ends{end(open, "open_"), end(close, "close_")};
  if (ends.open == transform && ends.close == transform) return std::nullopt;
  if (!scene::stays_solid(ends.open, ends.close))
    refuse(what + "open_to_world and close_to_world have a singular interpolation");
  return ends;
}

/// Returns a host's array of count * each values.
template <class T>
std::span<const T> array_of(const T* values, uint64_t count, uint64_t each, const std::string& what) {
  if (count > std::numeric_limits<size_t>::max() / sizeof(T) / each) refuse(what + " exceed the address space");
  if (values == nullptr && count != 0) refuse(what + " are NULL");
  return {values, static_cast<size_t>(count * each)};
}

/// Calls visit with each descriptor of a host's array and its label. A host built against an older header passes
/// shorter descriptors, so the first one's struct_size is the stride. what: for example "clouds: mesh".
template <class Desc, class Visit>
void for_each_desc(const Desc* first, uint64_t count, const char* name, const std::string& what, Visit&& visit) {
  if (count == 0) return;
  const size_t stride = read_desc(first, name).struct_size;
  if (stride % alignof(Desc) != 0) refuse(what + ": " + name + ".struct_size is not a valid size");
  array_of(reinterpret_cast<const unsigned char*>(first), count, stride, what + "s");
  for (uint64_t i = 0; i < count; ++i) {
    const auto* at = reinterpret_cast<const Desc*>(reinterpret_cast<const char*>(first) + i * stride);
    const std::string one = what + " " + std::to_string(i);
    if (at->struct_size != stride) refuse(one + ": " + name + ".struct_size differs from that of the first element");
    visit(*at, one);
  }
}

}  // namespace cumulet::c_abi
