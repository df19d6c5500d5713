// The measurements of a probe, as text, JSON and SVG.
#pragma once

#include <string>
#include <vector>

#include "ctl/probe.hpp"

namespace connect_bridge {

// In milliseconds. All zero without samples.
struct ProbeFigures {
  double least = 0;
  double median = 0;
  double most_of_100 = 0;  // 99 of 100 are not longer
  double longest = 0;
  double jitter = 0;  // mean difference of two that follow each other (RFC 3550 without smoothing)
  double offset = 0;  // of the server's clock, by the shortest round trip
  double offset_bound = 0;
};
[[nodiscard]] ProbeFigures figures_of(const ProbeSpan& span);

struct NamedSpan {
  std::string name;  // "idle", "sending", ...
  ProbeSpan span;
};

// Lines for people, of one span.
[[nodiscard]] std::string ping_text(const ProbeSpan& span);
// A table of all, and how it is to be read.
[[nodiscard]] std::string bench_text(const std::vector<NamedSpan>& spans);
// An object with the figures and samples of each span.
[[nodiscard]] std::string probe_json(const std::vector<NamedSpan>& spans);
// Round trips over time, one span beside the other.
[[nodiscard]] std::string bench_svg(const std::vector<NamedSpan>& spans);

}  // namespace connect_bridge
