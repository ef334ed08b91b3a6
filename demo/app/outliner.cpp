#include "outliner.hpp"

#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <utility>

#include "selection.hpp"

namespace cumulet::demo {
namespace {

constexpr float icon_width = 22.0f;
constexpr float eye_width = 24.0f;

/// Colors of the icons by kind, so that a kind is found at a glance.
constexpr ImU32 amber = IM_COL32(240, 190, 105, 255);
constexpr ImU32 blue = IM_COL32(127, 180, 230, 255);
constexpr ImU32 green = IM_COL32(140, 200, 150, 255);
constexpr ImU32 grey = IM_COL32(160, 168, 178, 255);

/// Draws icons within a square around a center.
class Icon {
 public:
  Icon(ImDrawList& list, ImVec2 center, float unit) : list_(list), center_(center), unit_(unit) {}

  void draw(const Subject& subject) const {
    if (const Item* item = std::get_if<Item>(&subject)) return draw_kind(item->kind);
    switch (std::get<Part>(subject)) {
      case Part::render:
        rectangle(-5.0f, -4.0f, 5.0f, 4.0f, grey);
        return line(-5.0f, 2.0f, 5.0f, -1.0f, grey);
      case Part::camera:
        rectangle(-5.5f, -3.5f, 2.0f, 3.5f, grey);
        return triangle({2.5f, 0.0f}, {6.0f, -3.0f}, {6.0f, 3.0f}, grey);
      case Part::sun_sky:
        circle(0.0f, 0.0f, 2.6f, amber);
        for (const ImVec2 ray : {ImVec2(1, 0), ImVec2(0, 1), ImVec2(0.7f, 0.7f), ImVec2(0.7f, -0.7f)})
          for (const float side : {-1.0f, 1.0f})
            line(side * 4.0f * ray.x, side * 4.0f * ray.y, side * 6.0f * ray.x, side * 6.0f * ray.y, amber);
        return;
      case Part::environment:
        list_.AddCircle(at(0.0f, 0.0f), 5.5f * unit_, blue, 24, unit_);
        line(-5.5f, 0.0f, 5.5f, 0.0f, blue);
        return line(0.0f, -5.5f, 0.0f, 5.5f, blue);
      case Part::ground:
        line(-6.0f, 2.5f, 6.0f, 2.5f, grey);
        line(-3.0f, 5.0f, -1.0f, 2.5f, grey);
        return line(2.0f, 5.0f, 4.0f, 2.5f, grey);
    }
  }

 private:
  void draw_kind(Item::Kind kind) const {
    switch (kind) {
      case Item::Kind::volume:
        circle(-3.0f, 1.2f, 2.8f, blue);
        circle(3.0f, 1.2f, 2.8f, blue);
        return circle(0.0f, -1.2f, 3.4f, blue);
      case Item::Kind::model:
        triangle({0.0f, -5.5f}, {5.5f, 4.0f}, {-5.5f, 4.0f}, green);
        return;
      case Item::Kind::analytic_light:
        circle(0.0f, -1.5f, 3.6f, amber);
        return rectangle(-1.5f, 2.5f, 1.5f, 5.0f, amber);
    }
  }
  [[nodiscard]] ImVec2 at(float x, float y) const { return {center_.x + x * unit_, center_.y + y * unit_}; }
  void line(float x0, float y0, float x1, float y1, ImU32 color) const {
    list_.AddLine(at(x0, y0), at(x1, y1), color, 1.2f * unit_);
  }
  void rectangle(float x0, float y0, float x1, float y1, ImU32 color) const {
    list_.AddRect(at(x0, y0), at(x1, y1), color, unit_, 0, 1.2f * unit_);
  }
  void circle(float x, float y, float radius, ImU32 color) const {
    list_.AddCircleFilled(at(x, y), radius * unit_, color, 20);
  }
  void triangle(ImVec2 a, ImVec2 b, ImVec2 c, ImU32 color) const {
    list_.AddTriangleFilled(at(a.x, a.y), at(b.x, b.y), at(c.x, c.y), color);
  }

  ImDrawList& list_;
  ImVec2 center_;
  float unit_;
};

constexpr const char* dragged_item = "item";

bool contains(const std::vector<Item>& items, const Item& item) {
  return std::ranges::find(items, item) != items.end();
}

}  // namespace

void Outliner::draw(Model& model, float max_height, bool focus, std::vector<Command>& commands) {
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {ui_.px(4.0f), ui_.px(4.0f)});
  ImGui::PushStyleColor(ImGuiCol_Header, IM_COL32(95, 143, 191, 120));
  const std::vector<Item> items = listed_items(model.scene);
  selected_ = selected_items(model);
  last_rows_ = std::exchange(rows_, {});
  constexpr std::size_t fixed_rows = 9;  // parts, groups and an empty one
  const auto rows = static_cast<float>(fixed_rows + items.size());
  const float row_height = ImGui::GetTextLineHeightWithSpacing();
  ImGui::BeginChild("outliner", {0.0f, std::min(rows * row_height, max_height)}, false, ImGuiWindowFlags_NavFlattened);
  if (focus) ImGui::SetKeyboardFocusHere();
  part(model, Part::render, "Render", "Image and sampling of the rendering, and advanced settings.");
  part(model, Part::camera, "Camera", "Lens, navigation and saved cameras.");
  part(model, Part::sun_sky, "Sun & sky", "Daylight.");
  part(model, Part::environment, "Environment", "The environment map around the scene.");
  part(model, Part::ground, "Ground", "The ground plane.");
  const auto all = [&](Item::Kind kind) {
    for (const Item& one : items)
      if (one.kind == kind) item(model, one, commands);
  };
  group("Lights", "Add light", "Adds a point light in view, above the camera's target.", Action::add_light, commands);
  all(Item::Kind::analytic_light);
  group("Volumes", "Add volume", "Adds another volume.", Action::add_volume_dialog, commands);
  all(Item::Kind::volume);
  group("Models", "Add model", "Adds another model.", Action::add_model_dialog, commands);
  all(Item::Kind::model);
  drag_box(model);
  ImGui::EndChild();
  // The order changes when all rows are drawn.
  if (const auto drop = std::exchange(drop_, std::nullopt)) static_cast<void>(reorder(model, drop->from, drop->to));
  ImGui::PopStyleColor();
  ImGui::PopStyleVar();
}

bool Outliner::row(const std::string& control, const char* tip, const std::string& text, const Subject& subject,
                   const Model& model, float room) {
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  // ImGui extends a selectable by half of the spacing on each side.
  const float gap = room > 0.0f ? ImGui::GetStyle().ItemSpacing.x : 0.0f;
  const float width = ImGui::GetContentRegionAvail().x - room - gap;
  const Item* const object = std::get_if<Item>(&subject);
  const bool selected = object != nullptr ? contains(selected_, *object) : subject_of(model) == subject;
  // A selected row keeps its color below the pointer.
  if (selected) ImGui::PushStyleColor(ImGuiCol_HeaderHovered, ImGui::GetStyleColorVec4(ImGuiCol_Header));
  const bool clicked = ImGui::Selectable(("##" + control).c_str(), selected, ImGuiSelectableFlags_AllowDoubleClick,
                                         {std::max(width, 1.0f), 0.0f});
  if (selected) ImGui::PopStyleColor();
  ui_.remember(control.c_str(), tip);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const float height = ImGui::GetTextLineHeight();
  const float indent = std::holds_alternative<Item>(subject) ? 14.0f : 2.0f;
  const float left = corner.x + ui_.px(indent);
  Icon(list, {left + ui_.px(9.0f), corner.y + 0.5f * height}, ui_.px(1.0f)).draw(subject);
  list.PushClipRect(corner, {corner.x + width, corner.y + height + ui_.px(2.0f)}, true);
  list.AddText({left + ui_.px(icon_width), corner.y}, ImGui::GetColorU32(ImGuiCol_Text), text.c_str());
  list.PopClipRect();
  return clicked;
}

void Outliner::part(Model& model, Part part, const char* label, const char* tip) {
  if (row(std::string("Scene/") + label, tip, label, part, model, 0.0f)) select(model, part);
}

void Outliner::group(const char* label, const char* control, const char* tip, Action add,
                     std::vector<Command>& commands) {
  const float width = ui_.px(eye_width);
  const float room = ImGui::GetContentRegionAvail().x - width;
  const float left = ImGui::GetCursorPosX();
  ImGui::SetCursorPosX(left + ui_.px(4.0f));
  Ui::heading(label);
  ImGui::SameLine();
  ImGui::SetCursorPosX(left + room);
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const float height = ImGui::GetTextLineHeight();
  if (ImGui::InvisibleButton((std::string("##") + control).c_str(), {width, height})) commands.push_back({add});
  const ImU32 color = ImGui::GetColorU32(ImGui::IsItemHovered() ? ImGuiCol_Text : ImGuiCol_TextDisabled);
  ui_.remember(control, tip);
  const ImVec2 middle(corner.x + 0.5f * width, corner.y + 0.5f * height);
  const float arm = ui_.px(4.5f);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  list.AddLine({middle.x - arm, middle.y}, {middle.x + arm, middle.y}, color, ui_.px(1.5f));
  list.AddLine({middle.x, middle.y - arm}, {middle.x, middle.y + arm}, color, ui_.px(1.5f));
}

void Outliner::item(Model& model, const Item& item, std::vector<Command>& commands) {
  const std::string title = title_of(model.scene, item);
  if (renamed_ == item) return name_field(model, item);
  bool* const visible = visibility_of(model.scene, item);
  const bool clicked = row("Scene/" + title, "Selects the object. Double click: rename. Right click: more.",
                           row_text(model.scene, item), item, model, visible != nullptr ? ui_.px(eye_width) : 0.0f);
  rows_.push_back({item, ImGui::GetItemRectMin().y, ImGui::GetItemRectMax().y});
  drag(item);
  if (clicked) click(model, item);
  if (ImGui::BeginPopupContextItem(title.c_str())) {
    if (!contains(selected_, item)) select(model, item);
    context_menu(item, commands);
    ImGui::EndPopup();
  }
  if (visible == nullptr) return;
  ImGui::SameLine();
  if (!eye("Eye/" + title, *visible)) return;
  *visible = !*visible;
  if (!contains(selected_, item)) return;
  for (const Item& other : selected_)
    if (bool* const one = visibility_of(model.scene, other)) *one = *visible;
}

void Outliner::click(Model& model, const Item& item) {
  const ImGuiIO& io = ImGui::GetIO();
  if (io.KeyCtrl) return toggle_selected(model, item);
  const Subject subject = subject_of(model);
  const Item* const anchor = std::get_if<Item>(&subject);
  if (io.KeyShift && anchor != nullptr) {
    std::vector<Item> range;
    bool inside = false;
    for (const Row& row : last_rows_) {
      const bool end = row.item == item || row.item == *anchor;
      if (inside || end) range.push_back(row.item);
      if (end && item != *anchor) inside = !inside;
    }
    // The anchor stays the subject, so that the next Shift+click begins there too.
    return select_items(model, std::move(range), *anchor);
  }
  select(model, item);
  if (!ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left) || name_of_object(model.scene, item) == nullptr) return;
  renamed_ = item;
  name_ = *name_of_object(model.scene, item);
}

void Outliner::drag(const Item& item) {
  const ImVec2 low = ImGui::GetItemRectMin();
  const ImVec2 high = ImGui::GetItemRectMax();
  if (ImGui::BeginDragDropSource(ImGuiDragDropFlags_SourceNoPreviewTooltip)) {
    ImGui::SetDragDropPayload(dragged_item, &item, sizeof item);
    ImGui::EndDragDropSource();
  }
  if (!ImGui::BeginDragDropTarget()) return;
  const ImGuiPayload* const payload = ImGui::AcceptDragDropPayload(
      dragged_item, ImGuiDragDropFlags_AcceptBeforeDelivery | ImGuiDragDropFlags_AcceptNoDrawDefaultRect);
  ImGui::EndDragDropTarget();
  if (payload == nullptr) return;
  Item from;
  std::memcpy(&from, payload->Data, sizeof from);
  if (from.kind != item.kind || from == item) return;
  const bool down = std::pair(from.index, from.transform_index) < std::pair(item.index, item.transform_index);
  const float y = down ? high.y : low.y;
  ImGui::GetWindowDrawList()->AddLine({low.x, y}, {high.x, y}, ImGui::GetColorU32(ImGuiCol_DragDropTarget),
                                      ui_.px(2.0f));
  if (payload->IsDelivery()) drop_ = Drop{from, item};
}

void Outliner::drag_box(Model& model) {
  const float y = ImGui::GetIO().MousePos.y;
  const bool empty = ImGui::IsWindowHovered() && !ImGui::IsAnyItemHovered();
  if (empty && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) box_ = y;
  if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) box_.reset();
  if (!box_ || !ImGui::IsMouseDragging(ImGuiMouseButton_Left)) return;
  const float top = std::min(*box_, y);
  const float bottom = std::max(*box_, y);
  const float left = ImGui::GetWindowPos().x;
  ImGui::GetWindowDrawList()->AddRect({left, top}, {left + ImGui::GetWindowWidth(), bottom},
                                      ImGui::GetColorU32(ImGuiCol_DragDropTarget), 0.0f, 0, ui_.px(1.0f));
  std::vector<Item> items;
  for (const Row& row : rows_)
    if (row.bottom > top && row.top < bottom) items.push_back(row.item);
  if (items.empty()) return;
  const Item first = items.front();
  select_items(model, std::move(items), first);
}

void Outliner::context_menu(const Item& item, std::vector<Command>& commands) {
  const auto entry = [&](const char* label, const char* keys, const char* tip, Action action) {
    if (ImGui::MenuItem(label, keys)) commands.push_back({action});
    ui_.remember((std::string("Object/") + label).c_str(), tip);
  };
  entry("Duplicate", "Ctrl+D", "Duplicates the object; both share their data.", Action::duplicate_selected);
  entry("Delete", "Del", "Removes the object from the scene.", Action::remove_selected);
  entry("Hide", "H", "Hides the object, or shows it.", Action::hide_selected);
  if (item.kind == Item::Kind::volume)
    entry("Inspect grids", "", "Shows the grids of the first volume.", Action::grids_dialog);
}

bool Outliner::eye(const std::string& control, bool visible) {
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const ImVec2 size(ui_.px(eye_width), ImGui::GetTextLineHeight());
  const bool clicked = ImGui::InvisibleButton(("##" + control).c_str(), size);
  ui_.remember(control.c_str(), "Shows or hides the object. A hidden object casts no shadow.");
  const ImVec2 middle(corner.x + 0.5f * size.x, corner.y + 0.5f * size.y);
  const ImU32 color = ImGui::GetColorU32(visible ? ImGuiCol_Text : ImGuiCol_TextDisabled, visible ? 0.85f : 0.6f);
  const float wide = ui_.px(6.5f);
  const float high = ui_.px(6.0f);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 left(middle.x - wide, middle.y);
  const ImVec2 right(middle.x + wide, middle.y);
  if (visible) list.AddBezierQuadratic(left, {middle.x, middle.y - high}, right, color, ui_.px(1.2f));
  list.AddBezierQuadratic(left, {middle.x, middle.y + high}, right, color, ui_.px(1.2f));
  if (visible) list.AddCircleFilled(middle, ui_.px(2.0f), color, 12);
  return clicked;
}

void Outliner::name_field(Model& model, const Item& item) {
  const std::string control = "Name/" + title_of(model.scene, item);
  if (!ImGui::IsAnyItemActive()) ImGui::SetKeyboardFocusHere();
  ImGui::SetNextItemWidth(-1.0f);
  const bool entered =
      ImGui::InputTextWithHint(("##" + control).c_str(), "name of the file", &name_,
                               ImGuiInputTextFlags_EnterReturnsTrue | ImGuiInputTextFlags_AutoSelectAll);
  ui_.remember(control.c_str(), "Name in the scene file. Press Enter to accept.");
  std::string* const name = name_of_object(model.scene, item);
  if (entered && name != nullptr) *name = name_;
  if (name == nullptr || ImGui::IsItemDeactivated()) renamed_.reset();
}

}  // namespace cumulet::demo
