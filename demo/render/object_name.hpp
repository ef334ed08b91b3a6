#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <scene_file.hpp>
#include <string>

#include "instances.hpp"

namespace cumulet::demo {

/// What an object of a scene is called in mattes, of what a cumulet_object_name_fn is told of it: the name of the
/// volume or model, which all places of one share, else its file's; the ground's is "ground". others: the scene's
/// further volumes, as the viewer shows them.
[[nodiscard]] std::string object_name(const SceneOptions& scene, const Instances& others, cumulet_object_kind kind,
                                      std::uint64_t tag);

}  // namespace cumulet::demo
