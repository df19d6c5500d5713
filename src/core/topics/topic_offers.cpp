#include "core/topics/topic_offers.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/flow/delta_encoder.hpp"

namespace connect_bridge {
namespace {

constexpr Duration kJoinMax = std::chrono::seconds(1);  // since the first early sample
constexpr std::uint64_t kEncoderBytesMax = 4 << 20;     // of samples that wait for a worker
// Bytes per second; below, zstd's third level is the better one, above it its first.
constexpr double kThinRate = 4e6;
constexpr double kSlackMax = 0.1;    // the next check comes after this time at the latest
constexpr double kSlackMin = 0.005;  // a queue that stands still must not keep the loop busy
constexpr double kDecompressSecondsPerByte = 2e-9;

std::uint32_t micrometres(double metres) {
  return static_cast<std::uint32_t>(std::lround(1e6 * metres));
}

}  // namespace

bool TopicOffers::erase(LinkId link) {
  const auto offer = offers_.find(link);
  if (offer == offers_.end()) return false;
  lose_under_way(offer->second, DropReason::kNoDemand);
  busy_.erase(link);
  offers_.erase(offer);
  return true;
}

bool TopicOffers::erase_closed() {
  std::erase_if(busy_, [](const auto& entry) { return !entry.second->is_open(); });
  return std::erase_if(offers_, [](const auto& entry) { return !entry.second.is_open(); }) > 0;
}

void TopicOffers::clear() {
  drop_under_way();
  busy_.clear();
  offers_.clear();
}

void TopicOffers::note(TopicOffer& offer) {
  if (offer.demanded() || !offer.early().empty()) {
    busy_[offer.link().id] = &offer;
  } else {
    busy_.erase(offer.link().id);
  }
}

// Several bridges of one graph may listen, and the first may give way to another one. So a link
// that listens a little later gets the samples that no link has got yet. It gets them first, so
// that their order is the same on all links.
void TopicOffers::keep_early(const std::vector<TopicOffer*>& awaited, const OutSample& sample,
                             const Now& now) {
  if (awaited.empty()) return;
  const EarlySamples* oldest = nullptr;
  for (const auto& [link, offer] : busy_)
    if (!offer->early().empty() && (!oldest || offer->early().since() < oldest->since()))
      oldest = &offer->early();
  if (oldest && now.steady - oldest->since() >= kJoinMax) oldest = nullptr;
  for (TopicOffer* offer : awaited)
    if (oldest && offer->early().empty())
      for (const OutSample& early : oldest->samples())
        offer->keep_early(early, oldest->since(), now);
  for (TopicOffer* offer : awaited) {
    offer->keep_early(sample, now.steady, now);
    note(*offer);
  }
}

bool TopicOffers::drop_late(const Now& now) {
  bool any = false;
  for (auto it = busy_.begin(); it != busy_.end();) {
    TopicOffer& offer = *(it++)->second;
    if (!offer.drop_late(now)) continue;
    note(offer);
    any = true;
  }
  return any;
}

bool TopicOffers::demanded() const {
  return std::any_of(busy_.begin(), busy_.end(),
                     [](const auto& entry) { return entry.second->demanded(); });
}

bool TopicOffers::want_live(const TopicKey& topic) const {
  bool asked = false;
  const auto wants_kept = [&](const TopicOffer& offer) {
    asked = true;
    return !offer.is_live();
  };
  for (const auto& [link, offer] : busy_)
    if (offer->demanded() && wants_kept(*offer)) return false;
  for (const LinkId link : context_.listeners.links_of(topic))
    if (const auto of = offers_.find(link);
        of != offers_.end() && of->second.is_awaited() && wants_kept(of->second))
      return false;
  return asked || drives(Treatment{}, topic);
}

bool TopicOffers::hold(OriginId origin) const {
  return std::any_of(begin(), end(), [&](const auto& entry) { return entry.second.holds(origin); });
}

bool TopicOffers::drained() const {
  return bytes() == 0 && std::all_of(busy_.begin(), busy_.end(),
                                     [](const auto& entry) { return entry.second->drained(); });
}

// ---- samples

void TopicOffers::send(const OutSample& sample, TopicOffer::Age age, const Now& now) {
  std::map<Compression, std::vector<LinkId>> compressed;
  for (const auto& [link, offer] : busy_) {
    if (!offer->admit(sample, age, now)) continue;
    if (becomes_picture(*offer, sample, now)) {
      offer->pictures().push(sample, now);
      continue;
    }
    const Compression how = way_to(*offer, sample.raw.size(), now);
    if (how.codec == Codec::kNone) {
      offer->send(sample, Codec::kNone, sample.raw, now);
    } else {
      compressed[how].push_back(link);
    }
  }
  for (auto& [how, links] : compressed) {
    OutSample to_links = sample;
    // The state may be one that some links replace by newer ones, while others count each message.
    for (const LinkId link : links)
      if (offers_.at(link).keep() == Keep::kAll) to_links.state.reset();
    to_links.targets = std::move(links);
    encode(how, std::move(to_links), now);
  }
}

void TopicOffers::send_to(TopicOffer& offer, const OutSample& sample, const Now& now) {
  if (becomes_picture(offer, sample, now)) return offer.pictures().push(sample, now);
  const Compression how = way_to(offer, sample.raw.size(), now);
  if (how.codec == Codec::kNone) return offer.send(sample, Codec::kNone, sample.raw, now);
  OutSample compressed = sample;
  compressed.targets = {offer.link().id};
  encode(how, std::move(compressed), now);
}

Compression TopicOffers::way_to(TopicOffer& offer, std::size_t bytes, const Now& now) {
  choose_step(offer, bytes, now);
  // A sample must not overtake one that is being compressed.
  for (auto& [how, stream] : streams_)
    if (stream.encoder.holds(offer.link().id) && !leave(stream, how, offer))
      return how;  // mutant: compressed_in_order
  const Compression& rule = offer.treatment().compression;
  // The link's queue compresses small samples, against the base that this peer has.
  const bool small = !context_.jobs.is_large(bytes) && bytes <= DeltaEncoder::kBytesMax;
  if (rule.codec == Codec::kZstd && small) return {};
  if (!rule.automatic) return rule;
  const double rate = offer.path_rate();
  const bool thinned = may_be_lossy(offer) && offer.treatment().grid > 0;
  if (!thinned && (small || rate == 0)) return {};
  const Compression how = automatic_way(offer, rate);
  if (how.loses()) return how;
  Stream& stream = stream_of(how);
  const double cost = stream.seconds_per_byte * static_cast<double>(bytes);
  return stream.gain.pays(bytes, rate, cost) ? how : Compression{};
}

// Planes and columns of clouds shrink at their first level as much as at any other.
Compression TopicOffers::automatic_way(const TopicOffer& offer, double rate) const {
  if (has_planes(offer.type()) && offer.decodes().planes) return {Codec::kPlanes, 1, true};
  if (is_cloud(offer.type()) && offer.decodes().cloud) {
    Compression how{Codec::kCloud, 1, true};
    if (may_be_lossy(offer)) {
      how.step_um = offer.cloud().step_um();
      how.grid_um = micrometres(offer.treatment().grid);
    }
    return how;
  }
  return {Codec::kZstd, rate < kThinRate ? 3 : 1, true};
}

bool TopicOffers::becomes_picture(TopicOffer& offer, const OutSample& sample, const Now& now) {
  PictureStream& pictures = offer.pictures();
  const OriginId origin = sample.subject.origin();
  const bool has_columns = has_planes(offer.type());  // a JPEG has none, and is small already
  const bool is_small = has_columns && !context_.jobs.is_large(sample.raw.size());
  if (is_small || !offer.may_be_picture(sample)) {
    pictures.forget(origin, DropReason::kNewerAvailable);
    return false;
  }
  const bool was_exact = pictures.fit().is_exact();
  const double own = was_exact ? 0 : pictures.rate(now);
  const auto rate = own > 0 ? TopicOffer::Rate{own, true} : offer.channel_rate(now);
  const auto planes = streams_.find({Codec::kPlanes, 1, true});
  const CompressionGain gain = planes != streams_.end() ? planes->second.gain : CompressionGain();
  const double ratio = has_columns ? gain.ratio() : 1;
  const double exact_bytes = ratio * static_cast<double>(sample.raw.size());
  pictures.fit().came(now.steady);
  const double carried = rate.rate / exact_bytes;
  const bool is_shown = rate.is_shown || (rate.is_near && pictures.fit().falls_far_short(carried));
  const bool exact = pictures.fit().judge(carried, is_shown, now.steady);
  if (exact && !was_exact) pictures.clear(DropReason::kNewerAvailable);
  if (!exact && was_exact) offer.begin_pictures();
  // A picture leaves before what is still being compressed.
  if (!exact && offer.has_one_origin())
    for (const auto& older : take_under_way(offer.link().id))
      offer.lose(older, DropReason::kNewerAvailable);
  return !exact;
}

void TopicOffers::choose_step(TopicOffer& offer, std::size_t bytes, const Now& now) {
  if (!may_be_lossy(offer)) return;
  const std::uint32_t grid_um = micrometres(offer.treatment().grid);
  const auto bytes_at = [&](std::uint32_t step_um) -> std::optional<double> {
    const auto found = streams_.find({Codec::kCloud, 1, true, step_um, grid_um});
    if (found == streams_.end() || !found->second.measured) return std::nullopt;
    return found->second.gain.ratio() * static_cast<double>(bytes);
  };
  const double exact_bytes =
      bytes_at(0).value_or(CompressionGain().ratio() * static_cast<double>(bytes));
  offer.cloud().came(now.steady);
  const auto rate = offer.channel_rate(now);
  static_cast<void>(offer.cloud().choose(
      {rate.rate, rate.is_shown, exact_bytes, micrometres(offer.treatment().max_error), bytes_at},
      now.steady));
}

bool TopicOffers::leave(Stream& stream, const Compression& how, TopicOffer& offer) {
  const LinkId link = offer.link().id;
  if (how.codec != Codec::kCloud) return false;
  if (may_be_lossy(offer)) {
    if (stream.encoder.works_for(link) || how.step_um == offer.cloud().step_um()) return false;
  } else if (!how.loses()) {
    return false;
  }
  for (const auto& sample : stream.encoder.forget(link))
    offer.lose(sample, DropReason::kNewerAvailable);
  return true;
}

TopicOffers::Stream& TopicOffers::stream_of(const Compression& how) {
  const auto stream = streams_.find(how);
  if (stream != streams_.end()) return stream->second;
  // The last samples of each origin of a transient-local topic must all arrive, and come at once.
  const bool latched = qos_.durability == Durability::kTransientLocal;
  const std::uint32_t depth = latched ? 0 : qos_.depth;
  const auto bytes =
      latched ? std::max(context_.options.history_bytes_max, kEncoderBytesMax) : kEncoderBytesMax;
  return streams_.try_emplace(how, *this, Encoder::Options{how, depth, bytes}).first->second;
}

void TopicOffers::encode(const Compression& how, OutSample sample, const Now& now) {
  Stream& stream = stream_of(how);
  stream.chosen = stream.chosen || stream.encoder.bytes() == 0;
  for (const auto& displaced : stream.encoder.push(std::move(sample)))
    drop(displaced.sample, displaced.reason);
  send_encoded(stream, now);
}

// The time includes the wait behind other jobs, because the message waits for both.
void TopicOffers::Stream::on_job(std::optional<Payload> result, const Now& now) {
  const auto bytes = static_cast<double>(encoder.bytes_at_work());
  if (result) {
    gain.note(static_cast<double>(result->size()) / bytes);
    measured = true;
  } else {
    gain.note_in_vain();
  }
  const double took = std::chrono::duration<double>(now.steady - begun).count();
  // One slow job, while others took the workers, shows little: the mean moves by a quarter.
  const double latest = took / bytes + kDecompressSecondsPerByte;
  seconds_per_byte += (latest - seconds_per_byte) / 4;
  encoder.finish(std::move(result));
  offers.send_encoded(*this, now);
}

void TopicOffers::send_encoded(Stream& stream, const Now& now) {
  // Samples leave in order, until one must wait. A sample that was only in line behind others, and
  // would not be compressed by itself, passes uncompressed. A large one waits while its links have
  // enough to send. Any other is compressed, at once or by a worker, whose result calls this again.
  const bool at_work = stream.encoder.bytes_at_work() > 0;
  stream.later.cancel();
  for (;;) {
    if (passes(stream)) {
      send(stream.encoder.pass(), now);
      continue;
    }
    const Duration slack = slack_of(stream);
    if (slack > Duration::zero()) {
      stream.later = timers_.set(now.steady + slack);
      break;
    }
    if (stream.encoder.upcoming()) stream.chosen = false;
    const auto ready = stream.encoder.next();
    if (!ready) break;
    send(*ready, now);
  }
  // A worker that has begun just now is timed from here (on_job).
  if (!at_work) stream.begun = now.steady;
}

void TopicOffers::send(const Encoder::Encoded& ready, const Now& now) {
  for (const LinkId link : ready.sample.targets)
    if (const auto offer = offers_.find(link); offer != offers_.end())
      offer->second.send(ready.sample, ready.codec, ready.body, now);
}

// Without this, a topic that fills its link would never stop a compression that does not pay.
bool TopicOffers::passes(const Stream& stream) const {
  const OutSample* next = stream.passes && !stream.chosen ? stream.encoder.upcoming() : nullptr;
  if (!next) return false;
  const std::size_t bytes = next->raw.size();
  const double cost = stream.seconds_per_byte * static_cast<double>(bytes);
  return std::none_of(next->targets.begin(), next->targets.end(), [&](LinkId link) {
    const auto offer = offers_.find(link);
    return offer != offers_.end() &&
           stream.gain.likely_pays(bytes, offer->second.path_rate(), cost);
  });
}

// Newer samples displace those that a path cannot carry: better before they cost a worker's time
// than after. So a sample waits until the first of its links has nearly sent its queue.
Duration TopicOffers::slack_of(const Stream& stream) const {
  const OutSample* next = stream.automatic ? stream.encoder.upcoming() : nullptr;
  if (!next || !context_.jobs.is_large(next->raw.size())) return {};
  double busy = kSlackMax;
  for (const LinkId link : next->targets) {
    const auto offer = offers_.find(link);
    busy = std::min(busy, offer == offers_.end() ? 0 : offer->second.queue_seconds());
  }
  const double takes = stream.seconds_per_byte * static_cast<double>(next->raw.size());
  const double slack = busy - 2 * takes;
  if (slack < kSlackMin) return {};
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(slack));
}

void TopicOffers::on_time(std::size_t& held, const Now& now) {
  for (auto& [how, stream] : streams_)
    if (stream.later && stream.later.at() <= now.steady) send_encoded(stream, now);
  for (const auto& [link, offer] : busy_)
    while (const auto sample = offer->take_held(held, now)) send_to(*offer, *sample, now);
  for (const auto& [link, offer] : busy_) offer->pictures().on_time(now);
}

void TopicOffers::drop(DropReason reason, std::uint64_t count) {
  for (const auto& [link, offer] : busy_)
    if (offer->demanded()) offer->drop(reason, count);
}

// The sample that a worker has for the link must not leave in the next demand. It would come before
// the last samples, and may be one of them.
std::vector<OutSample> TopicOffers::take_under_way(LinkId link) {
  std::vector<OutSample> forgotten;  // all of one stream, see way_to()
  for (auto& [how, stream] : streams_)
    for (auto& sample : stream.encoder.forget(link)) forgotten.push_back(std::move(sample));
  return forgotten;
}

void TopicOffers::lose_under_way(TopicOffer& offer, DropReason reason) {
  for (const auto& sample : take_under_way(offer.link().id)) offer.lose(sample, reason);
}

void TopicOffers::drop_under_way() {
  for (auto& [how, stream] : streams_)
    for (const auto& sample : stream.encoder.clear()) drop(sample, DropReason::kNoDemand);
  for (const auto& [link, offer] : busy_) offer->pictures().clear(DropReason::kNoDemand);
}

void TopicOffers::drop(const OutSample& sample, DropReason reason) {
  for (const LinkId link : sample.targets)
    if (const auto offer = offers_.find(link); offer != offers_.end())
      offer->second.lose(sample, reason);
}

std::uint64_t TopicOffers::bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& [how, stream] : streams_) bytes += stream.encoder.bytes();
  for (const auto& [link, offer] : busy_) bytes += offer->pictures().bytes();
  return bytes;
}

}  // namespace connect_bridge
