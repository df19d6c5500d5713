// The owner of a channel number. A link knows the owner of each number, so an arrival is dispatched
// once. Each side chooses the numbers of the channels on which it sends (docs/protocol.md, "offer"
// and "attach").
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "core/flow/reassembly.hpp"
#include "core/wire/control.hpp"

namespace connect_bridge {

// The reason why a channel of this side ends while its link goes on.
struct Ending {
  std::string reason{};  // for the audit log
  std::string code{};    // code and reason are sent to the peer; empty: neither
};

// The facts of a topic's or service's channel, without its traffic.
struct ChannelFacts {
  InterfaceKind kind = InterfaceKind::kTopic;
  bool exported = false;
  std::string name;  // local
  std::string type;
  std::string rule;        // of ours, that lets it cross
  Ending declined{};       // exported: the peer does not import it, and why
  std::string misfit{};    // imported: what some subscriber requests and no publisher offers
  TimePoint lost_until{};  // exported: much is lost before the bridge gets it (RecentLoss)
};

// A channel on which the peer sends: a topic or service that it offers, or its requests to a
// service of ours. An error closes the connection with its code. The channel is registered in its
// link until it is withdrawn or the connection is lost; if it ends earlier, it removes itself.
class IncomingChannel {
 public:
  virtual ~IncomingChannel() = default;

  // Are messages that answer this demand (its number) accepted now? Bodies of other messages are
  // not kept.
  [[nodiscard]] virtual bool wants(std::uint16_t) const { return true; }
  virtual Result<Nothing> on_message(InMessage message, const Now& now) = 0;
  // The peer ends the channel. The link has forgotten the number already. May destroy this object.
  virtual void on_withdraw(const Withdraw& why, const Now& now) = 0;

  virtual Result<Nothing> on_origins(const OriginsChanged&, const Now&) {
    return Error{CloseCode::kUnknownChannel, "origins of a channel that is no topic"};
  }
  virtual Result<Nothing> on_attached(const Attached&, const Now&) {
    return Error{CloseCode::kUnknownChannel, "attached to a channel that is no service"};
  }
  // The operator would take or leave the wheel of a topic that it offers.
  virtual void on_wheel_wanted(WheelWant, const Now&) {}
  virtual Result<Nothing> on_refuse(const Refuse&, const Now&) {
    return Error{CloseCode::kUnknownChannel, "calls of a channel that is no service are refused"};
  }
};

// The link's record of a number on which the peer may send.
struct Incoming {
  IncomingChannel* channel = nullptr;  // null: declined or ended, so messages are dropped
  bool offered = false;                // by the peer; else these are the peer's requests
  bool service = false;
  Reassembly::Stream stream{};
};

// A channel on which this side sends: a topic or a service that it offers, or its requests to a
// service of the peer. A message of the wrong kind is ignored, or is an error of the peer.
class OutgoingChannel {
 public:
  virtual ~OutgoingChannel() = default;

  virtual void on_demand(const ChannelDemand&, const Now&) {}
  virtual void on_decline(const Decline&, const Now&) {}
  // The robot says who steers this topic.
  virtual void on_wheel(WheelState, const Now&) {}
  virtual Result<Nothing> on_attach(const Attach&, const Now&) {
    return Error{CloseCode::kIllegal, "attached to a channel that is no service"};
  }
  virtual Result<Nothing> on_forget(const Forget&, const Now&) { return Nothing{}; }
  // The last part of a message that reports its leaving was handed out.
  virtual void on_left(const Now&) {}
  // The peer has received all of a tracked message.
  virtual void on_delivered(CallId, const Now&) {}
};

}  // namespace connect_bridge
