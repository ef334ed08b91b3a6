#include "headless.hpp"

#include <dlfcn.h>

#include <array>
#include <cstdint>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

// Without this, eglplatform.h includes the X11 headers.
#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>

namespace cumulet::headless {

class Context::Driver {
 public:
  Driver() = default;
  Driver(const Driver&) = delete;
  Driver& operator=(const Driver&) = delete;
  virtual ~Driver() = default;
  virtual void make_current() = 0;
  virtual void release_current() noexcept = 0;
  virtual void* get_proc(const char* name) = 0;
  [[nodiscard]] virtual const char* name() const noexcept = 0;
};

namespace {

constexpr int gl_major = 4;
constexpr int gl_minor = 5;
constexpr unsigned gl_major_version_enum = 0x821B;
constexpr unsigned gl_minor_version_enum = 0x821C;

[[noreturn]] void fail(const std::string& message) { throw std::runtime_error(message); }

/// Opens the first of these shared libraries that exists. It is never unloaded: drivers have threads and thread-local
/// destructors, and crash at exit if their code is gone. RTLD_LOCAL keeps the GL entry points of EGL and OSMesa
/// separate.
void* open_library(std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (void* handle = dlopen(name, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE)) return handle;
  fail(std::string(*names.begin()) + " cannot be loaded");
}

template <class Function>
void load(void* library, Function& function, const char* name) {
  function = reinterpret_cast<Function>(dlsym(library, name));
  if (function == nullptr) fail(std::string(name) + " is missing");
}

bool has_extension(const char* list, std::string_view wanted) {
  std::string_view rest = list == nullptr ? "" : list;
  while (!rest.empty()) {
    const auto end = rest.find(' ');
    if (rest.substr(0, end) == wanted) return true;
    if (end == std::string_view::npos) break;
    rest.remove_prefix(end + 1);
  }
  return false;
}

/// Checks the version, because some drivers return a lower one than requested.
void check_version(Context::Driver& driver) {
  const auto get_integer = reinterpret_cast<void (*)(unsigned, int*)>(driver.get_proc("glGetIntegerv"));
  if (get_integer == nullptr) fail("no glGetIntegerv");
  int major = 0;
  int minor = 0;
  get_integer(gl_major_version_enum, &major);
  get_integer(gl_minor_version_enum, &minor);
  if (major < gl_major || (major == gl_major && minor < gl_minor))
    fail("the context has only OpenGL " + std::to_string(major) + "." + std::to_string(minor));
}

// ---------------------------------------------------------------------------------------------------------- EGL

/// Entry points of libEGL.
struct Egl {
  void* library = open_library({"libEGL.so.1"});
  PFNEGLBINDAPIPROC BindAPI = nullptr;
  PFNEGLCHOOSECONFIGPROC ChooseConfig = nullptr;
  PFNEGLCREATECONTEXTPROC CreateContext = nullptr;
  PFNEGLCREATEPBUFFERSURFACEPROC CreatePbufferSurface = nullptr;
  PFNEGLDESTROYCONTEXTPROC DestroyContext = nullptr;
  PFNEGLDESTROYSURFACEPROC DestroySurface = nullptr;
  PFNEGLGETCURRENTCONTEXTPROC GetCurrentContext = nullptr;
  PFNEGLGETCURRENTDISPLAYPROC GetCurrentDisplay = nullptr;
  PFNEGLGETCURRENTSURFACEPROC GetCurrentSurface = nullptr;
  PFNEGLGETDISPLAYPROC GetDisplay = nullptr;
  PFNEGLGETERRORPROC GetError = nullptr;
  PFNEGLGETPROCADDRESSPROC GetProcAddress = nullptr;
  PFNEGLINITIALIZEPROC Initialize = nullptr;
  PFNEGLMAKECURRENTPROC MakeCurrent = nullptr;
  PFNEGLQUERYSTRINGPROC QueryString = nullptr;
  // Extension functions; null if not supported.
  PFNEGLGETPLATFORMDISPLAYEXTPROC GetPlatformDisplayEXT = nullptr;
  PFNEGLQUERYDEVICESEXTPROC QueryDevicesEXT = nullptr;
  PFNEGLQUERYDEVICESTRINGEXTPROC QueryDeviceStringEXT = nullptr;

  Egl() {
    load(library, BindAPI, "eglBindAPI");
    load(library, ChooseConfig, "eglChooseConfig");
    load(library, CreateContext, "eglCreateContext");
    load(library, CreatePbufferSurface, "eglCreatePbufferSurface");
    load(library, DestroyContext, "eglDestroyContext");
    load(library, DestroySurface, "eglDestroySurface");
    load(library, GetCurrentContext, "eglGetCurrentContext");
    load(library, GetCurrentDisplay, "eglGetCurrentDisplay");
    load(library, GetCurrentSurface, "eglGetCurrentSurface");
    load(library, GetDisplay, "eglGetDisplay");
    load(library, GetError, "eglGetError");
    load(library, GetProcAddress, "eglGetProcAddress");
    load(library, Initialize, "eglInitialize");
    load(library, MakeCurrent, "eglMakeCurrent");
    load(library, QueryString, "eglQueryString");
    extension(GetPlatformDisplayEXT, "eglGetPlatformDisplayEXT");
    extension(QueryDevicesEXT, "eglQueryDevicesEXT");
    extension(QueryDeviceStringEXT, "eglQueryDeviceStringEXT");
  }

  template <class Function>
  void extension(Function& function, const char* name) const {
    function = reinterpret_cast<Function>(GetProcAddress(name));
  }

  /// Throws an error such as "eglSomething failed: EGL_BAD_MATCH".
  [[noreturn]] void fail_with_error(const char* what) const {
    static constexpr std::array<const char*, 15> names = {
        "EGL_SUCCESS",       "EGL_NOT_INITIALIZED", "EGL_BAD_ACCESS",        "EGL_BAD_ALLOC",
        "EGL_BAD_ATTRIBUTE", "EGL_BAD_CONFIG",      "EGL_BAD_CONTEXT",       "EGL_BAD_CURRENT_SURFACE",
        "EGL_BAD_DISPLAY",   "EGL_BAD_MATCH",       "EGL_BAD_NATIVE_PIXMAP", "EGL_BAD_NATIVE_WINDOW",
        "EGL_BAD_PARAMETER", "EGL_BAD_SURFACE",     "EGL_CONTEXT_LOST"};
    const auto index = static_cast<std::size_t>(GetError() - EGL_SUCCESS);
    fail(std::string(what) + " failed: " + (index < names.size() ? names[index] : "unknown error"));
  }
};

class EglDriver final : public Context::Driver {
 public:
  EglDriver(const Egl& egl, EGLDisplay display, const char* name, bool debug, Profile profile)
      : egl_(egl), display_(display), name_(name) {
    EGLint major = 0;
    EGLint minor = 0;
    // There is one display per process, and initializing it twice is allowed. It is never terminated, because that
    // would destroy the contexts of all other users.
    if (egl_.Initialize(display_, &major, &minor) == EGL_FALSE) egl_.fail_with_error("eglInitialize");
    if (egl_.BindAPI(EGL_OPENGL_API) == EGL_FALSE) fail("no desktop OpenGL");
    const char* extensions = egl_.QueryString(display_, EGL_EXTENSIONS);
    if (major == 1 && minor < 5 && !has_extension(extensions, "EGL_KHR_create_context"))
      fail("EGL cannot create a core context");

    const std::array<EGLint, 5> wanted = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                          EGL_NONE};
    EGLConfig config = nullptr;
    EGLint configs = 0;
    if (egl_.ChooseConfig(display_, wanted.data(), &config, 1, &configs) == EGL_FALSE || configs < 1) {
      if (!has_extension(extensions, "EGL_KHR_no_config_context")) fail("no config for desktop OpenGL");
      config = EGL_NO_CONFIG_KHR;
    }
    std::vector<EGLint> attributes = {
        EGL_CONTEXT_MAJOR_VERSION,
        gl_major,
        EGL_CONTEXT_MINOR_VERSION,
        gl_minor,
        EGL_CONTEXT_OPENGL_PROFILE_MASK,
        profile == Profile::core ? EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT : EGL_CONTEXT_OPENGL_COMPATIBILITY_PROFILE_BIT};
    // The extension's enums work everywhere: EGL 1.4 drivers only have these, and 1.5 drivers list the extension too.
    if (debug) attributes.insert(attributes.end(), {EGL_CONTEXT_FLAGS_KHR, EGL_CONTEXT_OPENGL_DEBUG_BIT_KHR});
    attributes.push_back(EGL_NONE);
    context_ = egl_.CreateContext(display_, config, EGL_NO_CONTEXT, attributes.data());
    if (context_ == EGL_NO_CONTEXT) {
      egl_.fail_with_error(profile == Profile::core ? "eglCreateContext for OpenGL 4.5 core"
                                                    : "eglCreateContext for OpenGL 4.5 compatibility");
    }
    try {
      if (!has_extension(extensions, "EGL_KHR_surfaceless_context")) {
        if (config == EGL_NO_CONFIG_KHR) fail("neither surfaceless contexts nor pixel buffers are supported");
        const std::array<EGLint, 5> size = {EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE};
        surface_ = egl_.CreatePbufferSurface(display_, config, size.data());
        if (surface_ == EGL_NO_SURFACE) egl_.fail_with_error("eglCreatePbufferSurface");
      }
      EglDriver::make_current();
      check_version(*this);
    } catch (...) {
      release();
      throw;
    }
  }
  EglDriver(const EglDriver&) = delete;
  EglDriver& operator=(const EglDriver&) = delete;
  ~EglDriver() override { release(); }

  void make_current() override {
    if (egl_.BindAPI(EGL_OPENGL_API) == EGL_FALSE) fail("no desktop OpenGL");  // the current API is per thread
    if (egl_.GetCurrentContext() == context_) return;
    const Binding present = {egl_.GetCurrentDisplay(), egl_.GetCurrentSurface(EGL_DRAW),
                             egl_.GetCurrentSurface(EGL_READ), egl_.GetCurrentContext()};
    if (egl_.MakeCurrent(display_, surface_, surface_, context_) == EGL_FALSE) egl_.fail_with_error("eglMakeCurrent");
    replaced_ = present;
  }
  void release_current() noexcept override {
    egl_.BindAPI(EGL_OPENGL_API);  // the current API is per thread, and this may be another thread
    if (egl_.GetCurrentContext() != context_) return;
    const Binding previous = std::exchange(replaced_, Binding{});
    // The replaced context may have been destroyed since. Then no context is current.
    if (previous.context == EGL_NO_CONTEXT ||
        egl_.MakeCurrent(previous.display, previous.draw, previous.read, previous.context) == EGL_FALSE)
      egl_.MakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  }
  void* get_proc(const char* function) override { return reinterpret_cast<void*>(egl_.GetProcAddress(function)); }
  [[nodiscard]] const char* name() const noexcept override { return name_; }

 private:
  /// The context that is current on a thread.
  struct Binding {
    EGLDisplay display = EGL_NO_DISPLAY;
    EGLSurface draw = EGL_NO_SURFACE;
    EGLSurface read = EGL_NO_SURFACE;
    EGLContext context = EGL_NO_CONTEXT;
  };

  void release() noexcept {
    replaced_ = {};
    EglDriver::release_current();
    if (surface_ != EGL_NO_SURFACE) egl_.DestroySurface(display_, surface_);
    egl_.DestroyContext(display_, context_);
  }

  Egl egl_;
  EGLDisplay display_;
  const char* name_;
  EGLContext context_ = EGL_NO_CONTEXT;
  EGLSurface surface_ = EGL_NO_SURFACE;
  Binding replaced_;
};

std::unique_ptr<Context::Driver> create_egl(bool debug, Profile profile) {
  const Egl egl;
  std::string reasons;
  const auto attempt = [&](EGLDisplay display, const char* name,
                           const std::string& label) -> std::unique_ptr<Context::Driver> {
    try {
      if (display == EGL_NO_DISPLAY) fail("no display");
      return std::make_unique<EglDriver>(egl, display, name, debug, profile);
    } catch (const std::exception& error) {
      reasons += (reasons.empty() ? "" : "; ") + label + ": " + error.what();
      return nullptr;
    }
  };

  const char* client = egl.QueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const bool platforms = egl.GetPlatformDisplayEXT != nullptr && has_extension(client, "EGL_EXT_platform_base");
  const bool devices =
      platforms && egl.QueryDevicesEXT != nullptr && egl.QueryDeviceStringEXT != nullptr &&
      has_extension(client, "EGL_EXT_platform_device") &&
      (has_extension(client, "EGL_EXT_device_enumeration") || has_extension(client, "EGL_EXT_device_base"));
  if (devices) {
    EGLint count = 0;
    std::vector<EGLDeviceEXT> found;
    if (egl.QueryDevicesEXT(0, nullptr, &count) == EGL_TRUE && count > 0) {
      found.resize(static_cast<std::size_t>(count));
      if (egl.QueryDevicesEXT(count, found.data(), &count) == EGL_FALSE) count = 0;
      found.resize(static_cast<std::size_t>(count));
    }
    for (const bool software : {false, true}) {
      for (std::size_t i = 0; i < found.size(); ++i) {
        const char* extensions = egl.QueryDeviceStringEXT(found[i], EGL_EXTENSIONS);
        if (has_extension(extensions, "EGL_MESA_device_software") != software) continue;
        if (auto driver = attempt(egl.GetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, found[i], nullptr), "egl-device",
                                  "device " + std::to_string(i)))
          return driver;
      }
    }
  }
  if (platforms && has_extension(client, "EGL_MESA_platform_surfaceless")) {
    EGLDisplay display = egl.GetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
    if (auto driver = attempt(display, "egl-surfaceless", "surfaceless")) return driver;
  }
  if (auto driver = attempt(egl.GetDisplay(EGL_DEFAULT_DISPLAY), "egl-default", "default display")) return driver;
  fail(reasons);
}

// ------------------------------------------------------------------------------------------------------- OSMesa

/// Entry points of OSMesa, declared here because Mesa has dropped the library and its header. OSMesa is used if it is
/// still installed.
struct OsMesa {
  using Handle = struct osmesa_context*;
  static constexpr int format = 0x22;
  static constexpr int rgba = 0x1908;
  static constexpr int depth_bits = 0x30;
  static constexpr int stencil_bits = 0x31;
  static constexpr int profile = 0x33;
  static constexpr int core_profile = 0x34;
  static constexpr int compatibility_profile = 0x35;
  static constexpr int major_version = 0x36;
  static constexpr int minor_version = 0x37;
  static constexpr unsigned unsigned_byte = 0x1401;

  void* library = open_library({"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"});
  Handle (*CreateContextAttribs)(const int* attributes, Handle share) = nullptr;
  void (*DestroyContext)(Handle) = nullptr;
  Handle (*GetCurrentContext)() = nullptr;
  unsigned char (*MakeCurrent)(Handle, void* buffer, unsigned type, int width, int height) = nullptr;
  void* (*GetProcAddress)(const char* name) = nullptr;

  OsMesa() {
    load(library, CreateContextAttribs, "OSMesaCreateContextAttribs");
    load(library, DestroyContext, "OSMesaDestroyContext");
    load(library, GetCurrentContext, "OSMesaGetCurrentContext");
    load(library, MakeCurrent, "OSMesaMakeCurrent");
    load(library, GetProcAddress, "OSMesaGetProcAddress");
  }
};

class OsMesaDriver final : public Context::Driver {
 public:
  explicit OsMesaDriver(Profile profile) {
    const std::array<int, 13> attributes = {
        OsMesa::format,
        OsMesa::rgba,
        OsMesa::depth_bits,
        0,
        OsMesa::stencil_bits,
        0,
        OsMesa::profile,
        profile == Profile::core ? OsMesa::core_profile : OsMesa::compatibility_profile,
        OsMesa::major_version,
        gl_major,
        OsMesa::minor_version,
        gl_minor,
        0};
    context_ = osmesa_.CreateContextAttribs(attributes.data(), nullptr);
    if (context_ == nullptr)
      fail(profile == Profile::core ? "no OpenGL 4.5 core context" : "no OpenGL 4.5 compatibility context");
    try {
      OsMesaDriver::make_current();
      check_version(*this);
    } catch (...) {
      release();
      throw;
    }
  }
  OsMesaDriver(const OsMesaDriver&) = delete;
  OsMesaDriver& operator=(const OsMesaDriver&) = delete;
  ~OsMesaDriver() override { release(); }

  void make_current() override {
    if (osmesa_.GetCurrentContext() == context_) return;
    if (osmesa_.MakeCurrent(context_, pixel_.data(), OsMesa::unsigned_byte, 1, 1) == 0)
      fail("OSMesaMakeCurrent failed");
  }
  void release_current() noexcept override {
    if (osmesa_.GetCurrentContext() == context_) osmesa_.MakeCurrent(nullptr, nullptr, OsMesa::unsigned_byte, 0, 0);
  }
  void* get_proc(const char* function) override { return osmesa_.GetProcAddress(function); }
  [[nodiscard]] const char* name() const noexcept override { return "osmesa"; }

 private:
  void release() noexcept {
    OsMesaDriver::release_current();
    osmesa_.DestroyContext(context_);
  }

  OsMesa osmesa_;
  OsMesa::Handle context_ = nullptr;
  std::array<std::uint32_t, 1> pixel_{};  // OSMesa's default framebuffer, which must exist, but is not drawn to
};

std::unique_ptr<Context::Driver> create_driver(Backend backend, bool debug, Profile profile) {
  std::string reasons;
  if (backend != Backend::osmesa) {
    try {
      return create_egl(debug, profile);
    } catch (const std::exception& error) {
      reasons = std::string("EGL (") + error.what() + ")";
    }
  }
  if (backend != Backend::egl) {
    try {
      return std::make_unique<OsMesaDriver>(profile);
    } catch (const std::exception& error) {
      reasons += (reasons.empty() ? "" : ", ") + std::string("OSMesa (") + error.what() + ")";
    }
  }
  fail("no OpenGL 4.5 context: tried " + reasons);
}

}  // namespace

Context::Context(std::unique_ptr<Driver> driver) : driver_(std::move(driver)) {}
Context::Context(Context&&) noexcept = default;
Context& Context::operator=(Context&&) noexcept = default;
Context::~Context() = default;

Context Context::create(Backend backend, bool debug, Profile profile) {
  return Context(create_driver(backend, debug, profile));
}

void Context::make_current() { driver_->make_current(); }

void Context::release_current() noexcept {
  if (driver_ != nullptr) driver_->release_current();
}

void* Context::get_proc(void* user, const char* name) {
  if (user == nullptr || name == nullptr) return nullptr;
  const Context& context = *static_cast<Context*>(user);
  return context.driver_ == nullptr ? nullptr : context.driver_->get_proc(name);
}

const char* Context::name() const noexcept { return driver_ == nullptr ? "" : driver_->name(); }

}  // namespace cumulet::headless
