#include "ctl/probe.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <chrono>
#include <cstring>
#include <utility>

#include "core/base/overloaded.hpp"
#include "core/link/standing.hpp"
#include "core/wire/control.hpp"
#include "net/tcp/steady_now.hpp"
#include "net/tcp/system_now.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kFillerBytes = 8 << 10;
constexpr auto kPullPeriod = std::chrono::milliseconds(2);
constexpr Duration kSilence = std::chrono::seconds(30);  // a bad path must be measurable, too

Now now() {
  return {steady_now(), system_now(), 0};
}

SideOptions options_of(const BridgeParts& parts, const Probe::Options& options) {
  SideOptions side = parts.side;
  side.dead_after = std::max(kSilence, 3 * options.interval);
  side.time_period = options.interval;
  side.audits = false;
  side.clock_publish_period = {};
  Rule rule;
  rule.name = "probe";
  rule.opens[Direction::kImport][OpenedBy::kTopics] = options.topics;
  side.policy = Policy({rule});
  return side;
}

// A control message that changes nothing: a peer ignores members that it does not know
// (docs/protocol.md section 3).
Payload make_filler() {
  std::string text = encode(Demand{});
  std::string noise;
  std::uint32_t state = 1;
  while (text.size() + noise.size() < kFillerBytes) {
    state = state * 1664525 + 1013904223;
    noise += static_cast<char>('A' + (state >> 24) % 26);
  }
  text.insert(text.size() - 1, ",\"filler\":\"" + noise + "\"");
  return Payload::adopt(Bytes(text.begin(), text.end()));
}

}  // namespace

Probe::Probe(BridgeParts parts, Options options)
    : parts_(std::move(parts)),
      side_(options_of(parts_, options), parts_.side.secret_random(), system_now()),
      network_(
          io_,
          {[this](Input&& input) { handle(std::move(input)); },
           [this](ConnectionId id, const Repairs& repairs) { return next_packet(id, repairs); },
           [this](PacketReceived&& packet) {
             const ConnectionId connection = packet.connection;
             handle(std::move(packet));
             network_.read_on(connection);
           },
           {}},
          parts_.sockets),
      timer_(io_),
      pulls_(io_),
      logs_in_(options.logs_in),
      workers_({}, [this](JobDone done) {
        boost::asio::post(io_, [this, done = std::move(done)]() mutable {
          workers_.handled(done);
          handle(std::move(done));
        });
      }) {}

template <class Done>
void Probe::run_for(Duration time, Done done) {
  const TimePoint end = steady_now() + time;
  while (!done() && steady_now() < end) {
    io_.restart();
    io_.run_one_until(std::chrono::steady_clock::time_point(end.time_since_epoch()));
  }
}

Failure Probe::open(Duration patience) {
  handle(GraphChanged{});  // nobody is here
  run_for(patience, [this] { return open_ || reached_ || bool(why_not_); });
  if (open_ || reached_) return {};
  return why_not_ ? why_not_ : Failure{Cause::kServerSilent, "no answer"};
}

ProbeSpan Probe::measure(Duration time, const Load& load,
                         const std::function<void(const ProbeSpan::Sample&)>& each) {
  span_ = {};
  each_ = each;
  span_since_ = steady_now();
  const std::uint64_t repeated = repeated_;
  const bool listens = std::exchange(load_, load).receive;
  if (listens != load.receive) show_graph();
  if (load_.send_bytes_per_second > 0) network_.send(connection_);
  run_for(time, [this] { return !open_; });
  load_.send_bytes_per_second = 0;
  span_.took = steady_now() - span_since_;
  span_.repeated = repeated_ - repeated;
  if (!open_) span_.ended = why_not_ ? why_not_.text : "the link was lost";
  return std::exchange(span_, {});
}

void Probe::close() {
  handle(StopRequested{});
  run_for(std::chrono::seconds(1), [this] { return network_.all_closed(); });
}

void Probe::handle(Input&& input) {
  if (!logs_in_ && std::holds_alternative<ConnectionOpened>(input)) {
    reached_ = true;  // the side would say hello and log in
    return;
  }
  const bool is_packet = std::holds_alternative<PacketReceived>(input);
  if (const auto* const failed = std::get_if<DialFailed>(&input)) note_end(failed->why);
  if (const auto* const closed = std::get_if<ConnectionClosed>(&input)) {
    open_ = false;
    note_end(failure_of(*closed));
  }
  side_.handle(std::move(input), now());
  while (auto action = side_.next_action()) carry_out(std::move(*action));
  if (is_packet) note_sample();
  while (const auto connection = side_.take_ready()) network_.send(*connection);
  set_timer();
}

void Probe::note_end(const Failure& why) {
  if (!why_not_) why_not_ = why;
}

void Probe::carry_out(Action&& action) {
  std::visit(
      Overloaded{
          [&](Dial& a) {
            connection_ = a.connection;
            network_.dial(a.connection, parts_.dial);
          },
          [&](OpenGate& a) {
            open_ = true;
            network_.allow(a.connection, a.packet_bytes_max);
          },
          [&](CloseConnection& a) {
            note_end({cause_of(a.code), a.reason});
            network_.close(a.connection, a.code, a.reason);
          },
          [&](CreateMirror& a) {
            boost::asio::post(io_, [this, made = MirrorMade{a.id, next_gid()}] { handle(made); });
            if (a.topic.find("/_") != std::string::npos) return;  // bridges use it among themselves
            topics_[a.topic] = a.type;
            if (mirrors_.insert(a.id).second && load_.receive) show_graph();
          },
          [&](DestroyMirror& a) { mirrors_.erase(a.id); },
          [&](Publish& a) {
            if (mirrors_.contains(a.mirror)) span_.received_bytes += a.payload.size();
          },
          [&](DecompressJob& a) { workers_.add(std::move(a)); },
          [&](CompressJob& a) { workers_.add(std::move(a)); },
          [&](CancelJob& a) { workers_.cancel(a.job); }, [&](Stopped&) { network_.stop(); },
          [&](const auto&) {},  // actions for a graph that does not exist here
      },
      action);
}

Gid Probe::next_gid() {
  Gid gid;
  std::memcpy(gid.bytes.data(), &++gids_, sizeof gids_);
  return gid;
}

// Shows the side a listener of every offered topic, or of none.
void Probe::show_graph() {
  GraphChanged graph;
  for (const auto& [name, type] : topics_) {
    TopicState state;
    state.name = name;
    state.type = type;
    Endpoint listener;
    listener.gid.bytes.fill(1);
    listener.node_namespace = "/";
    listener.node_name = "probe";
    listener.qos = {Reliability::kBestEffort, Durability::kVolatile, History::kKeepLast, 10};
    state.subscribers.push_back(listener);
    if (load_.receive) graph.topics.push_back(std::move(state));
  }
  boost::asio::post(io_, [this, graph = std::move(graph)]() mutable { handle(std::move(graph)); });
}

void Probe::note_sample() {
  for (const LinkId link : side_.links()) {
    const auto status = side_.status_of(link, now());
    if (!status || status->clock.samples == samples_seen_) continue;
    samples_seen_ = status->clock.samples;
    const ProbeSpan::Sample sample{steady_now() - span_since_, status->clock.last_round_trip,
                                   status->clock.last_offset};
    span_.samples.push_back(sample);
    if (each_) each_(sample);
  }
}

std::optional<Packet> Probe::next_packet(ConnectionId id, const Repairs& repairs) {
  repeated_ = std::max(repeated_, repairs.repeated);
  auto packet = side_.next_packet(id, now(), repairs);
  if (packet) {
    packet->more = true;
    return packet;
  }
  set_timer();
  return open_ ? filler() : std::nullopt;
}

// The next message of the load, at the requested rate, or as fast as TCP takes it if that is less.
std::optional<Packet> Probe::filler() {
  static const Payload text = make_filler();
  const auto rate = static_cast<double>(load_.send_bytes_per_second);
  if (rate == 0) return std::nullopt;
  const double seconds = std::chrono::duration<double>(steady_now() - span_since_).count();
  if (static_cast<double>(span_.sent_bytes) > rate * seconds) {
    pulls_.expires_after(kPullPeriod);
    pulls_.async_wait([this](const boost::system::error_code& error) {
      if (!error && open_) network_.send(connection_);
    });
    return std::nullopt;
  }
  span_.sent_bytes += text.size();
  Packet packet;
  packet.text = true;
  packet.pieces.push_back(text);
  return packet;
}

void Probe::set_timer() {
  const auto deadline = side_.next_deadline();
  if (!deadline) return;
  timer_.expires_at(std::chrono::steady_clock::time_point(deadline->time_since_epoch()));
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) handle(TimePassed{});
  });
}

}  // namespace connect_bridge
