// What late subscribers must get, and what must not happen when there are none.
#include <algorithm>
#include <set>

#include "core/topics/topic_qos.hpp"
#include "sim/expectation.hpp"

namespace connect_bridge::sim {

// ---- late subscribers
// --------------------------------------------------------------------------------

// Whether the topic ever had volatile publishers as well, or a rule makes it volatile for one of
// its links: then it was subscribed as volatile for all (topic_qos.hpp).
bool Expectation::is_mixed(const Writer& origin) const {
  const auto is_of_topic = [&](const Writer& other) {
    return other.spec.host < 0 && other.spec.graph == origin.spec.graph &&
           other.spec.topic == origin.spec.topic && other.spec.type == origin.spec.type;
  };
  const auto is_made_volatile = [&](const ExpectedMirror& mirror) {
    return mirror.made_volatile && is_of_topic(middleware_.writer(mirror.origin));
  };
  return std::any_of(mirrors_.begin(), mirrors_.end(), is_made_volatile) ||
         middleware_.writers().any([&](const Writer& other) {
           return is_of_topic(other) && other.spec.qos.durability == Durability::kVolatile;
         });
}

// What an overloaded queue gave up while the link lasted is not sent again.
bool Expectation::was_overloaded(const Writer& origin) const {
  for (const auto& host : hosts_) {
    if (host->graph() != origin.spec.graph || !host->running()) continue;
    for (const auto& link : host->status().links) {
      for (const auto& topic : link.topics) {
        if (!topic.exported || topic.topic != origin.spec.topic) continue;
        if (topic.dropped.of(DropReason::kQueueBytes) > 0) return true;
        if (topic.dropped.of(DropReason::kMemory) > 0) return true;
        if (topic.dropped.of(DropReason::kQueueTime) > 0) return true;
        if (topic.dropped.of(DropReason::kQueueDepth) > 0) return true;
      }
    }
  }
  return false;
}

std::uint64_t Expectation::history_of(const ExpectedMirror& expected) const {
  const Writer& origin = middleware_.writer(expected.origin);
  return std::min({std::uint64_t{origin.spec.qos.depth}, std::uint64_t{expected.qos.depth},
                   std::uint64_t{expected.history}, origin.count});
}

std::uint64_t Expectation::history_bytes(const ExpectedMirror& expected) const {
  // The exporter keeps as many samples of each as the deepest of them asks for.
  std::uint64_t depth = 0;
  std::uint64_t sizes = 0;
  for (const auto& other : mirrors_) {
    if (other.graph != expected.graph || other.topic != expected.topic) continue;
    depth = std::max<std::uint64_t>(
        {depth, other.qos.depth, other.history, middleware_.writer(other.origin).spec.qos.depth});
    sizes += crowd_.plan_of(other.origin).bytes_max;
  }
  return depth * sizes;
}

bool Expectation::is_under_way() const {
  for (const auto& host : hosts_) {
    if (!host->running()) continue;
    for (const auto& link : host->status().links)
      for (const auto& topic : link.topics)
        if (topic.queued > 0) return true;
  }
  return false;
}

void Expectation::add_late_subscribers(Crowd& crowd) {
  std::map<std::pair<int, std::string>, int> readers;
  for (std::size_t i = 0; i < mirrors_.size(); ++i) {
    const ExpectedMirror& expected = mirrors_[i];
    const Writer& origin = middleware_.writer(expected.origin);
    if (expected.qos.durability != Durability::kTransientLocal) continue;
    if (origin.spec.qos.durability != Durability::kTransientLocal) continue;
    if (drives(Treatment{}, {origin.spec.topic, origin.spec.type})) continue;  // late ones are none
    Qos qos;
    qos.durability = Durability::kTransientLocal;
    qos.reliability = Reliability::kBestEffort;  // fits every publisher
    qos.depth = 100;
    const auto [it, is_new] = readers.try_emplace({expected.graph, expected.topic}, 0);
    if (is_new) {
      it->second = crowd.add_reader(expected.graph, expected.topic, crowd.plan_of(origin.id), qos);
    }
    late_.push_back(Late{it->second, i, middleware_.writers().made()});
  }
}

void Expectation::check_late_subscribers() const {
  for (const auto& late : late_) check_late(late);
}

void Expectation::check_late(const Late& late) const {
  const ExpectedMirror& expected = mirrors_[late.mirror];
  const Writer& origin = middleware_.writer(expected.origin);
  if (!is_complete(expected) || is_mixed(origin) || rules_change_) return;
  if (was_overloaded(origin)) return;
  if (middleware_.has_lost(origin.spec.graph)) return;  // the side itself may have missed some
  if (origin.spec.qos.lifespan != kForever || expected.qos.lifespan != kForever) return;
  if (history_bytes(expected) > expected.queue_bytes_max) return;
  const auto& received = checker_.deliveries().received(late.reader, origin.id);
  const std::uint64_t should = history_of(expected);
  for (std::uint64_t n = origin.count - should + 1; n <= origin.count; ++n) {
    checker_.ledger().coverage().count(Judged::kHistory);
    const auto times = std::count(received.begin(), received.end(), n);
    if (times == 1 || (times > 1 && was_mirrored_again(expected, late.writers))) continue;
    std::string got;
    for (const auto counter : received) got += " " + std::to_string(counter);
    violated("late subscriber " + std::to_string(late.reader) + " of " + expected.topic +
             " did not get message " + std::to_string(n) + " of publisher " +
             std::to_string(origin.id) + ", one of its last " + std::to_string(should) + " of " +
             std::to_string(origin.count) + ", but" + (got.empty() ? " nothing" : got));
  }
}

bool Expectation::was_mirrored_again(const ExpectedMirror& expected, int writers) const {
  const auto is_mirror = [&](const Writer& writer) {
    return writer.spec.host >= 0 && writer.spec.graph == expected.graph &&
           writer.spec.topic == expected.topic;
  };
  return middleware_.writers().any(is_mirror, writers);
}

// ---- over cuts

// Both sides count by topic.
std::uint64_t Expectation::count_drops(const ExpectedMirror& expected) const {
  const std::string& there = middleware_.writer(expected.origin).spec.topic;
  std::uint64_t drops = 0;
  for (const auto& host : hosts_)
    for (const auto& link : host->status().links)
      for (const auto& topic : link.topics) {
        if (topic.type != expected.type || topic.topic != (topic.exported ? there : expected.topic))
          continue;
        drops += topic.dropped.total();
        for (const DropReason lost : {DropReason::kLinkLost, DropReason::kNoDemand,
                                      DropReason::kUnknownOrigin, DropReason::kDuplicate})
          drops -= topic.dropped.of(lost);
      }
  return drops;
}

void Expectation::check_unbroken() const {
  for (const auto& host : hosts_)
    for (const auto& link : host->status().links)
      if (link.connects > 1 && host->plan().options.role == Role::kClient)
        checker_.ledger().coverage().count(Judged::kBreaks, link.connects - 1);
  for (const int id : crowd_.readers()) check_unbroken_at(middleware_.reader(id));
}

// What a mirror has published reaches its subscribers. What it has not was dropped, and each drop
// counted: one accounts for one message of one of the topic's publishers.
void Expectation::check_unbroken_at(const Reader& reader) const {
  std::uint64_t unpublished = 0;
  std::uint64_t dropped = 0;
  for (const auto& expected : mirrors_) {
    if (!is_unbroken_at(reader, expected)) continue;
    const auto missing = checker_.deliveries().missing(reader.id, expected.origin);
    const auto received = checker_.deliveries().received(reader.id, expected.origin).size();
    checker_.ledger().coverage().count(Judged::kUnbroken,
                                       received + missing.published + missing.unpublished);
    if (missing.published > 0 && !may_come_too_early(expected))
      violated(std::to_string(missing.published) + " messages of publisher " +
               std::to_string(expected.origin) + " of " + expected.topic +
               " were published here and did not reach subscriber " + std::to_string(reader.id));
    unpublished += missing.unpublished;
    dropped = count_drops(expected);
  }
  if (unpublished > dropped)
    violated(std::to_string(unpublished) + " messages of " + reader.spec.topic +
             " did not reach subscriber " + std::to_string(reader.id) + ", and " +
             std::to_string(dropped) + " were dropped for a reason");
}

// A message that is too large to wait is published as soon as its mirror exists. Others of its
// topic may be fed by then, so that it comes before subscribers have found the mirror.
bool Expectation::may_come_too_early(const ExpectedMirror& expected) const {
  constexpr std::uint64_t kWaitingMax = 32 << 10;  // core/mirrors/first_messages.hpp
  if (crowd_.plan_of(expected.origin).bytes_max <= kWaitingMax) return false;
  return std::any_of(hosts_.begin(), hosts_.end(), [&](const auto& host) {
    if (host->graph() != expected.graph || !host->running()) return false;
    const auto links = host->status().links;
    return std::any_of(links.begin(), links.end(),
                       [](const LinkStatus& link) { return link.mirrors_waited > 0; });
  });
}

bool Expectation::is_unbroken_at(const Reader& reader, const ExpectedMirror& expected) const {
  const auto& writers = crowd_.writers();
  const bool uniform = std::all_of(writers.begin(), writers.end(), [&](int id) {
    return are_alike(middleware_.writer(id), middleware_.writer(expected.origin));
  });
  const EndpointSpec& at = reader.spec;
  return expected.resumes && uniform && at.graph == expected.graph && at.topic == expected.topic &&
         at.type == expected.type && at.qos.reliability == Reliability::kReliable;
}

// Of one topic, both are reliable or volatile, or neither.
bool Expectation::are_alike(const Writer& one, const Writer& other) {
  const EndpointSpec& a = one.spec;
  const EndpointSpec& b = other.spec;
  const bool same = a.graph == b.graph && a.topic == b.topic && a.type == b.type;
  return !same || (a.qos.reliability == b.qos.reliability && a.qos.durability == b.qos.durability);
}

// Whether all publishers of the topic are alike. Where they are not, the subscription of the
// exporter changes with them, and what is published meanwhile is lost.
bool Expectation::is_uniform(const Writer& origin) const {
  return std::all_of(last_writers_.begin(), last_writers_.end(),
                     [&](int id) { return are_alike(middleware_.writer(id), origin); });
}

// ---- last words
// ---------------------------------------------------------------------------------------

void Expectation::check_last_words() const {
  for (const auto& expected : mirrors_) {
    if (!is_complete(expected) || !is_uniform(middleware_.writer(expected.origin))) continue;
    // When one way learns of the end before the other, the other takes over for a moment, and what
    // other publishers of the topic send meanwhile may be lost.
    if (expected.ways > 1) continue;
    const Writer& origin = middleware_.writer(expected.origin);
    for (const int id : crowd_.readers()) {
      if (!hears(middleware_.reader(id).spec, expected)) continue;
      checker_.ledger().coverage().count(Judged::kLastWords);
      const auto& received = checker_.deliveries().received(id, origin.id);
      if (std::count(received.begin(), received.end(), origin.count) == 1) continue;
      violated("publisher " + std::to_string(origin.id) + " of " + origin.spec.topic +
               " ended right after message " + std::to_string(origin.count) +
               ", which did not reach subscriber " + std::to_string(id));
    }
  }
}

// ---- no demand
// ----------------------------------------------------------------------------------------

void Expectation::begin_silence() {
  for (const auto& host : hosts_) {
    for (const auto& topic : host->running() ? host->status().links : std::vector<LinkStatus>{}) {
      for (const auto& exported : topic.topics) {
        if (!exported.exported || is_hostile(exported.topic)) continue;
        const auto wire = host->plan().names.to_wire(exported.topic).value_or("");
        sent_before_[{host->index(), wire}] = checker_.wire().messages_sent(*host, wire);
      }
    }
    for (const auto& [id, subscription] : host->subscriptions()) {
      const std::string& topic = subscription.made.topic;
      if (!is_ordinary(topic)) continue;
      violated(describe(*host) + " subscribes to " + topic + " although nobody asks for it");
    }
  }
}

void Expectation::check_silence() const {
  for (const auto& [key, before] : sent_before_) {
    const Host& host = *hosts_[static_cast<std::size_t>(key.first)];
    const auto sent = checker_.wire().messages_sent(host, key.second);
    if (sent == before) continue;
    violated(describe(host) + " sent " + std::to_string(sent - before) + " messages of " +
             key.second + " although nobody subscribes to it");
  }
}

}  // namespace connect_bridge::sim
