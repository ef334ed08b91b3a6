#include "viewer/live.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/one_line.hpp"
#include "viewer/patient_lock.hpp"

namespace cumulet::viewer {

namespace {

using volume::MemoryField;

constexpr const char* no_state = "there is no state to update";

[[noreturn]] void refuse(const std::string& name, const std::string& cause) {
  throw Error(ErrorCode::invalid_argument, one_line(name + ": " + cause));
}

bool has_tiles(const MemoryField& field) {
  const auto* sparse = std::get_if<volume::SparseVoxels>(&field.voxels);
  return sparse != nullptr && !sparse->tiles.empty();
}

}  // namespace

// Not of what is in GL.
std::vector<MemoryField> Live::Whole::view() const {
  if (const auto* held = std::get_if<std::vector<MemoryField>>(&fields)) return *held;
  std::vector<MemoryField> views;
  for (const volume::FieldCopy& copy : std::get<std::vector<volume::FieldCopy>>(fields)) views.push_back(copy.view());
  return views;
}

void Live::set(const std::vector<MemoryField>& fields, std::string name, const MakeLease& lease) {
  volume::check_fields(fields, name);
  const bool copies = !lease;
  Whole whole;
  if (copies) {
    std::vector<volume::FieldCopy> made;
    made.reserve(fields.size());
    for (const MemoryField& field : fields) made.push_back(volume::FieldCopy::of(field, name));
    whole.fields = std::move(made);
  } else {
    whole.fields = fields;
  }
  whole.name = std::move(name);
  std::vector<Handed> handed;
  for (const MemoryField& field : fields) {
    const bool dense = std::holds_alternative<volume::DenseVoxels>(field.voxels);
    const Takes takes = !copies || has_tiles(field) ? Takes::nothing : dense ? Takes::zeros : Takes::bricks;
    handed.push_back({field.channel, takes});
  }
  hand_over(std::move(whole), std::move(handed), lease);
}

void Live::set(std::vector<volume::FieldCopy> fields, std::string name) {
  std::vector<Handed> handed;
  handed.reserve(fields.size());
  for (const volume::FieldCopy& field : fields) handed.push_back({field.channel, Takes::zeros});
  hand_over({std::move(fields), std::move(name), nullptr}, std::move(handed), nullptr);
}

void Live::set(volume::DeviceBricks bricks, const glm::dmat4& index_to_world, const std::string& name) {
  bricks.tidy();
  hand_over_in_gl(std::move(bricks), index_to_world, name, nullptr);
}

void Live::update(const volume::DeviceBricks& bricks, const std::string& name) {
  const std::optional<InGl> before = in_gl();
  if (handed().empty()) refuse(name, no_state);
  if (!before) refuse(name, "the state before it is not in GL");
  hand_over_in_gl(before->bricks->with(bricks), before->index_to_world, name, before->bricks.get());
}

void Live::hand_over_in_gl(volume::DeviceBricks bricks, const glm::dmat4& index_to_world, const std::string& name,
                           const volume::DeviceBricks* on_top_of) {
  bricks.wanted = values_wanted_;
  InGl state{std::make_shared<const volume::DeviceBricks>(std::move(bricks)), index_to_world, name};
  if (!hand_over({std::move(state), name, nullptr}, {{volume::Channel::density, Takes::bricks_in_gl}}, nullptr,
                 on_top_of))
    refuse(name, "another state came between");
}

void Live::set_if_newest(const volume::DeviceBricksPtr& in_gl, std::vector<volume::FieldCopy> fields,
                         std::string name) {
  hand_over({std::move(fields), std::move(name), nullptr}, {{volume::Channel::density, Takes::zeros}}, nullptr,
            in_gl.get());
}

void Live::move_in_gl(const volume::DeviceBricksPtr& from, volume::DeviceBricksPtr to) {
  const std::scoped_lock lock(mutex_);
  if (!in_gl_ || in_gl_->bricks != from) return;
  if (to) {
    in_gl_->bricks = std::move(to);
  } else {
    in_gl_.reset();
    handed_.clear();
  }
}

std::optional<Live::InGl> Live::in_gl() const {
  const std::scoped_lock lock(mutex_);
  return in_gl_;
}

bool Live::hand_over(Whole whole, std::vector<Handed> handed, const MakeLease& lease,
                     const volume::DeviceBricks* on_top_of) {
  Next next;
  std::optional<InGl> state;
  if (const auto* there = std::get_if<InGl>(&whole.fields)) state = *there;
  next.whole = std::move(whole);
  // Last of what may fail: who is refused keeps the memory.
  if (lease) next.whole->lease = lease();
  {
    const std::scoped_lock lock(mutex_);
    if (on_top_of != nullptr && (!in_gl_ || in_gl_->bricks.get() != on_top_of)) return false;
    std::swap(next_, next);  // what nobody read ends after the lock
    std::swap(handed_, handed);
    std::swap(in_gl_, state);
    ++newest_;
  }
  listeners_.tell();
  return true;
}

std::vector<Live::Handed> Live::handed() const {
  const std::scoped_lock lock(mutex_);
  return handed_;
}

const Live::Handed& Live::updatable(const std::vector<Handed>& handed, volume::Channel channel,
                                    const std::string& name) {
  const auto there = std::ranges::find(handed, channel, &Handed::channel);
  if (there == handed.end()) refuse(name, std::string("there is no ") + name_of(channel) + " to update");
  if (there->takes == Takes::nothing)
    refuse(name, std::string(name_of(channel)) + " takes no bricks: it was handed over with tiles, or with a release");
  return *there;
}

const Live::Handed& Live::updatable_from_memory(const std::vector<Handed>& handed, volume::Channel channel,
                                                const std::string& name) {
  const Handed& there = updatable(handed, channel, name);
  if (there.takes == Takes::bricks_in_gl)
    refuse(name, std::string(name_of(channel)) + " is in GL, and takes what changes from there alone");
  return there;
}

void Live::require_updatable(const std::vector<volume::Channel>& channels,
                             const std::optional<std::vector<volume::Channel>>& comes, const std::string& name) {
  std::vector<Handed> handed;
  if (comes) {
    for (const volume::Channel channel : *comes) handed.push_back({channel, Takes::zeros});
  } else {
    handed = this->handed();
  }
  if (handed.empty()) refuse(name, no_state);
  for (const volume::Channel channel : channels) updatable(handed, channel, name);
}

void Live::update(const std::vector<MemoryField>& fields, const std::string& name) {
  for (const MemoryField& field : fields) {
    if (!std::holds_alternative<volume::SparseVoxels>(field.voxels))
      refuse(name, std::string(name_of(field.channel)) + " is dense: an update has bricks");
  }
  volume::check_update(fields, name);
  const std::vector<Handed> handed = this->handed();
  if (handed.empty()) refuse(name, no_state);
  volume::Changes changes;
  for (const MemoryField& field : fields) {
    const Handed& there = updatable_from_memory(handed, field.channel, name);
    volume::require_finite(field, name);
    const auto& sparse = std::get<volume::SparseVoxels>(field.voxels);
    changes.fields.push_back({field.channel, volume::BrickCopy(sparse, there.takes == Takes::zeros)});
  }
  hand_over(std::move(changes), handed, name);
}

void Live::update(volume::Changes changes, const std::string& name) {
  const std::vector<Handed> handed = this->handed();
  if (handed.empty()) refuse(name, no_state);
  for (const volume::Changes::Bricks& field : changes.fields) updatable_from_memory(handed, field.channel, name);
  hand_over(std::move(changes), handed, name);
}

void Live::hand_over(volume::Changes changes, const std::vector<Handed>& handed, const std::string& name) {
  {
    const std::scoped_lock lock(mutex_);
    if (handed != handed_) refuse(name, "another state came between");
    next_.changes.put(std::move(changes));
    ++newest_;
  }
  listeners_.tell();
}

void Live::refuse_updates() {
  const std::scoped_lock lock(mutex_);
  handed_.clear();
}

void Live::take_next(std::optional<Whole>& old) {
  Next next;
  {
    const std::scoped_lock lock(mutex_);
    next = std::exchange(next_, {});
    base_number_ = newest_;
  }
  if (next.whole) old = std::exchange(base_, std::move(next.whole));
  if (!base_) return;
  auto* copies = std::get_if<std::vector<volume::FieldCopy>>(&base_->fields);
  if (copies == nullptr) return;  // in GL, or held: none are handed over on top of that
  for (const volume::Changes::Bricks& change : next.changes.fields) {
    const auto field = std::ranges::find(*copies, change.channel, &volume::FieldCopy::channel);
    field->put(change.bricks);
  }
}

void Live::refuse_base(std::optional<Whole>& old) {
  old = std::exchange(base_, std::nullopt);
  Next next;
  const std::scoped_lock lock(mutex_);
  // Updates that came meanwhile are of what was refused.
  if (next_.whole) return;
  std::swap(next_, next);
  handed_.clear();
  in_gl_.reset();
  base_number_ = newest_;
}

volume::VolumeFrame Live::read_base(Progress& progress) const {
  if (const auto* there = std::get_if<InGl>(&base_->fields))
    return {.density = volume::volume_on_device(there->bricks, base_->name, there->index_to_world)};
  const std::vector<MemoryField> fields = base_->view();
  if (base_->lease) {
    for (const MemoryField& field : fields) volume::require_finite(field, base_->name);
  }
  return volume::import_fields(fields, base_->name, {}, &progress);
}

Live::State Live::read(Progress& progress) {
  progress.begin(Progress::Stage::loading);
  // What is held goes back after the lock: the host is called then.
  std::optional<Whole> before;
  std::optional<Whole> after;
  const auto lock = patient_lock(reading_, progress);
  try {
    if (newest_ != base_number_) take_next(before);
    if (!base_ || base_number_ == state_.number) return state_;
    state_.volume = std::make_shared<const VolumeAsset>(read_base(progress), &progress);
    state_.number = base_number_;
  } catch (const Error& error) {
    if (error.code() != ErrorCode::cancelled) refuse_base(after);
    throw;
  } catch (...) {
    refuse_base(after);  // an update may be in it by half
    throw;
  }
  // What is held goes back, and what is copied is what the next may change.
  if (base_->lease) after = std::exchange(base_, std::nullopt);
  return state_;
}

}  // namespace cumulet::viewer
