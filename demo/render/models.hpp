#pragma once

#include <cumulet/cumulet.h>

#include <memory>
#include <scene_file.hpp>
#include <string>
#include <vector>

namespace cumulet::demo {

using SurfacesPtr = std::shared_ptr<cumulet_surfaces>;

/// In any thread. Throws std::runtime_error with the library's cause.
[[nodiscard]] SurfacesPtr open_surfaces(const std::string& file);

/// A scene's models (SceneOptions::models) in a viewer. In the thread that has the viewer.
class Models {
 public:
  /// The files of those to be shown that were not given yet, each once. One that the viewer shows itself is best given
  /// those surfaces: they share triangles.
  [[nodiscard]] std::vector<std::string> missing(const std::vector<SceneModel>& models) const;
  /// Null: they cannot be had, and are not asked for again while a scene names them.
  void give(const std::string& file, SurfacesPtr surfaces);
  /// A file's surfaces, if they were given.
  [[nodiscard]] cumulet_surfaces* surfaces(const std::string& file) const;
  /// Shows those that were given, and forgets the files that are named no more. A model's tag is its number from 1 on.
  /// Throws std::runtime_error with the cause, in the end, where one has not the animation or variant that it is to
  /// show: it is then not there.
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
