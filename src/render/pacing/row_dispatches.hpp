#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>

#include "render/pacing/pace.hpp"

namespace cumulet::render {

/// Updates the cost estimate, if there is one, with a finished dispatch of rows.
void learn_rows(const InFlightDispatches::Completed& completed);
/// Dispatches the remaining rows, from `row` on, until all are sent or about the deadline. Each pixel costs one round.
/// Later GL commands run after them. send: receives the first row and the end of a range, and dispatches it. collect:
/// takes finished dispatches and updates the cost.
void send_rows(InFlightDispatches& dispatches, const std::shared_ptr<RoundCost>& cost, glm::uvec2 size,
               std::uint32_t& row, std::chrono::steady_clock::time_point deadline,
               const std::function<void(glm::uvec2 rows)>& send, const std::function<void()>& collect);

}  // namespace cumulet::render
