#include "render/scene/model_upload.hpp"

#include <algorithm>

#include "base/error.hpp"

namespace cumulet::render {

ModelUpload::ModelUpload(const gl::FunctionsPtr& gl, gl::ProgramsPtr programs, const gl::Limits& limits,
                         gl::WordHeap& heap, ModelData::Sources sources, ModelParts parts,
                         const ModelDataPtr& last_data, RasterContents last_raster)
    : gl_(gl),
      programs_(std::move(programs)),
      limits_(limits),
      sources_(std::move(sources)),
      last_raster_(std::move(last_raster)),
      paths_(gl, "uploading the surfaces"),
      raster_(gl, "uploading the preview surfaces"),
      raster_due_(parts != ModelParts::paths) {
  if (parts != ModelParts::raster) data_ = ModelData::plan(gl_, limits_, heap, paths_, sources_, last_data);
}

void ModelUpload::plan_raster() {
  for (const scene::ModelSourcePtr& source : sources_) {
    const auto of = [&](const RasterContentPtr& content) { return &content->pose() == &source->pose; };
    const auto same = std::ranges::find_if(last_raster_, of);
    if (same != last_raster_.end()) {
      contents_.push_back(*same);
      continue;
    }
    const auto shares = [&](const RasterContentPtr& content) { return content->is_of(*source->scene); };
    RasterContents all = contents_;
    all.insert(all.end(), last_raster_.begin(), last_raster_.end());
    const auto like = std::ranges::find_if(all, shares);
    const RasterContent::Input input{source->raster, {source, &source->pose}, {source, &source->centres}};
    contents_.push_back(
        RasterContent::plan(gl_, programs_, limits_, raster_, input, like == all.end() ? nullptr : like->get()));
  }
}

bool ModelUpload::advance(Deadline deadline) {
  if (!paths_.advance(deadline)) return false;
  if (!raster_due_) return true;
  try {
    if (!raster_planned_) plan_raster();
    raster_planned_ = true;
    raster_due_ = !raster_.advance(deadline);
  } catch (const Error&) {
    contents_.clear();
    raster_due_ = false;
    throw;
  }
  return !raster_due_;
}

}  // namespace cumulet::render
