#include "ops/status/status_site.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <exception>

#include "access/login/runtime_folder.hpp"
#include "core/base/base64.hpp"
#include "core/base/json.hpp"
#include "core/base/sha256.hpp"
#include "net/tcp/steady_now.hpp"
#include "net/tcp/system_now.hpp"
#include "status_page.hpp"

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kHistoryPoints = 300;  // five minutes
constexpr auto kFresh = 2500ms;              // a picture is given once a second
constexpr auto kPatience = 3s;               // for one
constexpr auto kInterest = 10s;              // so long after a question the next is expected
constexpr int kNice = 10;
constexpr char kJson[] = "application/json";

// The page with its columns in it.
const std::string& page_text() {
  static const std::string text = [] {
    constexpr std::string_view kMark = "/*columns*/{}";
    std::string page = kStatusPage;
    return page.replace(page.find(kMark), kMark.size(), page_columns().dump());
  }();
  return text;
}

// The page may do what its own script does, and nothing else.
std::string policy_of_page() {
  const auto hash_of = [](std::string_view begin, std::string_view end) {
    const std::string_view page{page_text()};
    const std::size_t from = page.find(begin) + begin.size();
    const std::string_view part = page.substr(from, page.find(end, from) - from);
    const Digest digest = sha256({reinterpret_cast<const std::uint8_t*>(part.data()), part.size()});
    return "'sha256-" + to_base64(digest) + "'";
  };
  return "default-src 'none'; script-src " + hash_of("<script>", "</script>") + "; style-src " +
         hash_of("<style>", "</style>") +
         "; connect-src 'self'; img-src data:; frame-ancestors 'none'; base-uri 'none'; "
         "form-action 'none'";
}

SharedText shared(std::string text) {
  return std::make_shared<const std::string>(std::move(text));
}

}  // namespace

StatusSite::StatusSite(Options options, Tell tell)
    : options_(std::move(options)), tell_(std::move(tell)), seconds_(io_) {
  StatusDoor::Ports ports{[this](const StatusRequest& request, Answered answered) {
                            ask(request, std::move(answered));
                          },
                          [this](const std::string& token) { return judge(token); },
                          [this](LogLevel level, const std::string& text) { tell_(level, text); }};
  door_ = std::make_shared<StatusDoor>(io_, std::move(ports));
}

StatusSite::~StatusSite() {
  io_.stop();
  if (thread_.joinable()) thread_.join();
  door_->close();
}

std::string StatusSite::open() {
  if (!options_.at.address.empty()) {
    std::string problem = options_.at.beyond_loopback ? open_judge() : "";
    if (problem.empty())
      problem =
          door_->listen(options_.at.address, options_.at.port,
                        options_.at.beyond_loopback ? std::optional{options_.tls} : std::nullopt);
    if (!problem.empty()) return "status.listen: " + problem;
    tell_(LogLevel::kInfo, std::string{"the status is at http"} +
                               (options_.at.beyond_loopback ? "s" : "") + "://" +
                               host_and_port(options_.at.address, door_->port()) + "/");
  }
  std::string problem;
  const std::string folder = make_runtime_folder(problem);
  if (problem.empty()) problem = door_->listen_at_file(status_socket(folder, options_.node));
  if (!problem.empty()) tell_(LogLevel::kInfo, "without a socket for ctl status: " + problem);
  every_second();
  thread_ = std::thread([this] {
    // Linux sets the priority of this thread alone.
    (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice);
    try {
      io_.run();
    } catch (const std::exception& error) {  // no memory
      ended_ = true;
      tell_(LogLevel::kError,
            std::string{"the status is not answered any longer: "} + error.what());
    }
  });
  return {};
}

std::string StatusSite::open_judge() {
  AuthSetup setup = make_authenticator({options_.auth, std::nullopt}, system_now());
  authenticator_ = std::move(setup.authenticator);
  return setup.problems.empty() ? "" : setup.problems.front();
}

bool StatusSite::wanted() const {
  return !ended_ && (!options_.at.address.empty() || Clock::now() - asked_.load() < kInterest);
}

void StatusSite::publish(std::shared_ptr<const StatusPicture> picture) {
  boost::asio::post(io_, [this, picture = std::move(picture)] { take(picture); });
}

void StatusSite::Past::add(const LinkStatus& link, Clock::time_point now) {
  const double seconds = std::chrono::duration<double>(now - at).count();
  const bool same = !points.empty() && link.open && connects == link.connects && seconds > 0;
  const auto growth = [&](std::uint64_t bytes, std::uint64_t before) {
    return same && bytes >= before ? std::optional(static_cast<double>(bytes - before) / seconds)
                                   : std::nullopt;
  };
  const auto if_open = [&](double value) {
    return link.open ? std::optional(value) : std::nullopt;
  };
  points.push_back(
      {link.clock.known ? std::optional(milliseconds_of(link.clock.round_trip)) : std::nullopt,
       if_open(milliseconds_of(link.path_queue)), if_open(link.rate), growth(link.sent_bytes, sent),
       growth(link.received_bytes, received)});
  at = now;
  connects = link.connects;
  sent = link.sent_bytes;
  received = link.received_bytes;
}

void StatusSite::take(const std::shared_ptr<const StatusPicture>& picture) {
  picture_ = picture;
  picture_at_ = Clock::now();
  texts_.clear();
  metrics_.count(*picture_, steady_now());
  std::map<std::uint64_t, Past> history;
  for (const LinkStatus& link : picture_->side.links) {
    Past& past = history[link.number] = std::move(history_[link.number]);
    past.add(link, picture_at_);
    if (past.points.size() > kHistoryPoints) past.points.pop_front();
  }
  history_ = std::move(history);
  for (const auto& waiting : std::exchange(waiting_, {})) waiting.answered(answer(waiting.request));
  if (door_->streams() == 0) return;
  asked_ = Clock::now();
  door_->tell(event(Names::kShown), event(Names::kHidden));
}

template <class Make>
const SharedText& StatusSite::text_of(const char* what, Names names, Make make) {
  SharedText& text = texts_[{what, names}];
  if (!text) text = shared(make());
  return text;
}

const SharedText& StatusSite::event(Names names) {
  return text_of("event", names,
                 [&] { return "data: " + to_json(*picture_, names, false) + "\n\n"; });
}

bool StatusSite::is_fresh() const {
  return picture_ && Clock::now() - picture_at_ < kFresh;
}

void StatusSite::ask(const StatusRequest& request, Answered answered) {
  asked_ = Clock::now();
  if (request.path == "/" || is_fresh()) return answered(answer(request));
  waiting_.push_back({request, std::move(answered), Clock::now()});
}

StatusAnswer StatusSite::answer(const StatusRequest& request) {
  const std::string& path = request.path;
  const Names names = request.sees_names ? Names::kShown : Names::kHidden;
  if (path == "/") {
    static const std::string policy = policy_of_page();
    static const SharedText page = shared(page_text());
    return {200, "text/html; charset=utf-8", page, policy, false};
  }
  if (path == "/healthz") return plain_answer(200, "alive");
  if (path == "/readyz") return readiness();
  if (path == "/metrics")
    return metrics_answer(
        request, text_of(request.open_metrics ? "metrics" : "older metrics", Names::kHidden,
                         [&] { return metrics_.text(request.open_metrics); }));
  if (path == "/api/status")
    return {
        200, kJson, text_of("status", names, [&] { return to_json(*picture_, names); }), {}, false};
  if (path == "/api/history")
    return {200, kJson, text_of("history", Names::kHidden, [&] { return history(); }), {}, false};
  if (path == "/api/events")  // the first at once
    return {200, "text/event-stream", event(names), {}, true};
  return plain_answer(404,
                      "There are /, /healthz, /readyz, /metrics, /api/status, /api/events, "
                      "/api/history.");
}

// A server is ready when it listens, which it does.
StatusAnswer StatusSite::readiness() const {
  const auto& links = picture_->side.links;
  const bool linked =
      std::any_of(links.begin(), links.end(), [](const LinkStatus& link) { return link.open; });
  if (picture_->run.role == Role::kServer || linked) return plain_answer(200, "ready");
  const Failure& why = picture_->side.last_failure;
  const std::string code = why ? " (" + std::string(word_of(why.cause)) + ")" : "";
  return plain_answer(503, "no link to the server: " + why.text + code);
}

std::string StatusSite::history() const {
  Json json = {{"schema", kStatusSchema}, {"period_seconds", 1}, {"links", Json::array()}};
  for (const auto& [link, past] : history_) {
    Json shown = {{"link", link}};
    const auto add = [&](const char* name, const std::optional<double>& value) {
      shown[name].push_back(value ? Json(*value) : Json());
    };
    for (const Point& point : past.points) {
      add("round_trip_ms", point.round_trip_ms);
      add("path_queue_ms", point.path_queue_ms);
      add("rate_bytes_per_second", point.rate);
      add("sent_bytes_per_second", point.sent);
      add("received_bytes_per_second", point.received);
    }
    json["links"].push_back(std::move(shown));
  }
  return json.dump();
}

unsigned StatusSite::judge(const std::string& token) {
  const Judgement judged =
      authenticator_->judge({"token", Bytes(token.begin(), token.end()), {}}, system_now());
  if (!judged.identity) return 401;
  const auto& has = judged.identity->groups;
  const auto& wanted = options_.at.groups;
  const auto common = std::find_first_of(has.begin(), has.end(), wanted.begin(), wanted.end());
  return common != has.end() ? 200 : 403;
}

void StatusSite::every_second() {
  if (authenticator_)
    for (const auto& problem : authenticator_->refresh(system_now()).problems)
      tell_(LogLevel::kError, "status.listen: " + problem);
  door_->check_files();
  const auto late = std::stable_partition(
      waiting_.begin(), waiting_.end(),
      [now = Clock::now()](const Waiting& waiting) { return now - waiting.since < kPatience; });
  std::vector<Waiting> over(std::make_move_iterator(late), std::make_move_iterator(waiting_.end()));
  waiting_.erase(late, waiting_.end());
  for (const auto& waiting : over)
    waiting.answered(plain_answer(503, "The loop of this side does not move."));
  seconds_.expires_after(1s);
  seconds_.async_wait([this](const ErrorCode& cancelled) {
    if (!cancelled) every_second();
  });
}

}  // namespace connect_bridge
