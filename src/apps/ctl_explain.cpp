#include "apps/ctl_explain.hpp"

#include "run/check.hpp"

CLI::App* add_explain_command(CLI::App& app, ExplainRequest& request) {
  auto* explain = app.add_subcommand(
      "explain", "Say which rule of a parameter file allows a name or denies it, and why");
  explain->footer(
      "Exit code: 0 if it is allowed (in each direction that is asked for, for some types at "
      "least), "
      "1 if it is not, 2 if the file or the question is wrong.");
  explain->add_option("file", request.file, "A ROS 2 parameter file")->required();
  explain->add_option("--role", request.role, "For a node with a name of its own: server or client")
      ->check(CLI::IsMember({"server", "client"}));
  explain->add_option("--identity", request.identity, "As whom the peer logs in");
  explain->add_option(
      "--group", request.groups,
      "A group of the peer; several times. Without it: the groups of --identity in the file that "
      "auth.token_file names");
  auto* names = explain->add_option_group("name", "What is asked for, by its name on the wire");
  names->add_option("--topic", request.topic, "A topic");
  names->add_option("--service", request.service, "A service");
  names->add_option("--action", request.action, "An action");
  names->add_option("--parameters", request.parameters, "A node, for its parameters");
  names->require_option(1);
  explain->add_option("--type", request.type, "Its type, as std_msgs/msg/String; any if not given");
  explain->add_option("--direction", request.direction, "import, export, or both (if not given)")
      ->check(CLI::IsMember({"import", "export", "both"}));
  return explain;
}

int run_explain(const ExplainRequest& request) {
  using connect_bridge::Direction;
  using connect_bridge::OpenedBy;
  connect_bridge::RightQuestion question;
  for (const auto& [what, name] : {std::pair{OpenedBy::kTopics, &request.topic},
                                   {OpenedBy::kServices, &request.service},
                                   {OpenedBy::kActions, &request.action},
                                   {OpenedBy::kParameters, &request.parameters}}) {
    if (name->empty()) continue;
    question.what = what;
    question.name = *name;
  }
  question.type = request.type;
  if (request.direction == "export") question.direction = Direction::kExport;
  if (request.direction == "import") question.direction = Direction::kImport;
  question.who.name = request.identity;
  question.who.groups = request.groups;
  return connect_bridge::explain_file(request.file, request.role, question);
}
