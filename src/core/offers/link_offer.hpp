// One interface of ours on one link.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/link/channel.hpp"
#include "core/link/link.hpp"
#include "core/offers/export_right.hpp"
#include "core/ports/audit.hpp"

namespace connect_bridge {

// Knows whether the peer may have the interface and takes it, its channel, what the peer has
// declined, and what the audit log says about that; for topics and services alike. It decides, and
// its owner obeys. Single-threaded.
class LinkOffer {
 public:
  // What other terms of the rules mean.
  enum class Terms : std::uint8_t {
    kFixed,    // it is offered again under them
    kFollowed  // they hold from the review on
  };

  // `side` and `link` outlive it.
  LinkOffer(const SideView& side, Link& link, std::shared_ptr<const LocalInterface> what,
            Terms terms)
      : side_(side), link_(link), what_(std::move(what)), terms_(terms) {}
  LinkOffer(const LinkOffer&) = delete;
  LinkOffer& operator=(const LinkOffer&) = delete;
  ~LinkOffer();

  // Neither open nor refused since the last review: open() is to be called.
  [[nodiscard]] bool is_due() const { return !number_ && !asked_; }
  // Opens a channel and returns what every offer says of it; nullopt: the peer may not have it now.
  // Only if it is due.
  [[nodiscard]] std::optional<ChannelOffer> open(OutgoingChannel& channel);

  // What follows from changed rules, `accepts` or actions: why it ends, or is offered again under a
  // new channel; nullopt: it stays, and what is not open is due. `used`: it is demanded, or the
  // peer is attached. Then it has not been forgotten.
  [[nodiscard]] std::optional<Ending> review(bool used);
  // Why what the peer may still have ends.
  [[nodiscard]] static Ending offered_again() { return {"it is to be offered again"}; }

  // Ends the channel and sends `withdraw`. The offer is not due again before a review.
  void close(const Ending& why);
  // The connection is gone, and the channel with it.
  void lose();

  void on_decline(const Decline& decline, const Now& now);
  // The peer demands it, or attaches.
  void on_taken() { declined_under_.reset(); }
  [[nodiscard]] bool is_declined() const { return declined_under_.has_value(); }
  // The reason that the peer gave last; empty: none, it has not declined.
  [[nodiscard]] const std::string& declined() const { return declined_; }

  // A line of the audit log.
  void note(AuditEvent event, const Ending& why = {}) const;

  [[nodiscard]] ChannelId number() const { return number_; }
  [[nodiscard]] bool is_open() const { return bool(number_); }
  [[nodiscard]] Link& link() const { return link_; }
  // Its name at the peer; if the peer does not see it, its name here.
  [[nodiscard]] std::string wire_name() const { return link_.names.wire_name(what_->key.first); }
  // The terms under which it was opened, or which a review has brought since.
  [[nodiscard]] const Decision& decision() const { return decision_; }
  [[nodiscard]] const Treatment& treatment() const { return decision_.treatment; }

 private:
  const SideView& side_;
  Link& link_;
  std::shared_ptr<const LocalInterface> what_;
  Terms terms_;
  ChannelId number_;  // none: the peer does not have it
  bool asked_ = false;
  Decision decision_;
  // A peer may forget what it declined under a list that it has replaced, so it is offered that
  // again (docs/protocol.md, "decline").
  std::optional<std::uint64_t> declined_under_;
  std::string declined_;
};

}  // namespace connect_bridge
