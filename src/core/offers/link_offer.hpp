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
  // `side` and `link` outlive it.
  LinkOffer(const SideView& side, Link& link, std::shared_ptr<const LocalInterface> what)
      : side_(side), link_(link), what_(std::move(what)) {}
  LinkOffer(const LinkOffer&) = delete;
  LinkOffer& operator=(const LinkOffer&) = delete;
  ~LinkOffer();

  // Neither open nor refused since the last review: open() is to be called.
  [[nodiscard]] bool is_due() const { return !number_ && !asked_; }
  // Opens a channel and returns what every offer says of it; nullopt: the peer may not have it now.
  // Only if it is due.
  [[nodiscard]] std::optional<ChannelOffer> open(OutgoingChannel& channel);

  // What follows from changed rules, `accepts` or actions.
  enum class Review : std::uint8_t {
    kStays,        // as it is; what is not open is due
    kNewTerms,     // the rules treat it in another way: take_terms() if it is to stay so
    kAgain,        // the peer may have it, but under a new channel
    kNotAccepted,  // the peer does not take it any longer
    kForbidden,    // the rules here do not allow it any longer
    kNotWhole,     // a part of its action does not exist any longer
  };
  // `used`: it is demanded, or the peer is attached. Then it has not been forgotten.
  [[nodiscard]] Review review(bool used);
  // The present terms hold from now on.
  void take_terms() { decision_ = export_right(side_, link_, *what_).decision; }
  // Why it ends, or is offered again.
  [[nodiscard]] static Ending ending_of(Review review);

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
  // The terms under which it was opened, or which were taken since.
  [[nodiscard]] const Decision& decision() const { return decision_; }
  [[nodiscard]] const Treatment& treatment() const { return decision_.treatment; }

 private:
  const SideView& side_;
  Link& link_;
  std::shared_ptr<const LocalInterface> what_;
  ChannelId number_;  // none: the peer does not have it
  bool asked_ = false;
  Decision decision_;
  // A peer may forget what it declined under a list that it has replaced, so it is offered that
  // again (docs/protocol.md, "decline").
  std::optional<std::uint64_t> declined_under_;
  std::string declined_;
};

}  // namespace connect_bridge
