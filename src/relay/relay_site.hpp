// The status of a relay for those who ask by HTTP, by the door that servers and clients have.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/ports/net_options.hpp"
#include "net/http/status_door.hpp"
#include "relay/relay_status.hpp"

namespace connect_bridge {

// At the socket in the runtime folder (this user's `ctl status`), and at status.listen, which is on
// the loopback, where every local user may ask: without addresses. Whoever asks within a second
// gets the same text, so that it costs the relay little. Thread: that of the io_context, which is
// also the relay's.
class RelaySite {
 public:
  using Log = std::function<void(LogLevel, const std::string&)>;

  RelaySite(asio::io_context& io, std::function<RelayStatus()> status, Log log);
  ~RelaySite();
  RelaySite(const RelaySite&) = delete;
  RelaySite& operator=(const RelaySite&) = delete;

  // Once. What is wrong with status.listen, or nothing; without the socket it does, with a line in
  // the log.
  [[nodiscard]] std::string open(const StatusOptions& at);
  [[nodiscard]] std::uint16_t port() const { return door_->port(); }
  // Tells those who follow; what is answered is of that moment, or later. Once a second.
  void tell();

 private:
  enum class Kind : std::uint8_t { kStatus, kEvent, kMetrics };

  [[nodiscard]] StatusAnswer answer(const StatusRequest& request);
  const RelayStatus& now();
  // The text of this kind for all who ask until tell() is called.
  SharedText once(Kind kind, bool flag, const std::function<std::string()>& make);
  SharedText event(bool names);

  const std::function<RelayStatus()> status_;
  std::optional<RelayStatus> now_;
  std::map<std::pair<Kind, bool>, SharedText> texts_;
  const Log log_;
  std::shared_ptr<StatusDoor> door_;
};

}  // namespace connect_bridge
