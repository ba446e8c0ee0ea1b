// What documents and samples say and show of settings, metrics and suspicion is what the daemon has.
#include <gtest/gtest.h>

#include "server/monitor/metrics_page.h"
#include "server/ops/settings.h"
#include "tests/support/generated_part.h"
#include "tests/suspicion_picture.h"

namespace relmap::testing {
namespace {

TEST(GeneratedDocuments, ListEverySetting) {
  expect_generated_part("server/README.md", "settings", ops::settings_table());
  expect_generated("server/ops/relmapd.yaml", ops::sample_config());
}

TEST(GeneratedDocuments, ListEveryMetric) {
  expect_generated_part("docs/metrics.md", "metrics", monitor::metrics_table());
}

TEST(GeneratedDocuments, ShowTheCurvesOfSuspicion) { expect_generated("docs/suspicion.svg", suspicion_picture()); }

}  // namespace
}  // namespace relmap::testing
