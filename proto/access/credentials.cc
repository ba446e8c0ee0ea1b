#include "proto/access/credentials.h"

#include <algorithm>

#include "proto/access/certificate.h"
#include "proto/access/file.h"
#include "proto/access/openssl.h"

namespace relmap::access {

namespace {

constexpr char kTokenBlock[] = "RELMAP TOKEN";
constexpr char kRobotKeyBlock[] = "RELMAP KEY";
constexpr std::string_view kCertificateBlock = "CERTIFICATE";

std::string block(const std::string& name, const unsigned char* bytes, long size) {
  const Bio bio = memory();
  return PEM_write_bio(bio.get(), name.c_str(), "", bytes, size) > 0 ? text_of(bio) : std::string();
}

bool read_robot_key(ByteSpan bytes, std::optional<RobotKey>& key) {
  RobotKey& read = key.emplace();
  if (bytes.size() != read.id.size() + read.key.size()) return false;
  std::copy_n(bytes.begin(), read.id.size(), read.id.begin());
  std::copy_n(bytes.begin() + read.id.size(), read.key.size(), read.key.begin());
  return true;
}

}  // namespace

std::string text_of(const Credentials& credentials) {
  std::string text = credentials.key + credentials.certificate;
  if (!credentials.token.empty())
    text += block(kTokenBlock, reinterpret_cast<const unsigned char*>(credentials.token.data()),
                  static_cast<long>(credentials.token.size()));
  if (credentials.robot_key) {
    Bytes bytes(credentials.robot_key->id.begin(), credentials.robot_key->id.end());
    bytes.insert(bytes.end(), credentials.robot_key->key.begin(), credentials.robot_key->key.end());
    text += block(kRobotKeyBlock, bytes.data(), static_cast<long>(bytes.size()));
  }
  return text + credentials.authorities;
}

Result<Credentials> parse_credentials(std::string_view text) {
  const auto bad = [](const std::string& what) { return Status(Reason::CORRUPT, what); };
  Credentials found;
  const Bio bio = reader_of(text);
  char *name = nullptr, *header = nullptr;
  unsigned char* bytes = nullptr;
  long size = 0;
  bool key_is_whole = true;
  while (PEM_read_bio(bio.get(), &name, &header, &bytes, &size) == 1) {
    const std::string kind = name;
    if (kind == kTokenBlock)
      found.token.assign(reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(size));
    else if (kind == kRobotKeyBlock)
      key_is_whole &= read_robot_key({bytes, static_cast<std::size_t>(size)}, found.robot_key);
    else if (kind.ends_with("PRIVATE KEY"))
      found.key = block(kind, bytes, size);
    else if (kind == kCertificateBlock)
      (found.key.empty() || !found.certificate.empty() ? found.authorities : found.certificate) +=
          block(kind, bytes, size);
    OPENSSL_free(name);
    OPENSSL_free(header);
    OPENSSL_free(bytes);
  }
  ERR_clear_error();
  if (!key_is_whole) return bad("a robot's key has 40 bytes");
  if (found.key.empty() == found.token.empty())
    return bad(found.key.empty() ? "there is neither a private key nor a token"
                                 : "there are a private key and a token");
  if (!found.key.empty()) {
    if (Status fits = check_key_pair({found.certificate, found.key}); !fits.ok())
      return bad("the certificate after the private key: " + fits.message());
  }
  if (found.authorities.empty()) return bad("there is no certificate of the authority that issued the daemon's");
  return found;
}

Result<Credentials> read_credentials(const std::string& path) {
  const auto text = read_private_file(path);
  if (!text.ok()) return text.status();
  auto credentials = parse_credentials(*text);
  if (!credentials.ok()) return Status(Reason::BAD_CONFIG, path + ": " + credentials.status().message());
  return credentials;
}

Result<std::string> read_authorities(const std::string& path) {
  const auto text = read_file(path);
  if (!text.ok()) return text.status();
  std::string authorities;
  bool has_key = false;
  const Bio bio = reader_of(*text);
  char *name = nullptr, *header = nullptr;
  unsigned char* bytes = nullptr;
  long size = 0;
  while (PEM_read_bio(bio.get(), &name, &header, &bytes, &size) == 1) {
    const std::string_view kind = name;
    has_key = has_key || kind.ends_with("PRIVATE KEY");
    if (kind == kCertificateBlock) authorities += block(std::string(kind), bytes, size);
    OPENSSL_free(name);
    OPENSSL_free(header);
    OPENSSL_free(bytes);
  }
  ERR_clear_error();
  if (has_key)
    return Status(Reason::BAD_CONFIG, path +
                                          " has a private key, with which all callers would be taken for its owner: " +
                                          "give ca.crt, the certificate of the authority, instead");
  if (authorities.empty()) return Status(Reason::BAD_CONFIG, path + " has no certificate of an authority");
  return authorities;
}

}  // namespace relmap::access
