#pragma once

#include <cumulet/cumulet.h>

#include <memory>
#include <scene_file.hpp>
#include <string>
#include <vector>

namespace cumulet::demo {

using SurfacesPtr = std::shared_ptr<cumulet_surfaces>;

/// Opens a file in any thread and logs its warnings. Throws std::runtime_error with the library's error text.
[[nodiscard]] SurfacesPtr open_surfaces(const std::string& file, cumulet_log_fn log, void* log_user);

/// A viewer's models (SceneOptions::models). Call from the viewer's thread.
class Models {
 public:
  /// Returns the files of visible models that have not been given yet, each once. If the viewer itself shows a file,
  /// pass those surfaces to give(): both then share triangles.
  [[nodiscard]] std::vector<std::string> missing(const std::vector<SceneModel>& models) const;
  /// Provides a file's surfaces. Null means that the file cannot be opened; it is not requested again while a scene
  /// names it.
  void give(const std::string& file, SurfacesPtr surfaces);
  /// Returns a file's surfaces, or null if they were not given.
  [[nodiscard]] cumulet_surfaces* surfaces(const std::string& file) const;
  /// Shows the given models and drops files that the scene no longer names. A model's tag is its index + 1. A model
  /// without the requested animation or variant is not shown. After the others are shown, std::runtime_error with the
  /// cause is thrown.
  void show(cumulet_viewer* viewer, const std::vector<SceneModel>& models);

 private:
  struct Given {
    std::string file;
    SurfacesPtr surfaces;
  };
  struct Shown {
    std::shared_ptr<cumulet_model> model;
    SceneModel scene;
    SurfacesPtr surfaces;
  };

  [[nodiscard]] const Given* find(const std::string& file) const;

  std::vector<Given> given_;
  std::vector<Shown> shown_;
};

}  // namespace cumulet::demo
