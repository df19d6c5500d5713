#include "core/types/type_description.hpp"

#include <gmock/gmock.h>

#include <algorithm>

#include "core/wire/control.hpp"
#include "unit/types/descriptions.hpp"

namespace connect_bridge {
namespace {

using testing::HasSubstr;

std::string problem_of(const std::string& text) {
  const auto read = parse_description(text);
  return read ? "" : read.error().message;
}
std::string problem_of(const TypeDescription& description) {
  return problem_of(canonical_text(description));
}
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

const DescribedField kNumber = field("number", FieldKind::kInt32);

TEST(TypeDescription, TheHashIsThatOfRos) {
  EXPECT_EQ(type_hash_of(kEmptyText), kEmptyHash);
}

TEST(TypeDescription, IsReadAndWrittenAlike) {
  const auto read = parse_description(kEmptyText);
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read.value(),
            description("std_msgs/msg/Empty",
                        {field("structure_needs_at_least_one_member", FieldKind::kUint8)}));
  EXPECT_EQ(canonical_text(read.value()), kEmptyText);

  const TypeDescription many =
      description("a/msg/A",
                  {nested_field("b", "a/msg/B", FieldShape::kSequence),
                   field("c", FieldKind::kDouble, FieldShape::kArray, 36),
                   {"d", FieldKind::kBoundedString, FieldShape::kBoundedSequence, 5, 10}},
                  {{"a/msg/B", {nested_field("c", "a/msg/C")}}, {"a/msg/C", {kNumber}}});
  const auto again = parse_description(canonical_text(many));
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again.value(), many);
  EXPECT_EQ(again.value().find("a/msg/C"), &again.value().nested[1]);
  EXPECT_EQ(again.value().find("a/msg/D"), nullptr);
}

TEST(TypeDescription, OnlyTheCanonicalFormIsRead) {
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {": {", ":  {"},
           {R"("type_id": 3)", R"("type_id": 03)"},
           {R"("type_id": 3)", R"("type_id": 3.0)"},
           {R"("type_id": 3)", R"("type_id": 3, "type_id": 3)"},
           {R"("type_id": 3)", R"("extra": 3, "type_id": 3)"},
           {R"("capacity": 0, "string_capacity": 0)", R"("string_capacity": 0, "capacity": 0)"},
           {"Empty", "\\u0045mpty"},
           {R"("nested_type_name": "")", R"("nested_type_name": null)"}}) {
    EXPECT_NE(problem_of(replaced(kEmptyText, from, to)), "") << to;
  }
  EXPECT_NE(problem_of(kEmptyText + " "), "");
  EXPECT_NE(problem_of(kEmptyText.substr(0, kEmptyText.size() - 1)), "");
  for (const char* text : {"", "null", "7", "[]", "{}", "\"\"", R"({"type_description": 7})"})
    EXPECT_NE(problem_of(text), "") << text;
}

TEST(TypeDescription, NamesKindsAndCapacitiesAreChecked) {
  const auto of_field = [](const DescribedField& one) {
    return problem_of(description("a/msg/A", {one}));
  };
  EXPECT_EQ(of_field(kNumber), "");
  EXPECT_THAT(problem_of(description("a/A", {kNumber})), HasSubstr("name of a type"));
  EXPECT_THAT(problem_of(description("a/msg/A\n", {kNumber})), HasSubstr("name of a type"));
  EXPECT_THAT(problem_of(description("a/msg/" + std::string(kNameBytesMax, 'A'), {kNumber})),
              HasSubstr("name of a type"));
  EXPECT_THAT(of_field(field("a b", FieldKind::kInt32)), HasSubstr("name of a field"));
  EXPECT_THAT(of_field(field("n", FieldKind::kInt32, FieldShape::kArray)), HasSubstr("capacity"));
  EXPECT_THAT(of_field(field("n", FieldKind::kInt32, FieldShape::kSequence, 5)),
              HasSubstr("capacity"));
  EXPECT_THAT(of_field(field("s", FieldKind::kBoundedString)), HasSubstr("capacity"));
  EXPECT_THAT(of_field({"n", FieldKind::kInt32, FieldShape::kSingle, 0, 0, "a/msg/B"}),
              HasSubstr("nested"));
  EXPECT_THAT(of_field(nested_field("n", "")), HasSubstr("nested"));
  EXPECT_THAT(problem_of(description("a/msg/A", {})), HasSubstr("no fields"));
  for (const int id : {0, 23, 47, 48, 48 + 23, 3 * 48, 4 * 48 + 3, 300})
    EXPECT_THAT(problem_of(replaced(kEmptyText, ": 3", ": " + std::to_string(id))),
                HasSubstr("not known"))
        << id;
}

TEST(TypeDescription, NestedTypesMustBeThereAndEnd) {
  const auto of = [](std::vector<DescribedType> nested) {
    return problem_of(description("a/msg/A", {nested_field("b", "a/msg/B")}, std::move(nested)));
  };
  EXPECT_EQ(of({{"a/msg/B", {kNumber}}}), "");
  EXPECT_THAT(of({}), HasSubstr("missing"));
  EXPECT_THAT(of({{"a/msg/B", {kNumber}}, {"a/msg/C", {kNumber}}}), HasSubstr("not used"));
  EXPECT_THAT(of({{"a/msg/B", {nested_field("b", "a/msg/B")}}}), HasSubstr("itself"));
  EXPECT_THAT(of({{"a/msg/B", {nested_field("a", "a/msg/A")}}}), HasSubstr("missing"));
  EXPECT_THAT(of({{"a/msg/A", {kNumber}}, {"a/msg/B", {nested_field("a", "a/msg/A")}}}),
              HasSubstr("twice"));
  EXPECT_THAT(of({{"a/msg/C", {kNumber}}, {"a/msg/B", {nested_field("c", "a/msg/C")}}}),
              HasSubstr("order"));
  EXPECT_THAT(of({{"a/msg/B", {nested_field("c", "a/msg/C")}},
                  {"a/msg/C", {nested_field("b", "a/msg/B")}}}),
              HasSubstr("itself"));
}

// Each type twice in the one above it: what would be expanded has 2^depth parts.
TypeDescription chain(std::size_t depth) {
  const auto name = [](std::size_t i) { return "a/msg/T" + std::to_string(1000 + i); };
  TypeDescription made = description("a/msg/A", {nested_field("t", name(0))});
  for (std::size_t i = 0; i + 1 < depth; ++i)
    made.nested.push_back(
        {name(i), {nested_field("l", name(i + 1)), nested_field("r", name(i + 1))}});
  made.nested.push_back({name(depth - 1), {kNumber}});
  return made;
}

TEST(TypeDescription, TheLimitsHold) {
  EXPECT_EQ(problem_of(chain(kDescribedDepthMax)), "");
  EXPECT_THAT(problem_of(chain(kDescribedDepthMax + 1)), HasSubstr("too deeply"));

  TypeDescription wide = description("a/msg/A", {});
  for (std::size_t i = 0; i < kDescribedTypesMax; ++i) {
    const std::string name = "a/msg/T" + std::to_string(1000 + i);
    wide.type.fields.push_back(nested_field("f", name));
    wide.nested.push_back({name, {field("f", FieldKind::kInt8)}});
  }
  EXPECT_EQ(problem_of(wide), "");
  wide.type.fields.push_back(nested_field("f", "a/msg/U"));
  wide.nested.push_back({"a/msg/U", {field("f", FieldKind::kInt8)}});
  EXPECT_THAT(problem_of(wide), HasSubstr("too many types"));

  TypeDescription longest = description("a/msg/A", {});
  while (canonical_text(longest).size() <= kDescriptionBytesMax)
    longest.type.fields.resize(longest.type.fields.size() + 100, kNumber);
  EXPECT_THAT(problem_of(longest), HasSubstr("too long"));
}

TEST(TypeDescription, FieldsAreShownAsInMessageFiles) {
  EXPECT_EQ(shown(kNumber), "int32");
  EXPECT_EQ(shown(field("f", FieldKind::kDouble, FieldShape::kArray, 36)), "float64[36]");
  EXPECT_EQ(shown(field("f", FieldKind::kBoolean, FieldShape::kSequence)), "bool[]");
  EXPECT_EQ(shown({"f", FieldKind::kBoundedString, FieldShape::kBoundedSequence, 5, 10}),
            "string<=10[<=5]");
  EXPECT_EQ(shown(nested_field("f", "a/msg/B", FieldShape::kSequence)), "a/msg/B[]");
}

}  // namespace
}  // namespace connect_bridge
