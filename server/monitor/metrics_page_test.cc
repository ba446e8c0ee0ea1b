#include "server/monitor/metrics_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <sstream>
#include <string>

#include "server/ingest/mapper_sink.h"
#include "server/rpc/server.h"
#include "server/rpc/testing/served_map.h"

namespace relmap::monitor {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Pair;

// "name{labels}" of each sample, and its value.
std::map<std::string, double> samples_of(const std::string& page) {
  std::map<std::string, double> samples;
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line.front() == '#') continue;
    const std::size_t space = line.rfind(' ');
    EXPECT_TRUE(samples.emplace(line.substr(0, space), std::stod(line.substr(space + 1))).second) << line;
  }
  return samples;
}

TEST(MetricFamilies, HaveNamesOfTheirOwnInBaseUnits) {
  std::set<std::string> names;
  for (const MetricFamily& family : metric_families()) {
    const std::string name = family.name, type = family.type;
    EXPECT_TRUE(names.insert(name).second) << name;
    EXPECT_EQ(type == "counter", name.ends_with("_total")) << name;
    EXPECT_TRUE(type != "histogram" || name.ends_with("_seconds")) << name;
    EXPECT_NE(std::string(family.meaning), "") << name;
  }
}

class MetricsPageTest : public ::testing::Test {
 protected:
  MetricsPageTest() {
    map_.core->intake.server = &intake_;
    map_.core->intake.facts = [] { return rpc::IngestFacts(); };
    map_.core->facts.lcm_url = "udpm://239.255.76.67:7667?ttl=0";
    map_.core->process = [] { return rpc::ProcessFacts{1 << 20, 2 << 20, 1.5, 12, 1024}; };
    map_.core->health = [this] { return health_; };
    server_ = rpc::RpcServer::start(*map_.core, everyone_, {.host = "127.0.0.1", .tls_watch = &tls_}).or_throw();
  }
  ~MetricsPageTest() override {
    server_.reset();
    intake_.stop();
  }

  rpc::ServedMap map_;
  ingest::MapperSink sink_{*map_.mapper};
  intake::IngestServer intake_{sink_, map_.mapper->budget(), BootId{4, 2}};
  const rpc::Gatekeeper everyone_{{}, true};
  const rpc::TlsWatch tls_{{}};
  rpc::HealthFacts health_{{{"storage", {}}, {"worker", {}}, {"intake", {}}}, true, 0, 0};
  std::unique_ptr<rpc::RpcServer> server_;
  MetricsPage page_{*map_.core, "/tmp", 1 << 28};
};

TEST_F(MetricsPageTest, HasEveryFamilyWithTheLabelsThatItNames) {
  health_.components[0].state = {Reason::IO_ERROR, "the disk fails"};
  map_.core->metrics.count("Map.GetFrame", Reason::NO_SUCH_FRAME, 0.002);
  intake_.count_foreign(Reason::CORRUPT);
  const std::string page = page_.text().value();
  for (const MetricFamily& family : metric_families()) {
    const std::string name = family.name;
    EXPECT_THAT(page, HasSubstr("# TYPE " + name + " " + family.type + "\n"));
    EXPECT_THAT(page, HasSubstr("# HELP " + name + " "));
    const std::string suffix = family.type == std::string("histogram") ? "_count" : "";
    std::string labels = family.labels;
    const std::size_t at = page.find("\n" + name + suffix + (labels.empty() ? " " : "{"));
    ASSERT_NE(at, std::string::npos) << name;
    const std::string line = page.substr(at + 1, page.find('\n', at + 1) - at - 1);
    std::istringstream each(labels);
    for (std::string label; std::getline(each >> std::ws, label, ',');) EXPECT_THAT(line, HasSubstr(label + "=\""));
    EXPECT_EQ(std::count(line.begin(), line.end(), '"'),
              labels.empty() ? 0 : 2 * (1 + std::count(labels.begin(), labels.end(), ',')))
        << line;
  }
}

TEST_F(MetricsPageTest, TellsWhatTheMapHas) {
  const auto samples = samples_of(page_.text().value());
  EXPECT_THAT(samples, Contains(Pair("relmap_frames", rpc::ServedMap::kFrames + rpc::ServedMap::kElsewhere)));
  EXPECT_THAT(samples, Contains(Pair("relmap_sessions", 2)));
  EXPECT_EQ(samples.at("relmap_journal_applied_sequence"), samples.at("relmap_journal_durable_sequence"));
  EXPECT_EQ(samples.at("relmap_acknowledgement_seconds_count"), samples.at("relmap_frames"));
  EXPECT_EQ(samples.at("relmap_relaxation_seconds_count"), samples.at("relmap_frames"));
  EXPECT_GE(samples.at("relmap_lookup_seconds_count"), samples.at("relmap_frames"));
  EXPECT_GT(samples.at("relmap_append_seconds_count"), 0);
  EXPECT_GT(samples.at("relmap_closures{state=\"accepted\"}"), 0);
  EXPECT_EQ(samples.at("relmap_memory_budget_bytes"), 256 << 20);
  EXPECT_EQ(samples.at("relmap_disk_low_water_bytes"), 1 << 28);
  EXPECT_GT(samples.at("relmap_disk_size_bytes"), samples.at("relmap_disk_free_bytes"));
}

TEST_F(MetricsPageTest, HistogramsAddUp) {
  map_.core->metrics.count("Map.GetFrame", Reason::OK, 0.0002);
  map_.core->metrics.count("Map.GetFrame", Reason::OK, 100);
  map_.core->metrics.count("Map.GetFrame", Reason::NO_SUCH_FRAME, 0.00001);
  const auto samples = samples_of(page_.text().value());
  const auto of = [&](const std::string& suffix, const std::string& reason, const std::string& more = "") {
    return samples.at("relmap_rpc_seconds" + suffix + "{method=\"Map.GetFrame\",reason=\"" + reason + "\"" + more +
                      "}");
  };
  EXPECT_EQ(of("_count", "OK"), 2);
  EXPECT_NEAR(of("_sum", "OK"), 100.0002, 1e-6);
  EXPECT_EQ(of("_bucket", "OK", ",le=\"0.0001\""), 0);
  EXPECT_EQ(of("_bucket", "OK", ",le=\"0.00025\""), 1);
  EXPECT_EQ(of("_bucket", "OK", ",le=\"60\""), 1);
  EXPECT_EQ(of("_bucket", "OK", ",le=\"+Inf\""), 2);
  EXPECT_EQ(of("_count", "NO_SUCH_FRAME"), 1);
}

TEST_F(MetricsPageTest, ShowsTroubleAndTakesItBack) {
  health_.components[0].state = {Reason::DISK_FULL, "12 MiB free"};
  health_.live = false;
  health_.clock_steps = 2;
  health_.clock_step_s = -3600;
  auto samples = samples_of(page_.text().value());
  EXPECT_EQ(samples.at("relmap_component_ok{component=\"storage\"}"), 0);
  EXPECT_EQ(samples.at("relmap_component_ok{component=\"worker\"}"), 1);
  EXPECT_EQ(samples.at("relmap_component_problem{component=\"storage\",reason=\"DISK_FULL\"}"), 1);
  EXPECT_EQ(samples.at("relmap_ready"), 0);
  EXPECT_EQ(samples.at("relmap_live"), 0);
  EXPECT_EQ(samples.at("relmap_clock_steps_total"), 2);
  EXPECT_EQ(samples.at("relmap_clock_step_seconds"), -3600);
  health_.components[0].state = {};
  health_.live = true;
  samples = samples_of(page_.text().value());
  EXPECT_EQ(samples.count("relmap_component_problem{component=\"storage\",reason=\"DISK_FULL\"}"), 0u);
  EXPECT_EQ(samples.at("relmap_ready"), 1);
}

TEST_F(MetricsPageTest, OneIsMadeAtATime) {
  map_.core->health = [&] {
    EXPECT_EQ(page_.text(), std::nullopt) << "while another is being made";
    return health_;
  };
  EXPECT_NE(page_.text(), std::nullopt);
  EXPECT_NE(page_.text(), std::nullopt) << "the next";
}

}  // namespace
}  // namespace relmap::monitor
