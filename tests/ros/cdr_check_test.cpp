#include "ros/types/cdr_check.hpp"

#include <rosidl_typesupport_introspection_c/field_types.h>
#include <rosidl_typesupport_introspection_c/identifier.h>
#include <rosidl_typesupport_introspection_c/message_introspection.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <random>

#include "ros/service_fixture.hpp"

namespace connect_bridge::ros {
namespace {

constexpr std::size_t kMemoryMax = 1U << 20;

const rosidl_message_type_support_t& introspection(const std::string& type) {
  static TypeSupports types;
  return *std::get<0>(types.message(type, "")).introspection;
}

std::optional<std::string> check(const std::string& type, const Bytes& bytes,
                                 std::size_t memory_max = kMemoryMax) {
  return check_cdr(bytes, introspection(std::string{kTestPackage} + type), call_limits(memory_max));
}

Bytes leaf() {
  return Cdr{}.u8(1).text("ab").u64(0).u64(0).u64(0).u32(1).u32(2).bytes();
}

TEST(CdrCheck, TakesWhatIsRight) {
  EXPECT_EQ(std::nullopt, check("/msg/Leaf", leaf()));
  EXPECT_EQ(std::nullopt, check("/msg/Nothing", {0, 1, 0, 0, 0}));
  EXPECT_EQ(std::nullopt, check("/msg/Nothing", {0, 0, 0, 0, 0, 0, 0, 0}));  // longer, big endian
  EXPECT_EQ(std::nullopt, check("/srv/Upload_Request", Cdr{}.u32(5).zeros(5).bytes()));
  EXPECT_EQ(std::nullopt, check("/srv/Upload_Request", {0, 0, 0, 0, 0, 0, 0, 1, 9}));
}

// Only types from IDL have one. CDR 1 aligns it to 8.
TEST(CdrCheck, ALongDoubleHasSixteenBytes) {
  rosidl_typesupport_introspection_c__MessageMember fields[2]{};
  fields[0].name_ = "flag";
  fields[0].type_id_ = rosidl_typesupport_introspection_c__ROS_TYPE_UINT8;
  fields[1].name_ = "value";
  fields[1].type_id_ = rosidl_typesupport_introspection_c__ROS_TYPE_LONG_DOUBLE;
  rosidl_typesupport_introspection_c__MessageMembers members{};
  members.message_name_ = "Precise";
  members.member_count_ = 2;
  members.members_ = fields;
  rosidl_message_type_support_t type{};
  type.data = &members;
  const Bytes whole = Cdr{}.u8(1).zeros(7).zeros(16).bytes();
  EXPECT_EQ(std::nullopt, check_cdr(whole, type, {}));
  EXPECT_NE(std::nullopt, check_cdr(Bytes(whole.begin(), whole.end() - 1), type, {}));
#if defined(__x86_64__)
  Bytes dirty(whole.size(), 0xff);
  std::copy_n(whole.begin(), kCdrHeaderSize, dirty.begin());
  std::string problem;
  EXPECT_TRUE(clear_padding(dirty, type, problem)) << problem;
  EXPECT_EQ(std::count(dirty.begin() + kCdrHeaderSize, dirty.end(), 0xff), 1 + 10);
#endif
}

TEST(CdrCheck, KeysAreSeen) {
  EXPECT_FALSE(has_keys(introspection(std::string{kTestPackage} + "/msg/Leaf")));
  rosidl_typesupport_introspection_c__MessageMembers members{};
  const auto set = [](auto& of) {
    if constexpr (requires { of.has_any_key_member_; }) return of.has_any_key_member_ = true;
    return false;  // the distribution does not tell
  };
  const bool keyed = set(members);
  rosidl_message_type_support_t type{};
  type.data = &members;
  EXPECT_EQ(has_keys(type), keyed);
}

TEST(CdrCheck, EveryMissingByteIsMissed) {
  const Bytes whole = leaf();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_NE(std::nullopt, check("/msg/Leaf", Bytes(whole.begin(), whole.begin() + size))) << size;
  }
}

TEST(CdrCheck, RefusesOtherEncapsulations) {
  for (const std::uint8_t kind : {2, 3, 6, 7, 8, 9, 10, 255}) {
    Bytes bytes = leaf();
    bytes[1] = kind;
    EXPECT_NE(std::nullopt, check("/msg/Leaf", bytes)) << int{kind};
  }
  Bytes bytes = leaf();
  bytes[0] = 1;
  EXPECT_NE(std::nullopt, check("/msg/Leaf", bytes));
}

TEST(CdrCheck, LengthsAreCoveredByBytes) {
  for (const std::uint32_t count : {6U, 0x7fffffffU, 0x80000000U, 0xffffffffU}) {
    EXPECT_NE(std::nullopt, check("/srv/Upload_Request", Cdr{}.u32(count).zeros(5).bytes()));
    // Branch: a name, a leaf, leaves ...
    EXPECT_NE(std::nullopt, check("/msg/Branch", Cdr{}.u32(count).zeros(5).bytes()));
  }
}

TEST(CdrCheck, NamesTheField) {
  const auto problem = check("/srv/Upload_Request", Cdr{}.u32(9).bytes());
  ASSERT_TRUE(problem);
  EXPECT_NE(std::string::npos, problem->find("Upload_Request.data")) << *problem;
}

// rcl_interfaces has no bounded field, so the tests' own package has them all.
TEST(CdrCheck, BoundsHold) {
  const auto everything = [](std::uint32_t few, std::size_t short_text, std::size_t wide) {
    Cdr cdr;
    for (int i = 0; i < 5; ++i) cdr.u8(0);          // flag .. uint8_value
    cdr.zeros(1).zeros(2).zeros(2).zeros(2);        // int16, uint16 (aligned to 4)
    cdr.u32(0).u32(0).u64(0).u64(0).u32(0).u64(0);  // int32 .. float64
    cdr.text("any").text(std::string(short_text, 'x'));
    cdr.wide(u"any").wide(std::u16string(wide, u'x'));
    cdr.u8(0).u8(1).u8(0);                          // flags
    cdr.u32(0);                                     // numbers
    cdr.u32(few).zeros(2 * few);                    // few_numbers
    cdr.u32(0).u32(0).u32(0).u32(0).u32(0).u32(0);  // doubles .. wide_texts
    cdr.u8(0).text("").u64(0).u64(0).u64(0).u32(0).u32(0).u32(0);
    return cdr.zeros(64).bytes();
  };
  EXPECT_EQ(std::nullopt, check("/msg/Everything", everything(5, 16, 8)));
  EXPECT_NE(std::nullopt, check("/msg/Everything", everything(6, 16, 8)));
  EXPECT_NE(std::nullopt, check("/msg/Everything", everything(5, 17, 8)));
  EXPECT_NE(std::nullopt, check("/msg/Everything", everything(5, 16, 9)));
}

TEST(CdrCheck, MemoryIsBounded) {
  Cdr cdr;
  cdr.u32(100000);  // empty strings take 24 bytes of memory each, and 4 here
  for (int i = 0; i < 100000; ++i) cdr.u32(0);
  const std::string type = "rcl_interfaces/srv/GetParameters_Request";
  EXPECT_NE(std::nullopt, check_cdr(cdr.bytes(), introspection(type), call_limits(1000000)));
  EXPECT_EQ(std::nullopt, check_cdr(cdr.bytes(), introspection(type), call_limits(10000000)));
}

// A sequence of this many strings, empty ones but for the last.
Bytes texts(std::uint32_t count, std::uint32_t last_size = 1) {
  Cdr cdr;
  cdr.u32(count);
  for (std::uint32_t i = 1; i < count; ++i) cdr.u32(0);
  return cdr.u32(last_size).zeros(last_size).bytes();
}

// Millions of empty strings compress to almost nothing and take little memory, but half a second to
// read.
TEST(CdrCheck, StringsAndSequencesAreBounded) {
  const std::string strings = "rcl_interfaces/srv/GetParameters_Request";
  constexpr std::size_t kRoomy = std::size_t{256} << 20;
  const auto problem = [&](const std::string& type, const Bytes& bytes) {
    return check_cdr(bytes, introspection(type), call_limits(kRoomy)).value_or("");
  };
  EXPECT_EQ("", problem(strings, texts(10000)));
  EXPECT_EQ("", problem(strings, texts(kBlocksMax - 1)));  // the sequence is the one missing
  EXPECT_NE("", problem(strings, texts(kBlocksMax)));
  const std::string refusal = problem(strings, texts(6'500'000));
  EXPECT_NE(std::string::npos, refusal.find("more strings and sequences")) << refusal;
  EXPECT_NE(std::string::npos, refusal.find("GetParameters_Request.names")) << refusal;

  // Empty sequences take no memory, but time: a list of them (ranges) in a laser's message.
  const auto ranges = [](std::uint32_t count) {
    return Cdr{}.u64(0).u32(0).zeros(7 * 4).u32(count).zeros(4 * count).u32(0).bytes();
  };
  const std::string lists = "sensor_msgs/msg/MultiEchoLaserScan";
  EXPECT_EQ("", problem(lists, ranges(kBlocksMax - 3)));  // a string, two sequences
  EXPECT_NE("", problem(lists, ranges(kBlocksMax - 2)));
}

TEST(CdrCheck, MessagesWithinAreBounded) {
  const auto points = [](std::uint32_t count) {
    return check_cdr(Cdr{}.u32(count).zeros(12 * count).bytes(),
                     introspection("geometry_msgs/msg/Polygon"),
                     call_limits(std::size_t{256} << 20));
  };
  EXPECT_EQ(std::nullopt, points(kNestedMax));
  const auto problem = points(kNestedMax + 1);
  ASSERT_TRUE(problem);
  EXPECT_NE(std::string::npos, problem->find("more messages within it")) << *problem;
}

// How long checking a peer's sample takes before it is published: almost nothing for an image, and
// for the worst allowed one a time that the loop can afford. Our own samples are not checked.
TEST(CdrCheck, ATopicsSampleCostsLittle) {
  const auto milliseconds = [](const std::string& type, const Bytes& bytes) {
    const auto begin = std::chrono::steady_clock::now();
    const auto problem = check_cdr(bytes, introspection(type), sample_limits(bytes.size()));
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
    EXPECT_EQ(problem, std::nullopt);
    return took.count();
  };
  // rcl_interfaces/msg/ListParametersResult: names and prefixes, two lists of strings.
  const double strings = milliseconds("rcl_interfaces/msg/ListParametersResult",
                                      Cdr{}.u32(999'990).zeros(4 * 999'990).u32(0).bytes());
  const double image = milliseconds(std::string{kTestPackage} + "/srv/Upload_Request",
                                    Cdr{}.u32(8U << 20U).zeros(8U << 20U).bytes());
  const double points =
      milliseconds("geometry_msgs/msg/Polygon", Cdr{}.u32(5'000'000).zeros(12 * 5'000'000).bytes());
  std::cout << "5,000,000 points: " << points << " ms, 1,000,000 strings: " << strings
            << " ms, 8 MiB of bytes: " << image << " ms\n";
  EXPECT_LT(image, points / 5);  // bytes are one block, whatever their number
  Bytes many = Cdr{}.u32(1'000'010).zeros(4 * 1'000'010).u32(0).bytes();
  EXPECT_NE(check_cdr(many, introspection("rcl_interfaces/msg/ListParametersResult"),
                      sample_limits(many.size())),
            std::nullopt);
}

TEST(CdrCheck, LargeMessagesOfOursHaveTheirPaddingCleared) {
  Bytes bytes = texts(kBlocksMax + 1);
  const auto size = bytes.size();
  std::string problem;
  EXPECT_EQ(size, clear_padding(bytes, introspection("rcl_interfaces/srv/GetParameters_Request"),
                                problem));
  EXPECT_EQ("", problem);
}

TEST(CdrCheck, LargeBytesAreOneBlock) {
  const std::uint32_t size = 60U << 20;
  EXPECT_EQ(std::nullopt,
            check("/srv/Upload_Request", Cdr{}.u32(size).zeros(size).bytes(), 64U << 20));
}

TEST(CdrCheck, ClearsPadding) {
  const Bytes bytes = leaf();
  Bytes dirty = bytes;
  for (const std::size_t place : {5, 6, 7, 15}) dirty[place] = 0x77;
  ASSERT_NE(bytes, dirty);
  dirty.resize(dirty.size() + 9, 0x77);  // reserved and not written
  const auto& type = introspection(std::string{kTestPackage} + "/msg/Leaf");
  std::string problem;
  EXPECT_EQ(bytes.size(), clear_padding(dirty, type, problem));
  dirty.resize(bytes.size());
  EXPECT_EQ(bytes, dirty);
  EXPECT_EQ("", problem);
  EXPECT_EQ(std::nullopt, clear_padding({}, type, problem));
  EXPECT_NE("", problem);
}

// The middleware can read everything that passes without harm.
TEST(CdrCheck, RandomBytesDoNoHarm) {
  TypeSupports types;
  std::mt19937 random(4711);
  int passed = 0, read = 0;
  for (const char* name :
       {"/srv/Echo", "/srv/Upload", "/action/Fibonacci_SendGoal", "/action/Fibonacci_GetResult"}) {
    ServiceType& type = *std::get<0>(types.service(std::string{kTestPackage} + name, ""));
    for (auto* form : {type.request.get(), type.response.get()}) {
      rmw_serialized_message_t message = rmw_get_zero_initialized_serialized_message();
      auto allocator = rcl_get_default_allocator();
      ASSERT_EQ(RMW_RET_OK, rmw_serialized_message_init(&message, 0, &allocator));
      ASSERT_EQ(std::nullopt, form->write_to(message));
      const Bytes whole(message.buffer, message.buffer + message.buffer_length);
      ASSERT_EQ(RMW_RET_OK, rmw_serialized_message_fini(&message));
      for (int i = 0; i < 3000; ++i) {
        Bytes bytes = whole;
        for (auto n = random() % 4; n > 0; --n) {
          bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
        }
        bytes.resize(random() % 3 == 0 ? random() % bytes.size() : bytes.size());
        if (random() % 4 == 0) bytes.resize(bytes.size() + random() % 200);
        if (!form->read_from(bytes, kMemoryMax)) ++read;
        form->reset();
        ++passed;
      }
    }
  }
  EXPECT_GT(read, 1000);
  EXPECT_LT(read, passed);
}

}  // namespace
}  // namespace connect_bridge::ros
