// What the peers' names are at this side.
#include <gmock/gmock.h>

#include "config/explain.hpp"
#include "yaml_parameters.hpp"

namespace connect_bridge {
namespace {

using testing::HasSubstr;

constexpr char kRobots[] = R"(
prefix: by_identity
identity_names: ["robot-7:=seven"]
remap: ["/tf:=/tf"]
auth: {method: certificate}
tls: {certificate: /c, private_key: /k, ca: /a}
rules: [all]
rule: {all: {import_topics: ["/**"]}}
)";

TEST(NamesReader, ByIdentityEachLoginHasItsOwn) {
  const Config config = config_of(yaml(kRobots), Role::kServer);
  const SideOptions options = side_options(config);
  EXPECT_EQ(options.names.of("robot-7").value().to_local("/scan"), "/seven/scan");
  EXPECT_EQ(options.names.of("robot8").value().to_local("/scan"), "/robot8/scan");
  EXPECT_EQ(options.names.of("robot8").value().to_local("/tf"), "/tf");
  EXPECT_FALSE(options.names.of("robot-9"));
  const std::string text = explain(config);
  EXPECT_THAT(text, HasSubstr("the peer's /x is /IDENTITY/x at this side"));
  EXPECT_THAT(text, HasSubstr("the identity robot-7 is /seven"));
}

}  // namespace
}  // namespace connect_bridge
