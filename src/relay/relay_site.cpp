#include "relay/relay_site.hpp"

#include <utility>

#include "access/login/runtime_folder.hpp"

namespace connect_bridge {

RelaySite::RelaySite(asio::io_context& io, std::function<RelayStatus()> status, Log log)
    : status_(std::move(status)), log_(std::move(log)) {
  door_ = std::make_shared<StatusDoor>(
      io,
      StatusDoor::Ports{[this](const StatusRequest& request, const StatusDoor::Answered& answered) {
                          answered(answer(request));
                        },
                        [](const std::string&) { return 403U; },
                        [this](LogLevel level, const std::string& text) { log_(level, text); }});
}

RelaySite::~RelaySite() {
  door_->close();
}

std::string RelaySite::open(const StatusOptions& at) {
  std::string problem = at.address.empty() ? "" : door_->listen(at.address, at.port, std::nullopt);
  if (!problem.empty()) return "status.listen: " + problem;
  const std::string folder = make_runtime_folder(problem);
  if (problem.empty()) problem = door_->listen_at_file(status_socket(folder, "relay"));
  if (!problem.empty()) log_(LogLevel::kInfo, "without a socket for ctl status: " + problem);
  return {};
}

void RelaySite::tell() {
  texts_.clear();
  now_.reset();
  if (door_->streams() > 0) door_->tell(event(true), event(false));
}

const RelayStatus& RelaySite::now() {
  if (!now_) now_ = status_();
  return *now_;
}

SharedText RelaySite::once(Kind kind, bool flag, const std::function<std::string()>& make) {
  SharedText& text = texts_[{kind, flag}];
  if (!text) text = std::make_shared<const std::string>(make());
  return text;
}

SharedText RelaySite::event(bool names) {
  return once(Kind::kEvent, names,
              [&] { return "data: " + to_json(now(), false, names) + "\n\n"; });
}

StatusAnswer RelaySite::answer(const StatusRequest& request) {
  const bool names = request.sees_names;
  const std::string& path = request.path;
  if (path == "/healthz") return plain_answer(200, "alive");
  if (path == "/readyz") return plain_answer(200, "ready");
  if (path == "/metrics")
    return metrics_answer(request, once(Kind::kMetrics, request.open_metrics,
                                        [&] { return to_metrics(now(), request.open_metrics); }));
  if (path == "/api/status")
    return {200,
            "application/json",
            once(Kind::kStatus, names, [&] { return to_json(now(), true, names); }),
            {},
            false};
  if (path == "/api/events") return {200, "text/event-stream", event(names), {}, true};
  return plain_answer(404, "There are /healthz, /readyz, /metrics, /api/status, /api/events.");
}

}  // namespace connect_bridge
