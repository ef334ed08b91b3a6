#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "model.hpp"
#include "picture_job.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// A modal dialog for a picture that is rendered in the background.
class RenderDialog {
 public:
  /// Opens the dialog with the samples and the denoising of the scene, and the other choices of the last time.
  void open(const Model& model);
  /// Draws the dialog if it is open. Adds Action::render when the user starts the picture.
  void draw(Ui& ui, const Model& model, std::vector<Command>& commands);
  [[nodiscard]] bool is_open() const { return opening_ || open_; }
  [[nodiscard]] const PictureSettings& settings() const { return settings_; }

 private:
  void resolution(Ui& ui);
  void quality(Ui& ui);
  void format(Ui& ui);
  void layers(Ui& ui);
  void frames(Ui& ui, const Model& model);
  // Adapts the file's extension and placeholder to the other choices.
  void adapt_path();
  void close();

  bool opening_ = false;
  bool open_ = false;
  PictureSettings settings_;
  std::filesystem::path folder_;  // of the suggested file
  std::string problem_;           // of the settings when the user wanted to start
};

}  // namespace cumulet::demo
