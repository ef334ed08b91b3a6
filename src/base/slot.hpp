#pragma once

#include <cstdint>
#include <optional>
#include <utility>

namespace cumulet {

/// What was made, what it was made of, and what could not be made: of something that changes, and at settings that
/// change. What failed is not tried again before one of them does, and what there was may serve until then.
template <class Made, class Of>
class Slot {
 public:
  [[nodiscard]] explicit operator bool() const { return made_.has_value(); }
  [[nodiscard]] Made* get() { return made_ ? &made_->what : nullptr; }
  [[nodiscard]] const Made* get() const { return made_ ? &made_->what : nullptr; }
  /// Only where there is something.
  [[nodiscard]] Made* operator->() { return get(); }
  [[nodiscard]] const Made* operator->() const { return get(); }
  [[nodiscard]] Made& operator*() { return *get(); }
  [[nodiscard]] const Made& operator*() const { return *get(); }
  [[nodiscard]] const Of& of() const { return made_->of; }

  /// Whether it is to be made: what is there is not of this, and with these settings it did not fail.
  [[nodiscard]] bool wants(const Of& of, std::uint64_t settings) const {
    const bool is = made_ && made_->of == of;
    return !is && !(failed_ && failed_->of == of && failed_->settings == settings);
  }
  /// Neither is anything there nor did anything fail.
  [[nodiscard]] bool empty() const { return !made_ && !failed_; }

  void put(Of of, Made made) {
    made_ = Thing{std::move(made), std::move(of)};
    failed_.reset();
  }
  /// What is there stays.
  void fail(Of of, std::uint64_t settings) { failed_ = Failure{std::move(of), settings}; }
  /// put() with what `make` returns; where it throws, fail() and throws that.
  template <class Make>
  void make(const Of& of, std::uint64_t settings, Make&& make) {
    try {
      put(of, make());
    } catch (...) {
      fail(of, settings);
      throw;
    }
  }
  /// What is there, which then is not.
  [[nodiscard]] std::optional<Made> take() {
    std::optional<Made> taken;
    if (made_) taken.emplace(std::move(made_->what));
    made_.reset();
    return taken;
  }
  /// Forgets failures, too.
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
