// Messages of a stranger about services that must end the connection: docs/protocol.md section 9,
// row by row of "what arrives and does not fit".
#include <algorithm>

#include "sim/hostile_services.hpp"
#include "sim/label.hpp"
#include "sim/ledger.hpp"

namespace connect_bridge::sim {
namespace {

constexpr std::uint32_t kNever = 4'100'000'000U;  // a channel number that nobody has come to

bool always() {
  return true;
}

// `count` copies of `item`, with commas between them.
std::string repeated(std::string before, const std::string& item, std::size_t count,
                     const std::string& after) {
  for (std::size_t i = 0; i < count; ++i) before += (i > 0 ? "," : "") + item;
  return before + after;
}

}  // namespace

// Unless the peer withdraws it: then what crosses that is allowed.
std::function<bool()> HostileServices::while_offered(std::uint32_t channel) const {
  return [this, channel] {
    const auto it = theirs_.find(channel);
    return it == theirs_.end() || !it->second.withdrawn;
  };
}

// Unless the peer ends it: then what crosses that is ignored.
std::function<bool()> HostileServices::while_attached(std::uint32_t channel,
                                                      std::uint32_t requests) const {
  return [this, channel, requests] {
    const auto it = mine_.find(channel);
    return it != mine_.end() && it->second.requests == requests;
  };
}

HostileServices::Offence HostileServices::offend() {
  const auto which = rng_.below(30);
  Offence offence;
  if (which < 7) {
    offence = attach_wrongly(which);
  } else if (which < 14) {
    offence = request_wrongly(which - 7);
  } else if (which < 20) {
    offence = tell_wrongly(which - 14);
  } else if (which < 23) {
    offence = say_malformed();
  }
  // An offence that needs nothing of the peer is always possible.
  return offence.stands ? offence : name_what_never_was(rng_.below(7));
}

std::optional<std::uint32_t> HostileServices::an_attached() {
  const auto it = pick(theirs_, [](const Theirs& service) {
    return service.epoch > 0 && !service.withdrawn && service.requests > 0;
  });
  if (it != theirs_.end()) return it->second.requests;
  if (attach().empty()) return {};
  return last_number_;
}

HostileServices::Offence HostileServices::attach_wrongly(std::uint64_t which) {
  const auto offered = [](const Theirs& t) { return t.epoch > 0 && !t.withdrawn; };
  if (which == 0) {
    const auto first = an_attached();
    if (!first) return {};
    const std::uint32_t channel = requests_.at(*first).service;
    say(Attach{{channel}, {new_number()}});
    return {"attaches twice", while_offered(channel)};
  }
  if (which == 1) {
    const auto it = pick(theirs_, [](const Theirs& t) { return t.epoch == 0 && !t.withdrawn; });
    if (it == theirs_.end()) return {};
    say(Attach{{it->first}, {new_number()}});
    return {"attaches to a topic", while_offered(it->first)};
  }
  if (which == 2) {  // the peer's channel for requests to us is no service of the peer's
    const auto it = pick(mine_, [](const Mine& m) { return m.requests > 0; });
    if (it == mine_.end()) return {};
    say(Attach{{it->second.requests}, {new_number()}});
    return {"attaches to requests", while_attached(it->first, it->second.requests)};
  }
  if (which == 3) {  // a channel of nobody, called at once; numbers go on when a session does
    const std::uint32_t guess = their_last_ + 10'000 + static_cast<std::uint32_t>(rng_.below(20));
    const std::uint32_t number = new_number();
    say(Attach{{guess}, {number}});
    for (std::uint32_t call = 1; call < 4; ++call) send_request(number, call, call);
    return {"attaches to what it was not offered", [this, guess] { return their_last_ < guess; }};
  }
  const auto it = pick(theirs_, offered);
  const std::uint32_t channel = it == theirs_.end() ? kNever : it->first;
  if (which == 4) {
    const std::uint32_t used = offer_one("/hostile/a", "std_srvs/srv/Trigger", "", 1);
    say(Attach{{channel}, {used}});
    return {"attaches with a number that it has offered", always};
  }
  const auto used = an_attached();
  if (!used) return {};
  if (which == 5) {
    say(Attach{{channel}, {*used}});
    return {"attaches with a number that is in use", always};
  }
  ChannelOffer offer;
  offer.channel = {*used};
  offer.kind = InterfaceKind::kService;
  offer.name = "/hostile/b/c";
  offer.type = "std_srvs/srv/Trigger";
  offer.epoch = 1;
  say(Offer{{offer}, false});
  return {"offers a number of its requests", always};
}

// Numbers of calls begin again with each epoch.
Label HostileServices::label_of(std::uint32_t channel, std::uint32_t call) const {
  const auto requests = requests_.find(channel);
  const std::uint64_t epoch =
      requests == requests_.end() ? 0 : theirs_.at(requests->second.service).epoch;
  return {label_, epoch << 32U | call};
}

void HostileServices::send_request(std::uint32_t channel, std::uint32_t sequence,
                                   std::uint32_t call) {
  if (const auto it = requests_.find(channel); it != requests_.end()) {
    const Theirs& service = theirs_.at(it->second.service);
    std::uint32_t& highest = highest_calls_[{service.name, service.epoch}];
    highest = std::max(highest, call);
  }
  const Bytes body = make_message(label_of(channel, call), 100, true);
  MessageFrame frame;
  frame.channel = {channel};
  frame.subject = {call};
  frame.sequence = sequence;
  frame.raw_bytes = frame.body_bytes = static_cast<std::uint32_t>(body.size());
  frame.part = body;
  send(frame, body);
}

HostileServices::Offence HostileServices::request_wrongly(std::uint64_t which) {
  if (which < 2) {  // no `attached` is ever sent for this one
    const auto it = pick(theirs_, [](const Theirs& t) {
      return t.name == kDeafService && !t.withdrawn && t.requests == 0;
    });
    if (it == theirs_.end()) return {};
    const std::uint32_t number = new_number();
    say(Attach{{it->first}, {number}});
    send_request(number, 1, 1);
    return {"requests before it is attached", while_offered(it->first)};
  }
  if (which == 2) {
    const auto number = an_attached();
    if (!number) return {};
    say(Withdraw{{{*number}}});
    send_request(*number, 1'000'000'000, 1);
    return {"requests after it has withdrawn the channel", always};
  }
  if (which == 3) {
    const auto number = an_attached();
    if (!number) return {};
    say(Withdraw{{{*number}}});
    say(Withdraw{{{*number}}});
    return {"withdraws requests twice", always};
  }
  const auto it = pick(requests_, [&](const Requests& r) { return may_send(r); });
  if (it == requests_.end()) return {};
  Stream& stream = it->second.stream;
  if (which == 4) {
    if (!stream.rest.empty()) send(PartFrame{{it->first}, true, {}}, {});
    const Bytes part(10);
    send(PartFrame{{it->first}, false, part}, part);
    return {"sends a part of no request", always};
  }
  if (which == 5) {
    if (!stream.rest.empty()) send(PartFrame{{it->first}, true, {}}, {});
    send_request(it->first, ++stream.sequence, ++it->second.last);
    send_request(it->first, stream.sequence, ++it->second.last);
    return {"sends a request out of sequence", always};
  }
  MessageFrame frame;
  frame.channel = {it->first};
  frame.subject = {1};
  frame.sequence = ++stream.sequence;
  frame.raw_bytes = frame.body_bytes = rng_.chance(500) ? 0xF0000000U : 100;
  const Bytes part(10);
  frame.part = part;
  send(frame, part);
  ++frame.sequence;
  send(frame, part);
  return {"sends a request beyond all limits or inside another", always};
}

HostileServices::Offence HostileServices::tell_wrongly(std::uint64_t which) {
  if (which < 3) {
    const auto it = pick(mine_, [](const Mine& m) { return m.requests > 0; });
    if (it == mine_.end()) return {};
    Attached attached{{it->first}, {it->second.requests}, {0}, {}, ""};
    if (which == 0) {
      if (it->second.told) return {};
      attached.seen = {rng_.chance(500) ? 0xF0000000U : 0xFFFFFFFFU};
      say(attached);
      return {"has seen more calls than can be", while_attached(it->first, it->second.requests)};
    }
    say(attached);
    if (!it->second.told) say(attached);
    return {"says attached twice", while_attached(it->first, it->second.requests)};
  }
  const std::uint32_t channel = offer_one("/hostile/b/c", "std_srvs/srv/Trigger", "", 1);
  if (which == 3) {
    say(OriginsChanged{{channel}, {}, {{1}}});
    return {"tells of origins of a service", always};
  }
  say(Withdraw{{{channel}}});
  if (which == 4) {
    say(Attached{{channel}, {1}, {0}, {}, ""});
    return {"says attached for what it has withdrawn", always};
  }
  say(Refuse{{channel}, {{1}}, "failed", ""});
  return {"refuses calls of what it has withdrawn", always};
}

HostileServices::Offence HostileServices::name_what_never_was(std::uint64_t which) {
  const auto number = new_number();
  switch (which) {
    case 0:
      say(Attach{{kNever}, {number}});
      send_request(number, 1, 1);
      return {"attaches to what was never offered", always};
    case 1: say(Attached{{kNever}, {1}, {0}, {}, ""}); break;
    case 2: say(Refuse{{kNever}, {{1}}, "limit", ""}); break;
    case 3: say(Forget{{kNever}, {{1}}}); break;
    case 4: say(Withdraw{{{number}}}); break;
    case 5: send_request(number, 1, 1); break;
    default: say(OriginsChanged{{number}, {}, {}});
  }
  return {"speaks of a channel that never was (" + std::to_string(which) + ")", always};
}

HostileServices::Offence HostileServices::say_malformed() {
  const std::string channel = R"({"type":"offer","channels":[{"channel":)" +
                              std::to_string(new_number()) +
                              R"(,"kind":"service","name":"/hostile/a",)";
  const std::vector<std::string> texts = {
      channel + R"("type":"std_srvs/srv/Trigger"}]})",
      channel + R"("type":"std_srvs/srv/Trigger","epoch":0}]})",
      channel + R"("type":"std_srvs/srv/Trigger","epoch":4294967296}]})",
      R"({"type":"attach","channel":1,"requests":0})",
      R"({"type":"attach","channel":1})",
      R"({"type":"attached","channel":1,"requests":1,"seen":-1})",
      R"({"type":"attached","channel":1,"requests":1,"calls":{}})",
      R"({"type":"refuse","channel":1,"calls":[1],"code":"NO","reason":""})",
      R"({"type":"forget","channel":1,"calls":[4294967296]})",
      R"({"type":"forget","channel":1})",
      R"({"type":"call","channel":1})",
      repeated(R"({"type":"withdraw","channels":[],"x":[)", "{}", kControlValuesMax, "]}"),
      repeated(R"({"type":"withdraw","channels":[],"x":{)", R"("y":0)", kControlMembersMax + 1,
               "}}"),
  };
  const std::string& text = rng_.pick(texts);
  say(text);
  return {"says " + text.substr(0, 100), always};
}

}  // namespace connect_bridge::sim
