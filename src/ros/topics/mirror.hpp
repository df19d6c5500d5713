// One publisher that publishes serialized samples.
#pragma once

#include <rcl/publisher.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "ros/entities/entity.hpp"
#include "ros/entities/shared.hpp"
#include "ros/topics/large_samples.hpp"
#include "ros/types/type_supports.hpp"

namespace connect_bridge::ros {

// Thread: the loop's, but publish() any.
class Publisher {
 public:
  explicit Publisher(Shared& shared) : shared_(shared) {}
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  // Why there is no publisher, or nothing.
  std::optional<Refusal> open(const CreateMirror& create);
  // Why it was not published, or nothing. The bytes are not copied here.
  std::optional<std::string> publish(ByteView bytes);
  // From here on nothing is published.
  void end() { ended_ = true; }

 private:
  Shared& shared_;
  std::string topic_;
  std::string type_name_;
  MessageType type_;
  ProxyNodes::Handle node_;  // has the publisher
  rcl_publisher_t publisher_ = rcl_get_zero_initialized_publisher();
  bool open_ = false;
  std::optional<Gid> own_id_;  // of the publisher, where the middleware tells it
  std::atomic<bool> ended_{false};
};

// Thread: the loop's.
class Mirror final : public Entity {
 public:
  using Create = CreateMirror;

  Mirror(Shared& shared, Create create);
  // What waits to be published is not.
  ~Mirror() override;

  // Why there is no publisher, or nothing.
  std::optional<Refusal> open();
  // The bytes are not copied here. A large sample, and what comes behind it, is published beside
  // the loop: then on_published() is to be called. A message that does not have the type, or that
  // the middleware refuses, is reported with a later step.
  void publish(const Publish& sample, LargeSamples& large);
  void on_published(const std::optional<std::string>& problem);
  std::optional<Input> step(Batch& batch) override;

 private:
  Shared& shared_;
  const Create create_;
  std::shared_ptr<Publisher> publisher_;
  std::uint64_t beside_ = 0;       // samples that wait beside the loop
  std::uint64_t unpublished_ = 0;  // samples, not reported yet
};

}  // namespace connect_bridge::ros
