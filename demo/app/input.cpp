#include "input.hpp"

#include <GLFW/glfw3.h>
#include <cumulet/cumulet.h>

#include <utility>

namespace cumulet::demo {
namespace {

struct KeyName {
  const char* text;
  int code;
};

constexpr std::array<const char*, Input::buttons> button_names = {"left", "right", "middle"};
constexpr std::array key_names = {KeyName{"space", GLFW_KEY_SPACE},
                                  KeyName{"escape", GLFW_KEY_ESCAPE},
                                  KeyName{"enter", GLFW_KEY_ENTER},
                                  KeyName{"tab", GLFW_KEY_TAB},
                                  KeyName{"backspace", GLFW_KEY_BACKSPACE},
                                  KeyName{"insert", GLFW_KEY_INSERT},
                                  KeyName{"delete", GLFW_KEY_DELETE},
                                  KeyName{"right", GLFW_KEY_RIGHT},
                                  KeyName{"left", GLFW_KEY_LEFT},
                                  KeyName{"down", GLFW_KEY_DOWN},
                                  KeyName{"up", GLFW_KEY_UP},
                                  KeyName{"page_up", GLFW_KEY_PAGE_UP},
                                  KeyName{"page_down", GLFW_KEY_PAGE_DOWN},
                                  KeyName{"home", GLFW_KEY_HOME},
                                  KeyName{"end", GLFW_KEY_END},
                                  KeyName{"kp_period", GLFW_KEY_KP_DECIMAL},
                                  KeyName{"shift", GLFW_KEY_LEFT_SHIFT},
                                  KeyName{"ctrl", GLFW_KEY_LEFT_CONTROL},
                                  KeyName{"alt", GLFW_KEY_LEFT_ALT},
                                  KeyName{"right_shift", GLFW_KEY_RIGHT_SHIFT},
                                  KeyName{"right_ctrl", GLFW_KEY_RIGHT_CONTROL},
                                  KeyName{"right_alt", GLFW_KEY_RIGHT_ALT},
                                  KeyName{"comma", GLFW_KEY_COMMA},
                                  KeyName{"period", GLFW_KEY_PERIOD},
                                  KeyName{"minus", GLFW_KEY_MINUS},
                                  KeyName{"equal", GLFW_KEY_EQUAL},
                                  KeyName{",", GLFW_KEY_COMMA},
                                  KeyName{".", GLFW_KEY_PERIOD},
                                  KeyName{"[", GLFW_KEY_LEFT_BRACKET},
                                  KeyName{"]", GLFW_KEY_RIGHT_BRACKET},
                                  KeyName{"kp_enter", GLFW_KEY_KP_ENTER},
                                  KeyName{"kp_plus", GLFW_KEY_KP_ADD},
                                  KeyName{"kp_minus", GLFW_KEY_KP_SUBTRACT}};

std::string numbered(const char* word, int number) {
  std::string text = word;
  text += std::to_string(number);
  return text;
}

bool is_modifier(int code) {
  switch (code) {
    case GLFW_KEY_LEFT_SHIFT:
    case GLFW_KEY_RIGHT_SHIFT:
    case GLFW_KEY_LEFT_CONTROL:
    case GLFW_KEY_RIGHT_CONTROL:
    case GLFW_KEY_LEFT_ALT:
    case GLFW_KEY_RIGHT_ALT:
      return true;
    default:
      return false;
  }
}

/// Returns true if the key types a character and has no other function. Space is excluded because it activates
/// controls.
bool only_types(int code, unsigned modifiers) {
  return code > GLFW_KEY_SPACE && code < GLFW_KEY_ESCAPE && (modifiers & (modifier_ctrl | modifier_alt)) == 0;
}

bool is_plain(int code) {
  return (code >= GLFW_KEY_A && code <= GLFW_KEY_Z) || (code >= GLFW_KEY_0 && code <= GLFW_KEY_9);
}

}  // namespace

std::vector<Event> Input::take() {
  std::vector<Event> taken;
  std::bitset<buttons> changed_buttons;
  std::bitset<keys> changed_keys;
  bool other_changed = false;  // a key other than Ctrl, Shift or Alt
  while (!queue_.empty()) {
    const Event& event = queue_.front();
    const auto code = static_cast<std::size_t>(event.code);
    switch (event.type) {
      case Event::Type::move:
        // A button event belongs to the position at which it happened.
        if (changed_buttons.any()) return taken;
        x_ = event.x;
        y_ = event.y;
        break;
      case Event::Type::button:
        if (changed_buttons[code]) return taken;
        changed_buttons[code] = true;
        buttons_[code] = event.down;
        break;
      case Event::Type::key:
        if (only_types(event.code, modifiers())) {
          keys_[code] = event.down;
          break;
        }
        if (changed_keys[code] || (other_changed && is_modifier(event.code))) return taken;
        changed_keys[code] = true;
        other_changed |= !is_modifier(event.code);
        keys_[code] = event.down;
        break;
      case Event::Type::focus_lost:
        if (changed_buttons.any() || changed_keys.any()) return taken;
        buttons_.reset();
        keys_.reset();
        break;
      case Event::Type::wheel:
      case Event::Type::character:
      case Event::Type::drop:
      case Event::Type::resize:
      case Event::Type::close:
        break;
    }
    queue_.front().modifiers = modifiers();
    taken.push_back(std::move(queue_.front()));
    queue_.pop_front();
  }
  return taken;
}

unsigned Input::modifiers() const {
  const auto held = [this](int left, int right) {
    return keys_[static_cast<std::size_t>(left)] || keys_[static_cast<std::size_t>(right)];
  };
  unsigned modifiers = 0;
  if (held(GLFW_KEY_LEFT_SHIFT, GLFW_KEY_RIGHT_SHIFT)) modifiers |= modifier_shift;
  if (held(GLFW_KEY_LEFT_CONTROL, GLFW_KEY_RIGHT_CONTROL)) modifiers |= modifier_ctrl;
  if (held(GLFW_KEY_LEFT_ALT, GLFW_KEY_RIGHT_ALT)) modifiers |= modifier_alt;
  return modifiers;
}

int button_of(const std::string& name) {
  for (std::size_t i = 0; i < button_names.size(); ++i)
    if (name == button_names[i]) return static_cast<int>(i);
  return -1;
}

std::string button_name(int code) { return button_names[static_cast<std::size_t>(code)]; }

int key_of(const std::string& name) {
  if (name.size() == 1) {
    const int code = name[0] >= 'a' && name[0] <= 'z' ? name[0] - 'a' + 'A' : name[0];
    if (is_plain(code)) return code;
  }
  for (const KeyName& key : key_names)
    if (name == key.text) return key.code;
  for (int i = 1; i <= 12; ++i)
    if (name == numbered("f", i)) return GLFW_KEY_F1 + i - 1;
  for (int i = 0; i <= 9; ++i)
    if (name == numbered("kp_", i)) return GLFW_KEY_KP_0 + i;
  return -1;
}

std::string key_name(int code) {
  if (is_plain(code)) {
    const char c = static_cast<char>(code);
    std::string name(1, c >= 'A' ? static_cast<char>(c - 'A' + 'a') : c);
    return name;
  }
  for (const KeyName& key : key_names)
    if (code == key.code) return key.text;
  if (code >= GLFW_KEY_F1 && code <= GLFW_KEY_F12) return numbered("f", code - GLFW_KEY_F1 + 1);
  if (code >= GLFW_KEY_KP_0 && code <= GLFW_KEY_KP_9) return numbered("kp_", code - GLFW_KEY_KP_0);
  return "";
}

std::int32_t viewer_key(int code) {
  if (is_plain(code)) return code;
  if (code >= GLFW_KEY_KP_0 && code <= GLFW_KEY_KP_9) return CUMULET_KEY_KEYPAD_0 + code - GLFW_KEY_KP_0;
  switch (code) {
    case GLFW_KEY_HOME:
      return CUMULET_KEY_HOME;
    case GLFW_KEY_KP_DECIMAL:
      return CUMULET_KEY_KEYPAD_PERIOD;
    case GLFW_KEY_LEFT:
      return CUMULET_KEY_LEFT;
    case GLFW_KEY_RIGHT:
      return CUMULET_KEY_RIGHT;
    case GLFW_KEY_UP:
      return CUMULET_KEY_UP;
    case GLFW_KEY_DOWN:
      return CUMULET_KEY_DOWN;
    default:
      return CUMULET_KEY_NONE;
  }
}

}  // namespace cumulet::demo
