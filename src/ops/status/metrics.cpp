#include "ops/status/metrics.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "core/base/metrics_text.hpp"

namespace connect_bridge {
namespace {

// The samples of a field, each with its label: one, or one for each member of an object.
template <class Of, class Take>
void each_sample(const StatusField<Of>& field, const Of& of, Take take) {
  const OrderedJson value = field.value(of);
  const Series& series = field.series;
  if (value.is_object()) {
    for (const auto& [name, count] : value.items()) take(metric_label(series.label, name), count);
  } else if (!value.is_null()) {
    take(series.label.empty() ? "" : metric_label(series.label, field.name), value);
  }
}

template <class Of>
double in_metric_units(const StatusField<Of>& field, const OrderedJson& value) {
  const double number = value.is_boolean() ? (value.get<bool>() ? 1.0 : 0.0) : value.get<double>();
  return field.unit == Unit::kMilliseconds ? number / 1e3 : number;
}

}  // namespace

void Metrics::count(const StatusPicture& picture, TimePoint now) {
  last_ = picture;
  now_at_ = now;
  now_.clear();
  of_links_.clear();
  for (const LinkStatus& link : picture.side.links) {
    add_link(picture.places.of(link), link);
    for (const auto& topic : link.topics)
      add_channel(link, topic_fields(), topic, "topic", topic.topic);
    for (const auto& service : link.services)
      add_channel(link, service_fields(), service, "service", service.service);
  }
  keep_counts();
  before_ = std::exchange(next_, {});
  forget_names();
}

void Metrics::keep_counts() {
  std::map<std::uint64_t, bool> open;
  for (const LinkStatus& link : last_.side.links) open[link.number] = link.open;
  for (auto& [key, total] : before_) {
    const auto link = open.find(std::get<0>(key));
    if (link == open.end() || next_.size() >= kCountsMax) continue;
    // A lost link shows its counts when it is back, however late.
    if (!link->second || now_at_ < total.seen + kCountTime) next_.try_emplace(key, total);
  }
}

void Metrics::forget_names() {
  for (auto name = names_.begin(); name != names_.end();) {
    if (now_at_ < name->second.seen + kNameTime) {
      ++name;
      continue;
    }
    for (auto& [metric, series] : totals_)
      for (auto one = series.lower_bound(name->first);
           one != series.end() && one->first.starts_with(name->first);)
        one = series.erase(one);
    if (--owned_[name->second.owner] == 0) owned_.erase(name->second.owner);
    name = names_.erase(name);
  }
}

bool Metrics::has_place(const std::string& owner) const {
  if (owner.empty()) return names_.size() < kNamesMax;
  const auto own = owned_.find(owner), ours = owned_.find("");
  const std::size_t of_peers = names_.size() - (ours == owned_.end() ? 0 : ours->second);
  return names_.size() < kNamesMax &&
         (own == owned_.end() ? 0 : own->second) + of_peers < kNamesOfPeersMax;
}

std::string Metrics::labels_of(const std::string& kind, const std::string& name, bool exported,
                               const std::string& identity) {
  const std::string direction = metric_label("direction", exported ? "export" : "import") + ",";
  std::string labels = direction + metric_label(kind, name);
  if (const auto known = names_.find(labels); known != names_.end()) {
    known->second.seen = now_at_;
    return labels;
  }
  const std::string owner = exported ? "" : "identity " + identity;
  if (!has_place(owner)) return direction + metric_label(kind, "other");
  ++owned_[owner];
  names_[labels] = {owner, now_at_};
  return labels;
}

void Metrics::add(const LinkStatus& link, const std::string& own, const std::string& metric,
                  const std::string& labels, std::uint64_t total) {
  if (total == 0) return;
  const std::tuple key{link.number, metric, own};
  const auto before = before_.find(key);
  const std::uint64_t had = before == before_.end() ? 0 : before->second.value;
  // Less than before: it was withdrawn and offered again.
  totals_[metric][labels] += total >= had ? total - had : total;
  next_[key] = {total, now_at_};
}

template <class Of>
void Metrics::add_channel(const LinkStatus& link, std::span<const StatusField<Of>> fields,
                          const Of& of, const std::string& kind, const std::string& name) {
  const std::string labels = labels_of(kind, name, of.exported, link.identity);
  const std::string own = (of.exported ? ">" : "<") + name + " " + of.type;
  for (const StatusField<Of>& field : fields) {
    const Series& series = field.series;
    if (series.kind == Series::Kind::kNone) continue;
    each_sample(field, of, [&](const std::string& more, const OrderedJson& value) {
      const std::string what = more.empty() ? "" : "," + more;
      const std::string metric{series.name};
      if (series.kind == Series::Kind::kCounter)
        return add(link, own + what, metric, labels + what, value.get<std::uint64_t>());
      const double number = in_metric_units(field, value);
      double& shown = now_[metric].try_emplace(labels + what, 0).first->second;
      shown = series.kind == Series::Kind::kMost ? std::max(shown, number) : shown + number;
    });
  }
}

void Metrics::add_link(std::size_t place, const LinkStatus& link) {
  const std::string labels = metric_label("link", std::to_string(place));
  for (const auto& field : link_fields()) {
    const std::string metric{field.series.name};
    if (field.series.kind == Series::Kind::kNone) continue;
    each_sample(field, link, [&](const std::string&, const OrderedJson& value) {
      if (field.series.kind == Series::Kind::kCounter) {
        of_links_[metric][labels] = value.get<std::uint64_t>();
      } else {
        now_[metric][labels] = in_metric_units(field, value);
      }
    });
  }
}

template <class Of, class All>
void Metrics::write(MetricsText& text, std::span<const StatusField<Of>> fields,
                    const All& counters) const {
  for (const StatusField<Of>& field : fields) {
    const Series& series = field.series;
    if (series.help.empty()) continue;
    const bool counter = series.kind == Series::Kind::kCounter;
    if (counter) {
      text.all_of(series.name, series.help, true, counters);
    } else {
      text.all_of(series.name, series.help, false, now_);
    }
  }
}

std::string Metrics::text(bool open) const {
  const Status& side = last_.side;
  const RunStatus& run = last_.run;
  MetricsText text(open);
  const bool server = run.role == Role::kServer;
  text.family("build", false, "The program that runs");
  text.sample(1, metric_label("version", run.version) + "," +
                     metric_label("role", server ? "server" : "client") + "," +
                     metric_label("node", run.node));
  for (const auto& field : side_fields()) {
    const Series& series = field.series;
    const OrderedJson value = field.value(last_);
    if (series.kind == Series::Kind::kNone || value.is_null()) continue;
    if (series.kind == Series::Kind::kCounter) {
      text.one(series.name, true, series.help, value.get<std::uint64_t>());
    } else {
      text.one(series.name, false, series.help, in_metric_units(field, value));
    }
  }
  if (run.certificate_end != 0)
    text.one("certificate_end_time_seconds", false, "When the certificate in use ends",
             run.certificate_end / kStampSecond);
  if (!run.relays.empty())
    text.one("relay_connected", false, "Whether the server is connected to its relay",
             static_cast<int>(run.relays.front().connected_since != 0));
  text.one("links", false, "Links, those that are lost and may return among them",
           side.links.size());
  write(text, link_fields(), of_links_);
  write(text, topic_fields(), totals_);
  write(text, service_fields(), totals_);
  return text.take();
}

}  // namespace connect_bridge
