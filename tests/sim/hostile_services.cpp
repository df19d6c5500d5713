#include "sim/hostile_services.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/base/overloaded.hpp"
#include "core/compress/compress.hpp"
#include "sim/label.hpp"

namespace connect_bridge::sim {
namespace {

// Below the smallest limit that a side of the simulation has.
constexpr std::int64_t kMessageBytesMax = 2500;
constexpr std::uint32_t kCallsEnd = 0xF0000000;

const std::vector<std::string>& names() {
  static const std::vector<std::string> kNames = {"/hostile/a",
                                                  "/hostile/a",
                                                  "/hostile/b/c",
                                                  "/hostile/a/get_parameters",
                                                  "/hostile/act/_action/send_goal",
                                                  "/hostile/act/_action/cancel_goal",
                                                  "/hostile/act/_action/get_result",
                                                  "/hostile/act/_action/feedback",
                                                  "/hostile/_action/_action/send_goal",
                                                  "/hostile/echo",
                                                  "/robot/arm/enable",
                                                  "/robot/fib/_action/send_goal",
                                                  "/robot/base/set_parameters",
                                                  "/map/get",
                                                  "/parameter_events",
                                                  "/hostile//x",
                                                  "hostile",
                                                  ""};
  return kNames;
}

const std::vector<std::string>& types() {
  static const std::vector<std::string> kTypes = {"std_srvs/srv/Trigger",
                                                  "std_srvs/srv/Trigger",
                                                  "std_srvs/srv/SetBool",
                                                  "nav_msgs/srv/GetMap",
                                                  "rcl_interfaces/srv/GetParameters",
                                                  "test/action/Fib_SendGoal",
                                                  "test/action/Fib_GetResult",
                                                  "action_msgs/srv/CancelGoal",
                                                  "std_msgs/msg/String",
                                                  "Trigger",
                                                  ""};
  return kTypes;
}

}  // namespace

void HostileServices::begin() {
  last_number_ = 1000;
  their_last_ = 0;
  theirs_.clear();
  mine_.clear();
  requests_.clear();
  owed_.clear();
}

bool HostileServices::may_send(const Requests& requests) const {
  return requests.attached || theirs_.at(requests.service).withdrawn;
}

// ---- what it hears

void HostileServices::hear(const Control& control) {
  std::visit(
      Overloaded{
          [&](const Offer& m) {
            for (const auto& channel : m.channels) {
              theirs_[channel.channel.value] = {channel.name, channel.epoch, false, 0, {}};
              their_last_ = std::max(their_last_, channel.channel.value);
            }
          },
          [&](const Withdraw& m) {
            for (const ChannelId gone : m.channels) {
              owed_.erase(gone.value);
              const auto it = theirs_.find(gone.value);
              if (it != theirs_.end()) it->second.withdrawn = true;
              for (auto& [id, mine] : mine_)
                if (mine.requests == gone.value) mine.requests = 0;
            }
          },
          [&](const Attach& m) {
            their_last_ = std::max(their_last_, m.requests.value);
            const auto it = mine_.find(m.channel.value);
            if (it == mine_.end()) return;
            it->second.requests = m.requests.value;
            it->second.told = false;
          },
          [&](const Attached& m) {
            if (m.seen.value >= kCallsEnd)
              violated("a side says attached for an epoch that has no numbers left");
            const auto it = requests_.find(m.requests.value);
            if (it != requests_.end()) it->second.attached = true;
          },
          [&](const Refuse& m) {
            for (const CallId call : m.calls) end_call(m.channel.value, call.value);
          },
          [&](const Forget& m) {
            const auto it = mine_.find(m.channel.value);
            if (it == mine_.end()) return;
            const Mine& mine = it->second;
            for (const CallId call : m.calls) {
              if (mine.named.contains(call.value)) continue;
              if (std::find(mine.calls.begin(), mine.calls.end(), call.value) == mine.calls.end())
                violated("a side forgets a call before its request has arrived");
            }
          },
          [](const auto&) {},
      },
      control);
}

// A call that was made, and once.
void HostileServices::end_call(std::uint32_t channel, std::uint32_t call) {
  const auto it = theirs_.find(channel);
  if (it == theirs_.end() || it->second.epoch == 0) return;
  Theirs& service = it->second;
  const std::string what = "call " + std::to_string(call) + " of a stranger to " + service.name;
  if (call > highest_calls_[{service.name, service.epoch}]) violated(what + " was never made");
  if (!service.ended.insert(call).second) violated(what + " is answered twice");
}

void HostileServices::hear(const MessageFrame& frame) {
  end_call(frame.channel.value, frame.subject.value);
  for (auto& [id, mine] : mine_)
    if (mine.requests == frame.channel.value) mine.calls.push_back(frame.subject.value);
}

// ---- what it says

void HostileServices::say(const Control& control) {
  say(encode(control));
}

void HostileServices::say(const std::string& text) {
  send_(true, Bytes{text.begin(), text.end()});
}

void HostileServices::send(const Frame& frame, ByteView part) {
  Bytes bytes;
  append_header(frame, bytes);
  bytes.insert(bytes.end(), part.begin(), part.end());
  send_(false, std::move(bytes));
}

// Now and then far from the ones before.
std::uint32_t HostileServices::new_number() {
  const std::uint32_t step = rng_.chance(20) ? 1U << 28 : 1;
  last_number_ += last_number_ < 3U << 30 ? step : 1;
  return last_number_;
}

void HostileServices::send_message(std::uint32_t channel, Stream& stream, std::uint32_t call) {
  if (!stream.rest.empty()) {
    if (rng_.chance(200)) {
      stream.rest.clear();
      return send(PartFrame{{channel}, true, {}}, {});
    }
    const auto size = static_cast<std::ptrdiff_t>(rng_.below(stream.rest.size()) + 1);
    const Bytes part(stream.rest.begin(), stream.rest.begin() + size);
    stream.rest.erase(stream.rest.begin(), stream.rest.begin() + size);
    return send(PartFrame{{channel}, false, part}, part);
  }
  const auto size = static_cast<std::size_t>(rng_.between(32, kMessageBytesMax));
  Bytes body = make_message(label_of(channel, call), size, true);
  MessageFrame frame;
  frame.channel = {channel};
  frame.subject = {call};
  frame.sequence = stream.sequence += rng_.chance(900) ? 1 : 1000;
  frame.raw_bytes = static_cast<std::uint32_t>(body.size());
  if (rng_.chance(300)) {
    frame.codec = rng_.chance(500) ? Codec::kLz4 : Codec::kZstd;
    auto smaller = compress(body, {frame.codec, 3});
    if (smaller) body = std::move(*smaller);
    if (!smaller) frame.codec = Codec::kNone;
  }
  frame.body_bytes = static_cast<std::uint32_t>(body.size());
  if (rng_.chance(200)) {
    const auto first = static_cast<std::ptrdiff_t>(rng_.below(body.size() - 1) + 1);
    stream.rest.assign(body.begin() + first, body.end());
    body.erase(body.begin() + first, body.end());
  }
  frame.part = body;
  send(frame, body);
}

void HostileServices::accept_all() {
  Accepts accepts;
  AcceptedNames all;
  all.topics = all.services = all.actions = all.parameters = {"/**"};
  accepts.rules.push_back(std::move(all));
  if (rng_.chance(200)) accepts.deny = {rng_.pick(names())};
  say(accepts);
}

std::vector<CallId> HostileServices::some_calls(const std::vector<std::uint32_t>& known) {
  std::vector<CallId> calls;
  const auto count = rng_.between(0, 5);
  for (int i = 0; i < count; ++i) {
    const bool guess = known.empty() || rng_.chance(300);
    calls.push_back(
        {guess ? static_cast<std::uint32_t>(rng_.chance(500) ? rng_.below(50) + 1 : rng_.next() | 1)
               : rng_.pick(known)});
  }
  return calls;
}

std::string HostileServices::step() {
  switch (rng_.below(20)) {
    case 0:
    case 1:
    case 2: return attach();
    case 3: return attach_to_what_is_gone();
    case 4:
    case 5:
    case 6:
    case 7: return request();
    case 8: return detach();
    case 9: return forget();
    case 10: return ask_in_vain();
    case 11:
    case 12: return offer();
    case 13:
    case 14: return say_attached();
    case 15:
    case 16: return answer();
    case 17: return refuse();
    case 18: return withdraw();
    default:
      if (rng_.chance(200)) accept_all();
      return "accepts";
  }
}

// ---- as importer

std::string HostileServices::attach() {
  const auto it = pick(theirs_, [](const Theirs& service) {
    return service.epoch > 0 && !service.withdrawn && service.requests == 0;
  });
  if (it == theirs_.end()) return "";
  const std::uint32_t number = new_number();
  it->second.requests = number;
  requests_[number] = {it->first, false, last_calls_[{it->second.name, it->second.epoch}], {}};
  say(Attach{{it->first}, {number}});
  return "attach";
}

std::string HostileServices::attach_to_what_is_gone() {
  const auto it = pick(theirs_, [](const Theirs& channel) { return channel.withdrawn; });
  if (it == theirs_.end()) return "";
  const std::uint32_t number = new_number();
  requests_[number] = {it->first, false, 0, {}};
  say(Attach{{it->first}, {number}});
  return "attach to what is gone";
}

// The next call, one that was made before, or one far ahead.
std::string HostileServices::request() {
  const auto it = pick(requests_, [&](const Requests& r) { return may_send(r); });
  if (it == requests_.end()) return "";
  const auto count = rng_.chance(800) ? 1 : rng_.between(2, 20);
  const Theirs& service = theirs_.at(it->second.service);
  for (int i = 0; i < count; ++i) {
    std::uint32_t& last = it->second.last;
    std::uint32_t call = last + 1;
    if (rng_.chance(150))
      call = static_cast<std::uint32_t>(rng_.below(std::uint64_t{last} + 1) + 1);
    if (rng_.chance(30)) call = last + static_cast<std::uint32_t>(rng_.below(1U << 28));
    if (rng_.chance(20)) call = kCallsEnd - 1 + static_cast<std::uint32_t>(rng_.below(3));
    call = std::max(call, 1U);
    last = std::max(last, call == UINT32_MAX ? last : call);
    std::uint32_t& highest = highest_calls_[{service.name, service.epoch}];
    highest = std::max(highest, call);
    std::uint32_t& kept = last_calls_[{service.name, service.epoch}];
    // On the next connection it begins again with some that it has sent.
    if (rng_.chance(500)) kept = std::max(kept, last);
    send_message(it->first, it->second.stream, call);
  }
  return "request";
}

std::string HostileServices::detach() {
  const auto it = pick(requests_, [](const Requests&) { return true; });
  if (it == requests_.end()) return "";
  Theirs& service = theirs_.at(it->second.service);
  if (service.requests == it->first) service.requests = 0;
  say(Withdraw{{{it->first}}});
  requests_.erase(it);
  return "detach";
}

std::string HostileServices::forget() {
  const auto it = pick(theirs_, [](const Theirs& channel) { return channel.epoch > 0; });
  if (it == theirs_.end()) return "";
  const auto last = last_calls_[{it->second.name, it->second.epoch}];
  say(Forget{{it->first}, some_calls({last + 1, std::max(last, 1U), last / 2 + 1})});
  return "forget";
}

// Messages that a service's channel ignores.
std::string HostileServices::ask_in_vain() {
  const auto it = pick(theirs_, [](const Theirs&) { return true; });
  if (it == theirs_.end()) return "";
  if (rng_.chance(500)) {
    say(Demand{{{{it->first}, static_cast<std::uint16_t>(rng_.chance(500))}}});
  } else {
    say(Decline{{it->first}, "whim", "because"});
  }
  return "demand or decline";
}

// ---- as exporter

std::uint32_t HostileServices::offer_one(const std::string& name, const std::string& type,
                                         const std::string& action_type, std::uint32_t epoch) {
  ChannelOffer offer;
  offer.channel = {new_number()};
  offer.kind = InterfaceKind::kService;
  offer.name = name;
  offer.type = type;
  offer.action_type = action_type;
  offer.node = rng_.chance(500) ? "/stranger" : "no name";
  offer.epoch = epoch;
  mine_[offer.channel.value] = {};
  say(Offer{{offer}, rng_.chance(500)});
  return offer.channel.value;
}

// Also one service twice, parts of actions without the rest, and what it has no right to.
std::string HostileServices::offer() {
  if (mine_.size() > 200) return "";
  const auto epoch = static_cast<std::uint32_t>(rng_.chance(700) ? 7 : rng_.next() | 1);
  const bool plain = rng_.chance(500);
  const std::string name = plain ? "/hostile/a" : rng_.pick(names());
  const std::string type = plain ? "std_srvs/srv/Trigger" : rng_.pick(types());
  const std::vector<std::string> actions = {"", "test/action/Fib", "test/action/Other", "Fib"};
  offer_one(name, type, plain ? "" : rng_.pick(actions), epoch);
  return "offer " + name;
}

// As answer to an attach or to none.
std::string HostileServices::say_attached() {
  const auto wants = [](const Mine& m) { return m.requests > 0 && !m.told; };
  auto it = pick(mine_, wants);
  const bool right = it != mine_.end() && rng_.chance(850);
  if (!right) it = pick(mine_, [](const Mine&) { return true; });
  if (it == mine_.end()) return "";
  // Channel numbers of the peer's: this one it has never used.
  Attached attached{{it->first}, {right ? it->second.requests : 0xFFFFFFF0U}, {0}, {}, ""};
  if (right) it->second.told = true;
  if (rng_.chance(300)) attached.seen = {static_cast<std::uint32_t>(rng_.below(kCallsEnd))};
  if (rng_.chance(300)) attached.calls = some_calls(it->second.calls);
  for (const CallId call : attached.calls) it->second.named.insert(call.value);
  if (rng_.chance(300)) attached.type_hash = "RIHS01_strange";
  say(attached);
  return right ? "attached" : "attached that nobody asked for";
}

std::string HostileServices::answer() {
  auto it = pick(mine_, [](const Mine& m) { return !m.calls.empty() || !m.stream.rest.empty(); });
  if (it == mine_.end()) it = pick(mine_, [](const Mine&) { return true; });
  if (it == mine_.end()) return "";
  const auto count = rng_.between(1, 8);
  for (int i = 0; i < count; ++i) {
    const auto calls = some_calls(it->second.calls);
    send_message(it->first, it->second.stream, calls.empty() ? 1 : calls.front().value);
  }
  return "answer";
}

std::string HostileServices::refuse() {
  const auto it = pick(mine_, [](const Mine&) { return true; });
  if (it == mine_.end()) return "";
  const std::vector<std::string> codes = {"limit", "timeout", "failed", "lost", "whim"};
  say(Refuse{{it->first}, some_calls(it->second.calls), rng_.pick(codes), "because"});
  return "refuse";
}

std::string HostileServices::withdraw() {
  const auto it = pick(mine_, [](const Mine&) { return true; });
  if (it == mine_.end()) return "";
  say(Withdraw{{{it->first}}});
  if (it->second.requests > 0) owed_.insert(it->second.requests);
  mine_.erase(it);
  return "withdraw";
}

}  // namespace connect_bridge::sim
