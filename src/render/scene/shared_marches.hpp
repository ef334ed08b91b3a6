#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "gl/objects.hpp"
#include "gl/programs.hpp"
#include "gl/word_heap.hpp"
#include "render/scene/march_data.hpp"

namespace cumulet::render {

/// The uploaded grids of the viewers of a share group, so that viewers of the same grids hold one copy in GL memory.
/// Each grid lives until its last viewer releases it. All calls need a current context of the group, unless they say
/// otherwise, and the Turn of its programs.
class SharedMarches {
 public:
  using Sources = MarchUpload::Sources;

  /// gl: a table of its own, because viewers may be destroyed earlier. programs: of the share group.
  SharedMarches(gl::FunctionsPtr gl, gl::ProgramsPtr programs) : gl_(std::move(gl)), programs_(std::move(programs)) {}
  SharedMarches(const SharedMarches&) = delete;
  SharedMarches& operator=(const SharedMarches&) = delete;
  /// Without a current context of the group the objects leak.
  ~SharedMarches();
  /// Call it if the contexts are gone, and the objects with them. Needs no context.
  void abandon() const { gl_->abandoned = true; }
  /// The functions that own the objects: heaps of viewers must use them.
  [[nodiscard]] const gl::FunctionsPtr& functions() const { return gl_; }

  // ---- complete data ----

  /// Returns data of these sources that a viewer has uploaded; null: there are none. Later commands of the current
  /// context run after the upload.
  [[nodiscard]] MarchDataPtr find(const Sources& sources, std::int64_t page_texels);
  /// Makes data available that were uploaded in the current context.
  [[nodiscard]] MarchDataPtr add(MarchData data);
  /// Call it in each frame that uses data: a viewer may be called in another context than that in which it found them.
  void use(const MarchDataPtr& data);
  /// Call it before a viewer drops data: their memory is written only after the current context's commands.
  void release(const MarchDataPtr& data);
  /// Frees data that no viewer holds. Later commands of the current context, which may write to the memory, run after
  /// the commands of other contexts that used it.
  void collect();
  /// Takes the heap and an unfinished upload of a viewer that loses its context. They are freed by the next
  /// collect(). Needs no context.
  void leave(gl::WordHeap heap, std::optional<MarchData> unfinished);

  // ---- uploads in progress ----

  /// An upload of one viewer, for which others wait. It ends with its owner.
  struct InProgress {
    Sources of;
    std::int64_t page_texels = 0;
    std::uint64_t steps = 0;  ///< increased by the owner in each of its frames
    double progress = 0.0;
  };
  using InProgressPtr = std::shared_ptr<InProgress>;
  [[nodiscard]] InProgressPtr begin(const Sources& sources, std::int64_t page_texels);
  /// A viewer's wait for the upload of another.
  struct Wait {
    std::uint64_t steps = 0;  // of the uploads, when the viewer looked last
    int frames_in_vain = 0;   // since the last step
    double progress = 0.0;
  };
  /// Returns true if another viewer is uploading these sources. False after some frames without a step of it: its host
  /// may have hidden it. Needs no context.
  [[nodiscard]] bool is_coming(const Sources& sources, std::int64_t page_texels, Wait& wait);

 private:
  struct Kept {
    MarchDataPtr data;
    gl::Fence uploaded;
    bool complete = true;
    bool shared = false;  // more than one viewer has used it
  };
  [[nodiscard]] Kept* kept(const MarchDataPtr& data);

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  std::vector<Kept> kept_;
  std::vector<gl::Fence> released_;  // after a viewer's last commands that used shared data
  std::vector<gl::WordHeap> left_;   // heaps of viewers that lost their context
  std::vector<std::weak_ptr<InProgress>> in_progress_;
};
using SharedMarchesPtr = std::shared_ptr<SharedMarches>;

}  // namespace cumulet::render
