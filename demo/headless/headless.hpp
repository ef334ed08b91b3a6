#pragma once

#include <memory>

namespace cumulet::headless {

enum class Backend { automatic, egl, osmesa };
enum class Profile { core, compatibility };

/// An OpenGL 4.5 context that needs no display and no window.
///
/// EGL is tried first: every device of the device platform (hardware before software), then Mesa's surfaceless
/// platform, then the default display. OSMesa, a software driver, comes last and only when EGL gives no GL 4.5.
///
/// A context may be current on one thread at a time, as always in GL.
class Context {
 public:
  /// Makes a context and makes it current on this thread. With debug the driver is asked for a debug context
  /// (OSMesa has none and ignores it). Throws std::runtime_error, one line, that says what was tried and why
  /// each failed; whatever was current before may then no longer be.
  [[nodiscard]] static Context create(Backend backend, bool debug = false, Profile profile = Profile::core);

  Context(Context&&) noexcept;
  Context& operator=(Context&&) noexcept;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  /// Releases the context from this thread if it is current here, and destroys it.
  ~Context();

  /// Throws std::runtime_error if the driver refuses.
  void make_current();

  /// The address of a GL function, or null. user is the Context; fits cumulet_get_proc_fn.
  static void* get_proc(void* user, const char* name);

  /// How the context came about: "egl-device", "egl-surfaceless", "egl-default" or "osmesa".
  [[nodiscard]] const char* name() const noexcept;

  class Driver;

 private:
  explicit Context(std::unique_ptr<Driver> driver);
  std::unique_ptr<Driver> driver_;
};

}  // namespace cumulet::headless
