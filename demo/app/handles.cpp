#include "handles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace cumulet::demo {
namespace {

using glm::dmat4;
using glm::dvec2;
using glm::dvec3;
using glm::dvec4;

// Pixels at scale 1.
constexpr double handle_reach = 92.0;
constexpr double grasp_tolerance = 8.0;
constexpr double mark_radius = 7.0;
constexpr float thick = 2.6f;
constexpr float thin = 1.4f;
constexpr float tip = 10.0f;

constexpr std::array all_handles = {Handle::x, Handle::y, Handle::z, Handle::yz, Handle::zx, Handle::xy, Handle::free};
constexpr std::array handle_names = {"X", "Y", "Z", "YZ", "ZX", "XY", "free"};  // indexed by Handle
constexpr ImU32 shade = IM_COL32(0, 0, 0, 110);
constexpr ImU32 chosen_color = IM_COL32(255, 176, 64, 230);
constexpr ImU32 analytic_light_color = IM_COL32(255, 238, 170, 200);
constexpr ImU32 clip_color = IM_COL32(84, 206, 222, 230);
constexpr ImU32 hot_color = IM_COL32(255, 226, 72, 255);

ImVec2 vec(const dvec2& p) { return {static_cast<float>(p.x), static_cast<float>(p.y)}; }

ImU32 faded(ImU32 color, double part) {
  const double alpha = part * static_cast<double>((color >> IM_COL32_A_SHIFT) & 0xFFU);
  return (color & ~IM_COL32_A_MASK) | static_cast<ImU32>(alpha) << IM_COL32_A_SHIFT;
}

ImU32 color_of(Handle handle) {
  constexpr std::array<ImU32, 3> colors = {IM_COL32(238, 78, 90, 255), IM_COL32(126, 204, 58, 255),
                                           IM_COL32(74, 144, 246, 255)};
  return handle == Handle::free ? IM_COL32(236, 236, 236, 235) : colors[static_cast<std::size_t>(axis_of(handle))];
}

/// Draws strokes on a wider dark stroke, so that they are visible on bright and dark images.
class Pen {
 public:
  Pen(ImDrawList& list, const Sight& sight, float scale) : list_(&list), sight_(&sight), scale_(scale) {}

  void line(const dvec2& a, const dvec2& b, ImU32 color, float width) const {
    list_->AddLine(vec(a), vec(b), faded(shade, alpha(color)), (width + 2.0f) * scale_);
    list_->AddLine(vec(a), vec(b), color, width * scale_);
  }
  void line(const dvec3& a, const dvec3& b, ImU32 color, float width) const {
    if (const auto ends = sight_->project(a, b)) line((*ends)[0], (*ends)[1], color, width);
  }
  void lines(const std::vector<dvec2>& points, bool closed, ImU32 color, float width) const {
    std::vector<ImVec2> all;
    all.reserve(points.size());
    for (const dvec2& point : points) all.push_back(vec(point));
    const ImDrawFlags flags = closed ? ImDrawFlags_Closed : ImDrawFlags_None;
    const int count = static_cast<int>(all.size());
    list_->AddPolyline(all.data(), count, faded(shade, alpha(color)), flags, (width + 2.0f) * scale_);
    list_->AddPolyline(all.data(), count, color, flags, width * scale_);
  }
  void fill(const std::vector<dvec2>& points, ImU32 color) const {
    std::vector<ImVec2> all;
    all.reserve(points.size());
    for (const dvec2& point : points) all.push_back(vec(point));
    list_->AddConvexPolyFilled(all.data(), static_cast<int>(all.size()), color);
  }
  /// Draws the end of an axis: an arrowhead or a box.
  void end(const dvec2& from, const dvec2& to, bool arrow, ImU32 color) const {
    const dvec2 along = glm::normalize(to - from) * static_cast<double>(tip * scale_);
    const dvec2 across(-0.45 * along.y, 0.45 * along.x);
    if (arrow)
      fill({to + along, to - across, to + across}, color);
    else
      fill({to - across + 0.45 * along, to - across - 0.45 * along, to + across - 0.45 * along,
            to + across + 0.45 * along},
           color);
  }
  void text(const dvec2& at, const std::string& words) const {
    const ImVec2 size = ImGui::CalcTextSize(words.c_str());
    const float margin = 5.0f * scale_;
    const ImVec2 low = vec(at);
    list_->AddRectFilled({low.x - margin, low.y - margin}, {low.x + size.x + margin, low.y + size.y + margin},
                         IM_COL32(20, 22, 26, 205), 4.0f * scale_);
    list_->AddText(low, IM_COL32(240, 240, 240, 255), words.c_str());
  }
  [[nodiscard]] float scale() const { return scale_; }
  [[nodiscard]] const Sight& sight() const { return *sight_; }

 private:
  static double alpha(ImU32 color) { return static_cast<double>((color >> IM_COL32_A_SHIFT) & 0xFFU) / 255.0; }

  ImDrawList* list_;
  const Sight* sight_;
  float scale_;
};

void draw_box(const Pen& pen, const dmat4& transform, const Box& box, ImU32 color = chosen_color) {
  const auto corner = [&](unsigned i) {
    const dvec3 at((i & 1U) != 0 ? box.most.x : box.least.x, (i & 2U) != 0 ? box.most.y : box.least.y,
                   (i & 4U) != 0 ? box.most.z : box.least.z);
    return dvec3(transform * dvec4(at, 1.0));
  };
  for (unsigned i = 0; i < 8; ++i)
    for (unsigned bit = 1; bit < 8; bit *= 2)
      if ((i & bit) == 0) pen.line(corner(i), corner(i | bit), color, thin);
}

/// Draws the outline of a light: its size and the direction of its emission.
void draw_analytic_light(const Pen& pen, const cumulet_light_desc& analytic_light, const dmat4& transform) {
  const auto at = [&](double x, double y, double z) { return dvec3(transform * dvec4(x, y, z, 1.0)); };
  const double far = handle_reach * static_cast<double>(pen.scale()) * pen.sight().pixel_at(at(0.0, 0.0, 0.0));
  const auto round = [&](double radius, double z) {
    constexpr int parts = 32;
    const auto point = [&](int i) {
      const double angle = 2.0 * std::numbers::pi * i / parts;
      return at(radius * std::cos(angle), radius * std::sin(angle), z);
    };
    for (int i = 0; i < parts; ++i) pen.line(point(i), point(i + 1), chosen_color, thin);
  };
  if (analytic_light.kind == CUMULET_LIGHT_SPOT) {
    // The cone is drawn with a constant size on the screen.
    const double half = std::min(0.5 * analytic_light.angle_degrees, 85.0) * std::numbers::pi / 180.0;
    const double radius = far * std::sin(half);
    const double depth = far * std::cos(half);
    round(radius, depth);
    for (const auto& [x, y] : {std::pair(1.0, 0.0), std::pair(-1.0, 0.0), std::pair(0.0, 1.0), std::pair(0.0, -1.0)})
      pen.line(at(0.0, 0.0, 0.0), at(radius * x, radius * y, depth), chosen_color, thin);
    return;
  }
  if (analytic_light.kind == CUMULET_LIGHT_DISK) round(0.5 * analytic_light.width, 0.0);
  if (analytic_light.kind == CUMULET_LIGHT_RECT) {
    const double x = 0.5 * analytic_light.width;
    const double y = 0.5 * analytic_light.height;
    pen.line(at(-x, -y, 0.0), at(x, -y, 0.0), chosen_color, thin);
    pen.line(at(x, -y, 0.0), at(x, y, 0.0), chosen_color, thin);
    pen.line(at(x, y, 0.0), at(-x, y, 0.0), chosen_color, thin);
    pen.line(at(-x, y, 0.0), at(-x, -y, 0.0), chosen_color, thin);
  }
  if (analytic_light.kind != CUMULET_LIGHT_POINT)
    pen.line(at(0.0, 0.0, 0.0), at(0.0, 0.0, 0.7 * far), chosen_color, thin);
}

// The clip box of the selected volume and the volume's transform; nullopt if there are no handles of it.
std::optional<std::pair<settings::ClipBox, dmat4>> clip_of(const Model& model) {
  if (!model.chosen || model.chosen->kind != Item::Kind::volume || model.tool == Tool::none) return std::nullopt;
  const auto transform = transform_of(model.scene, *model.chosen);
  if (!transform) return std::nullopt;
  const std::optional<settings::ClipBox>& box = volume_at(model.scene, model.chosen->index).clip.box;
  return box ? std::optional(std::pair(*box, *transform)) : std::nullopt;
}

// Draws the mark of each light, and the outline of the selected object.
void draw_objects(const Pen& pen, ImDrawList& list, const Model& model) {
  const float scale = pen.scale();
  for (const Item& item : items_of(model.scene)) {
    const bool is_chosen = item == model.chosen;
    const dmat4 transform = *transform_of(model.scene, item);
    if (item.kind == Item::Kind::analytic_light) {
      const auto at = pen.sight().project(pivot_of(transform, std::nullopt));
      const float radius = static_cast<float>(mark_radius) * scale;
      if (at) {
        const ImU32 color = is_chosen ? chosen_color : analytic_light_color;
        list.AddCircle(vec(*at), radius, shade, 0, (thin + 2.0f) * scale);
        list.AddCircle(vec(*at), radius, color, 0, thin * scale);
        list.AddCircleFilled(vec(*at), 0.3f * radius, color);
      }
      if (is_chosen) draw_analytic_light(pen, model.scene.analytic_lights[item.index], transform);
    } else if (is_chosen) {
      if (const auto box = box_of(model.scene, model.status.boxes, item)) draw_box(pen, transform, *box);
    }
  }
}

// Draws the outline of a clip box, and the handle of each face.
void draw_clip(const Pen& pen, ImDrawList& list, const settings::ClipBox& box, const dmat4& transform,
               const std::optional<ClipFace>& hot) {
  draw_box(pen, transform, {{box[0], box[1], box[2]}, {box[3], box[4], box[5]}}, clip_color);
  constexpr float size = 5.0f;
  for (const ClipFace& face : clip_faces) {
    const auto at = pen.sight().project(center_of(face, box, transform));
    if (!at || !can_be_dragged(face, box, transform, pen.sight())) continue;
    const float half = size * pen.scale();
    const ImVec2 middle = vec(*at);
    const ImVec2 low(middle.x - half, middle.y - half);
    const ImVec2 high(middle.x + half, middle.y + half);
    list.AddRectFilled(low, high, face == hot ? hot_color : clip_color);
    list.AddRect(low, high, shade);
  }
}

void draw_handle(const Pen& pen, const Gizmo& gizmo, Handle handle, ImU32 color) {
  const std::vector<dvec2> shape = shape_of(gizmo, handle, pen.sight());
  if (shape.empty()) return;
  const bool closed = is_closed(gizmo, handle);
  const bool turns = gizmo.tool == Tool::rotate;
  if (closed && !turns) pen.fill(shape, faded(color, handle == Handle::free ? 0.6 : 0.4));
  pen.lines(shape, closed, color, is_axis(handle) ? thick : thin);
  if (is_axis(handle) && !turns) pen.end(shape[0], shape[1], gizmo.tool == Tool::move, color);
}

std::optional<Gizmo> gizmo_of(const Model& model, float scale) {
  if (!model.chosen || model.tool == Tool::none) return std::nullopt;
  const auto transform = transform_of(model.scene, *model.chosen);
  if (!transform) return std::nullopt;
  const glm::dvec3 pivot = pivot_of(*transform, box_of(model.scene, model.status.boxes, *model.chosen));
  return gizmo_of(model.tool, model.axes, *transform, pivot, handle_reach * static_cast<double>(scale));
}

}  // namespace

bool Handles::press(const Model& model, const Sight& sight, const dvec2& pixel, float scale) {
  if (const auto clip = clip_of(model)) {
    const auto& [box, transform] = *clip;
    const auto face = clip_face_at(box, transform, sight, pixel, grasp_tolerance * static_cast<double>(scale));
    if (face) {
      held_face_.emplace(HeldFace{ClipDrag(*face, box, transform, sight, pixel), *model.chosen,
                                  volume_at(model.scene, model.chosen->index).clip, pixel});
      return true;
    }
  }
  const auto gizmo = gizmo_of(model, scale);
  if (!gizmo) return false;
  const auto handle = handle_at(*gizmo, sight, pixel, grasp_tolerance * static_cast<double>(scale));
  if (!handle) return false;
  held_.emplace(Held{Drag(*gizmo, *handle, sight, pixel), *model.chosen, model.scene,
                     *transform_of(model.scene, *model.chosen), pixel});
  return true;
}

void Handles::drag_face(Model& model, const Sight& sight, const dvec2& pixel, bool snapped) {
  if (!transform_of(model.scene, held_face_->item)) {
    held_face_.reset();
    return;
  }
  // A press without movement changes nothing.
  if (pixel == held_face_->pixel && snapped == held_face_->snapped) return;
  held_face_->pixel = pixel;
  held_face_->snapped = snapped;
  volume_at(model.scene, held_face_->item.index).clip.box = held_face_->drag.to(sight, pixel, snapped);
}

void Handles::drag(Model& model, const Sight& sight, const dvec2& pixel, bool snapped) {
  if (held_face_) return drag_face(model, sight, pixel, snapped);
  if (!held_) return;
  if (!transform_of(model.scene, held_->item)) {
    held_.reset();
    return;
  }
  // A press without movement changes nothing.
  if (pixel == held_->pixel && snapped == held_->snapped) return;
  held_->pixel = pixel;
  held_->snapped = snapped;
  set_transform(model.scene, held_->item, held_->drag.to(sight, pixel, snapped) * held_->transform);
}

void Handles::cancel(Model& model) {
  if (held_ && transform_of(model.scene, held_->item)) restore_transform(model.scene, held_->item, held_->before);
  if (held_face_ && transform_of(model.scene, held_face_->item))
    volume_at(model.scene, held_face_->item.index).clip = held_face_->before;
  release();
}

std::optional<Item> Handles::analytic_light_at(const Model& model, const Sight& sight, const dvec2& pixel,
                                               float scale) {
  if (model.tool == Tool::none) return std::nullopt;
  std::optional<Item> found;
  double least = (mark_radius + 3.0) * static_cast<double>(scale);
  for (const Item& item : items_of(model.scene)) {
    if (item.kind != Item::Kind::analytic_light) continue;
    const auto at = sight.project(pivot_of(*transform_of(model.scene, item), std::nullopt));
    if (!at || !(glm::distance(*at, pixel) <= least)) continue;
    least = glm::distance(*at, pixel);
    found = item;
  }
  return found;
}

std::optional<Rectangle> Handles::find(const std::string& label, const Model& model, const Sight& sight, float scale) {
  const auto clip = clip_of(model);
  for (const ClipFace& face : clip_faces) {
    if (!clip || label != "Handle " + name_of(face)) continue;
    const auto at = sight.project(center_of(face, clip->first, clip->second));
    return at ? std::optional(Rectangle{at->x, at->y, 0.0, 0.0}) : std::nullopt;
  }
  const auto gizmo = gizmo_of(model, scale);
  if (!gizmo) return std::nullopt;
  for (const Handle handle : all_handles) {
    if (label != std::string("Handle ") + handle_names[static_cast<std::size_t>(handle)]) continue;
    const std::vector<dvec2> shape = shape_of(*gizmo, handle, sight);
    if (shape.empty()) return std::nullopt;
    const bool turns = gizmo->tool == Tool::rotate;
    dvec2 at(0.0);
    if (turns)
      at = shape[shape.size() / 3];
    else if (is_axis(handle))
      at = glm::mix(shape[0], shape[1], 0.85);
    else
      for (const dvec2& point : shape) at += point / static_cast<double>(shape.size());
    return Rectangle{at.x, at.y, 0.0, 0.0};
  }
  return std::nullopt;
}

std::optional<ClipFace> Handles::draw_clip_of(ImDrawList& list, const Model& model, const Sight& sight,
                                              const std::optional<dvec2>& pixel, float scale) const {
  const auto clip = clip_of(model);
  if (!clip) return std::nullopt;
  const auto& [box, transform] = *clip;
  const Pen pen(list, sight, scale);
  std::optional<ClipFace> hot;
  if (held_face_)
    hot = held_face_->drag.face();
  else if (pixel && !held_)
    hot = clip_face_at(box, transform, sight, *pixel, grasp_tolerance * static_cast<double>(scale));
  draw_clip(pen, list, box, transform, hot);
  const auto at = held_face_ ? sight.project(center_of(*hot, box, transform)) : std::nullopt;
  if (at) pen.text(*at + 12.0 * static_cast<double>(scale), held_face_->drag.label());
  return hot;
}

void Handles::draw(ImDrawList& list, const Model& model, const Sight& sight, const std::optional<dvec2>& pixel,
                   float scale) const {
  if (model.tool == Tool::none) return;
  const Pen pen(list, sight, scale);
  draw_objects(pen, list, model);
  const std::optional<ClipFace> hot_face = draw_clip_of(list, model, sight, pixel, scale);
  const auto gizmo = gizmo_of(model, scale);
  if (!gizmo) return;
  std::optional<Handle> hot;
  if (held_)
    hot = held_->drag.handle();
  else if (pixel && !hot_face)
    hot = handle_at(*gizmo, sight, *pixel, grasp_tolerance * static_cast<double>(scale));
  constexpr double back = 0.3;  // opacity of the handles that are not dragged
  for (const Handle handle : all_handles)
    if (handle != hot) draw_handle(pen, *gizmo, handle, faded(color_of(handle), held_ ? back : 1.0));
  if (!hot) return;
  if (held_ && is_axis(*hot) && gizmo->tool != Tool::rotate) {
    // Draws the line along which the object moves.
    constexpr double long_way = 20.0;
    const dvec3 way = long_way * gizmo->reach * sight.pixel_at(gizmo->pivot) * gizmo->axes[axis_of(*hot)];
    pen.line(gizmo->pivot - way, gizmo->pivot + way, faded(color_of(*hot), 0.6), 1.0f);
  }
  draw_handle(pen, *gizmo, *hot, hot_color);
  const auto pivot = sight.project(gizmo->pivot);
  if (held_ && pivot) pen.text(*pivot + dvec2(0.3, 0.35) * gizmo->reach, held_->drag.label());
}

}  // namespace cumulet::demo
