// One publisher that publishes serialized samples.
#pragma once

#include <rcl/publisher.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "ros/entities/entity.hpp"
#include "ros/entities/shared.hpp"
#include "ros/topics/sample_check.hpp"
#include "ros/types/message_form.hpp"
#include "ros/types/type_supports.hpp"

namespace connect_bridge::ros {

// Thread: the loop's; check() may run on any thread.
class Publisher {
 public:
  explicit Publisher(Shared& shared) : shared_(shared) {}
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  // Opens the publisher. Returns the refusal; nullopt: it is open.
  std::optional<Refusal> open(const CreateMirror& create);
  // The reason not to publish these bytes; nullopt: none.
  [[nodiscard]] std::optional<std::string> check(ByteView bytes) const;
  // Publishes the bytes, without copying them here. Returns the problem; nullopt: none.
  std::optional<std::string> publish(ByteView bytes);

 private:
  Shared& shared_;
  std::string topic_;
  std::string type_name_;
  MessageType type_;
  std::unique_ptr<MessageForm> form_;  // for a type with keys
  ProxyNodes::Handle node_;            // owns the publisher
  rcl_publisher_t publisher_ = rcl_get_zero_initialized_publisher();
  bool open_ = false;
  std::optional<Gid> own_id_;  // the publisher's id, if the middleware reports it
};

// Thread: the loop's.
class TopicMirror final : public Entity {
 public:
  using Create = CreateMirror;

  TopicMirror(Shared& shared, Create create);
  // Opens the publisher. Returns the refusal; nullopt: it is open.
  std::optional<Refusal> open();
  // Publishes a sample without copying its bytes. A large sample, and the samples behind it, go
  // through `check`, which must have room for them, and return as on_checked(). A later step
  // reports a message that does not have the type, or that the middleware refuses.
  void publish(const Publish& sample, SampleCheck& check);
  // This sample must be checked beside the loop.
  [[nodiscard]] bool is_checked_beside(const Publish& sample) const {
    return checked_ > 0 || sample.payload.size() > kLargeSample;
  }
  void on_checked(const SampleCheck::Sample& sample);
  std::optional<Input> step(Batch& batch) override;

 private:
  void count(const std::optional<std::string>& problem);

  Shared& shared_;
  const Create create_;
  std::shared_ptr<Publisher> publisher_;
  std::uint64_t checked_ = 0;      // samples that are at the check
  std::uint64_t unpublished_ = 0;  // samples that are not reported yet
};

}  // namespace connect_bridge::ros
