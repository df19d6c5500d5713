// A whole simulated world, from its seed to the last checker's verdict.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "sim/checker.hpp"
#include "sim/corner.hpp"
#include "sim/crowd.hpp"
#include "sim/day.hpp"
#include "sim/expectation.hpp"
#include "sim/host.hpp"
#include "sim/hostile.hpp"
#include "sim/middleware.hpp"
#include "sim/network.hpp"
#include "sim/scenario.hpp"
#include "sim/service_crowd.hpp"
#include "sim/service_expectation.hpp"
#include "sim/services.hpp"
#include "sim/weather.hpp"

namespace connect_bridge::sim {

struct WorldCounts {
  std::uint64_t events = 0;
  std::uint64_t published = 0;  // on mirrors
  std::uint64_t delivered = 0;  // to subscribers, from mirrors
  std::uint64_t frames = 0;
  Coverage coverage;
};

class World : public Middleware::Listener, public Services::Listener {
 public:
  World(Scenario scenario, bool verbose);

  // Throws Violation.
  void run();
  [[nodiscard]] WorldCounts counts() const;
  // Of all that the sides have done.
  [[nodiscard]] std::uint64_t digest() const { return digest_.value(); }
  // What a world that lives for a day went through.
  [[nodiscard]] std::string text_of_day() const { return day_ ? day_->text() : ""; }
  // Prints what each side knows of its links; for a verbose run that failed.
  void tell_status() const;

  void on_delivery(const Reader& reader, const Writer& writer, const Sample& sample) override;
  void on_graph_change(int graph) override;
  void on_request(const Servant& servant, RequestKey key, const Payload& payload) override;
  void on_response(const Caller& caller, const Servant& servant, RequestKey key,
                   const Payload& payload) override;
  void on_found(const Caller& caller) override;
  void on_caller_gone(const Caller& caller) override;
  void on_services_change(int graph) override { on_graph_change(graph); }

 private:
  void build_hosts(bool verbose);
  void build_strangers();
  void inspect();
  void run_for(Duration how_long) { schedule_.run_until(schedule_.now() + how_long); }
  void drain();
  void check_delivery();
  void check_first_words();
  void check_services();
  void renew_late_logins();
  void check_long_goals();
  void check_late_subscribers();
  void check_no_demand();
  void check_last_words();
  // What the sender that knows its path as the slowest takes it for, in bytes per second.
  [[nodiscard]] std::uint64_t known_rate() const;
  // Bytes that wait on all links.
  [[nodiscard]] std::uint64_t backlog() const;
  void let_backlogs_leave();
  void end();

  Scenario scenario_;
  Digest digest_;
  Rng rng_;
  Schedule schedule_;
  Middleware middleware_;
  Services services_;
  Network network_;
  Checker checker_;
  Crowd crowd_;
  ServiceCrowd service_crowd_;
  Corner corner_;
  std::vector<std::unique_ptr<Host>> hosts_;
  std::unique_ptr<Weather> weather_;
  std::vector<std::unique_ptr<Hostile>> strangers_;
  std::unique_ptr<Expectation> expectation_;
  std::unique_ptr<ServiceExpectation> service_expectation_;
  std::unique_ptr<Day> day_;  // of a world that lives for one
};

}  // namespace connect_bridge::sim
