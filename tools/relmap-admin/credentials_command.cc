// credentials ca, new, list and revoke: a folder with the authority of a fleet, the daemon's certificate, the secret of
// the robots' keys, and the list of what was issued.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>
#include <utility>
#include <vector>

#include "proto/access/access_list.h"
#include "proto/access/certificate.h"
#include "proto/access/credentials.h"
#include "proto/access/datagram_seal.h"
#include "proto/access/file.h"
#include "proto/access/token.h"
#include "proto/base/clock.h"
#include "proto/base/hex.h"
#include "tools/relmap-admin/commands.h"

namespace relmap::admin {

namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kSecondsOfADay = 86'400;
constexpr int kDays = 365, kAuthorityDays = 3650, kMaxDays = 36'500;

std::int64_t now_s() { return now_us() / 1'000'000; }

// The files of the folder that relmapd's --credentials names.
struct Files {
  explicit Files(const std::string& folder)
      : authority(folder + "/ca.crt"),
        authority_key(folder + "/ca.key"),
        server(folder + "/server.pem"),
        access(folder + "/access"),
        secret(folder + "/lcm.key") {}
  const std::string authority, authority_key;
  const std::string server;  // the daemon's key and certificate, in one file, so that both change at a time
  const std::string access;
  const std::string secret;  // of the robots' keys for LCM
};

Result<access::KeyPair> read_authority(const Files& files) {
  auto certificate = access::read_file(files.authority), key = access::read_private_file(files.authority_key);
  if (!certificate.ok()) return certificate.status();
  if (!key.ok()) return key.status();
  return access::KeyPair{std::move(*certificate), std::move(*key)};
}

Status make_private_folder(const std::string& folder) {
  std::error_code error;
  if (fs::is_directory(folder, error)) return {};
  // Whoever the daemon runs as has to get through the folders above, whatever the umask.
  std::vector<fs::path> above;
  fs::path one = fs::absolute(folder).lexically_normal();
  if (!one.has_filename()) one = one.parent_path();  // without the slash at its end
  while ((one = one.parent_path(), !fs::exists(one, error))) above.push_back(one);
  fs::create_directories(folder, error);
  if (!error) fs::permissions(folder, fs::perms::owner_all, error);
  using fs::perms;
  constexpr perms kOpen =
      perms::owner_all | perms::group_read | perms::group_exec | perms::others_read | perms::others_exec;
  for (const fs::path& path : above)
    if (!error) fs::permissions(path, kOpen, error);
  if (error) return {Reason::IO_ERROR, "cannot make " + folder + ": " + error.message()};
  return {};
}

// NO_SUCH_FILE unless credentials ca has made the folder.
Status check_made(const Files& files, const std::string& folder) {
  if (fs::exists(files.access)) return {};
  return {Reason::NO_SUCH_FILE,
          "there is no " + files.access + "; relmap-admin credentials ca " + folder + " makes it"};
}

struct CaOptions {
  std::string folder;
  std::vector<std::string> hosts;
  int days = kDays;
};

// The names by which this machine is reached.
std::vector<std::string> own_hosts() {
  std::vector<std::string> hosts{"localhost", "127.0.0.1", "::1"};
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) == 0 && name[0] != 0) hosts.emplace_back(name.data());
  return hosts;
}

Status write_all(const std::vector<std::pair<std::string, std::string>>& files) {
  for (const auto& [path, text] : files)
    if (Status written = access::write_private_file(path, text); !written.ok()) return written;
  return {};
}

// Makes the authority if there is none, and a new certificate of the daemon, which keeps the names of the former.
Answer make_authority(const CaOptions& options, Context& context) {
  const Files files(options.folder);
  if (Status made = make_private_folder(options.folder); !made.ok()) return {made, false, {}};
  const auto turn = access::FolderTurn::take(options.folder);
  if (!turn.ok()) return {turn.status(), false, {}};
  const bool fresh = !fs::exists(files.authority_key);
  if (fresh && (fs::exists(files.access) || fs::exists(files.server)))
    return {Status(Reason::NO_SUCH_FILE, "there is no " + files.authority_key +
                                             ", with which the other files of this folder were made; a new authority "
                                             "would shut everybody out, so it needs a new folder"),
            false,
            {}};
  if (fresh) {
    // The key last, since with it the authority counts as made.
    const access::KeyPair authority = access::new_authority("relmap fleet", kAuthorityDays);
    if (Status written = write_all({{files.authority, authority.certificate}, {files.authority_key, authority.key}});
        !written.ok())
      return {written, false, {}};
  }
  if (!fs::exists(files.access))
    if (Status written = write_all({{files.access, access::AccessList().text()}}); !written.ok())
      return {written, false, {}};
  if (!fs::exists(files.secret))
    if (Status written = write_all({{files.secret, hex(access::random_key()) + "\n"}}); !written.ok())
      return {written, false, {}};
  const auto authority = read_authority(files);
  if (!authority.ok()) return {authority.status(), false, {}};
  access::CertificateWish wish;
  wish.common_name = "relmapd";
  if (fs::exists(files.server)) {
    const auto former = access::read_file(files.server);
    const auto facts = former.ok() ? access::read_certificate(*former) : former.status();
    if (!facts.ok()) return {facts.status(), false, {}};
    wish.hosts = facts->hosts;
  } else {
    wish.hosts = own_hosts();
  }
  for (const std::string& host : options.hosts)
    if (std::find(wish.hosts.begin(), wish.hosts.end(), host) == wish.hosts.end()) wish.hosts.push_back(host);
  wish.days = options.days;
  const auto server = access::issue(*authority, wish);
  if (!server.ok()) return {server.status(), false, {}};
  if (Status written = write_all({{files.server, server->key + server->certificate}}); !written.ok())
    return {written, false, {}};
  std::string hosts;
  for (const std::string& host : wish.hosts) hosts += (hosts.empty() ? "" : ", ") + host;
  if (fresh) context.say("a new authority: keep " + files.authority_key + " secret; whoever has it can let anyone in");
  context.say("the daemon's certificate is for " + hosts + ", and expires in " + std::to_string(options.days) +
              " days");
  context.say("start it with: relmapd --data DIR --listen 0.0.0.0:50070 --credentials " + options.folder);
  Answer answer;
  answer.json.add("folder", options.folder).add("new_authority", fresh).add("hosts", wish.hosts);
  answer.json.add("expires", access::time_text(now_s() + options.days * kSecondsOfADay));
  return answer;
}

struct NewOptions {
  std::string folder, name, role, out;
  int days = kDays;
  bool token = false;
};

Answer make_credentials(const NewOptions& options, Context& context) {
  if (Status name = access::check_principal_name(options.name); !name.ok()) return {name, false, {}};
  if (options.out.empty() && (options.name.find('/') != std::string::npos || options.name.front() == '.'))
    return {Status(Reason::INVALID_ARGUMENT, "'" + options.name + "' is no name for a file; --out FILE gives one"),
            false,
            {}};
  const Files files(options.folder);
  if (Status made = check_made(files, options.folder); !made.ok()) return {made, false, {}};
  const auto turn = access::FolderTurn::take(options.folder);
  if (!turn.ok()) return {turn.status(), false, {}};
  auto list = access::read_access_list(files.access);
  if (!list.ok()) return {list.status(), false, {}};
  const auto authority_certificate = access::read_file(files.authority);
  if (!authority_certificate.ok()) return {authority_certificate.status(), false, {}};

  access::Grant grant;
  grant.principal = {access::role_of(options.role).value(), options.name};
  grant.expires_s = now_s() + options.days * kSecondsOfADay;
  access::Credentials credentials;
  credentials.authorities = *authority_certificate;
  if (options.token) {
    credentials.token = access::new_token();
    grant.kind = access::Grant::Kind::kToken;
    grant.hash = access::sha256(credentials.token);
  } else {
    if (!fs::exists(files.authority_key))
      return {Status(Reason::NO_SUCH_FILE, "there is no " + files.authority_key +
                                               ": certificates are issued where the authority's key is kept (tokens "
                                               "need none)"),
              false,
              {}};
    const auto authority = read_authority(files);
    if (!authority.ok()) return {authority.status(), false, {}};
    const auto issued = access::issue(*authority, {options.name, {}, grant.principal, options.days});
    if (!issued.ok()) return {issued.status(), false, {}};
    credentials.certificate = issued->certificate;
    credentials.key = issued->key;
    grant.kind = access::Grant::Kind::kCertificate;
    grant.hash = access::read_certificate(issued->certificate).or_throw().hash;
  }
  std::optional<access::Grant> key;
  if (grant.principal.role == access::Role::kRobot && fs::exists(files.secret)) {
    const auto secret = access::read_secret(files.secret);
    if (!secret.ok()) return {secret.status(), false, {}};
    const access::SealKey drawn = access::random_key();
    credentials.robot_key = access::robot_key(*secret, drawn);
    key = grant;
    key->kind = access::Grant::Kind::kKey;
    key->hash = hex(drawn);
  }
  const std::string out = options.out.empty() ? options.name + ".pem" : options.out;
  if (fs::exists(out))
    return {Status(Reason::INVALID_ARGUMENT, out + " exists already; --out names another file"), false, {}};
  // The list first, so that nothing is in use that cannot be revoked.
  const std::string former = list->text();
  list->add(grant);
  if (key) list->add(*key);
  if (Status written = write_all({{files.access, list->text()}, {out, access::text_of(credentials)}}); !written.ok()) {
    (void)write_all({{files.access, former}});  // nobody has them
    return {written, false, {}};
  }
  context.say(options.role + " " + options.name + " may call with " + out + ", a second from now and until " +
              access::time_text(grant.expires_s));
  if (grant.principal.role == access::Role::kRobot && !key)
    context.say("it has no key for LCM: credentials ca makes the secret that keys need");
  context.say("bring it there by a safe way, and use it with --credentials " + out);
  Answer answer;
  answer.json.add("file", out)
      .add("kind", access::kind_name(grant.kind))
      .add("lcm_key", key.has_value())
      .add("role", options.role)
      .add("name", options.name)
      .add("expires", access::time_text(grant.expires_s));
  return answer;
}

std::string state_of(const access::Grant& grant) {
  return grant.revoked ? "revoked" : grant.expires_s <= now_s() ? "expired" : "valid";
}

Answer list_credentials(const std::string& folder, Context& context) {
  const Files files(folder);
  if (Status made = check_made(files, folder); !made.ok()) return {made, false, {}};
  const auto list = access::read_access_list(files.access);
  if (!list.ok()) return {list.status(), false, {}};
  std::vector<Json> all;
  for (const access::Grant& grant : list->grants()) {
    const std::string expires = access::time_text(grant.expires_s);
    if (!context.console.json)
      context.console.out() << access::role_name(grant.principal.role) << '\t' << access::kind_name(grant.kind) << '\t'
                            << state_of(grant) << '\t' << expires << '\t' << grant.principal.name << '\n';
    all.push_back(Json()
                      .add("role", access::role_name(grant.principal.role))
                      .add("name", grant.principal.name)
                      .add("kind", access::kind_name(grant.kind))
                      .add("state", state_of(grant))
                      .add("expires", expires));
  }
  Answer answer;
  answer.json.add("credentials", all);
  return answer;
}

Answer revoke_credentials(const std::string& folder, const std::string& name, Context& context) {
  const Files files(folder);
  if (Status made = check_made(files, folder); !made.ok()) return {made, false, {}};
  const auto turn = access::FolderTurn::take(folder);
  if (!turn.ok()) return {turn.status(), false, {}};
  auto list = access::read_access_list(files.access);
  if (!list.ok()) return {list.status(), false, {}};
  const std::size_t count = list->revoke(name);
  if (count == 0) {
    const bool known = std::any_of(list->grants().begin(), list->grants().end(),
                                   [&](const access::Grant& grant) { return grant.principal.name == name; });
    return {Status(Reason::INVALID_ARGUMENT,
                   known ? "all that was issued to " + name + " was revoked before" : "nothing was issued to " + name),
            false,
            {}};
  }
  if (Status written = access::write_private_file(files.access, list->text()); !written.ok())
    return {written, false, {}};
  context.say(name + " may not call any more; a daemon that uses " + files.access + " knows within a second");
  Answer answer;
  answer.json.add("name", name).add("revoked", count);
  return answer;
}

}  // namespace

void add_credentials(CLI::App& app, Action& action) {
  auto* all = app.add_subcommand("credentials", "make, list and revoke what lets robots and operators in");
  all->require_subcommand(1);
  const auto days = [](CLI::App* command, int& value) {
    command->add_option("--days", value, "days until it expires")
        ->check(CLI::Range(1, kMaxDays))
        ->capture_default_str();
  };

  auto ca_options = std::make_shared<CaOptions>();
  auto* ca = all->add_subcommand(
      "ca", "make the authority of a fleet, unless it is there, and a new certificate for the daemon");
  ca->add_option("FOLDER", ca_options->folder, "where everything is kept")->type_name("FOLDER")->required();
  ca->add_option(
        "--host", ca_options->hosts,
        "names and addresses by which callers reach the daemon, besides localhost, this machine's name, and those "
        "of the certificate that is renewed")
      ->type_name("HOST");
  days(ca, ca_options->days);
  ca->footer("Example:\n  relmap-admin credentials ca /etc/relmap/credentials --host map.example");
  ca->callback([&action, ca_options] {
    action = [ca_options](Context& context) { return make_authority(*ca_options, context); };
  });

  auto new_options = std::make_shared<NewOptions>();
  auto* fresh = all->add_subcommand("new", "issue a certificate, or a token, to a robot, an operator or a reader");
  fresh->add_option("FOLDER", new_options->folder, "made by credentials ca")->type_name("FOLDER")->required();
  fresh->add_option("NAME", new_options->name, "of a robot: as its keyframes have it, and it may send no others")
      ->required();
  fresh->add_option("--role", new_options->role, "reader (asks), robot (also sends keyframes), operator (also edits)")
      ->required()
      ->check(CLI::IsMember({"reader", "robot", "operator"}));
  fresh->add_option("--out", new_options->out, "the file to write (default: NAME.pem)")->type_name("FILE");
  days(fresh, new_options->days);
  fresh->add_flag("--token", new_options->token, "a token instead of a certificate");
  fresh->footer(
      "Examples:\n"
      "  relmap-admin credentials new /etc/relmap/credentials cart-1 --role robot\n"
      "  relmap-admin credentials new /etc/relmap/credentials dashboard --role reader --token");
  fresh->callback([&action, new_options] {
    action = [new_options](Context& context) { return make_credentials(*new_options, context); };
  });

  auto folder = std::make_shared<std::string>();
  auto* list = all->add_subcommand("list", "show what was issued: role, kind, state, expiry, name");
  list->add_option("FOLDER", *folder, "made by credentials ca")->type_name("FOLDER")->required();
  list->footer("Example:\n  relmap-admin credentials list /etc/relmap/credentials");
  list->callback(
      [&action, folder] { action = [folder](Context& context) { return list_credentials(*folder, context); }; });

  auto name = std::make_shared<std::string>();
  auto* revoke = all->add_subcommand("revoke", "let a name in no more, at once");
  revoke->add_option("FOLDER", *folder, "made by credentials ca")->type_name("FOLDER")->required();
  revoke->add_option("NAME", *name, "as it was issued")->required();
  revoke->footer("Example:\n  relmap-admin credentials revoke /etc/relmap/credentials cart-1");
  revoke->callback([&action, folder, name] {
    action = [folder, name](Context& context) { return revoke_credentials(*folder, *name, context); };
  });
  all->footer(R"(
Examples:
  relmap-admin credentials ca /etc/relmap/credentials --host map.example
  relmap-admin credentials new /etc/relmap/credentials cart-1 --role robot
  relmap-admin credentials new /etc/relmap/credentials dashboard --role reader --token
  relmap-admin credentials list /etc/relmap/credentials
  relmap-admin credentials revoke /etc/relmap/credentials cart-1)");
}

}  // namespace relmap::admin
