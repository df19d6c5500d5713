// The state of a stranger's services and its peer's, and its messages about them.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/wire/control.hpp"
#include "core/wire/frame.hpp"
#include "sim/label.hpp"
#include "sim/network.hpp"
#include "sim/rng.hpp"

namespace connect_bridge::sim {

// Importer and exporter at once (docs/protocol.md section 9). A step is strange, but must not end
// the connection; an offence must.
class HostileServices {
 public:
  using Send = std::function<void(bool text, Bytes bytes)>;
  struct Offence {
    std::string name;
    // Asked later: false if a message that was on its way has made it legal.
    std::function<bool()> stands;
  };

  // `label`: of all its requests.
  HostileServices(Rng rng, std::uint32_t label, Send send)
      : rng_(rng), label_(label), send_(std::move(send)) {}

  void begin();  // a new connection
  // What the peer says.
  void hear(const Control& control);
  void hear(const MessageFrame& frame);

  // Returns what it was.
  std::string step();
  // What the peer has still to withdraw, because we have withdrawn what it was attached to.
  [[nodiscard]] const std::set<std::uint32_t>& owed() const { return owed_; }
  Offence offend();
  // Accepts everything, so that the peer could offer what it should not.
  void accept_all();

 private:
  // What the peer offers.
  struct Theirs {
    std::string name;
    std::uint32_t epoch = 0;  // 0: a topic
    bool withdrawn = false;
    std::uint32_t requests = 0;     // that we attached with; 0: not attached
    std::set<std::uint32_t> ended;  // calls that it has answered or refused
  };
  // A channel that we send messages on.
  struct Stream {
    std::uint32_t sequence = 0;
    Bytes rest;  // of the message that is open
  };
  // A channel for requests of ours.
  struct Requests {
    std::uint32_t service = 0;  // the peer's channel
    bool attached = false;
    std::uint32_t last = 0;  // call
    Stream stream;
  };
  // A service that we offer.
  struct Mine {
    std::uint32_t requests = 0;  // the peer attached with; 0: it is not attached
    bool told = false;           // and knows it
    std::vector<std::uint32_t> calls;
    std::set<std::uint32_t> named;  // calls that we have said to know
    Stream stream;
  };
  using TheirsById = std::map<std::uint32_t, Theirs>;
  using MineById = std::map<std::uint32_t, Mine>;
  using RequestsById = std::map<std::uint32_t, Requests>;

  void end_call(std::uint32_t channel, std::uint32_t call);
  // ---- as importer
  std::string attach();
  std::string attach_to_what_is_gone();
  std::string request();
  std::string detach();
  std::string forget();
  std::string ask_in_vain();
  // ---- as exporter
  std::string offer();
  std::string say_attached();
  std::string answer();
  std::string refuse();
  std::string withdraw();

  void say(const Control& control);
  void say(const std::string& text);
  void send(const Frame& frame, ByteView part);
  // Begins a message, all of it or a part, or goes on with the one that is open.
  void send_message(std::uint32_t channel, Stream& stream, std::uint32_t call);
  [[nodiscard]] Label label_of(std::uint32_t channel, std::uint32_t call) const;
  void send_request(std::uint32_t channel, std::uint32_t sequence, std::uint32_t call);
  std::uint32_t new_number();
  std::uint32_t offer_one(const std::string& name, const std::string& type,
                          const std::string& action_type, std::uint32_t epoch);
  std::vector<CallId> some_calls(const std::vector<std::uint32_t>& known);
  // Whether the peer accepts what we send there.
  [[nodiscard]] bool may_send(const Requests& requests) const;
  // Any of those that fit; the map's end if none does.
  template <class Map, class Fits>
  typename Map::iterator pick(Map& map, Fits fits) {
    std::vector<typename Map::iterator> found;
    for (auto it = map.begin(); it != map.end(); ++it) {
      if (fits(it->second)) found.push_back(it);
    }
    return found.empty() ? map.end() : rng_.pick(found);
  }

  // ---- hostile_offences.cpp
  Offence attach_wrongly(std::uint64_t which);
  Offence request_wrongly(std::uint64_t which);
  Offence tell_wrongly(std::uint64_t which);
  Offence name_what_never_was(std::uint64_t which);
  Offence say_malformed();
  // One that is attached, or will be when the peer reads on; made if there is none.
  std::optional<std::uint32_t> an_attached();
  [[nodiscard]] std::function<bool()> while_offered(std::uint32_t channel) const;
  [[nodiscard]] std::function<bool()> while_attached(std::uint32_t channel,
                                                     std::uint32_t requests) const;

  Rng rng_;
  std::uint32_t label_;
  Send send_;
  std::uint32_t last_number_ = 0;
  std::uint32_t their_last_ = 0;  // channel number that the peer has come to
  TheirsById theirs_;
  MineById mine_;
  RequestsById requests_;
  std::set<std::uint32_t> owed_;
  // What was called before, by name and epoch: on other connections, too.
  std::map<std::pair<std::string, std::uint32_t>, std::uint32_t> last_calls_, highest_calls_;
};

}  // namespace connect_bridge::sim
