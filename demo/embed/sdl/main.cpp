// Cumulet in an SDL 2 window of a host with legacy OpenGL: a context of the compatibility profile, immediate state that
// is set once and expected to stay, client arrays and a display list. The viewer's image is between two panels of the
// host; one is drawn before it and one after it.
//
//     cumulet-embed-sdl --volume FILE [--test OUT_DIR]
//
// F frames all, Escape quits, P writes sdl-N.ppm (to OUT_DIR or the current folder) when the image has all samples.
// --test: a small window with few samples.
#include <SDL.h>
#include <SDL_opengl.h>
#include <cumulet/cumulet.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

namespace {

[[noreturn]] void fail(const std::string& cause) {
  std::fprintf(stderr, "cumulet-embed-sdl: %s\n", cause.c_str());
  std::exit(1);
}

template <class T>
T must(cumulet::Result<T> result) {
  if (!result) fail(result.error().message.c_str());
  return std::move(result).value();
}

void must(const cumulet::Result<>& result) {
  if (!result) fail(result.error().message.c_str());
}

/// The host's own drawing. Its state is set once: each frame expects the state of the last one, as old renderers do.
class Panels {
 public:
  Panels() {
    glMatrixMode(GL_PROJECTION);
    glOrtho(0.0, 1.0, 0.0, 1.0, -1.0, 1.0);  // the window is a unit square
    glMatrixMode(GL_MODELVIEW);
    glShadeModel(GL_FLAT);
    glClearColor(0.1F, 0.1F, 0.1F, 1.0F);

    // A board of orange squares and holes, which the alpha test cuts out.
    std::array<std::array<unsigned char, 4>, 64> board{};
    for (std::size_t i = 0; i < board.size(); ++i)
      board[i] = {255, 140, 0, static_cast<unsigned char>((i % 8 + i / 8) % 2 == 0 ? 255 : 0)};
    GLuint texture = 0;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, 8, 8, 0, GL_RGBA, GL_UNSIGNED_BYTE, board.data());
    glTexEnvi(GL_TEXTURE_ENV, GL_TEXTURE_ENV_MODE, GL_MODULATE);
    glEnable(GL_TEXTURE_2D);
    glAlphaFunc(GL_GREATER, 0.5F);
    glEnable(GL_ALPHA_TEST);

    glEnableClientState(GL_VERTEX_ARRAY);
    glEnableClientState(GL_TEXTURE_COORD_ARRAY);
    glVertexPointer(2, GL_FLOAT, 0, corners.data());
    glTexCoordPointer(2, GL_FLOAT, 0, coordinates.data());

    label_ = glGenLists(1);
    glNewList(label_, GL_COMPILE);
    glBegin(GL_QUADS);
    for (const auto& [x, y] : {std::array{0.0F, 0.0F}, {1.0F, 0.0F}, {1.0F, 0.25F}, {0.0F, 0.25F}}) {
      glTexCoord2f(x, y);
      glVertex2f(0.35F + 0.3F * x, 0.02F + 0.4F * y);
    }
    glEnd();
    glEndList();
    glColor3f(1.0F, 1.0F, 1.0F);
  }

  static void draw_left() { glDrawArrays(GL_QUADS, 0, 4); }
  static void draw_right() { glDrawArrays(GL_QUADS, 4, 4); }
  /// Draws the board above the viewer's image, which shows through its holes.
  void draw_label() const { glCallList(label_); }

  static constexpr int parts = 8;  // of the window's width; a panel has one

 private:
  static constexpr float edge = 1.0F / parts;
  static constexpr std::array corners{0.0F,        0.0F, edge, 0.0F, edge, 1.0F, 0.0F,        1.0F,
                                      1.0F - edge, 0.0F, 1.0F, 0.0F, 1.0F, 1.0F, 1.0F - edge, 1.0F};
  static constexpr std::array coordinates{0.0F, 0.0F, 0.5F, 0.0F, 0.5F, 2.0F, 0.0F, 2.0F,
                                          0.0F, 0.0F, 0.5F, 0.0F, 0.5F, 2.0F, 0.0F, 2.0F};

  GLuint label_ = 0;
};

struct Host {
  SDL_Window* window = nullptr;
  cumulet::Viewer viewer;
  std::string folder = ".";
  bool picture_wanted = false;
  bool ends = false;
  int pictures = 0;
  int width = 0;  // of the window, in pixels
  int height = 0;

  [[nodiscard]] int panel() const { return width / Panels::parts; }
};

cumulet::Key key_of(SDL_Keycode key) {
  if (key >= SDLK_a && key <= SDLK_z) return cumulet::Key{key - SDLK_a + 'A'};
  if (key >= SDLK_0 && key <= SDLK_9) return cumulet::Key{key};
  if (key == SDLK_KP_0) return cumulet::Key{CUMULET_KEY_KEYPAD_0};
  if (key >= SDLK_KP_1 && key <= SDLK_KP_9) return cumulet::Key{CUMULET_KEY_KEYPAD_0 + 1 + key - SDLK_KP_1};
  switch (key) {
    case SDLK_HOME:
      return cumulet::Key::home;
    case SDLK_LEFT:
      return cumulet::Key::left;
    case SDLK_RIGHT:
      return cumulet::Key::right;
    case SDLK_UP:
      return cumulet::Key::up;
    case SDLK_DOWN:
      return cumulet::Key::down;
    default:
      return cumulet::Key::none;
  }
}

/// Adds the modifiers and the pointer position in pixels of the viewer's image.
void feed(Host& host, cumulet::Event event) {
  int x = 0, y = 0, points = 0;
  SDL_GetMouseState(&x, &y);
  SDL_GetWindowSize(host.window, &points, nullptr);
  const double scale = static_cast<double>(host.width) / std::max(points, 1);
  event.x = x * scale - host.panel();
  event.y = y * scale;
  const SDL_Keymod held = SDL_GetModState();
  const auto modifier = [held](int keys, cumulet::Modifiers of) {
    return (held & keys) != 0 ? of : cumulet::Modifiers::none;
  };
  event.modifiers = modifier(KMOD_SHIFT, cumulet::Modifiers::shift) | modifier(KMOD_CTRL, cumulet::Modifiers::ctrl) |
                    modifier(KMOD_ALT, cumulet::Modifiers::alt);
  must(host.viewer.input(event));
}

void feed_button(Host& host, const SDL_MouseButtonEvent& button) {
  if (button.button > SDL_BUTTON_RIGHT) return;
  const bool down = button.type == SDL_MOUSEBUTTONDOWN;
  feed(host, {.type = down ? cumulet::EventType::button_down : cumulet::EventType::button_up,
              .button = button.button == SDL_BUTTON_LEFT    ? cumulet::Button::left
                        : button.button == SDL_BUTTON_RIGHT ? cumulet::Button::right
                                                            : cumulet::Button::middle});
}

void feed_key(Host& host, const SDL_KeyboardEvent& key) {
  if (key.repeat != 0) return;
  const bool down = key.type == SDL_KEYDOWN;
  if (down && key.keysym.sym == SDLK_ESCAPE) host.ends = true;
  if (down && key.keysym.sym == SDLK_p) host.picture_wanted = true;
  feed(host, {.type = down ? cumulet::EventType::key_down : cumulet::EventType::key_up, .key = key_of(key.keysym.sym)});
}

void handle(Host& host, const SDL_Event& event) {
  switch (event.type) {
    case SDL_QUIT:
      host.ends = true;
      break;
    case SDL_MOUSEMOTION:
      feed(host, {.type = cumulet::EventType::pointer_move});
      break;
    case SDL_MOUSEBUTTONDOWN:
    case SDL_MOUSEBUTTONUP:
      feed_button(host, event.button);
      break;
    case SDL_MOUSEWHEEL:
      feed(host, {.type = cumulet::EventType::wheel, .wheel = event.wheel.preciseY});
      break;
    case SDL_KEYDOWN:
    case SDL_KEYUP:
      feed_key(host, event.key);
      break;
    case SDL_WINDOWEVENT:
      if (event.window.event == SDL_WINDOWEVENT_FOCUS_LOST) feed(host, {.type = cumulet::EventType::focus_lost});
      break;
    default:  // the viewer's update, or an event for other hosts
      break;
  }
}

void write_picture(Host& host) {
  const std::string path = host.folder + "/sdl-" + std::to_string(++host.pictures) + ".ppm";
  const std::size_t row = std::size_t(host.width) * 3;
  std::vector<unsigned char> pixels(row * std::size_t(host.height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, host.width, host.height, GL_RGB, GL_UNSIGNED_BYTE, pixels.data());
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) fail(path + ": cannot be written");
  std::fprintf(file, "P6\n%d %d\n255\n", host.width, host.height);
  for (std::size_t end = pixels.size(); end > 0; end -= row) std::fwrite(&pixels[end - row], 1, row, file);
  std::fclose(file);
  host.picture_wanted = false;
}

/// Draws a frame. Returns true if there is more to draw.
bool draw(Host& host, const Panels& panels) {
  int width = 0, height = 0;
  SDL_GL_GetDrawableSize(host.window, &width, &height);
  if (width != host.width || height != host.height) glViewport(0, 0, width, height);
  host.width = width, host.height = height;
  glClear(GL_COLOR_BUFFER_BIT);
  Panels::draw_left();
  // GlStatePolicy::restore, the default: all state is as before after the call.
  const cumulet::FrameResult frame =
      must(host.viewer.render({.budget_ms = 15.0,
                               .width = static_cast<std::uint32_t>(width),
                               .height = static_cast<std::uint32_t>(height),
                               .viewport = {host.panel(), 0, width - 2 * host.panel(), height}}));
  Panels::draw_right();
  panels.draw_label();
  if (const GLenum error = glGetError(); error != GL_NO_ERROR) fail("OpenGL error " + std::to_string(error));
  if (frame.has(cumulet::RenderFlags::failed)) fail(must(host.viewer.get_progress()).message.c_str());
  if (host.picture_wanted && frame.has(cumulet::RenderFlags::converged)) write_picture(host);
  SDL_GL_SwapWindow(host.window);
  return frame.has(cumulet::RenderFlags::incomplete);
}

void run(Host& host, const std::string& volume, bool test) {
  const Uint32 update = SDL_RegisterEvents(1);
  const auto wake = [update] {  // from any thread
    SDL_Event event{};
    event.type = update;
    SDL_PushEvent(&event);
  };
  host.viewer = must(cumulet::Viewer::create({.get_proc = SDL_GL_GetProcAddress, .update = wake}));
  must(host.viewer.set_sun_sky({.sun_azimuth_degrees = 60.0F,
                                .sun_elevation_degrees = 40.0F,
                                .sun_irradiance = {2.6F, 2.5F, 2.3F},
                                .sky_radiance = {0.2F, 0.3F, 0.5F}}));
  must(host.viewer.set_sampling({.samples = test ? 4U : 0U}));
  must(host.viewer.load_volume(volume));
  const Panels panels;
  while (!host.ends) {
    const bool more = draw(host, panels);
    SDL_Event event{};
    if (!more && SDL_WaitEvent(&event) != 0) handle(host, event);
    while (SDL_PollEvent(&event) != 0) handle(host, event);
  }
  host.viewer = {};  // destroyed while the context exists
}

}  // namespace

int main(int argc, char** argv) {
  Host host;
  std::string volume;
  bool test = false;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::string(argv[i]) == "--volume") volume = argv[i + 1];
    if (std::string(argv[i]) == "--test") host.folder = argv[i + 1], test = true;
  }
  if (volume.empty()) fail("usage: cumulet-embed-sdl --volume FILE [--test OUT_DIR]");

  if (SDL_Init(SDL_INIT_VIDEO) != 0) fail(SDL_GetError());
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_MAJOR_VERSION, 4);
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_MINOR_VERSION, 5);
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_PROFILE_MASK, SDL_GL_CONTEXT_PROFILE_COMPATIBILITY);
  host.window = SDL_CreateWindow("Cumulet in SDL", SDL_WINDOWPOS_UNDEFINED, SDL_WINDOWPOS_UNDEFINED, test ? 240 : 1280,
                                 test ? 180 : 800, SDL_WINDOW_OPENGL | SDL_WINDOW_RESIZABLE | SDL_WINDOW_ALLOW_HIGHDPI);
  if (host.window == nullptr) fail(SDL_GetError());
  SDL_GLContext context = SDL_GL_CreateContext(host.window);
  if (context == nullptr) fail(SDL_GetError());
  run(host, volume, test);
  SDL_GL_DeleteContext(context);
  SDL_DestroyWindow(host.window);
  SDL_Quit();
  return 0;
}
