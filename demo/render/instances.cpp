#include "instances.hpp"

#include <algorithm>
#include <cstddef>
#include <settings.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "default_medium.hpp"
#include "library_call.hpp"

namespace cumulet::demo {
namespace {

bool same_instance(const cumulet_instance_desc& a, const cumulet_instance_desc& b) {
  const auto same = [](const double(&one)[16], const double(&other)[16]) { return std::ranges::equal(one, other); };
  return same(a.to_world, b.to_world) && same(a.open_to_world, b.open_to_world) &&
         same(a.close_to_world, b.close_to_world) && a.hidden == b.hidden && a.tag == b.tag;
}

}  // namespace

cumulet_medium_desc medium_of(const SceneVolume& scene, const OpenVolume& open) {
  cumulet_medium_desc medium = scene.medium;
  if (!scene.auto_density_scale || medium.density_scale > 0.0) return medium;
  const bool keeps = open.look.content == Content::smoke && scene.albedo_given;
  if (open.look.content != Content::cloud && !keeps && is_unsaid(medium)) return open.look.medium;
  medium.density_scale = open.density_scale;
  return medium;
}

OpenVolume look_into(std::shared_ptr<cumulet_volume> volume, const VolumeFile& file) {
  OpenVolume open{std::move(volume), std::nullopt, 0.0, {}};
  SceneVolume plain;
  static_cast<VolumeFile&>(plain) = file;
  open.look = default_medium(open.volume.get(), plain);
  if (cumulet_volume_suggest_density_scale(open.volume.get(), &open.density_scale) != CUMULET_OK)
    open.density_scale = 0.0;
  return open;
}

OpenVolume open_volume(const VolumeFile& file, cumulet_log_fn log, void* log_user,
                       const std::function<void(const cumulet_volume&)>& see) {
  if (auto row = FrameRow::of_name(file.volume)) {
    if (const std::string line = row->pattern().passed_over(); log != nullptr && !line.empty())
      log(log_user, CUMULET_LOG_WARNING, line.c_str());
    std::string failure;
    for (const std::string& name : by_size(row->files())) {
      VolumeFile frame = file;
      frame.volume = name;
      try {
        OpenVolume open = open_volume(frame, nullptr, nullptr, see);
        open.volume.reset();
        open.row = std::move(row);
        return open;
      } catch (const std::runtime_error& error) {
        if (failure.empty()) failure = error.what();
      }
    }
    throw std::runtime_error(failure);
  }
  cumulet_volume_file_desc desc = volume_file(file);
  desc.log = log;
  desc.log_user = log_user;
  cumulet_volume* opened = nullptr;
  check_call(cumulet_volume_open_file(&desc, &opened, nullptr, 0));
  const std::shared_ptr<cumulet_volume> volume(opened, cumulet_volume_release);
  if (see) see(*volume);
  return look_into(volume, file);
}

std::shared_ptr<cumulet_sequence> open_sequence(const std::vector<std::string>& files,
                                                const cumulet_volume_file_desc& file, std::uint64_t memory_bytes) {
  std::vector<const char*> paths;
  paths.reserve(files.size());
  for (const std::string& name : files) paths.push_back(name.c_str());
  cumulet_sequence_desc desc{};
  desc.struct_size = sizeof desc;
  desc.paths = paths.data();
  desc.count = paths.size();
  desc.file = &file;
  desc.memory_bytes = memory_bytes;
  cumulet_sequence* made = nullptr;
  check_call(cumulet_sequence_create(&desc, &made, nullptr, 0));
  return {made, cumulet_sequence_release};
}

const Instances::Given* Instances::find(const VolumeFile& file) const {
  const auto found = std::ranges::find(given_, file, &Given::file);
  return found == given_.end() ? nullptr : &*found;
}

std::vector<VolumeFile> Instances::missing(const std::vector<SceneVolume>& volumes) const {
  std::vector<VolumeFile> files;
  for (const SceneVolume& volume : volumes) {
    const VolumeFile& file = volume;
    if (volume.is_shown() && find(file) == nullptr && std::ranges::find(files, file) == files.end())
      files.push_back(file);
  }
  return files;
}

cumulet_volume* Instances::volume(const VolumeFile& file) const {
  const Given* given = find(file);
  return given == nullptr ? nullptr : given->volume.volume.get();
}

std::optional<Instances::Indices> Instances::find_tag(std::uint64_t tag) const {
  if (tag == 0 || tag > shown_.size()) return std::nullopt;
  return shown_[static_cast<std::size_t>(tag) - 1].indices;
}

void Instances::give(const VolumeFile& file, OpenVolume volume) { given_.push_back({file, std::move(volume)}); }

std::shared_ptr<cumulet_sequence> Instances::sequence_of(const SceneVolume& scene, const FrameRow& row) {
  const auto found = std::ranges::find_if(playing_, [&](const Playing& playing) {
    return playing.file == static_cast<const VolumeFile&>(scene) && playing.as == scene.sequence;
  });
  if (found != playing_.end()) return found->sequence;
  std::shared_ptr<cumulet_sequence> sequence = open_sequence(row.files(), volume_file(scene));
  const cumulet_playback_desc playback = playback_of(scene.sequence, row);
  check_call(cumulet_sequence_set_playback(sequence.get(), &playback));
  const Moment moment = scene.sequence.frame.value_or(row.number(playback.first_frame));
  check_call(seconds_ ? cumulet_sequence_set_time(sequence.get(), *seconds_)
                      : cumulet_sequence_set_frame(sequence.get(), row.position_of(moment)));
  playing_.push_back({scene, scene.sequence, sequence});
  return sequence;
}

void Instances::go_to(double seconds) {
  if (seconds_ == seconds) return;
  seconds_ = seconds;
  for (const Playing& playing : playing_) check_call(cumulet_sequence_set_time(playing.sequence.get(), seconds));
}

void Instances::show(cumulet_viewer* viewer, const std::vector<SceneVolume>& volumes) {
  std::erase_if(given_, [&](const Given& given) {
    return std::ranges::none_of(volumes, [&](const VolumeFile& file) { return file == given.file; });
  });
  std::size_t count = 0;
  const auto update = [&](const SceneVolume& scene, const OpenVolume& open,
                          const std::shared_ptr<cumulet_sequence>& sequence, cumulet_instance_desc desc,
                          const Indices& indices) {
    desc.tag = count + 1;
    if (count == shown_.size()) {
      cumulet_instance* made = nullptr;
      check_call(cumulet_instance_create(&desc, &made, nullptr, 0), nullptr, scene.volume);
      std::shared_ptr<cumulet_instance> instance(made, cumulet_instance_release);
      check_call(cumulet_add_instance(viewer, made), viewer);
      shown_.push_back({std::move(instance), desc, open.volume, sequence, *desc.medium, {}, {}, {}, indices});
    }
    Shown& shown = shown_[count++];
    if (shown.volume != open.volume || shown.sequence != sequence || !settings::same(shown.medium, *desc.medium) ||
        !same_instance(shown.desc, desc))
      check_call(cumulet_instance_set(shown.instance.get(), &desc), nullptr, scene.volume);
    shown.desc = desc;
    shown.desc.medium = nullptr;  // `medium` points to a local variable of the caller; a copy is stored below
    shown.volume = open.volume;
    shown.sequence = sequence;
    shown.medium = *desc.medium;
    shown.indices = indices;
    for (std::size_t i = 0; i < scene.ramps.size(); ++i) {
      if (shown.ramps[i] == scene.ramps[i]) continue;
      check_call(cumulet_instance_set_ramp(shown.instance.get(), static_cast<cumulet_ramp>(i),
                                           settings::numbers_of(scene.ramps[i]), scene.ramps[i].size()),
                 nullptr, scene.volume);
      shown.ramps[i] = scene.ramps[i];
    }
    for (std::size_t i = 0; i < scene.color_ramps.size(); ++i) {
      if (shown.color_ramps[i] == scene.color_ramps[i]) continue;
      check_call(
          cumulet_instance_set_color_ramp(shown.instance.get(), static_cast<cumulet_ramp>(i),
                                          settings::numbers_of(scene.color_ramps[i]), scene.color_ramps[i].size()),
          nullptr, scene.volume);
      shown.color_ramps[i] = scene.color_ramps[i];
    }
    if (shown.clip != scene.clip) {
      const cumulet_clip_desc clip = settings::clip_desc_of(scene.clip);
      check_call(cumulet_instance_set_clip(shown.instance.get(), &clip), nullptr, scene.volume);
      shown.clip = scene.clip;
    }
  };
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    const SceneVolume& scene = volumes[i];
    const Given* given = find(scene);
    if (given == nullptr || (!given->volume.volume && !given->volume.row)) continue;
    std::shared_ptr<cumulet_sequence> sequence;
    if (given->volume.row) sequence = sequence_of(scene, *given->volume.row);
    const cumulet_medium_desc medium = medium_of(scene, given->volume);
    cumulet_instance_desc desc{};
    desc.struct_size = sizeof desc;
    desc.volume = given->volume.volume.get();
    desc.sequence = sequence.get();
    desc.medium = &medium;
    desc.hidden = scene.visible ? 0 : 1;
    set_shutter(scene.shutter, desc.to_world, desc.open_to_world, desc.close_to_world);
    if (scene.transforms.empty()) update(scene, given->volume, sequence, desc, {i, 0});
    for (std::size_t at = 0; at < scene.transforms.size(); ++at) {
      std::ranges::copy(scene.transforms[at], desc.to_world);
      set_shutter(scene.shutter, desc.to_world, desc.open_to_world, desc.close_to_world);
      update(scene, given->volume, sequence, desc, {i, at});
    }
  }
  std::erase_if(playing_, [&](const Playing& playing) {
    return std::ranges::none_of(volumes, [&](const SceneVolume& scene) {
      return playing.file == static_cast<const VolumeFile&>(scene) && playing.as == scene.sequence;
    });
  });
  while (shown_.size() > count) {
    check_call(cumulet_remove_instance(viewer, shown_.back().instance.get()), viewer);
    shown_.pop_back();
  }
}

}  // namespace cumulet::demo
