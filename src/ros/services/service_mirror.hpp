// One service server that turns requests of any type into bytes, and bytes into responses.
#pragma once

#include <rcl/service.h>

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "ros/entities/entity.hpp"
#include "ros/entities/shared.hpp"

namespace connect_bridge::ros {

// Thread: the loop's.
class ServiceMirror final : public Entity {
 public:
  using Create = CreateServiceMirror;

  ServiceMirror(Shared& shared, Create create);
  ~ServiceMirror() override;

  // Opens the server. Returns the refusal; nullopt: it is open.
  std::optional<Refusal> open();
  std::optional<Input> step(Batch& batch) override;
  // Sends the response. Blocks up to 100 ms if the middleware has not connected the caller yet, but
  // only once for each caller until graph_changed().
  void respond(RequestId request, ByteView bytes);
  // The request gets no answer; `aborted`: the caller is told that its goal was aborted.
  void drop(RequestId request, bool aborted);
  // A server that vanishes takes its last answers along, if their callers have not read them yet.
  [[nodiscard]] Duration farewell() const override {
    return aborts_ ? std::chrono::seconds(1) : Duration::zero();
  }

  // Callers that could not be reached may be reachable now.
  void graph_changed() { unconnected_.clear(); }
  // Drops and returns the requests whose callers have left the graph, as far as the middleware
  // shows them.
  std::vector<RequestId> look_for_callers();
  // A request came from a caller that was not in the graph at the last look.
  [[nodiscard]] bool has_new_callers() const { return new_callers_; }
  // A caller that the graph has never shown may still appear: Fast DDS knows callers by their
  // readers, whose announcement may have to be repeated. The next look follows after this time.
  static constexpr auto kDoubt = std::chrono::seconds(5);
  [[nodiscard]] bool has_doubtful_callers() const { return doubtful_callers_; }

  // Logs if clients in the graph have another definition of the type; their requests may never
  // arrive here.
  void compare_clients();

  [[nodiscard]] std::size_t requests() const { return requests_.size(); }

 private:
  struct Request {
    rmw_request_id_t id{};
    std::chrono::steady_clock::time_point taken;
  };

  // The bytes of a result with the status "aborted"; empty: the type is not installed.
  [[nodiscard]] Payload aborted_result();
  // Sends the response. Returns an error text; nullopt: it was sent.
  std::optional<std::string> send(rmw_request_id_t& request, ByteView bytes);
  [[nodiscard]] Gid caller_in_graph(const rmw_request_id_t& request) const;

  Shared& shared_;
  const Create create_;
  std::shared_ptr<ServiceType> type_;
  ProxyNodes::Handle node_;  // owns the server
  rcl_service_t service_ = rcl_get_zero_initialized_service();
  bool open_ = false;
  std::uint64_t last_request_ = 0;
  std::unordered_map<RequestId, Request> requests_;
  std::unordered_set<Gid> callers_;  // in the graph at the last look
  bool new_callers_ = false;
  bool doubtful_callers_ = false;
  bool aborts_ = false;           // a caller was told that its goal was aborted
  std::vector<Gid> unconnected_;  // callers that responses do not reach yet
};

}  // namespace connect_bridge::ros
