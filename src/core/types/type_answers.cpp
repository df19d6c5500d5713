#include "core/types/type_answers.hpp"

#include <algorithm>
#include <utility>

#include "core/types/description_service.hpp"
#include "core/types/type_description.hpp"

namespace connect_bridge {

std::size_t TypeAnswers::unanswered(const Link& link) {
  std::size_t count = 0;
  for (auto it = questions_.lower_bound({link.id, ChannelId{}});
       it != questions_.end() && it->first.first == link.id;) {
    const auto question = it++;
    if (link.outgoing(question->first.second)) {
      ++count;
    } else {
      end(question);
    }
  }
  return count;
}

Result<Nothing> TypeAnswers::on_describe(Link& link, const Describe& describe, const Now& now) {
  for (const ChannelId channel : describe.channels) {
    const OutgoingChannel* of = link.outgoing(channel);
    if (!of && !link.was_opened(channel))
      return Error{CloseCode::kUnknownChannel, "the type of a channel that was never offered"};
    if (!of) continue;  // it crossed our withdraw
    const std::pair key{link.id, channel};
    if (questions_.contains(key))
      return Error{CloseCode::kIllegal, "a type was asked for that is being looked up"};
    // Those whose channels this side has withdrawn do not count: the peer knows that no answer
    // comes (docs/protocol.md, "describe", rule 1).
    if (unanswered(link) >= kDescribesMax)
      return Error{CloseCode::kTooLarge, "more types are asked for at a time than allowed"};
    auto type = of->type();
    // Not an error: a peer with many types may ask often. "Not known" costs this side next to
    // nothing, and ends the question as any answer does.
    if (!type || !link.account->describes.take(now.steady)) {
      link.send(Description{channel});
      continue;
    }
    const LookupId lookup = outputs_.new_lookup();
    outputs_.push(LookUpType{lookup, type->type, type->hash});
    questions_[key] = {&link, channel, *std::move(type), lookup, {}, false, {}};
  }
  return Nothing{};
}

void TypeAnswers::on_link_lost(LinkId link) {
  for (auto it = questions_.lower_bound({link, ChannelId{}});
       it != questions_.end() && it->first.first == link;)
    end(it++);
}

void TypeAnswers::on_looked_up(const TypeLookedUp& found, const Now& now) {
  const auto question = std::find_if(questions_.begin(), questions_.end(), [&](const auto& entry) {
    return entry.second.lookup == found.lookup;
  });
  if (question == questions_.end()) return;
  question->second.lookup = {};
  if (!found.text.empty()) return answer(question, found.text);
  ask_node(question, now);
}

void TypeAnswers::ask_node(Questions::iterator question, const Now& now) {
  Question& asked = question->second;
  if (asked.type.node.empty() || !asked.link->account->nodes_asked.take(now.steady))
    return answer(question, {});
  // A node of this graph that may be anything: it may never answer, or answer what is wrong. So
  // there is a time limit, and answer() checks the text before it is sent.
  asked.client = outputs_.new_service_client();
  asked.until = now.steady + kPatience;
  const std::string service =
      (asked.type.node == "/" ? "" : asked.type.node) + "/" + std::string{kDescriptionService};
  outputs_.push(CreateServiceClient{asked.client, service, std::string{kDescriptionServiceType}});
}

TypeAnswers::Questions::iterator TypeAnswers::find(ServiceClientId client) {
  return std::find_if(questions_.begin(), questions_.end(),
                      [&](const auto& entry) { return client && entry.second.client == client; });
}

void TypeAnswers::on_ready(const ServiceReady& ready) {
  const auto question = find(ready.client);
  if (question == questions_.end() || !ready.ready) return;
  Question& asked = question->second;
  // The server may be lost and found again meanwhile: one request is enough.
  if (std::exchange(asked.sent, true)) return;
  outputs_.push(SendRequest{asked.client, outputs_.new_invocation(),
                            description_request(asked.type.type, asked.type.hash)});
}

void TypeAnswers::on_response(const ResponseTaken& response) {
  const auto question = find(response.client);
  if (question == questions_.end()) return;
  answer(question, text_of_response(response.payload.view()).value_or(""));
}

void TypeAnswers::on_failed(ServiceClientId client) {
  const auto question = find(client);
  if (question != questions_.end()) answer(question, {});
}

// The node may be wrong about its type, and the peer ends the connection for a text that has not
// the hash, or is too large.
void TypeAnswers::answer(Questions::iterator question, const std::string& text) {
  const Question& asked = question->second;
  const bool right =
      !text.empty() && text.size() <= kDescriptionBytesMax && type_hash_of(text) == asked.type.hash;
  if (asked.link->outgoing(asked.channel))
    asked.link->send(Description{asked.channel, right ? text : std::string{}});
  end(question);
}

void TypeAnswers::end(Questions::iterator question) {
  if (question->second.client) outputs_.push(DestroyServiceClient{question->second.client});
  questions_.erase(question);
}

void TypeAnswers::on_time(const Now& now) {
  for (auto it = questions_.begin(); it != questions_.end();) {
    const auto question = it++;
    if (question->second.until && *question->second.until <= now.steady) answer(question, {});
  }
}

std::optional<TimePoint> TypeAnswers::deadline() const {
  std::optional<TimePoint> first;
  for (const auto& [key, question] : questions_)
    if (question.until && (!first || *question.until < *first)) first = question.until;
  return first;
}

}  // namespace connect_bridge
