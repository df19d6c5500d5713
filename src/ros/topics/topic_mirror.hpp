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

// Thread: the loop's, but check() any.
class Publisher {
 public:
  explicit Publisher(Shared& shared) : shared_(shared) {}
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  // Why there is no publisher, or nothing.
  std::optional<Refusal> open(const CreateMirror& create);
  // Why these bytes are not to be published, or nothing.
  [[nodiscard]] std::optional<std::string> check(ByteView bytes) const;
  // Why they were not published, or nothing. They are not copied here.
  std::optional<std::string> publish(ByteView bytes);

 private:
  Shared& shared_;
  std::string topic_;
  std::string type_name_;
  MessageType type_;
  std::unique_ptr<MessageForm> form_;  // of a type with keys
  ProxyNodes::Handle node_;            // has the publisher
  rcl_publisher_t publisher_ = rcl_get_zero_initialized_publisher();
  bool open_ = false;
  std::optional<Gid> own_id_;  // of the publisher, where the middleware tells it
};

// Thread: the loop's.
class TopicMirror final : public Entity {
 public:
  using Create = CreateMirror;

  TopicMirror(Shared& shared, Create create);
  // Why there is no publisher, or nothing.
  std::optional<Refusal> open();
  // The bytes are not copied here. A large sample, and what comes behind it, is checked first, and
  // comes back as on_checked(). A message that does not have the type, or that the middleware
  // refuses, is reported with a later step. `check` must have room for it, if it is checked so.
  void publish(const Publish& sample, SampleCheck& check);
  // Whether this sample is checked beside the loop.
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
  std::uint64_t checked_ = 0;      // samples that are to come back
  std::uint64_t unpublished_ = 0;  // samples, not reported yet
};

}  // namespace connect_bridge::ros
