#include "ros/types/type_functions.hpp"

#include <rmw/rmw.h>
#include <rosidl_runtime_c/message_initialization.h>
#include <rosidl_typesupport_introspection_c/message_introspection.h>

#include <memory>
#include <random>

#include "ros/rcl/middleware.hpp"
#include "ros/rcl/rcl_result.hpp"
#include "ros/rcl/take_buffer.hpp"
#include "ros/service_fixture.hpp"
#include "ros/types/cdr_check.hpp"

namespace connect_bridge::ros {
namespace {

using Members = rosidl_typesupport_introspection_c__MessageMembers;

// A message of a type of the test package.
class Sample {
 public:
  explicit Sample(const std::string& name) {
    static TypeSupports types;
    const auto type = std::get<0>(types.message(std::string{kTestPackage} + name, ""));
    support = type.handle.get();
    introspection = type.introspection;
    members_ = static_cast<const Members*>(introspection->data);
    memory = ::operator new(members_->size_of_);
    members_->init_function(memory, ROSIDL_RUNTIME_C_MSG_INIT_ALL);
  }
  ~Sample() {
    members_->fini_function(memory);
    ::operator delete(memory);
  }
  Sample(const Sample&) = delete;
  Sample& operator=(const Sample&) = delete;

  [[nodiscard]] Bytes by_middleware() const {
    return cleared(
        [&](auto& bytes) { return ignore_error(rmw_serialize(memory, support, &bytes)); });
  }
  [[nodiscard]] Bytes by_functions() const {
    return cleared([&](auto& bytes) { return TypeFunctions(*support).write(memory, bytes); });
  }

  const rosidl_message_type_support_t* support;
  const rosidl_message_type_support_t* introspection;
  void* memory;

 private:
  // Without its padding, which the middleware also puts at the end.
  template <class Write>
  [[nodiscard]] Bytes cleared(const Write& write) const {
    TakeBuffer buffer;
    rmw_serialized_message_t& bytes = *buffer.prepare();
    EXPECT_TRUE(write(bytes));
    std::string problem;
    const auto end = clear_padding({bytes.buffer, bytes.buffer_length}, *introspection, problem);
    EXPECT_TRUE(end) << problem;
    bytes.buffer_length = end.value_or(0);
    return bytes_of(buffer.give_away());
  }

  const Members* members_;
};

class TypeFunctionsTest : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!middleware().takes_bare_services)
      GTEST_SKIP() << "this middleware does not use the functions";
  }
};

TEST_P(TypeFunctionsTest, WriteWhatTheMiddlewareWrites) {
  const Sample sample(GetParam());
  EXPECT_EQ(sample.by_middleware(), sample.by_functions());
}

// Random bytes that the check lets through: mostly zeros, as many of these are lengths.
TEST_P(TypeFunctionsTest, ReadWhatTheMiddlewareReads) {
  std::mt19937 random(7);
  int read = 0;
  for (int i = 0; i < 4000; ++i) {
    Bytes bytes{0, 1, 0, 0};
    const unsigned one_of = 4U << random() % 8;
    for (int left = std::uniform_int_distribution{1, 2000}(random); left > 0; --left)
      bytes.push_back(random() % one_of == 0 ? static_cast<std::uint8_t>(random() % 3) : 0);
    const Sample one(GetParam());
    const Sample other(GetParam());
    if (check_cdr(bytes, *one.introspection, call_limits(1U << 20))) continue;
    const auto message = as_serialized(bytes);
    const bool by_middleware = ignore_error(rmw_deserialize(&message, one.support, one.memory));
    ASSERT_EQ(by_middleware, TypeFunctions(*other.support).read(bytes, other.memory));
    if (!by_middleware) continue;
    ++read;
    EXPECT_EQ(one.by_middleware(), other.by_functions());
  }
  EXPECT_GT(read, 10);
}

TEST_P(TypeFunctionsTest, BytesThatEndTooEarlyAreNoMessage) {
  const Sample sample(GetParam());
  const Bytes bytes = sample.by_functions();
  const Sample into(GetParam());
  const ByteView cut{bytes.data(), bytes.size() - 1};
  EXPECT_FALSE(TypeFunctions(*into.support).read(cut, into.memory));
  EXPECT_FALSE(TypeFunctions(*into.support).read({}, into.memory));
}

INSTANTIATE_TEST_SUITE_P(Types, TypeFunctionsTest,
                         testing::Values("/msg/Everything", "/msg/Tree", "/msg/Leaf",
                                         "/msg/Nothing", "/msg/Blob", "/srv/Upload_Request",
                                         "/srv/Reflect_Request", "/action/Fibonacci_Feedback"));

}  // namespace
}  // namespace connect_bridge::ros
