// TLS versions, suites and groups that a server accepts, tried one by one: Mozilla's "intermediate"
// and nothing else.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl.hpp>
#include <set>

#include "unit/net/tls/certificates.hpp"
#include "unit/net/tls/raw_tls.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge::test {
namespace {

using Names = std::set<std::string>;

class TlsOffers : public testing::Test {
 protected:
  static Authority& authority() {
    static Authority made{scratch_folder() + "offers_"};
    return made;
  }
  // A server that takes any number of handshakes.
  static ListenOptions server_of(const Key& key) {
    const auto files = authority().sign(key, "robot", "IP:127.0.0.1");
    ListenOptions options;
    options.tls = TlsOptions{files.certificate, files.key};
    options.address_handshakes_at_once = options.handshakes_at_once = 100000;
    return options;
  }
  static bool shakes(Pair& pair, const RawTls::Configure& configure) {
    return RawTls{pair.server.network.listen_port(), configure}.shakes(pair.loop);
  }

  // Of all suites that OpenSSL has for TLS 1.2 and before.
  static Names suites_of(Pair& pair) {
    const RawTls::Context all{SSL_CTX_new(TLS_client_method()), &SSL_CTX_free};
    SSL_CTX_set_cipher_list(all.get(), "ALL:COMPLEMENTOFALL:@SECLEVEL=0");
    Names accepted;
    const auto* suites = SSL_CTX_get_ciphers(all.get());
    for (int i = 0; i < sk_SSL_CIPHER_num(suites); ++i) {
      const SSL_CIPHER* suite = sk_SSL_CIPHER_value(suites, i);
      const std::string name = SSL_CIPHER_get_name(suite);
      if (name.starts_with("TLS_")) continue;  // of TLS 1.3
      const bool accepts = shakes(pair, [&](SSL_CTX* context) {
        SSL_CTX_set_max_proto_version(context, TLS1_2_VERSION);
        SSL_CTX_set_cipher_list(context, (name + ":@SECLEVEL=0").c_str());
      });
      if (accepts) accepted.insert(name);
    }
    return accepted;
  }
};

TEST_F(TlsOffers, OfTls12ForwardSecrecyWithAeadOnly) {
  Pair ecdsa{server_of(make_key())};
  EXPECT_EQ(suites_of(ecdsa),
            (Names{"ECDHE-ECDSA-AES128-GCM-SHA256", "ECDHE-ECDSA-AES256-GCM-SHA384",
                   "ECDHE-ECDSA-CHACHA20-POLY1305"}));
  Pair rsa{server_of(make_rsa_key())};
  EXPECT_EQ(suites_of(rsa), (Names{"ECDHE-RSA-AES128-GCM-SHA256", "ECDHE-RSA-AES256-GCM-SHA384",
                                   "ECDHE-RSA-CHACHA20-POLY1305"}));
}

TEST_F(TlsOffers, OfTls13ThreeSuites) {
  Pair pair{server_of(make_key())};
  Names accepted;
  for (const char* suite :
       {"TLS_AES_128_GCM_SHA256", "TLS_AES_256_GCM_SHA384", "TLS_CHACHA20_POLY1305_SHA256",
        "TLS_AES_128_CCM_SHA256", "TLS_AES_128_CCM_8_SHA256"}) {
    const bool accepts = shakes(pair, [&](SSL_CTX* context) {
      SSL_CTX_set_min_proto_version(context, TLS1_3_VERSION);
      ASSERT_EQ(SSL_CTX_set_ciphersuites(context, suite), 1) << suite;
    });
    if (accepts) accepted.insert(suite);
  }
  EXPECT_EQ(accepted, (Names{"TLS_AES_128_GCM_SHA256", "TLS_AES_256_GCM_SHA384",
                             "TLS_CHACHA20_POLY1305_SHA256"}));
}

TEST_F(TlsOffers, ThreeGroupsForTheKeyExchange) {
  // With an ECDSA key a group of TLS 1.2 would have to be the key's curve as well.
  Pair pair{server_of(make_rsa_key())};
  for (const int version : {TLS1_2_VERSION, TLS1_3_VERSION}) {
    Names accepted;
    for (const char* group : {"X25519", "P-256", "P-384", "X448", "P-521", "P-224", "secp256k1",
                              "brainpoolP256r1", "ffdhe2048", "ffdhe3072", "ffdhe8192"}) {
      bool known = false;
      const bool accepts = shakes(pair, [&](SSL_CTX* context) {
        SSL_CTX_set_min_proto_version(context, version);
        SSL_CTX_set_max_proto_version(context, version);
        known = SSL_CTX_set1_groups_list(context, group) == 1;
      });
      if (known && accepts) accepted.insert(group);
    }
    EXPECT_EQ(accepted, (Names{"X25519", "P-256", "P-384"})) << version;
  }
}

TEST_F(TlsOffers, NoOldVersion) {
  Pair pair{server_of(make_key())};
  Names accepted;
  for (const int version : {TLS1_VERSION, TLS1_1_VERSION, TLS1_2_VERSION, TLS1_3_VERSION}) {
    RawTls client{pair.server.network.listen_port(), [&](SSL_CTX* context) {
                    SSL_CTX_set_min_proto_version(context, version);
                    SSL_CTX_set_max_proto_version(context, version);
                  }};
    if (client.shakes(pair.loop)) accepted.insert(SSL_get_version(client.tls()));
  }
  EXPECT_EQ(accepted, (Names{"TLSv1.2", "TLSv1.3"}));
}

TEST_F(TlsOffers, OurClientTakesTheNewestVersion) {
  const auto own = authority().sign("robot", "IP:127.0.0.1");
  Loop loop;
  boost::asio::ssl::context context(boost::asio::ssl::context::tls_server);
  context.use_certificate_chain_file(own.certificate);
  context.use_private_key_file(own.key, boost::asio::ssl::context::pem);
  boost::asio::ip::tcp::acceptor acceptor(loop.io, {boost::asio::ip::address_v4::loopback(), 0});
  boost::asio::ssl::stream<boost::asio::ip::tcp::socket> server(loop.io, context);
  bool shaken = false;
  acceptor.async_accept(server.next_layer(), [&](const auto&) {
    server.async_handshake(boost::asio::ssl::stream_base::server,
                           [&](const auto& error) { shaken = !error; });
  });
  Side client(loop);
  DialOptions options;
  options.url = {true, "127.0.0.1", acceptor.local_endpoint().port(), "/"};
  options.tls.ca_file = authority().ca;
  client.network.dial(kDial, options);
  ASSERT_TRUE(loop.until([&] { return shaken; }));
  EXPECT_STREQ(SSL_get_version(server.native_handle()), "TLSv1.3");
}

TEST_F(TlsOffers, TheClientsOrderHolds) {
  Pair pair{server_of(make_key())};
  for (const char* first : {"TLS_AES_128_GCM_SHA256", "TLS_CHACHA20_POLY1305_SHA256"}) {
    RawTls client{pair.server.network.listen_port(), [&](SSL_CTX* context) {
                    const std::string order = std::string{first} + ":TLS_AES_256_GCM_SHA384";
                    SSL_CTX_set_ciphersuites(context, order.c_str());
                  }};
    ASSERT_TRUE(client.shakes(pair.loop));
    EXPECT_STREQ(SSL_get_cipher_name(client.tls()), first);
  }
}

TEST_F(TlsOffers, NeitherRenegotiationNorResumption) {
  Pair pair{server_of(make_key())};
  RawTls client{pair.server.network.listen_port(),
                [](SSL_CTX* context) { SSL_CTX_set_max_proto_version(context, TLS1_2_VERSION); }};
  ASSERT_TRUE(client.shakes(pair.loop));
  EXPECT_EQ(SSL_SESSION_has_ticket(SSL_get_session(client.tls())), 0);
  unsigned length = 0;
  SSL_SESSION_get_id(SSL_get_session(client.tls()), &length);
  EXPECT_EQ(length, 0U);
  ASSERT_EQ(SSL_renegotiate(client.tls()), 1);
  const bool again = client.completes(pair.loop, [&] {
    return SSL_do_handshake(client.tls());
  }) && client.completes(pair.loop, [&] { return SSL_renegotiate_pending(client.tls()) == 0; });
  EXPECT_FALSE(again);
}

}  // namespace
}  // namespace connect_bridge::test
