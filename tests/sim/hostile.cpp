#include "sim/hostile.hpp"

#include <algorithm>

#include "core/wire/control.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/login.hpp"

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kSeenMax = 64;
constexpr std::size_t kQueueMax = 200;

Bytes text_bytes(const std::string& text) {
  return {text.begin(), text.end()};
}

Bytes message(std::uint32_t channel, std::uint32_t sequence, std::uint32_t body_bytes,
              const Bytes& part, Codec codec = Codec::kNone, std::uint32_t raw_bytes = 0) {
  MessageFrame frame;
  frame.channel = {channel};
  frame.subject = {1};
  frame.sequence = sequence;
  frame.stamp = 1'700'000'000'000'000'000;
  frame.codec = codec;
  frame.body_bytes = body_bytes;
  frame.raw_bytes = codec == Codec::kNone ? body_bytes : raw_bytes;
  frame.part = part;
  Bytes bytes;
  append_header(frame, bytes);
  bytes.insert(bytes.end(), part.begin(), part.end());
  return bytes;
}

}  // namespace

Hostile::Hostile(Schedule& schedule, Network& network, Rng rng, std::string secret,
                 std::uint32_t label)
    : schedule_(schedule),
      network_(network),
      rng_(rng),
      secret_(std::move(secret)),
      services_(rng_.fork(), label, [this](bool text, Bytes bytes) {
        if (text) {
          send_text({bytes.begin(), bytes.end()});
        } else {
          send_binary(std::move(bytes));
        }
      }) {
  for (auto& byte : side_.bytes) byte = static_cast<std::uint8_t>(rng_.next());
}

void Hostile::start() {
  if (!serves()) schedule_.after(rng_.between(100ms, 2s), [this] { dial(); });
}

void Hostile::dial() {
  if (stopped_) return;
  network_.dial(path_, ConnectionId{++last_id_});
}

void Hostile::on_dial_failed(ConnectionId, const std::string&) {
  schedule_.after(300ms, [this] { dial(); });
}

void Hostile::on_closed(ConnectionId id, std::optional<std::uint16_t> code) {
  if (id != connection_) return;
  const std::vector<int> faults = {4002, 4006, 4009, 4010, 4014};
  if (strict_ && welcome_ && !offended_ && code &&
      std::find(faults.begin(), faults.end(), *code) != faults.end()) {
    violated("a side ends a connection with " + std::to_string(*code) +
             " for what it must tolerate, lately:" + last_steps_);
  }
  connection_ = {};
  queue_.clear();
  if (!serves()) schedule_.after(rng_.between(20ms, 500ms), [this] { dial(); });
}

void Hostile::on_open(ConnectionId id) {
  connection_ = id;
  queue_.clear();  // the last one may have ended without a word
  welcome_ = false;
  received_ = 0;
  texts_ = {};
  records_ = 0;
  strict_ = rng_.chance(500);
  offended_ = false;
  last_steps_.clear();
  services_.begin();
  if (!strict_ && rng_.chance(150)) {  // no login at all
    for (int i = 0; i < 5; ++i) rng_.chance(500) ? send_noise() : send_plausible();
    return;
  }
  if (!serves()) log_in();
}

void Hostile::send_welcome() {
  Welcome answer;
  for (auto& byte : answer.side.bytes) byte = static_cast<std::uint8_t>(rng_.next());
  for (auto& byte : answer.session.bytes) byte = static_cast<std::uint8_t>(rng_.next());
  answer.dead_after_ms = static_cast<std::uint32_t>(rng_.next());
  answer.message_bytes_max = static_cast<std::uint32_t>(rng_.below(2) * rng_.next());
  answer.node = "/stranger";
  Bytes bytes = encode(answer);
  if (!strict_ && rng_.chance(150))
    bytes[rng_.below(bytes.size())] ^= static_cast<std::uint8_t>(rng_.next());
  send_binary(std::move(bytes));
}

void Hostile::log_in() {
  Hello hello;
  for (auto& byte : hello.side.bytes) byte = static_cast<std::uint8_t>(rng_.next());
  if (rng_.chance(600)) {  // its own session goes on
    if (rng_.chance(900)) hello.side = side_;
    hello.session = session_;
  } else if (rng_.chance(500)) {  // somebody else's session, guessed
    for (auto& byte : hello.session.bytes) byte = static_cast<std::uint8_t>(rng_.next());
  }
  hello.node = "/stranger";
  Bytes first = encode(hello);
  Bytes second = encode(Login{"token", text_bytes(rng_.chance(900) ? secret_ : "wrong")});
  if (!strict_ && rng_.chance(100))
    first[rng_.below(first.size())] ^= static_cast<std::uint8_t>(rng_.next());
  if (!strict_ && rng_.chance(100)) second.resize(rng_.below(second.size()));
  send_binary(std::move(first));
  send_binary(std::move(second));
}

void Hostile::on_packet(ConnectionId id, FlatPacket packet) {
  if (id != connection_) return;
  if (!packet.text) received_ += packet.bytes.size();
  if (seen_.size() < kSeenMax) seen_.push_back(packet);
  if (welcome_) return listen_to(packet);
  if (serves() && ++records_ < 2) return;
  if (serves()) {
    send_welcome();
  } else if (const auto welcome = decode_welcome(packet.bytes)) {
    session_ = welcome.value().session;
  }
  welcome_ = true;
  received_ = 0;
  if (strict_ || rng_.chance(500)) services_.accept_all();
  act();
}

// One step after the other while the connection lasts.
void Hostile::act() {
  if (!connection_ || !welcome_ || stopped_) return;
  if (rng_.chance(strict_ ? 30 : 150)) {
    offended_ = true;
    rng_.chance(strict_ ? 800 : 300) ? commit_service_offence() : commit_offence();
    return;
  }
  if (queue_.size() < kQueueMax / 2) take_step();
  const ConnectionId id = connection_;
  schedule_.after(rng_.between(Duration{100us}, 100ms), [this, id] {
    if (id == connection_) act();
  });
}

void Hostile::take_step() {
  const auto what = rng_.below(100);
  if (strict_) {
    if (what < 15) return acknowledge();
    const std::string step = services_.step();
    if (step.empty()) return;
    if (step == "withdraw") expect_withdraws();
    ++tolerated_;
    last_steps_ += " " + step + ",";
    if (last_steps_.size() > 200) last_steps_.erase(0, last_steps_.find(',') + 1);
  } else if (what < 10) {
    send_noise();
  } else if (what < 30) {
    send_mutated();
  } else if (what < 60) {
    send_plausible();
  } else {
    services_.step();
  }
}

// The peer ends its attachment as soon as it sees that the service is gone.
void Hostile::expect_withdraws() {
  schedule_.after(2s, [this, id = connection_, owed = services_.owed()] {
    if (stopped_ || id != connection_ || offended_ || !network_.is_alive(*this, id)) return;
    for (const auto requests : owed) {
      if (services_.owed().contains(requests))
        violated("a side does not withdraw its requests to a service that is withdrawn");
    }
  });
}

void Hostile::listen_to(const FlatPacket& packet) {
  if (packet.text) {
    const auto control =
        decode_control({reinterpret_cast<const char*>(packet.bytes.data()), packet.bytes.size()});
    if (control) services_.hear(control.value());
    return;
  }
  FrameReader reader(packet.bytes);
  for (;;) {
    const auto next = reader.next();
    if (!next || !next.value()) return;
    if (const auto* frame = std::get_if<MessageFrame>(&*next.value())) services_.hear(*frame);
    if (const auto* texts = std::get_if<TextsFrame>(&*next.value()))
      for (const auto& text : texts_.read(*texts))
        if (const auto control = decode_control(text)) services_.hear(control.value());
  }
}

void Hostile::acknowledge() {
  Bytes bytes;
  append_header(AckFrame{received_}, bytes);
  send_binary(std::move(bytes));
}

std::string Hostile::offer(std::uint32_t channel, const std::string& name) {
  ChannelOffer made;
  made.channel = {channel};
  made.name = name;
  made.type = "std_msgs/msg/String";
  OriginOffer origin;
  origin.origin = {1};
  for (auto& byte : origin.gid.bytes) byte = static_cast<std::uint8_t>(rng_.next());
  origin.node = "/stranger";
  origin.qos.depth = static_cast<std::uint32_t>(rng_.below(1000));
  made.origins.push_back(origin);
  return encode(Control{Offer{{made}, true}});
}

std::string Hostile::listener(std::uint32_t number, const std::string& name) {
  ListenerReport told;
  told.listener = {number};
  told.name = name;
  told.type = rng_.chance(800) ? "std_msgs/msg/String" : "String";
  return encode(Control{Listeners{{told}, {{number + 1}}}});
}

// An offence, on a channel number of its own. The connection must end.
void Hostile::commit_offence() {
  ++offences_;
  const std::uint32_t channel = 1'000'000 + static_cast<std::uint32_t>(offences_);
  const Bytes body(100);
  const auto kind = rng_.below(10);
  switch (kind) {
    case 0:  // data for a channel that was never offered
      send_binary(message(channel, 1, 100, body));
      break;
    case 1:  // a sequence number that does not rise
      send_text(offer(channel, "/hostile/a"));
      send_binary(message(channel, 1, 100, body));
      send_binary(message(channel, 1, 100, body));
      break;
    case 2:  // a part without a message
      send_text(offer(channel, "/hostile/a"));
      {
        Bytes bytes;
        append_header(PartFrame{{channel}, false, body}, bytes);
        bytes.insert(bytes.end(), body.begin(), body.end());
        send_binary(std::move(bytes));
      }
      break;
    case 3:  // a message larger than anybody accepts
      send_text(offer(channel, "/hostile/a"));
      send_binary(message(channel, 1, 0xF0000000U, body));
      break;
    case 4: {  // an acknowledgement of what was never sent
      Bytes bytes;
      append_header(AckFrame{received_ + (1ULL << 40)}, bytes);
      send_binary(std::move(bytes));
      break;
    }
    case 5:  // one channel twice
      send_text(offer(channel, "/hostile/a"));
      send_text(offer(channel, "/hostile/b"));
      break;
    case 6: {  // more of a message than it has
      send_text(offer(channel, "/hostile/a"));
      send_binary(message(channel, 1, 150, body));
      Bytes bytes;
      append_header(PartFrame{{channel}, false, body}, bytes);
      bytes.insert(bytes.end(), body.begin(), body.end());
      send_binary(std::move(bytes));
      break;
    }
    case 7:  // one listener twice
      send_text(listener(channel, "/hostile/a"));
      send_text(listener(channel, "/tf"));
      break;
    case 8:  // an answer to what nobody asked
      send_text(encode(Control{Answered{std::vector<std::string>(kAskedMax - 1, "absent")}}));
      break;
    default:  // no JSON
      send_text("{\"offer\": [");
  }
  expect_the_end(std::to_string(kind), [] { return true; });
}

void Hostile::commit_service_offence() {
  ++offences_;
  auto offence = services_.offend();
  expect_the_end(offence.name, std::move(offence.stands));
}

void Hostile::expect_the_end(const std::string& offence, std::function<bool()> stands) {
  schedule_.after(2s, [this, id = connection_, offence, stands = std::move(stands)] {
    if (!stopped_ && id == connection_ && network_.is_alive(*this, id) && stands()) {
      violated("a side goes on with a peer that broke the protocol, offence " + offence);
    }
  });
}

Bytes Hostile::random_bytes(std::size_t most) {
  Bytes bytes(rng_.below(most) + 1);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(rng_.next());
  return bytes;
}

void Hostile::send_noise() {
  if (rng_.chance(500)) return send_binary(random_bytes(300));
  const Bytes bytes = random_bytes(200);
  send_text(std::string{bytes.begin(), bytes.end()});
}

// Something the server itself sent, with a few bytes changed.
void Hostile::send_mutated() {
  if (seen_.empty()) return;
  FlatPacket packet = rng_.pick(seen_);
  const auto changes = rng_.below(4);
  for (std::uint64_t i = 0; i < changes && !packet.bytes.empty(); ++i) {
    packet.bytes[rng_.below(packet.bytes.size())] = static_cast<std::uint8_t>(rng_.next());
  }
  if (rng_.chance(200)) packet.bytes.resize(rng_.below(packet.bytes.size() + 1));
  if (!packet.bytes.empty()) queue_.push_back(std::move(packet));
  if (connection_) network_.poke(*this, connection_);
}

// Well-formed messages in a meaningless order.
void Hostile::send_plausible() {
  const auto number = static_cast<std::uint32_t>(rng_.below(20));
  const std::vector<std::string> names = {"/hostile/a",  "/hostile/b/c",
                                          "/tf",         "/camera/front/image",
                                          "/hostile//x", "/_connect_bridge/claims",
                                          "hostile",     ""};
  switch (rng_.below(11)) {
    case 0:
    case 1: return send_text(offer(number, rng_.pick(names)));
    case 2: return send_text(encode(Control{Withdraw{{{number}}}}));
    case 3: {
      const auto wanted = static_cast<std::uint16_t>(rng_.chance(600));
      return send_text(encode(Control{Demand{{{{number}, wanted}, {{number + 1}, wanted}}}}));
    }
    case 4: {
      Accepts accepts;
      accepts.rules.push_back({{"/**", "/*/**/*", rng_.pick(names)}, {}});
      return send_text(encode(Control{accepts}));
    }
    case 5: return send_text(encode(Control{Decline{{number}, "failed", "because"}}));
    case 6: return send_text(encode(Control{OriginsChanged{{number}, {}, {{1}, {2}}}}));
    case 7: return send_text(listener(number, rng_.pick(names)));
    case 9: {
      const AskedName asked{static_cast<InterfaceKind>(rng_.below(4)), rng_.pick(names),
                            "std_msgs/msg/String"};
      return send_text(encode(Control{Ask{{asked}}}));
    }
    case 8: {
      Bytes bytes;
      append_header(TimeRequest{static_cast<Stamp>(rng_.below(1ULL << 62))}, bytes);
      append_header(TimeReply{1, static_cast<Stamp>(rng_.below(1ULL << 62)), 3, 0}, bytes);
      return send_binary(std::move(bytes));
    }
    default: {
      const Bytes body = random_bytes(200);
      return send_binary(message(number, static_cast<std::uint32_t>(rng_.below(5)) + 1,
                                 static_cast<std::uint32_t>(body.size()), body,
                                 static_cast<Codec>(rng_.below(5)),
                                 static_cast<std::uint32_t>(rng_.below(100'000))));
    }
  }
}

void Hostile::send_binary(Bytes bytes) {
  if (!connection_ || queue_.size() > kQueueMax || bytes.empty()) return;
  queue_.push_back({false, std::move(bytes)});
  network_.poke(*this, connection_);
}

void Hostile::send_text(const std::string& text) {
  if (!connection_ || queue_.size() > kQueueMax || text.empty()) return;
  queue_.push_back({true, text_bytes(text)});
  network_.poke(*this, connection_);
}

std::optional<FlatPacket> Hostile::pull(ConnectionId id) {
  if (id != connection_ || queue_.empty()) return {};
  FlatPacket packet = std::move(queue_.front());
  queue_.pop_front();
  return packet;
}

}  // namespace connect_bridge::sim
