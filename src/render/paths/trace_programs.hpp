#pragma once

#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "gl/programs.hpp"
#include "render/pacing/pace.hpp"

namespace cumulet::render {

/// A program, and the cost estimates of its dispatches.
struct TraceProgram {
  const gl::Program* object = nullptr;
  std::shared_ptr<RoundCost> cost = std::make_shared<RoundCost>();
  /// for rays beyond feature_rays, when most pixels are done
  std::shared_ptr<RoundCost> settled_cost = std::make_shared<RoundCost>();
};

/// The programs that trace pictures. All calls need a current context and an active StateGuard.
class TracePrograms {
 public:
  explicit TracePrograms(gl::ProgramsPtr programs) : programs_(std::move(programs)) {}

  /// Returns the program. Waits until it is linked, except within asked(). Throws if it does not build.
  const TraceProgram& get(gl::ProgramKey key);
  /// Runs `find`, which calls get(), in a mode that requests programs without waiting. Returns whether all are linked.
  /// If the driver does not compile in parallel, returns true without a request. Throws if a program does not build.
  template <class Find>
  bool asked(Find&& find) {
    if (!programs_->parallel()) return true;
    asked_ = true;
    try {
      find();
    } catch (...) {
      asked_.reset();
      throw;
    }
    return *std::exchange(asked_, std::nullopt);
  }

 private:
  gl::ProgramsPtr programs_;
  std::optional<bool> asked_;                    // in asked(): whether all programs so far are linked
  std::map<gl::ProgramKey, TraceProgram> used_;  // programs that were used, with their cost
};

}  // namespace cumulet::render
