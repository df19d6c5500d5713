// How exact the clouds of one topic can be on one link.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

#include "core/base/time.hpp"
#include "core/topics/exact_fit.hpp"

namespace connect_bridge {

// Decides to which step points are rounded where they cannot stay exact (ExactFit). Belongs to one
// offer; single-threaded.
class CloudForm {
 public:
  // A cloud is published.
  void came(TimePoint now) { fit_.came(now); }

  struct Facts {
    double rate = 0;             // bytes per second that the channel has; 0: not known
    bool is_shown = false;       // by its own messages, not only assumed
    double exact_bytes = 0;      // of an exact cloud on the wire
    std::uint32_t error_um = 0;  // by which a point may move
    // Bytes of a cloud with this step; nothing: none was sent yet.
    std::function<std::optional<double>(std::uint32_t step_um)> bytes_at;
  };
  // The step of the next cloud in micrometres, 0: exact.
  [[nodiscard]] std::uint32_t choose(const Facts& facts, TimePoint now);
  [[nodiscard]] std::uint32_t step_um() const { return step_um_; }
  // For people.
  [[nodiscard]] std::string_view because() const;

 private:
  // The finest of the steps that fits, or the coarsest.
  [[nodiscard]] std::uint32_t fitting_step(const Facts& facts) const;

  ExactFit fit_;
  std::uint32_t step_um_ = 0;
};

}  // namespace connect_bridge
