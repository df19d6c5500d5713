// One interface of ours on one link.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/connection/channel.hpp"
#include "core/link/link.hpp"
#include "core/offers/export_right.hpp"
#include "core/ports/audit.hpp"

namespace connect_bridge {

// Knows the peer's right to the interface, its channel, and the peer's decline; writes the lines of
// the audit log. Topics and services use it alike. This class decides, and its owner acts.
// Single-threaded.
class LinkOffer {
 public:
  // The effect of a review that brings other terms of the rules.
  enum class Terms : std::uint8_t {
    kFixed,    // the interface is offered again, unless may_follow()
    kFollowed  // the new terms apply from the review on
  };

  // An offer takes as long as so many looks at interfaces that are offered already.
  static constexpr std::size_t kLooks = 32;

  // `side` and `link` must outlive this object.
  LinkOffer(const SideView& side, Link& link, std::shared_ptr<const LocalInterface> what,
            Terms terms)
      : side_(side), link_(link), what_(std::move(what)), terms_(terms) {}
  LinkOffer(const LinkOffer&) = delete;
  LinkOffer& operator=(const LinkOffer&) = delete;
  ~LinkOffer();

  // Neither open nor refused since the last review: the owner calls open().
  [[nodiscard]] bool is_due() const { return !number_ && !asked_; }
  // Opens a channel and returns the offer's common fields; nullopt: the peer may not have it now.
  // Call it only if is_due().
  [[nodiscard]] std::optional<ChannelOffer> open(OutgoingChannel& channel);

  // Applies changed rules, `accepts` or actions. Returns the reason why the offer ends, or is made
  // again on a new channel; nullopt: it stays, and is due if it is not open. `used`: the peer
  // demands it or is attached, so it has not forgotten it.
  [[nodiscard]] std::optional<Ending> review(bool used);
  // The reason for the end of an offer that is made again.
  [[nodiscard]] static Ending offered_again() { return {"it is to be offered again"}; }

  // Ends the channel and sends `withdraw`. The offer is not due again before a review.
  void close(const Ending& why);
  // The connection is lost, and the channel with it.
  void lose();

  void on_decline(const Decline& decline, const Now& now);
  // The peer demands the topic, or attaches to the service.
  void on_taken() { declined_under_.reset(); }
  [[nodiscard]] bool is_declined() const { return declined_under_.has_value(); }
  // The peer's last decline, with its code; empty: it has not declined.
  [[nodiscard]] const Ending& declined() const { return declined_; }

  // Writes a line of the audit log.
  void note(AuditEvent event, const Ending& why = {}) const;

  [[nodiscard]] ChannelId number() const { return number_; }
  [[nodiscard]] bool is_open() const { return bool(number_); }
  [[nodiscard]] Link& link() const { return link_; }
  // The name at the peer; the local name if the peer does not see it.
  [[nodiscard]] std::string wire_name() const { return link_.names.wire_name(what_->key.first); }
  // The terms under which it was opened, or which a later review brought.
  [[nodiscard]] const Decision& decision() const { return decision_; }
  [[nodiscard]] const Treatment& treatment() const { return decision_.treatment; }

 private:
  const SideView& side_;
  Link& link_;
  std::shared_ptr<const LocalInterface> what_;
  Terms terms_;
  ChannelId number_;  // none: not open on this link
  bool asked_ = false;
  Decision decision_;
  // The peer's list of `accepts` under which it declined. A peer may forget declines when it
  // replaces that list, so it then receives the offer again (docs/protocol.md, "decline").
  std::optional<std::uint64_t> declined_under_;
  Ending declined_;
};

// Sends offers that were opened. `completes`: they complete the first round of the connection.
void send_offers(Link& link, const std::vector<ChannelOffer>& offers, bool completes);
// Logs that the type of an interface that the peer might have cannot be taken here, once for each
// type. An action is reported as a whole.
void tell_lack(const SideView& side, const Link& link, const LocalInterface& what);

}  // namespace connect_bridge
