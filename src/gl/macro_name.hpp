#pragma once

#include <string>
#include <string_view>
#include <type_traits>

namespace cumulet::gl {

/// The name of a macro of shader variants. cmake/embed_glsl.py writes shader_macros.hpp, which has a constant for each
/// macro: macros::halves is CM_HALVES.
class MacroName {
 public:
  explicit constexpr MacroName(std::string_view text) : text_(text) {}

  [[nodiscard]] constexpr std::string_view text() const { return text_; }
  /// Returns a macro of ProgramKey: the name and a value, which is a text or a number.
  template <class Value>
  [[nodiscard]] std::string operator()(const Value& value) const {
    if constexpr (std::is_convertible_v<Value, std::string_view>) {
      return std::string(text_).append(" ").append(std::string_view(value));
    } else {
      return (*this)(std::to_string(static_cast<int>(value)));
    }
  }

 private:
  std::string_view text_;
};

}  // namespace cumulet::gl
