// /diagnostics, on which this process tells of itself.
#pragma once

#include <rcl/publisher.h>

#include <optional>

#include "core/policy/interface.hpp"
#include "ros/entities/shared.hpp"

namespace connect_bridge::ros {

// Its package need not be installed: samples are serialized by the caller.
inline constexpr char kDiagnosticsType[] = "diagnostic_msgs/msg/DiagnosticArray";

// The one publisher of this process that the graph shows as anybody's, so that rules can export it:
// the operator then sees the robot's. Thread: the loop's.
class DiagnosticsTopic {
 public:
  explicit DiagnosticsTopic(Shared& shared) : shared_(shared) {}
  ~DiagnosticsTopic();
  DiagnosticsTopic(const DiagnosticsTopic&) = delete;
  DiagnosticsTopic& operator=(const DiagnosticsTopic&) = delete;

  // Once. Why there is none, or nothing.
  [[nodiscard]] std::optional<Refusal> open();
  // Whether the package of its type is not installed.
  [[nodiscard]] bool is_bare() const { return open_ && type_.introspection == nullptr; }
  // Whether somebody listens, here or (by a subscription of this process) at a peer.
  [[nodiscard]] bool wanted() const;
  // One serialized sample. Nothing happens if it is not open.
  void publish(ByteView sample);

 private:
  Shared& shared_;
  MessageType type_;
  rcl_publisher_t publisher_ = rcl_get_zero_initialized_publisher();
  bool open_ = false;
};

}  // namespace connect_bridge::ros
