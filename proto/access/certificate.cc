#include "proto/access/certificate.h"

#include <arpa/inet.h>
#include <openssl/rand.h>

#include <array>
#include <ctime>
#include <stdexcept>

#include "proto/access/openssl.h"
#include "proto/access/token.h"

namespace relmap::access {

namespace {

constexpr long kSecondsOfADay = 86'400;
constexpr long kClockSkew = 3'600;  // a certificate holds so long before it was made, for clocks that are behind

void must(bool done, const char* what) {
  if (done) return;
  ERR_clear_error();
  throw std::runtime_error(std::string("OpenSSL cannot ") + what);
}

Key new_key() {
  Key key(EVP_EC_gen("P-256"));
  must(key != nullptr, "make a key");
  return key;
}

std::string pem_of(const Key& key) {
  const Bio bio = memory();
  must(PEM_write_bio_PrivateKey(bio.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) == 1, "write a key");
  return text_of(bio);
}

std::string pem_of(const X509Certificate& certificate) {
  const Bio bio = memory();
  must(PEM_write_bio_X509(bio.get(), certificate.get()) == 1, "write a certificate");
  return text_of(bio);
}

void add_extension(X509* certificate, X509* issuer, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const X509Extension extension(X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str()));
  must(extension && X509_add_ext(certificate, extension.get(), -1) == 1, "add an extension");
}

X509Certificate new_certificate(const std::string& common_name, const Key& key, int days) {
  X509Certificate certificate(X509_new());
  must(certificate != nullptr, "make a certificate");
  X509* raw = certificate.get();
  std::array<unsigned char, 16> serial{};
  must(RAND_bytes(serial.data(), static_cast<int>(serial.size())) == 1, "make a serial number");
  serial[0] = static_cast<unsigned char>((serial[0] & 0x3f) | 0x40);  // positive, and of full length
  const std::unique_ptr<BIGNUM, Freed<BN_free>> number(BN_bin2bn(serial.data(), serial.size(), nullptr));
  must(X509_set_version(raw, X509_VERSION_3) == 1 && BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(raw)) &&
           X509_gmtime_adj(X509_getm_notBefore(raw), -kClockSkew) &&
           X509_gmtime_adj(X509_getm_notAfter(raw), days * kSecondsOfADay) && X509_set_pubkey(raw, key.get()) == 1 &&
           X509_NAME_add_entry_by_txt(X509_get_subject_name(raw), "CN", MBSTRING_UTF8,
                                      reinterpret_cast<const unsigned char*>(common_name.data()),
                                      static_cast<int>(common_name.size()), -1, 0) == 1,
       "fill in a certificate");
  return certificate;
}

bool is_address(const std::string& host) {
  std::array<unsigned char, 16> bytes{};
  return inet_pton(AF_INET, host.c_str(), bytes.data()) == 1 || inet_pton(AF_INET6, host.c_str(), bytes.data()) == 1;
}

std::string alternative_names(const CertificateWish& wish) {
  std::string names;
  const auto add = [&](const std::string& name) { names += (names.empty() ? "" : ",") + name; };
  for (const std::string& host : wish.hosts) add((is_address(host) ? "IP:" : "DNS:") + host);
  if (wish.principal) add("URI:" + uri_of(*wish.principal));
  return names;
}

std::string_view bytes_of(const ASN1_STRING* text) {
  return {reinterpret_cast<const char*>(ASN1_STRING_get0_data(text)),
          static_cast<std::size_t>(ASN1_STRING_length(text))};
}

std::string address_text(std::string_view bytes) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  inet_ntop(bytes.size() == 4 ? AF_INET : AF_INET6, bytes.data(), text.data(), text.size());
  return text.data();
}

// Fills in what the subject's alternative names say.
void read_names(const X509Certificate& certificate, CertificateFacts& facts) {
  const std::unique_ptr<GENERAL_NAMES, Freed<GENERAL_NAMES_free>> names(
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate.get(), NID_subject_alt_name, nullptr, nullptr)));
  for (int i = 0; names && i < sk_GENERAL_NAME_num(names.get()); ++i) {
    const GENERAL_NAME* name = sk_GENERAL_NAME_value(names.get(), i);
    if (name->type == GEN_DNS) facts.hosts.emplace_back(bytes_of(name->d.dNSName));
    if (const auto bytes = name->type == GEN_IPADD ? bytes_of(name->d.iPAddress) : std::string_view();
        bytes.size() == 4 || bytes.size() == 16)
      facts.hosts.push_back(address_text(bytes));
    if (name->type == GEN_URI && !facts.principal)
      facts.principal = principal_of(bytes_of(name->d.uniformResourceIdentifier));
  }
}

}  // namespace

KeyPair new_authority(const std::string& common_name, int days) {
  const Key key = new_key();
  const X509Certificate certificate = new_certificate(common_name, key, days);
  X509* raw = certificate.get();
  must(X509_set_issuer_name(raw, X509_get_subject_name(raw)) == 1, "name the issuer");
  add_extension(raw, raw, NID_basic_constraints, "critical,CA:TRUE,pathlen:0");
  add_extension(raw, raw, NID_key_usage, "critical,keyCertSign,cRLSign");
  add_extension(raw, raw, NID_subject_key_identifier, "hash");
  must(X509_sign(raw, key.get(), EVP_sha256()) > 0, "sign a certificate");
  return {pem_of(certificate), pem_of(key)};
}

Result<KeyPair> issue(const KeyPair& authority, const CertificateWish& wish) {
  if (Status sound = check_key_pair(authority); !sound.ok())
    return Status(sound.reason(), "the authority: " + sound.message());
  const X509Certificate issuer = next_certificate(reader_of(authority.certificate));
  const Key issuer_key = first_key(authority.key);
  const Key key = new_key();
  const X509Certificate certificate = new_certificate(wish.common_name, key, wish.days);
  X509* raw = certificate.get();
  must(X509_set_issuer_name(raw, X509_get_subject_name(issuer.get())) == 1, "name the issuer");
  add_extension(raw, issuer.get(), NID_basic_constraints, "critical,CA:FALSE");
  add_extension(raw, issuer.get(), NID_key_usage, "critical,digitalSignature");
  add_extension(raw, issuer.get(), NID_ext_key_usage, wish.principal ? "clientAuth" : "serverAuth");
  add_extension(raw, issuer.get(), NID_authority_key_identifier, "keyid");
  add_extension(raw, issuer.get(), NID_subject_alt_name, alternative_names(wish));
  must(X509_sign(raw, issuer_key.get(), EVP_sha256()) > 0, "sign a certificate");
  return KeyPair{pem_of(certificate), pem_of(key)};
}

Result<CertificateFacts> read_certificate(std::string_view pem) {
  const X509Certificate certificate = next_certificate(reader_of(pem));
  if (!certificate) return Status(Reason::CORRUPT, "there is no certificate in PEM");
  CertificateFacts facts;
  read_names(certificate, facts);
  unsigned char* der = nullptr;
  const int size = i2d_X509(certificate.get(), &der);
  must(size > 0, "encode a certificate");
  const std::unique_ptr<unsigned char, Freed<[](unsigned char* bytes) { OPENSSL_free(bytes); }>> owned(der);
  facts.hash = sha256({reinterpret_cast<const char*>(der), static_cast<std::size_t>(size)});
  std::tm utc{};
  if (ASN1_TIME_to_tm(X509_get0_notAfter(certificate.get()), &utc) == 1) facts.expires_s = timegm(&utc);
  return facts;
}

Status check_key_pair(const KeyPair& pair) {
  const X509Certificate certificate = next_certificate(reader_of(pair.certificate));
  if (!certificate) return {Reason::CORRUPT, "there is no certificate in PEM"};
  const Key key = first_key(pair.key);
  if (!key) return {Reason::CORRUPT, "there is no private key in PEM, or it has a password"};
  const bool fits = X509_check_private_key(certificate.get(), key.get()) == 1;
  ERR_clear_error();
  return fits ? Status() : Status(Reason::CORRUPT, "the key is not that of the certificate");
}

}  // namespace relmap::access
