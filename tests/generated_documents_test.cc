// What documents and samples say of settings and metrics is what the daemon has.
#include <gtest/gtest.h>

#include "server/monitor/metrics_page.h"
#include "server/ops/settings.h"
#include "tests/support/generated_part.h"

namespace relmap::testing {
namespace {

TEST(GeneratedDocuments, ListEverySetting) {
  expect_generated_part("server/README.md", "settings", ops::settings_table());
  expect_generated("server/ops/relmapd.yaml", ops::sample_config());
}

TEST(GeneratedDocuments, ListEveryMetric) {
  expect_generated_part("docs/metrics.md", "metrics", monitor::metrics_table());
}

}  // namespace
}  // namespace relmap::testing
