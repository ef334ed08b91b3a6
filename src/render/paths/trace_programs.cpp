#include "render/paths/trace_programs.hpp"

namespace cumulet::render {

const TraceProgram& TracePrograms::get(gl::ProgramKey key) {
  const gl::Program& made = asked_ ? programs_->ask(key) : programs_->get(key);
  if (asked_) asked_ = *asked_ && made.usable();
  TraceProgram& program = used_[std::move(key)];
  program.object = &made;
  return program;
}

}  // namespace cumulet::render
