#include "sim/stream_check.hpp"

#include <algorithm>
#include <string>

#include "sim/label.hpp"

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

// What was published before a process ends may still be on its way, a longer outage before it, too.
constexpr Duration kOnItsWay = 8s;
// From the opening of the connection on: origins are told, mirrors made and found.
constexpr Duration kUntilItFlows = 3s;
constexpr Duration kKnownForLong = 10min;

std::string describe(const Reader& reader, const Writer& origin) {
  return "publisher " + std::to_string(origin.id) + " of " + origin.spec.topic + " at subscriber " +
         std::to_string(reader.id);
}

}  // namespace

bool StreamCheck::is_lasting(const Reader& reader, const Writer& origin) const {
  return crowd_.plan_of(origin.id).lasting && reader.spec.host < 0 &&
         reader.spec.graph != origin.spec.graph && reader.spec.topic == origin.spec.topic &&
         reader.spec.qos.reliability == Reliability::kReliable &&
         compatible(origin.spec.qos, reader.spec.qos);
}

void StreamCheck::on_delivery(const Reader& reader, const Writer& mirror, const Sample& sample) {
  if (mirror.spec.host < 0 || !is_ordinary(mirror.spec.topic)) return;
  const auto label = read_label(sample.payload.view());
  if (!label) return;  // DeliveryCheck's
  const Writer& origin = ledger_.middleware().writer(static_cast<int>(label->writer));
  if (!is_lasting(reader, origin)) return;
  const auto [it, first] = last_.try_emplace({reader.id, origin.id}, label->counter);
  if (first) return;
  ++judged_;
  ledger_.coverage().count(Judged::kUnbroken);
  for (auto n = it->second + 1; n < label->counter; ++n) {
    if (!is_excused(origin.id, n))
      violated("message " + std::to_string(n) + " of " + describe(reader, origin) +
               " is missing before message " + std::to_string(label->counter));
    ++excused_;
  }
  it->second = label->counter;
}

bool StreamCheck::is_excused(int origin, std::uint64_t counter) const {
  const TimePoint at = ledger_.published_at(origin, counter);
  return std::any_of(breaks_.begin(), breaks_.end(),
                     [at](const Break& b) { return b.from <= at && (!b.to || at <= *b.to); });
}

void StreamCheck::begin_break() {
  breaks_.push_back({ledger_.now() - kOnItsWay, std::nullopt});
}

void StreamCheck::end_break(TimePoint linked) {
  if (!breaks_.empty() && !breaks_.back().to) breaks_.back().to = linked + kUntilItFlows;
}

void StreamCheck::check_pair(const Reader& reader, const Writer& origin) const {
  if (!is_lasting(reader, origin)) return;
  const auto it = last_.find({reader.id, origin.id});
  if (it == last_.end()) {
    if (std::max(reader.created, origin.created) + kKnownForLong > ledger_.now()) return;
    violated("nothing arrives of " + describe(reader, origin));
  }
  const auto published = ledger_.published(origin.id);
  if (it->second == published) return;
  for (auto n = it->second + 1; n <= published; ++n)
    if (!is_excused(origin.id, n))
      violated("message " + std::to_string(n) + " of " + describe(reader, origin) +
               " has not arrived at rest");
}

void StreamCheck::check_complete() const {
  for (const int writer : crowd_.writers())
    for (const int reader : crowd_.readers())
      check_pair(ledger_.middleware().reader(reader), ledger_.middleware().writer(writer));
}

void StreamCheck::forget() {
  const auto& middleware = ledger_.middleware();
  std::erase_if(last_, [&](const auto& stream) {
    return !middleware.readers().knows(stream.first.first) ||
           !middleware.writers().knows(stream.first.second);
  });
  while (!breaks_.empty() && breaks_.front().to &&
         *breaks_.front().to + kKnownForLong < ledger_.now())
    breaks_.pop_front();
}

}  // namespace connect_bridge::sim
