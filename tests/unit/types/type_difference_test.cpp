#include "core/types/type_difference.hpp"

#include <gmock/gmock.h>

#include "unit/types/descriptions.hpp"

namespace connect_bridge {
namespace {

const DescribedField kId = field("id", FieldKind::kInt32);
const DescribedField kName = field("name", FieldKind::kString);

TEST(TypeDifference, AHashIsShortened) {
  EXPECT_EQ(shortened_hash("RIHS01_93da1a4b" + std::string(56, '0')), "RIHS01_93da1a4b...");
  EXPECT_EQ(shortened_hash("RIHS01_93da1a4b"), "RIHS01_93da1a4b");
  EXPECT_EQ(shortened_hash(""), "");
}

TEST(TypeDifference, AFieldMore) {
  const auto small = description("a/msg/A", {kId, kName});
  const auto large = description(
      "a/msg/A", {kId, field("covariance", FieldKind::kDouble, FieldShape::kArray, 36), kName});
  EXPECT_EQ(difference(small, large),
            "the field 'covariance' (float64[36]) is only in the peer's definition");
  EXPECT_EQ(difference(large, small),
            "the field 'covariance' (float64[36]) is only in the definition here");
}

TEST(TypeDifference, AnotherTypeAndAnotherOrder) {
  const auto here = description("a/msg/A", {kId, kName});
  EXPECT_EQ(difference(here, description("a/msg/A", {field("id", FieldKind::kInt64), kName})),
            "'id' is int32 here and int64 there");
  EXPECT_EQ(difference(here, description("a/msg/A", {kName, kId})), "fields are in another order");
  EXPECT_EQ(difference(here, here), "none that a description shows");
}

TEST(TypeDifference, NestedTypes) {
  const auto field_of = nested_field("pose", "g/msg/Pose");
  const auto here = description("a/msg/A", {field_of}, {{"g/msg/Pose", {kId, kName}}});
  const auto there = description("a/msg/A", {field_of}, {{"g/msg/Pose", {kName, kId}}});
  EXPECT_EQ(difference(here, there), "g/msg/Pose: fields are in another order");
  // A type that only one side has is named by its field.
  const auto more = description("a/msg/A", {field_of, nested_field("b", "a/msg/B")},
                                {{"a/msg/B", {kId}}, {"g/msg/Pose", {kId, kName}}});
  EXPECT_EQ(difference(here, more), "the field 'b' (a/msg/B) is only in the peer's definition");
}

TEST(TypeDifference, IsBounded) {
  TypeDescription here = description("a/msg/A", {kId});
  TypeDescription there = here;
  for (int i = 0; i < 1000; ++i)
    there.type.fields.push_back(
        field(std::string(250, 'x') + std::to_string(i), FieldKind::kInt32));
  const std::string text = difference(here, there);
  EXPECT_LE(text.size(), kDifferenceBytesMax);
  EXPECT_THAT(text, testing::EndsWith("more differences"));
  EXPECT_THAT(text, testing::HasSubstr("xxx...'"));
}

}  // namespace
}  // namespace connect_bridge
