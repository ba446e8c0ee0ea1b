#include "server/rpc/gatekeeper.h"

#include <sys/stat.h>

#include <utility>

#include "proto/access/token.h"
#include "proto/base/clock.h"

namespace relmap::rpc {

namespace {

constexpr std::size_t kMaxSeen = 4096;  // certificates whose facts are kept

std::int64_t now_s() { return now_us() / 1'000'000; }

Status refused(const std::string& why) { return {Reason::UNAUTHENTICATED, why}; }

}  // namespace

Gatekeeper::Stamp Gatekeeper::stamp() const {
  struct stat facts {};
  if (stat(file_.c_str(), &facts) != 0) return {};
  return {facts.st_mtim.tv_sec * 1'000'000'000 + facts.st_mtim.tv_nsec, facts.st_size, facts.st_ino};
}

Status Gatekeeper::reload() {
  if (file_.empty()) return {};
  const Stamp before = stamp();  // if the file changes while it is read, it is read again next time
  auto list = access::read_access_list(file_);
  const MutexLock lock(mutex_);
  problem_ = list.status();
  if (!list.ok()) return list.status();
  read_ = before;
  list_ = std::make_shared<const access::AccessList>(std::move(*list));
  ++version_;
  return {};
}

Status Gatekeeper::reload_if_changed() {
  if (file_.empty()) return {};
  const Stamp present = stamp();
  {
    const MutexLock lock(mutex_);
    if (present == read_) return {};
  }
  return reload();
}

Result<access::CertificateFacts> Gatekeeper::facts_of(std::string_view pem) const {
  {
    const MutexLock lock(mutex_);
    if (const auto known = seen_.find(pem); known != seen_.end()) return known->second;
  }
  auto facts = access::read_certificate(pem);
  if (!facts.ok()) return facts;
  const MutexLock lock(mutex_);
  if (seen_.size() >= kMaxSeen) seen_.clear();
  seen_.emplace(pem, *facts);
  return facts;
}

Result<Identity> Gatekeeper::identify(const Evidence& evidence) const {
  std::shared_ptr<const access::AccessList> list;
  Identity identity;
  {
    const MutexLock lock(mutex_);
    list = list_;
    identity.version = version_;
  }
  if (evidence.way == Evidence::Way::kSocket || (evidence.way == Evidence::Way::kOpen && open_)) {
    identity.name = evidence.way == Evidence::Way::kSocket ? access::kLocalName : access::kAnonymousName;
    identity.role = Role::kOperator;
    return identity;
  }
  if (evidence.way == Evidence::Way::kOpen) return refused("this connection has no TLS");
  const auto as = [&](const access::Principal& principal, std::int64_t expires_s) -> Result<Identity> {
    identity.name = principal.name;
    identity.role = principal.role;
    identity.expires_s = expires_s;
    if (expires_s <= now_s())
      return refused("the credentials of " + principal.name + " expired at " + access::time_text(expires_s));
    return identity;
  };
  if (!evidence.token.empty()) {
    const access::Grant* grant = list->find(access::Grant::Kind::kToken, access::sha256(evidence.token));
    if (!grant) return refused("the token is unknown");
    if (grant->revoked) return refused("the token of " + grant->principal.name + " was revoked");
    return as(grant->principal, grant->expires_s);
  }
  if (evidence.certificate.empty()) return refused("neither a certificate nor a token was shown");
  const auto facts = facts_of(evidence.certificate);
  if (!facts.ok()) return refused("the certificate cannot be read");
  if (!facts->principal)
    return refused("the certificate has no name of the form relmap:ROLE:NAME, or one that is not for credentials");
  const access::Grant* grant = list->find(access::Grant::Kind::kCertificate, facts->hash);
  if (grant && grant->revoked) return refused("the certificate of " + facts->principal->name + " was revoked");
  return as(*facts->principal, facts->expires_s);
}

bool Gatekeeper::is_current(const Identity& identity) const {
  return identity.version == version() && now_s() < identity.expires_s;
}

}  // namespace relmap::rpc
