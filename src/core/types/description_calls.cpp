#include "core/types/description_calls.hpp"

#include <algorithm>
#include <utility>

#include "core/types/description_service.hpp"
#include "core/types/type_description.hpp"

namespace connect_bridge {

bool DescriptionCalls::admit(ServiceMirrorId server, const Now& now) {
  const auto under_way = std::count_if(calls_.begin(), calls_.end(),
                                       [&](const Call& call) { return call.server == server; });
  if (calls_.size() >= kCallsMax || under_way >= std::ptrdiff_t{kServerCallsMax}) return false;
  Pace& own = paces_.try_emplace(server, kServerAtOnceMax, kServerPeriod).first->second;
  // The server's own pace first: a caller that asks one server too often uses up nothing of the
  // pace that all servers share.
  return own.take(now.steady) && pace_.take(now.steady);
}

void DescriptionCalls::begin(const RequestTaken& request, const Now& now) {
  const auto asked = read_description_request(request.payload.view());
  if (!asked) return outputs_.push(DropRequest{request.mirror, request.request});
  if (!admit(request.mirror, now))
    return outputs_.push(SendResponse{
        request.mirror, request.request,
        description_refusal("too many types are asked for at a time: ask again later")});
  Call call{
      request.mirror,        request.request, {asked->type, asked->hash}, asked->with_sources, {},
      now.steady + kPatience};
  call.lookup = outputs_.new_lookup();
  outputs_.push(LookUpType{call.lookup, call.type.first, call.type.second});
  calls_.push_back(std::move(call));
}

std::optional<Definition> DescriptionCalls::on_looked_up(const TypeLookedUp& found) {
  const auto at = std::find_if(calls_.begin(), calls_.end(), [&](const Call& call) {
    return call.lookup && call.lookup == found.lookup;
  });
  if (at == calls_.end()) return std::nullopt;
  // From here on it waits for a peer, and is found by its type: several calls may want the same.
  at->lookup = {};
  const Definition type = at->type;
  if (found.text.empty()) return type;
  on_there(type, found.text);
  return std::nullopt;
}

bool DescriptionCalls::waits_for(const Definition& type) const {
  return std::any_of(calls_.begin(), calls_.end(),
                     [&](const Call& call) { return !call.lookup && call.type == type; });
}

void DescriptionCalls::on_there(const Definition& type, const std::string& text) {
  std::erase_if(calls_, [&](const Call& call) {
    if (call.lookup || call.type != type) return false;
    answer(call, text);
    return true;
  });
}

void DescriptionCalls::on_callers_gone(const CallersGone& gone) {
  std::erase_if(calls_, [&](const Call& call) {
    return call.server == gone.mirror && std::find(gone.requests.begin(), gone.requests.end(),
                                                   call.request) != gone.requests.end();
  });
}

void DescriptionCalls::on_server_gone(ServiceMirrorId server) {
  std::erase_if(calls_, [&](const Call& call) { return call.server == server; });
  paces_.erase(server);
}

void DescriptionCalls::on_time(const Now& now) {
  // All have the same patience, so they end in the order in which they came.
  while (!calls_.empty() && calls_.front().until <= now.steady) {
    const Call call = std::move(calls_.front());
    calls_.erase(calls_.begin());
    answer(call, {});
  }
}

std::optional<TimePoint> DescriptionCalls::deadline() const {
  if (calls_.empty()) return std::nullopt;
  return calls_.front().until;
}

void DescriptionCalls::answer(const Call& call, const std::string& text) {
  const auto& [type, hash] = call.type;
  // Also what is installed here is checked: the caller names the hash, and must get that definition
  // or none. A text may have the right hash and be that of another type's name.
  const bool right = !text.empty() && type_hash_of(text) == hash;
  const auto description = parse_description(right ? text : std::string{});
  const bool known = description && description.value().type.name == type;
  outputs_.push(SendResponse{
      call.server, call.request,
      known ? description_response(description.value(), call.with_sources)
            : description_refusal("the type " + type + " with this hash is not known here")});
}

}  // namespace connect_bridge
