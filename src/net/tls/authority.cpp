#include "net/tls/authority.hpp"

#include <fcntl.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <cerrno>
#include <cstring>
#include <optional>
#include <string_view>

#include "core/base/hex.hpp"
#include "net/tls/certified.hpp"
#include "net/tls/openssl_owned.hpp"
#include "net/tls/tls.hpp"

namespace connect_bridge {
namespace {

constexpr int kAuthorityDays = 3650;
// The clock of a robot that has just started may be slow.
constexpr long kEarlierSeconds = 86400;
constexpr int kSerialBits = 159;            // RFC 5280 section 4.1.2.2: 20 bytes, positive
constexpr std::size_t kCommonNameMax = 64;  // RFC 5280, upper bounds
constexpr std::size_t kHostMax = 253;
constexpr std::size_t kListMax = 100;

// OpenSSL fails here only for lack of memory or randomness, and nothing can be done about that.
struct Failed {
  std::string what;
};
void must(bool good, const char* what) {
  if (!good) throw Failed{std::string{"OpenSSL cannot "} + what};
}

struct Signed {
  OpenSslOwned<X509> certificate;
  OpenSslOwned<EVP_PKEY> key;
};

struct CertificateSubject {
  std::string common_name;
  std::vector<std::string> organizations;
  std::string alternatives;  // "DNS:robot,IP:10.0.0.1"; empty: none
  const char* usage;         // "serverAuth"; null: an authority
  int days = 0;
};

// A file that is to be written.
struct Sheet {
  std::string path;
  std::string text;
  bool secret = false;
};

void add_entry(X509_NAME* name, const char* field, const std::string& text) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(text.data());
  must(X509_NAME_add_entry_by_txt(name, field, MBSTRING_UTF8, bytes, static_cast<int>(text.size()),
                                  -1, 0) == 1,
       "write a subject");
}

void add_extension(X509* certificate, X509* issuer, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const OpenSslOwned<X509_EXTENSION> made{
      X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str())};
  must(made && X509_add_ext(certificate, made.get(), -1) == 1, "write an extension");
}

void add_serial(X509* certificate) {
  const OpenSslOwned<BIGNUM> number{BN_new()};
  must(number && BN_rand(number.get(), kSerialBits, BN_RAND_TOP_ONE, BN_RAND_BOTTOM_ANY) == 1 &&
           BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate)) != nullptr,
       "make a serial number");
}

void add_extensions(X509* certificate, X509* issuer, const CertificateSubject& subject) {
  const bool authority = subject.usage == nullptr;
  add_extension(certificate, issuer, NID_basic_constraints,
                authority ? "critical,CA:TRUE,pathlen:0" : "critical,CA:FALSE");
  add_extension(certificate, issuer, NID_key_usage,
                authority ? "critical,keyCertSign,cRLSign" : "critical,digitalSignature");
  add_extension(certificate, issuer, NID_subject_key_identifier, "hash");
  if (authority) return;
  add_extension(certificate, issuer, NID_authority_key_identifier, "keyid");
  // A client must not be able to act as a server with its certificate.
  add_extension(certificate, issuer, NID_ext_key_usage, subject.usage);
  if (!subject.alternatives.empty())
    add_extension(certificate, issuer, NID_subject_alt_name, subject.alternatives);
}

// Peers refuse a certificate whose authority has ended: its own end would promise too much.
void cap_end(X509* certificate, const X509* issuer) {
  const ASN1_TIME* const last = X509_get0_notAfter(issuer);
  if (ASN1_TIME_compare(X509_get0_notAfter(certificate), last) > 0)
    must(X509_set1_notAfter(certificate, last) == 1, "write the dates of a certificate");
}

// Signed by `issuer`, or by itself.
Signed sign(const CertificateSubject& subject, const Signed* issuer) {
  Signed made{OpenSslOwned<X509>{X509_new()}, OpenSslOwned<EVP_PKEY>{EVP_EC_gen("P-256")}};
  X509* const certificate = made.certificate.get();
  must(certificate != nullptr && made.key != nullptr, "make a key");
  const Signed& signer = issuer == nullptr ? made : *issuer;
  X509_NAME* const name = X509_get_subject_name(certificate);
  for (const std::string& organization : subject.organizations) add_entry(name, "O", organization);
  add_entry(name, "CN", subject.common_name);
  add_serial(certificate);
  const int version3 = 2;
  must(X509_set_version(certificate, version3) == 1 &&
           X509_set_pubkey(certificate, made.key.get()) == 1 &&
           X509_set_issuer_name(certificate, X509_get_subject_name(signer.certificate.get())) == 1,
       "write a certificate");
  must(X509_gmtime_adj(X509_getm_notBefore(certificate), -kEarlierSeconds) != nullptr &&
           X509_time_adj_ex(X509_getm_notAfter(certificate), subject.days, 0, nullptr) != nullptr,
       "write the dates of a certificate");
  cap_end(certificate, signer.certificate.get());
  add_extensions(certificate, signer.certificate.get(), subject);
  must(X509_sign(certificate, signer.key.get(), EVP_sha256()) > 0, "sign a certificate");
  return made;
}

// NAME.crt and NAME.key.
void add_sheets(const std::string& name, const Signed& made, std::vector<Sheet>& sheets) {
  const OpenSslOwned<BIO> certificate{BIO_new(BIO_s_mem())};
  const OpenSslOwned<BIO> key{BIO_new(BIO_s_mem())};
  must(certificate && PEM_write_bio_X509(certificate.get(), made.certificate.get()) == 1,
       "write a certificate");
  must(key && PEM_write_bio_PrivateKey(key.get(), made.key.get(), nullptr, nullptr, 0, nullptr,
                                       nullptr) == 1,
       "write a key");
  sheets.push_back({name + ".crt", written_to(certificate.get()), false});
  sheets.push_back({name + ".key", written_to(key.get()), true});
}

bool exists(const std::string& path) {
  struct stat unused {};
  return ::lstat(path.c_str(), &unused) == 0;
}

// Made of letters, digits and these; it does not begin with a dot.
bool is_made_of(const std::string& text, std::string_view others, std::size_t max) {
  const auto allowed = [others](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           others.find(c) != std::string_view::npos;
  };
  return !text.empty() && text.size() <= max && text.front() != '.' &&
         std::all_of(text.begin(), text.end(), allowed);
}

bool is_host(const std::string& text) {
  ErrorCode no_address;
  const auto address = asio::ip::make_address(text, no_address);
  // A certificate knows no zones.
  if (!no_address) return address.is_v4() || address.to_v6().scope_id() == 0;
  // No rule of DNS (RFC 952) allows '_', but names of machines have it.
  return is_made_of(text, "-._", kHostMax) && text.front() != '-';
}

// Also a part of a file's name.
bool is_name(const std::string& text) {
  return is_made_of(text, "-_.@", kCommonNameMax);
}

std::string problem_of(const CertificateOrder& order) {
  if (order.hosts.empty() && order.clients.empty()) return "name a host of the server or a client";
  if (std::max({order.hosts.size(), order.clients.size(), order.groups.size()}) > kListMax)
    return "at most " + std::to_string(kListMax) + " hosts, clients and groups";
  for (const std::string& host : order.hosts)
    if (!is_host(host)) return "'" + host + "' is neither the name of a host nor an IP address";
  for (const auto* names : {&order.clients, &order.groups})
    for (const std::string& name : *names)
      if (!is_name(name))
        return "'" + name + "': a name has 1 to 64 letters, digits or any of - _ . @";
  return {};
}

std::string alternatives_of(const std::vector<std::string>& hosts) {
  std::string text;
  for (const std::string& host : hosts) {
    ErrorCode no_address;
    static_cast<void>(asio::ip::make_address(host, no_address));
    text += (text.empty() ? "" : ",") + std::string{no_address ? "DNS:" : "IP:"} + host;
  }
  return text;
}

// The authority that the folder has already.
std::optional<Signed> read_authority(const std::string& name, std::string& problem) {
  const OpenSslOwned<BIO> certificate{BIO_new_file((name + ".crt").c_str(), "r")};
  const OpenSslOwned<BIO> key{BIO_new_file((name + ".key").c_str(), "r")};
  Signed read;
  if (certificate)
    read.certificate.reset(PEM_read_bio_X509(certificate.get(), nullptr, nullptr, nullptr));
  const auto no_passphrase = [](char*, int, int, void*) { return 0; };
  if (key) read.key.reset(PEM_read_bio_PrivateKey(key.get(), nullptr, no_passphrase, nullptr));
  ERR_clear_error();
  if (read.certificate && read.key &&
      X509_check_private_key(read.certificate.get(), read.key.get()) == 1)
    return read;
  problem = name + ".crt and " + name +
            ".key cannot be used as an authority: the certificate and " +
            "its key, without a passphrase, are both needed";
  return std::nullopt;
}

// Whether it ends before a certificate would that is valid for so many days from now.
bool shortens(const X509* authority, int days) {
  int days_left = 0, seconds = 0;
  return ASN1_TIME_diff(&days_left, &seconds, nullptr, X509_get0_notAfter(authority)) == 1 &&
         days_left < days;
}

Signed new_authority() {
  // Two authorities must not have the same name: a machine that trusts both could not tell their
  // signatures apart.
  unsigned char random[4];
  must(RAND_bytes(random, sizeof random) == 1, "make random numbers");
  CertificateSubject subject;
  subject.common_name = "ROS2 Connect authority " + to_hex(random);
  subject.usage = nullptr;
  subject.days = kAuthorityDays;
  return sign(subject, nullptr);
}

std::string write(const Sheet& sheet) {
  const int mode = sheet.secret ? 0600 : 0644;
  const int file = ::open(sheet.path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (file < 0) return sheet.path + " cannot be written: " + std::strerror(errno);
  const ssize_t written = ::write(file, sheet.text.data(), sheet.text.size());
  // On the disk: after a loss of power an empty file would have to be removed by hand.
  const bool kept = ::fsync(file) == 0 || errno == EINVAL;
  const bool closed = ::close(file) == 0;
  if (written == static_cast<ssize_t>(sheet.text.size()) && kept && closed) return {};
  ::unlink(sheet.path.c_str());
  return sheet.path + " cannot be written: the disk may be full";
}

// All of them, or none.
std::string write_all(const std::vector<Sheet>& sheets) {
  for (std::size_t i = 0; i < sheets.size(); ++i) {
    const std::string problem = write(sheets[i]);
    if (problem.empty()) continue;
    for (std::size_t done = 0; done < i; ++done) ::unlink(sheets[done].path.c_str());
    return problem;
  }
  return {};
}

CertificatesMade make(const CertificateOrder& order) {
  CertificatesMade result;
  const std::string before = order.folder + "/";
  std::vector<Sheet> sheets;
  std::optional<Signed> authority;
  if (exists(before + "ca.crt") || exists(before + "ca.key")) {
    authority = read_authority(before + "ca", result.problem);
    if (!authority) return result;
    const X509* const signer = authority->certificate.get();
    if (X509_cmp_current_time(X509_get0_notAfter(signer)) < 0) {
      result.problem =
          before + "ca.crt has ended: to make a new authority, move it and ca.key away";
      return result;
    }
    if (shortens(signer, order.days)) result.shortened_to = day_of(end_of(signer));
  } else {
    authority = new_authority();
    add_sheets(before + "ca", *authority, sheets);
  }
  if (!order.hosts.empty()) {
    const std::string& first = order.hosts.front();
    const std::string name = first.size() <= kCommonNameMax ? first : "server";
    const Signed made =
        sign({name, {}, alternatives_of(order.hosts), "serverAuth", order.days}, &*authority);
    result.pin = pin_of_certificate(made.certificate.get());
    add_sheets(before + "server", made, sheets);
  }
  for (const std::string& client : order.clients)
    add_sheets(before + "client-" + client,
               sign({client, order.groups, {}, "clientAuth", order.days}, &*authority), sheets);
  for (const Sheet& sheet : sheets)
    if (exists(sheet.path)) result.problem = sheet.path + " exists already and is not overwritten";
  if (result.problem.empty() && ::mkdir(order.folder.c_str(), 0700) != 0 && errno != EEXIST)
    result.problem = "the folder " + order.folder + " cannot be made: " + std::strerror(errno);
  if (result.problem.empty()) result.problem = write_all(sheets);
  if (!result.problem.empty()) return result;
  for (const Sheet& sheet : sheets) result.files.push_back(sheet.path);
  return result;
}

}  // namespace

CertificatesMade make_certificates(const CertificateOrder& order) {
  CertificatesMade result;
  result.problem = problem_of(order);
  if (!result.problem.empty()) return result;
  try {
    return make(order);
  } catch (const Failed& failed) {
    result.problem = failed.what;
    return result;
  }
}

std::string make_pinned_certificate(const std::string& folder, const std::string& host) {
  constexpr int kYears10 = 3650;
  CertificateOrder order;
  order.folder = folder;
  order.hosts = {host};
  order.days = kYears10;
  const std::string problem = make_certificates(order).problem;
  if (problem.empty())
    for (const char* unused : {"/ca.key", "/ca.crt"}) ::unlink((folder + unused).c_str());
  return problem;
}

std::string pin_of_file(const std::string& file, std::string& problem) {
  const OpenSslOwned<BIO> opened{BIO_new_file(file.c_str(), "r")};
  const OpenSslOwned<X509> certificate{
      opened ? PEM_read_bio_X509(opened.get(), nullptr, nullptr, nullptr) : nullptr};
  ERR_clear_error();
  if (certificate) return pin_of_certificate(certificate.get());
  problem = file + " is not a certificate";
  return {};
}

}  // namespace connect_bridge
