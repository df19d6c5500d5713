// Measures the path to a server by a login of its own, without a ROS graph.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/side/side.hpp"
#include "net/websocket/network.hpp"
#include "run/parts.hpp"
#include "run/workers.hpp"

namespace connect_bridge {

// Measurements in one span of time.
struct ProbeSpan {
  struct Sample {
    Duration at{};  // time of its answer, since the span began
    Duration round_trip{};
    Duration offset{};  // the server's clock minus ours
  };
  Duration took{};
  std::vector<Sample> samples;
  std::uint64_t sent_bytes = 0;      // load that this side sent
  std::uint64_t received_bytes = 0;  // topics that it received, uncompressed
  std::uint64_t repeated = 0;        // segments that this side's TCP sent again
  std::string ended;                 // reason why the span ended early; empty: it did not
};

// A probe is a client like any other: it needs a login, and gets no more than the server's rules
// give that login. Round trips are those of the protocol's time requests, which overtake other data
// of this side. Thread: that of the caller, which each call blocks.
class Probe {
 public:
  struct Options {
    Duration interval = std::chrono::milliseconds(200);  // between time requests
    std::vector<Pattern> topics = {};                    // topics that may be received
    bool logs_in = true;  // false: tries only the path to the server, up to its WebSocket
  };
  // Traffic of this side beside the time requests.
  struct Load {
    std::uint64_t send_bytes_per_second = 0;  // 0: none
    bool receive = false;                     // receives the topics, as a subscriber does
  };

  // `parts`: those of a client.
  Probe(BridgeParts parts, Options options);

  // Dials and, if it is to, logs in. Why it cannot, within this time; nothing: it can.
  [[nodiscard]] Failure open(Duration patience);
  // `each`: called with every sample, as it comes; may be empty.
  [[nodiscard]] ProbeSpan measure(Duration time, const Load& load,
                                  const std::function<void(const ProbeSpan::Sample&)>& each = {});
  // Number of requested topics that the server offers.
  [[nodiscard]] std::size_t topics() const { return topics_.size(); }
  // Stops the side and closes the connection; takes at most 1 s.
  void close();

 private:
  void handle(Input&& input);
  void carry_out(Action&& action);
  void note_sample();
  void note_end(const Failure& why);
  [[nodiscard]] Gid next_gid();
  void show_graph();
  [[nodiscard]] std::optional<Packet> next_packet(ConnectionId id, const Repairs& repairs);
  [[nodiscard]] std::optional<Packet> filler();
  void set_timer();
  // Runs until the time is over, or `done`.
  template <class Done>
  void run_for(Duration time, Done done);

  BridgeParts parts_;
  boost::asio::io_context io_{1};
  Side side_;
  Network network_;
  boost::asio::steady_timer timer_;
  boost::asio::steady_timer pulls_;            // for the load
  std::map<std::string, std::string> topics_;  // names and types
  std::set<MirrorId> mirrors_;                 // of these topics
  std::uint64_t gids_ = 0;
  ConnectionId connection_{};
  Load load_;
  TimePoint span_since_{};
  ProbeSpan span_;
  std::function<void(const ProbeSpan::Sample&)> each_;
  std::uint64_t samples_seen_ = 0;
  std::uint64_t repeated_ = 0;
  const bool logs_in_;
  bool open_ = false;
  bool reached_ = false;  // the server; only if it does not log in
  Failure why_not_;
  Workers workers_;  // last: its threads post to io_
};

}  // namespace connect_bridge
