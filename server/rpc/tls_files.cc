#include "server/rpc/tls_files.h"

#include <sys/stat.h>

#include "proto/access/access_list.h"
#include "proto/access/certificate.h"
#include "proto/access/file.h"

namespace relmap::rpc {

namespace {

constexpr std::int64_t kSoon_s = std::int64_t{14} * 86'400;

}  // namespace

Status check_files(const TlsFiles& files) {
  if (files.certificate.empty()) return {};
  const auto certificate = access::read_file(files.certificate), key = access::read_file(files.key);
  for (const auto* text : {&certificate, &key})
    if (!text->ok()) return {Reason::BAD_CONFIG, text->status().message()};
  struct stat file {};
  if (stat(files.key.c_str(), &file) == 0 && (file.st_mode & S_IRWXO) != 0)
    return {Reason::BAD_CONFIG, "others can read " + files.key + ": chmod o= " + files.key};
  if (const Status fits = access::check_key_pair({*certificate, *key}); !fits.ok())
    return {Reason::BAD_CONFIG, files.certificate + " with " + files.key + ": " + fits.message()};
  if (files.client_authority.empty()) return {};
  const auto authority = access::read_file(files.client_authority);
  if (!authority.ok()) return {Reason::BAD_CONFIG, authority.status().message()};
  if (const auto facts = access::read_certificate(*authority); !facts.ok())
    return {Reason::BAD_CONFIG, files.client_authority + ": " + facts.status().message()};
  return {};
}

Status tls_state(const TlsFiles& files, std::int64_t utc_s) {
  if (Status sound = check_files(files); !sound.ok() || files.certificate.empty()) return sound;
  const auto certificate = access::read_file(files.certificate);
  const auto facts = certificate.ok() ? access::read_certificate(*certificate) : certificate.status();
  if (!facts.ok()) return {Reason::BAD_CONFIG, files.certificate + ": " + facts.status().message()};
  if (facts->expires_s > utc_s + kSoon_s) return {};
  const bool expired = facts->expires_s <= utc_s;
  return {Reason::BAD_CONFIG, files.certificate + (expired ? " expired at " : " expires at ") +
                                  access::time_text(facts->expires_s) +
                                  (expired ? ", and nobody can call over TLS" : "") +
                                  ": relmap-admin credentials ca FOLDER makes a new one"};
}

}  // namespace relmap::rpc
