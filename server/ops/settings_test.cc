#include "server/ops/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <sstream>
#include <string>

namespace relmap::ops {
namespace {

using ::testing::HasSubstr;

Config config_of(const std::string& text) {
  Config config;
  const Status parsed = parse_config(text, "relmapd.yaml", config);
  EXPECT_TRUE(parsed.ok()) << parsed.to_string();
  return config;
}

// A configuration in which no setting has its default.
std::string unusual() {
  return "data: '/srv/a map'\nsocket: /run/relmap/socket\nsocket_group: relmap\nlisten: '[::1]:0'\ninsecure: true\n"
         "http: 50071\ncredentials: /etc/relmap\ntls.certificate: c.pem\ntls.key: 'yes'\ntls.client_authority: "
         "\"a\\nb\"\n"
         "access: '#access'\naudit: 'none'\nlcm: 'udpm://239.255.76.67:7667?ttl=0'\nlcm.authentication: [cart-1, 'cart "
         "2']\n"
         "lcm.key: \"k\\\"ey\"\nbackup.roots: [/backup, '/other one']\nmemory_budget_mb: 64\ndisk_low_water_mb: 0\n"
         "vocabulary: '123'\nlog_level: debug\nlog_format: json\nhung_after_s: 2.5\ndeterministic: true\nclosures: "
         "false\n"
         "lookup_threads: 3\ncommit_interval_ms: 10\nevents.max_mb: 5\nrpc.threads: 2\nrpc.max_concurrent: 5\n"
         "rpc.max_concurrent_per_caller: 4\nrpc.max_waiting: 3\nrpc.stalled_s: 1.5\nrpc.max_connections: 9\n"
         "rpc.quiet_s: 7\nrpc.max_connections_per_peer: 8\nrpc.max_ingest_streams: 11\n"
         "rpc.max_ingest_streams_per_caller: 12\nrpc.max_watchers: 13\nrpc.max_watchers_per_caller: 6\n"
         "rpc.max_search_frames: 1000000000\nrpc.default_deadline_s: 0.001\n"
         "ingest.max_keyframes_per_s: 0.1\ningest.max_new_sessions_per_min: 1000000\ningest.robots: [a, 'b: c']\n"
         "routes.mixes: [{metre: 1e-9, driven_second: 0.3}, {square_metre_of_variance: 30}]\nrba.window: 9\n"
         "rba.delta_eps: 0.07\nrba.idle_delta_eps: 0.02\nrba.budget: 123456\nrba.huber_px: 3.25\n";
}

TEST(Settings, EachIsPrintedAndReadBackAsItWas) {
  const Config odd = config_of(unusual()), usual;
  const std::string printed = print_config(odd);
  const Config again = config_of(printed);
  for (const Setting& one : settings()) {
    EXPECT_EQ(one.get(again), one.get(odd)) << one.key;
    EXPECT_NE(one.get(odd), one.get(usual)) << one.key << " has its default here, and is not tested";
  }
  EXPECT_EQ(again.tls.client_authority, "a\nb");
  EXPECT_EQ(again.tls.key, "yes");
  EXPECT_EQ(again.lcm_key, "k\"ey");
  EXPECT_EQ(again.vocabulary, "123");
  EXPECT_EQ(again.route_mixes, odd.route_mixes);
}

TEST(Settings, TheDefaultsArePrintedAndReadBack) {
  const std::string printed = print_config(Config());
  EXPECT_EQ(print_config(config_of(printed)), printed);
}

TEST(Settings, TheSampleHasEachWithItsDefault) {
  const std::string sample = sample_config();
  Config untouched = config_of(sample);
  EXPECT_EQ(print_config(untouched), print_config(Config())) << "all of it is commented out";
  std::string taken;  // all that has a value
  std::istringstream lines(sample);
  std::set<std::string> keys;
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(line.size(), 140u) << line;
    if (!line.starts_with("#") || line.starts_with("# ") || line == "#") continue;
    keys.insert(line.substr(1, line.find(':') - 1));
    if (line.find(":   #") == std::string::npos) taken += line.substr(1) + "\n";
  }
  for (const Setting& one : settings()) EXPECT_TRUE(keys.contains(one.key)) << one.key;
  EXPECT_EQ(keys.size(), settings().size());
  EXPECT_EQ(print_config(config_of(taken)), print_config(Config()));
}

TEST(Settings, OnlyLiveOnesChangeWhileTheDaemonRuns) {
  Config config;
  config.data = "map";
  Config fresh = config;
  fresh.log_level = "debug";
  fresh.max_keyframes_per_s = 7;
  fresh.robots = {"cart-1"};
  fresh.hung_after_s = 30;
  EXPECT_TRUE(adopt_live(fresh, config).empty());
  EXPECT_EQ(config.log_level, "debug");
  EXPECT_EQ(config.max_keyframes_per_s, 7);
  EXPECT_EQ(config.robots, fresh.robots);
  EXPECT_EQ(config.hung_after_s, 30);

  fresh.memory_budget_mb = 2048;
  fresh.max_keyframes_per_s = 8;
  const std::vector<Status> refused = adopt_live(fresh, config);
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_EQ(refused[0].to_string(),
            "NEEDS_RESTART: memory_budget_mb stays 1024 until the daemon is started again; 2048 was read");
  EXPECT_EQ(config.memory_budget_mb, 1024u);
  EXPECT_EQ(config.max_keyframes_per_s, 8) << "what can change does";
}

TEST(Settings, HttpIsOfThisMachineUnlessCallersCanBeKnown) {
  EXPECT_EQ(parse_http("50071").or_throw().to_string(), "127.0.0.1:50071");
  EXPECT_EQ(parse_http("0.0.0.0:1").or_throw().to_string(), "0.0.0.0:1");
  EXPECT_EQ(parse_http("").reason(), Reason::BAD_CONFIG);
  EXPECT_EQ(parse_http("99999").reason(), Reason::BAD_CONFIG);
  Config config;
  config.data = "map";
  for (const char* local : {"50071", "127.0.0.1:0", "localhost:50071", "[::1]:50071"}) {
    config.http = local;
    EXPECT_TRUE(check_config(config).ok()) << local;
  }
  for (const char* wide : {"0.0.0.0:50071", "[::]:50071", "map.lab:50071", "192.0.2.1:50071"}) {
    config.http = wide;
    config.insecure = false;
    config.tls = {};
    const Status refused = check_config(config);
    EXPECT_EQ(refused.reason(), Reason::BAD_CONFIG) << wide;
    EXPECT_THAT(refused.message(), HasSubstr("--credentials"));
    config.insecure = true;
    EXPECT_TRUE(check_config(config).ok()) << wide;
    config.insecure = false;
    config.tls = {"c", "k", ""};
    EXPECT_TRUE(check_config(config).ok()) << wide;
  }
}

}  // namespace
}  // namespace relmap::ops
