#include "ctl/probe_report.hpp"

#include <gmock/gmock.h>

#include "core/base/json.hpp"

namespace connect_bridge {
namespace {

using std::chrono::milliseconds;
using testing::AllOf;
using testing::HasSubstr;

ProbeSpan span_of(std::vector<int> round_trips_ms) {
  ProbeSpan span;
  span.took = std::chrono::seconds(2);
  for (const int ms : round_trips_ms)
    span.samples.push_back({milliseconds(100) * static_cast<int>(span.samples.size() + 1),
                            milliseconds(ms), milliseconds(ms / 2)});
  return span;
}

TEST(ProbeReport, Figures) {
  const ProbeFigures figures = figures_of(span_of({30, 10, 20, 100}));
  EXPECT_DOUBLE_EQ(figures.least, 10);
  EXPECT_DOUBLE_EQ(figures.median, 30);
  EXPECT_DOUBLE_EQ(figures.most_of_100, 100);
  EXPECT_DOUBLE_EQ(figures.longest, 100);
  EXPECT_DOUBLE_EQ(figures.jitter, (20 + 10 + 80) / 3.0);
  EXPECT_DOUBLE_EQ(figures.offset, 5) << "of the shortest";
  EXPECT_DOUBLE_EQ(figures.offset_bound, 5);
  EXPECT_DOUBLE_EQ(figures_of({}).longest, 0);
}

TEST(ProbeReport, NinetyNineOfAHundred) {
  std::vector<int> all(100, 10);
  all[7] = 500;
  EXPECT_DOUBLE_EQ(figures_of(span_of(all)).most_of_100, 10);
  all[8] = 400;
  EXPECT_DOUBLE_EQ(figures_of(span_of(all)).most_of_100, 400);
}

TEST(ProbeReport, Text) {
  ProbeSpan span = span_of({10, 20});
  span.repeated = 3;
  EXPECT_THAT(ping_text(span), AllOf(HasSubstr("2 answers in 2.0 s\nround trip: least 10.00 ms"),
                                     HasSubstr("TCP segments sent again: 3")));
  span.sent_bytes = 500'000;
  span.received_bytes = 10'000;
  span.ended = "gone";
  EXPECT_THAT(bench_text({{"sending", span}}),
              AllOf(HasSubstr("2.0 Mbit/s"), HasSubstr("40 kbit/s"), HasSubstr("early: gone")));
  EXPECT_THAT(ping_text({}), HasSubstr("0 answers"));
}

TEST(ProbeReport, Json) {
  const auto json = Json::parse(probe_json({{"idle", span_of({10, 20})}}));
  const auto& span = json.at("spans").at(0);
  EXPECT_EQ(span.at("span"), "idle");
  EXPECT_EQ(span.at("answers"), 2);
  EXPECT_EQ(span.at("samples_ms").at(1), Json::parse("[200.0, 20.0, 10.0]"));
  EXPECT_FALSE(span.contains("ended"));
}

TEST(ProbeReport, Svg) {
  const std::string svg = bench_svg({{"idle", span_of({10, 20})}, {"sending", span_of({90})}});
  EXPECT_THAT(svg, AllOf(HasSubstr("<svg xmlns"), HasSubstr(">sending</text>"),
                         HasSubstr(">100 ms</text>"), HasSubstr("over 4 s")));
  EXPECT_THAT(bench_svg({}), HasSubstr("</svg>"));
}

}  // namespace
}  // namespace connect_bridge
