// A fleet's credentials from relmap-admin to the daemon's answer, with the programs themselves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"
#include "tests/support/simulated_recording.h"

namespace relmap::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class CredentialsTest : public ::testing::Test {
 protected:
  CredentialsTest() { expect_done(admin({"credentials", "ca", folder_ / "fleet"})); }

  static Finished program(const std::string& name, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), built_program(name));
    return run_program(arguments);
  }
  static Finished admin(const std::vector<std::string>& arguments) { return program("relmap-admin", arguments); }
  static void expect_done(const Finished& finished) { ASSERT_EQ(finished.exit_code, 0) << finished.standard_error; }

  // The file of new credentials.
  std::string issue(const std::string& role, const std::string& name, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"credentials", "new", folder_ / "fleet", name,
                                       "--role",      role,  "--out",           folder_ / (name + ".pem")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    expect_done(admin(arguments));
    return folder_ / (name + ".pem");
  }
  DaemonOptions served() const {
    DaemonOptions options{.data = folder_ / "map", .lcm = "", .more = {}};
    options.credentials = folder_ / "fleet";
    return options;
  }

  const storage::TemporaryFolder folder_;
};

TEST_F(CredentialsTest, LetEachDoWhatItsRoleMayUntilTheyAreRevoked) {
  const std::string cart = issue("robot", "cart"), anna = issue("operator", "anna"),
                    dash = issue("reader", "dash", {"--token"});
  record_simulation(folder_ / "drive", {"--seed", "1", "--pairs", "12", "--laps", "0.1"});
  RunningDaemon daemon(served());
  const auto relmap = [&](const std::string& credentials, std::vector<std::string> command) {
    command.insert(command.begin(), {"--server", daemon.address(), "--credentials", credentials});
    return program("relmap", command);
  };
  const auto stream = [&](const std::string& robot, const std::string& credentials) {
    return program("relmap-frontend", {folder_ / "drive", "--robot", robot, "--server", daemon.address(), "--spool",
                                       "none", "--quiet", "--patience", "2", "--credentials", credentials});
  };
  expect_done(stream("cart", cart));
  const Finished as_another = stream("train", cart);
  EXPECT_EQ(as_another.exit_code, 1) << "at once";
  EXPECT_THAT(as_another.standard_error, HasSubstr("is for the robot cart, and this is the robot train (--robot)"));
  // A token does not say whose it is; the daemon does.
  const Finished by_token = stream("train", issue("robot", "tram", {"--token"}));
  EXPECT_EQ(by_token.exit_code, 3);  // keyframes are left
  EXPECT_THAT(by_token.standard_error,
              AllOf(HasSubstr("NOT_ALLOWED"), HasSubstr("tram may not send keyframes as train")));
  EXPECT_NE(stream("dash", dash).exit_code, 0) << "a reader sends no keyframes";
  // Whose own front-ends relmap runs.
  expect_done(relmap(cart, {"ingest", folder_ / "drive", "--robot", "cart", "--again"}));

  for (const std::string& file : {cart, anna, dash}) expect_done(relmap(file, {"status"}));
  const Finished edit = relmap(dash, {"label", "1:0", "kitchen"});
  EXPECT_EQ(edit.exit_code, 1);
  EXPECT_THAT(daemon.log(), AllOf(HasSubstr("tram may not send keyframes as train"),
                                  HasSubstr("Map.SetLabel is for the role operator, and dash has the role reader")));
  EXPECT_THAT(edit.standard_error,
              HasSubstr("NOT_ALLOWED: Map.SetLabel is for the role operator, and dash has the role reader"));
  expect_done(relmap(anna, {"label", "1:0", "kitchen"}));
  expect_done(admin({"--server", daemon.address(), "--credentials", anna, "stats"}));

  // Without TLS nothing answers, and what is not in the list is not known.
  const Finished plain = program("relmap", {"--server", daemon.address(), "status"});
  EXPECT_EQ(plain.exit_code, 3);
  EXPECT_THAT(plain.standard_error, HasSubstr("needs --credentials"));
  expect_done(program("relmap", {"--server", folder_ / "map", "status"}));  // the socket

  // What operators did, and others tried, is on record; what was only asked is not.
  const std::string audit = read_text(folder_ / "map/audit.jsonl");
  EXPECT_THAT(audit, HasSubstr(R"("who":"anna","role":"operator","from":"ipv4:127.0.0.1)"));
  EXPECT_THAT(audit, HasSubstr(R"("method":"Map.SetLabel","request":"frame { session: 1 } label: \"kitchen\")"));
  EXPECT_THAT(audit, HasSubstr(R"("who":"dash","role":"reader")"));
  EXPECT_THAT(audit, HasSubstr(R"("outcome":"NOT_ALLOWED")"));
  EXPECT_THAT(audit, ::testing::Not(HasSubstr("Map.GetStatus")));

  // SIGHUP reads the files again, and ends nothing, whatever they say.
  daemon.process().signal(SIGHUP);
  const auto patience = std::chrono::steady_clock::now() + kPatience;
  while (daemon.log().find("SIGHUP") == std::string::npos && std::chrono::steady_clock::now() < patience)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_THAT(daemon.log(), HasSubstr("SIGHUP: settings and access list were read again"));
  const std::string server = read_text(folder_ / "fleet/server.pem");
  std::ofstream(folder_ / "fleet/server.pem") << "no certificate";
  daemon.process().signal(SIGHUP);
  while (daemon.log().find("the certificate stays as it was") == std::string::npos &&
         std::chrono::steady_clock::now() < patience)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_THAT(daemon.log(), HasSubstr("the certificate stays as it was"));
  const Finished status = program("relmap", {"--server", folder_ / "map", "status"});
  EXPECT_THAT(status.standard_output, HasSubstr("certificate")) << "it needs attention";
  std::ofstream(folder_ / "fleet/server.pem") << server;
  expect_done(relmap(anna, {"status"}));

  expect_done(admin({"credentials", "revoke", folder_ / "fleet", "dash"}));
  expect_done(admin({"credentials", "revoke", folder_ / "fleet", "anna"}));
  const auto until = std::chrono::steady_clock::now() + kPatience;
  for (const std::string& file : {dash, anna}) {
    Finished refused;
    do refused = relmap(file, {"sessions"});
    while (refused.exit_code == 0 && std::chrono::steady_clock::now() < until);
    EXPECT_THAT(refused.standard_error, AllOf(HasSubstr("UNAUTHENTICATED"), HasSubstr("revoked")));
  }
  expect_done(relmap(cart, {"sessions"}));
  EXPECT_EQ(daemon.stop(), 0) << daemon.log();
}

// A robot proves over LCM who it is by the same file.
TEST_F(CredentialsTest, ProveOverLcmWhichRobotSends) {
  const std::string cart = issue("robot", "cart"), dash = issue("reader", "dash");
  record_simulation(folder_ / "drive", {"--seed", "1", "--pairs", "12", "--laps", "0.1"});
  DaemonOptions options = served();
  options.lcm = random_lcm_url();
  RunningDaemon daemon(options);
  const auto stream = [&](const std::string& robot, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{folder_ / "drive", "--robot", robot,        "--lcm", options.lcm,
                                       "--spool",         "none",    "--patience", "4",     "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return program("relmap-frontend", arguments);
  };
  expect_done(stream("cart", {"--credentials", cart}));
  const Finished unsealed = stream("cart", {"--session", "unsealed"});
  EXPECT_EQ(unsealed.exit_code, 3);
  EXPECT_THAT(unsealed.standard_error, AllOf(HasSubstr("UNAUTHENTICATED"), HasSubstr("--credentials")));
  const Finished as_another = stream("train", {"--credentials", cart});
  EXPECT_EQ(as_another.exit_code, 1);
  EXPECT_THAT(as_another.standard_error, HasSubstr("is for the robot cart, and this is the robot train (--robot)"));
  const Finished as_reader = stream("dash", {"--credentials", dash});
  EXPECT_EQ(as_reader.exit_code, 1);
  EXPECT_THAT(as_reader.standard_error, HasSubstr("is for the reader dash"));
  EXPECT_EQ(daemon.client()->sessions().or_throw().size(), 1u);
  EXPECT_THAT(admin({"--json", "credentials", "list", folder_ / "fleet"}).standard_output,
              HasSubstr(R"({"role":"robot","name":"cart","kind":"key","state":"valid","expires":")"));

  // Another map, which serves the same fleet, is not the one that is asked for.
  const Finished elsewhere =
      stream("cart", {"--credentials", cart, "--session", "elsewhere", "--map", SessionUuid::random().to_string()});
  EXPECT_EQ(elsewhere.exit_code, 1) << elsewhere.standard_error;
  EXPECT_THAT(elsewhere.standard_error, HasSubstr("WRONG_MAP"));
  EXPECT_EQ(daemon.client()->sessions().or_throw().size(), 1u);
  expect_done(admin({"credentials", "revoke", folder_ / "fleet", "cart"}));
  const auto until = std::chrono::steady_clock::now() + kPatience;
  Finished revoked;
  int tries = 0;
  do revoked = stream("cart", {"--credentials", cart, "--session", "after" + std::to_string(++tries)});
  while (revoked.exit_code == 0 && std::chrono::steady_clock::now() < until);
  EXPECT_THAT(revoked.standard_error, HasSubstr("UNAUTHENTICATED"));
  EXPECT_EQ(daemon.stop(), 0) << daemon.log();
}

// Whatever the umask, and whatever the folder's mode was.
TEST_F(CredentialsTest, FilesAreTheirUsersOnly) {
  namespace fs = std::filesystem;
  const mode_t before = umask(0);
  fs::create_directories(folder_ / "map");
  fs::create_directories(folder_ / "backups");
  fs::permissions(folder_ / "map", fs::perms::all);
  fs::permissions(folder_ / "backups", fs::perms::owner_all);
  {
    DaemonOptions options = served();
    options.more = {"--backup-root", folder_ / "backups"};
    RunningDaemon daemon(options);
    record_simulation(folder_ / "drive", {"--seed", "1", "--pairs", "12", "--laps", "0.1"});
    expect_done(program("relmap-frontend", {folder_ / "drive", "--robot", "cart", "--server", folder_ / "map",
                                            "--spool", folder_ / "spool", "--quiet"}));
    expect_done(admin({"backup", folder_ / "map", folder_ / "backups/monday"}));
    const Finished elsewhere = admin({"backup", folder_ / "map", folder_ / "elsewhere"});
    EXPECT_EQ(elsewhere.exit_code, 1);
    EXPECT_THAT(elsewhere.standard_error, HasSubstr("NOT_ALLOWED"));
    EXPECT_FALSE(fs::exists(folder_ / "elsewhere"));
    EXPECT_EQ(daemon.stop(), 0) << daemon.log();
  }
  fs::permissions(folder_ / "map/journal", fs::perms::all);  // as an older version left it
  fs::permissions(folder_ / "map/FORMAT", fs::perms::all);
  EXPECT_EQ(RunningDaemon(served()).stop(), 0);
  expect_done(admin({"backup", folder_ / "map", folder_ / "offline"}));
  expect_done(admin({"restore", folder_ / "offline", folder_ / "restored"}));
  umask(before);
  for (const std::string& root : {folder_ / "map", folder_ / "backups/monday", folder_ / "offline",
                                  folder_ / "restored", folder_ / "fleet", folder_ / "spool"}) {
    std::vector<fs::path> all{root};
    for (const auto& entry : fs::recursive_directory_iterator(root)) all.push_back(entry.path());
    EXPECT_GT(all.size(), 3u) << root;
    for (const fs::path& path : all)
      EXPECT_EQ(fs::symlink_status(path).permissions() & (fs::perms::group_all | fs::perms::others_all),
                fs::perms::none)
          << path;
  }
}

TEST_F(CredentialsTest, DaemonsWithoutAuthenticationSaySo) {
  DaemonOptions options{.data = folder_ / "map", .lcm = random_lcm_url(), .more = {}};
  RunningDaemon daemon(options);
  EXPECT_THAT(daemon.log(), HasSubstr("lcm.authentication is none"));
  std::vector<std::string> arguments = daemon_arguments(options);
  std::erase(arguments, "--lcm-authentication");
  std::erase(arguments, "none");
  const Finished refused = run_program(arguments);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.standard_error, AllOf(HasSubstr("BAD_CONFIG"), HasSubstr("--lcm-authentication none")));
}

TEST_F(CredentialsTest, AreMadeOnceAndRenewedWithTheirNames) {
  const Finished again = admin({"--json", "credentials", "ca", folder_ / "fleet", "--host", "map.lab"});
  expect_done(again);
  EXPECT_THAT(again.standard_output,
              AllOf(HasSubstr("\"new_authority\":false"), HasSubstr("map.lab"), HasSubstr("127.0.0.1")));
  EXPECT_THAT(admin({"--json", "credentials", "ca", folder_ / "fleet"}).standard_output, HasSubstr("map.lab"));
  issue("robot", "cart");
  const Finished twice =
      admin({"credentials", "new", folder_ / "fleet", "cart", "--role", "robot", "--out", folder_ / "cart.pem"});
  EXPECT_EQ(twice.exit_code, 1);
  EXPECT_THAT(twice.standard_error, HasSubstr("exists already"));
  EXPECT_EQ(admin({"credentials", "revoke", folder_ / "fleet", "nobody"}).exit_code, 1);
  expect_done(admin({"credentials", "revoke", folder_ / "fleet", "cart"}));
  EXPECT_THAT(admin({"credentials", "revoke", folder_ / "fleet", "cart"}).standard_error,
              HasSubstr("all that was issued to cart was revoked before"));
  issue("robot", "van");
  EXPECT_EQ(admin({"credentials", "new", folder_ / "fleet", "x", "--role", "king"}).exit_code, 2);
  const Finished listed = admin({"--json", "credentials", "list", folder_ / "fleet"});
  EXPECT_THAT(listed.standard_output,
              HasSubstr(R"({"role":"robot","name":"van","kind":"certificate","state":"valid","expires":")"));

  // On a copy without the authority's key a new one would shut everybody out.
  std::filesystem::copy(folder_ / "fleet", folder_ / "copy");
  std::filesystem::remove(folder_ / "copy/ca.key");
  const Finished blind = admin({"credentials", "ca", folder_ / "copy"});
  EXPECT_EQ(blind.exit_code, 1);
  EXPECT_THAT(blind.standard_error, HasSubstr("needs a new folder"));
  EXPECT_EQ(read_text(folder_ / "copy/access"), read_text(folder_ / "fleet/access"));
  EXPECT_THAT(admin({"credentials", "new", folder_ / "copy", "x", "--role", "robot"}).standard_error,
              HasSubstr("issued where the authority's key is kept"));
}

TEST_F(CredentialsTest, MistakesAreNamed) {
  for (const char* command : {"new", "list", "revoke"}) {
    std::vector<std::string> arguments{"credentials", command, folder_ / "nowhere"};
    if (command != std::string("list")) arguments.emplace_back("cart");
    if (command == std::string("new")) arguments.insert(arguments.end(), {"--role", "robot"});
    const Finished early = admin(arguments);
    EXPECT_EQ(early.exit_code, 1);
    EXPECT_THAT(early.standard_error, HasSubstr("relmap-admin credentials ca " + (folder_ / "nowhere") + " makes it"));
  }
  const Finished outside = admin({"credentials", "new", folder_ / "fleet", "../cart", "--role", "robot"});
  EXPECT_THAT(outside.standard_error, HasSubstr("'../cart' is no name for a file; --out FILE gives one"));
  // In events and histories these mean what was done without credentials.
  expect_done(admin({"credentials", "ca", folder_ / "fleet"}));
  for (const std::string name : {"relmapd", "local", "anonymous"}) {
    const Finished reserved =
        admin({"credentials", "new", folder_ / "fleet", name, "--role", "operator", "--out", folder_ / "x.pem"});
    EXPECT_EQ(reserved.exit_code, 1) << name;
    EXPECT_THAT(reserved.standard_error, HasSubstr("BAD_NAME: '" + name + "' is no name for credentials"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "x.pem")) << name;
  }
  // Whoever the daemon runs as gets to its folder, and nobody else into it.
  expect_done(admin({"credentials", "ca", folder_ / "a/b/fleet/"}));
  for (const auto& [folder, mode] : {std::pair("a", 0755), {"a/b", 0755}, {"a/b/fleet", 0700}})
    EXPECT_EQ(static_cast<int>(std::filesystem::status(folder_ / folder).permissions()), mode) << folder;
}

TEST_F(CredentialsTest, BothSidesSayWhyTheyDoNotTrustEachOther) {
  expect_done(admin({"credentials", "ca", folder_ / "other"}));
  expect_done(admin(
      {"credentials", "new", folder_ / "other", "anna", "--role", "operator", "--out", folder_ / "stranger.pem"}));
  RunningDaemon daemon(served());
  const Finished refused =
      program("relmap", {"--server", daemon.address(), "--credentials", folder_ / "stranger.pem", "status"});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.standard_error, HasSubstr("stranger.pem do not trust each other"));
  EXPECT_THAT(daemon.log(), HasSubstr("TLS: a handshake failed"));
}

TEST_F(CredentialsTest, TheLogLevelIsReadAgain) {
  const auto configure = [&](const char* level) {
    std::ofstream(folder_ / "new.yaml") << "log_level: " << level << "\n";
    std::filesystem::rename(folder_ / "new.yaml", folder_ / "relmapd.yaml");
  };
  configure("error");
  DaemonOptions options = served();
  options.more = {"--config",      folder_ / "relmapd.yaml", "--backup-root",
                  folder_ / "one", "--backup-root",          folder_ / "two"};
  RunningDaemon daemon(options);
  EXPECT_THAT(daemon.log(), ::testing::Not(HasSubstr("[info]")));
  configure("info");
  daemon.process().signal(SIGHUP);
  const auto patience = std::chrono::steady_clock::now() + kPatience;
  while (daemon.log().find("SIGHUP: settings and access list were read again") == std::string::npos &&
         std::chrono::steady_clock::now() < patience)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_THAT(daemon.log(), HasSubstr("SIGHUP: settings and access list were read again"));
}

}  // namespace
}  // namespace relmap::testing
