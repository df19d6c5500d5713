// One publisher that publishes serialized samples.
#pragma once

#include <rcl/publisher.h>

#include <cstdint>
#include <optional>
#include <string>

#include "ros/entities/entity.hpp"
#include "ros/entities/shared.hpp"

namespace connect_bridge::ros {

// Thread: the loop's.
class Mirror final : public Entity {
 public:
  using Create = CreateMirror;

  Mirror(Shared& shared, Create create);
  ~Mirror() override;

  // Why there is no publisher, or nothing.
  std::optional<Refusal> open();
  // The bytes are not copied here. A message that does not have the type, or that the middleware
  // refuses, is reported with the next step.
  void publish(ByteView bytes);
  std::optional<Input> step(Batch& batch) override;

 private:
  void refuse(const std::string& text);

  Shared& shared_;
  const Create create_;
  MessageType type_;
  ProxyNodes::Handle node_;  // has the publisher
  rcl_publisher_t publisher_ = rcl_get_zero_initialized_publisher();
  bool open_ = false;
  std::optional<Gid> own_id_;      // of the publisher, where the middleware gives it
  std::uint64_t unpublished_ = 0;  // samples, not reported yet
};

}  // namespace connect_bridge::ros
