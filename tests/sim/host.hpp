// One process of the bridge in the simulated world: a Side and around it what the program has
// around it (the loop, a gateway, sockets, login, workers), all fake.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/side/side.hpp"
#include "sim/digest.hpp"
#include "sim/middleware.hpp"
#include "sim/network.hpp"
#include "sim/picture_codec.hpp"
#include "sim/rights.hpp"
#include "sim/rng.hpp"
#include "sim/schedule.hpp"
#include "sim/services.hpp"

namespace connect_bridge::sim {

// How long a login holds at most, if it ends at all.
inline constexpr Duration kLoginMax = std::chrono::milliseconds(3500);

struct HostPlan {
  int graph = 0;
  SideOptions options;           // role, rules, names, credential, limits
  Names names;                   // the same names as in options, for the checker
  bool meets_strangers = false;  // a hostile peer may be connected
  Duration start{};              // when the process starts
  Duration login_delay_max{};    // server: how long its login may think
  Duration job_delay_max{};      // how long a worker may take
  Duration graph_delay_max{};    // until a change of the graph is told
};

// The credentials that are accepted, and their identities.
using Accounts = std::map<std::string, Identity>;  // by credential

class Checker;

class Host : public Party {
 public:
  struct World {
    Schedule& schedule;
    Middleware& middleware;
    Services& services;
    Network& network;
    Checker& checker;
    const Accounts& accounts;
    Digest& digest;
    bool verbose = false;
  };
  struct MirrorInfo {
    int writer = 0;
    CreateMirror made;
  };
  struct SubscriptionInfo {
    int reader = 0;
    CreateSubscription made;
  };
  struct ServiceMirrorInfo {
    int servant = 0;
    CreateServiceMirror made;
    std::uint32_t last_request = 0;
    std::map<RequestId, RequestKey> requests;  // without an answer
  };
  struct ServiceClientInfo {
    int caller = 0;
    CreateServiceClient made;
    bool ready = false;  // as the side was told
    bool told = false;
    std::set<InvocationId> dropped;  // whose answers are told of, without their bytes
  };

  Host(int index, HostPlan plan, const World& world, Rng rng);
  ~Host() override;

  void start();
  void crash(bool peers_notice);
  void request_stop();
  // Starts again what has stopped or crashed.
  void restart();
  void set_policy(Policy policy);
  // Somebody calls the service ~/drive.
  void drive(bool take);
  // What a middleware reports sometimes: lost samples, endpoints that do not fit.
  void report_trouble();
  void network_changed();
  // Login, workers and graph are quick from now on, and logins do not expire.
  void calm();
  void set_path(int path) { path_ = path; }  // client: whom it dials

  // From the middleware.
  void on_graph_change();
  void on_sample(const Reader& reader, const Writer& writer, const Sample& sample);

  // From the services.
  void on_request(const Servant& servant, RequestKey key, const Payload& payload);
  void on_response(const Caller& caller, RequestKey key, const Payload& payload);
  void on_found(const Caller& caller);
  void on_caller_gone(const Caller& caller);

  // From the network.
  [[nodiscard]] bool listening() const override;
  ConnectionId accept() override;
  void on_open(ConnectionId id) override;
  void on_dial_failed(ConnectionId id, const std::string& reason) override;
  void on_packet(ConnectionId id, FlatPacket packet) override;
  void on_closed(ConnectionId id, std::optional<std::uint16_t> code) override;
  std::optional<FlatPacket> pull(ConnectionId id) override;

  [[nodiscard]] Now now() const;
  [[nodiscard]] bool running() const { return side_ != nullptr; }
  [[nodiscard]] bool stopped() const { return stopped_; }
  [[nodiscard]] bool meets_strangers() const { return plan_.meets_strangers; }
  [[nodiscard]] int index() const { return index_; }
  [[nodiscard]] int graph() const { return plan_.graph; }
  [[nodiscard]] const HostPlan& plan() const { return plan_; }
  [[nodiscard]] bool is_server() const { return plan_.options.role == Role::kServer; }
  [[nodiscard]] const Policy& policy() const { return plan_.options.policy; }
  [[nodiscard]] int policy_number() const { return policy_number_; }
  [[nodiscard]] Status status() const { return side_->status(now()); }
  [[nodiscard]] const std::map<MirrorId, MirrorInfo>& mirrors() const { return mirrors_; }
  [[nodiscard]] const std::map<SubscriptionId, SubscriptionInfo>& subscriptions() const {
    return subscriptions_;
  }
  [[nodiscard]] const std::map<ServiceMirrorId, ServiceMirrorInfo>& service_mirrors() const {
    return service_mirrors_;
  }
  [[nodiscard]] const std::map<ServiceClientId, ServiceClientInfo>& service_clients() const {
    return service_clients_;
  }
  // Bytes of taken samples and received packets that the side still refers to.
  [[nodiscard]] std::uint64_t held_bytes() const { return *held_bytes_; }
  [[nodiscard]] TimePoint last_packet() const { return last_packet_; }
  [[nodiscard]] TimePoint last_network_change() const { return last_network_change_; }
  [[nodiscard]] TimePoint last_open() const { return last_open_; }
  // The identities that logged in, by connection (server).
  [[nodiscard]] const Identity* identity_on(ConnectionId id) const;
  // Whether a login ends later than any did when it was made: the clock was set back meanwhile.
  [[nodiscard]] bool has_late_login() const;

 private:
  // What the network takes from a peer (OpenGate).
  struct Gate {
    std::size_t packet_bytes_max = 4096;
    std::uint64_t bytes_max = 16384;
    std::uint64_t bytes = 0;
  };
  void input(Input input);
  // The first of the packets that have come on this connection.
  void arrive(ConnectionId id);
  void read(ConnectionId id);
  void take_turns();
  void plan_turn(Duration delay);
  // What a step takes of the loop.
  Duration cost();
  void drain();
  void block(Duration how_long);
  void pump();
  void plan_deadline();
  void later(Duration delay, std::function<Input()> make);

  void act(const CreateSubscription& action);
  void act(const DestroySubscription& action);
  void act(const CreateMirror& action);
  void act(const DestroyMirror& action);
  void act(const Publish& action);
  void act(const CreateServiceMirror& action);
  void act(const DestroyServiceMirror& action);
  void act(const SendResponse& action);
  void act(const DropRequest& action);
  void act(const CreateServiceClient& action);
  void act(const DestroyServiceClient& action);
  void act(const SendRequest& action);
  void act(const DropInvocation& action);
  void act(const FollowClock& action);
  void act(const RefreshGraph& action);
  void act(const Dial& action);
  void act(const OpenGate& action);
  void act(const CloseConnection& action);
  void act(const Authenticate& action);
  void act(const CompressJob& action);
  void act(const DecompressJob& action);
  void act(const EncodePicture& action);
  void act(const DecodePicture& action);
  void act(const EndPicture& action);
  void act(const CancelJob&) {}  // a worker may have begun it: its result comes
  void act(const Log& action);
  void act(const Audit& action);
  void act(const Stopped& action);

  EndpointSpec endpoint(const std::string& topic, const std::string& type,
                        const std::string& type_hash, const Qos& qos, std::uint64_t handle,
                        const std::string& proxy = {}) const;
  Payload counted(Bytes bytes) const;
  void forget_entities();
  void tell(const std::string& what) const;  // a line of the log of a verbose run

  int index_;
  HostPlan plan_;
  World world_;
  Rng rng_;
  Rng cost_rng_;
  int path_ = -1;
  std::unique_ptr<Side> side_;
  PictureCodec pictures_;
  bool calm_ = false;
  std::uint64_t life_ = 0;  // counts starts and ends; events of an earlier life are void
  bool stopped_ = false;
  int policy_number_ = 0;  // counts the rules it has had
  bool snapshot_planned_ = false;
  bool draining_ = false, drain_planned_ = false;
  std::set<ConnectionId> ready_;  // that may have a packet, as the side has said
  std::map<ConnectionId, std::deque<FlatPacket>> unread_;  // those wait for their turns
  bool turn_planned_ = false;
  bool blocked_ = false;
  std::vector<Input> waiting_;  // while it is blocked
  std::optional<TimePoint> planned_deadline_;
  TimePoint last_deadline_{};
  int same_deadlines_ = 0;
  std::uint32_t last_connection_ = 0;
  std::map<ConnectionId, Identity> identities_;
  std::map<ConnectionId, Gate> gates_;
  std::map<MirrorId, MirrorInfo> mirrors_;
  std::map<SubscriptionId, SubscriptionInfo> subscriptions_;
  std::set<MirrorId> failed_mirrors_;
  std::map<ServiceMirrorId, ServiceMirrorInfo> service_mirrors_;
  std::map<ServiceClientId, ServiceClientInfo> service_clients_;
  std::set<ServiceMirrorId> failed_service_mirrors_;
  ServiceMirrorId drive_switch_;
  std::uint32_t drive_calls_ = 0;
  std::set<RequestId> open_drive_calls_;
  std::set<ServiceClientId> failed_service_clients_;
  std::shared_ptr<std::uint64_t> held_bytes_;
  TimePoint last_packet_{}, last_open_{}, last_network_change_{};
};

}  // namespace connect_bridge::sim
