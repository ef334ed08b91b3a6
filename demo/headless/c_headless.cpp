// The C interface of the headless contexts.

#include <algorithm>
#include <cstring>
#include <exception>
#include <new>
#include <string_view>
#include <utility>

#include "cumulet_headless.h"
#include "headless.hpp"

using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::headless::Profile;

struct cumulet_headless {
  Context context;
};

namespace {

cumulet_status fail(cumulet_status status, std::string_view line, char* error, std::size_t error_size) noexcept {
  if (error == nullptr || error_size == 0) return status;
  const std::size_t length = std::min(line.size(), error_size - 1);
  std::memcpy(error, line.data(), length);
  error[length] = '\0';
  return status;
}

bool is_flag(std::int32_t value) { return value == 0 || value == 1; }

/// Returns why a descriptor is refused, or "".
std::string_view refusal_of(const cumulet_headless_desc& desc) {
  if (desc.struct_size != sizeof desc) return "cumulet_headless_desc: unknown struct_size";
  if (desc.backend < CUMULET_HEADLESS_AUTO || desc.backend > CUMULET_HEADLESS_OSMESA)
    return "cumulet_headless_desc: unknown backend";
  if (!is_flag(desc.debug)) return "cumulet_headless_desc: debug must be 0 or 1";
  if (!is_flag(desc.compatibility)) return "cumulet_headless_desc: compatibility must be 0 or 1";
  return "";
}

Backend backend_of(cumulet_headless_backend backend) {
  if (backend == CUMULET_HEADLESS_EGL) return Backend::egl;
  return backend == CUMULET_HEADLESS_OSMESA ? Backend::osmesa : Backend::automatic;
}

}  // namespace

cumulet_status cumulet_headless_create(const cumulet_headless_desc* desc, cumulet_headless** out, char* error,
                                       size_t error_size) {
  if (out == nullptr) return fail(CUMULET_ERROR_INVALID_ARGUMENT, "out is NULL", error, error_size);
  *out = nullptr;
  if (desc == nullptr) return fail(CUMULET_ERROR_INVALID_ARGUMENT, "desc is NULL", error, error_size);
  if (const auto refusal = refusal_of(*desc); !refusal.empty())
    return fail(CUMULET_ERROR_INVALID_ARGUMENT, refusal, error, error_size);
  try {
    const Profile profile = desc->compatibility == 1 ? Profile::compatibility : Profile::core;
    *out = new cumulet_headless{Context::create(backend_of(desc->backend), desc->debug == 1, profile)};
    return CUMULET_OK;
  } catch (const std::bad_alloc&) {
    return fail(CUMULET_ERROR_OUT_OF_MEMORY, "out of memory", error, error_size);
  } catch (const std::exception& cause) {
    return fail(CUMULET_ERROR_UNSUPPORTED, cause.what(), error, error_size);
  }
}

void cumulet_headless_destroy(cumulet_headless* context) {
  cumulet_headless_release_current(context);
  delete context;
}

cumulet_status cumulet_headless_make_current(cumulet_headless* context, char* error, size_t error_size) {
  if (context == nullptr) return fail(CUMULET_ERROR_INVALID_ARGUMENT, "context is NULL", error, error_size);
  try {
    context->context.make_current();
    return CUMULET_OK;
  } catch (const std::exception& cause) {
    return fail(CUMULET_ERROR_GL, cause.what(), error, error_size);
  }
}

void cumulet_headless_release_current(cumulet_headless* context) {
  if (context != nullptr) context->context.release_current();
}

const char* cumulet_headless_name(const cumulet_headless* context) {
  return context == nullptr ? "" : context->context.name();
}

void* cumulet_headless_get_proc(void* context, const char* name) {
  return context == nullptr ? nullptr : Context::get_proc(&static_cast<cumulet_headless*>(context)->context, name);
}
