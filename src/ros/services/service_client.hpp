// One service client that sends requests of any type from bytes, and returns answers as bytes.
#pragma once

#include <rcl/client.h>

#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "ros/entities/entity.hpp"
#include "ros/entities/shared.hpp"
#include "ros/services/server_sight.hpp"

namespace connect_bridge::ros {

// Thread: the loop's.
class ServiceClient final : public Entity {
 public:
  using Create = CreateServiceClient;

  ServiceClient(Shared& shared, Create create);
  ~ServiceClient() override;

  // Opens the client. Returns the refusal; nullopt: it is open.
  std::optional<Refusal> open();
  std::optional<Input> step(Batch& batch) override;
  // Sends a request. Reports an InvocationFailed if the bytes are not a valid request. Without a
  // server the request is lost.
  void send(InvocationId invocation, ByteView bytes);
  void drop(InvocationId invocation);

  // Checks whether requests reach a server now; returns an input for the core if that has changed.
  std::optional<ServiceReady> look_for_server(ServerSight::Time now);
  // The result of the last look; the core knows the value of is_ready().
  [[nodiscard]] const ServerSight& server() const { return server_; }
  [[nodiscard]] const std::string& service() const { return create_.service; }
  [[nodiscard]] std::size_t invocations() const { return sent_.size() - dropped_; }

 private:
  struct Sent {
    InvocationId invocation;
    bool dropped = false;
  };

  // Compares definitions once, for as long as the graph shows a server.
  void compare_servers(bool in_graph);
  Input failed(InvocationId invocation, std::string reason);

  Shared& shared_;
  const Create create_;
  std::shared_ptr<ServiceType> type_;
  rcl_client_t client_ = rcl_get_zero_initialized_client();
  bool open_ = false;
  ServerSight server_;
  bool compared_ = false;              // the definitions of its servers were compared
  std::map<std::int64_t, Sent> sent_;  // requests without an answer, by sequence
  std::size_t dropped_ = 0;            // number of dropped ones in sent_
};

}  // namespace connect_bridge::ros
