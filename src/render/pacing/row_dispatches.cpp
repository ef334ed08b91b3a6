#include "render/pacing/row_dispatches.hpp"

#include <algorithm>
#include <utility>

#include "render/pacing/dispatch_pacer.hpp"

namespace cumulet::render {

void learn_rows(const InFlightDispatches::Completed& completed) {
  const double ms = completed.ms.value_or(completed.at_most_ms);
  if (completed.what.cost) completed.what.cost->learn(completed.what.slots, completed.ms ? ms : 0.0, ms);
}

void send_rows(InFlightDispatches& dispatches, const std::shared_ptr<RoundCost>& cost, glm::uvec2 size,
               std::uint32_t& row, std::chrono::steady_clock::time_point deadline,
               const std::function<void(glm::uvec2 rows)>& send, const std::function<void()>& collect) {
  DispatchPacer pacer(deadline);
  const auto slots = [&](std::uint32_t rows) { return double(rows) * size.x / lanes_per_slot; };
  while (row < size.y) {
    const bool anyway = pacer.must_send(dispatches);
    const double max_ms = std::clamp(pacer.left_ms(dispatches.expected_ms()), anyway ? min_ms : 0.0, pacer.max_ms());
    const auto fits = [&](std::uint32_t rows) {
      const auto ms = cost->most(slots(rows));
      return ms && *ms <= max_ms;
    };
    std::uint32_t height = 8;
    while (height < size.y && fits(2 * height)) height *= 2;
    if (!dispatches.full() && (anyway || fits(height) || !cost->most(1.0))) {
      height = std::min(height, size.y - row);
      Dispatched what;
      what.slots = slots(height);
      what.cost = cost;
      what.max_ms = cost->most(what.slots).value_or(0.0);
      dispatches.begin(InFlightDispatches::Kind::dispatch);
      send({row, row + height});
      dispatches.end(std::move(what), 0, 0);
      row += height;
      pacer.note_sent();
    } else if (!pacer.wait(dispatches)) {
      break;
    }
    collect();
  }
}

}  // namespace cumulet::render
