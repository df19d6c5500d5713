#include "core/link/channel.hpp"

namespace connect_bridge {

bool IncomingChannel::wants(std::uint16_t) const {
  return true;
}

Result<Nothing> IncomingChannel::on_origins(const OriginsChanged&, const Now&) {
  return Error{CloseCode::kUnknownChannel, "origins of a channel that is no topic"};
}

Result<Nothing> IncomingChannel::on_attached(const Attached&, const Now&) {
  return Error{CloseCode::kUnknownChannel, "attached to a channel that is no service"};
}

Result<Nothing> IncomingChannel::on_refuse(const Refuse&, const Now&) {
  return Error{CloseCode::kUnknownChannel, "calls of a channel that is no service are refused"};
}

void OutgoingChannel::on_demand(const ChannelDemand&, const Now&) {}

void OutgoingChannel::on_decline(const Decline&, const Now&) {}

Result<Nothing> OutgoingChannel::on_attach(const Attach&, const Now&) {
  return Error{CloseCode::kIllegal, "attached to a channel that is no service"};
}

Result<Nothing> OutgoingChannel::on_forget(const Forget&, const Now&) {
  return Nothing{};
}

void OutgoingChannel::on_delivered(CallId, const Now&) {}

}  // namespace connect_bridge
