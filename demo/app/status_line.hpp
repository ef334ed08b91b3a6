#pragma once

#include <optional>
#include <string>

#include "model.hpp"

namespace cumulet::demo {

/// Returns the relative noise of the samples as it is shown; nullopt if it is unknown, or measured with so few samples
/// that it says little.
[[nodiscard]] std::optional<double> shown_noise(const Status& status);

/// Returns the line about the displayed image: "42 / 256, 0:35 left, denoised   1280x720". The noise of the samples is
/// left out while the denoised image is displayed.
[[nodiscard]] std::string status_text(const Model& model);

/// Returns the file that is being loaded, or whose grid is being built; "" if that is unknown, because the scene has
/// several volumes.
[[nodiscard]] std::string file_of_work(const Model& model);

}  // namespace cumulet::demo
