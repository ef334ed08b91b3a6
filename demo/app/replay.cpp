#include "replay.hpp"

#include <algorithm>
#include <iomanip>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace cumulet::demo {
namespace {

constexpr int max_frames = 100000;
constexpr int drag_moves = 8;
constexpr int control_frames = 30;  // maximum number of frames to wait for a control
constexpr auto patience = std::chrono::seconds(300);

/// Parser of the words of a line.
class Line {
 public:
  Line(const std::string& text, std::string where) : words_(text), where_(std::move(where)) {
    words_.imbue(std::locale::classic());
  }

  [[noreturn]] void fail(const std::string& cause) const { throw std::runtime_error(where_ + ": " + cause); }
  [[nodiscard]] bool ended() { return (words_ >> std::ws).eof(); }

  std::string word() {
    std::string text;
    if (!(words_ >> text)) fail("an argument is missing at the end");
    return text;
  }

  std::string quoted() {
    std::string text;
    if (ended()) fail("an argument is missing at the end");
    if (!(words_ >> std::quoted(text))) fail("the quotes do not match");
    return text;
  }

  double number() {
    double value = 0.0;
    if (!(words_ >> value)) fail("a number is missing or wrong");
    return value;
  }

  int integer(int least, int most) {
    int value = 0;
    if (!(words_ >> value) || value < least || value > most)
      fail("a whole number from " + std::to_string(least) + " to " + std::to_string(most) + " is missing");
    return value;
  }

  int button() {
    const int code = ended() ? 0 : button_of(word());
    if (code < 0) fail("the button must be left, right or middle");
    return code;
  }

  int key(const std::string& name) const {
    const int code = key_of(name);
    if (code < 0) fail("there is no key '" + name + "'");
    return code;
  }

  Position position() {
    if (ended()) fail("a position is missing");
    Position position;
    if (words_.peek() == '"') {
      position.of = Position::Of::control;
      position.control = quoted();
      position.x = position.y = 0.5;
      const int next = ended() ? 0 : words_.peek();
      if ((next < '0' || next > '9') && next != '.' && next != '-') return position;
    } else if (words_.peek() == 'v') {
      if (word() != "viewport") fail("a position must be \"a control\", viewport X Y, or X Y");
      position.of = Position::Of::viewport;
    }
    position.x = number();
    position.y = number();
    return position;
  }

 private:
  std::istringstream words_;
  std::string where_;
};

Event button_event(int code, bool down) {
  Event event;
  event.type = Event::Type::button;
  event.code = code;
  event.down = down;
  return event;
}

Event key_event(int code, bool down) {
  Event event;
  event.type = Event::Type::key;
  event.code = code;
  event.down = down;
  return event;
}

class Parser {
 public:
  Parser(std::vector<ReplayStep>& steps, int line) : steps_(steps), line_(line) {}

  void parse(Line& line) {
    using Type = ReplayStep::Type;
    const std::string command = line.word();
    if (command == "wait") {
      wait(line);
    } else if (command == "frames") {
      add(Type::frames).count = line.integer(1, max_frames);
    } else if (command == "idle") {
      ReplayStep& step = add(Type::idle);
      step.seconds = line.number();
      if (!(step.seconds > 0.0 && step.seconds <= 60.0)) line.fail("idle needs a time of up to 60 seconds");
    } else if (command == "move") {
      move(line.position());
    } else if (command == "down" || command == "up") {
      event(button_event(line.button(), command == "down"));
    } else if (command == "click") {
      move(line.position());
      const int button = line.button();
      event(button_event(button, true));
      event(button_event(button, false));
    } else if (command == "drag") {
      const Position from = line.position();
      if (line.word() != "to") line.fail("expected: drag POSITION to POSITION [BUTTON]");
      const Position to = line.position();
      const int button = line.button();
      move(from);
      event(button_event(button, true));
      for (int i = 1; i <= drag_moves; ++i) {
        ReplayStep& step = add(Type::move);
        step.from = from;
        step.to = to;
        step.part = static_cast<double>(i) / drag_moves;
      }
      event(button_event(button, false));
    } else if (command == "wheel") {
      Event wheel;
      wheel.type = Event::Type::wheel;
      wheel.y = line.number();
      event(wheel);
    } else if (command == "press" || command == "release") {
      event(key_event(line.key(line.word()), command == "press"));
    } else if (command == "key") {
      chord(line);
    } else if (command == "text") {
      add(Type::text).text = line.quoted();
    } else if (command == "drop") {
      Event drop;
      drop.type = Event::Type::drop;
      do drop.files.push_back(line.quoted());
      while (!line.ended());
      event(drop);
    } else if (command == "resize") {
      Event resize;
      resize.type = Event::Type::resize;
      resize.x = line.integer(1, 16384);
      resize.y = line.integer(1, 16384);
      event(resize);
    } else if (command == "focus_lost") {
      Event lost;
      lost.type = Event::Type::focus_lost;
      event(lost);
    } else if (command == "close") {
      Event close;
      close.type = Event::Type::close;
      event(close);
    } else if (command == "screenshot" || command == "report") {
      add(command == "report" ? Type::report : Type::screenshot).text = line.quoted();
    } else if (command == "quit") {
      add(Type::quit);
    } else {
      line.fail("there is no command '" + command + "'");
    }
    if (!line.ended()) line.fail("unexpected text at the end");
  }

 private:
  ReplayStep& add(ReplayStep::Type type) {
    ReplayStep& step = steps_.emplace_back();
    step.line = line_;
    step.type = type;
    return step;
  }
  void wait(Line& line) {
    using Type = ReplayStep::Type;
    const std::string what = line.word();
    if (what != "loaded" && what != "converged" && what != "rendered")
      line.fail("wait needs loaded, converged or rendered");
    add(what == "loaded" ? Type::wait_loaded : what == "converged" ? Type::wait_converged : Type::wait_rendered);
  }
  void event(Event what) { add(ReplayStep::Type::event).event = std::move(what); }
  void move(const Position& position) {
    ReplayStep& step = add(ReplayStep::Type::move);
    step.from = step.to = position;
  }

  /// Adds the events of "ctrl+shift+z": keys go down in this order and up in reverse order.
  void chord(Line& line) {
    std::istringstream names(line.word());
    std::vector<int> keys;
    for (std::string name; std::getline(names, name, '+');) keys.push_back(line.key(name));
    for (const int key : keys) event(key_event(key, true));
    std::reverse(keys.begin(), keys.end());
    for (const int key : keys) event(key_event(key, false));
  }

  std::vector<ReplayStep>& steps_;
  int line_;
};

std::string utf8(int code) {
  const auto c = static_cast<unsigned>(code);
  std::string text;
  const auto add = [&text](unsigned byte) { text += static_cast<char>(byte); };
  if (c < 0x80) {
    add(c);
  } else if (c < 0x800) {
    add(0xC0 | (c >> 6));
    add(0x80 | (c & 0x3F));
  } else if (c < 0x10000) {
    add(0xE0 | (c >> 12));
    add(0x80 | ((c >> 6) & 0x3F));
    add(0x80 | (c & 0x3F));
  } else {
    add(0xF0 | (c >> 18));
    add(0x80 | ((c >> 12) & 0x3F));
    add(0x80 | ((c >> 6) & 0x3F));
    add(0x80 | (c & 0x3F));
  }
  return text;
}

/// Decodes UTF-8; invalid bytes are dropped.
std::vector<int> code_points(const std::string& text) {
  std::vector<int> codes;
  for (std::size_t i = 0; i < text.size();) {
    const auto first = static_cast<unsigned char>(text[i]);
    const int more = first < 0x80 ? 0 : first >= 0xF0 ? 3 : first >= 0xE0 ? 2 : first >= 0xC0 ? 1 : -1;
    if (more < 0 || i + static_cast<std::size_t>(more) >= text.size()) {
      ++i;
      continue;
    }
    int code = more == 0 ? first : first & (0x3F >> more);
    for (int k = 1; k <= more; ++k)
      code = code << 6 | (static_cast<unsigned char>(text[i + static_cast<std::size_t>(k)]) & 0x3F);
    codes.push_back(code);
    i += static_cast<std::size_t>(more) + 1;
  }
  return codes;
}

}  // namespace

std::vector<ReplayStep> parse_replay(const std::string& text, const std::string& path) {
  std::vector<ReplayStep> steps;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    Line words(line, path + ":" + std::to_string(number));
    if (words.ended() || line[line.find_first_not_of(" \t\r")] == '#') continue;
    Parser(steps, number).parse(words);
  }
  return steps;
}

Player::Player(std::vector<ReplayStep> steps, std::string path)
    : steps_(std::move(steps)), path_(std::move(path)), since_(Clock::now()) {}

void Player::fail(const std::string& cause) const {
  throw std::runtime_error(path_ + ":" + std::to_string(steps_[at_].line) + ": " + cause);
}

std::optional<Rectangle> Player::locate(const ReplayHost& host, const Position& position) const {
  switch (position.of) {
    case Position::Of::window:
      return Rectangle{position.x, position.y, 0.0, 0.0};
    case Position::Of::viewport:
      return Rectangle{host.viewport.x + position.x * host.viewport.width,
                       host.viewport.y + position.y * host.viewport.height, 0.0, 0.0};
    case Position::Of::control:
      break;
  }
  const auto control = host.find(position.control);
  if (!control) {
    if (frames_ > control_frames) fail("there is no control \"" + position.control + "\"");
    return std::nullopt;
  }
  return Rectangle{control->x + position.x * control->width, control->y + position.y * control->height, 0.0, 0.0};
}

bool Player::wait_over(const ReplayHost& host) {
  const ReplayStep& step = steps_[at_];
  if (step.type == ReplayStep::Type::frames) return frames_ >= step.count;
  // The state shows a requested change only after a frame or two.
  constexpr int settle = 3;
  const bool loaded = step.type == ReplayStep::Type::wait_loaded;
  const bool rendered = step.type == ReplayStep::Type::wait_rendered;
  const bool done = rendered ? !host.rendering : !host.loading && (loaded || host.converged);
  if (frames_ > settle && done) return true;
  if (Clock::now() - since_ > patience)
    fail(rendered ? "the pictures were not rendered in time"
         : loaded ? "loading did not finish in time"
                  : "the image did not converge in time");
  return false;
}

Player::Order Player::next(const ReplayHost& host, Input& input) {
  Order order;
  if (at_ == steps_.size()) {
    order.quit = true;
    return order;
  }
  if (frames_ == 0) since_ = Clock::now();
  ++frames_;
  const ReplayStep& step = steps_[at_];
  switch (step.type) {
    case ReplayStep::Type::wait_loaded:
    case ReplayStep::Type::wait_converged:
    case ReplayStep::Type::wait_rendered:
    case ReplayStep::Type::frames:
      if (!wait_over(host)) return order;
      break;
    case ReplayStep::Type::idle: {
      const double left = step.seconds - std::chrono::duration<double>(Clock::now() - since_).count();
      idle_frames_ = frames_ - 1;
      if (left > 0.0) {
        order.idle = left;
        return order;
      }
      break;
    }
    case ReplayStep::Type::move: {
      const auto from = locate(host, step.from);
      const auto to = locate(host, step.to);
      if (!from || !to) return order;
      Event move;
      move.x = from->x + (to->x - from->x) * step.part;
      move.y = from->y + (to->y - from->y) * step.part;
      input.push(move);
      break;
    }
    case ReplayStep::Type::event:
      input.push(step.event);
      break;
    case ReplayStep::Type::text:
      for (const int code : code_points(step.text)) {
        Event character;
        character.type = Event::Type::character;
        character.code = code;
        input.push(character);
      }
      break;
    case ReplayStep::Type::screenshot:
      order.screenshot = step.text;
      break;
    case ReplayStep::Type::report:
      order.report = step.text;
      break;
    case ReplayStep::Type::quit:
      order.quit = true;
      break;
  }
  ++at_;
  frames_ = 0;
  return order;
}

Recorder::Recorder(const std::string& path) : file_(path) {
  if (!file_) throw std::runtime_error(path + ": cannot be written");
  file_.imbue(std::locale::classic());
  file_ << "# recorded by cumulet-demo\n";
}

Recorder::~Recorder() { file_ << "quit\n"; }

void Recorder::frame(const std::vector<Event>& events, bool loading) {
  if (!events.empty() && quiet_ > 0) {
    file_ << "frames " << quiet_ << '\n';
    quiet_ = 0;
  }
  for (const Event& event : events) {
    switch (event.type) {
      case Event::Type::move:
        file_ << "move " << event.x << ' ' << event.y << '\n';
        break;
      case Event::Type::button:
        file_ << (event.down ? "down " : "up ") << button_name(event.code) << '\n';
        break;
      case Event::Type::wheel:
        file_ << "wheel " << event.y << '\n';
        break;
      case Event::Type::key:
        if (const std::string name = key_name(event.code); !name.empty())
          file_ << (event.down ? "press " : "release ") << name << '\n';
        break;
      case Event::Type::character:
        file_ << "text " << std::quoted(utf8(event.code)) << '\n';
        break;
      case Event::Type::drop:
        file_ << "drop";
        for (const std::string& file : event.files) file_ << ' ' << std::quoted(file);
        file_ << '\n';
        break;
      case Event::Type::resize:
        file_ << "resize " << event.x << ' ' << event.y << '\n';
        break;
      case Event::Type::focus_lost:
        file_ << "focus_lost\n";
        break;
      case Event::Type::close:
        file_ << "close\n";
        break;
    }
  }
  if (events.empty()) ++quiet_;
  if (loading_ && !loading) {
    file_ << "wait loaded\n";
    quiet_ = 0;
  }
  loading_ = loading;
  file_.flush();
}

}  // namespace cumulet::demo
