#include <fmt/format.h>

#include <csignal>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "access/pairing/pairing.hpp"
#include "config/syntax.hpp"
#include "core/policy/pattern.hpp"
#include "ctl/check.hpp"
#include "ctl/ctl_commands.hpp"
#include "ctl/probe_report.hpp"
#include "ops/doctor/host_check.hpp"
#include "run/assembly.hpp"
#include "run/exit_codes.hpp"
#include "run/surroundings.hpp"

namespace {

using namespace connect_bridge;

struct PingOrder {
  std::string file;  // a client's parameter file; empty: what this user's client was paired with
  double seconds = 10;
  double interval = 0.2;
  bool json = false;
};

struct BenchOrder {
  std::string file;
  double seconds = 5;  // of each part
  std::uint64_t rate = 1'000'000;
  std::vector<std::string> topics;
  bool json = false;
  std::string svg;  // a file to write, too; empty: none
};

constexpr int kNoLink = 1;
constexpr auto kPatience = std::chrono::seconds(15);
constexpr auto kOffers = std::chrono::seconds(2);  // until the server has offered its topics

Duration seconds_of(double seconds) {
  return syntax::from_seconds(seconds);
}

// The parameters with which a client would start, and their problems.
Start client_start(const std::string& file) {
  if (file.empty()) return start_with({}, {}, "/connect_client");
  OfNode part = read_for_node(file, "client");
  Start start;
  start.parameters = std::move(part.parameters);
  start.problems = texts_of(part.problems);
  return start;
}

// A probe with an open link. Null: no link opened, and standard error and `exit_code` report why.
std::unique_ptr<Probe> open_probe(const std::string& file, const char* node,
                                  const Probe::Options& options, int& exit_code) {
  std::signal(SIGPIPE, SIG_IGN);
  const Start start = client_start(file);
  std::vector<std::string> problems = start.problems;
  Parsed parsed;
  if (problems.empty()) parsed = parse_config(start.parameters, Role::kClient, surroundings());
  for (const auto& problem : parsed.problems) problems.push_back(to_text(problem));
  Assembly assembly;
  if (parsed.config) assembly = assemble(*parsed.config, node, start);
  append(problems, texts_of(assembly.problems));
  exit_code = complain(fmt::format("{}", fmt::join(problems, "\n")), kExitConfiguration);
  if (!assembly.parts) return nullptr;
  auto probe = std::make_unique<Probe>(std::move(*assembly.parts), options);
  const Failure failure = probe->open(kPatience);
  if (!failure) return probe;
  exit_code = complain(failure.text, kNoLink);
  return nullptr;
}

void add_file(CLI::App& command, std::string& file) {
  command.footer(
      "It logs in as the client does, as one more client, and gets no more than the server's rules "
      "give that login. Exit code: 0 if it was measured, 1 if there is no link, or it was lost, 2 "
      "if the file is wrong.");
  command.add_option("file", file,
                     "A client's parameter file. Without it: what this user's client was paired "
                     "with");
}

bool write_file(const std::string& file, const std::string& text) {
  std::ofstream out(file);
  if (out << text << std::flush) return true;
  std::fprintf(stderr, "%s: cannot be written\n", file.c_str());
  return false;
}

int run_ping(const PingOrder& order) {
  int no_link = 0;
  const auto probe = open_probe(order.file, "/ctl_ping", {seconds_of(order.interval), {}}, no_link);
  if (!probe) return no_link;
  const auto print = [](const ProbeSpan::Sample& sample) {
    const std::chrono::duration<double> at = sample.at;
    const std::chrono::duration<double, std::milli> round_trip = sample.round_trip;
    std::printf("%7.2f s  %8.2f ms\n", at.count(), round_trip.count());
    std::fflush(stdout);
  };
  const ProbeSpan span =
      probe->measure(seconds_of(order.seconds), {},
                     order.json ? std::function<void(const ProbeSpan::Sample&)>{} : print);
  std::fputs((order.json ? probe_json({{"idle", span}}) : ping_text(span)).c_str(), stdout);
  probe->close();
  return span.ended.empty() ? 0 : kNoLink;
}

int run_bench(const BenchOrder& order) {
  std::string wrong;
  for (const auto& topic : order.topics)
    if (!is_pattern(topic)) wrong += topic + ": this is no name or pattern of topics\n";
  if (!wrong.empty()) return complain(wrong, kExitConfiguration);
  int no_link = 0;
  const auto probe =
      open_probe(order.file, "/ctl_bench",
                 {std::chrono::milliseconds(100), syntax::parse_patterns(order.topics)}, no_link);
  if (!probe) return no_link;
  if (!order.topics.empty()) static_cast<void>(probe->measure(kOffers, {}));
  if (!order.topics.empty() && probe->topics() == 0)
    complain("the server offers none of the topics to this login: nothing is received", 0);
  struct Part {
    const char* name;
    Probe::Load load;
  };
  std::vector<Part> plan{{"idle", {}}, {"sending", {order.rate, false}}};
  if (probe->topics() > 0) {
    plan.push_back({"receiving", {0, true}});
    plan.push_back({"sending, receiving", {order.rate, true}});
  }
  std::vector<NamedSpan> spans;
  for (const auto& [name, load] : plan) {
    if (!order.json) std::fprintf(stderr, "%s ...\n", name);
    spans.push_back({name, probe->measure(seconds_of(order.seconds), load)});
    if (!spans.back().span.ended.empty()) break;
  }
  const bool whole = spans.back().span.ended.empty();
  if (whole) probe->close();
  std::fputs((order.json ? probe_json(spans) : bench_text(spans)).c_str(), stdout);
  if (!order.svg.empty() && !write_file(order.svg, bench_svg(spans))) return kExitConfiguration;
  return whole ? 0 : kNoLink;
}

}  // namespace

void add_ping_command(CLI::App& app, int& exit_code) {
  const auto order = std::make_shared<PingOrder>();
  auto* ping = app.add_subcommand(
      "ping", "Measure round trip, jitter and clock of the way to a server, over time");
  add_file(*ping, order->file);
  ping->add_option("--seconds", order->seconds, "How long")->check(CLI::Range(1.0, 3600.0));
  ping->add_option("--interval", order->interval, "Seconds between two questions")
      ->check(CLI::Range(0.02, 10.0));
  ping->add_flag("--json", order->json, "As JSON, at the end");
  ping->callback([order, &exit_code] { exit_code = run_ping(*order); });
}

void add_bench_command(CLI::App& app, int& exit_code) {
  const auto order = std::make_shared<BenchOrder>();
  auto* bench = app.add_subcommand(
      "bench", "Measure how good the link to a server is: idle, while sending, while receiving");
  add_file(*bench, order->file);
  bench->add_option("--seconds", order->seconds, "How long each part takes")
      ->check(CLI::Range(1.0, 60.0));
  bench
      ->add_option("--rate", order->rate,
                   "The most bytes per second that it sends. Other links share the way: a robot "
                   "that is being driven feels it")
      ->check(CLI::Range(std::uint64_t{1000}, std::uint64_t{10'000'000}));
  bench->add_option("--topic", order->topics,
                    "A topic to receive for the load from the server, as the server calls it, or "
                    "a pattern; several times. Without one nothing is received");
  bench->add_flag("--json", order->json, "As JSON");
  bench->add_option("--svg", order->svg, "Also a picture, into this file");
  bench->callback([order, &exit_code] { exit_code = run_bench(*order); });
}
