#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "color_ramp_edit.hpp"
#include "file_dialog.hpp"
#include "grid_picker.hpp"
#include "light_color_rows.hpp"
#include "model.hpp"
#include "outliner.hpp"
#include "question.hpp"
#include "ramp_edit.hpp"
#include "render_dialog.hpp"
#include "rows.hpp"
#include "sun_path.hpp"
#include "transform_rows.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// The user interface. Edits the model's settings and collects commands.
class Panel {
 public:
  /// Call between ImGui::NewFrame and ImGui::Render.
  void draw(Model& model, float scale, double time, std::vector<Command>& commands);

  /// Returns the part of a window of this size that shows the image.
  [[nodiscard]] static Rectangle viewport(const Model& model, double width, double height, float scale);

  void focus() { focus_ = true; }
  [[nodiscard]] FileDialog& dialog() { return dialog_; }
  [[nodiscard]] const FileDialog& dialog() const { return dialog_; }
  /// Returns true if a modal dialog is open.
  [[nodiscard]] bool dialog_open() const {
    return dialog_.is_open() || picker_.is_open() || question_.is_open() || render_dialog_.is_open();
  }
  [[nodiscard]] GridPicker& picker() { return picker_; }
  [[nodiscard]] RenderDialog& render_dialog() { return render_dialog_; }
  [[nodiscard]] Question& question() { return question_; }
  [[nodiscard]] const Question& question() const { return question_; }
  [[nodiscard]] Ui& ui() { return ui_; }
  /// Returns the last drawn text line below the image; "" if there is none.
  [[nodiscard]] const std::string& state() const { return state_; }

 private:
  void side(Model& model, std::vector<Command>& commands);
  // Draws the left edge of the panel, which can be dragged.
  void edge(Model& model);
  void inspector(Model& model, std::vector<Command>& commands);
  void render(Model& model, std::vector<Command>& commands);
  void volume(Model& model, const Item& item, std::vector<Command>& commands);
  void object(SceneVolume& volume, const Item& item, std::vector<Command>& commands);
  void name_row(std::string& name);
  void grids(Model& model, std::vector<Command>& commands);
  // Draws the up axis of a volume. other: the file of a further volume, "" for the first one.
  void up_axis(UpAxis now, const std::string& other, std::vector<Command>& commands);
  void camera(Model& model, std::vector<Command>& commands);
  /// Draws the saved cameras of the scene.
  void cameras(Model& model);
  void display(Model& model, std::vector<Command>& commands);
  void ocio(Model& model, std::vector<Command>& commands);
  void light(Model& model, std::vector<Command>& commands);
  void environment(Model& model, std::vector<Command>& commands);
  void one_model(const Model& model, SceneModel& one);
  void analytic_light(Model& model, cumulet_light_desc& analytic_light);
  void sequence(Model& model, std::vector<Command>& commands);
  /// Draws the timeline below the image: the frames, their states and the current frame.
  void timeline(Model& model, std::vector<Command>& commands);
  // Draws the first row of the timeline: buttons, frame rate, frame and legend. other: not the current frame is
  // displayed.
  void transport(Model& model, bool other, std::vector<Command>& commands);
  // Draws the medium and the ramps of a volume, in groups. index: 0 for the first one.
  void medium(Model& model, std::size_t index, std::vector<Command>& commands);
  // Draws the ramps of a volume. fields: the values of its grids.
  void ramps(Model& model, SceneVolume& volume, const Fields& fields);
  // Draws the presets of a ramp, and the buttons that copy and paste it. most: the largest value of its grid.
  void shape_ramp(Model& model, settings::RampPoints& points, std::size_t index, float most);
  // Draws a color ramp.
  void color_ramp(Model& model, SceneVolume& volume, std::size_t index, float most);
  // Draws the presets of a color ramp, and the buttons that copy and paste it.
  void choose_colors(Model& model, settings::ColorStops& stops, std::size_t index, float most);
  // Draws the animation of a model and the time in it.
  void animation(const Model& model, const ModelFile& file, std::uint32_t& number, double& time);
  // Draws the material variant of a model.
  void variant(const ModelFile& file, std::string& wanted);
  void grid(Model& model);
  void sampling(Model& model);
  void advanced_sampling(Model& model);
  void statistics(const Model& model);
  void scattering(cumulet_medium_desc& medium);
  void fire(cumulet_medium_desc& medium, const SceneVolume& volume, const Fields& fields);
  void absorption(float (&coalbedo)[3]);
  void threshold(settings::SettingInfo info, cumulet_grid_desc& grid);
  void ground(Model& model);
  /// Draws a slider that moves the sun along its path over a day. Returns true if it did.
  bool time_of_day(cumulet_sun_sky_desc& light);
  void sun_angle(const settings::SettingInfo& info, cumulet_sun_sky_desc& light);

  void loading(const Model& model, std::vector<Command>& commands);
  /// Draws the messages as toasts at the lower right of the image.
  void messages(Model& model, std::vector<Command>& commands);
  void toast(const Message& message, std::vector<Command>& commands);
  /// Draws the log of all messages.
  void log(Model& model, std::vector<Command>& commands);
  void state_line(const Model& model);
  void help(Model& model);

  Ui ui_;
  Rows rows_{ui_};
  Outliner outliner_{ui_};
  TransformRows transform_{ui_};
  LightColorRows light_color_{ui_};
  std::array<RampView, settings::ramps.size()> ramp_views_;
  std::array<ColorRampView, settings::color_ramps.size()> color_ramp_views_;
  FileDialog dialog_;
  GridPicker picker_;
  RenderDialog render_dialog_;
  Question question_;
  bool focus_ = false;
  bool help_was_closed_ = true;
  double time_ = 0.0;
  Rectangle view_;
  std::optional<Item> seen_;         // selected object in the last frame
  bool sun_moves_ = false;           // until the mouse is released
  std::optional<SunPath> sun_path_;  // nullopt: the light has not been shown yet
  std::string state_;
  std::string name_;         // while it is typed
  std::string camera_name_;  // while it is typed
  std::string path_;         // while it is typed
  std::string path_of_;
};

}  // namespace cumulet::demo
