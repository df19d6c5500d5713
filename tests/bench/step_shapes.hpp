// Packets of one peer that are legal and that take a side long.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bench/control_shapes.hpp"
#include "bench/loaded_side.hpp"

namespace bench {

struct StepShape {
  std::string name;
  bool text = true;
  Bytes packet;
};

inline StepShape step_of(const char* name, const Control& control) {
  const std::string text = encode(control);
  return {name, true, Bytes(text.begin(), text.end())};
}

inline Demand demand_of(std::size_t count, std::uint16_t number) {
  Demand demand;
  for (std::uint32_t n = 1; n <= count; ++n)
    demand.channels.push_back({.channel = {n}, .number = number});
  return demand;
}

inline void add_channels(std::vector<StepShape>& shapes, std::uint32_t offered) {
  const auto channels = [](std::size_t count) {
    std::vector<ChannelId> all;
    for (std::uint32_t n = 1; n <= count; ++n) all.push_back({n});
    return all;
  };
  const auto add = [&](const char* name, const Control& control) {
    shapes.push_back(step_of(name, control));
  };
  const std::string longest(200, 'x');

  Offer offer;
  for (std::uint32_t n = 1; n <= kOfferChannelsMax; ++n) {
    offer.channels.push_back(LoadedSide::channel(offered + n));
    offer.channels.back().name += longest;
  }
  add("an offer of 256 topics", offer);
  Offer again;
  for (std::uint32_t n = 1; n <= kOfferChannelsMax; ++n) {
    again.channels.push_back(LoadedSide::channel(n));
    again.channels.back().channel = {offered + n};
  }
  add("an offer of topics that it offers", again);
  for (const std::uint16_t number : {std::uint16_t{0}, std::uint16_t{2}})
    add(number == 0 ? "a demand that ends 1,024" : "a demand of 1,024",
        demand_of(kDemandChannelsMax, number));
  add("a withdraw of all", Withdraw{channels(std::min<std::size_t>(offered, kChannelIdsMax))});
}

inline void add_accepts(std::vector<StepShape>& shapes) {
  const auto add = [&](const char* name, const Control& control) {
    shapes.push_back(step_of(name, control));
  };
  Accepts names;
  names.rules.emplace_back();
  for (std::size_t n = 0; n < kAcceptEntriesMax; ++n)
    names.rules[0].topics.push_back("/down" + std::to_string(n) + std::string(40, 'y'));
  add("an accepts of 4,096 names", names);
  Accepts wild;
  for (std::size_t n = 0; n < kWildcardsMax; ++n)
    wild.rules.push_back({{"/**/" + std::string(5, 'd') + "*" + std::to_string(n)}, {}});
  add("an accepts of 256 wildcards", wild);
  Accepts rules;
  for (std::size_t n = 0; n < kAcceptRulesMax; ++n)
    rules.rules.push_back({{"/down1"}, {"q/msg/T"}});
  add("an accepts of 1,024 rules", rules);
}

inline void add_others(std::vector<StepShape>& shapes, std::uint32_t offered,
                       std::uint32_t listeners) {
  const auto add = [&](const char* name, const Control& control) {
    shapes.push_back(step_of(name, control));
  };
  const std::string longest(200, 'x');
  OriginsChanged origins{{1}, {}, {}};
  for (std::uint32_t n = 2; n < 2 + kAddedMax; ++n) {
    OriginOffer origin = LoadedSide::channel(offered + n).origins[0];
    origin.origin = {n};
    origins.added.push_back(origin);
  }
  add("64 origins of a topic", origins);
  Listeners more;
  for (std::uint32_t n = 1; n <= std::min<std::size_t>(kRemovedMax, listeners); ++n)
    more.removed.push_back({n});
  for (std::uint32_t n = 1; n <= kAddedMax; ++n)
    more.added.push_back({{n}, "/fresh" + longest + std::to_string(n), "p/msg/T", {}});
  add("1,024 listeners go, 64 come", more);
  std::vector<CallId> calls;
  for (std::uint32_t n = 1; n <= kCallIdsMax; ++n) calls.push_back({n});
  add("a forget of 8,192 calls", Forget{{1}, calls});
  for (const auto& [name, text] : control_shapes())
    if (decode_control(text).ok()) shapes.push_back({name, true, Bytes(text.begin(), text.end())});
}

inline void add_frames(std::vector<StepShape>& shapes) {
  Bytes times;
  for (Stamp n = 1; n <= Stamp{kPacketFramesMax}; ++n) append_header(TimeRequest{n}, times);
  shapes.push_back({"1,024 time requests", false, times});
  Bytes asks;
  for (std::uint32_t n = 0; n < kPacketFramesMax; ++n) append_header(AckRequest{}, asks);
  shapes.push_back({"1,024 requests of an acknowledgement", false, asks});
  Bytes samples;
  for (std::uint32_t n = 1; n <= kPacketFramesMax; ++n) {
    const Bytes body{0, 1, 0, 0, 1, 2, 3, 4};
    MessageFrame frame;
    frame.channel = {1};
    frame.subject = {1};
    frame.sequence = n;
    frame.demand = 1;
    frame.raw_bytes = frame.body_bytes = static_cast<std::uint32_t>(body.size());
    frame.part = body;
    append_header(frame, samples);
    samples.insert(samples.end(), body.begin(), body.end());
  }
  shapes.push_back({"1,024 samples", false, samples});
}

// For a side with so many topics and listeners of the peer.
inline std::vector<StepShape> step_shapes(std::uint32_t offered, std::uint32_t listeners) {
  std::vector<StepShape> shapes;
  add_channels(shapes, offered);
  add_accepts(shapes);
  add_others(shapes, offered, listeners);
  add_frames(shapes);
  return shapes;
}

}  // namespace bench
