// Nodes whose workspace has another definition of a service's type than the bridge's.
#include <rosidl_runtime_c/service_type_support_struct.h>

#include <memory>
#include <string>

#include "ros/rcl/distro.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/service_fixture.hpp"
#include "ros/types/hashed.hpp"

namespace connect_bridge::ros {
namespace {

#if CONNECT_TYPE_HASHES

constexpr char kSameInAll[] = "std_srvs/srv/Trigger";

// std_srvs/srv/SetBool with another hash of its requests, or of its responses. The fields are the
// same, so that Fast DDS of any version connects its endpoints with others.
class OtherType {
 public:
  explicit OtherType(bool of_requests) : type_(std::get<0>(types_.service(kSetBool, ""))) {
    support_ = *type_->handle;
    const auto*& part = of_requests ? support_.request_typesupport : support_.response_typesupport;
    part_ = *part;
    part_.get_type_hash_func = [](const rosidl_message_type_support_t*) {
      static const TypeHash hash = parse_type_hash("RIHS01_" + std::string(64, 'b')).value();
      return &hash;
    };
    part = &part_;
  }
  [[nodiscard]] const rosidl_service_type_support_t* handle() const { return &support_; }

 private:
  TypeSupports types_;
  std::shared_ptr<ServiceType> type_;
  rosidl_service_type_support_t support_{};
  rosidl_message_type_support_t part_{};
};

class OtherServer {
 public:
  OtherServer(TestNode& node, const std::string& service, const OtherType& type) : node_(node) {
    const auto options = rcl_service_get_default_options();
    EXPECT_EQ(RCL_RET_OK, rcl_service_init(&service_, node->handle(), type.handle(),
                                           service.c_str(), &options));
  }
  ~OtherServer() { EXPECT_EQ(RCL_RET_OK, rcl_service_fini(&service_, node_->handle())); }

 private:
  TestNode& node_;
  rcl_service_t service_ = rcl_get_zero_initialized_service();
};

class OtherClient {
 public:
  OtherClient(TestNode& node, const std::string& service, const OtherType& type) : node_(node) {
    const auto options = rcl_client_get_default_options();
    EXPECT_EQ(RCL_RET_OK,
              rcl_client_init(&client_, node->handle(), type.handle(), service.c_str(), &options));
  }
  ~OtherClient() { EXPECT_EQ(RCL_RET_OK, rcl_client_fini(&client_, node_->handle())); }

 private:
  TestNode& node_;
  rcl_client_t client_ = rcl_get_zero_initialized_client();
};

class ServiceDefinitionsTest : public RosTest {
 protected:
  void SetUp() override {
    if (!middleware().tells_servers()) GTEST_SKIP() << "the graph shows no hashes of services";
    testing::internal::CaptureStderr();
  }
  void client(TestSide& side, const std::string& type = kSetBool) {
    side.gateway.apply(CreateServiceClient{ServiceClientId{3}, topic("service"), type});
  }
  void mirror(TestSide& side, const std::string& type = kSetBool) {
    side.gateway.apply(CreateServiceMirror{ServiceMirrorId{4}, topic("service"), type, {}, {}});
  }
  // The log, after this time.
  std::string log_after(TestSide& side, std::chrono::milliseconds time = 5s) {
    side.drain_for(time);
    return testing::internal::GetCapturedStderr();
  }
  static std::size_t told(const std::string& log) {
    std::size_t lines = 0;
    for (auto at = log.find("is not that of its"); at != std::string::npos;
         at = log.find("is not that of its", at + 1))
      ++lines;
    return lines;
  }
};

TEST_F(ServiceDefinitionsTest, ServersWithAnotherRequestAreToldOnce) {
  const OtherType type(true);
  TestNode robot("robot");
  TestSide side("connect_server");
  client(side);
  for (int i = 0; i < 2; ++i) {
    const OtherServer server(robot, topic("service"), type);
    side.drain_for(2s);
  }
  const std::string log = log_after(side, 0ms);
  EXPECT_EQ(1u, told(log)) << log;
  EXPECT_NE(std::string::npos,
            log.find(topic("service") + ": the definition of std_srvs/srv/SetBool_Request here "
                                        "(RIHS01_"))
      << log;
  EXPECT_NE(std::string::npos, log.find("is not that of its server /robot (RIHS01_" +
                                        std::string(64, 'b') + "): calls of it may fail or hang"))
      << log;
}

TEST_F(ServiceDefinitionsTest, ClientsWithAnotherResponseAreTold) {
  const OtherType type(false);
  TestNode operator_node("operator");
  TestSide side("connect_client");
  mirror(side);
  side.drain_for(500ms);
  const OtherClient client(operator_node, topic("service"), type);
  const std::string log = log_after(side);
  EXPECT_EQ(1u, told(log)) << log;
  EXPECT_NE(std::string::npos, log.find("the definition of std_srvs/srv/SetBool_Response here"))
      << log;
  EXPECT_NE(std::string::npos, log.find("is not that of its client /operator (")) << log;
}

TEST_F(ServiceDefinitionsTest, NothingIsToldOfTheSameDefinition) {
  TestNode robot("robot"), operator_node("operator");
  TestSide server_side("connect_server"), client_side("connect_client");
  RawServer server(robot, topic("service"), kSameInAll);
  client(server_side, kSameInAll);
  EXPECT_TRUE(server_side.next<ServiceReady>());
  server_side.drain_for(500ms);
  server_side.gateway.apply(DestroyServiceClient{ServiceClientId{3}});
  mirror(client_side, kSameInAll);
  RawClient caller(operator_node, topic("service"), kSameInAll);
  const std::string log = log_after(client_side, 3s);
  EXPECT_EQ(0u, told(log)) << log;
}

#endif

}  // namespace
}  // namespace connect_bridge::ros
