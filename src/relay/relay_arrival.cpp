#include "relay/relay_arrival.hpp"

#include <boost/asio/read.hpp>
#include <utility>

namespace connect_bridge {

void RelayArrival::read(bool from_proxy, std::shared_ptr<void> owner, Events events) {
  events_ = std::move(events);
  from_proxy ? read_proxy(owner) : read_hello(owner);
}

void RelayArrival::read_proxy(const std::shared_ptr<void>& owner) {
  const ProxyHeader header = read_proxy_header(header_);
  if (header.state == ProxyHeader::State::kMore)
    return more(owner, header_, header.missing, &RelayArrival::read_proxy);
  if (header.state == ProxyHeader::State::kWrong) return events_.read(State::kWrong);
  if (header.source) events_.from(*header.source);
  read_hello(owner);
}

void RelayArrival::read_hello(const std::shared_ptr<void>& owner) {
  said_ = read_client_hello(hello_);
  if (said_.state == ClientHello::State::kMore)
    return more(owner, hello_, said_.missing, &RelayArrival::read_hello);
  events_.read(said_.state == ClientHello::State::kComplete ? State::kHello : State::kWrong);
}

void RelayArrival::more(const std::shared_ptr<void>& owner, Bytes& bytes, std::size_t missing,
                        void (RelayArrival::*then)(const std::shared_ptr<void>&)) {
  const std::size_t have = bytes.size();
  bytes.resize(have + missing);
  asio::async_read(socket_, asio::buffer(bytes.data() + have, missing),
                   [this, owner, have, then](ErrorCode error, std::size_t n) {
                     if (!error) return (this->*then)(owner);
                     events_.read(have + n == 0 ? State::kNothing : State::kWrong);
                   });
}

}  // namespace connect_bridge
