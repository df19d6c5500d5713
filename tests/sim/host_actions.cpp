// What a host does with the actions of its side.
#include <cstdio>
#include <utility>

#include "core/media/sample_codec.hpp"
#include "sim/checker.hpp"
#include "sim/host.hpp"

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

const char* letter_of(LogLevel level) {
  constexpr const char* kLetters[] = {"D", "I", "W", "E"};
  return kLetters[static_cast<std::size_t>(level)];
}

}  // namespace

void Host::tell(const std::string& what) const {
  if (!world_.verbose) return;
  std::printf("%9.4f side %d %s\n", seconds(world_.schedule.now()), index_, what.c_str());
}

EndpointSpec Host::endpoint(const std::string& topic, const std::string& type,
                            const std::string& type_hash, const Qos& qos, std::uint64_t handle,
                            const std::string& proxy) const {
  const std::string& node = proxy.empty() ? plan_.options.node : proxy;
  const std::size_t slash = node.rfind('/');
  EndpointSpec spec;
  spec.graph = plan_.graph;
  spec.topic = topic;
  spec.type = type;
  spec.type_hash = type_hash;
  spec.node_namespace = slash == 0 ? "/" : node.substr(0, slash);
  spec.node_name = node.substr(slash + 1);
  spec.qos = qos;
  spec.host = index_;
  spec.handle = handle;
  return spec;
}

void Host::act(const CreateSubscription& action) {
  if (action.qos.depth == 0) violated("a subscription without a depth");
  if (subscriptions_.contains(action.id)) violated("a subscription is created twice");
  if (!world_.middleware.knows_type(plan_.graph, action.type)) {
    later(rng_.between(1us, 2ms), [action]() -> Input {
      return SubscriptionFailed{action.id, "type_unknown", "the type is not installed"};
    });
    return;
  }
  const int reader = world_.middleware.create_reader(
      endpoint(action.topic, action.type, action.type_hash, action.qos, action.id.value, {}));
  subscriptions_[action.id] = SubscriptionInfo{reader, action};
  tell("subscribes to " + action.topic);
  world_.checker.on_subscription(*this, action);
}

void Host::act(const DestroySubscription& action) {
  const auto it = subscriptions_.find(action.id);
  if (it == subscriptions_.end()) return;  // it could not be created
  tell("subscribes no longer to " + it->second.made.topic);
  world_.middleware.destroy_reader(it->second.reader);
  subscriptions_.erase(it);
}

void Host::act(const CreateMirror& action) {
  if (action.qos.depth == 0) violated("a mirror without a depth");
  if (mirrors_.contains(action.id)) violated("a mirror is created twice");
  if (!world_.middleware.knows_type(plan_.graph, action.type)) {
    failed_mirrors_.insert(action.id);
    later(rng_.between(1us, 2ms), [action]() -> Input {
      return MirrorFailed{action.id, "type_unknown", "the type is not installed"};
    });
    return;
  }
  const int writer = world_.middleware.create_writer(endpoint(
      action.topic, action.type, action.type_hash, action.qos, action.id.value, action.node));
  mirrors_[action.id] = MirrorInfo{writer, action};
  tell("mirrors " + action.topic + " as publisher " + std::to_string(writer));
  world_.checker.on_mirror(*this, mirrors_[action.id]);
  const Gid gid = world_.middleware.writer(writer).gid;
  later(rng_.between(1us, 200us), [id = action.id, gid]() -> Input { return MirrorMade{id, gid}; });
}

void Host::act(const DestroyMirror& action) {
  const auto it = mirrors_.find(action.id);
  if (it == mirrors_.end()) {
    if (!failed_mirrors_.contains(action.id)) violated("a mirror that does not exist is destroyed");
    return;
  }
  tell("ends publisher " + std::to_string(it->second.writer));
  world_.middleware.destroy_writer(it->second.writer);
  mirrors_.erase(it);
}

void Host::act(const Publish& action) {
  const auto it = mirrors_.find(action.mirror);
  if (it == mirrors_.end()) {
    if (!failed_mirrors_.contains(action.mirror)) {
      violated("published on a mirror that does not exist");
    }
    return;
  }
  world_.checker.on_publish(*this, it->second, action.payload.view());
  world_.middleware.publish(it->second.writer, Payload::copy_of(action.payload.view()));
  const Duration block_max = world_.middleware.graph(plan_.graph).block_max;
  if (block_max > 0ns && rng_.chance(kBlocksPermille))
    block(rng_.between(Duration{1ms}, block_max));
}

void Host::act(const FollowClock& action) {
  tell(action.on ? "follows /clock" : "no longer follows /clock");
}

void Host::act(const RefreshGraph&) {
  on_graph_change();
}

void Host::act(const Dial& action) {
  if (path_ < 0) violated("a server dials");
  tell("dials");
  world_.checker.on_dial(*this);
  world_.network.dial(path_, action.connection);
}

void Host::act(const OpenGate& action) {
  const auto it = gates_.find(action.connection);
  if (it == gates_.end()) return;
  it->second.packet_bytes_max = action.packet_bytes_max;
  it->second.bytes_max = UINT64_MAX;
  last_open_ = world_.schedule.now();
}

void Host::act(const CloseConnection& action) {
  if (action.reason.size() > 120) violated("the reason of a close is too long");
  world_.checker.on_close(*this, action);
  tell("closes connection " + std::to_string(action.connection.value) + ": " + action.reason);
  world_.network.close(*this, action.connection, static_cast<std::uint16_t>(action.code));
}

void Host::act(const Authenticate& action) {
  std::optional<Identity> identity;
  if (action.method == "none") {
    identity = Identity{};
  } else {
    const std::string credential{action.credential.begin(), action.credential.end()};
    const auto account = world_.accounts.find(credential);
    if (account != world_.accounts.end()) identity = account->second;
  }
  if (identity && identity->expires != 0) identity->expires += now().system;
  const Duration delay = rng_.between(1us, plan_.login_delay_max + 2us);
  later(delay, [this, identity, id = action.connection]() mutable -> Input {
    if (identity && calm_) identity->expires = 0;
    if (identity && gates_.contains(id)) identities_[id] = *identity;
    return Authenticated{id, identity, identity ? "" : "unknown credential"};
  });
}

void Host::act(const CompressJob& action) {
  later(rng_.between(1us, plan_.job_delay_max + 2us), [action]() -> Input {
    auto smaller = media::encode_sample(action.raw.view(), action.how);
    if (!smaller) return JobDone{action.job, std::nullopt};
    return JobDone{action.job, Payload::adopt(std::move(*smaller))};
  });
}

void Host::act(const DecompressJob& action) {
  later(rng_.between(1us, plan_.job_delay_max + 2us), [action]() -> Input {
    auto raw = media::decode_sample(action.body.view(), action.codec, action.raw_bytes);
    if (!raw) return JobDone{action.job, std::nullopt};
    return JobDone{action.job, Payload::adopt(std::move(raw).value())};
  });
}

void Host::act(const EncodePicture& action) {
  later(rng_.between(1us, plan_.job_delay_max + 2us), [this, action]() -> Input {
    auto body = pictures_.encode(action);
    if (!body) return JobDone{action.job, std::nullopt};
    return JobDone{action.job, Payload::adopt(*std::move(body))};
  });
}

void Host::act(const DecodePicture& action) {
  later(rng_.between(1us, plan_.job_delay_max + 2us), [this, action]() -> Input {
    auto raw = pictures_.decode(action);
    if (!raw) return JobDone{action.job, std::nullopt};
    return JobDone{action.job, Payload::adopt(*std::move(raw))};
  });
}

void Host::act(const EndPicture& action) {
  pictures_.end(action.picture);
}

void Host::act(const Log& action) {
  tell(std::string(letter_of(action.level)) + " " + action.text);
}

void Host::act(const Audit& action) {
  if (action.event != AuditEvent::kRefused && !action.link) violated("a line of no link");
  world_.checker.on_audit(action);
}

void Host::act(const Stopped&) {
  if (stopped_) violated("a side stops twice");
  stopped_ = true;
  // The process ends after this input has been dealt with.
  world_.schedule.after(0ns, [this] { crash(true); });
}

}  // namespace connect_bridge::sim
