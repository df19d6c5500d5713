// A robot that one operator drives: what a command costs the robot's side.
#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "bench/side_step.hpp"
#include "core/base/cdr.hpp"
#include "core/wire/control.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/login.hpp"

namespace bench {

using namespace connect_bridge;

class DrivenRobot {
 public:
  // `wheel`: its rule has one, and `halt_after`.
  explicit DrivenRobot(bool wheel) : side_(options(wheel), 1, 0) {
    TopicState driven{kTopic, kType, "", {}, {{gid(1, 2), "/", "base", {}}}};
    give(GraphChanged{{driven}});
    give(ConnectionOpened{kConnection, "10.0.0.1:1"});
    Hello hello;
    hello.side.bytes.fill(9);
    hello.node = "/peer";
    receive(encode(hello));
    receive(encode(Login{"none", {}}));
    Identity who;
    who.name = "peer";
    give(Authenticated{kConnection, who, ""});
    ChannelOffer offer;
    offer.channel = {1};
    offer.name = kTopic;
    offer.type = kType;
    offer.origins.push_back({{1}, gid(1, 3), "/peer", {}});
    hear(Offer{{offer}, true});
    pass(std::chrono::seconds(3));
  }

  // Processor time in microseconds for a command that moves, the mean of so many, 50 ms apart.
  double microseconds(std::uint32_t commands) {
    double seconds = 0;
    for (std::uint32_t i = 0; i < commands; ++i) {
      pass(std::chrono::milliseconds(50));
      Bytes bytes = command(++number_);
      seconds += give(PacketReceived{kConnection, false, Payload::adopt(std::move(bytes))});
    }
    return 1e6 * seconds / commands;
  }
  [[nodiscard]] std::uint64_t published() const { return published_; }

 private:
  static constexpr ConnectionId kConnection{1};
  static constexpr char kTopic[] = "/cmd_vel";
  static constexpr char kType[] = "geometry_msgs/msg/TwistStamped";

  static SideOptions options(bool wheel) {
    SideOptions options;
    options.outbox.compressed_texts_min = kPacketBytesMax;  // they are read here
    options.at_robot = true;
    options.dead_after = std::chrono::hours(1);
    Rule rule;
    rule.opens[Direction::kImport][OpenedBy::kTopics] = {Pattern::parse("/**").value()};
    rule.treatment.max_age = std::chrono::milliseconds(500);
    rule.treatment.wheel = wheel;
    if (wheel) rule.treatment.halt_after = std::chrono::milliseconds(500);
    options.policy = Policy({rule});
    options.audits = true;
    return options;
  }

  // The clocks agree.
  void answer(const Packet& packet) {
    const std::string bytes = text_of(packet);
    FrameReader frames({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    for (;;) {
      const auto frame = frames.next();
      if (!frame.ok() || !frame.value()) return;
      const auto* const asked = std::get_if<TimeRequest>(&*frame.value());
      if (!asked) continue;
      Bytes reply;
      append_header(TimeReply{asked->t1, asked->t1, asked->t1, 0}, reply);
      replies_.push_back(std::move(reply));
    }
  }
  Bytes command(std::uint64_t number) const {
    CdrWriter writer;
    writer.u32(static_cast<std::uint32_t>(now_.system / kStampSecond))
        .u32(static_cast<std::uint32_t>(now_.system % kStampSecond))
        .string("base");
    for (int i = 0; i < 6; ++i) writer.u64(std::bit_cast<std::uint64_t>(i == 0 ? 0.5 : 0.0));
    const Payload body = writer.take();
    MessageFrame frame;
    frame.channel = {1};
    frame.subject = {1};
    frame.sequence = static_cast<std::uint32_t>(number);
    frame.demand = demand_;
    frame.number = number;
    frame.stamp = now_.system;
    frame.raw_bytes = frame.body_bytes = static_cast<std::uint32_t>(body.size());
    frame.part = body.view();
    Bytes bytes;
    append_header(frame, bytes);
    bytes.insert(bytes.end(), body.view().begin(), body.view().end());
    return bytes;
  }

  void hear(const Control& control) {
    const std::string text = encode(control);
    give(PacketReceived{kConnection, true, Payload::copy_of(Bytes(text.begin(), text.end()))});
  }
  void receive(const Bytes& bytes) {
    give(PacketReceived{kConnection, false, Payload::copy_of(bytes)});
  }
  void pass(Duration duration) {
    const TimePoint until = now_.steady + duration;
    for (auto next = side_.next_deadline(); next && *next <= until; next = side_.next_deadline()) {
      pass_to(std::max(*next, now_.steady + std::chrono::microseconds(100)));
      give(TimePassed{});
      for (const Bytes& reply : std::exchange(replies_, {})) receive(reply);
    }
    pass_to(std::max(until, now_.steady));
  }
  void pass_to(TimePoint at) {
    now_.system += (at - now_.steady).count();
    now_.steady = at;
  }
  double give(Input input) {
    const SideStep step = step_of(side_, std::move(input), now_);
    for (const Action& action : step.actions) {
      const auto* made = std::get_if<CreateMirror>(&action);
      if (made && made->topic == kTopic) mirror_ = made->id;
      const auto* sample = std::get_if<Publish>(&action);
      if (sample && mirror_ && sample->mirror == mirror_) ++published_;
    }
    for (const auto& [connection, packet] : step.packets)
      if (packet.text)
        if (const auto said = decode_control(text_of(packet)); said.ok())
          if (const auto* demand = std::get_if<Demand>(&said.value()))
            for (const auto& one : demand->channels) demand_ = one.number;
    for (const auto& [connection, packet] : step.packets)
      if (!packet.text) answer(packet);
    return step.seconds;
  }

  Side side_;
  Now now_{TimePoint{} + std::chrono::seconds(1), 1'700'000'000 * kStampSecond};
  std::vector<Bytes> replies_;
  MirrorId mirror_;
  std::uint16_t demand_ = 0;
  std::uint64_t number_ = 0;
  std::uint64_t published_ = 0;
};

}  // namespace bench
