#pragma once

#include <memory>
#include <utility>

#include "render/model_data.hpp"
#include "render/surface_raster.hpp"

namespace cumulet::render {

/// What comes of surfaces on the GPU: for paths, and for the surface pass.
enum class ModelParts { paths, raster, both };

/// Brings posed surfaces to GL piece by piece, beside what is shown until then. All calls need the context current and
/// a StateGuard around.
class ModelUpload {
 public:
  /// What is shared with the last of each, which may be null and empty, is taken from there. Throws Error(unsupported)
  /// for what paths need; allocates nothing yet.
  ModelUpload(const gl::FunctionsPtr& gl, gl::ProgramsPtr programs, const gl::Limits& limits, gl::WordHeap& heap,
              ModelData::Sources sources, ModelParts parts, const ModelDataPtr& last_data, RasterContents last_raster);
  /// Works until the deadline, one piece at least. Returns whether all is there. Throws Error(out_of_memory, gl,
  /// unsupported): then nothing is to be had, unless done().
  bool advance(Deadline deadline);
  /// Whether all is there, or all but a raster that could not be made.
  [[nodiscard]] bool done() const { return paths_.done() && !raster_due_; }
  [[nodiscard]] double progress() const {
    const double raster = raster_planned_ ? raster_.progress() : 0.0;  // once paths have theirs
    return 0.5 * (paths_.progress() + (raster_due_ ? raster : 1.0));
  }

  /// Once it is done; null where that was not asked for.
  ModelDataPtr take_data() { return std::move(data_); }
  /// Likewise; of each source, in their order; none where it failed.
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
  Upload paths_;  // its steps use the above
  Upload raster_;
  bool raster_due_;
  bool raster_planned_ = false;
};

}  // namespace cumulet::render
