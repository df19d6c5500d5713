// The operator's tool, in addition to the two programs.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>

#include "apps/ctl_bugreport.hpp"
#include "apps/ctl_certs.hpp"
#include "apps/ctl_doctor.hpp"
#include "apps/ctl_explain.hpp"
#include "apps/ctl_ping.hpp"
#include "apps/ctl_status.hpp"
#include "apps/ctl_token.hpp"
#include "config/document.hpp"
#include "run/check.hpp"
#include "run/exit_codes.hpp"

namespace {

int write_tables(const std::string& manual) {
  if (manual.empty()) {
    std::fputs(connect_bridge::config_tables().c_str(), stdout);
    return 0;
  }
  const auto complain = [&manual](const char* problem) {
    std::fprintf(stderr, "%s: %s\n", manual.c_str(), problem);
    return connect_bridge::kExitConfiguration;
  };
  std::ifstream file(manual);
  std::ostringstream content;
  if (!file || !(content << file.rdbuf())) return complain("cannot be read");
  const auto document = connect_bridge::config_document(content.str());
  if (!document) return complain("has no marks between which the table stands");
  std::ofstream out(manual);
  if (!(out << *document << std::flush)) return complain("cannot be written");
  return 0;
}

CLI::App* add_token(CLI::App& app, TokenRequest& request) {
  auto* token = app.add_subcommand("token",
                                   "Make a token for a client and its entry for the server, or "
                                   "remove a client's entries");
  token->add_option("identity", request.identity, "Who has the token, as rules call them")
      ->required();
  auto* remove =
      token->add_flag("--remove", request.remove, "Remove its entries from the file, make none");
  token->add_option("--group", request.groups, "A group that rules can ask for; several times")
      ->excludes(remove);
  auto* expires = token
                      ->add_option("--expires", request.expires,
                                   "When it ends: 2027-01-31 or 2027-01-31T12:00:00Z")
                      ->excludes(remove);
  token->add_option("--days", request.days, "When it ends: after so many days")
      ->check(CLI::Range(1, 36500))
      ->excludes(expires)
      ->excludes(remove);
  token->add_option("--comment", request.comment, "For people")->excludes(remove);
  auto* file = token->add_option("--file", request.file,
                                 "The server's token file, which gets the entry; a running server "
                                 "reads it within two seconds");
  remove->needs(file);
  return token;
}

// CLI11 says only that a subcommand is required, whatever stands in its place.
std::string complaint_of(const CLI::App& app, const CLI::Error& wrong) {
  const auto unknown = app.remaining();
  if (unknown.empty() || !app.get_subcommands().empty()) return wrong.what();
  return "\"" + unknown.front() + "\" is unknown: a subcommand is required";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"ctl: tools for ROS2 Connect, the bridge that joins two ROS 2 graphs"};
  app.require_subcommand(1);
  app.set_version_flag("--version", connect_bridge::version_text(), "Print the version");
  app.failure_message([](const CLI::App* failed, const CLI::Error& wrong) {
    return complaint_of(*failed, wrong) + "\n\n" + failed->help();
  });

  std::string file, role;
  auto* check =
      app.add_subcommand("check", "Say what a server or client would do with a parameter file");
  check->add_option("file", file, "A ROS 2 parameter file")->required();
  check->add_option("--role", role, "For a node with a name of its own: server or client")
      ->check(CLI::IsMember({"server", "client"}));

  std::string manual;
  auto* document = app.add_subcommand("config-doc", "Print the table of all parameters");
  document->add_option("manual", manual,
                       "Instead, write the table into this file, between its marks");

  connect_bridge::CertificateOrder order;
  const auto* certs = connect_bridge::add_certs_command(app, order);
  TokenRequest request;
  const auto* token = add_token(app, request);

  ExplainRequest question;
  const auto* explain = add_explain_command(app, question);

  StatusQuestion status_question;
  const auto* status = add_status_command(app, status_question);

  DoctorOrder doctor_order;
  const auto* doctor = add_doctor_command(app, doctor_order);

  BugreportOrder report_order;
  const auto* report = add_bugreport_command(app, report_order);

  PingOrder ping_order;
  const auto* ping = add_ping_command(app, ping_order);
  BenchOrder bench_order;
  const auto* bench = add_bench_command(app, bench_order);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& wrong) {
    return app.exit(wrong) == 0 ? 0 : connect_bridge::kExitConfiguration;
  }
  if (*doctor) return run_doctor(doctor_order);
  if (*report) return run_bugreport(report_order);
  if (*ping) return run_ping(ping_order);
  if (*bench) return run_bench(bench_order);
  if (*status) return run_status(status_question);
  if (*explain) return run_explain(question);
  if (*certs) return connect_bridge::run_certs(order);
  if (*token) return request.remove ? remove_token(request) : make_token(request);
  if (*check) return connect_bridge::check_file(file, role);
  return *document ? write_tables(manual) : 0;
}
