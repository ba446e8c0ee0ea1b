// The credentials of a fleet in a folder of their own, as relmap-admin credentials makes them.
#pragma once

#include <fstream>
#include <string>

#include "proto/access/access_list.h"
#include "proto/access/certificate.h"
#include "proto/access/credentials.h"
#include "proto/access/file.h"
#include "proto/access/token.h"
#include "server/rpc/server.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::rpc {

class FleetCredentials {
 public:
  FleetCredentials() {
    const auto server = access::issue(authority_, {"relmapd", {"localhost", "127.0.0.1"}, {}, 1}).or_throw();
    write("ca.crt", authority_.certificate);
    write("server.pem", server.key + server.certificate);
    write_list();
  }

  std::string file(const std::string& name) const { return folder_ / name; }
  TlsFiles tls() const { return {file("server.pem"), file("server.pem"), file("ca.crt")}; }
  const access::KeyPair& authority() const { return authority_; }

  // A new certificate; listed, so that it can be revoked.
  access::Credentials certificate(Role role, const std::string& name) {
    const auto pair = access::issue(authority_, {name, {}, access::Principal{role, name}, 1}).or_throw();
    const auto facts = access::read_certificate(pair.certificate).or_throw();
    add({access::Grant::Kind::kCertificate, facts.hash, {role, name}, facts.expires_s, false});
    return {authority_.certificate, pair.certificate, pair.key, ""};
  }
  access::Credentials token(Role role, const std::string& name, std::int64_t expires_s = INT32_MAX) {
    const std::string token = access::new_token();
    add({access::Grant::Kind::kToken, access::sha256(token), {role, name}, expires_s, false});
    return {authority_.certificate, "", "", token};
  }
  void revoke(const std::string& name) {
    list_.revoke(name);
    write_list();
  }
  void write(const std::string& name, const std::string& text) const {
    if (const Status written = access::write_private_file(file(name), text); !written.ok()) throw StatusError(written);
  }

 private:
  void add(access::Grant grant) {
    list_.add(std::move(grant));
    write_list();
  }
  void write_list() const { write("access", list_.text()); }

  const storage::TemporaryFolder folder_;
  const access::KeyPair authority_ = access::new_authority("fleet", 1);
  access::AccessList list_;
};

}  // namespace relmap::rpc
