#include <cstdio>
#include <memory>

#include "ctl/ctl_commands.hpp"
#include "net/tls/authority.hpp"

namespace {

using namespace connect_bridge;

constexpr int kDaysMax = 3650;

void print_lines(const CertificateOrder& order) {
  const char* const folder = order.folder.c_str();
  const bool server = !order.hosts.empty();
  if (server && order.clients.empty()) {
    std::printf(
        "The server's parameters:\n  tls: {certificate: %s/server.crt, private_key: "
        "%s/server.key}\nA client's, with a copy of ca.crt:\n  tls: {ca: %s/ca.crt}\n",
        folder, folder, folder);
    return;
  }
  std::printf(
      "The server's parameters:\n  tls: {certificate: %s/server.crt, private_key: "
      "%s/server.key, ca: %s/ca.crt}\n",
      folder, folder, folder);
  for (const std::string& client : order.clients)
    std::printf(
        "Those of %s, with a copy of these three files:\n  tls: {ca: %s/ca.crt, "
        "certificate: %s/client-%s.crt, private_key: %s/client-%s.key}\n",
        client.c_str(), folder, folder, client.c_str(), folder, client.c_str());
}

int run_certs(const CertificateOrder& order) {
  if (!order.groups.empty() && order.clients.empty())
    return complain("ctl certs: --group is for clients: name them by --client", 2);
  const CertificatesMade made = make_certificates(order);
  if (!made.problem.empty()) return complain("ctl certs: " + made.problem, 2);
  for (const std::string& file : made.files) std::printf("made %s\n", file.c_str());
  if (!made.shortened_to.empty())
    std::printf("They end on %s, as their authority does\n", made.shortened_to.c_str());
  if (!made.pin.empty()) std::printf("The pin of the server's key: %s\n", made.pin.c_str());
  print_lines(order);
  std::printf(
      "Keep %s/ca.key elsewhere, not on the robot: who has it can make servers and clients that "
      "are trusted. It is needed here to sign others.\n",
      order.folder.c_str());
  return 0;
}

}  // namespace

void add_certs_command(CLI::App& app, int& exit_code) {
  const auto order = std::make_shared<CertificateOrder>();
  auto* certs = app.add_subcommand(
      "certs",
      "Make a private authority, and certificates of it for a server and for clients by name. An "
      "authority that is in the folder already signs what is new. Nothing is overwritten.");
  certs->add_option("folder", order->folder, "Where the files are put")->required();
  certs->add_option("--host", order->hosts,
                    "A name or address under which clients dial the server");
  certs->add_option("--client", order->clients, "The name of a client");
  certs->add_option("--group", order->groups, "A group of these clients, for rules");
  certs->add_option("--days", order->days, "How long they are valid")
      ->check(CLI::Range(1, kDaysMax))
      ->capture_default_str();
  certs->callback([order, &exit_code] { exit_code = run_certs(*order); });
}
