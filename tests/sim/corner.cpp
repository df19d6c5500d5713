#include "sim/corner.hpp"

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

constexpr char kCornerType[] = "std_srvs/srv/Trigger";

struct Offered {
  const char* name;
  const char* type;
};
// Services that strangers offer, and that nodes here would call.
constexpr Offered kCalled[] = {
    {"/hostile/a", kCornerType},
    {"/hostile/b/c", kCornerType},
    {"/hostile/a/get_parameters", "rcl_interfaces/srv/GetParameters"},
    {"/hostile/act/_action/send_goal", "test/action/Fib_SendGoal"},
};

}  // namespace

EndpointSpec Corner::spec(int graph, const std::string& name, const std::string& type) {
  EndpointSpec spec;
  spec.graph = graph;
  spec.topic = name;
  spec.type = type;
  spec.type_hash = Services::hash_of(type);
  spec.node_namespace = "/hostile";
  spec.node_name = "corner";
  return spec;
}

void Corner::start(int graphs) {
  for (int graph = 0; graph < graphs; ++graph) {
    for (const char* name : {"/hostile/echo", "/hostile/slow", kDeafService}) {
      add_servant(graph, name);
    }
    writers_.push_back(
        middleware_.create_writer(spec(graph, "/hostile/topic", "std_msgs/msg/String")));
    for (const auto& [name, type] : kCalled) {
      const int caller = services_.create_caller(spec(graph, name, type));
      callers_.push_back(caller);
      schedule_.after(rng_.between(0ms, 500ms), [this, caller] { tick(caller); });
    }
  }
  churn();
}

void Corner::add_servant(int graph, const std::string& name) {
  servants_.push_back(services_.create_servant(spec(graph, name, kCornerType)));
}

// Servers and callers are replaced from time to time.
void Corner::churn() {
  schedule_.after(rng_.between(100ms, 2s), [this] {
    if (stopped_) return;
    const auto at = rng_.below(servants_.size());
    const EndpointSpec old = services_.servant(servants_[at]).spec;
    services_.destroy_servant(servants_[at]);
    servants_.erase(servants_.begin() + static_cast<std::ptrdiff_t>(at));
    schedule_.after(rng_.chance(500) ? 0ms : rng_.between(1ms, 400ms), [this, old] {
      if (!stopped_) add_servant(old.graph, old.topic);
    });
    int& caller = callers_[rng_.below(callers_.size())];
    const EndpointSpec leaver = services_.caller(caller).spec;
    services_.destroy_caller(caller);
    caller = services_.create_caller(leaver);
    schedule_.after(1ms, [this, id = caller] { tick(id); });
    if (servants_.empty()) add_servant(old.graph, "/hostile/echo");
    churn();
  });
}

void Corner::tick(int caller) {
  if (stopped_ || !services_.caller(caller).alive) return;
  if (services_.is_ready(caller)) {
    const auto burst = rng_.chance(700) ? 1 : rng_.between(2, 30);
    for (int i = 0; i < burst; ++i) {
      const auto size = static_cast<std::size_t>(rng_.between(32, 3000));
      const std::uint32_t number = ++calls_;
      services_.call({caller, number},
                     Payload::adopt(make_message({kStrangerLabels, number}, size, true)));
    }
  }
  schedule_.after(rng_.between(5ms, 150ms), [this, caller] { tick(caller); });
}

void Corner::on_request(const Servant& servant, RequestKey key, const Payload& payload) {
  const auto label = is_intact(payload.view()) ? read_label(payload.view()) : std::nullopt;
  coverage_.count(Judged::kStrangeRequests);
  // A stranger may return a caller's bytes as often as it likes, but not its own.
  const bool own = label && label->writer > kStrangerLabels;
  if (own && !executed_.insert({servant.id, label->writer, label->counter}).second) {
    violated("a stranger's call " + std::to_string(label->counter & 0xFFFFFFFFU) +
             " is executed twice by server " + std::to_string(servant.id) + " of " +
             servant.spec.topic);
  }
  const bool slow = servant.spec.topic == "/hostile/slow";
  if (slow && rng_.chance(400)) return;  // never
  const auto size = static_cast<std::size_t>(rng_.between(32, 3000));
  schedule_.after(slow ? rng_.between(1ms, 1s) : rng_.between(Duration{10us}, 2ms),
                  [this, id = servant.id, key, size] {
                    if (!services_.servant(id).alive) return;
                    services_.answer(id, key, Payload::adopt(make_message({1, 1}, size, true)));
                  });
}

void Corner::on_response(const Caller& caller, const Servant& servant, RequestKey key) {
  coverage_.count(Judged::kStrangeAnswers);
  if (answered_.insert({caller.id, key.number, servant.id}).second) return;
  violated("call " + std::to_string(key.number) + " of client " + std::to_string(caller.id) +
           " of " + caller.spec.topic + " is answered twice by a stranger");
}

void Corner::stop() {
  stopped_ = true;
  for (const int id : servants_) services_.destroy_servant(id);
  for (const int id : callers_) services_.destroy_caller(id);
  for (const int id : writers_) middleware_.destroy_writer(id);
}

}  // namespace connect_bridge::sim
