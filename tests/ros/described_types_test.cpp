// Types that are known by their descriptions: as good as installed ones for the check of samples.
#include <gmock/gmock.h>

#include <chrono>
#include <iostream>
#include <random>

#include "core/types/type_description.hpp"
#include "ros/gateway.hpp"
#include "ros/rcl/distro.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/service_fixture.hpp"
#include "ros/types/cdr_check.hpp"
#include "ros/types/described_fields.hpp"
#include "ros/types/installed_description.hpp"

namespace connect_bridge::ros {
namespace {

#if CONNECT_TYPE_HASHES

const std::string kPackage = kTestPackage;

class DescribedTypesTest : public RosTest {
 protected:
  void SetUp() override {
    if (!middleware().takes_bare_types) GTEST_SKIP() << "not with this middleware";
  }
  // Whether a sample of the mirror could be published.
  static bool publishes(TestSide& side, const Bytes& sample) {
    const auto before = side.gateway.counters().published;
    side.gateway.apply(Publish{MirrorId{1}, Payload::adopt(Bytes(sample))});
    return side.gateway.counters().published > before;
  }
};

const MessageType& installed(const std::string& type) {
  static TypeSupports types;
  static std::map<std::string, MessageType> kept;
  return kept[type] = std::get<0>(types.message(type, ""));
}

std::unique_ptr<DescribedFields> described(const std::string& type) {
  return DescribedFields::make(parse_description(description_of(*installed(type).handle)).value());
}

// std::uint8_t[] and a text.
std::string thing_text() {
  return canonical_text(
      {{kMadeUp,
        {{"data", FieldKind::kUint8, FieldShape::kSequence}, {"name", FieldKind::kString}}},
       {}});
}

TEST(DescribedTypes, TheTextHasTheHashOfTheInstalledType) {
  for (const std::string& type :
       {kPackage + "/msg/Everything", kPackage + "/msg/Tree", kPackage + "/msg/Nothing",
        kPackage + "/action/Fibonacci_FeedbackMessage", std::string{"rcl_interfaces/msg/Log"},
        std::string{"sensor_msgs/msg/PointCloud2"},
        std::string{"action_msgs/msg/GoalStatusArray"}}) {
    const std::string text = description_of(*installed(type).handle);
    EXPECT_EQ(type_hash_of(text), distro::type_hash_of(*installed(type).handle)) << type;
    EXPECT_TRUE(parse_description(text).ok()) << type;
    EXPECT_TRUE(described(type)) << type;
  }
}

TEST(DescribedTypes, AreCheckedLikeInstalledOnes) {
  std::mt19937 random(7);
  int right = 0, wrong = 0;
  for (const char* name :
       {"/msg/Everything", "/msg/Tree", "/msg/Branch", "/msg/Leaf", "/msg/Blob"}) {
    const auto& type = installed(kPackage + name);
    const auto fields = described(kPackage + name);
    for (int i = 0; i < 4000; ++i) {
      Bytes bytes(4 + random() % 800);
      bytes[1] = random() % 2;
      // Mostly zeros are mostly right: nothing is in the sequences.
      for (unsigned n = random() % 6; n > 0 && bytes.size() > 4; --n)
        bytes[4 + random() % (bytes.size() - 4)] = static_cast<std::uint8_t>(random() % 4);
      const auto expected = check_cdr(bytes, *type.introspection, sample_limits(bytes.size()));
      const auto found = check_cdr(bytes, fields->introspection(), sample_limits(bytes.size()));
      ASSERT_EQ(expected.has_value(), found.has_value()) << name << " " << i;
      ++(found ? wrong : right);
    }
  }
  EXPECT_GT(right, 1000);
  EXPECT_GT(wrong, 1000);
}

TEST(DescribedTypes, WhatNobodyKnowsHowToReadIsNotChecked) {
  for (const FieldKind kind : {FieldKind::kWchar, FieldKind::kLongDouble})
    EXPECT_FALSE(DescribedFields::make({{kMadeUp, {{"f", kind}}}, {}}));
}

// Arrays of arrays of arrays: what one would take is no number of 64 bits.
TEST(DescribedTypes, HugeArraysAreNoTrouble) {
  constexpr std::uint32_t kMany = 0xFFFFFFFF;
  TypeDescription huge{
      {kMadeUp, {{"f", FieldKind::kNested, FieldShape::kSequence, 0, 0, "a/msg/A"}}}, {}};
  huge.nested.push_back(
      {"a/msg/A", {{"f", FieldKind::kNested, FieldShape::kArray, kMany, 0, "a/msg/B"}}});
  huge.nested.push_back(
      {"a/msg/B", {{"f", FieldKind::kNested, FieldShape::kArray, kMany, 0, "a/msg/C"}}});
  huge.nested.push_back({"a/msg/C", {{"f", FieldKind::kDouble, FieldShape::kArray, kMany}}});
  const auto fields = DescribedFields::make(huge);
  ASSERT_TRUE(fields);
  Bytes bytes(100'000);
  bytes[1] = 1;
  bytes[4] = 3;
  EXPECT_NE(std::nullopt, check_cdr(bytes, fields->introspection(), sample_limits(bytes.size())));
}

// A peer chooses the fields and the bytes: what the check costs is in proportion to these.
TEST(DescribedTypes, MessagesInMessagesForEveryByteAreRefused) {
  TypeDescription deep{
      {kMadeUp, {{"f", FieldKind::kNested, FieldShape::kSequence, 0, 0, "a/msg/A0"}}}, {}};
  for (int depth = 0; depth < 30; ++depth)
    deep.nested.push_back({"a/msg/A" + std::to_string(depth),
                           {{"f", FieldKind::kNested, FieldShape::kSingle, 0, 0,
                             "a/msg/A" + std::to_string(depth + 1)}}});
  deep.nested.push_back({"a/msg/A30", {{"f", FieldKind::kUint8}}});
  std::sort(deep.nested.begin(), deep.nested.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  const auto fields = DescribedFields::make(deep);
  ASSERT_TRUE(fields);
  const Bytes bytes = Cdr{}.u32(250'000).zeros(250'000).bytes();
  const auto problem = check_cdr(bytes, fields->introspection(), described_limits(bytes.size()));
  ASSERT_TRUE(problem);
  EXPECT_THAT(*problem, testing::StartsWith("more messages within it than allowed"));
  EXPECT_LT(problem->size(), 1000U);
  EXPECT_EQ(check_cdr(bytes, fields->introspection(), sample_limits(bytes.size())), std::nullopt);
}

// The fields of a hash go with its last user, not with the last one of the name.
TEST_F(DescribedTypesTest, FieldsAreFreedWithTheLastUserOfTheirHash) {
  TypeSupports types(true);
  const std::string text = thing_text(), hash = type_hash_of(text);
  const auto other = types.message(kMadeUp, "RIHS01_" + std::string(64, 'a'));
  {
    const auto first = types.message(kMadeUp, hash);
    types.describe(kMadeUp, hash, text);
    EXPECT_EQ(types.described(), 1U);
    EXPECT_NE(std::get<0>(first).fields(), nullptr);
    // A node that comes later knows them, too.
    EXPECT_NE(std::get<0>(types.message(kMadeUp, hash)).fields(), nullptr);
  }
  EXPECT_EQ(types.made(), 1U);
  EXPECT_EQ(types.described(), 0U);
  EXPECT_EQ(std::get<0>(types.message(kMadeUp, hash)).fields(), nullptr);
}

TEST_F(DescribedTypesTest, SamplesAreCheckedFromThenOn) {
  const std::string text = thing_text();
  TestSide side("connect_client");
  side.gateway.apply(
      CreateMirror{MirrorId{1}, topic("thing"), kMadeUp, type_hash_of(text), qos_of_depth(10)});
  const auto differs = side.next<TypeDiffers>();
  ASSERT_TRUE(differs);
  EXPECT_EQ(differs->id, MirrorId{1});
  EXPECT_EQ(differs->hash_here, "");
  const Bytes right = Cdr{}.u32(2000).zeros(2000).text("a name").bytes();
  const Bytes wrong = Cdr{}.u32(3000).zeros(2000).bytes();
  EXPECT_TRUE(publishes(side, wrong));                                     // nobody knows
  side.gateway.apply(DescribeType{kMadeUp, type_hash_of("other"), text});  // of nobody
  EXPECT_TRUE(publishes(side, wrong));
  side.gateway.apply(DescribeType{kMadeUp, type_hash_of(text), text});
  EXPECT_FALSE(publishes(side, wrong));
  EXPECT_EQ(side.next<PublishFailed>()->count, 1U);
  EXPECT_TRUE(publishes(side, right));
}

// A service whose answer has a sequence: few bytes that claim to be a long one reach no caller.
TEST_F(DescribedTypesTest, AnswersAreCheckedFromThenOn) {
  if (!middleware().takes_bare_services) GTEST_SKIP() << "not with this middleware";
  const std::string type = "made_up/srv/Do";
  TypeDescription service{
      {type,
       {{"request_message", FieldKind::kNested, FieldShape::kSingle, 0, 0, type + "_Request"},
        {"response_message", FieldKind::kNested, FieldShape::kSingle, 0, 0, type + "_Response"}}},
      {{type + "_Request", {{"number", FieldKind::kInt64}}},
       {type + "_Response", {{"x", FieldKind::kDouble, FieldShape::kSequence}}}}};
  const std::string text = canonical_text(service), hash = type_hash_of(text);
  TestSide side("connect_client");
  side.gateway.apply(CreateServiceMirror{ServiceMirrorId{1}, topic("do"), type, hash});
  const auto differs = side.next<ServiceTypeDiffers>();
  ASSERT_TRUE(differs);
  EXPECT_EQ(differs->hash_here, "");
  TypeSupports types(true);
  const auto made = std::get<0>(types.service(type, hash));
  const auto other = std::get<0>(types.service(type, "RIHS01_" + std::string(64, 'a')));
  const Bytes huge = Cdr{}.u32(0x7FFFFFFF).bytes(), right = Cdr{}.u32(1).u32(0).u64(5).bytes();
  EXPECT_EQ(made->response->read_from(huge, 1000), std::nullopt);  // nobody knows
  types.describe(type, hash, text);
  EXPECT_EQ(types.described(), 2U);
  EXPECT_THAT(made->response->read_from(huge, 1000).value_or(""),
              testing::StartsWith("not a made_up/srv/Do_Response: the bytes end too early"));
  EXPECT_EQ(made->response->read_from(right, 1000), std::nullopt);
  EXPECT_NE(made->request->read_from(Cdr{}.u32(1).bytes(), 1000), std::nullopt);
  EXPECT_EQ(other->response->read_from(huge, 1000), std::nullopt);
  // A node that comes later knows it, too; with the last one it is forgotten.
  EXPECT_NE(std::get<0>(types.service(type, hash))->response->read_from(huge, 1000), std::nullopt);
}

TEST_F(DescribedTypesTest, AnInstalledServiceIsLookedUpByItsHash) {
  TestSide side("connect_client");
  for (const std::string& type :
       {kPackage + "/srv/Echo", kPackage + "/action/Fibonacci_SendGoal"}) {
    const std::string hash = std::get<0>(TypeSupports().service(type, ""))->hash;
    side.gateway.apply(LookUpType{LookupId{1}, type, hash});
    const std::string text = side.next<TypeLookedUp>()->text;
    EXPECT_EQ(type_hash_of(text), hash);
    const auto description = parse_description(text);
    ASSERT_TRUE(description.ok()) << type;
    const auto fields = DescribedFields::make(description.value());
    ASSERT_TRUE(fields);
    EXPECT_NE(fields->introspection(type + "_Request"), nullptr);
    EXPECT_NE(fields->introspection(type + "_Response"), nullptr);
    EXPECT_EQ(fields->introspection("made_up/msg/Thing"), nullptr);
    side.gateway.apply(LookUpType{LookupId{2}, type, type_hash_of("other")});
    EXPECT_EQ(side.next<TypeLookedUp>()->text, "");
  }
}

TEST_F(DescribedTypesTest, AnotherDefinitionOfAServiceIsToldToo) {
  const std::string other = "RIHS01_" + std::string(64, 'a');
  TestSide side("connect_client");
  CreateServiceMirror create{ServiceMirrorId{1}, topic("echo"), kPackage + "/srv/Echo", other};
  side.gateway.apply(create);
  const auto failed = side.next<ServiceMirrorFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ(failed->code, "type_mismatch");
  EXPECT_EQ(failed->hash_here, std::get<0>(TypeSupports().service(create.type, ""))->hash);
  create.id = ServiceMirrorId{2};
  create.any_definition = true;
  side.gateway.apply(create);
  EXPECT_EQ(side.next<ServiceTypeDiffers>()->hash_here, failed->hash_here);
}

TEST_F(DescribedTypesTest, InstalledTypesAreLookedUpByTheirHash) {
  TestSide side("connect_client");
  const std::string text = description_of(*installed(kPackage + "/msg/Tree").handle);
  side.gateway.apply(LookUpType{LookupId{1}, kPackage + "/msg/Tree", type_hash_of(text)});
  EXPECT_EQ(side.next<TypeLookedUp>()->text, text);
  side.gateway.apply(LookUpType{LookupId{2}, kPackage + "/msg/Tree", type_hash_of("other")});
  EXPECT_EQ(side.next<TypeLookedUp>()->text, "");
  side.gateway.apply(LookUpType{LookupId{3}, kMadeUp, type_hash_of(text)});
  EXPECT_EQ(side.next<TypeLookedUp>()->text, "");
}

TEST_F(DescribedTypesTest, AnotherDefinitionIsUsedWhereThatIsAllowed) {
  const std::string other = "RIHS01_" + std::string(64, 'a');
  const std::string type = kPackage + "/msg/Blob";
  TestSide side("connect_client");
  CreateMirror create{MirrorId{1}, topic("blob"), type, other, qos_of_depth(10)};
  side.gateway.apply(create);
  const auto failed = side.next<MirrorFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ(failed->code, "type_mismatch");
  EXPECT_EQ(failed->hash_here, distro::type_hash_of(*installed(type).handle));
  create.any_definition = true;
  side.gateway.apply(create);
  EXPECT_EQ(side.next<TypeDiffers>()->hash_here, failed->hash_here);
  EXPECT_TRUE(publishes(side, Cdr{}.u64(1).u64(2).u32(3).zeros(3).bytes()));
  // Small ones are checked too: who sends them has another definition.
  EXPECT_FALSE(publishes(side, Cdr{}.u64(1).u64(2).u32(30).zeros(3).bytes()));
}

TEST_F(DescribedTypesTest, AThousandAreFreedWithTheirLastUsers) {
  constexpr std::uint32_t kTypes = 1000;
  TestSide side("connect_client");
  std::vector<std::size_t> memory;
  for (int round = 0; round < 4; ++round) {
    for (std::uint32_t i = 1; i <= kTypes; ++i) {
      const std::string type = "made_up/msg/Thing" + std::to_string(i);
      TypeDescription thing{{type, {}}, {}};
      for (int f = 0; f < 50; ++f)
        thing.type.fields.push_back({"field" + std::to_string(f), FieldKind::kDouble});
      const std::string text = canonical_text(thing);
      side.gateway.apply(CreateMirror{MirrorId{i}, topic("t" + std::to_string(i)), type,
                                      type_hash_of(text), qos_of_depth(1)});
      side.gateway.apply(DescribeType{type, type_hash_of(text), text});
    }
    EXPECT_EQ(side.gateway.counters().types_not_installed, kTypes);
    for (std::uint32_t i = 1; i <= kTypes; ++i) side.gateway.apply(DestroyMirror{MirrorId{i}});
    EXPECT_TRUE(side.until([&] { return side.gateway.counters().types_not_installed == 0; }));
    side.drain_for(200ms);
    memory.push_back(resident_kilobytes());
  }
  // All descriptions of a round have 15 MB and more. rmw_zenoh_cpp 0.6.7 keeps 4 kB of each
  // publisher.
  const std::size_t kept = middleware().joins_by_hash ? 2 * 6 * kTypes : 0;
  EXPECT_LT(memory[3], memory[1] + 8192 + kept) << testing::PrintToString(memory);
}

TEST(DescribedTypes, ASampleCostsTheSame) {
  const auto milliseconds = [](const rosidl_message_type_support_t& type, const Bytes& bytes) {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(check_cdr(bytes, type, sample_limits(bytes.size())), std::nullopt);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
    return took.count();
  };
  const std::string type = "rcl_interfaces/msg/ListParametersResult";
  const auto fields = described(type);
  const Bytes bytes = Cdr{}.u32(999'990).zeros(4 * 999'990).u32(0).bytes();
  std::cout << "1,000,000 strings: installed "
            << milliseconds(*installed(type).introspection, bytes) << " ms, described "
            << milliseconds(fields->introspection(), bytes) << " ms\n";
}

#endif

}  // namespace
}  // namespace connect_bridge::ros
