// The interface of all checkers of a world: the hosts and the middleware report events to it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sim/call_check.hpp"
#include "sim/delivery_check.hpp"
#include "sim/ledger.hpp"
#include "sim/wire_check.hpp"

namespace connect_bridge::sim {

// Gets what drives a robot, and what the audit log says of it.
class DrivingListener {
 public:
  virtual void on_command(const Host& host, ByteView message) = 0;
  virtual void on_audit(const Audit& line) = 0;

 protected:
  ~DrivingListener() = default;
};

class Checker {
 public:
  Checker(const Schedule& schedule, const Middleware& middleware, Network& network, bool overlaps)
      : ledger_(schedule, middleware),
        deliveries_(ledger_, overlaps),
        wire_(ledger_, network),
        calls_(ledger_) {}

  Ledger& ledger() { return ledger_; }
  [[nodiscard]] const Ledger& ledger() const { return ledger_; }
  [[nodiscard]] const DeliveryCheck& deliveries() const { return deliveries_; }
  [[nodiscard]] const WireCheck& wire() const { return wire_; }
  CallCheck& calls() { return calls_; }
  void set_driving(DrivingListener& driving) { driving_ = &driving; }

  // ---- what hosts report
  void on_start(const Host& host);
  void on_end(const Host& host);
  void on_policy(const Host& host);
  void after_input(const Host& host);
  void on_taken(const Host& host, const Reader& reader, const Writer& writer, const Sample& sample);
  void on_connection(const Host& host, ConnectionId id) { wire_.on_connection(host, id); }
  void on_disconnected(const Host& host, ConnectionId id) { wire_.on_disconnected(host, id); }
  void on_sent(const Host& host, ConnectionId id, const FlatPacket& packet) {
    wire_.on_sent(host, id, packet);
  }
  void on_received(const Host& host, ConnectionId id, bool text, ByteView packet) {
    wire_.on_received(host, id, text, packet);
  }
  void on_mirror(const Host& host, const Host::MirrorInfo& mirror);
  void on_publish(const Host& host, const Host::MirrorInfo& mirror, ByteView message) {
    if (driving_ && mirror.made.topic == kDriveTopic) driving_->on_command(host, message);
    deliveries_.on_publish(host, mirror, message);
  }
  void on_audit(const Audit& line) {
    if (driving_) driving_->on_audit(line);
  }
  void on_subscription(const Host& host, const CreateSubscription& made);
  void on_service_mirror(const Host& host, const CreateServiceMirror& made);
  void on_service_client(const Host& host, const CreateServiceClient& made);
  void on_dial(const Host& host);
  void on_close(const Host& host, const CloseConnection& action);

  // ---- what the middleware reports
  void on_delivery(const Reader& reader, const Writer& writer, const Sample& sample) {
    deliveries_.on_delivery(reader, writer, sample);
  }

  // Messages of long ago, and endpoints that the middleware has forgotten.
  void forget(TimePoint before) {
    ledger_.forget(before);
    deliveries_.forget();
  }

  // Checks a host from outside; called from time to time.
  void inspect(const Host& host);

  // Samples of a topic that a host took in its present life.
  [[nodiscard]] std::uint64_t taken(const Host& host, const std::string& topic,
                                    const std::string& type) const;
  // The codes with which hosts closed connections.
  [[nodiscard]] const std::map<CloseCode, int>& closes() const { return closes_; }

 private:
  void check_import(const Host& host, const std::string& topic, const std::string& type) const;
  void check_export(const Host& host, const std::string& topic, const std::string& type) const;
  void check_service(const Host& host, Direction direction, const std::string& service,
                     const std::string& type) const;
  void check_memory(const Host& host, const Status& status) const;
  void check_clock(const Host& host, const Status& status) const;
  void check_silence(const Host& host) const;
  [[nodiscard]] bool may_resume(const Host& host, const CreateSubscription& made) const;

  Ledger ledger_;
  DeliveryCheck deliveries_;
  WireCheck wire_;
  CallCheck calls_;
  DrivingListener* driving_ = nullptr;
  std::set<int> policy_changed_;
  std::map<int, TimePoint> policy_changed_at_;
  std::map<int, TimePoint> last_dial_;
  std::map<std::pair<int, std::pair<std::string, std::string>>, std::uint64_t> taken_;
  std::map<CloseCode, int> closes_;
};

}  // namespace connect_bridge::sim
