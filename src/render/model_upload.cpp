#include "render/model_upload.hpp"

#include "base/error.hpp"

namespace cumulet::render {

ModelUpload::ModelUpload(const gl::FunctionsPtr& gl, gl::ProgramsPtr programs, const gl::Limits& limits,
                         gl::WordHeap& heap, scene::ModelSourcePtr source, ModelParts parts, const ModelData* last_data,
                         RasterContentPtr last_raster)
    : gl_(gl),
      programs_(std::move(programs)),
      limits_(limits),
      source_(std::move(source)),
      last_raster_(std::move(last_raster)),
      paths_(gl, "uploading the surfaces"),
      raster_(gl, "uploading the surfaces of previews"),
      raster_due_(parts != ModelParts::paths) {
  if (parts != ModelParts::raster) data_ = ModelData::plan(gl_, limits_, heap, paths_, *source_, last_data);
}

bool ModelUpload::advance(Deadline deadline) {
  if (!paths_.advance(deadline)) return false;
  if (!raster_due_) return true;
  try {
    if (!content_) {
      const RasterContent::Input input{source_->raster, {source_, &source_->pose}, {source_, &source_->centres}};
      content_ = RasterContent::plan(gl_, programs_, limits_, raster_, input, last_raster_.get());
    }
    raster_due_ = !raster_.advance(deadline);
  } catch (const Error&) {
    content_.reset();
    raster_due_ = false;
    throw;
  }
  return !raster_due_;
}

}  // namespace cumulet::render
