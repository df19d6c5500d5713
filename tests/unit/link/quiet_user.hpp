// What a link needs beside its channels, where a test does not look at that.
#pragma once

#include "core/link/link.hpp"

namespace connect_bridge::link_test {

// Takes everything, and says nothing.
class QuietUser : public LinkUser {
 public:
  Result<Nothing> on(Link&, const Offer&, const Now&) override { return Nothing{}; }
  Result<Nothing> on(Link&, Accepts, const Now&) override { return Nothing{}; }
  Result<Nothing> on(Link&, const Listeners&, const Now&) override { return Nothing{}; }
  Result<Nothing> on(Link&, const Ask&, const Now&) override { return Nothing{}; }
  Result<Nothing> on(Link&, const Answered&, const Now&) override { return Nothing{}; }
  Result<Nothing> on(Link&, const Renew&, const Now&) override { return Nothing{}; }
  Result<Nothing> on(Link&, const Renewed&, const Now&) override { return Nothing{}; }
  void on_peer_time(Link&, const TimeReply&, const Now&) override {}

  void on_link_open(Link&, const Now&) override {}
  void on_peer_replaced(Link&, const Now&) override {}
  [[nodiscard]] bool on_link_lost(Link&, const Now&) override { return true; }
  [[nodiscard]] bool on_link_dead(Link&, const Now&) override { return true; }
  void on_identity_changed(Link&, const Now&) override {}
  [[nodiscard]] bool resumes(const Link&) const override { return false; }
  void on_link_forgotten(Link&, const Now&) override {}
  void on_session_forgotten(Link&, const Now&) override {}
  void on_offers_over(Link&, const Now&) override {}

 protected:
  ~QuietUser() = default;
};

}  // namespace connect_bridge::link_test
