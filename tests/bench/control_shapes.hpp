// Control messages of the largest size, of shapes that take long to read.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/wire/control.hpp"

namespace bench {

struct Shape {
  std::string name, text;
};

// `piece` as often as there is room, at most `count` times; each '#' in it is how often it stood
// there before.
inline std::string filled(std::string_view before, std::string_view piece, std::string_view after,
                          std::size_t count = connect_bridge::kControlBytesMax) {
  std::string text{before};
  for (std::size_t i = 0; i < count; ++i) {
    std::string next;
    for (const char c : piece) next += c == '#' ? std::to_string(i) : std::string{c};
    if (text.size() + next.size() + after.size() > connect_bridge::kControlBytesMax) break;
    text += next;
  }
  return text.append(after);
}

inline std::vector<Shape> control_shapes() {
  using connect_bridge::kControlValuesMax;
  const std::string skipped = R"({"type":"demand","channels":[],"number":1,"x":[)";
  const std::string text = R"({"type":"decline","channel":1,"code":"x","reason":")";
  std::string object = "{";
  for (int i = 0; i < 60; ++i) object += "\"x" + std::to_string(i) + "\":[{},0,\"\"],";
  object.back() = '}';
  const std::string origin =
      R"({"origin":1#,"gid":"010f01010101010101010101010101010000000000000000","qos":{}})";
  std::string channel = R"({"channel":1#,"kind":"topic","name":"/a","type":"b/msg/C","origins":[])";
  for (int i = 0; i < 55; ++i) channel += R"(,"newest_onlx":1)";
  constexpr std::size_t kMost = kControlValuesMax - 100;
  return {
      {"unknown members", filled(R"({"type":"demand","channels":[],"number":1)", ",\"#\":0", "}")},
      {"one member again and again", filled("{", R"("type":"demand",)", R"("number":1})")},
      {"empty objects", filled(skipped, "{},", "0]}", kMost)},
      {"empty strings", filled(skipped, "\"\",", "0]}", kMost)},
      {"objects of 60 members", filled(skipped, object + ",", "0]}", kMost / 240)},
      {"channels with unknown members",
       filled(R"({"type":"offer","channels":[)", channel + "},",
              R"({"channel":2,"kind":"other","name":"/a"}]})", 255)},
      {"nested lists", filled(skipped, "[[[[[[]]]]]],", "0]}", kMost / 6)},
      {"small floats", filled(skipped, "1.2345678e-320,", "0]}", kMost)},
      {"long floats", filled(skipped, "1.23456789012345678901e-300,", "0]}", kMost)},
      {"a long number", filled(skipped, "1", "]}")},
      {"a long string", filled(text, "a", "\"}")},
      {"a long escaped string", filled(text, R"(\u20ac)", "\"}")},
      {"spaces", filled(R"({"type":"withdraw","channels":[])", " ", "}")},
      {"lines", filled(R"({"type":"withdraw","channels":[])", "\n", "}")},
      {"channels of a withdraw",
       filled(R"({"type":"withdraw","channels":[1)", ",4294967295", "]}", 4095)},
      {"calls of a forget",
       filled(R"({"type":"forget","channel":1,"calls":[1)", ",4294967295", "]}", 8191)},
      {"patterns", filled(R"({"type":"accepts","rules":[],"deny":[")",
                          "/" + std::string(50, 'a') + "\",\"", "\"]}", 4095)},
      {"rules", filled(R"({"type":"accepts","deny":[],"rules":[{"topics":[],"types":[]})",
                       R"(,{"topics":["/a"],"types":["b"],"services":["/c"],"actions":["/d"]})",
                       "]}", 1000)},
      {"origins",
       filled(R"({"type":"origins","channel":1,"removed":[1)", ",1", "],\"added\":[", 1023) +
           filled("", origin + ",", "", 63) + filled("", origin, "]}", 1)},
  };
}

}  // namespace bench
