#include "unit/side/words.hpp"

#include <utility>
#include <variant>

#include "core/base/overloaded.hpp"
#include "core/graph/claims.hpp"

namespace connect_bridge::side_test {

Gid gid(std::uint8_t n) {
  Gid result;
  result.bytes[0] = n;
  return result;
}

std::string word_of(const Qos& qos) {
  return std::string(qos.reliability == Reliability::kReliable ? "reliable" : "best_effort") +
         (qos.durability == Durability::kVolatile ? " volatile " : " latched ") +
         std::to_string(qos.depth) + (qos.history == History::kKeepAll ? " all" : "");
}

Payload sample(const std::string& text) {
  Bytes bytes{0, 1, 0, 0};
  bytes.insert(bytes.end(), text.begin(), text.end());
  return Payload::adopt(std::move(bytes));
}
std::int64_t times(const std::string& text, const std::string& word) {
  std::int64_t found = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1))
    ++found;
  return found;
}

std::string text_of(ByteView raw) {
  if (raw.size() < 4) return "?";
  // Not by iterators: without optimization that takes seconds for some tests.
  return {reinterpret_cast<const char*>(raw.data()) + 4, raw.size() - 4};
}

namespace {

std::string with(std::string line, const std::vector<std::string>& more) {
  for (const auto& word : more) line += " " + word;
  return line;
}

std::string words_of(const Claim& claim) {
  std::string words;
  for (const auto& claimed : {claim.origins, claim.services})
    for (const Gid& gid : claimed)
      words += (words.empty() ? "" : " ") + std::to_string(gid.bytes[0]);
  return words;
}

}  // namespace

std::string word_of(const Action& action) {
  const auto id = [](auto i) { return std::to_string(i.value); };
  return std::visit(
      Overloaded{
          [&](const CreateSubscription& a) {
            return "subscribe " + id(a.id) + " " + a.topic + " " + word_of(a.qos);
          },
          [&](const DestroySubscription& a) { return "unsubscribe " + id(a.id); },
          [&](const CreateMirror& a) {
            return "mirror " + id(a.id) + " " + a.topic + " " + word_of(a.qos);
          },
          [&](const DestroyMirror& a) { return "unmirror " + id(a.id); },
          [&](const Publish& a) {
            const auto claim = parse_claim(a.payload.view());
            if (!claim) return "publish " + id(a.mirror) + " " + text_of(a.payload.view());
            return "claim [" + words_of(*claim) + "]" +
                   (claim->good_for == Duration::zero() ? " and ends" : "");
          },
          [&](const CreateServiceMirror& a) {
            return "mirror_service " + id(a.id) + " " + a.service;
          },
          [&](const DestroyServiceMirror& a) { return "unmirror_service " + id(a.id); },
          [&](const SendResponse& a) {
            return "respond " + id(a.mirror) + "." + id(a.request) + " " +
                   text_of(a.payload.view());
          },
          [&](const DropRequest& a) {
            return (a.aborted ? "abort_request " : "drop_request ") + id(a.mirror) + "." +
                   id(a.request);
          },
          [&](const CreateServiceClient& a) {
            return "call_service " + id(a.id) + " " + a.service;
          },
          [&](const DestroyServiceClient& a) { return "uncall_service " + id(a.id); },
          [&](const SendRequest& a) {
            return "invoke " + id(a.client) + "." + id(a.invocation) + " " +
                   text_of(a.payload.view());
          },
          [&](const DropInvocation& a) {
            return "drop_invocation " + id(a.client) + "." + id(a.invocation);
          },
          [&](const FollowClock& a) -> std::string {
            return std::string("clock ") + (a.on ? "followed" : "not followed");
          },
          [&](const RefreshGraph& refresh) { return "refresh " + refresh.topic; },
          [&](const Dial& a) { return "dial " + id(a.connection); },
          [&](const OpenGate& a) { return "gate " + id(a.connection); },
          [&](const CloseConnection& a) {
            return "close " + id(a.connection) + " " + std::to_string(static_cast<int>(a.code));
          },
          [&](const Authenticate& a) {
            return "authenticate " + id(a.connection) + " " + a.method +
                   (a.renewal ? " renewal" : "") + (a.turn.empty() ? "" : " turn " + a.turn);
          },
          [&](const CompressJob& a) { return "compress " + id(a.job); },
          [&](const DecompressJob& a) { return "decompress " + id(a.job); },
          [&](const EncodePicture& a) { return "encode " + id(a.job) + (a.base ? " base" : ""); },
          [&](const DecodePicture& a) { return "decode " + id(a.job); },
          [&](const EndPicture& a) { return "end picture " + id(a.picture); },
          [&](const CancelJob& a) { return "cancel " + id(a.job); },
          [&](const Log&) -> std::string { return ""; },
          [&](const Audit&) -> std::string { return ""; },
          [&](const Stopped&) -> std::string { return "stopped"; },
      },
      action);
}

std::string word_of(const Audit& line) {
  std::string word =
      std::string(word_of(kAuditWords, line.event)) + " " + std::to_string(line.link.value);
  if (!line.identity.empty()) word += " " + line.identity;
  if (line.channel) {
    word += line.channel->direction == Direction::kExport ? " export " : " import ";
    word += line.channel->name;
    if (!line.channel->rule.empty()) word += " by " + line.channel->rule;
  }
  for (const auto& group : line.groups) word += " " + group;
  if (!line.code.empty()) word += " " + line.code;
  return line.reason.empty() ? word : word + ": " + line.reason;
}

// A line for each run of channels that are demanded alike.
std::string word_of_demands(const std::vector<ChannelDemand>& channels) {
  std::string lines;
  std::string before;
  for (const auto& demand : channels) {
    std::string how = demand.number ? " on" : " off";
    if (demand.resume) how += " resume";
    if (demand.live) how += " live";
    if (demand.after) how += " after " + std::to_string(*demand.after);
    for (const auto& held : demand.has)
      how += " has " + std::to_string(held.origin.value) + ":" + std::to_string(held.number);
    if (how != before) lines += before + (lines.empty() ? "demand" : "\ndemand");
    lines += " " + std::to_string(demand.channel.value);
    before = how;
  }
  return lines + before;
}

std::string word_of(const Control& control) {
  const auto ids = [](const auto& list) { return list_of(list, [](auto i) { return i.value; }); };
  const auto origins = [](const std::vector<OriginOffer>& list) {
    return "[" + list_of(list, [](const OriginOffer& o) { return o.origin.value; }) + "]";
  };
  return std::visit(
      Overloaded{
          [&](const Offer& m) {
            std::string line = "offer";
            for (const auto& c : m.channels)
              line += " " + std::to_string(c.channel.value) + c.name + origins(c.origins);
            return line + (m.complete ? " complete" : "");
          },
          [&](const OriginsChanged& m) {
            const std::string too_large = " too large " + std::to_string(m.too_large) + " (" +
                                          std::to_string(m.too_large_bytes) + ")";
            return "origins " + std::to_string(m.channel.value) + " +" + origins(m.added) + " -[" +
                   ids(m.removed) + "]" + (m.too_large == 0 ? "" : too_large);
          },
          [&](const Withdraw& m) {
            return "withdraw " + ids(m.channels) + (m.code.empty() ? "" : " " + m.code);
          },
          [&](const Demand& m) { return word_of_demands(m.channels); },
          [&](const Wheel& m) {
            return "wheel " + std::to_string(m.channel.value) +
                   (m.state                      ? " state"
                    : m.want == WheelWant::kTake ? " want take"
                                                 : " want leave");
          },
          [&](const Accepts& m) { return "accepts " + std::to_string(m.rules.size()) + " rules"; },
          [&](const Listeners& m) {
            std::string line = "listeners";
            for (const auto& l : m.added) line += " +" + std::to_string(l.listener.value) + l.name;
            return line + " -[" + ids(m.removed) + "]";
          },
          [&](const Decline& m) {
            return "decline " + std::to_string(m.channel.value) + " " + m.code;
          },
          [&](const Attach& m) {
            return "attach " + std::to_string(m.channel.value) + " " +
                   std::to_string(m.requests.value);
          },
          [&](const Attached& m) {
            return "attached " + std::to_string(m.channel.value) + " " +
                   std::to_string(m.requests.value) + " seen " + std::to_string(m.seen.value) +
                   (m.calls.empty() ? "" : " open " + ids(m.calls));
          },
          [&](const Ask& m) {
            std::string line = "ask";
            for (const auto& asked : m.names) line += " " + asked.name;
            return line;
          },
          [&](const Answered& m) { return with("answer", m.codes); },
          [&](const Renew& m) { return "renew " + m.method + " " + m.credential; },
          [&](const Renewed& m) {
            return std::string(m.accepted ? "renewed accepted" : "renewed refused");
          },
          [&](const Refuse& m) {
            return "refuse " + std::to_string(m.channel.value) + " " + ids(m.calls) + " " + m.code;
          },
          [&](const Forget& m) {
            return "forget " + std::to_string(m.channel.value) + " " + ids(m.calls);
          },
          [](const Findings& m) { return "findings " + std::to_string(m.list.size()); },
      },
      control);
}

std::optional<Demand> demand_of(const Packet& packet) {
  if (!packet.text) return std::nullopt;
  const Bytes bytes = flow_test::joined(packet);
  const auto control = decode_control({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  const auto* demand = control ? std::get_if<Demand>(&control.value()) : nullptr;
  return demand ? std::optional(*demand) : std::nullopt;
}

std::string line_of(const Packet& packet) {
  const Bytes bytes = flow_test::joined(packet);
  if (packet.text) {
    const auto control =
        decode_control({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    if (!control) return "MALFORMED";
    // These have tests of their own (topics/told_listeners_test.cpp, side/missing_test.cpp).
    const bool is_left_out = std::holds_alternative<Listeners>(control.value()) ||
                             std::holds_alternative<Ask>(control.value()) ||
                             std::holds_alternative<Answered>(control.value());
    return is_left_out ? "" : word_of(control.value());
  }
  std::string line;
  FrameReader reader(bytes);
  for (;;) {
    const auto frame = reader.next();
    if (!frame) return line + " MALFORMED";
    if (!frame.value()) return line;
    std::string word;
    if (const auto* m = std::get_if<MessageFrame>(&*frame.value())) {
      const char* codecs[] = {"",       " lz4",          " zstd",          " base",
                              " delta", " picture base", " picture delta", " cloud",
                              " planes"};
      word = std::to_string(m->channel.value) + "." + std::to_string(m->subject.value) +
             (m->codec == Codec::kNone ? " " + text_of(m->part)
                                       : codecs[static_cast<std::size_t>(m->codec)]);
    } else if (const auto* p = std::get_if<PartFrame>(&*frame.value())) {
      word = std::to_string(p->channel.value) + (p->abort ? "!" : "+");
    }
    if (!word.empty()) line += (line.empty() ? "" : ", ") + word;
  }
}

Topic& Topic::pub(std::uint8_t n, const Qos& qos, const std::string& node) {
  publishers.push_back({gid(n), "/", node.empty() ? "n" + std::to_string(n) : node, qos});
  return *this;
}
Topic& Topic::sub(std::uint8_t n, const Qos& qos, const std::string& node) {
  subscribers.push_back({gid(n), "/", node.empty() ? "n" + std::to_string(n) : node, qos});
  return *this;
}
Topic topic(std::string name) {
  Topic result;
  result.name = std::move(name);
  result.type = kType;
  return result;
}

Qos qos(std::uint32_t depth) {
  Qos result;
  result.depth = depth;
  return result;
}
Qos best_effort(std::uint32_t depth) {
  Qos result = qos(depth);
  result.reliability = Reliability::kBestEffort;
  return result;
}
Qos latched(std::uint32_t depth) {
  Qos result = qos(depth);
  result.durability = Durability::kTransientLocal;
  return result;
}

OriginOffer origin(std::uint32_t id, std::uint8_t publisher, const Qos& q) {
  return {{id}, gid(publisher), "/peer_node", q};
}
ChannelOffer channel(std::uint32_t id, std::string name, std::vector<OriginOffer> origins) {
  ChannelOffer result;
  result.channel = {id};
  result.name = std::move(name);
  result.type = kType;
  result.origins = std::move(origins);
  return result;
}

Identity called(const std::string& name) {
  Identity who;
  who.name = name;
  return who;
}

Rule rule(const std::vector<std::string>& exported, const std::vector<std::string>& imported,
          const std::vector<std::string>& denied) {
  const auto patterns = [](const std::vector<std::string>& texts) {
    std::vector<Pattern> result;
    for (const auto& text : texts) result.push_back(Pattern::parse(text).value());
    return result;
  };
  Rule result;
  result.name = "rule";
  result.opens[Direction::kExport][OpenedBy::kTopics] = patterns(exported);
  result.opens[Direction::kImport][OpenedBy::kTopics] = patterns(imported);
  result.deny = patterns(denied);
  return result;
}
Rule callable() {
  Rule result = rule({"/**"}, {"/**"});
  result.opens[Direction::kExport][OpenedBy::kServices] =
      result.opens[Direction::kImport][OpenedBy::kServices] = {Pattern::parse("/**").value()};
  return result;
}

ServiceState service(std::string name, const std::vector<std::uint8_t>& servers) {
  ServiceState result;
  result.name = std::move(name);
  result.type = kServiceType;
  for (const auto n : servers) result.servers.push_back({gid(n), "/", "n" + std::to_string(n)});
  return result;
}
ChannelOffer service_channel(std::uint32_t id, std::string name, std::uint32_t epoch) {
  ChannelOffer result;
  result.channel = {id};
  result.kind = InterfaceKind::kService;
  result.name = std::move(name);
  result.type = kServiceType;
  result.node = "/robot/peer_node";
  result.epoch = epoch;
  return result;
}

Rule everything() {
  return rule({"/**"}, {"/**"});
}

}  // namespace connect_bridge::side_test
