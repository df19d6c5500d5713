#include "core/topics/drive_switch.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "core/base/cdr.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

constexpr char kType[] = "std_srvs/srv/SetBool";
// A robot tells each change within 250 ms; the path takes the rest.
constexpr Duration kAnswerMax = std::chrono::seconds(2);
constexpr std::size_t kCallsMax = 16;

std::string words_of(WheelState state, WheelWant want, const std::string& topic) {
  switch (state) {
    case WheelState::kYours: return "you drive " + topic;
    case WheelState::kTaken: return "another peer drives " + topic;
    case WheelState::kHalted: return "nobody drives " + topic + ": let go first";
    case WheelState::kFree: break;
  }
  const bool unanswered = want == WheelWant::kTake;
  return "nobody drives " + topic +
         (unanswered ? ": its robot has not answered, or has no wheel" : "");
}

struct Answer {
  bool as_wanted = true;
  std::string text;
};

Answer answer_to(WheelWant want, LocalTopics& topics) {
  Answer answer;
  std::set<std::string> lines;
  for (const TopicOffer* const offer : topics.steered()) {
    const WheelState state = offer->wheel().value_or(WheelState::kFree);
    const bool is_ours = state == WheelState::kYours;
    answer.as_wanted = answer.as_wanted && is_ours == (want == WheelWant::kTake);
    lines.insert(words_of(state, want, offer->name()));
  }
  for (const std::string& line : lines) answer.text += (answer.text.empty() ? "" : "; ") + line;
  if (!lines.empty()) return answer;
  return {false, "nothing to steer: no robot subscribes to commands of this graph"};
}

// std_srvs/srv/SetBool_Response
Payload response(const Answer& answer) {
  return CdrWriter().u8(answer.as_wanted ? 1 : 0).string(answer.text).take();
}

}  // namespace

DriveSwitch::DriveSwitch(const std::string& node, Outputs& outputs)
    : name_(node.empty() ? std::string() : node + std::string(kDriveSwitch)), outputs_(outputs) {}

void DriveSwitch::appear() {
  if (name_.empty() || service_) return;
  service_ = outputs_.new_id<ServiceMirrorId>();
  outputs_.push(CreateServiceMirror{service_, name_, kType, "", "", true});
}

void DriveSwitch::add_mirrored(Claim& claim) const {
  if (!name_.empty()) claim.services.push_back(service_gid(name_));
}

bool DriveSwitch::on_request(const RequestTaken& request, LocalTopics& topics, const Now& now) {
  if (request.mirror != service_) return false;
  const auto data = CdrReader(request.payload.view()).u8();
  if (!data) {
    outputs_.push(DropRequest{service_, request.request});
    return true;
  }
  if (calls_.size() >= kCallsMax) {
    outputs_.push(SendResponse{service_, request.request,
                               response({.as_wanted = false, .text = "too many calls wait"})});
    return true;
  }
  const WheelWant want = *data != 0 ? WheelWant::kTake : WheelWant::kLeave;
  // A robot that gets both wishes within a moment tells the last state alone.
  std::erase_if(calls_, [&](const Call& call) {
    if (call.want == want) return false;
    outputs_.push(SendResponse{
        service_, call.request,
        response({.as_wanted = false, .text = "another call has asked for the opposite since"})});
    return true;
  });
  for (TopicOffer* const offer : topics.steered()) offer->want_wheel(want);
  calls_.push_back({request.request, want, now.steady + kAnswerMax});
  answer(topics, now);
  return true;
}

bool DriveSwitch::on_failed(const ServiceMirrorFailed& failed) {
  if (failed.id != service_) return false;
  outputs_.log(LogLevel::kWarn, "there is no service " + name_ + ": " + failed.reason);
  calls_.clear();
  return true;
}

void DriveSwitch::answer(LocalTopics& topics, const Now& now) {
  std::erase_if(calls_, [&](const Call& call) {
    const Answer answer = answer_to(call.want, topics);
    // Without a topic nothing is waited for.
    const bool waits = !answer.as_wanted && now.steady < call.until && !topics.steered().empty();
    if (!waits) outputs_.push(SendResponse{service_, call.request, response(answer)});
    return !waits;
  });
}

std::optional<TimePoint> DriveSwitch::deadline() const {
  return calls_.empty() ? std::nullopt : std::optional(calls_.front().until);
}

}  // namespace connect_bridge
