#include "net/listener.hpp"

#include <sys/socket.h>

#include <boost/asio/ip/v6_only.hpp>

#include "net/socket_tuning.hpp"

namespace connect_bridge {
namespace {

constexpr std::chrono::milliseconds kRetryTime{100};
// Behind a proxy, which mostly is at this host, is the whole world.
constexpr int kProxyShare = 8;
constexpr std::size_t kPacesMax = 4096;

TimePoint steady_now() {
  return TimePoint(std::chrono::steady_clock::now().time_since_epoch());
}

// The key that limits count by: an IPv6 customer has at least a /64 of addresses.
std::string limit_key(const asio::ip::address& address) {
  if (address.is_v4()) return address.to_string();
  auto bytes = address.to_v6().to_bytes();
  std::fill(bytes.begin() + 8, bytes.end(), static_cast<unsigned char>(0));
  return asio::ip::make_address_v6(bytes).to_string();
}

int share_of(const asio::ip::address& address) {
  return address.is_loopback() ? kProxyShare : 1;
}

std::string host_text(const asio::ip::address& address) {
  return address.is_v6() ? "[" + address.to_string() + "]" : address.to_string();
}

std::string peer_text(const asio::ip::address& address, std::uint16_t port) {
  return host_text(address) + ":" + std::to_string(port);
}

}  // namespace

Listener::Listener(asio::io_context& io, SocketOptions sockets, Events events)
    : io_(io), sockets_(std::move(sockets)), events_(std::move(events)) {}

std::string Listener::open(const ListenOptions& options) {
  auto accept_options = std::make_shared<AcceptOptions>();
  accept_options->path = options.path;
  accept_options->origins = options.origins;
  accept_options->timeout = options.handshake_timeout;
  accept_options->told_by = options.told_by;
  for (const std::string& text : options.trusted_proxies) {
    const auto range = AddressRange::parse(text);
    if (!range) return "trusted proxy '" + text + "': it is no IP address and no range of them";
    accept_options->proxies.push_back(*range);
  }
  if (options.tls) {
    std::string problem;
    tls_.emplace(*options.tls);
    accept_options->tls = tls_->get(problem);
    if (!accept_options->tls) return problem;
  }
  limits_ = options;
  admission_ =
      std::make_shared<Admission>(options.connections_max, options.pending_per_address_max);
  accept_options->reserve = [admission = admission_] { return admission->take_connection(); };
  options_ = std::move(accept_options);

  const std::string problem = open_doors(options);
  if (!problem.empty()) return problem;
  spare_ = static_cast<int>(doors_.size()) - 1;
  pace_ = Pace(options.handshakes_at_once + spare_, options.handshake_period);
  for (const DoorPtr& door : doors_) accept(door);
  return {};
}

std::string Listener::open_doors(const ListenOptions& options) {
  std::string problem;
  for (std::size_t i = 0; i < options.sockets.size() && problem.empty(); ++i)
    problem = take_socket(options.sockets[i]);
  if (!options.sockets.empty()) return problem;
  std::vector<std::string> addresses = options.addresses;
  if (addresses == std::vector<std::string>{"*"}) {
    if (bind("::", options.port).empty()) return {};
    addresses = {"0.0.0.0"};  // a host without IPv6
  }
  for (std::size_t i = 0; i < addresses.size() && problem.empty(); ++i)
    problem = bind(addresses[i], i == 0 ? options.port : port());
  return problem;
}

std::uint16_t Listener::port() const {
  ErrorCode ignored;
  return doors_.empty() ? std::uint16_t{0} : doors_[0]->acceptor.local_endpoint(ignored).port();
}

std::vector<std::string> Listener::addresses() const {
  std::vector<std::string> texts;
  for (const DoorPtr& door : doors_) {
    ErrorCode ignored;
    const Endpoint endpoint = door->acceptor.local_endpoint(ignored);
    texts.push_back(peer_text(endpoint.address(), endpoint.port()));
  }
  return texts;
}

void Listener::check_files() {
  const auto news = tls_ ? tls_->check() : std::nullopt;
  if (!news) return;
  if (news->used) {
    auto changed = std::make_shared<AcceptOptions>(*options_);
    std::string problem;
    changed->tls = tls_->get(problem);
    options_ = std::move(changed);
  }
  log(news->used ? LogLevel::kInfo : LogLevel::kWarn, news->text);
}

std::string Listener::bind(const std::string& address, std::uint16_t port) {
  ErrorCode error;
  const auto parsed = asio::ip::make_address(address == "localhost" ? "127.0.0.1" : address, error);
  if (error) return "cannot listen on '" + address + "': it is no IP address";
  const Endpoint endpoint{parsed, port};
  const auto door = std::make_shared<Door>(io_);
  Acceptor& acceptor = door->acceptor;
  ErrorCode ignored;
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(Acceptor::reuse_address(true), error);
  if (!error && parsed.is_v6()) {
    acceptor.set_option(asio::ip::v6_only(!parsed.is_unspecified()), ignored);
  }
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(Acceptor::max_listen_connections, error);
  if (error) return "cannot listen on " + peer_text(parsed, port) + ": " + error.message();
  doors_.push_back(door);
  return {};
}

std::string Listener::take_socket(int socket) {
  const auto option = [socket](int name) {
    int value = -1;
    socklen_t size = sizeof value;
    return getsockopt(socket, SOL_SOCKET, name, &value, &size) == 0 ? value : -1;
  };
  const int family = option(SO_DOMAIN);
  if ((family != AF_INET && family != AF_INET6) || option(SO_TYPE) != SOCK_STREAM ||
      option(SO_ACCEPTCONN) != 1)
    return "the socket " + std::to_string(socket) +
           " that this process was given does not listen for TCP";
  const auto door = std::make_shared<Door>(io_);
  ErrorCode error;
  door->acceptor.assign(family == AF_INET ? asio::ip::tcp::v4() : asio::ip::tcp::v6(), socket,
                        error);
  if (error) return "cannot use the socket that this process was given: " + error.message();
  doors_.push_back(door);
  return {};
}

void Listener::close() {
  for (const DoorPtr& door : doors_) {
    ErrorCode ignored;
    door->acceptor.close(ignored);
    door->retry.cancel();
  }
  events_ = {};
  const auto acceptances = std::move(acceptances_);
  acceptances_.clear();
  for (const auto& acceptance : acceptances) acceptance->abandon();
}

void Listener::accept(const DoorPtr& door) {
  door->acceptor.async_accept(io_.get_executor(),
                              [self = shared_from_this(), door](ErrorCode error, TcpSocket socket) {
                                self->on_accepted(door, error, std::move(socket));
                              });
}

void Listener::on_accepted(const DoorPtr& door, const ErrorCode& error, TcpSocket socket) {
  if (!door->acceptor.is_open()) return;
  if (!error) {
    ++accepted_;
    admit(std::move(socket));
    return accept_at(door, pace_.free_at() + spare_ * limits_.handshake_period);
  }
  if (error == asio::error::connection_aborted) return accept(door);
  // Out of file descriptors or memory: the kernel keeps them waiting, and asking again at once
  // would spin.
  log(LogLevel::kWarn, "cannot accept connections now: " + error.message());
  accept_at(door, steady_now() + kRetryTime);
}

// Until then the kernel keeps them waiting.
void Listener::accept_at(const DoorPtr& door, TimePoint when) {
  if (when <= steady_now()) return accept(door);
  door->retry.expires_at(std::chrono::steady_clock::time_point(when.time_since_epoch()));
  door->retry.async_wait([weak = weak_from_this(), at = std::weak_ptr{door}](ErrorCode cancelled) {
    const auto self = weak.lock();
    const auto waiting = at.lock();
    if (self && waiting && !cancelled && waiting->acceptor.is_open()) self->accept(waiting);
  });
}

// A TLS handshake costs the loop a signature, a millisecond or ten. Those of one address are
// limited first, so that it cannot use up what all have together; those that a trusted proxy brings
// have its pace only.
bool Listener::take_handshake(const std::string& key, int share) {
  const TimePoint now = steady_now();
  if (paces_.size() >= kPacesMax)
    std::erase_if(paces_, [&](const auto& entry) { return entry.second.idle(now); });
  if (share > 0 && (paces_.size() < kPacesMax || paces_.contains(key))) {
    const Pace fresh(limits_.address_handshakes_at_once * share,
                     limits_.address_handshake_period / share);
    if (!paces_.try_emplace(key, fresh).first->second.take(now)) return false;
  }
  return pace_.take(now);
}

void Listener::drop(TcpSocket& socket, const std::string& why) {
  ++refused_;
  ErrorCode ignored;
  socket.set_option(TcpSocket::linger(true, 0), ignored);
  socket.close(ignored);
  log(LogLevel::kDebug, why);
}

void Listener::admit(TcpSocket socket) {
  ErrorCode error;
  const Endpoint remote = socket.remote_endpoint(error);
  if (error) return;  // gone already
  const auto address = plain_address(remote.address());
  const auto visitor = std::make_shared<Visitor>();
  visitor->peer = peer_text(address, remote.port());
  visitor->address = address;
  const bool proxy = contain(options_->proxies, address);
  if (limits_.proxies_only && !proxy)
    return drop(socket, visitor->peer + ": dropped, it is no trusted proxy");
  const std::string key = limit_key(address);
  const int share = proxy ? 0 : share_of(address);
  const bool told_before_tls = proxy && options_->told_by == ToldBy::kProxyProtocol;
  if (options_->tls && !told_before_tls && !take_handshake(key, share))
    return drop(socket, visitor->peer + ": dropped, too many handshakes");
  visitor->slot = admission_->take_pending(proxy ? std::string{} : key, share);
  const std::string refused = tune_socket(socket.native_handle(), sockets_);
  if (!refused.empty() && !tuning_told_) {
    tuning_told_ = true;
    log(LogLevel::kWarn, "this host refuses socket options: " + refused);
  }
  start(std::move(socket), visitor, proxy);
}

void Listener::start(TcpSocket socket, std::shared_ptr<Visitor> visitor, bool from_proxy) {
  const auto weak = weak_from_this();
  Acceptance::Identify identify;
  if (from_proxy) {
    identify = [weak, visitor](const std::optional<Source>& source) {
      const auto self = weak.lock();
      return self && self->identify(*visitor, source);
    };
  }
  auto acceptance = std::make_shared<Acceptance>(std::move(socket), options_, std::move(identify));
  acceptances_.insert(acceptance);
  visitor->slot->give_way = [weak, handshake = std::weak_ptr{acceptance}] {
    const auto self = weak.lock();
    const auto oldest = handshake.lock();
    if (!self || !oldest) return;
    ++self->refused_;
    self->acceptances_.erase(oldest);
    oldest->abandon();
  };
  acceptance->start([weak, handshake = std::weak_ptr{acceptance}, visitor](Accepted accepted) {
    if (const auto self = weak.lock()) {
      self->on_done(handshake.lock(), *visitor, std::move(accepted));
    }
  });
}

bool Listener::identify(Visitor& visitor, const std::optional<Source>& source) {
  if (source) {
    visitor.address = source->address;
    visitor.peer =
        source->port == 0 ? host_text(source->address) : peer_text(source->address, source->port);
  }
  const std::string key = limit_key(visitor.address);
  // Without a client's address the proxy itself counts.
  const int share = source ? share_of(visitor.address) : kProxyShare;
  const bool before_tls = options_->tls && options_->told_by == ToldBy::kProxyProtocol;
  if (before_tls && !take_handshake(key, share)) return false;
  admission_->move_pending(*visitor.slot, key, share);
  return true;
}

void Listener::on_done(const std::shared_ptr<Acceptance>& acceptance, Visitor& visitor,
                       Accepted accepted) {
  acceptances_.erase(acceptance);
  const auto slot = std::move(visitor.slot);
  if (!accepted.notice.empty()) log_notice(visitor, accepted.notice);
  if (!accepted.socket) {
    ++refused_;
    return log(LogLevel::kDebug, visitor.peer + ": " + accepted.problem);
  }
  if (!events_.arrived) return;
  events_.arrived({std::move(accepted.socket), visitor.peer, slot, std::move(accepted.slot)});
}

void Listener::log_notice(const Visitor& visitor, const std::string& notice) {
  if (notices_.take(steady_now())) log(LogLevel::kWarn, visitor.peer + ": " + notice);
}

void Listener::log(LogLevel level, const std::string& text) {
  if (events_.log) events_.log(level, text);
}

}  // namespace connect_bridge
