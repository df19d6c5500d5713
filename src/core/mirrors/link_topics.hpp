// The topics that one peer offers on its present connection.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "core/base/pace.hpp"
#include "core/mirrors/peer_topic.hpp"

namespace connect_bridge {

// Created with the first offer, destroyed with the connection. Single-threaded.
class LinkTopics {
 public:
  LinkTopics(ImportContext& context, Link& link) : context_(context), link_(link) {}

  // Imports the offered topic, or declines it. The caller has checked that the number is unused,
  // and has registered it at the link.
  void on_offer(const ChannelOffer& offer, const Now& now);
  // Declines topics that our new rules no longer allow.
  void recheck(const Now& now);
  void renew(const Now& now);
  // The topic has origins without a place.
  void note_left_out(ChannelId number);
  // At most so many topics look for places; returns how many.
  std::size_t try_left_out(std::size_t most, const Now& now);
  // Number of topics that may look.
  [[nodiscard]] std::size_t without_place() const { return finished_ ? 0 : left_out_.size(); }
  // The link's turn among those without a place (ImportContext) goes on, or is over.
  void go_on_with_turns();
  void finish(const Now& now);
  [[nodiscard]] bool is_finished() const { return finished_; }
  // The sample, decompressed here and not by a worker, because its channel or connection ends.
  // None: so much was decompressed here in the last second that everything else would have to wait,
  // or the sample is malformed.
  [[nodiscard]] std::optional<Payload> decompress_at_once(const InMessage& message, const Now& now);
  // May a message that a rate has held be published now, because its publisher or channel ends? So
  // many may in a second that nothing else has to wait.
  [[nodiscard]] bool may_publish_last(const Now& now) { return last_ones_.take(now.steady); }
  // Some of the topics end. True: all have.
  [[nodiscard]] bool on_link_lost(LinkEnd& end, const Now& now);
  // A reply about the peer's clock has come.
  void on_clock(const Now& now);

  // The demand for a topic has changed; send_demands() sends it.
  void change_demand(const PeerTopic& topic, bool on);
  void send_demands();
  void erase(ChannelId number) { topics_.erase(number); }
  void forget_name(const TopicKey& key) { names_.erase(key); }

  [[nodiscard]] ImportContext& context() const { return context_; }
  [[nodiscard]] Link& link() const { return link_; }
  // Bytes of messages that wait to be decompressed.
  [[nodiscard]] Budget& decoding() { return decoding_; }
  [[nodiscard]] const Budget& decoding() const { return decoding_; }
  // Bytes of the bases of all topics of the link.
  [[nodiscard]] Budget& bases() { return bases_; }
  void add_status(LinkStatus& status) const;
  void add_channels(std::vector<ChannelFacts>& channels) const;

 private:
  ImportContext& context_;
  Link& link_;
  Budget decoding_{&link_.memory};
  Budget bases_{&link_.memory};
  static constexpr double kAtOnceMax = 16 << 20;  // bytes; some ten milliseconds of work
  Throttle at_once_{kAtOnceMax, {}};
  Pace last_ones_{1024, std::chrono::milliseconds(1)};
  std::vector<ChannelId> wants_;
  std::vector<ChannelId> ends_;
  bool has_clock_ = false;        // the peer's clock is known
  bool finished_ = false;         // nothing is published any more
  std::uint16_t demands_ = 0;     // number of the last demand; skips 0 when it wraps
  std::set<ChannelId> left_out_;  // topics with origins without a place
  ChannelId looked_at_;           // the topic of left_out_ that looked for a place last
  bool has_turn_ = false;         // among the links with topics in left_out_
  std::set<TopicKey> names_;      // names of the topics below
  std::map<ChannelId, PeerTopic> topics_;
};

}  // namespace connect_bridge
