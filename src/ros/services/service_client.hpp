// One service client that sends requests of any type from bytes, and returns answers as bytes.
#pragma once

#include <rcl/client.h>

#include <chrono>
#include <cstddef>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "ros/entities/entity.hpp"
#include "ros/entities/shared.hpp"

namespace connect_bridge::ros {

// Thread: the loop's.
class ServiceClient final : public Entity {
 public:
  using Create = CreateServiceClient;
  using Failed = ServiceClientFailed;
  using Time = std::chrono::steady_clock::time_point;

  // A server counts as gone after it was not found for this time: while one of two servers comes or
  // goes, the middleware reports none for a moment.
  static constexpr Duration kLossPatience = std::chrono::milliseconds(75);

  ServiceClient(Shared& shared, Create create);
  ~ServiceClient() override;

  // Why there is no client, or nothing.
  std::optional<Refusal> open();
  std::optional<Input> step(Batch& batch) override;
  // Reports an InvocationFailed if the bytes are not a valid request. Without a server a request is
  // lost.
  void send(InvocationId invocation, ByteView bytes);
  void drop(InvocationId invocation);

  // Checks whether requests reach a server now; returns an input for the core, if that has changed.
  std::optional<ServiceReady> look_for_server(Time now);
  // Whether no server was found at the last look.
  [[nodiscard]] bool is_alone() const { return missing_since_.has_value(); }
  // Whether the core knows that there is one.
  [[nodiscard]] bool told_ready() const { return told_ready_; }

  [[nodiscard]] const std::string& service() const { return create_.service; }
  [[nodiscard]] std::size_t invocations() const { return invocations_.size(); }

 private:
  std::optional<Input> take_dropped(std::int64_t sequence);
  Input failed(InvocationId invocation, std::string reason);

  Shared& shared_;
  const Create create_;
  std::shared_ptr<ServiceType> type_;
  rcl_client_t client_ = rcl_get_zero_initialized_client();
  bool open_ = false;
  bool told_ready_ = false;
  std::optional<Time> missing_since_;
  std::unordered_map<std::int64_t, InvocationId> by_sequence_;
  std::unordered_map<InvocationId, std::int64_t> invocations_;
  std::deque<std::pair<std::int64_t, InvocationId>> dropped_;  // the newest, by sequence
};

}  // namespace connect_bridge::ros
