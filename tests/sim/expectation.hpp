// What must be true once a world has been quiet for a while: who is linked, which mirrors exist,
// which messages have arrived.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sim/checker.hpp"
#include "sim/crowd.hpp"
#include "sim/host.hpp"
#include "sim/scenario.hpp"

namespace connect_bridge::sim {

// An origin as it should exist in another graph.
struct ExpectedMirror {
  int graph = 0;
  std::string topic;  // there
  std::string type;
  int origin = 0;
  Qos qos;                            // with the overrides of both sides
  int ways = 1;                       // pairs of sides that can carry it
  bool certain = true;                // all pairs of sides that can carry it would treat it alike
  bool made_volatile = false;         // by the exporter's rule
  bool limited = false;               // rules or limits may drop messages even on a quiet link
  bool resumes = false;               // what a lost connection loses comes later
  std::size_t bytes_max = 0;          // largest message that both sides accept
  std::uint64_t queue_bytes_max = 0;  // how much may wait at once
  std::uint64_t topic_bytes_max = 0;  // the same at the exporter, of its topic
  std::uint64_t link_bytes_max = 0;   // and of all topics of a link
  std::uint32_t history = 0;          // samples that the exporter keeps for late subscribers
};

class Expectation {
 public:
  // `rules_change`: what is in force at the end was not so from the start.
  Expectation(const Middleware& middleware, Checker& checker, const Crowd& crowd,
              const std::vector<std::unique_ptr<Host>>& hosts, bool rules_change);

  // Takes a snapshot of what should exist now. To be called when nothing changes any more.
  void settle();

  void check_links() const;
  void check_mirrors() const;
  // There is a subscription here for each listener at the far side, and for nobody else.
  void check_listeners() const;
  // Whoever listens to what no rule lets in is told so, and nothing is said that is not so.
  void check_missing() const;

  // Where nothing but the network changed: what did not arrive was counted as dropped, and none of
  // it because a connection was lost.
  void check_unbroken() const;

  // Around a few rounds of messages.
  void begin_rounds();
  void check_rounds() const;
  // Mirrors are of the QoS their origins have; known once each has published.
  void check_qos() const;

  // First messages of new publishers arrive where a listener existed before they came.
  void check_first_words() const;

  // Transient-local subscribers that come late.
  // Whether a message of a topic still waits at a side: to be sent, or to be decompressed.
  [[nodiscard]] bool is_under_way() const;
  void add_late_subscribers(Crowd& crowd);
  void check_late_subscribers() const;

  // Around the time in which every publisher publishes once more and ends.
  void begin_last_words() { last_writers_ = crowd_.writers(); }
  void check_last_words() const;

  // Around a time in which nobody subscribes to anything.
  void begin_silence();
  void check_silence() const;

  [[nodiscard]] const std::vector<ExpectedMirror>& mirrors() const { return mirrors_; }

 private:
  // Somebody listens, and nobody in the same graph publishes, nor does a bridge there.
  [[nodiscard]] bool is_wanted_alone(const Reader& reader) const;
  void check_missing(const Host& host, const Ledger::Peer& peer, const MissingName& missing) const;
  struct Counts {
    std::uint64_t taken = 0, handled = 0;  // exporter
    std::uint64_t sent = 0, arrived = 0;   // exporter, importer
  };
  struct Late {
    int reader = 0;
    std::size_t mirror = 0;  // index of the expected mirror
    int writers = 0;         // that there were when the subscriber came
  };
  void expect_origin(const Writer& origin, const Host& importer);
  void merge(ExpectedMirror expected);
  // Whether every message of the origin must arrive, as far as rules and limits are concerned.
  // Whether this subscriber gets what the mirror publishes.
  [[nodiscard]] static bool hears(const EndpointSpec& reader, const ExpectedMirror& expected);
  [[nodiscard]] bool is_complete(const ExpectedMirror& expected) const;
  [[nodiscard]] bool is_mixed(const Writer& origin) const;
  [[nodiscard]] bool was_overloaded(const Writer& origin) const;
  [[nodiscard]] bool is_uniform(const Writer& origin) const;
  [[nodiscard]] static bool are_alike(const Writer& one, const Writer& other);
  void check_unbroken_at(const Reader& reader) const;
  // Whether a mirror there was made later because its peer made too many at once, and messages of
  // this one may be too large to wait.
  [[nodiscard]] bool may_come_too_early(const ExpectedMirror& expected) const;
  // Whether nothing of the mirror may be missing at this subscriber.
  [[nodiscard]] bool is_unbroken_at(const Reader& reader, const ExpectedMirror& expected) const;
  [[nodiscard]] std::uint64_t count_drops(const ExpectedMirror& expected) const;
  [[nodiscard]] std::map<std::string, Counts> count_topics() const;
  void check_reader(const ExpectedMirror& expected, const Reader& reader) const;
  void check_late(const Late& late) const;
  // Whether a mirror was made since there were so many writers: one whose samples are too large for
  // its depth is made again, with what it keeps.
  [[nodiscard]] bool was_mirrored_again(const ExpectedMirror& expected, int writers) const;
  // Whether there may not be memory for as many samples as it should keep.
  [[nodiscard]] bool may_keep_fewer(const ExpectedMirror& expected) const;
  [[nodiscard]] bool is_as_expected(const Qos& made, const ExpectedMirror& expected) const;
  // How many of its origin's last samples a late subscriber gets, at least.
  [[nodiscard]] std::uint64_t history_of(const ExpectedMirror& expected) const;
  // Bytes that all origins of the topic keep for late subscribers, at most.
  [[nodiscard]] std::uint64_t history_bytes(const ExpectedMirror& expected) const;

  const Middleware& middleware_;
  Checker& checker_;
  const Crowd& crowd_;
  const std::vector<std::unique_ptr<Host>>& hosts_;
  bool rules_change_;
  std::vector<ExpectedMirror> mirrors_;
  std::map<int, std::uint64_t> published_before_;  // by origin
  int writers_before_ = 0;
  std::map<std::string, Counts> counts_before_;
  std::vector<Late> late_;
  std::vector<int> last_writers_;
  std::map<std::pair<int, std::string>, std::uint64_t> sent_before_;  // (host, topic on the wire)
};

}  // namespace connect_bridge::sim
