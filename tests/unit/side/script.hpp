// One side as a script: inputs in, what it does and what it says to its peers out.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/side/side.hpp"
#include "unit/side/words.hpp"

namespace connect_bridge::side_test {

SideOptions server(std::vector<Rule> rules = {everything()});
SideOptions client(std::vector<Rule> rules = {everything()});
// A server that keeps for a minute what a lost link loses.
SideOptions keeping(const Treatment& treatment = {});

// Time is in milliseconds and begins at 0. Every input but time is handled at the present moment;
// peers that are on the line give a sign of life whenever time passes, unless they are silent.
class Script {
 public:
  // `plain`: control messages leave as texts, so that said() reads them.
  explicit Script(SideOptions options, bool plain = true);
  ~Script();

  // ---- inputs
  void give(Input input);
  void graph(const std::vector<Topic>& topics, std::vector<ServiceState> services = {});
  // A sample of publisher n; its stamp is `stamp_ms`, or the present.
  void take(std::uint32_t subscription, std::uint8_t n, const std::string& text,
            std::int64_t stamp_ms = -1, std::uint64_t number = 0);
  // Another bridge's claim to origins.
  void claim(std::uint8_t publisher, std::uint8_t side_id, const std::vector<Gid>& origins);
  // The same to a service.
  void claim_service(std::uint8_t publisher, std::uint8_t side_id, const std::string& service);
  void binary(std::uint32_t connection, const Bytes& packet);
  // In as many messages as it takes.
  void say(std::uint32_t connection, const Control& control);
  // Channels with however many origins, see encode_offers().
  void offer(std::uint32_t connection, const std::vector<ChannelOffer>& channels,
             bool complete = false);
  void demand(std::uint32_t connection, std::uint32_t channel, bool on = true);
  // A message on a channel, for the demand that said() has read (the first one, if it has not). Its
  // number is its stamp, if only that is given; sequences are counted here.
  void message(std::uint32_t connection, std::uint32_t channel, std::uint32_t origin,
               const std::string& text, std::int64_t stamp_ms = -1);
  void message(std::uint32_t connection, std::uint32_t channel, std::uint32_t origin,
               const Payload& body, Codec codec, std::uint32_t raw_bytes,
               std::int64_t stamp_ms = -1, std::uint64_t number = 0);
  // The same, compressed.
  void compressed(std::uint32_t connection, std::uint32_t channel, std::uint32_t origin,
                  const std::string& text);
  void lose(std::uint32_t connection, std::optional<std::uint16_t> code = {});
  void fall_silent(std::uint32_t connection);
  // Up to this moment, with an input at every deadline.
  void pass_to(std::int64_t ms);
  void pass(std::int64_t ms);

  // ---- whole logins; what is said during them is not kept
  // Server: connection and login; returns the session. Side ids of peers are 100 + connection, but
  // the same for the same session.
  Token128 login(std::uint32_t connection, Token128 session = {}, const Identity& who = {});
  // Client: the dial that is under way succeeds.
  void be_welcomed(std::uint32_t connection, std::uint32_t message_bytes_max = 0,
                   Token128 session = peer_id(77));
  // Login, and the peer accepts everything. What follows is the beginning of the test.
  Token128 join(std::uint32_t connection, Token128 session = {});

  // ---- results
  // What was done since the last call, one word per line; logs are kept apart, and a claim that is
  // told again is left out.
  std::string did();
  // What is said to a peer now, one packet per line; packets of acks and time frames are left out.
  std::string said(std::uint32_t connection);
  // The peer has all that was said to it by now.
  void acknowledge(std::uint32_t connection);
  [[nodiscard]] Status status() const;
  // How many messages of the only topic of the first link were dropped for this reason.
  [[nodiscard]] std::uint64_t dropped(DropReason reason, std::size_t link = 0) const;
  static Token128 peer_id(std::uint32_t n);

  Side side;
  std::int64_t at = 0;
  Stamp certified_until = 0;  // of the peers that connect from now on
  Identity server_is;         // client: what the servers that are dialled from now on prove to be
  std::size_t claims = 0;     // that were done, also those that did() leaves out: equal to the last
  std::string logged;
  std::string noted;  // for the audit log, if the options ask for it

 private:
  void say_text(std::uint32_t connection, const std::string& text);
  Token128 welcomed(std::uint32_t connection);
  // A claim like the last one, and no mirror has gone since.
  bool is_repeated(const std::string& word);

  std::set<std::uint32_t> living_;
  std::map<Token128, Token128> peers_;  // by session
  std::map<std::uint32_t, std::uint64_t> sent_bytes_;
  std::uint32_t sequence_ = 0;
  std::string claimed_;                                                   // the last claim
  std::map<std::pair<std::uint32_t, ChannelId>, std::uint16_t> demands_;  // the newest
};

}  // namespace connect_bridge::side_test
