// The operator's tool beside the two programs.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>

#include "apps/ctl_certs.hpp"
#include "config/document.hpp"
#include "run/check.hpp"

namespace {

int print_document(const std::string& manual) {
  std::string text = connect_bridge::config_tables();
  if (!manual.empty()) {
    std::ifstream file(manual);
    std::ostringstream content;
    if (!file || !(content << file.rdbuf())) {
      std::fprintf(stderr, "%s: cannot be read\n", manual.c_str());
      return 2;
    }
    const auto document = connect_bridge::config_document(content.str());
    if (!document) {
      std::fprintf(stderr, "%s: expected a line @TABLES@\n", manual.c_str());
      return 2;
    }
    text = *document;
  }
  std::fputs(text.c_str(), stdout);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"ctl: tools for ROS2 Connect, the bridge that joins two ROS 2 graphs"};
  app.require_subcommand(1);

  std::string file, role;
  auto* check =
      app.add_subcommand("check", "Say what a server or client would do with a parameter file");
  check->add_option("file", file, "A ROS 2 parameter file")->required();
  check->add_option("--role", role, "For a node with a name of its own: server or client")
      ->check(CLI::IsMember({"server", "client"}));

  std::string manual;
  auto* document = app.add_subcommand("config-doc", "Print the table of all parameters");
  document->add_option("manual", manual,
                       "A text to print with the table in place of its line @TABLES@");

  connect_bridge::CertificateOrder order;
  auto* certs = connect_bridge::add_certs_command(app, order);

  CLI11_PARSE(app, argc, argv);
  if (*certs) return connect_bridge::run_certs(order);
  if (*check) return connect_bridge::check_file(file, role);
  return *document ? print_document(manual) : 0;
}
