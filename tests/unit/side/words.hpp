// What a side does and says, as words: actions, control texts, frames.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/graph/graph_view.hpp"
#include "core/ports/ports.hpp"
#include "core/wire/control.hpp"
#include "unit/flow/script.hpp"

namespace connect_bridge::side_test {

// Publisher n of a participant of its own; printed as n.
Gid gid(std::uint8_t n);

// "reliable volatile 10"; "latched" is transient local; "all" is keep-all.
std::string word_of(const Qos& qos);
// Ids are printed as they are: the claims have subscription 1 and mirror 1. "claim 1 2" is what
// the side tells other bridges: the origins and services that it mirrors, or will. Logs have no
// word.
std::string word_of(const Action& action);
// "login 1 anna", "channel_opened 1 anna export /a by all", "call_refused 1 anna export /s: why"
std::string word_of(const Audit& line);
// "1[2 3]" is origins 2 and 3 of channel 1.
std::string word_of(const Control& control);
// What one packet says, without acks and time frames: "1.2 hello" is a message of origin 2 on
// channel 1.
std::string line_of(const Packet& packet);
// What the packet says if that is a demand.
std::optional<Demand> demand_of(const Packet& packet);

// A serialized sample: encapsulation, then text.
Payload sample(const std::string& text);
std::string text_of(ByteView raw);

// How often a word is in the text.
std::int64_t times(const std::string& text, const std::string& word);

// Numbers with a space between them; `number` takes the number out of an element.
template <class Numbers, class Number>
std::string list_of(const Numbers& numbers, Number&& number) {
  std::string line;
  for (const auto& n : numbers)
    line += (line.empty() ? "" : " ") + std::to_string(static_cast<unsigned>(number(n)));
  return line;
}

// Topics of the graph, told in one line: topic("/a").pub(1).sub(2).
struct Topic : TopicState {
  Topic& pub(std::uint8_t n, const Qos& qos = {}, const std::string& node = "");
  Topic& sub(std::uint8_t n, const Qos& qos = {}, const std::string& node = "");
};
inline constexpr char kType[] = "p/msg/T";
Topic topic(std::string name);

Qos qos(std::uint32_t depth = 10);
Qos best_effort(std::uint32_t depth = 10);
Qos latched(std::uint32_t depth = 1);

OriginOffer origin(std::uint32_t id, std::uint8_t publisher, const Qos& q = qos());
ChannelOffer channel(std::uint32_t id, std::string name, std::vector<OriginOffer> origins);

Identity called(const std::string& name);

Rule rule(const std::vector<std::string>& exported, const std::vector<std::string>& imported,
          const std::vector<std::string>& denied = {});
// All topics, both ways.
Rule everything();
// All topics and services, both ways.
Rule callable();

inline constexpr char kServiceType[] = "p/srv/S";
// A service with a server for each number; 0 is a server whose gid is not told.
ServiceState service(std::string name, const std::vector<std::uint8_t>& servers = {1});
ChannelOffer service_channel(std::uint32_t id, std::string name, std::uint32_t epoch = 7);

}  // namespace connect_bridge::side_test
