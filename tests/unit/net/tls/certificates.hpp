// Certificates made for one test run: an authority, and what it signs.
#pragma once

#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rsa.h>
#include <openssl/x509v3.h>

#include <cstdio>
#include <memory>
#include <string>

namespace connect_bridge::test {

using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
using Certificate = std::unique_ptr<X509, decltype(&X509_free)>;

inline Key make_key() {
  EVP_PKEY* made = nullptr;
  const std::unique_ptr<EVP_PKEY_CTX, decltype(&EVP_PKEY_CTX_free)> context{
      EVP_PKEY_CTX_new_id(EVP_PKEY_EC, nullptr), &EVP_PKEY_CTX_free};
  EVP_PKEY_keygen_init(context.get());
  EVP_PKEY_CTX_set_ec_paramgen_curve_nid(context.get(), NID_X9_62_prime256v1);
  EVP_PKEY_keygen(context.get(), &made);
  return {made, &EVP_PKEY_free};
}

inline Key make_rsa_key() {
  EVP_PKEY* made = nullptr;
  const std::unique_ptr<EVP_PKEY_CTX, decltype(&EVP_PKEY_CTX_free)> context{
      EVP_PKEY_CTX_new_id(EVP_PKEY_RSA, nullptr), &EVP_PKEY_CTX_free};
  EVP_PKEY_keygen_init(context.get());
  EVP_PKEY_CTX_set_rsa_keygen_bits(context.get(), 2048);
  EVP_PKEY_keygen(context.get(), &made);
  return {made, &EVP_PKEY_free};
}

inline void add_extension(X509* certificate, X509* issuer, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* const extension = X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str());
  X509_add_ext(certificate, extension, -1);
  X509_EXTENSION_free(extension);
}

// Signs for `key`; an empty `names` makes an authority. `names`: "IP:127.0.0.1,DNS:robot".
inline Certificate make_certificate(EVP_PKEY* key, const std::string& common_name,
                                    const std::string& names, X509* issuer, EVP_PKEY* issuer_key,
                                    long begins_days, long ends_days) {
  static long serial = 1;
  Certificate made{X509_new(), &X509_free};
  X509_set_version(made.get(), 2);
  ASN1_INTEGER_set(X509_get_serialNumber(made.get()), serial++);
  X509_gmtime_adj(X509_getm_notBefore(made.get()), begins_days * 86400);
  X509_gmtime_adj(X509_getm_notAfter(made.get()), ends_days * 86400);
  X509_set_pubkey(made.get(), key);
  if (!common_name.empty())
    X509_NAME_add_entry_by_txt(X509_get_subject_name(made.get()), "CN", MBSTRING_ASC,
                               reinterpret_cast<const unsigned char*>(common_name.c_str()), -1, -1,
                               0);
  X509* const signer = issuer == nullptr ? made.get() : issuer;
  X509_set_issuer_name(made.get(), X509_get_subject_name(signer));
  const bool authority = names.empty();
  add_extension(made.get(), signer, NID_basic_constraints,
                authority ? "critical,CA:TRUE" : "CA:FALSE");
  if (!authority) add_extension(made.get(), signer, NID_subject_alt_name, names);
  X509_sign(made.get(), issuer_key, EVP_sha256());
  return made;
}

inline void write_pem(const std::string& file, X509* certificate) {
  std::FILE* const out = std::fopen(file.c_str(), "w");
  PEM_write_X509(out, certificate);
  std::fclose(out);
}

inline void write_pem(const std::string& file, EVP_PKEY* key) {
  std::FILE* const out = std::fopen(file.c_str(), "w");
  PEM_write_PrivateKey(out, key, nullptr, nullptr, 0, nullptr, nullptr);
  std::fclose(out);
}

// An authority in the file `ca`, and pairs of files it signed.
class Authority {
 public:
  explicit Authority(std::string folder, const std::string& name = "Test authority")
      : folder_(std::move(folder)),
        key_(make_key()),
        certificate_(make_certificate(key_.get(), name, "", nullptr, key_.get(), -10, 3650)) {
    ca = folder_ + "ca.pem";
    write_pem(ca, certificate_.get());
  }

  struct Files {
    std::string certificate;
    std::string key;
  };

  Files sign(const std::string& name, const std::string& names, long begins_days = -1,
             long ends_days = 365) {
    return sign(make_key(), name, names, begins_days, ends_days);
  }
  Files sign(const Key& key, const std::string& name, const std::string& names,
             long begins_days = -1, long ends_days = 365) {
    const Certificate made = make_certificate(key.get(), name, names, certificate_.get(),
                                              key_.get(), begins_days, ends_days);
    Files files{folder_ + name + ".cert.pem", folder_ + name + ".key.pem"};
    write_pem(files.certificate, made.get());
    write_pem(files.key, key.get());
    return files;
  }

  std::string ca;

 private:
  std::string folder_;
  Key key_;
  Certificate certificate_;
};

}  // namespace connect_bridge::test
