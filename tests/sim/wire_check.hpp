// Checks what a side hands to the network, frame by frame: nothing that was not offered, not
// demanded, not permitted or too old; urgent before everything else; each class in its turn.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "core/wire/control.hpp"
#include "core/wire/frame.hpp"
#include "sim/ledger.hpp"
#include "sim/text_reader.hpp"

namespace connect_bridge::sim {

class WireCheck {
 public:
  WireCheck(const Ledger& ledger, Network& network) : ledger_(ledger), network_(network) {}

  void on_connection(const Host& host, ConnectionId id);
  void on_disconnected(const Host& host, ConnectionId id);
  void on_end(const Host& host);
  void on_sent(const Host& host, ConnectionId id, const FlatPacket& packet);
  void on_received(const Host& host, ConnectionId id, bool text, ByteView packet);
  void on_taken(const Host& host, const Reader& reader, const Writer& writer, const Sample& sample);
  // Called again and again with fresh status: queued data must move.
  void on_status(const Host& host, const Status& status);

  // Message frames of a topic (as named on the wire) that a host has begun to send.
  [[nodiscard]] std::uint64_t messages_sent(const Host& host, const std::string& wire) const;
  // Whether a host's peers demand this topic now.
  [[nodiscard]] bool is_demanded(const Host& host, const std::string& wire) const;
  [[nodiscard]] std::uint64_t frames() const { return frames_; }

 private:
  struct Origin {
    Gid gid;
    Qos qos;
    TimePoint offered{};
  };
  struct Channel {
    std::string wire;   // name on the wire
    std::string local;  // name at the exporter
    std::string type;
    InterfaceKind kind = InterfaceKind::kTopic;
    bool resume = false;    // it goes on after a break, with its numbers
    bool requests = false;  // of our calls, at a service that the peer offers
    Priority priority = Priority::kNormal;
    std::map<OriginId, Origin> origins;
    bool demanded = false;
    std::uint16_t demand = 0;  // its number; of a service 0
    TimePoint demanded_since{};
    std::uint64_t open_bytes = 0;   // of the message that is partly sent: what is missing
    std::uint64_t progress_at = 0;  // the connection's weighted bytes at our last frame
    std::uint64_t class_at = 0;     // the same of its class alone
    TimePoint progress_time{};
    bool waits = false;           // had something queued at the last status
    std::uint64_t turn_most = 0;  // the largest turn of the line since our last frame
  };
  struct Connection {
    int records_left = 0;  // login records that precede everything
    int path = 0;
    TextReader sent_texts, received_texts;
    TimePoint opened{};
    std::map<ChannelId, Channel> channels;
    std::map<ChannelId, std::pair<std::string, std::string>> services;  // the peer's: name, type
    std::map<ChannelId, ChannelId> requests;   // by the peer's channel: ours for the requests
    std::map<ChannelId, std::uint32_t> calls;  // by channel: the last call requested
    std::map<ChannelId, std::uint32_t> sequences;
    std::deque<std::pair<TimePoint, std::size_t>> second;  // packets of the last one
    std::uint64_t second_bytes = 0;
    std::uint64_t weighted_bytes = 0;               // data of the classes that share by weight
    std::map<Priority, std::uint64_t> class_bytes;  // of these, by class
    std::uint64_t turn = 0;         // what counts at a time: the largest of some seconds
    TimePoint turn_at{};            // when it was so
    std::uint64_t first_bytes = 0;  // control texts, small frames and urgent data
  };
  using Key = std::pair<int, ConnectionId>;  // host
  // A small message of a host that may be urgent.
  struct Taken {
    TimePoint at;
    std::map<ConnectionId, std::pair<std::uint64_t, std::uint64_t>> bytes;  // weighted, first
  };
  using TakenKey = std::pair<int, std::pair<Gid, Stamp>>;

  void begin_wait(Connection& connection, Channel& channel) const;
  void note_turn(Connection& connection, std::uint64_t turn) const;
  // A channel that waits must have its turn before others have sent more.
  void check_turn(const Host& host, const Connection& connection, const Channel& channel) const;
  void on_text(const Host& host, ConnectionId id, Connection& connection, std::string_view text);
  void on_received(const Host& host, Connection& connection, std::string_view text);
  void on_control(const Host& host, const Identity& who, Connection& connection,
                  const Control& control);
  void on_offer(const Host& host, const Identity& who, Connection& connection,
                const ChannelOffer& offer);
  void on_attach(const Host& host, const Identity& who, Connection& connection,
                 const Attach& attach);
  void on_message(const Host& host, ConnectionId id, Connection& connection,
                  const MessageFrame& frame);
  void on_part(const Host& host, Connection& connection, const PartFrame& frame);
  void check_age(const Host& host, const Identity& who, const Channel& channel,
                 const MessageFrame& frame) const;
  void check_urgent(const Host& host, ConnectionId id, const Connection& connection,
                    const Channel& channel, const MessageFrame& frame);
  void count(Connection& connection, Channel& channel, std::size_t bytes);
  // `held`: there is data in it that is not urgent.
  void check_cap(const Host& host, Connection& connection, std::size_t bytes, bool held);
  void check_expiry(const Host& host, ConnectionId id) const;

  const Ledger& ledger_;
  Network& network_;
  std::map<Key, Connection> connections_;
  std::map<int, TextReader::Kept> kept_;  // texts of first rounds, by the host that sent them
  std::map<std::pair<int, std::string>, std::uint64_t> sent_;
  std::map<TakenKey, Taken> taken_;
  std::deque<std::pair<TimePoint, TakenKey>> taken_order_;
  std::map<std::pair<int, std::string>, std::size_t> largest_;  // message of a topic in a graph
  std::uint64_t frames_ = 0;
};

}  // namespace connect_bridge::sim
