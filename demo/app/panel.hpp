#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "file_dialog.hpp"
#include "grid_picker.hpp"
#include "model.hpp"
#include "ramp_edit.hpp"
#include "rows.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// The user interface: changes the model's settings, and tells what else was asked for.
class Panel {
 public:
  /// Between ImGui's new frame and its render.
  void draw(Model& model, float scale, double time, std::vector<Command>& commands);

  /// The part of a window of this size that the picture has.
  [[nodiscard]] static Rectangle viewport(const Model& model, double width, double height, float scale);

  void focus() { focus_ = true; }
  [[nodiscard]] FileDialog& dialog() { return dialog_; }
  /// Whether one that stops all else is open.
  [[nodiscard]] bool dialog_open() const { return dialog_.is_open() || picker_.is_open(); }
  [[nodiscard]] GridPicker& picker() { return picker_; }
  [[nodiscard]] Ui& ui() { return ui_; }
  /// The line of text below the picture, as drawn last; "" if there is none.
  [[nodiscard]] const std::string& state() const { return state_; }

 private:
  void side(Model& model, std::vector<Command>& commands);
  void toolbar(Model& model, std::vector<Command>& commands);
  void file(Model& model, std::vector<Command>& commands);
  void camera(Model& model, std::vector<Command>& commands);
  /// Those that the scene keeps.
  void cameras(Model& model);
  void display(Model& model);
  void light(Model& model);
  void environment(Model& model, std::vector<Command>& commands);
  /// All that stands in the scene, to be chosen, and what handles do to it.
  void items(Model& model);
  void volumes(Model& model, std::vector<Command>& commands);
  /// Where a volume stands, of several places that which is chosen; number: what its controls' labels end with.
  void stand(SceneVolume& volume, std::optional<std::size_t> place, const std::string& number);
  void models(Model& model, std::vector<Command>& commands);
  // Rows of what is at `place`; another place, where they were moved.
  std::optional<std::array<double, 16>> stand_at(const std::optional<std::array<double, 16>>& place,
                                                 const std::string& number);
  void lamps(Model& model);
  void sequence(Model& model, std::vector<Command>& commands);
  /// Below the picture: the frames, which of them are ready, and where it stands.
  void timeline(Model& model, std::vector<Command>& commands);
  void medium(Model& model, std::vector<Command>& commands);
  void ramps(Model& model);
  void surfaces(Model& model);
  void variant(Model& model);
  void grid(Model& model);
  void sampling(Model& model);
  void statistics(const Model& model);
  void absorption(float (&coalbedo)[3]);
  void threshold(settings::Facts facts, cumulet_grid_desc& grid);
  void ground(Model& model);
  void sun_angle(const settings::Facts& facts, cumulet_light_desc& light);

  void hint() const;
  void loading(const Model& model, std::vector<Command>& commands);
  void messages(Model& model, std::vector<Command>& commands);
  void state_line(const Model& model);
  void help(Model& model);

  Ui ui_;
  Rows rows_{ui_};
  std::array<RampView, settings::ramps.size()> ramp_views_;
  FileDialog dialog_;
  GridPicker picker_;
  bool focus_ = false;
  bool help_was_closed_ = true;
  double time_ = 0.0;
  Rectangle view_;
  std::string state_;
  std::map<std::size_t, std::string> names_;        // of volumes, as typed
  std::map<std::size_t, std::string> model_names_;  // of models, likewise
  std::string camera_name_;                         // as typed
  std::string path_;                                // likewise
  std::string path_of_;
};

}  // namespace cumulet::demo
