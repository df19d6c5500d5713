#include "unit/side/script.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>
#include <variant>

#include "core/compress/compress.hpp"
#include "core/wire/login.hpp"

namespace connect_bridge::side_test {

SideOptions server(std::vector<Rule> rules) {
  SideOptions result;
  result.node = "/own";
  result.policy = Policy(std::move(rules));
  return result;
}
SideOptions client(std::vector<Rule> rules) {
  SideOptions result = server(std::move(rules));
  result.role = Role::kClient;
  return result;
}

SideOptions keeping(const Treatment& treatment) {
  auto treated = everything();
  treated.treatment = treatment;
  auto options = server({treated});
  options.resume_for = std::chrono::seconds(60);
  return options;
}

namespace {

SideOptions in_plain(SideOptions options) {
  options.outbox.compressed_texts_min = std::numeric_limits<std::size_t>::max();
  return options;
}

}  // namespace

Script::Script(SideOptions options, bool plain)
    : side(plain ? in_plain(std::move(options)) : std::move(options), 1, 0) {}
Script::~Script() = default;

void Script::give(Input input) {
  side.handle(std::move(input), flow_test::now_ms(at));
}

void Script::graph(const std::vector<Topic>& topics, std::vector<ServiceState> services) {
  GraphChanged picture;
  for (const auto& t : topics) picture.topics.push_back(t);
  picture.services = std::move(services);
  give(picture);
}

void Script::take(std::uint32_t subscription, std::uint8_t n, const std::string& text,
                  std::int64_t stamp_ms, std::uint64_t number) {
  const Stamp stamp = flow_test::at_ms(stamp_ms < 0 ? at : stamp_ms);
  give(MessageTaken{{subscription}, gid(n), stamp, sample(text), number});
}

void Script::claim(std::uint8_t publisher, std::uint8_t side_id, const std::vector<Gid>& origins) {
  Claim claim;
  claim.side.bytes.fill(side_id);
  claim.origins = origins;
  give(MessageTaken{{1}, gid(publisher), 0, serialize(claim, 0)});
}

void Script::claim_service(std::uint8_t publisher, std::uint8_t side_id,
                           const std::string& service) {
  Claim claim;
  claim.side.bytes.fill(side_id);
  claim.services = {service_gid(service)};
  give(MessageTaken{{1}, gid(publisher), 0, serialize(claim, 0)});
}

void Script::binary(std::uint32_t connection, const Bytes& packet) {
  give(PacketReceived{{connection}, false, Payload::copy_of(packet)});
}

void Script::say(std::uint32_t connection, const Control& control) {
  for (const std::string& text : encode_parts(control)) say_text(connection, text);
}

void Script::offer(std::uint32_t connection, const std::vector<ChannelOffer>& channels,
                   bool complete) {
  for (const std::string& text : encode_offers(channels, complete)) say_text(connection, text);
}

void Script::say_text(std::uint32_t connection, const std::string& text) {
  give(PacketReceived{{connection}, true, Payload::copy_of(Bytes(text.begin(), text.end()))});
}

void Script::demand(std::uint32_t connection, std::uint32_t channel, bool on) {
  say(connection, Demand{{{{channel}, static_cast<std::uint16_t>(on ? 1 : 0)}}});
}

void Script::message(std::uint32_t connection, std::uint32_t channel, std::uint32_t origin,
                     const std::string& text, std::int64_t stamp_ms) {
  const Payload body = sample(text);
  message(connection, channel, origin, body, Codec::kNone, static_cast<std::uint32_t>(body.size()),
          stamp_ms);
}

void Script::message(std::uint32_t connection, std::uint32_t channel, std::uint32_t origin,
                     const Payload& body, Codec codec, std::uint32_t raw_bytes,
                     std::int64_t stamp_ms, std::uint64_t number) {
  MessageFrame frame;
  frame.codec = codec;
  frame.channel = {channel};
  frame.subject = {origin};
  frame.sequence = ++sequence_;
  const auto demand = demands_.find({connection, frame.channel});
  frame.demand = demand == demands_.end() ? 1 : demand->second;
  frame.stamp = flow_test::at_ms(stamp_ms < 0 ? at : stamp_ms);
  frame.number = number;
  if (number == 0 && stamp_ms >= 0) frame.number = static_cast<std::uint64_t>(stamp_ms);
  frame.raw_bytes = raw_bytes;
  frame.body_bytes = static_cast<std::uint32_t>(body.size());
  frame.part = body.view();
  Bytes bytes;
  append_header(frame, bytes);
  bytes.insert(bytes.end(), body.view().begin(), body.view().end());
  binary(connection, bytes);
}

void Script::compressed(std::uint32_t connection, std::uint32_t channel, std::uint32_t origin,
                        const std::string& text) {
  const Payload raw = sample(text);
  const auto body = compress(raw.view(), {Codec::kZstd, 3});
  message(connection, channel, origin, Payload::adopt(body.value()), Codec::kZstd,
          static_cast<std::uint32_t>(raw.size()));
}

void Script::lose(std::uint32_t connection, std::optional<std::uint16_t> code) {
  living_.erase(connection);
  give(ConnectionClosed{{connection}, code, "lost"});
}

void Script::fall_silent(std::uint32_t connection) {
  living_.erase(connection);
}

void Script::pass_to(std::int64_t ms) {
  while (at < ms) {
    for (const auto connection : living_) binary(connection, {});
    const std::int64_t step = std::min(at + 500, ms);
    for (auto next = side.next_deadline(); next && *next <= flow_test::now_ms(step).steady;
         next = side.next_deadline()) {
      using std::chrono::milliseconds;
      at = std::max(at, std::chrono::ceil<milliseconds>(*next - TimePoint{}).count());
      give(TimePassed{});
    }
    at = step;
  }
}

void Script::pass(std::int64_t ms) {
  pass_to(at + ms);
}

Token128 Script::login(std::uint32_t connection, Token128 session, const Identity& who) {
  give(ConnectionOpened{
      {connection}, "10.0.0." + std::to_string(connection), {}, 1, {}, certified_until});
  const auto known = peers_.find(session);
  const Token128 peer = known == peers_.end() ? peer_id(connection) : known->second;
  binary(connection, encode(Hello{1, 1, peer, session, "/peer"}));
  binary(connection, encode(Login{"none", {}}));
  give(Authenticated{{connection}, who, ""});
  session = welcomed(connection);
  peers_[session] = peer;
  return session;
}

void Script::be_welcomed(std::uint32_t connection, std::uint32_t message_bytes_max,
                         Token128 session) {
  ConnectionOpened opened{{connection}, "10.0.0.1"};
  opened.server = server_is;
  give(std::move(opened));
  while (side.next_packet({connection}, flow_test::now_ms(at))) {
  }
  Welcome welcome;
  welcome.side = peer_id(100);
  welcome.session = session;
  welcome.message_bytes_max = message_bytes_max;
  binary(connection, encode(welcome));
  living_.insert(connection);
}

Token128 Script::join(std::uint32_t connection, Token128 session) {
  session = login(connection, session);
  say(connection, Accepts{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}});
  did();
  said(connection);
  return session;
}

std::string Script::did() {
  std::string lines;
  while (const auto action = side.next_action()) {
    if (const auto* log = std::get_if<Log>(&*action)) logged += log->text + "\n";
    if (const auto* line = std::get_if<Audit>(&*action)) noted += word_of(*line) + "\n";
    if (const auto* request = std::get_if<SendRequest>(&*action); request && request->line)
      noted += word_of(*request->line) + "\n";
    const std::string word = word_of(*action);
    if (!word.empty() && !is_repeated(word)) lines += word + "\n";
  }
  return lines;
}

bool Script::is_repeated(const std::string& word) {
  if (word.starts_with("unmirror")) claimed_.clear();
  if (!word.starts_with("claim [")) return false;
  ++claims;
  return std::exchange(claimed_, word) == word;
}

std::string Script::said(std::uint32_t connection) {
  std::string lines;
  while (const auto packet = side.next_packet({connection}, flow_test::now_ms(at))) {
    const std::string line = line_of(*packet);
    if (const auto demand = demand_of(*packet))
      for (const auto& of : demand->channels)
        if (of.number) demands_[{connection, of.channel}] = of.number;
    if (!packet->text) sent_bytes_[connection] += packet->size();
    if (!line.empty()) lines += line + "\n";
  }
  return lines;
}

void Script::acknowledge(std::uint32_t connection) {
  Bytes bytes;
  append_header(AckFrame{sent_bytes_[connection]}, bytes);
  binary(connection, bytes);
}

Status Script::status() const {
  return side.status(flow_test::now_ms(at));
}

std::uint64_t Script::dropped(DropReason reason, std::size_t link) const {
  return status().links.at(link).topics.at(0).dropped.of(reason);
}

Token128 Script::peer_id(std::uint32_t n) {
  Token128 result;
  result.bytes.fill(static_cast<std::uint8_t>(100 + n));
  return result;
}

Token128 Script::welcomed(std::uint32_t connection) {
  const auto packet = side.next_packet({connection}, flow_test::now_ms(at));
  if (!packet) return {};
  const auto welcome = decode_welcome(flow_test::joined(*packet));
  living_.insert(connection);
  return welcome ? welcome.value().session : Token128{};
}

}  // namespace connect_bridge::side_test
