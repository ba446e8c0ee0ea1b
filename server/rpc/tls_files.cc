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
  for (const std::string& path : {files.certificate, files.client_authority}) {
    if (path.empty()) continue;
    const auto text = access::read_file(path);
    const auto facts = text.ok() ? access::read_certificate(*text) : text.status();
    if (!facts.ok()) return {Reason::BAD_CONFIG, path + ": " + facts.status().message()};
    if (facts->expires_s > utc_s + kSoon_s) continue;
    const bool expired = facts->expires_s <= utc_s;
    return {Reason::BAD_CONFIG, path + (expired ? " expired at " : " expires at ") +
                                    access::time_text(facts->expires_s) +
                                    (expired ? ", and nobody can call over TLS" : "") +
                                    "; what relmap-admin credentials ca made, it also renews"};
  }
  return {};
}

Status TlsWatch::look(std::int64_t utc_s) {
  const Status state = tls_state(files_, utc_s);
  const MutexLock lock(mutex_);
  return state_ = state;
}

Status TlsWatch::state() const {
  const MutexLock lock(mutex_);
  return state_;
}

}  // namespace relmap::rpc
