#include "core/mirrors/clock_publisher.hpp"

#include <algorithm>

#include "core/base/cdr.hpp"

namespace connect_bridge {
namespace {

constexpr double kClockRateMax = 100.0;
// Two samples closer than this show little about the rate.
constexpr Stamp kRateBase = kStampSecond / 20;

// rosgraph_msgs/msg/Clock: int32 seconds, uint32 nanoseconds.
Payload clock_message(Stamp ros) {
  return CdrWriter()
      .u32(static_cast<std::uint32_t>(ros / kStampSecond))
      .u32(static_cast<std::uint32_t>(ros % kStampSecond))
      .take();
}

}  // namespace

void ClockPublisher::start(const std::string& topic, Outputs& outputs, const Now& now) {
  if (mirror_) return;
  mirror_ = outputs.new_id<MirrorId>();
  Qos qos;
  // Reliable serves subscribers of both kinds; the depth is a subscriber's default.
  qos.depth = 10;
  outputs.push(CreateMirror{mirror_, topic, kClockType, "", qos, "", true});
  claimed_ = service_gid("time on " + topic);  // no service has such a name
  outputs.follow_up(FollowUp::kClaim);
  next_ = now.steady;
  // The link was dead: earlier samples of the peer's clock show nothing about now.
  sample_.reset();
  rate_ = 1.0;
  measured_rate_ = 1.0;
}

void ClockPublisher::stop(Outputs& outputs) {
  if (mirror_) outputs.push(DestroyMirror{mirror_});
  if (mirror_) outputs.follow_up(FollowUp::kClaim);
  mirror_ = {};
}

void ClockPublisher::add_mirrored(Claim& claim) const {
  if (mirror_) claim.services.push_back(claimed_);
}

void ClockPublisher::on_reply(const TimeReply& reply, Stamp t4) {
  if (reply.ros <= 0 || !is_plausible(reply.ros) || !is_plausible(reply.t1)) return;
  // The peer read its clock within the round trip. The middle of that is wrong by half of it at
  // most (as in RFC 5905 section 8).
  const Stamp round_trip = t4 - reply.t1;
  if (round_trip < 0) return;
  const Sample sample{t4 - round_trip / 2, reply.ros};
  if (sample_ && sample.local - sample_->local >= kRateBase) {
    const double rate = static_cast<double>(sample.ros - sample_->ros) /
                        static_cast<double>(sample.local - sample_->local);
    // A jump forward looks like a high rate, once. So a higher rate counts only when it was
    // measured twice; else our time would run ahead and then back. A jump back (a restarted
    // simulation) gives no rate.
    if (rate >= 0) {
      rate_ = std::min({rate, measured_rate_, kClockRateMax});
      measured_rate_ = rate;
    }
  }
  sample_ = sample;
}

Stamp ClockPublisher::ros_at(Stamp local) const {
  return sample_->ros + static_cast<Stamp>(rate_ * static_cast<double>(
                                                       std::max<Stamp>(local - sample_->local, 0)));
}

void ClockPublisher::on_time(Outputs& outputs, const Claims& claims, const Now& now) {
  if (!mirror_ || now.steady < next_) return;
  // A loop that stood still skips the ticks it missed: they would come at once, with nearly one
  // time.
  next_ = std::max(next_ + period_, now.steady);
  if (!sample_ || claims.service_taken(claimed_, true)) return;
  Stamp ros = ros_at(now.system);
  // A new sample may correct the estimate down a little: then time stands still until the peer's
  // has caught up. A difference of more than a second is a jump of the peer's time, and ours
  // follows.
  if (ros < last_published_ && last_published_ - ros < kStampSecond) ros = last_published_;
  last_published_ = ros;
  outputs.push(Publish{mirror_, clock_message(ros)});
}

std::optional<TimePoint> ClockPublisher::deadline() const {
  if (!mirror_) return std::nullopt;
  return next_;
}

bool wants_clock(const LinkTable& links, const Policy& policy) {
  const auto asks = [](const auto& entry) {
    const Link& link = entry.second;
    return link.open() && link.accepts && link.accepts->list().ros_time;
  };
  // Nearly always no link asks.
  if (std::none_of(links.begin(), links.end(), asks)) return false;
  return std::any_of(links.begin(), links.end(), [&](const auto& entry) {
    const Link& link = entry.second;
    const auto wire_name = link.names.to_wire("/clock");
    return wire_name && asks(entry) &&
           policy.decide(Direction::kExport, InterfaceKind::kTopic, *wire_name, kClockType,
                         link.login.identity());
  });
}

}  // namespace connect_bridge
