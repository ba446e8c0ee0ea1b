#include "tools/relmap/report_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace relmap::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// Every text that comes from elsewhere is hostile.
constexpr char kHostile[] = "</td></table><script>alert('x')</script><img src=x onerror=\"y\">\u202Egnp\u2066";

MapReport report_of(const std::string& name) {
  MapReport report;
  report.title = name;
  report.status.data_folder = report.status.version = name;
  report.status.frames = 1234;
  report.status.refused = 3;
  report.status.refused_by_reason[Reason::TIME_BACKWARDS] = 3;
  report.status.gaps = 2;
  report.status.storage = {Reason::DISK_FULL, name};
  report.status.doubtful_cameras.push_back({1, name, name, {2}, 4, name});
  for (SessionNumber number : {1u, 2u}) {
    client::Session session;
    session.number = number;
    session.name = session.robot = session.uuid = name;
    session.frames = 617;
    session.last = 616;
    report.sessions.push_back(session);
  }
  report.keyframes_by_day = {{"2026-11-29", 17}, {"2026-11-30", 1217}};
  report.map_svg = "<svg id=\"the-map\"></svg>";
  report.parts = 2;
  report.tears = {{{{1, 5}, 1}, {1, 0}, {1, 5}, 0.5, 2, 17.25}};
  report.matrix = {{1, 1, 0, 12, 0, 0, {}, 0.1}, {1, 2, 3, 40, 1, 2, EdgeId{{2, 7}, 1}, 0.75}};
  client::Edge edge;
  edge.id = {{2, 7}, 1};
  edge.suspicion = client::Suspicion{0.75, {{client::DoubtKind::kContradiction, 0.5, name}}, name};
  report.suspicious = {{edge, "<svg id=\"the-pair\"></svg>"}};
  report.errors = {{1, {0.1, 0.2, 0.9}}};
  report.sigmas = {{0, 1}, {0.125, 1}, {0.25, 64}, {0.5, 3}};
  report.sigmas_root = {1, 0};
  client::RobotStatus robot;
  robot.robot = robot.name = robot.uuid = name;
  robot.silent = true;
  report.robots = {robot};
  client::AuditEntry entry;
  entry.who = entry.role = entry.from = entry.method = entry.request = entry.request_id = name;
  report.audit.entries = {entry};
  return report;
}

TEST(ReportPage, HostileNamesAreTextOnly) {
  const std::string page = report_page(report_of(kHostile));
  for (const char* bad : {"<script", "<img", "onerror=\"y\"", "\u202E", "\u2066", "</td></table><"})
    EXPECT_THAT(page, Not(HasSubstr(bad)));
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;"));
  EXPECT_THAT(page, HasSubstr("default-src 'none'")) << "and if one were not, it would not run";
  EXPECT_THAT(page, HasSubstr("\n<html")) << "it is whole";
  EXPECT_TRUE(page.ends_with("</body></html>\n"));
}

TEST(ReportPage, NeedsNothingFromOutside) {
  const std::string page = report_page(report_of("cart"));
  for (const char* outside : {"http://", "https://", "src=", "<link", "@import", "<script"})
    EXPECT_THAT(page, Not(HasSubstr(outside))) << outside;
}

TEST(ReportPage, TellsWhatTheMapHoldsAndWhatToLookAt) {
  const MapReport report = report_of("cart");
  const std::string page = report_page(report);
  for (const char* text :
       {"1,234", "the-map", "the-pair", "2026-11-29", "TIME_BACKWARDS", "relmap-admin explain TIME_BACKWARDS",
        "40 in force, 3 candidates, 1 quarantined, 2 removed; largest suspicion 0.75", "class=\"sus\"", "17.2",
        "0.20</td>", "at most 0.5 m", "of half of the keyframes at most 0.25 m", "prefers-color-scheme:dark",
        "@media print"})
    EXPECT_THAT(page, HasSubstr(text));
  const auto findings = findings_of(report);
  EXPECT_THAT(findings, ::testing::Contains(HasSubstr("DISK_FULL")));
  EXPECT_THAT(findings, ::testing::Contains(HasSubstr("Loop closure 2:7/1 is suspicious (0.75 of 1): contradicted")));
  EXPECT_THAT(findings, ::testing::Contains(HasSubstr("3 keyframes were refused for good")));
  EXPECT_THAT(findings, ::testing::Contains(HasSubstr("2 parts that nothing connects")));
  EXPECT_THAT(findings, ::testing::Contains(HasSubstr("fell silent")));
}

TEST(ReportPage, SaysWhyAPartIsMissing) {
  MapReport report = report_of("cart");
  report.map_missing = {Reason::EMPTY_MAP, "there is nothing to draw"};
  report.audit_missing = {Reason::NOT_ALLOWED, "operators only"};
  report.matrix_missing = {Reason::UNIMPLEMENTED, "an older daemon"};
  report.suspicious_missing = {Reason::DEADLINE, "too slow"};
  report.store_missing = {Reason::NOT_ALLOWED, "not for readers"};
  const std::string page = report_page(report);
  for (const char* why : {"EMPTY_MAP: there is nothing to draw", "NOT_ALLOWED: operators only",
                          "UNIMPLEMENTED: an older daemon", "DEADLINE: too slow", "NOT_ALLOWED: not for readers"})
    EXPECT_THAT(page, HasSubstr(why));
}

TEST(ReportPage, AMapThatIsNotAskedForIsLeftOut) {
  MapReport report = report_of("cart");
  EXPECT_THAT(report_page(report), HasSubstr("<h2>The map</h2>"));
  report.map_asked = false;
  EXPECT_THAT(report_page(report), Not(HasSubstr("<h2>The map</h2>")));
}

TEST(ReportPage, PicturesThatCannotBeShownHideNoOthers) {
  MapReport report = report_of("cart");
  MapReport::Suspicious lost = report.suspicious[0];
  lost.edge.id = {{2, 9}, 1};
  lost.svg.clear();
  lost.not_shown = {Reason::NO_SUCH_EDGE, "its session was deleted meanwhile"};
  report.suspicious.insert(report.suspicious.begin(), lost);
  const std::string page = report_page(report);
  EXPECT_THAT(page, HasSubstr("the-pair"));
  EXPECT_THAT(page, HasSubstr("The pictures of <code>2:9/1</code>, whose suspicion is 0.75, cannot be shown: "));
  EXPECT_THAT(page, HasSubstr("NO_SUCH_EDGE: its session was deleted meanwhile"));
  EXPECT_EQ(report.shown(), 1u);
}

TEST(ReportPage, SuspiciousClosuresAreCountedWithoutPicturesToo) {
  MapReport report = report_of("cart");
  report.suspicious[0].svg.clear();
  for (std::uint32_t i = 0; i < 7; ++i) {
    report.suspicious.push_back(report.suspicious[0]);
    report.suspicious.back().edge.id.frame.index = 100 + i;
  }
  client::Edge harmless;
  harmless.suspicion = client::Suspicion{0.2, {}, {}};
  report.suspicious.push_back({harmless});
  EXPECT_EQ(report.suspicious_count(), 8u);
  const std::string page = report_page(report);
  EXPECT_THAT(page, HasSubstr("8 of those in force have a suspicion of 0.5 or more"));
  EXPECT_THAT(page, Not(HasSubstr("A wrong one shows in its pictures"))) << "there are none";
  const auto findings = findings_of(report);
  EXPECT_THAT(findings, ::testing::Contains(HasSubstr("\"relmap edges --explain 2:7/1\" says why")));
  EXPECT_THAT(findings, ::testing::Contains(HasSubstr("8 of those in force have a suspicion of 0.5 or more.")));
}

TEST(ReportPage, OfAnEmptyMapThereIsNothingToLookAt) {
  const MapReport empty;
  EXPECT_THAT(findings_of(empty), IsEmpty());
  EXPECT_THAT(report_page(empty), HasSubstr("Nothing needs a look."));
}

}  // namespace
}  // namespace relmap::cli
