// The status as metrics for Prometheus.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <tuple>

#include "core/base/metrics_text.hpp"
#include "core/base/time.hpp"
#include "ops/status/status_fields.hpp"
#include "ops/status/status_picture.hpp"

namespace connect_bridge {

// Names that a peer chooses must not make series without end. A link is a place, of which there are
// as many as links at a time. Topics and services have kNamesMax names, and all further ones are
// "other": what this side exports may use all of them, peers together kNamesOfPeersMax, of which an
// identity has as many as it leaves to the others. A name without a link is forgotten after
// kNameTime. Neither addresses nor people are labels. Counters of a topic go on when a link ends.
class Metrics {
 public:
  static constexpr std::size_t kNamesMax = 2000;
  static constexpr std::size_t kNamesOfPeersMax = 1500;
  static constexpr Duration kNameTime = std::chrono::hours(1);
  // Counts that a picture leaves out are kept so long while their link is open.
  static constexpr Duration kCountTime = std::chrono::minutes(10);
  static constexpr std::size_t kCountsMax = 50'000;

  // Call it with each picture, so that the counts of a link that ends are not lost.
  void count(const StatusPicture& picture, TimePoint now);
  // The metrics of the last picture. `open`: in OpenMetrics 1.0, else in the text format 0.0.4.
  [[nodiscard]] std::string text(bool open) const;

 private:
  // By metric and labels.
  template <class Value>
  using ByLabels = std::map<std::string, std::map<std::string, Value>>;
  struct Total {
    std::uint64_t value = 0;
    TimePoint seen;
  };
  using Totals = std::map<std::tuple<std::uint64_t, std::string, std::string>, Total>;
  struct Name {
    std::string owner;  // the identity that brought it; empty: this side's own
    TimePoint seen;
  };

  // A topic or a service.
  template <class Of>
  void add_channel(const LinkStatus& link, std::span<const StatusField<Of>> fields, const Of& of,
                   const std::string& kind, const std::string& name);
  void add_link(std::size_t place, const LinkStatus& link);
  // `kind` and `name` as labels, or "other" if there are too many names.
  [[nodiscard]] std::string labels_of(const std::string& kind, const std::string& name,
                                      bool exported, const std::string& identity);
  [[nodiscard]] bool has_place(const std::string& owner) const;
  void forget_names();
  // A link that is lost shows no topics, and counts on when it is back.
  void keep_counts();
  // Adds a counter of one link to the sum over all links. `own`: what identifies it on the link.
  void add(const LinkStatus& link, const std::string& own, const std::string& metric,
           const std::string& labels, std::uint64_t total);

  // `counters`: where those of these fields are.
  template <class Of, class All>
  void write(MetricsText& text, std::span<const StatusField<Of>> fields, const All& counters) const;

  StatusPicture last_;
  TimePoint now_at_{};
  std::map<std::string, Name> names_;         // by labels
  std::map<std::string, std::size_t> owned_;  // names of each owner
  ByLabels<std::uint64_t> totals_;
  ByLabels<double> now_;
  ByLabels<std::uint64_t> of_links_;  // counters of the links that there are
  Totals before_, next_;
};

}  // namespace connect_bridge
