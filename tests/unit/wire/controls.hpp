// Control messages for tests: what was read, and what to send.
#pragma once

#include <gtest/gtest.h>

#include <string_view>

#include "core/wire/control.hpp"

namespace connect_bridge::control_test {

template <class Message>
Message read(std::string_view text) {
  const auto message = decode_control(text);
  EXPECT_TRUE(message.ok()) << message.error().message;
  if (!message.ok()) return {};
  const auto* value = std::get_if<Message>(&message.value());
  EXPECT_NE(value, nullptr);
  return value == nullptr ? Message{} : *value;
}

inline CloseCode code_of(std::string_view text) {
  const auto message = decode_control(text);
  return message.ok() ? CloseCode::kNormal : message.error().code;
}

inline ChannelOffer channel(std::uint32_t number, std::size_t origins = 1) {
  ChannelOffer offer;
  offer.channel.value = number;
  offer.name = "/topic";
  offer.type = "std_msgs/msg/String";
  for (std::uint32_t i = 1; i <= origins; ++i) {
    OriginOffer origin;
    origin.origin.value = i;
    origin.node = "/node";
    offer.origins.push_back(origin);
  }
  return offer;
}

}  // namespace connect_bridge::control_test
