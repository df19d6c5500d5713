#include "core/side/missing.hpp"

#include <algorithm>
#include <utility>

namespace connect_bridge {
namespace {

using std::chrono::seconds;

constexpr Duration kFirstLook = seconds(3);  // after a link was opened
constexpr Duration kChangeTime = std::chrono::milliseconds(500);
constexpr Duration kLooksPeriod = seconds(1);
constexpr Duration kPeriodOfLink = std::chrono::milliseconds(100);
constexpr std::size_t kFirstLooksSpread = 50;
constexpr Duration kAgain = seconds(10);  // while somebody wants something
constexpr Duration kLasting = seconds(3);
constexpr Duration kLinesPeriod = seconds(30);
constexpr std::size_t kNamesInLine = 8;
constexpr std::size_t kAnswersMax = 2 * kAskedMax;  // names that the peer is asked for

constexpr std::string_view kLater = "later";  // the answer to who asks too much

bool is_same(const MissingName& a, const MissingName& b) {
  return a.kind == b.kind && a.exported == b.exported && a.name == b.name && a.type == b.type &&
         a.reason == b.reason;
}

// The rest has a line of its own, or is how things are most of the time.
bool is_logged(const MissingName& name) {
  switch (name.reason) {
    case MissingReason::kNoRule:
    case MissingReason::kOtherPeer:
    case MissingReason::kDenied:
    case MissingReason::kRuleType:
    case MissingReason::kNotTaken:
    case MissingReason::kNotGiven:
    case MissingReason::kOtherType:
    case MissingReason::kLost:
    case MissingReason::kOutside: return true;
    case MissingReason::kNotThere: return name.kind != InterfaceKind::kTopic;
    case MissingReason::kTypeUnknown:
    case MissingReason::kDeclined:
    case MissingReason::kQos: break;
  }
  return false;
}

std::string shown_in_line(const MissingName& name) {
  const char* kind = name.kind == InterfaceKind::kTopic     ? ""
                     : name.kind == InterfaceKind::kService ? "the service "
                                                            : "the action ";
  return kind + name.name + " (" + name.type + (name.exported ? ", to it): " : ", from it): ") +
         name.text;
}

}  // namespace

Duration Missing::looks_period() const {
  return std::max<Duration>(kLooksPeriod, kPeriodOfLink * static_cast<int>(of_links_.size()));
}

void Missing::look_at(LinkId link, OfLink& of_link, TimePoint at) {
  if (!of_link.looks || of_link.looks.at() > at) of_link.looks = timers_.set(at, link);
}

void Missing::on_change(const Now& now) {
  for (auto& [id, of_link] : of_links_)
    look_at(id, of_link, std::max(now.steady + kChangeTime, of_link.looked_at + looks_period()));
}

void Missing::on_peer_rules(const Link& link, const Now& now) {
  const auto of_link = of_links_.find(link.id);
  if (of_link == of_links_.end()) return;
  of_link->second.asks_again = now.steady;
  on_change(now);
}

// The first look is later than the peer's first round of offers. After a restart many links come at
// once, and have theirs one after the other.
void Missing::on_link_open(const Link& link, const Now& now) {
  OfLink& of_link = of_links_.try_emplace(link.id).first->second;
  const auto others = static_cast<int>((of_links_.size() - 1) % kFirstLooksSpread);
  const TimePoint first = now.steady + kFirstLook + kPeriodOfLink * others;
  of_link.looked_at = first - looks_period();
  look_at(link.id, of_link, first);
}

std::optional<LinkId> Missing::take_due(const Now& now) {
  const auto link = timers_.take_due(now.steady);
  if (link) of_links_.at(*link).looks.cancel();
  return link;
}

void Missing::look(Link& link, const std::vector<Wish>& wanted, LinkPicture picture,
                   const Now& now) {
  OfLink& of_link = of_links_.at(link.id);
  of_link.looked_at = now.steady;
  Answers still;
  for (const Wish& wish : wanted)
    if (auto answer = of_link.answers.extract(wish)) still.insert(std::move(answer));
  of_link.answers = std::move(still);
  picture.answers = of_link.answers;
  auto found = find_missing(wanted, side_, link, picture);
  of_link.further = found.further;
  std::vector<std::pair<MissingName, TimePoint>> lasting;
  std::optional<TimePoint> next;
  for (MissingName& name : found.names) {
    const auto before = std::find_if(of_link.found.begin(), of_link.found.end(),
                                     [&](const auto& old) { return is_same(old.first, name); });
    const TimePoint since = before == of_link.found.end() ? now.steady : before->second;
    if (since + kLasting > now.steady) next = earliest(next, since + kLasting);
    lasting.emplace_back(std::move(name), since);
  }
  of_link.found = std::move(lasting);
  ask(link, of_link, found.unanswered);
  if (of_link.asks_again <= now.steady && of_link.under_way.empty() && !of_link.answers.empty()) {
    // In turns, as a question has not room for all.
    std::vector<Wish> again;
    for (const auto& [wish, code] : of_link.answers) again.push_back(wish);
    const auto next_one = std::upper_bound(again.begin(), again.end(), of_link.asked_last);
    std::rotate(again.begin(), next_one, again.end());
    of_link.asks_again = now.steady + kAgain;
    ask(link, of_link, again);
  }
  tell(link, of_link, now);
  if (!wanted.empty() || picture.brought || !picture.heard.empty())
    next = earliest(next, now.steady + kAgain);
  if (next) look_at(link.id, of_link, std::max(*next, now.steady + looks_period()));
}

// One question at a time; the others follow when that is answered.
void Missing::ask(Link& link, OfLink& of_link, const std::vector<Wish>& wishes) {
  if (!of_link.under_way.empty()) return;
  Ask question;
  for (const Wish& wish : wishes) {
    const bool has_place = of_link.answers.contains(wish) ||
                           of_link.answers.size() + of_link.under_way.size() < kAnswersMax;
    if (question.names.size() >= kAskedMax || !has_place) break;
    auto asked = question_of(side_, link, wish);
    if (!asked) continue;
    question.names.push_back(*std::move(asked));
    of_link.under_way.push_back(wish);
    of_link.asked_last = wish;
  }
  if (!question.names.empty()) link.send(question);
}

Result<Nothing> Missing::on_ask(Link& link, const Ask& ask, const Now& now) {
  const auto of_link = of_links_.find(link.id);
  if (of_link == of_links_.end() || !of_link->second.asked.take(now.steady))
    return Error{CloseCode::kTooLarge, "asks for names too often"};
  const bool pays = link.account->asks.take(now.steady);  // its identity may have many links
  Answered answer;
  for (const AskedName& asked : ask.names)
    answer.codes.emplace_back(pays ? answer_to(side_, link, asked) : kLater);
  link.send(answer);
  return Nothing{};
}

Result<Nothing> Missing::on_answer(Link& link, const Answered& answer, const Now& now) {
  const auto at = of_links_.find(link.id);
  if (at == of_links_.end() || at->second.under_way.empty() ||
      at->second.under_way.size() != answer.codes.size())
    return Error{CloseCode::kIllegal, "an answer to what was not asked"};
  OfLink& of_link = at->second;
  if (of_link.answers.empty()) of_link.asks_again = now.steady + kAgain;
  const auto asked = std::exchange(of_link.under_way, {});
  for (std::size_t i = 0; i < asked.size(); ++i) {
    std::string& known = of_link.answers[asked[i]];
    if (known.empty() || answer.codes[i] != kLater) known = answer.codes[i];
  }
  look_at(link.id, of_link, std::max(now.steady, of_link.looked_at + looks_period()));
  return Nothing{};
}

// Not more often than the period, and each line once for the peer's identity.
void Missing::tell(const Link& link, OfLink& of_link, const Now& now) const {
  if (now.steady < of_link.tells_at) return;
  std::vector<const MissingName*> names;
  for (const auto& [name, since] : of_link.found)
    if (is_logged(name) && since + kLasting <= now.steady) names.push_back(&name);
  if (names.empty()) {
    of_link.logged.clear();
    return;
  }
  const bool one = names.size() == 1;
  std::string line = std::to_string(names.size()) + (one ? " name" : " names") +
                     " that nodes here use " + (one ? "is" : "are") + " not forwarded to " +
                     link.label() + ": ";
  for (std::size_t i = 0; i < names.size() && i < kNamesInLine; ++i)
    line += (i == 0 ? "" : "; ") + shown_in_line(*names[i]);
  if (names.size() > kNamesInLine) line += "; more in the status (ctl status)";
  if (line == of_link.logged) return;
  of_link.logged = line;
  of_link.tells_at = now.steady + kLinesPeriod;
  side_.outputs.log_once(link.account->logged, LogLevel::kInfo, line);
}

void Missing::add_status(const Link& link, LinkStatus& status) const {
  const auto of_link = of_links_.find(link.id);
  if (of_link == of_links_.end()) return;
  const TimePoint looked_at = of_link->second.looked_at;
  for (const auto& [name, since] : of_link->second.found)
    if (since + kLasting <= looked_at) status.missing.push_back(name);
  status.further_missing = of_link->second.further;
}

}  // namespace connect_bridge
