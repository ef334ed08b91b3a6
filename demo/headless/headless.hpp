#pragma once

#include <memory>

namespace cumulet::headless {

enum class Backend { automatic, egl, osmesa };
enum class Profile { core, compatibility };

/// An OpenGL 4.5 context that needs no display and no window.
/// EGL is tried first: every device of the device platform (hardware before software), then Mesa's surfaceless
/// platform, then the default display. OSMesa, a software driver, is tried last, only if EGL provides no GL 4.5.
/// A context can be current on one thread at a time.
class Context {
 public:
  /// Creates a context and makes it current on this thread. debug: requests a debug context; OSMesa ignores it. Throws
  /// std::runtime_error, one line that lists all attempts and their errors; the previous context may then no longer be
  /// current.
  [[nodiscard]] static Context create(Backend backend, bool debug = false, Profile profile = Profile::core);

  Context(Context&&) noexcept;
  Context& operator=(Context&&) noexcept;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  /// Releases the context from this thread if it is current here, and destroys it.
  ~Context();

  /// Throws std::runtime_error if the driver refuses. Does nothing if the context is current on this thread.
  void make_current();
  /// Releases the context from this thread if it is current here. With EGL, the context that it replaced here is
  /// current again.
  void release_current() noexcept;

  /// Returns the address of a GL function, or null. user: the Context. Matches cumulet_get_proc_fn.
  static void* get_proc(void* user, const char* name);

  /// Returns how the context was created: "egl-device", "egl-surfaceless", "egl-default" or "osmesa".
  [[nodiscard]] const char* name() const noexcept;

  class Driver;

 private:
  explicit Context(std::unique_ptr<Driver> driver);
  std::unique_ptr<Driver> driver_;
};

}  // namespace cumulet::headless
