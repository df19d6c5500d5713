// `ctl explain`: why rules allow an interface or not.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

struct ExplainRequest {
  std::string file, role;
  std::string identity;
  std::vector<std::string> groups;
  std::string topic, service, action, parameters;  // one of them
  std::string type;
  std::string direction = "both";
};

// Adds the command to the program; the options go to `request`.
CLI::App* add_explain_command(CLI::App& app, ExplainRequest& request);
// The program's exit code: 0 allowed, 1 not allowed, 2 if the file or the question is wrong.
int run_explain(const ExplainRequest& request);
