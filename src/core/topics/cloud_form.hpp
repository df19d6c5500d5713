// How exact the clouds of one topic can be on one link.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

#include "core/base/time.hpp"

namespace connect_bridge {

// Decides when points must be rounded, and to which step. Clouds stay exact as long as the link
// carries five of them in a second, or half of those that are published: programs that measure in
// them must not notice the bridge. Belongs to one offer; single-threaded.
class CloudForm {
 public:
  // A cloud is published.
  void came(TimePoint now);

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

  static constexpr double kEnoughPerSecond = 5;
  static constexpr double kShareOfPublished = 0.5;
  static constexpr double kExactMargin = 1.5;
  static constexpr Duration kExactAfter = std::chrono::seconds(5);

 private:
  // Clouds per second that are enough; nothing: too few have come to know.
  [[nodiscard]] std::optional<double> enough() const;
  // The finest of the steps that fits, or the coarsest.
  [[nodiscard]] std::uint32_t fitting_step(const Facts& facts) const;

  std::optional<TimePoint> last_;
  double interval_ = 0;  // seconds between clouds, their mean
  std::uint32_t step_um_ = 0;
  std::optional<TimePoint> fits_since_;  // exact ones would, with the margin
};

}  // namespace connect_bridge
