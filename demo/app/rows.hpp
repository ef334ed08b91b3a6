#pragma once

#include <array>
#include <map>
#include <settings.hpp>
#include <string>

#include "ui.hpp"

namespace cumulet::demo {

/// Rows of the panel, as the table of settings has them: each shows a value and is true once the user changed it.
/// Settings without a row show nothing.
class Rows {
 public:
  explicit Rows(Ui& ui) : ui_(ui) {}
  Rows(const Rows&) = delete;
  Rows& operator=(const Rows&) = delete;
  ~Rows() = default;

  bool draw(const settings::Facts& facts, std::int32_t& value);
  bool draw(const settings::Facts& facts, std::uint32_t& value);
  bool draw(const settings::Facts& facts, std::uint64_t& value);
  bool draw(const settings::Facts& facts, float& value);
  bool draw(const settings::Facts& facts, double& value);
  /// A light's colour and strength, the largest of the three; or a colour alone.
  bool draw(const settings::Facts& facts, float (&value)[3]);
  /// A rectangle's numbers.
  bool draw(const settings::Facts& facts, float (&value)[4]);
  template <settings::Enumerated Enum>
  bool draw(const settings::Facts& facts, Enum& value) {
    int number = static_cast<int>(value);
    if (!choose(facts, number)) return false;
    value = static_cast<Enum>(number);
    return true;
  }

 private:
  bool choose(const settings::Facts& facts, int& value);

  Ui& ui_;
  std::map<std::string, std::array<float, 3>> hues_;  // of lights, which strength 0 does not lose
};

}  // namespace cumulet::demo
