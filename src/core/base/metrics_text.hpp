// Metrics as text for Prometheus.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>

namespace connect_bridge {

// name="value", with any value.
[[nodiscard]] inline std::string metric_label(std::string_view name, std::string_view value) {
  std::string text{name};
  text += "=\"";
  for (const char c : value) {
    if (c == '\\' || c == '"') text += '\\';
    text += c == '\n' ? std::string{"\\n"} : std::string{c};
  }
  return text + '"';
}

// Put together from families, each with its samples behind it. `open`: OpenMetrics 1.0, else the
// text format 0.0.4.
class MetricsText {
 public:
  explicit MetricsText(bool open) : open_(open) {}

  void family(std::string_view name, bool counter, std::string_view help) {
    name_ = fmt::format("connect_bridge_{}", name);
    const std::string sample = counter ? name_ + "_total" : name_;
    const std::string& shown = open_ ? name_ : sample;
    text_ +=
        fmt::format("# HELP {0} {1}\n# TYPE {0} {2}\n", shown, help, counter ? "counter" : "gauge");
    name_ = sample;
  }
  template <class Value>
  void sample(Value value, const std::string& labels = {}) {
    text_ += labels.empty() ? fmt::format("{} {}\n", name_, value)
                            : fmt::format("{}{{{}}} {}\n", name_, labels, value);
  }
  template <class Value>
  void one(std::string_view name, bool counter, std::string_view help, Value value) {
    family(name, counter, help);
    sample(value);
  }
  // `series`: by metric, values by labels. `name`: a counter's without _total.
  template <class Series>
  void all_of(std::string_view name, std::string_view help, bool counter, const Series& series) {
    const auto found = series.find(std::string(name));
    if (found == series.end()) return;
    family(name, counter, help);
    for (const auto& [labels, value] : found->second) sample(value, labels);
  }
  [[nodiscard]] std::string take() { return std::move(text_) + (open_ ? "# EOF\n" : ""); }

 private:
  const bool open_;
  std::string name_;
  std::string text_;
};

}  // namespace connect_bridge
