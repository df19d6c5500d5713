#include "net/url.hpp"

namespace connect_bridge {

std::string Url::authority() const {
  std::string text = host.find(':') == std::string::npos ? host : "[" + host + "]";
  if (port != (secure ? 443 : 80)) text += ":" + std::to_string(port);
  return text;
}

std::string Url::text() const {
  return (secure ? "wss://" : "ws://") + authority() + path.substr(0, path.find('?'));
}

}  // namespace connect_bridge
