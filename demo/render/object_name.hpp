#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <scene_file.hpp>
#include <string>

#include "instances.hpp"

namespace cumulet::demo {

/// Returns the Cryptomatte name of an object of the scene. kind, tag: as passed to cumulet_object_name_fn. It is the
/// name of the volume or model, else its file name; "ground" for the ground. All transforms of a volume share one name.
/// others: the further volumes, as shown by the viewer.
[[nodiscard]] std::string object_name(const SceneOptions& scene, const Instances& others, cumulet_object_kind kind,
                                      std::uint64_t tag);

}  // namespace cumulet::demo
