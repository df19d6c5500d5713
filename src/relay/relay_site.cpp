#include "relay/relay_site.hpp"

#include <utility>

#include "auth/runtime_folder.hpp"

namespace connect_bridge {
namespace {

SharedText shared_text(std::string text) {
  return std::make_shared<const std::string>(std::move(text));
}

SharedText event_of(const RelayStatus& status) {
  return shared_text("data: " + to_json(status, false) + "\n\n");
}

}  // namespace

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
  if (door_->streams() == 0) return;
  const SharedText event = event_of(status_());
  door_->tell(event, event);
}

StatusAnswer RelaySite::answer(const StatusRequest& request) const {
  const std::string& path = request.path;
  if (path == "/healthz") return plain_answer(200, "alive");
  if (path == "/readyz") return plain_answer(200, "ready");
  if (path == "/metrics")
    return metrics_answer(request, shared_text(to_metrics(status_(), request.open_metrics)));
  if (path == "/api/status")
    return {200, "application/json", shared_text(to_json(status_(), true)), {}, false};
  if (path == "/api/events") return {200, "text/event-stream", event_of(status_()), {}, true};
  return plain_answer(404, "There are /healthz, /readyz, /metrics, /api/status, /api/events.");
}

}  // namespace connect_bridge
