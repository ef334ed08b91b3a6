#pragma once

#include <cstdint>
#include <optional>
#include <utility>

namespace cumulet {

/// Caches a value with the input it was built from. A failed build is remembered and is not retried until the input or
/// the settings change; the previous value stays available until then.
template <class Made, class Of>
class Slot {
 public:
  [[nodiscard]] explicit operator bool() const { return made_.has_value(); }
  [[nodiscard]] Made* get() { return made_ ? &made_->what : nullptr; }
  [[nodiscard]] const Made* get() const { return made_ ? &made_->what : nullptr; }
  /// Only valid if there is a value.
  [[nodiscard]] Made* operator->() { return get(); }
  [[nodiscard]] const Made* operator->() const { return get(); }
  [[nodiscard]] Made& operator*() { return *get(); }
  [[nodiscard]] const Made& operator*() const { return *get(); }
  [[nodiscard]] const Of& of() const { return made_->of; }

  /// Whether the value must be built: there is none for this input, and building it with these settings has not failed.
  [[nodiscard]] bool wants(const Of& of, std::uint64_t settings) const {
    const bool is = made_ && made_->of == of;
    return !is && !(failed_ && failed_->of == of && failed_->settings == settings);
  }
  /// True if there is neither a value nor a recorded failure.
  [[nodiscard]] bool empty() const { return !made_ && !failed_; }

  void put(Of of, Made made) {
    made_ = Thing{std::move(made), std::move(of)};
    failed_.reset();
  }
  /// Records a failure; the current value is kept.
  void fail(Of of, std::uint64_t settings) { failed_ = Failure{std::move(of), settings}; }
  /// Calls put() with the result of `make`. If `make` throws, calls fail() and rethrows.
  template <class Make>
  void make(const Of& of, std::uint64_t settings, Make&& make) {
    try {
      put(of, make());
    } catch (...) {
      fail(of, settings);
      throw;
    }
  }
  /// Moves the value out; the slot then has none.
  [[nodiscard]] std::optional<Made> take() {
    std::optional<Made> taken;
    if (made_) taken.emplace(std::move(made_->what));
    made_.reset();
    return taken;
  }
  /// Also forgets failures.
  void clear() {
    made_.reset();
    failed_.reset();
  }

 private:
  struct Thing {
    Made what;
    Of of;
  };
  struct Failure {
    Of of;
    std::uint64_t settings;
  };
  std::optional<Thing> made_;
  std::optional<Failure> failed_;
};

}  // namespace cumulet
