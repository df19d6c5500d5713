// One service client that sends requests of any type from bytes, and gives answers as bytes.
#pragma once

#include <rcl/client.h>

#include <chrono>
#include <deque>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "core/ports/ports.hpp"
#include "ros/entities/ready_list.hpp"
#include "ros/node/node.hpp"
#include "ros/topics/subscription.hpp"
#include "ros/types/message_form.hpp"

namespace connect_bridge::ros {

// Thread: the loop's.
class ServiceClient {
 public:
  struct Setup {
    ServiceClientId id;
    std::string service;
    ServiceType* type = nullptr;
  };
  // kFailed: the answer to an invocation that cannot be given away as bytes, and so ends it.
  // kUnwanted: the answer to a dropped invocation, without its bytes. kInvalid: there was something
  // that nobody waits for. More may be behind these.
  enum class Taken { kNothing, kResponse, kFailed, kUnwanted, kInvalid };

  // `slot` is marked when responses wait; it stays the caller's.
  ServiceClient(Node& node, Setup setup, ReadyList::Slot* slot);
  ~ServiceClient();
  ServiceClient(const ServiceClient&) = delete;
  ServiceClient& operator=(const ServiceClient&) = delete;

  // An error text, or nothing.
  std::optional<std::string> open();

  // An error text, or nothing. The bytes may take up to `memory_max` as a message. Before
  // is_ready() a request would be lost.
  std::optional<std::string> send(InvocationId invocation, ByteView bytes, std::size_t memory_max);
  void drop(InvocationId invocation);
  // `problem` is set with kFailed, and with others where it is worth telling.
  Taken take(TakeBuffer& buffer, ResponseTaken& response, std::string& problem);

  // Whether requests reach a server now.
  [[nodiscard]] bool is_ready() const;

  [[nodiscard]] ServiceClientId id() const { return setup_.id; }
  [[nodiscard]] const std::string& service() const { return setup_.service; }
  [[nodiscard]] const std::string& type_hash() const { return setup_.type->hash; }
  [[nodiscard]] ReadyList::Slot* slot() const { return slot_; }
  [[nodiscard]] std::size_t invocations() const { return invocations_.size(); }

  // Kept by the caller: what the core was told last, and since when it is not true.
  bool told_ready = false;
  std::optional<std::chrono::steady_clock::time_point> missing_since;

 private:
  Taken take_dropped(std::int64_t sequence, ResponseTaken& response);

  Node& node_;
  const Setup setup_;
  ReadyList::Slot* const slot_;
  rcl_client_t client_ = rcl_get_zero_initialized_client();
  bool open_ = false;
  std::size_t expected_ = 0;  // responses that callbacks have told of and take() has not seen
  std::unordered_map<std::int64_t, InvocationId> by_sequence_;
  std::unordered_map<InvocationId, std::int64_t> invocations_;
  std::deque<std::pair<std::int64_t, InvocationId>> dropped_;  // the newest, by sequence
};

}  // namespace connect_bridge::ros
