// The peers' topics that exist here.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/mirrors/import_context.hpp"
#include "core/mirrors/link_topics.hpp"

namespace connect_bridge {

// Finds or creates the peers' topics and the mirrors of their origins. Single-threaded; owned by
// the side.
class PeerTopics {
 public:
  PeerTopics(const SideView& side, const TopicOptions& options) : context_{side, options} {}

  // Imports the offered topic, or declines it. The caller has checked that the number is unused,
  // and has registered it at the link. Unknown kinds of channels are declined, too.
  void on_offer(Link& link, const ChannelOffer& offer, const Now& now);
  // The connection is about to be lost: publishes messages that have arrived and would resume, so
  // that the peer need not send them again.
  void finish(const Link& link, const Now& now);
  // The connection is gone: its channels end, some in each step, and its mirrors wait for the
  // link's return. True: all have ended.
  [[nodiscard]] bool on_link_lost(LinkId link, LinkEnd& end, const Now& now);
  // The link is declared dead: nobody steers by it. Then its mirrors end, some in each step. A link
  // that returns creates them again. True: all have ended.
  void end_driving(const Link& link, const Now& now) {
    context_.wheels.on_link_end(context_, link, now);  // mutant: halt_at_the_links_end
  }
  [[nodiscard]] bool on_link_dead(const Link& link, LinkEnd& end, const Now& now);
  // The link is open again, and its time for offers is over: removes origins that it has not
  // offered again.
  void forget_orphans(const Link& link, const Now& now);
  // Local subscribers or origins changed.
  void on_graph(const Now& now, const GraphDifference& difference = {});
  void on_claims(LinkTable& links, const Now& now);  // another bridge's claims changed
  void on_policy(const Now& now);
  // A goal is on its way to this action (local name): its feedback may arrive before the graph
  // shows the client's subscriptions.
  void expect_goal(const std::string& action, const Now& now);
  void on_mirror_made(const MirrorMade& made) { context_.mirrors.on_made(made.mirror, made.gid); }
  void on_mirror_failed(const MirrorFailed& failed, const Now& now);
  void on_type_differs(const TypeDiffers& differs);
  void on_publish_failed(const PublishFailed& failed);
  // A reply has measured the clock of the link's peer.
  void on_clock(const Link& link, const Now& now);
  // This side stops.
  void on_stop(const Now& now) { context_.wheels.on_stop(context_, now); }
  void on_time(const Now& now);

  // Sends the demands that changed, one message per link and direction.
  void send_demands();
  // The origins mirrored here, and the mirrors, for our own claim.
  void add_mirrored(Claim& claim, const Now& now) { context_.mirrors.add_to(claim, now); }

  [[nodiscard]] std::optional<TimePoint> deadline() const {
    return earliest(earliest(context_.mirrors.timers().deadline(), context_.held.deadline()),
                    earliest(context_.looks_again_at, context_.wheels.deadline()));
  }
  // Is a peer's publisher of this topic mirrored here?
  [[nodiscard]] bool has_mirror(const TopicKey& key) const;
  void add_status(const Link& link, LinkStatus& status) const;
  void add_channels(const Link& link, std::vector<ChannelFacts>& channels) const;
  [[nodiscard]] std::uint64_t memory_bytes() const;
  // Number of times that a topic judged its demand: it measures the work done here.
  [[nodiscard]] std::uint64_t judged() const { return context_.judged; }

 private:
  // permission(): the import rule for the mirror on this link. is_permitted_as_before(): do the
  // rules let the same link feed the mirror in the same way as until now?
  [[nodiscard]] std::optional<Decision> permission(const Link& link,
                                                   const TopicMirror& mirror) const;
  [[nodiscard]] bool is_permitted_as_before(const TopicMirror& mirror) const;

  // Some of the topics without a place look for one.
  void look_for_places(const Now& now);

  ImportContext context_;
  std::map<LinkId, LinkTopics> peers_;
};

}  // namespace connect_bridge
