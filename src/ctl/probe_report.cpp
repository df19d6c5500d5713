#include "ctl/probe_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/json.hpp"

namespace connect_bridge {
namespace {

double in_ms(Duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

double in_s(Duration time) {
  return std::chrono::duration<double>(time).count();
}

// Bytes per second as text in bits, as links are sold.
std::string rate_text(std::uint64_t bytes, Duration time) {
  if (bytes == 0 || time <= Duration::zero()) return "-";
  const double bits = 8 * static_cast<double>(bytes) / in_s(time);
  return bits < 1e6 ? fmt::format("{:.0f} kbit/s", bits / 1e3)
                    : fmt::format("{:.1f} Mbit/s", bits / 1e6);
}

constexpr char kHowToRead[] =
    R"(Round trips are of the protocol's time requests, which overtake what waits at this side: so
an urgent message would fare. Sending fills TCP as far as --rate and the path let it; the bridge
itself holds back what would wait on the path, so its round trips under load are shorter. Receiving
is what the server publishes on the topics, held back as it is for every client. TCP loses nothing:
a lost packet is sent again, and shows as a late answer.
)";

OrderedJson json_of(const NamedSpan& named) {
  const ProbeSpan& span = named.span;
  const ProbeFigures figures = figures_of(span);
  OrderedJson json = {
      {"span", named.name},
      {"seconds", in_s(span.took)},
      {"answers", span.samples.size()},
      {"round_trip_ms",
       {{"least", figures.least},
        {"median", figures.median},
        {"most_of_100", figures.most_of_100},
        {"longest", figures.longest},
        {"jitter", figures.jitter}}},
      {"clock", {{"offset_ms", figures.offset}, {"error_bound_ms", figures.offset_bound}}},
      {"sent_bytes", span.sent_bytes},
      {"received_bytes", span.received_bytes},
      {"repeated_segments", span.repeated}};
  if (!span.ended.empty()) json["ended"] = span.ended;
  json["samples_ms"] = OrderedJson::array();
  for (const auto& sample : span.samples)
    json["samples_ms"].push_back(
        OrderedJson::array({in_ms(sample.at), in_ms(sample.round_trip), in_ms(sample.offset)}));
  return json;
}

// A round number, so that the axis has about four marks.
double mark_step(double most) {
  const double rough = std::max(most, 1e-3) / 4;
  const double power = std::pow(10, std::floor(std::log10(rough)));
  for (const double times : {1.0, 2.0, 5.0})
    if (times * power >= rough) return times * power;
  return 10 * power;
}

}  // namespace

ProbeFigures figures_of(const ProbeSpan& span) {
  ProbeFigures figures;
  if (span.samples.empty()) return figures;
  std::vector<double> sorted;
  const ProbeSpan::Sample* best = &span.samples.front();
  double before = in_ms(best->round_trip);
  for (const auto& sample : span.samples) {
    sorted.push_back(in_ms(sample.round_trip));
    figures.jitter += std::abs(sorted.back() - before);
    before = sorted.back();
    if (sample.round_trip < best->round_trip) best = &sample;
  }
  figures.jitter /= static_cast<double>(std::max<std::size_t>(sorted.size() - 1, 1));
  std::sort(sorted.begin(), sorted.end());
  figures.least = sorted.front();
  figures.median = sorted[sorted.size() / 2];
  figures.most_of_100 = sorted[(sorted.size() * 99 + 99) / 100 - 1];
  figures.longest = sorted.back();
  figures.offset = in_ms(best->offset);
  figures.offset_bound = in_ms(best->round_trip) / 2;
  return figures;
}

std::string ping_text(const ProbeSpan& span) {
  const ProbeFigures figures = figures_of(span);
  std::string text = fmt::format("{} answers in {:.1f} s\n", span.samples.size(), in_s(span.took));
  if (!span.samples.empty())
    text += fmt::format(
        "round trip: least {:.2f} ms, median {:.2f} ms, 99 of 100 {:.2f} ms, longest {:.2f} ms, "
        "jitter {:.2f} ms\nthe server's clock: {:+.2f} ms, within {:.2f} ms\n",
        figures.least, figures.median, figures.most_of_100, figures.longest, figures.jitter,
        figures.offset, figures.offset_bound);
  text += fmt::format("TCP segments sent again: {} (a lost packet shows as a late answer)\n",
                      span.repeated);
  if (!span.ended.empty()) text += "ended early: " + span.ended + "\n";
  return text;
}

std::string bench_text(const std::vector<NamedSpan>& spans) {
  std::string text =
      fmt::format("{:<20} {:>7} {:>10} {:>10} {:>10} {:>13} {:>13} {:>6}\n", "", "answers",
                  "median", "99 of 100", "longest", "sent", "received", "again");
  for (const auto& [name, span] : spans) {
    const ProbeFigures figures = figures_of(span);
    text += fmt::format("{:<20} {:>7} {:>7.1f} ms {:>7.1f} ms {:>7.1f} ms {:>13} {:>13} {:>6}\n",
                        name, span.samples.size(), figures.median, figures.most_of_100,
                        figures.longest, rate_text(span.sent_bytes, span.took),
                        rate_text(span.received_bytes, span.took), span.repeated);
    if (!span.ended.empty()) text += "  ended early: " + span.ended + "\n";
  }
  return text + "\n" + kHowToRead;
}

std::string probe_json(const std::vector<NamedSpan>& spans) {
  OrderedJson json = {{"schema", 1}, {"spans", OrderedJson::array()}};
  for (const auto& named : spans) json["spans"].push_back(json_of(named));
  return json.dump(1, ' ', false, OrderedJson::error_handler_t::replace) + "\n";
}

std::string bench_svg(const std::vector<NamedSpan>& spans) {
  constexpr double kLeft = 60, kTop = 30, kWide = 800, kHigh = 260;
  double most = 0, all = 0;
  for (const auto& [name, span] : spans) {
    most = std::max(most, figures_of(span).longest);
    all += in_ms(span.took);
  }
  const double step = mark_step(most);
  const double top = std::max(step * std::ceil(most / step), step);
  const auto x = [&](double ms) { return kLeft + kWide * ms / std::max(all, 1.0); };
  const auto y = [&](double ms) { return kTop + kHigh * (1 - ms / top); };
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" "
      "font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
      kLeft + kWide + 20, kTop + kHigh + 30);
  for (double mark = 0; mark <= top + step / 2; mark += step)
    text += fmt::format(
        "<line x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\" stroke=\"#ddd\"/>"
        "<text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5:g} ms</text>\n",
        kLeft, kLeft + kWide, y(mark), kLeft - 6, y(mark) + 4, mark);
  double from = 0;
  for (const auto& [name, span] : spans) {
    text += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" stroke=\"#888\"/>"
        "<text x=\"{3:.1f}\" y=\"{4}\">{5}</text>\n<polyline fill=\"none\" stroke=\"#06c\" "
        "points=\"",
        x(from), kTop, kTop + kHigh, x(from) + 4, kTop - 8, name);
    for (const auto& sample : span.samples)
      text +=
          fmt::format("{:.1f},{:.1f} ", x(from + in_ms(sample.at)), y(in_ms(sample.round_trip)));
    text += "\"/>\n";
    from += in_ms(span.took);
  }
  return text + fmt::format("<text x=\"{}\" y=\"{}\">round trip over {:.0f} s</text>\n</svg>\n",
                            kLeft, kTop + kHigh + 20, all / 1000);
}

}  // namespace connect_bridge
