#include "image_input.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <utility>

#include "history.hpp"

namespace cumulet::demo {
namespace {

constexpr double click_reach = 4.0;  // pixels at scale 1 that the pointer may move during a click

}  // namespace

void ImageInput::set_viewport(const Rectangle& viewport, float scale) {
  viewport_ = viewport;
  scale_ = scale;
}

bool ImageInput::take_for_region(const Event& event) {
  const bool over_picture = !ImGui::GetIO().WantCaptureMouse;
  return region_drag_.take(event, input_.x(), input_.y(), over_picture);
}

void ImageInput::take(const Event& event) {
  switch (event.type) {
    case Event::Type::focus_lost:
      buttons_ = 0;
      handles_.release();
      clicked_.reset();
      to_viewer(event);
      break;
    case Event::Type::button:
      take_button(event);
      break;
    case Event::Type::move:
      if (clicked_ && glm::distance(*clicked_, pointer()) > click_reach * static_cast<double>(scale_)) clicked_.reset();
      if (handles_.holds()) break;
      [[fallthrough]];
    case Event::Type::wheel:
      if (buttons_ != 0 || !ImGui::GetIO().WantCaptureMouse) to_viewer(event);
      break;
    case Event::Type::key:
    case Event::Type::character:
    case Event::Type::drop:
    case Event::Type::resize:
    case Event::Type::close:
      break;
  }
}

void ImageInput::take_button(const Event& event) {
  const unsigned bit = 1U << static_cast<unsigned>(event.code);
  const bool ours = event.down ? !ImGui::GetIO().WantCaptureMouse : (buttons_ & bit) != 0;
  if (!ours) return;
  buttons_ = event.down ? buttons_ | bit : buttons_ & ~bit;
  if (event.down)
    press(event);
  else
    let_go(event);
}

void ImageInput::press(const Event& event) {
  clicked_.reset();
  const bool plain = (event.modifiers & (modifier_shift | modifier_alt)) == 0;
  if (event.code == GLFW_MOUSE_BUTTON_LEFT && plain && model_.navigation.fly == 0) {
    const auto seen = sight();
    if (seen && handles_.press(model_, *seen, pointer(), scale_)) return;
    if ((event.modifiers & modifier_ctrl) == 0) clicked_ = pointer();
  }
  if (!handles_.holds()) to_viewer(event);
}

void ImageInput::let_go(const Event& event) {
  if (event.code != GLFW_MOUSE_BUTTON_LEFT || !handles_.holds()) {
    to_viewer(event);
    if (event.code == GLFW_MOUSE_BUTTON_LEFT && clicked_) choose_at(*std::exchange(clicked_, std::nullopt));
    return;
  }
  drag_handle();
  handles_.release();
}

void ImageInput::choose_at(const glm::dvec2& pixel) {
  const auto seen = sight();
  if (!seen) return;
  if (const auto analytic_light = Handles::analytic_light_at(model_, *seen, pixel, scale_)) {
    model_.chosen = analytic_light;
    return;
  }
  exchange_.requests.push_back({Request::Type::pick, {}, pixel.x - viewport_.x, pixel.y - viewport_.y});
}

std::optional<Sight> ImageInput::sight() const {
  if (needs_fit(model_.scene.camera) || !(viewport_.width > 0.0 && viewport_.height > 0.0)) return std::nullopt;
  return Sight(model_.scene.camera, viewport_);
}

void ImageInput::drag_handle() {
  if (!handles_.holds()) return;
  if (const auto seen = sight()) handles_.drag(model_, *seen, pointer(), (input_.modifiers() & modifier_ctrl) != 0);
}

void ImageInput::draw_handles() const {
  const auto seen = sight();
  if (!seen || model_.navigation.fly != 0) return;
  const bool free = buttons_ == 0 && !ImGui::GetIO().WantCaptureMouse;
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const auto corner = [](double x, double y) { return ImVec2(static_cast<float>(x), static_cast<float>(y)); };
  list.PushClipRect(corner(viewport_.x, viewport_.y),
                    corner(viewport_.x + viewport_.width, viewport_.y + viewport_.height));
  handles_.draw(list, model_, *seen, free ? std::optional(pointer()) : std::nullopt, scale_);
  list.PopClipRect();
}

void ImageInput::to_viewer(const Event& event) {
  cumulet_event out{};
  out.struct_size = sizeof out;
  out.x = input_.x() - viewport_.x;
  out.y = input_.y() - viewport_.y;
  out.modifiers = event.modifiers;
  switch (event.type) {
    case Event::Type::move:
      out.type = CUMULET_EVENT_POINTER_MOVE;
      break;
    case Event::Type::button:
      out.type = event.down ? CUMULET_EVENT_BUTTON_DOWN : CUMULET_EVENT_BUTTON_UP;
      out.button = event.code == GLFW_MOUSE_BUTTON_LEFT     ? CUMULET_BUTTON_LEFT
                   : event.code == GLFW_MOUSE_BUTTON_MIDDLE ? CUMULET_BUTTON_MIDDLE
                                                            : CUMULET_BUTTON_RIGHT;
      break;
    case Event::Type::wheel:
      out.type = CUMULET_EVENT_WHEEL;
      out.wheel = event.y;
      break;
    case Event::Type::key:
      out.type = event.down ? CUMULET_EVENT_KEY_DOWN : CUMULET_EVENT_KEY_UP;
      out.key = viewer_key(event.code);
      break;
    case Event::Type::focus_lost:
      out.type = CUMULET_EVENT_FOCUS_LOST;
      break;
    case Event::Type::character:
    case Event::Type::drop:
    case Event::Type::resize:
    case Event::Type::close:
      return;
  }
  exchange_.inputs.push_back({out, event.type == Event::Type::key ? event.code : 0});
}

void ImageInput::follow_pointer() {
  if (const auto region = region_drag_.taken(viewport_)) std::ranges::copy(*region, model_.scene.sampling.region);
  drag_handle();
}

bool ImageInput::cancel() {
  if (region_drag_.cancel()) return true;
  if (!handles_.holds()) return false;
  handles_.cancel(model_);
  return true;
}

void ImageInput::draw_region() const {
  const auto drawn = region_drag_.drawn();
  if (!drawn) return;
  const ImVec2 low(static_cast<float>(drawn->x), static_cast<float>(drawn->y));
  const ImVec2 high(low.x + static_cast<float>(drawn->width), low.y + static_cast<float>(drawn->height));
  ImGui::GetForegroundDrawList()->AddRect(low, high, IM_COL32(255, 160, 40, 255), 0.0f, 0, scale_);
}

}  // namespace cumulet::demo
