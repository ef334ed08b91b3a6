#include "assets/live.hpp"

#include <algorithm>

#include "assets/patient_lock.hpp"
#include "base/error.hpp"
#include "base/one_line.hpp"
#include "volume/frame_import.hpp"

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

// Must not be called for a GPU-resident state.
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

std::vector<Live::Handed> Live::handed_as_zeros(const std::vector<volume::FieldCopy>& fields) {
  std::vector<Handed> handed;
  handed.reserve(fields.size());
  for (const volume::FieldCopy& field : fields) handed.push_back({field.channel, Takes::zeros});
  return handed;
}

void Live::set(std::vector<volume::FieldCopy> fields, std::string name) {
  std::vector<Handed> handed = handed_as_zeros(fields);
  hand_over({std::move(fields), std::move(name), nullptr}, std::move(handed), nullptr);
}

void Live::set(scene::StateInGl state) { hand_over(std::move(state), std::nullopt); }

scene::StateInGl Live::with(const scene::StateInGl& newest, const std::vector<scene::StateInGl::Field>& changed,
                            const std::string& name) const {
  if (handed().empty()) refuse(name, no_state);
  scene::StateInGl state = newest;
  state.name = name;
  for (const scene::StateInGl::Field& field : changed) {
    const auto there = std::ranges::find(state.fields, field.channel, &scene::StateInGl::Field::channel);
    if (there == state.fields.end()) refuse(name, std::string("no ") + name_of(field.channel) + " to update");
    there->bricks = std::make_shared<const volume::DeviceBricks>(there->bricks->with(*field.bricks));
  }
  return state;
}

bool Live::set_if_newest(std::uint64_t in_gl, scene::StateInGl state) { return hand_over(std::move(state), in_gl); }

bool Live::hand_over(scene::StateInGl state, std::optional<std::uint64_t> on_top_of) {
  std::vector<Handed> handed;
  for (const scene::StateInGl::Field& field : state.fields) handed.push_back({field.channel, Takes::bricks_in_gl});
  std::string name = state.name;
  return hand_over({std::make_shared<const scene::StateInGl>(std::move(state)), std::move(name), nullptr},
                   std::move(handed), nullptr, on_top_of);
}

bool Live::set_if_newest(std::uint64_t in_gl, std::vector<volume::FieldCopy> fields, std::string name) {
  std::vector<Handed> handed = handed_as_zeros(fields);
  return hand_over({std::move(fields), std::move(name), nullptr}, std::move(handed), nullptr, in_gl);
}

void Live::move_in_gl(const scene::StateInGlPtr& from, scene::StateInGlPtr to) {
  const std::scoped_lock lock(mutex_);
  if (in_gl_.state != from) return;
  in_gl_.state = std::move(to);
  if (!in_gl_.state) handed_.clear();
}

Live::InGl Live::in_gl() const {
  const std::scoped_lock lock(mutex_);
  return in_gl_;
}

Live::Request Live::want(const scene::Emission& emission) {
  auto request = std::make_shared<const scene::Emission>(emission);
  {
    const std::scoped_lock lock(mutex_);
    std::erase_if(requests_, [](const auto& other) { return other.expired(); });
    requests_.push_back(request);
  }
  request_listeners_.notify();
  return request;
}

std::vector<scene::Emission> Live::wanted() const {
  std::vector<scene::Emission> wanted;
  const std::scoped_lock lock(mutex_);
  for (const auto& held : requests_) {
    const Request request = held.lock();
    if (request && std::ranges::find(wanted, *request) == wanted.end()) wanted.push_back(*request);
  }
  return wanted;
}

bool Live::hand_over(Whole whole, std::vector<Handed> handed, const MakeLease& lease,
                     std::optional<std::uint64_t> on_top_of) {
  Next next;
  InGl state;
  if (const auto* there = std::get_if<scene::StateInGlPtr>(&whole.fields)) state.state = *there;
  next.whole = std::move(whole);
  // Last step that may fail: if the state is refused, the host keeps its memory.
  if (lease) next.whole->lease = lease();
  {
    const std::scoped_lock lock(mutex_);
    if (on_top_of && (!in_gl_.state || in_gl_.number != *on_top_of)) return false;
    // If updates were refused, they are refused for this successor too.
    if (on_top_of && handed_.empty()) handed.clear();
    state.number = newest_ + 1;
    std::swap(next_, next);  // unread data is destroyed after the lock is released
    std::swap(handed_, handed);
    std::swap(in_gl_, state);
    ++newest_;
  }
  listeners_.notify();
  return true;
}

std::vector<Live::Handed> Live::handed() const {
  const std::scoped_lock lock(mutex_);
  return handed_;
}

const Live::Handed& Live::updatable(const std::vector<Handed>& handed, volume::Channel channel,
                                    const std::string& name) {
  const auto there = std::ranges::find(handed, channel, &Handed::channel);
  if (there == handed.end()) refuse(name, std::string("no ") + name_of(channel) + " to update");
  if (there->takes == Takes::nothing)
    refuse(name,
           std::string(name_of(channel)) + " does not accept bricks: it was set with tiles or with a release function");
  return *there;
}

const Live::Handed& Live::updatable_from_memory(const std::vector<Handed>& handed, volume::Channel channel,
                                                const std::string& name) {
  const Handed& there = updatable(handed, channel, name);
  if (there.takes == Takes::bricks_in_gl)
    refuse(name, std::string(name_of(channel)) + " is on the GPU and can only be updated from GL");
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
      refuse(name, std::string(name_of(field.channel)) + " is dense, but an update must consist of bricks");
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
    if (handed != handed_) refuse(name, "another state was set during the update");
    next_.changes.put(std::move(changes));
    ++newest_;
  }
  listeners_.notify();
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
  if (copies == nullptr) return;  // GPU-resident, or the host's memory: such states have no changes
  for (const volume::Changes::Bricks& change : next.changes.fields) {
    const auto field = std::ranges::find(*copies, change.channel, &volume::FieldCopy::channel);
    field->put(change.bricks);
  }
}

void Live::refuse_base(std::optional<Whole>& old) {
  old = std::exchange(base_, std::nullopt);
  Next next;
  const std::scoped_lock lock(mutex_);
  // Updates submitted meanwhile apply to the refused state.
  if (next_.whole) return;
  std::swap(next_, next);
  handed_.clear();
  in_gl_ = {};
  base_number_ = newest_;
}

VolumeAssetPtr Live::read_base(Progress& progress) {
  VolumeAssetPtr made;
  if (const auto* there = std::get_if<scene::StateInGlPtr>(&base_->fields)) {
    made = std::make_shared<const VolumeAsset>(*there, &progress, temperature_scale_);
  } else {
    const std::vector<MemoryField> fields = base_->view();
    if (base_->lease) {
      for (const MemoryField& field : fields) volume::require_finite(field, base_->name);
    }
    volume::VolumeFrame frame = volume::import_fields(fields, base_->name, {}, &progress);
    frame.temperature_scale = temperature_scale_;
    made = std::make_shared<const VolumeAsset>(std::move(frame), &progress);
  }
  constexpr double kelvin = 1.0;
  if (made->temperature_scale() == kelvin) temperature_scale_ = kelvin;
  return made;
}

Live::State Live::read(Progress& progress) {
  progress.begin(Progress::Stage::loading);
  // Leases are released after the lock, because this calls the host.
  std::optional<Whole> before;
  std::optional<Whole> after;
  const auto lock = patient_lock(reading_, progress);
  try {
    if (newest_ != base_number_) take_next(before);
    if (!base_ || base_number_ == state_.number) return state_;
    state_.volume = read_base(progress);
    state_.number = base_number_;
  } catch (const Error& error) {
    if (error.code() != ErrorCode::cancelled) refuse_base(after);
    throw;
  } catch (...) {
    refuse_base(after);  // an update may have been applied in part
    throw;
  }
  // Host memory is returned now. Copies are kept, because the next update changes them.
  if (base_->lease) after = std::exchange(base_, std::nullopt);
  return state_;
}

}  // namespace cumulet::viewer
