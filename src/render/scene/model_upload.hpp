#pragma once

#include <memory>
#include <utility>

#include "render/raster/surface_raster.hpp"
#include "render/scene/model_data.hpp"

namespace cumulet::render {

/// Selects the GPU data of surfaces to make: for paths, for the surface pass, or both.
enum class ModelParts { paths, raster, both };

/// Uploads posed surfaces in steps, while the previous ones are still shown. All calls need a current context and an
/// active StateGuard.
class ModelUpload {
 public:
  /// Allocates nothing yet. last_data, last_raster: previous data, which may be null or empty; equal parts are shared.
  /// Throws Error(unsupported) if the path data exceed a limit of the driver.
  ModelUpload(const gl::FunctionsPtr& gl, gl::ProgramsPtr programs, const gl::Limits& limits, gl::WordHeap& heap,
              ModelData::Sources sources, ModelParts parts, const ModelDataPtr& last_data, RasterContents last_raster);
  /// Works until the deadline, but at least one step. Returns whether all is done. Throws Error(out_of_memory, gl,
  /// unsupported); then nothing can be taken, unless done().
  bool advance(Deadline deadline);
  /// True if all is done, or all but raster data that failed.
  [[nodiscard]] bool done() const { return paths_.done() && !raster_due_; }
  [[nodiscard]] double progress() const {
    const double raster = raster_planned_ ? raster_.progress() : 0.0;  // planned when the path data are done
    return 0.5 * (paths_.progress() + (raster_due_ ? raster : 1.0));
  }

  /// Returns the path data; null if they were not requested. Call it once after done().
  ModelDataPtr take_data() { return std::move(data_); }
  /// Returns the raster data of each source, in their order; empty if they failed. Call it once after done().
  RasterContents take_raster() { return std::move(contents_); }

 private:
  void plan_raster();

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  gl::Limits limits_;
  ModelData::Sources sources_;
  RasterContents last_raster_;
  ModelDataPtr data_;
  RasterContents contents_;
  Upload paths_;  // its steps use the members above
  Upload raster_;
  bool raster_due_;
  bool raster_planned_ = false;
};

}  // namespace cumulet::render
