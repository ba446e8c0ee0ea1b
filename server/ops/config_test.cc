#include "server/ops/config.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace relmap::ops {
namespace {

std::string refusal(std::string_view text) {
  Config config;
  const Status status = parse_config(text, "relmapd.yaml", config);
  EXPECT_EQ(status.reason(), Reason::BAD_CONFIG);
  return status.message();
}

TEST(Config, ReadsKeysOfTheFileAndKeepsOtherDefaults) {
  Config config;
  ASSERT_TRUE(parse_config("data: /srv/map\n"
                           "memory_budget_mb: 64\n"
                           "deterministic: true\n"
                           "rpc:\n"
                           "  threads: 2\n"
                           "  max_ingest_streams: 3\n"
                           "ingest:\n"
                           "  max_keyframes_per_s: 12.5\n"
                           "  robots: [cart-1, 'cart 2']\n"
                           "routes:\n"
                           "  mixes: [{metre: 1, driven_second: 0.5}, {square_metre_of_variance: 2}]\n"
                           "rba: { window: 16, delta_eps: 0.1 }\n",
                           "relmapd.yaml", config)
                  .ok());
  EXPECT_EQ(config.data, "/srv/map");
  EXPECT_EQ(config.memory_budget_mb, 64u);
  EXPECT_TRUE(config.map.deterministic);
  EXPECT_EQ(config.rpc.threads, 2);
  EXPECT_EQ(config.rpc.max_ingest_streams, 3);
  EXPECT_EQ(config.max_keyframes_per_s, 12.5);
  EXPECT_EQ(config.robots, (std::vector<std::string>{"cart-1", "cart 2"}));
  EXPECT_EQ(config.map.rba.window, 16u);
  EXPECT_EQ(config.map.rba.delta_eps, 0.1);
  EXPECT_EQ(config.route_metrics(),
            (std::vector<route::RouteWeights>{route::kByDistance, route::kByTime, {1, 0.5, 0, 0}, {0, 0, 0, 2}}));
  config.map.deterministic = false;
  EXPECT_EQ(config.route_metrics().at(2), map::kWithoutStops) << "lookups ask for ways by cells";
  EXPECT_EQ(config.listen, Config().listen);
  EXPECT_TRUE(check_config(config).ok());
}

TEST(Config, LookupThreadsHaveARange) {
  Config config;
  EXPECT_TRUE(parse_config("lookup_threads: 256\n", "relmapd.yaml", config).ok());
  EXPECT_EQ(config.map.lookup_threads, 256u);
  EXPECT_NE(refusal("lookup_threads: 257\n").find("lookup_threads"), std::string::npos);
  EXPECT_NE(refusal("lookup_threads: -1\n").find("lookup_threads"), std::string::npos);
}

TEST(Config, AnEmptyFileChangesNothing) {
  Config config;
  EXPECT_TRUE(parse_config("# nothing\n", "relmapd.yaml", config).ok());
}

TEST(Config, RefusesBadKeysWithTheirLine) {
  EXPECT_EQ(refusal("data: x\nmemroy_budget_mb: 64\n"), "relmapd.yaml:2: unknown key 'memroy_budget_mb'");
  EXPECT_EQ(refusal("rpc:\n  thread: 2\n"), "relmapd.yaml:2: unknown key 'rpc.thread'");
  EXPECT_EQ(refusal("memory_budget_mb: 1\n"),
            "relmapd.yaml:1: 'memory_budget_mb' needs a whole number from 32 to 1048576");
  EXPECT_EQ(refusal("\nrpc: {threads: 1.5}\n"), "relmapd.yaml:2: 'rpc.threads' needs a whole number from 1 to 256");
  EXPECT_EQ(refusal("rba: {delta_eps: .nan}\n"), "relmapd.yaml:1: 'rba.delta_eps' needs a number from 0 to 10");
  EXPECT_EQ(refusal("deterministic: maybe\n"), "relmapd.yaml:1: 'deterministic' needs true or false");
  EXPECT_EQ(refusal("lcm: [a, b]\n"), "relmapd.yaml:1: 'lcm' needs text");
  EXPECT_EQ(refusal("data: a\ndata: b\n"), "relmapd.yaml:2: 'data' is given twice");
  EXPECT_TRUE(refusal("routes: {mixes: 3}\n").ends_with("needs a list of at most 8 weights"));
  EXPECT_TRUE(refusal("routes: {mixes: [3]}\n").ends_with("needs weights like {metre: 1, driven_second: 0.5}"));
  EXPECT_TRUE(
      refusal("routes: {mixes: [{metre: -1}]}\n").ends_with("needs weights of 0, or 1e-9 to 1e9, and not all 0"));
  EXPECT_TRUE(refusal("routes: {mixes: [{metre: x}]}\n").ends_with("needs numbers"));
  EXPECT_TRUE(refusal("routes: {mixes: [{mile: 1}]}\n").find("standing_second") != std::string::npos);
  EXPECT_TRUE(refusal("ingest: {max_keyframes_per_s: -1}\n").ends_with("needs a number from 0 to 1000000"));
  EXPECT_TRUE(refusal("ingest: {max_keyframes_per_s: many}\n").ends_with("needs a number"));
  EXPECT_EQ(refusal("ingest:\n  robots: cart-1\n"), "relmapd.yaml:2: 'ingest.robots' needs a list of names");
  EXPECT_TRUE(refusal("ingest: {robots: [[a]]}\n").ends_with("needs a list of names"));
  EXPECT_TRUE(refusal("ingest: {robots: ['']}\n").find("a name that no robot can have") != std::string::npos);
  EXPECT_EQ(refusal("ingest: {robot: [a]}\n"), "relmapd.yaml:1: unknown key 'ingest.robot'");
  EXPECT_TRUE(refusal("rpc: {max_ingest_streams: 0}\n").ends_with("needs a whole number from 1 to 100000"));
  EXPECT_EQ(refusal("- data\n"), "relmapd.yaml:1: needs 'key: value' lines");
  EXPECT_TRUE(refusal("data: [\n").starts_with("relmapd.yaml:2: ")) << refusal("data: [\n");
}

TEST(Config, ARefusedFileChangesNothing) {
  Config config;
  EXPECT_FALSE(parse_config("data: x\nnonsense: 1\n", "relmapd.yaml", config).ok());
  EXPECT_EQ(config.data, "");
}

TEST(Config, AMissingFileIsReported) {
  Config config;
  const Status status = read_config("/nowhere/relmapd.yaml", config);
  EXPECT_EQ(status.reason(), Reason::NO_SUCH_FILE);
  EXPECT_NE(status.message().find("/nowhere/relmapd.yaml"), std::string::npos);
}

TEST(Config, ListeningOverTcpNeedsTlsOrInsecure) {
  Config config;
  config.data = "map";
  EXPECT_TRUE(check_config(config).ok()) << "only the socket";
  for (const char* address : {"127.0.0.1:0", "localhost:50070", "0.0.0.0:50070", "[::]:50070", "robot.local:50070"}) {
    config.listen = address;
    config.tls = {};
    config.insecure = false;
    EXPECT_EQ(check_config(config).reason(), Reason::BAD_CONFIG) << address;
    config.insecure = true;
    EXPECT_TRUE(check_config(config).ok()) << address;
    config.tls = {"server.crt", "server.key", ""};
    EXPECT_EQ(check_config(config).reason(), Reason::BAD_CONFIG) << "a contradiction";
    config.insecure = false;
    EXPECT_TRUE(check_config(config).ok()) << address;
    config.tls.key.clear();
    EXPECT_EQ(check_config(config).reason(), Reason::BAD_CONFIG) << "half of a pair";
  }
  config.listen = unless_none("none");
  EXPECT_EQ(config.listen, "");
}

TEST(Config, AFolderOfCredentialsNamesWhatNothingElseNames) {
  Config config;
  ASSERT_TRUE(parse_config("credentials: /etc/relmap/credentials\ntls: { key: /elsewhere/key.pem }\n"
                           "rpc: { max_connections: 20, max_connections_per_peer: 10, quiet_s: 90.5 }\n",
                           "relmapd.yaml", config)
                  .ok());
  complete_config(config);
  EXPECT_EQ(config.tls.certificate, "/etc/relmap/credentials/server.pem");
  EXPECT_EQ(config.tls.key, "/elsewhere/key.pem");
  EXPECT_EQ(config.tls.client_authority, "/etc/relmap/credentials/ca.crt");
  EXPECT_EQ(config.access, "/etc/relmap/credentials/access");
  EXPECT_EQ(config.connections.total, 20u);
  EXPECT_EQ(config.connections.per_peer, 10u);
  EXPECT_EQ(config.connections.quiet_s, 90.5);
  Config plain;
  complete_config(plain);
  EXPECT_EQ(plain.access + plain.tls.certificate, "");
}

TEST(Config, LcmNeedsKeysUnlessItIsSaidThatItNeedsNone) {
  using Who = ingest::LcmAuthentication::Who;
  Config config;
  config.data = "map";
  config.lcm = "udpm://239.255.76.67:7667";
  EXPECT_EQ(check_config(config).reason(), Reason::BAD_CONFIG);
  EXPECT_NE(check_config(config).message().find("--lcm-authentication none"), std::string::npos);
  config.credentials = "fleet";
  complete_config(config);
  EXPECT_EQ(config.lcm_key, "fleet/lcm.key");
  EXPECT_TRUE(check_config(config).ok());
  ASSERT_TRUE(parse_config("lcm.authentication: [cart-1, cart-2]", "test", config).ok());
  EXPECT_EQ(config.lcm_authentication, Who::kSome);
  EXPECT_EQ(config.lcm_proving, (std::vector<std::string>{"cart-1", "cart-2"}));
  EXPECT_TRUE(check_config(config).ok());
  config.lcm_key.clear();
  EXPECT_EQ(check_config(config).reason(), Reason::BAD_CONFIG);
  ASSERT_TRUE(parse_config("lcm.authentication: none\nlcm.key: other", "test", config).ok());
  EXPECT_EQ(config.lcm_authentication, Who::kNobody);
  EXPECT_EQ(config.lcm_key, "other");
  EXPECT_TRUE(check_config(config).ok());
  ASSERT_TRUE(parse_config("lcm.authentication: all", "test", config).ok());
  EXPECT_EQ(config.lcm_authentication, Who::kAll);
  for (const char* bad : {"lcm.authentication: some", "lcm.authentication: {a: b}", "lcm.authentication: [[a]]"})
    EXPECT_EQ(parse_config(bad, "test", config).reason(), Reason::BAD_CONFIG) << bad;
}

TEST(Config, RefusesLcmUrlsThatCannotDeliverKeyframes) {
  Config config;
  config.data = "map";
  config.lcm_authentication = ingest::LcmAuthentication::Who::kNobody;
  const std::string log = testing::TempDir() + "lcmlog_" + std::to_string(getpid());
  std::ofstream(log) << "";
  for (const std::string& url :
       {std::string(""), std::string("udpm://"), std::string("udpm://239.255.76.67:7667"),
        std::string("udpm://239.255.76.67:7667?ttl=0"), std::string("udpm://224.0.0.1:1?ttl=255&recv_buf_size=65536"),
        "file://" + log, "file://" + log + "?speed=0", "file://" + log + "?speed=2.5&mode=r&start_timestamp=0"}) {
    config.lcm = url;
    EXPECT_TRUE(check_config(config).ok()) << url << ": " << check_config(config).to_string();
  }
  const std::pair<std::string, const char*> bad[] = {
      {"foo", "'foo' is no LCM URL such as udpm://239.255.76.67:7667?ttl=0"},
      {"239.255.76.67:7667", "is no LCM URL"},
      {"nonsense://", "LCM provider 'nonsense'; known: udpm, file, memq"},
      {"udpm://239.255.76.67:x", "'x' is no port"},
      {"udpm://239.255.76.67:0", "'0' is no port"},
      {"udpm://239.255.76.67:76670", "'76670' is no port"},
      {"udpm://239.255.76.67:", "'' is no port"},
      {"udpm://10.0.0.1:7667", "'10.0.0.1' is no IPv4 multicast group"},
      {"udpm://robots:7667", "'robots' is no IPv4 multicast group"},
      {"udpm://239.255.76.67:7667?tll=1", "LCM's udpm has no option 'tll'; known: recv_buf_size, ttl"},
      {"udpm://239.255.76.67:7667?ttl=256", "option 'ttl' needs a number from 0 to 255"},
      {"udpm://239.255.76.67:7667?ttl=one", "option 'ttl' needs"},
      {"udpm://239.255.76.67:7667?ttl", "option 'ttl' needs"},
      {"udpm://239.255.76.67:7667?ttl=0&ttl=1", "option 'ttl' is given twice"},
      {"udpm://239.255.76.67:7667?recv_buf_size=-1", "option 'recv_buf_size' needs"},
      {"memq://", "reaches nobody outside of this process"},
      {"file://", "the path of the log is missing"},
      {"file://" + log + ".none", "there is no log"},
      {"file://" + log + "?mode=w", "writes none"},
      {"file://" + log + "?speed=fast", "option 'speed' needs"},
  };
  for (const auto& [url, why] : bad) {
    config.lcm = url;
    const Status status = check_config(config);
    EXPECT_EQ(status.reason(), Reason::BAD_CONFIG) << url;
    EXPECT_TRUE(status.message().starts_with("lcm: ")) << status.message();
    EXPECT_NE(status.message().find(why), std::string::npos) << url << ": " << status.message();
  }
  config.lcm = "file://" + log;
  config.lcm_authentication = ingest::LcmAuthentication::Who::kAll;
  EXPECT_NE(check_config(config).message().find("nothing in a log can prove"), std::string::npos);
  std::filesystem::remove(log);
}

TEST(Config, LcmIsTurnedOffByName) {
  Config config;
  config.lcm = "udpm://";
  ASSERT_TRUE(parse_config("lcm: none", "test", config).ok());
  EXPECT_EQ(config.lcm, "");
  EXPECT_EQ(unless_none("none"), "");
  EXPECT_EQ(unless_none("udpm://"), "udpm://");
}

TEST(Config, AnAddressNeedsHostAndPort) {
  for (const char* text : {"", "localhost", ":50070", "localhost:", "localhost:x", "localhost:70000", "::1:50070",
                           "[::1]", "localhost:-1", "localhost:1 "})
    EXPECT_EQ(parse_host_port(text).reason(), Reason::BAD_CONFIG) << text;
  EXPECT_EQ(parse_host_port("[::1]:7")->to_string(), "[::1]:7");
}

}  // namespace
}  // namespace relmap::ops
