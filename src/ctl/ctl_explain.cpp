#include <memory>
#include <string>
#include <tuple>

#include "ctl/check.hpp"
#include "ctl/ctl_commands.hpp"

namespace {

using namespace connect_bridge;

struct ExplainRequest {
  std::string file, role;
  std::string direction = "both";
  RightQuestion question;
};

int run_explain(ExplainRequest& request) {
  if (request.direction == "export") request.question.direction = Direction::kExport;
  if (request.direction == "import") request.question.direction = Direction::kImport;
  return explain_file(request.file, request.role, request.question);
}

}  // namespace

void add_explain_command(CLI::App& app, int& exit_code) {
  const auto request = std::make_shared<ExplainRequest>();
  auto* explain = app.add_subcommand(
      "explain", "Say which rule of a parameter file allows a name or denies it, and why");
  explain->footer(
      "Exit code: 0 if it is allowed (in each direction that is asked for, for some types at "
      "least), "
      "1 if it is not, 2 if the file or the question is wrong.");
  explain->add_option("file", request->file, "A ROS 2 parameter file")->required();
  explain
      ->add_option("--role", request->role, "For a node with a name of its own: server or client")
      ->check(CLI::IsMember({"server", "client"}));
  RightQuestion& question = request->question;
  explain->add_option("--identity", question.who.name, "As whom the peer logs in");
  explain->add_option(
      "--group", question.who.groups,
      "A group of the peer; several times. Without it: the groups of --identity in the file that "
      "auth.token_file names");
  auto* names = explain->add_option_group("name", "What is asked for, by its name on the wire");
  for (const auto& [option, what, help] :
       {std::tuple{"--topic", OpenedBy::kTopics, "A topic"},
        {"--service", OpenedBy::kServices, "A service"},
        {"--action", OpenedBy::kActions, "An action"},
        {"--parameters", OpenedBy::kParameters, "A node, for its parameters"}})
    names->add_option_function<std::string>(
        option,
        [&question, what = what](const std::string& name) {
          question.what = what;
          question.name = name;
        },
        help);
  names->require_option(1);
  explain->add_option("--type", question.type,
                      "Its type, as std_msgs/msg/String; any if not given");
  explain->add_option("--direction", request->direction, "import, export, or both (if not given)")
      ->check(CLI::IsMember({"import", "export", "both"}));
  explain->callback([request, &exit_code] { exit_code = run_explain(*request); });
}
