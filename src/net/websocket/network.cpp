#include "net/websocket/network.hpp"

#include <algorithm>

#include <boost/asio/io_context.hpp>
#include <map>
#include <unordered_map>

#include "core/base/log_limit.hpp"
#include "core/ports/pin.hpp"
#include "net/relay/client_word.hpp"
#include "net/relay/relay_wire.hpp"
#include "net/tcp/route.hpp"
#include "net/tcp/route_watch.hpp"
#include "net/tcp/socket_tuning.hpp"
#include "net/tcp/steady_now.hpp"
#include "net/tls/certified.hpp"
#include "net/tls/tls_files.hpp"
#include "net/websocket/dial.hpp"
#include "net/websocket/listener.hpp"
#include "net/websocket/socket.hpp"
#include "net/websocket/websocket.hpp"

namespace connect_bridge {
namespace {

constexpr int kSilentDials = 60;  // then the next are slow (DialOptions)

}  // namespace

struct Network::State : std::enable_shared_from_this<Network::State> {
  State(asio::io_context& context, NetworkEvents event_sinks, SocketOptions socket_options)
      : io(context), events(std::move(event_sinks)), sockets(std::move(socket_options)) {}

  void add(ConnectionOpened opened, std::shared_ptr<WebSocket> socket,
           std::shared_ptr<Admission::Pending> pending_slot, std::shared_ptr<void> connection_slot);
  void on_arrival(Listener::Arrival arrival);
  void on_dialled(ConnectionId id, const DialOptions& options, std::shared_ptr<WebSocket> socket,
                  Failure why);
  void abandon();
  void watch_routes();
  void watch_route_to(const asio::ip::address& to);
  void on_routes_changed();
  void on_held(const std::string& peer);
  void forget(ConnectionId id);
  void log(LogLevel level, std::string text) {
    if (events.log) events.log(Log{level, std::move(text)});
  }
  ConnectionId free_id();
  // The words for this URL: those that prove to its relay that we know its robot, made of the
  // robot's pins, known from the options or from an earlier connection; and the one of our last
  // login there.
  std::vector<std::string> words_for(const DialOptions& options) const;
  TlsContext client_tls(const DialOptions& options, std::string& problem);
  std::shared_ptr<Socket> find(ConnectionId id) const;
  // The TLS files of the listener and of the dialer, as far as they are there.
  std::vector<TlsFiles*> tls_files();

  asio::io_context& io;
  NetworkEvents events;
  SocketOptions sockets;
  std::shared_ptr<Listener> listener;
  std::unordered_map<ConnectionId, std::shared_ptr<Socket>> connections;
  std::unordered_map<ConnectionId, std::shared_ptr<Dialing>> dials;
  std::shared_ptr<RouteWatch> routes;      // of who dials
  asio::ip::address dialled;               // the last that was tried, or one far away
  std::string route;                       // to it, when `routes` last reported; empty: not known
  TlsOptions dial_options;                 // what dial_tls was made of
  std::optional<TlsFiles> dial_tls;        // empty: no secure URL was dialed yet
  std::map<std::string, std::string> met;  // the pins of robots at relays, by name
  std::map<std::string, std::string>
      login_words;       // of the last login at each host, by DialUrl::whom()
  int silent_dials = 0;  // in a row, to which nothing answered
  std::uint64_t last_id = 0;
  Traffic past;  // of connections that are gone
  std::uint64_t past_extra_frames = 0;
  std::uint64_t held = 0;
  LogLimit holds;
  bool stopped = false;
};

std::shared_ptr<Socket> Network::State::find(ConnectionId id) const {
  const auto found = connections.find(id);
  return found == connections.end() ? nullptr : found->second;
}

std::vector<TlsFiles*> Network::State::tls_files() {
  std::vector<TlsFiles*> all;
  if (listener && listener->tls_files()) all.push_back(listener->tls_files());
  if (dial_tls) all.push_back(&*dial_tls);
  return all;
}

ConnectionId Network::State::free_id() {
  ConnectionId id;
  do {
    id.value = ++last_id;
  } while (!id || connections.count(id) != 0 || dials.count(id) != 0);
  return id;
}

// Reading the system's authorities takes milliseconds: not at every try.
TlsContext Network::State::client_tls(const DialOptions& options, std::string& problem) {
  if (!options.url.secure) return nullptr;
  if (!dial_tls || !(dial_options == options.tls)) {
    dial_options = options.tls;
    dial_tls.emplace(options.tls, Role::kClient);
  }
  return dial_tls->get(problem);
}

std::vector<std::string> Network::State::words_for(const DialOptions& options) const {
  const std::string& robot = options.url.robot;
  std::vector<std::string> words;
  const auto add = [&](const std::string& pin) {
    const std::string word = client_word(pin, robot);
    if (!word.empty() && words.size() < kClientWordsMax) words.push_back(word);
  };
  if (!robot.empty()) {
    if (const auto known = met.find(robot); known != met.end()) add(known->second);
    for (const std::string& entry : options.tls.pins) add(pin_in(entry).key);
  }
  const auto login = login_words.find(options.url.whom());
  if (login != login_words.end() && words.size() < kClientWordsMax) words.push_back(login->second);
  return words;
}

void Network::State::add(ConnectionOpened opened, std::shared_ptr<WebSocket> socket,
                         std::shared_ptr<Admission::Pending> pending_slot,
                         std::shared_ptr<void> connection_slot) {
  const ConnectionId id = opened.connection;
  SocketSetup setup;
  setup.opened = std::move(opened);
  setup.socket = std::move(socket);
  setup.events = &events;
  setup.gone = if_alive(this, &State::forget);
  setup.held = if_alive(this, &State::on_held);
  setup.options = sockets;
  setup.pending_slot = pending_slot;
  setup.connection_slot = std::move(connection_slot);
  const auto connection = std::make_shared<Socket>(std::move(setup));
  connections[id] = connection;
  if (pending_slot) {
    pending_slot->open = true;
    pending_slot->give_way = [weak = std::weak_ptr{connection}] {
      if (const auto self = weak.lock()) self->give_way();
    };
    pending_slot.reset();
  }
  connection->open();
}

void Network::State::forget(ConnectionId id) {
  const auto found = connections.find(id);
  if (found == connections.end()) return;
  past += found->second->traffic();
  past_extra_frames += found->second->extra_frames();
  connections.erase(found);
}

void Network::State::on_held(const std::string& peer) {
  ++held;
  const auto times = holds.count({steady_now(), 0});
  if (times)
    log(LogLevel::kWarn, peer + " sends more messages or bytes than are read of it: it waits (" +
                             std::to_string(*times) + " times since the last line)");
}

void Network::State::on_arrival(Listener::Arrival arrival) {
  arrival.from.connection = free_id();
  arrival.from.expires = certified_until(arrival.socket->next_layer().tls());
  add(std::move(arrival.from), std::move(arrival.socket), std::move(arrival.pending_slot),
      std::move(arrival.connection_slot));
}

void Network::State::on_dialled(ConnectionId id, const DialOptions& options,
                                std::shared_ptr<WebSocket> socket, Failure why) {
  const auto dial = std::move(dials[id]);
  dials.erase(id);
  past += dial->traffic();
  silent_dials = dial->was_silent() ? std::min(silent_dials + 1, kSilentDials) : 0;
  if (!socket) {
    // A proxy that ends TLS may refuse the list of protocols in which the word stands.
    if (why.cause == Cause::kTlsFails || why.cause == Cause::kConnectionLost)
      login_words.erase(options.url.whom());
    if (dial->tried()) {
      watch_route_to(*dial->tried());
    } else {
      dialled = asio::ip::address();  // a network that comes may be the one that knows the name
    }
    return events.input(DialFailed{id, std::move(why)});
  }
  if (!options.url.robot.empty()) met[options.url.robot] = pin_of(socket->next_layer().tls());
  ConnectionOpened opened{id, options.url.whom()};
  opened.server = server_of(socket->next_layer().tls(), options.tls, server_name(options));
  ErrorCode error;
  const auto remote = socket->next_layer().socket().remote_endpoint(error);
  if (!error) watch_route_to(remote.address());
  add(std::move(opened), std::move(socket), nullptr, nullptr);
}

void Network::State::watch_routes() {
  if (routes || stopped) return;
  routes = std::make_shared<RouteWatch>(io, [this] { on_routes_changed(); });
  const std::string problem = routes->open();
  if (!problem.empty()) log(LogLevel::kDebug, "changes of the network are not noticed: " + problem);
  watch_route_to(asio::ip::make_address(kFarAway));
}

// A new route to the same address waits for on_routes_changed(), which has to report it.
void Network::State::watch_route_to(const asio::ip::address& to) {
  if (to == dialled) return;
  dialled = to;
  route = route_to(to);
}

void Network::State::on_routes_changed() {
  const auto now_open = connections;  // one that ends takes itself out
  for (const auto& entry : now_open) entry.second->check_address();
  // Most changes concern others: containers that come and go, addresses that are renewed.
  const std::string now = dialled.is_unspecified() ? "" : route_to(dialled);
  const std::string before = std::exchange(route, now);
  events.input(NetworkChanged{before.empty() || before != route});
}

void Network::State::abandon() {
  routes.reset();
  if (listener) listener->close();
  for (const auto& entry : dials) entry.second->abandon();
  for (const auto& entry : connections) entry.second->abandon();
  dials.clear();
  connections.clear();
}

Network::Network(asio::io_context& io, NetworkEvents events, SocketOptions sockets)
    : state_(std::make_shared<State>(io, std::move(events), std::move(sockets))) {}

Network::~Network() {
  state_->abandon();
}

std::string Network::listen(const ListenOptions& options) {
  state_->listener =
      std::make_shared<Listener>(state_->io, state_->sockets,
                                 Listener::Events{if_alive(state_.get(), &State::on_arrival),
                                                  if_alive(state_.get(), &State::log)});
  std::string problem = state_->listener->open(options);
  if (!problem.empty()) state_->listener.reset();
  return problem;
}

std::uint16_t Network::listen_port() const {
  return state_->listener ? state_->listener->port() : std::uint16_t{0};
}

std::vector<std::string> Network::listen_addresses() const {
  return state_->listener ? state_->listener->addresses() : std::vector<std::string>{};
}

void Network::dial(ConnectionId connection, const DialOptions& options) {
  state_->watch_routes();
  std::string problem;
  TlsContext tls = state_->client_tls(options, problem);
  DialOptions how = options;
  how.slow = state_->silent_dials >= kSilentDials;
  const auto dialing =
      std::make_shared<Dialing>(state_->io, std::move(how), state_->sockets, std::move(tls));
  dialing->show(state_->words_for(options));
  state_->dials[connection] = dialing;
  dialing->start([weak = std::weak_ptr{state_}, connection, options](
                     std::shared_ptr<WebSocket> socket, Failure failure) {
    if (const auto state = weak.lock()) {
      state->on_dialled(connection, options, std::move(socket), std::move(failure));
    }
  });
  if (state_->stopped) return dialing->cancel({Cause::kGoingAway, "this side is stopping"});
  if (!problem.empty()) dialing->cancel({Cause::kCertificateFiles, problem});
}

void Network::check_files() {
  if (state_->listener) state_->listener->check_files();
  if (const auto news = state_->dial_tls ? state_->dial_tls->check() : std::nullopt)
    state_->log(news->used ? LogLevel::kInfo : LogLevel::kWarn, news->text);
}

// Setting the clock may have brought the end nearer, so it is compared each time.
void Network::every_second(const Now& now) {
  for (TlsFiles* const files : state_->tls_files())
    if (const auto line = files->certificate().take_line(now)) state_->log(LogLevel::kWarn, *line);
  if (state_->listener) state_->listener->tell_refusals(now.steady);
  for (const auto& entry : state_->connections) entry.second->follow_path();
}

std::vector<std::string> Network::refused_files() const {
  std::vector<std::string> all;
  for (TlsFiles* const files : state_->tls_files())
    if (!files->problem().empty()) all.push_back("TLS: " + files->problem());
  return all;
}

Stamp Network::certificate_end() const {
  for (TlsFiles* const files : state_->tls_files())
    if (const Stamp end = files->certificate().end(); end != 0) return end;
  return 0;
}

bool Network::has_one_at_most() const {
  return state_->connections.size() + (state_->listener ? state_->listener->pending() : 0) <= 1;
}

void Network::read_on(ConnectionId connection) {
  if (const auto found = state_->find(connection)) found->go_on();
}

void Network::send(ConnectionId connection) {
  if (const auto found = state_->find(connection)) found->send();
}

void Network::allow(ConnectionId connection, std::size_t packet_bytes_max) {
  const auto found = state_->find(connection);
  if (!found) return;
  found->allow(packet_bytes_max);
  const std::string word = found->login_word();
  if (state_->listener) return state_->listener->note_login(found->address(), word);
  if (!word.empty()) state_->login_words[found->peer()] = word;
}

void Network::close(ConnectionId connection, CloseCode code, const std::string& reason) {
  if (const auto found = state_->find(connection)) {
    found->close(static_cast<std::uint16_t>(code), reason);
  }
  const auto dialing = state_->dials.find(connection);
  if (dialing != state_->dials.end())
    dialing->second->cancel({cause_of(code), "given up: " + reason});
}

void Network::stop() {
  state_->stopped = true;
  state_->routes.reset();
  if (state_->listener) state_->listener->close();
  for (const auto& entry : state_->dials)
    entry.second->cancel({Cause::kGoingAway, "this side is stopping"});
  for (const auto& entry : state_->connections) {
    entry.second->close(static_cast<std::uint16_t>(CloseCode::kGoingAway), "the peer is stopping");
  }
}

bool Network::all_closed() const {
  return std::all_of(state_->connections.begin(), state_->connections.end(),
                     [](const auto& entry) { return entry.second->has_ended(); });
}

Certified Network::certified(ConnectionId connection) const {
  const auto found = state_->find(connection);
  return found && found->is_open() ? found->certified() : certified_by(nullptr);
}

std::string Network::dial_problem(const DialOptions& options) {
  std::string problem;
  state_->client_tls(options, problem);
  return problem;
}

std::string Network::refused_options() const {
  asio::ip::tcp::socket probe(state_->io);
  ErrorCode error;
  probe.open(asio::ip::tcp::v4(), error);
  if (error) probe.open(asio::ip::tcp::v6(), error);
  return error ? "" : tune_socket(probe.native_handle(), state_->sockets);
}

TcpCounts Network::tcp_counts(ConnectionId connection) const {
  const auto found = state_->find(connection);
  return found && found->is_open() ? found->tcp_counts() : TcpCounts{};
}

std::vector<PlaceAtRelay> Network::relays() const {
  const PlaceAtRelay* const place = state_->listener ? state_->listener->relay() : nullptr;
  return place == nullptr ? std::vector<PlaceAtRelay>{} : std::vector{*place};
}

Traffic Network::traffic() const {
  Traffic sum = state_->past;
  if (state_->listener) sum += state_->listener->traffic();
  for (const auto& entry : state_->connections) sum += entry.second->traffic();
  return sum;
}

NetworkCounts Network::counts() const {
  NetworkCounts counts;
  if (const auto& listener = state_->listener) {
    static_cast<DoorCounts&>(counts) = listener->counts();
    counts.pending = listener->pending();
  }
  counts.held = state_->held;
  counts.extra_frames = state_->past_extra_frames;
  for (const auto& entry : state_->connections) {
    counts.extra_frames += entry.second->extra_frames();
    if (entry.second->is_open()) ++counts.open;
  }
  return counts;
}

}  // namespace connect_bridge
