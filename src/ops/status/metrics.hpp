// The status as metrics for Prometheus.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <tuple>

#include "core/base/metrics_text.hpp"
#include "ops/status/status_fields.hpp"
#include "ops/status/status_picture.hpp"

namespace connect_bridge {

// Names that a peer chooses must not make series without end. A link is a place, of which there are
// as many as links at a time. Topics and services are the first kNamesMax that came, and all later
// ones are "other". Neither addresses nor people are labels. Counters of a topic go on when a link
// ends.
class Metrics {
 public:
  static constexpr std::size_t kNamesMax = 1000;

  // Call it with each picture, so that the counts of a link that ends are not lost.
  void count(const StatusPicture& picture);
  // The metrics of the last picture. `open`: in OpenMetrics 1.0, else in the text format 0.0.4.
  [[nodiscard]] std::string text(bool open) const;

 private:
  // By metric and labels.
  template <class Value>
  using ByLabels = std::map<std::string, std::map<std::string, Value>>;
  using Totals = std::map<std::tuple<std::uint64_t, std::string, std::string>, std::uint64_t>;

  // A topic or a service.
  template <class Of>
  void add_channel(const LinkStatus& link, std::span<const StatusField<Of>> fields, const Of& of,
                   const std::string& kind, const std::string& name);
  void add_link(std::size_t place, const LinkStatus& link);
  // `kind` and `name` as labels, or "other" if there are too many names.
  [[nodiscard]] std::string labels_of(const std::string& kind, const std::string& name,
                                      bool exported);
  // Adds a counter of one link to the sum over all links. `own`: what identifies it on the link.
  void add(const LinkStatus& link, const std::string& own, const std::string& metric,
           const std::string& labels, std::uint64_t total);

  // `counters`: where those of these fields are.
  template <class Of, class All>
  void write(MetricsText& text, std::span<const StatusField<Of>> fields, const All& counters) const;

  StatusPicture last_;
  std::set<std::string> names_;
  ByLabels<std::uint64_t> totals_;
  ByLabels<double> now_;
  ByLabels<std::uint64_t> of_links_;  // counters of the links that there are
  Totals before_, next_;
};

}  // namespace connect_bridge
