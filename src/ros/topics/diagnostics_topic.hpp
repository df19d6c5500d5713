// The topic /diagnostics, on which this process reports about itself.
#pragma once

#include <rcl/publisher.h>

#include <optional>

#include "core/policy/interface.hpp"
#include "ros/entities/shared.hpp"

namespace connect_bridge::ros {

// The type's package need not be installed: the caller serializes samples.
inline constexpr char kDiagnosticsType[] = "diagnostic_msgs/msg/DiagnosticArray";

// The only publisher of this process that the graph shows like anybody's. So rules can export it,
// and the operator sees the robot's diagnostics. Thread: the loop's.
class DiagnosticsTopic {
 public:
  explicit DiagnosticsTopic(Shared& shared) : shared_(shared) {}
  ~DiagnosticsTopic();
  DiagnosticsTopic(const DiagnosticsTopic&) = delete;
  DiagnosticsTopic& operator=(const DiagnosticsTopic&) = delete;

  // Opens the publisher; call it once. Returns the refusal; nullopt: it is open.
  [[nodiscard]] std::optional<Refusal> open();
  // The package of the type is not installed.
  [[nodiscard]] bool is_bare() const { return open_ && type_.introspection == nullptr; }
  // The topic has a subscriber, here or (by a subscription of this process) at a peer.
  [[nodiscard]] bool wanted() const;
  // Publishes one serialized sample. Without effect if the publisher is not open.
  void publish(ByteView sample);

 private:
  Shared& shared_;
  MessageType type_;
  rcl_publisher_t publisher_ = rcl_get_zero_initialized_publisher();
  bool open_ = false;
};

}  // namespace connect_bridge::ros
