// Names that somebody here wants and does not get over a link, and why: from values alone.
// One unit: all reasons are tried in one order, and share the picture of the link.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/graph/side_view.hpp"
#include "core/link/link.hpp"
#include "core/ports/status.hpp"

namespace connect_bridge {

// Something that a node here wants of other graphs: a topic that it subscribes and nobody here
// publishes or brings, a service that it has a client of and nobody here serves, a topic that it
// publishes and nobody here subscribes.
struct Wish {
  InterfaceKind kind = InterfaceKind::kTopic;  // kTopic, kService
  bool exported = false;
  std::string name;  // local; of an action that of its goals
  std::string type;

  auto operator<=>(const Wish&) const = default;
};

// Hidden names only where somebody subscribes or calls; an action is one wish, by its goals.
// Without bridges' own, the parameter events, which every node has, and /diagnostics, which every
// bridge publishes; /rosout, which every node publishes, only where a node of an operator
// subscribes. At most kWishesMax of each direction.
inline constexpr std::size_t kWishesMax = 512;
[[nodiscard]] std::vector<Wish> wishes_of(const GraphView& graph, const Claims& claims,
                                          bool is_operator);

// The peer's answers (docs/protocol.md, "ask, answer") by what was asked.
using Answers = std::map<Wish, std::string>;

// The channels of a link, and what is known of the other names.
struct LinkPicture {
  TimePoint at{};
  std::vector<ChannelFacts> channels;
  std::vector<TopicKey> heard;  // what the peer listens to, local names
  Answers answers;
  bool brought = false;  // some link brings what is wanted here
};

struct MissingFound {
  std::vector<MissingName> names;
  std::vector<Wish> unanswered;  // only the peer can say why, and has not been asked
  std::size_t further = 0;       // names that are left out
};

// `wishes`: those that no link brings. Topics that are published here and that no rule here, or
// none of the peer's, names are left out where they are more than kLonelyMax.
inline constexpr std::size_t kLonelyMax = 10;
[[nodiscard]] MissingFound find_missing(const std::vector<Wish>& wishes, const SideView& side,
                                        const Link& link, const LinkPicture& picture);

// The code that this side answers when the peer of a link asks for a name.
[[nodiscard]] std::string_view answer_to(const SideView& side, const Link& link,
                                         const AskedName& asked);
// The question of this side to the peer; nullopt: the peer cannot see that name, or the rules here
// do not let it in any longer.
[[nodiscard]] std::optional<AskedName> question_of(const SideView& side, const Link& link,
                                                   const Wish& wish);

}  // namespace connect_bridge
