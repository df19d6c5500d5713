#include "ops/status/status_json.hpp"

#include <algorithm>
#include <span>
#include <utility>

namespace connect_bridge {
namespace {

// Adds the fields of one row each to the object. Of a list with reasons the codes are no secret.
template <class Of>
void put(OrderedJson& json, std::span<const StatusField<Of>> fields, const Of& of, Names names,
         Role role) {
  for (const StatusField<Of>& field : fields) {
    OrderedJson value = field.value(of);
    if (value.is_null()) continue;
    const bool hidden = names == Names::kHidden &&
                        (field.seen_by == SeenBy::kUser ||
                         (field.seen_by == SeenBy::kUserOfServer && role == Role::kServer));
    if (hidden && value.is_array()) {
      for (OrderedJson& one : value) one.erase("reason");
    } else if (hidden && !value.is_string()) {
      continue;
    } else if (hidden) {
      value = "";
    }
    const std::size_t dot = field.name.find('.');
    const std::string name{field.name.substr(0, dot)};
    if (dot == std::string_view::npos) {
      json[name] = std::move(value);
    } else {
      json[name][std::string(field.name.substr(dot + 1))] = std::move(value);
    }
  }
}

template <class Of>
OrderedJson list_of(std::span<const StatusField<Of>> fields, const std::vector<Of>& all) {
  OrderedJson list = OrderedJson::array();
  for (const Of& one : all) {
    OrderedJson json = OrderedJson::object();
    put(json, fields, one, Names::kShown, Role::kServer);
    list.push_back(std::move(json));
  }
  return list;
}

}  // namespace

void LinkPlaces::follow(const std::vector<LinkStatus>& links) {
  const auto has = [](const auto& all, const auto& is) {
    return std::any_of(all.begin(), all.end(), is);
  };
  for (auto& place : places_)
    if (!has(links, [&](const LinkStatus& link) { return link.number == place; })) place = 0;
  for (const LinkStatus& link : links) {
    if (has(places_, [&](std::uint64_t place) { return place == link.number; })) continue;
    auto free = std::find(places_.begin(), places_.end(), 0U);
    if (free == places_.end()) free = places_.insert(free, 0);
    *free = link.number;
  }
}

std::size_t LinkPlaces::of(const LinkStatus& link) const {
  const auto place = std::find(places_.begin(), places_.end(), link.number);
  return static_cast<std::size_t>(place - places_.begin()) + 1;
}

OrderedJson facts_of(const LinkStatus& link, Names names) {
  OrderedJson json = OrderedJson::object();
  put(json, link_fields(), link, names, Role::kServer);
  return json;
}

OrderedJson facts_of(const StatusPicture& picture, Names names) {
  OrderedJson json = OrderedJson::object();
  put(json, side_fields(), picture, names, picture.run.role);
  return json;
}

namespace {

OrderedJson to_value(const LinkStatus& link, Names names) {
  OrderedJson json = facts_of(link, names);
  json["topics"] = list_of(topic_fields(), link.topics);
  json["services"] = list_of(service_fields(), link.services);
  json["missing"] = list_of(missing_fields(), link.missing);
  if (link.further_missing > 0) json["further_missing"] = {{"count", link.further_missing}};
  if (link.further_topics > 0) {
    OrderedJson& further = json["further_topics"] = {{"count", link.further_topics}};
    for (const auto& field : topic_fields())
      for (const char* summed : {"messages", "bytes", "wire_bytes", "queued", "dropped"})
        if (field.name == summed) further[summed] = field.value(link.further);
  }
  if (link.further_services > 0) json["further_services"] = {{"count", link.further_services}};
  return json;
}

}  // namespace

std::string to_json(const StatusPicture& picture, Names names, bool in_lines) {
  OrderedJson json = facts_of(picture, names);
  json["links"] = OrderedJson::array();
  for (const auto& link : picture.side.links) json["links"].push_back(to_value(link, names));
  return json.dump(in_lines ? 1 : -1, ' ', false, OrderedJson::error_handler_t::replace);
}

}  // namespace connect_bridge
