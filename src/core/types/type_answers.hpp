// What peers ask about the types of the channels that this side offers them.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "core/base/timers.hpp"
#include "core/link/link.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// Answers each `describe` once: from the installed package, else by asking a node that has the
// type, else that it is not known. Nothing is kept afterwards. A peer can ask only about channels
// that it is offered, so it does not learn what else is installed; how much it makes this side do
// is limited by its account and by kDescribesMax. Single-threaded; owned by the side.
class TypeAnswers {
 public:
  // A node that has not answered by then is not waited for.
  static constexpr Duration kPatience = std::chrono::seconds(2);

  explicit TypeAnswers(Outputs& outputs) : outputs_(outputs) {}

  // An error ends the connection with its code.
  Result<Nothing> on_describe(Link& link, const Describe& describe, const Now& now);
  // Its channels have ended.
  void on_link_lost(LinkId link);

  // Ids that are not of a question here are ignored.
  void on_looked_up(const TypeLookedUp& found, const Now& now);
  void on_ready(const ServiceReady& ready);
  void on_response(const ResponseTaken& response);
  void on_failed(ServiceClientId client);
  void on_time(const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const;

 private:
  struct Question {
    Link* link = nullptr;  // valid until on_link_lost()
    ChannelId channel;
    ChannelType type;
    LookupId lookup;         // while it is looked up here
    ServiceClientId client;  // while a node is asked
    bool sent = false;       // the request to it
    std::optional<TimePoint> until;
  };
  using Questions = std::map<std::pair<LinkId, ChannelId>, Question>;

  // Ends those whose channel has ended: the peer does not wait for them.
  [[nodiscard]] std::size_t unanswered(const Link& link);
  [[nodiscard]] Questions::iterator find(ServiceClientId client);
  void ask_node(Questions::iterator question, const Now& now);
  // `text`: checked here against the hash; else, or without one, the answer is that it is not
  // known.
  void answer(Questions::iterator question, const std::string& text);
  void end(Questions::iterator question);

  Outputs& outputs_;
  Questions questions_;
};

}  // namespace connect_bridge
