#include "client/map_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>

#include "client/drawing.h"
#include "client/label_placement.h"
#include "client/map_plan.h"
#include "client/testing/svg.h"

namespace relmap::client {
namespace {

class MapPictureFile : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() / (std::string("relmap_map_picture_") + info->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  static std::string contents(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    std::ostringstream out;
    out << in.rdbuf();
    return out.str();
  }
  std::filesystem::path folder_;
};

MapPicture circle(int frames = 60) {
  MapPicture picture;
  picture.parts.resize(1);
  picture.parts[0].root = {1, 0};
  std::vector<MapPicture::Frame>& placed = picture.parts[0].frames;
  for (int k = 0; k < frames; ++k) {
    const double angle = 2 * M_PI * k / frames;
    SE3 T;
    T.R = so3_exp(Vector3(0, angle, 0));
    T.t = Vector3(-10 * std::cos(angle), 0, 10 * std::sin(angle));
    placed.push_back({{1, static_cast<std::uint32_t>(k)}, T});
    if (k > 0) picture.edges.push_back({placed[k - 1].id, placed[k].id, MapPicture::EdgeKind::kMotion});
  }
  return picture;
}

// A part of `frames` frames of a new session, on a line.
void add_part(MapPicture& picture, SessionNumber session, std::uint32_t frames) {
  MapPicture::Part& part = picture.parts.emplace_back();
  part.root = {session, 0};
  for (std::uint32_t k = 0; k < frames; ++k) {
    part.frames.push_back({{session, k}, SE3{Matrix3::Identity(), Vector3(0, 0, k)}});
    if (k > 0) picture.edges.push_back({{session, k - 1}, {session, k}, MapPicture::EdgeKind::kMotion});
  }
  picture.session_names[session] = "robot-" + std::to_string(session);
}

TEST_F(MapPictureFile, SvgHoldsAllThatThePictureShows) {
  MapPicture picture = circle();
  picture.title = "Street <A> & B";
  picture.session_names[1] = "robot-7";
  picture.labels = {{{1, 30}, "loading dock"}, {{9, 9}, "elsewhere"}};
  picture.edges.push_back({{1, 0}, {1, 59}, MapPicture::EdgeKind::kLoopAccepted});
  picture.edges.push_back({{1, 5}, {1, 40}, MapPicture::EdgeKind::kLoopCandidate});
  picture.edges.push_back({{1, 5}, {9, 9}, MapPicture::EdgeKind::kLoopAccepted});  // leads out of the picture
  picture.route = MapPicture::Route{{{1, 3}, {1, 4}, {1, 5}}, "route to the loading dock, 12 m"};
  ASSERT_TRUE(write_map_picture(picture, path("map.svg")).ok());
  const std::string svg = contents(path("map.svg"));
  EXPECT_THAT(svg, ::testing::StartsWith("<svg "));
  EXPECT_THAT(svg, ::testing::EndsWith("</svg>\n"));
  for (const char* text : {"Street &lt;A&gt; &amp; B", "robot-7", "loading dock", "1 loop closure<",
                           "1 candidate closure<", "60 keyframes", "start", "end"})
    EXPECT_THAT(svg, ::testing::HasSubstr(text));
  EXPECT_THAT(svg, ::testing::Not(::testing::HasSubstr("elsewhere")));
  EXPECT_THAT(svg, ::testing::Not(::testing::HasSubstr("nan")));
}

TEST_F(MapPictureFile, MotionIsDrawnOnlyAlongEdges) {
  MapPicture whole = circle(3), broken = circle(3);
  broken.edges.pop_back();
  ASSERT_TRUE(write_map_picture(whole, path("whole.svg")).ok());
  ASSERT_TRUE(write_map_picture(broken, path("broken.svg")).ok());
  EXPECT_GT(count_in(contents(path("whole.svg")), "<polyline"), count_in(contents(path("broken.svg")), "<polyline"));
}

TEST_F(MapPictureFile, PngHasThePagesSizeAndContents) {
  MapPicture picture = circle();
  picture.png_scale = 1;
  ASSERT_TRUE(write_map_picture(picture, path("map.png")).ok());
  const std::string png = contents(path("map.png"));
  ASSERT_GT(png.size(), 5000U);
  EXPECT_EQ(png.substr(1, 3), "PNG");
  const auto number = [&](std::size_t at) {
    return static_cast<unsigned char>(png[at + 2]) * 256 + static_cast<unsigned char>(png[at + 3]);
  };
  EXPECT_EQ(number(16), 1200);
  EXPECT_GT(number(20), 500);
  EXPECT_LT(number(20), 1000);
}

std::vector<double> numbers_of(const std::string& svg) {
  std::vector<double> numbers;
  for (const char* at = svg.c_str(); *at;) {
    char* end = nullptr;
    const double number = std::isdigit(static_cast<unsigned char>(*at)) ? std::strtod(at, &end) : 0;
    if (end) numbers.push_back(number);
    at = end ? end : at + 1;
  }
  return numbers;
}
TEST_F(MapPictureFile, UnconnectedPartsAreDrawnApartEachWithItsScale) {
  MapPicture picture = circle();
  add_part(picture, 2, 9);
  add_part(picture, 3, 1);
  picture.edges.push_back({{1, 5}, {2, 5}, MapPicture::EdgeKind::kLoopCandidate});
  picture.edges.push_back({{1, 59}, {3, 0}, MapPicture::EdgeKind::kUnmeasuredMotion});
  ASSERT_TRUE(write_map_picture(picture, path("map.svg")).ok());
  const std::string svg = contents(path("map.svg")), said = said_in(svg);
  EXPECT_THAT(said, ::testing::HasSubstr("3 parts that nothing connects: their position relative to each other is not "
                                         "known."));
  for (const char* caption : {"Part 1 of 3", "Part 2 of 3", "Part 3 of 3", "in the frame of 1:0", "in the frame of 2:0",
                              "in the frame of 3:0"})
    EXPECT_EQ(count_in(said, caption), 1) << caption;
  EXPECT_EQ(count_in(said, "position relative to the other parts unknown"), 3) << "each says so of itself";
  int scales = 0;
  for (const SvgText& text : texts_of(svg))
    scales += text.text == "5 m" || text.text == "2 m" || text.text == "1 m" || text.text == "50 cm";
  EXPECT_EQ(scales, 3) << "bars";
  EXPECT_THAT(said, ::testing::HasSubstr("1 candidate closure from part to part not drawn"));
  EXPECT_THAT(said, ::testing::HasSubstr("1 step from part to part not drawn: nothing measured the motion"));
  expect_nothing_cut_off(svg);

  MapPicture alone = circle();
  ASSERT_TRUE(write_map_picture(alone, path("alone.svg")).ok());
  EXPECT_THAT(said_in(contents(path("alone.svg"))), ::testing::Not(::testing::HasSubstr("not known")));
}

// The position of a part on the page depends only on its own shape.
TEST_F(MapPictureFile, TheRelativePoseOfPartsDoesNotMatter) {
  MapPicture here = circle(), there = circle();
  add_part(here, 2, 9);
  add_part(there, 2, 9);
  here.turn_to_fit = there.turn_to_fit = false;
  for (MapPicture::Frame& frame : there.parts[1].frames) frame.T_root_frame.t += Vector3(1024, 0, -64);
  ASSERT_TRUE(write_map_picture(here, path("here.svg")).ok());
  ASSERT_TRUE(write_map_picture(there, path("there.svg")).ok());
  const std::vector<double> numbers = numbers_of(contents(path("here.svg")));
  EXPECT_THAT(numbers_of(contents(path("there.svg"))), ::testing::Pointwise(::testing::DoubleNear(0.02), numbers));
}

TEST_F(MapPictureFile, DashesAndDotsAreExplained) {
  MapPicture picture = circle();
  picture.edges[10].kind = MapPicture::EdgeKind::kUnmeasuredMotion;
  picture.edges[20].kind = MapPicture::EdgeKind::kCarriedMotion;
  picture.edges.push_back({{1, 5}, {1, 40}, MapPicture::EdgeKind::kLoopCandidate});
  picture.edges.push_back({{1, 6}, {1, 41}, MapPicture::EdgeKind::kLoopQuarantined});
  picture.edges.push_back({{1, 7}, {1, 42}, MapPicture::EdgeKind::kLoopRemoved});
  ASSERT_TRUE(write_map_picture(picture, path("map.svg")).ok());
  const std::string svg = contents(path("map.svg")), said = said_in(svg);
  for (const char* part :
       {"1 unmeasured step dashes: nothing measured this motion",
        "1 carried step dots: closures say that the robot was carried",
        "1 candidate closure not in force: nothing agrees, or motion contradicts",
        "1 quarantined closure outvoted: not in force", "1 removed closure taken out by an operator"})
    EXPECT_THAT(said, ::testing::HasSubstr(part));
  // A sample in the legend for each dashed line of the plan.
  EXPECT_EQ(count_in(svg, "stroke-dasharray"), 10);
  MapPicture plain = circle();
  ASSERT_TRUE(write_map_picture(plain, path("plain.svg")).ok());
  EXPECT_EQ(count_in(contents(path("plain.svg")), "stroke-dasharray"), 0);
  EXPECT_THAT(said_in(contents(path("plain.svg"))), ::testing::Not(::testing::HasSubstr("dashes")));
}

TEST_F(MapPictureFile, NoTextIsCutOff) {
  MapPicture picture = circle();
  for (SessionNumber session = 2; session <= 20; ++session) add_part(picture, session, session < 10 ? session : 1);
  picture.session_names[1] = "a_name_of_a_session_that_somebody_typed_without_any_space_2026-11-24T08:15:00";
  picture.session_names[2] = "evening survey of the second robot in the northern hall on the day before the fair";
  picture.title =
      "A title that is long enough to need more than one line, because somebody described the whole of the "
      "experiment in it, with its date and its place and the names of all who were there";
  picture.labels = {{{3, 1}, "corridor to the machine room behind the loading dock of the northern building"},
                    {{1, 0}, "WWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWW"}};
  picture.route = MapPicture::Route{{{1, 3}, {1, 4}, {1, 5}},
                                    "route to the corridor to the machine room behind the loading dock of the northern "
                                    "building, 1234.5 m, 2 h 12 min"};
  for (const double width : {600.0, 1200.0}) {
    picture.width = width;
    ASSERT_TRUE(write_map_picture(picture, path("map.svg")).ok());
    const std::string svg = contents(path("map.svg"));
    expect_nothing_cut_off(svg);
    std::string said = said_in(svg);
    EXPECT_THAT(said, ::testing::Not(::testing::HasSubstr("...")));
    said.erase(std::remove(said.begin(), said.end(), ' '), said.end());
    for (const char* whole : {"without_any_space_2026-11-24T08:15:00", "onthedaybeforethefair", "1234.5m,2h12min",
                              "thenamesofallwhowerethere"})
      EXPECT_THAT(said, ::testing::HasSubstr(whole));
  }
}

TEST_F(MapPictureFile, TheLegendCountsWhatIsNotDrawn) {
  MapPicture picture = circle();
  ASSERT_TRUE(write_map_picture(picture, path("all.svg")).ok());
  EXPECT_THAT(contents(path("all.svg")), testing::Not(testing::HasSubstr("mono session")));
  picture.mono_sessions = 3;
  ASSERT_TRUE(write_map_picture(picture, path("some.svg")).ok());
  EXPECT_THAT(contents(path("some.svg")), testing::HasSubstr(">3 mono sessions<"));
  EXPECT_THAT(contents(path("some.svg")), testing::HasSubstr(">not drawn: photographs have"));
}

TEST_F(MapPictureFile, SessionsAreNumberedIfThereAreMoreThanColours) {
  MapPicture picture;
  add_part(picture, 1, 30);
  for (SessionNumber session = 2; session <= 30; ++session) {
    MapPicture one;
    add_part(one, session, 30);
    for (MapPicture::Frame& frame : one.parts[0].frames) {
      frame.T_root_frame.t.x() = session;
      picture.parts[0].frames.push_back(frame);
    }
    picture.session_names[session] = "robot-" + std::to_string(session);
  }
  ASSERT_TRUE(write_map_picture(picture, path("many.svg")).ok());
  const std::string svg = contents(path("many.svg"));
  EXPECT_EQ(count_in(svg, ">17 robot-17 (30)<"), 1) << "in the legend";
  EXPECT_EQ(count_in(svg, ">17<"), 1) << "where it begins";
  expect_nothing_cut_off(svg);
}

// Their marks would hide what they drove.
TEST_F(MapPictureFile, HundredsOfSessionsInOnePartAreNotMarked) {
  MapPicture picture;
  add_part(picture, 1, 30);
  for (SessionNumber session = 2; session <= 41; ++session) {
    MapPicture one;
    add_part(one, session, 30);
    for (MapPicture::Frame& frame : one.parts[0].frames) {
      frame.T_root_frame.t.x() = session;
      picture.parts[0].frames.push_back(frame);
    }
    picture.edges.insert(picture.edges.end(), one.edges.begin(), one.edges.end());
  }
  const std::string svg = draw_map_picture(picture, PictureFormat::kSvg).or_throw();
  EXPECT_EQ(count_in(svg, "<circle"), 0);
  EXPECT_THAT(said_in(svg), ::testing::Not(::testing::HasSubstr("start and end")));
}

TEST_F(MapPictureFile, CountsAreThoseOfTheMapWhereThePictureShowsLess) {
  MapPicture picture = circle();
  add_part(picture, 2, 9);
  picture.edges.push_back({{1, 5}, {1, 40}, MapPicture::EdgeKind::kLoopAccepted});
  picture.session_keyframes = {{1, 12'345}, {2, 678}};
  picture.parts[0].keyframes = 12'345;
  picture.alike[MapPicture::EdgeKind::kLoopAccepted] = 2'000;
  const std::string said = said_in(draw_map_picture(picture, PictureFormat::kSvg).or_throw());
  for (const char* text : {"12,345 keyframes in the frame of 1:0", "9 keyframes in the frame of 2:0", "678 keyframes",
                           "2,001 loop closures 1 drawn: of those that join the same stretches one"})
    EXPECT_THAT(said, ::testing::HasSubstr(text));
}

TEST_F(MapPictureFile, TheSmallestOfVeryManyPartsAreOnlyCounted) {
  MapPicture picture = circle();
  for (SessionNumber session = 2; session <= 60; ++session) add_part(picture, session, 2);
  ASSERT_TRUE(write_map_picture(picture, path("many.svg")).ok());
  const std::string svg = contents(path("many.svg"));
  const std::string said = said_in(svg);
  EXPECT_THAT(said, ::testing::HasSubstr("60 parts that nothing connects"));
  EXPECT_THAT(said, ::testing::HasSubstr("36 parts of 2 keyframes or fewer are not drawn."));
  EXPECT_THAT(said, ::testing::HasSubstr("and 20 more sessions"));
  expect_nothing_cut_off(svg);
}

TEST_F(MapPictureFile, OfAVastMapOnlyWhatCanBeToldApartIsWritten) {
  constexpr int kFrames = 40'000;
  MapPicture picture = circle(kFrames);
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    picture.edges.push_back({{1, a % kFrames}, {1, b % kFrames}, MapPicture::EdgeKind::kLoopAccepted});
  };
  for (std::uint32_t k = 0; k < kFrames; ++k) join(k, k + 1000);
  ASSERT_TRUE(write_map_picture(picture, path("vast.svg")).ok());
  const std::string svg = contents(path("vast.svg"));
  EXPECT_LT(svg.size(), 2'000'000u) << "all of it takes 13 MB";
  EXPECT_GT(count_in(svg, "<polyline"), 500) << "closures all around the circle";
  EXPECT_LT(count_in(svg, "<circle"), 20) << "marks at the ends of closures would hide the circle";
}

TEST_F(MapPictureFile, ASingleFrameIsFine) {
  ASSERT_TRUE(write_map_picture(circle(1), path("one.svg")).ok());
  expect_nothing_cut_off(contents(path("one.svg")));
}

TEST_F(MapPictureFile, TearsAreMarkedWithTheirSigmas) {
  MapPicture picture = circle();
  picture.edges.push_back({{1, 5}, {1, 40}, MapPicture::EdgeKind::kLoopAccepted});
  picture.tears = {{{1, 5}, {1, 40}, 17.25}, {{1, 5}, {9, 9}, 9}};
  picture.strained = {"1:40/1: 17.2 sigmas, 0.80 m"};
  const std::string torn = draw_map_picture(picture, PictureFormat::kSvg).or_throw();
  const std::string said = said_in(torn);
  EXPECT_THAT(said, ::testing::HasSubstr("17.2 sigmas"));
  EXPECT_THAT(said, ::testing::HasSubstr("2 tears"));
  EXPECT_THAT(said, ::testing::HasSubstr("closures that the picture stretches most 1:40/1: 17.2 sigmas, 0.80 m"));
  EXPECT_THAT(said, ::testing::Not(::testing::HasSubstr("9.0 sigmas"))) << "it leads out of the picture";
  expect_nothing_cut_off(torn);
  picture.tears.clear();
  const std::string whole = draw_map_picture(picture, PictureFormat::kSvg).or_throw();
  EXPECT_GT(count_in(torn, "<polyline"), count_in(whole, "<polyline"));
  EXPECT_THAT(said_in(whole), ::testing::Not(::testing::HasSubstr("tear")));
}

TEST_F(MapPictureFile, AScaleColoursFramesByTheirValuesAndIsExplained) {
  MapPicture picture = circle(40);
  for (std::size_t k = 0; k < 40; ++k) picture.parts[0].frames[k].value = static_cast<double>(k) / 39;
  picture.parts[0].frames[20].value = std::numeric_limits<double>::quiet_NaN();
  picture.scale = MapPicture::Scale{"colour: uncertainty", "0 m", "1.25 m (one sigma)"};
  const std::string svg = draw_map_picture(picture, PictureFormat::kSvg).or_throw();
  EXPECT_THAT(said_in(svg), ::testing::HasSubstr("colour: uncertainty 0 m"));
  EXPECT_THAT(said_in(svg), ::testing::HasSubstr("1.25 m (one sigma)"));
  std::set<std::string> strokes;
  for (std::size_t at = svg.find("stroke=\"#"); at != std::string::npos; at = svg.find("stroke=\"#", at + 1))
    strokes.insert(svg.substr(at + 8, 7));
  EXPECT_GT(strokes.size(), 30u) << "a colour for each value";
  expect_nothing_cut_off(svg);
}

// Where the rectangles of the colour bar lie: all polygons with four corners and two different x.
std::vector<Box> rectangles_of(const std::string& svg) {
  constexpr char kBegin[] = "<polygon points=\"";
  std::vector<Box> boxes;
  for (std::size_t at = svg.find(kBegin); at != std::string::npos; at = svg.find(kBegin, at + 1)) {
    Vector2 a, b, c;
    if (std::sscanf(svg.c_str() + at + sizeof kBegin - 1, "%lf,%lf %lf,%lf %lf,%lf", &a.x(), &a.y(), &b.x(), &b.y(),
                    &c.x(), &c.y()) == 6 &&
        a.y() == b.y() && b.x() == c.x())
      boxes.push_back({a, c});
  }
  return boxes;
}

TEST_F(MapPictureFile, AScaleIsOneBarWithWholeStampsAndWithoutSessions) {
  MapPicture picture = circle(40);
  picture.session_names[1] = "a drive in the morning";
  for (std::size_t k = 0; k < 40; ++k) picture.parts[0].frames[k].value = static_cast<double>(k) / 39;
  picture.scale = MapPicture::Scale{"colour: when it was driven", "2026-11-30 22:10:05 UTC", "2026-12-01 06:00:00 UTC"};
  for (const double width : {600.0, 1200.0}) {
    picture.width = width;
    const std::string svg = draw_map_picture(picture, PictureFormat::kSvg).or_throw();
    EXPECT_THAT(said_in(svg), ::testing::Not(::testing::HasSubstr("a drive in the morning")));
    EXPECT_THAT(said_in(svg), ::testing::Not(::testing::HasSubstr("not known")));
    double first = 0, last = 0;
    for (const SvgText& text : texts_of(svg)) {
      if (text.text.ends_with("22:10:05 UTC")) first = text.y;
      if (text.text.ends_with("06:00:00 UTC")) last = text.y;
    }
    // A break within a number would be a space there.
    for (const std::string& whole : {picture.scale->low, picture.scale->high})
      EXPECT_THAT(said_in(svg), ::testing::HasSubstr(whole));
    std::vector<Box> bar;
    for (const Box& box : rectangles_of(svg))
      if (box.size().x() < 31 && box.size().x() > 29) bar.push_back(box);
    ASSERT_GT(bar.size(), 20u);
    for (std::size_t k = 1; k < bar.size(); ++k) {
      EXPECT_EQ(bar[k].high.y(), bar[0].high.y()) << "in one piece";
      EXPECT_LT(bar[k].low.y(), bar[k - 1].high.y());
    }
    EXPECT_LT(bar[0].low.y(), first);
    EXPECT_LT(first, last);
    EXPECT_GE(bar[0].high.y(), last);
  }
  picture.parts[0].frames[7].value = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(said_in(draw_map_picture(picture, PictureFormat::kSvg).or_throw()), ::testing::HasSubstr("not known"));
  picture.scale = MapPicture::Scale{"colour: when it was driven", "", ""};
  for (const Box& box : rectangles_of(draw_map_picture(picture, PictureFormat::kSvg).or_throw()))
    EXPECT_GT(box.size().x(), 31) << "without values there is no bar";
}

// Beside the map, it would be as long as the page, most of which would be empty.
TEST_F(MapPictureFile, ALongLegendStandsBelowTheMapInColumns) {
  MapPicture picture;
  add_part(picture, 1, 60);
  for (SessionNumber session = 2; session <= 70; ++session) {
    MapPicture one;
    add_part(one, session, 60);
    for (MapPicture::Frame& frame : one.parts[0].frames) {
      frame.T_root_frame.t.x() = 0.2 * session;
      picture.parts[0].frames.push_back(frame);
    }
    picture.edges.insert(picture.edges.end(), one.edges.begin(), one.edges.end());
    picture.session_names[session] = "robot-" + std::to_string(session);
  }
  for (const double width : {600.0, 1200.0}) {
    picture.width = width;
    const std::string svg = draw_map_picture(picture, PictureFormat::kSvg).or_throw();
    expect_nothing_cut_off(svg);
    EXPECT_THAT(said_in(svg), ::testing::HasSubstr("and 30 more sessions"));
    Box panel{{0, 0}, {0, 0}};
    for (const Box& box : rectangles_of(svg))
      if (box.size().x() > panel.size().x() && box.low.x() > 0) panel = box;
    EXPECT_GT(panel.size().x(), 0.85 * width) << "the map has the width of the page";
    std::set<double> columns;
    std::vector<SvgText> names;
    for (const SvgText& text : texts_of(svg))
      if (text.text.find("robot-") != std::string::npos) {
        EXPECT_GT(text.y, panel.high.y());
        columns.insert(text.left);
        names.push_back(text);
      }
    EXPECT_GE(columns.size(), width > 1000 ? 4u : 2u);
    for (std::size_t i = 0; i < names.size(); ++i)
      for (std::size_t k = 0; k < i; ++k) EXPECT_FALSE(names[i].box().overlaps(names[k].box()));
    if (width > 1000) {
      EXPECT_GT(panel.size().y(), 0.35 * page_of(svg).second) << "the map is the main thing";
    }
  }
}

TEST_F(MapPictureFile, AShortLegendStaysBesideTheMap) {
  const std::string svg = draw_map_picture(circle(), PictureFormat::kSvg).or_throw();
  int beside = 0;
  for (const SvgText& text : texts_of(svg)) beside += text.text.starts_with("60 keyframes") && text.left > 900;
  EXPECT_EQ(beside, 1);
}

TEST_F(MapPictureFile, BadPicturesAreRefusedWithTheirReason) {
  EXPECT_EQ(write_map_picture(circle(), path("map.jpg")).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(write_map_picture({}, path("map.svg")).reason(), Reason::EMPTY_MAP);
  EXPECT_EQ(write_map_picture(circle(), path("no/such/folder/map.svg")).reason(), Reason::IO_ERROR);
  EXPECT_EQ(write_map_picture(circle(), path("no/such/folder/map.png")).reason(), Reason::IO_ERROR);
  MapPicture broken = circle();
  broken.parts[0].frames[3].T_root_frame.t.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(write_map_picture(broken, path("map.svg")).reason(), Reason::INVALID_ARGUMENT);
}

TEST(MapPlan, LooksFromAboveWithZUp) {
  const MapPlan plan({{0, 0, 0}, {10, -3, 0}, {10, 5, 20}}, 300, 400, false);
  EXPECT_DOUBLE_EQ(plan.points_per_metre(), 20);
  EXPECT_NEAR((plan.at({0, 7, 20}) - Vector2(50, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR((plan.at({10, 0, 0}) - Vector2(250, 400)).norm(), 0, 1e-9);
  EXPECT_NEAR((plan.heading(SE3{}) - Vector2(0, -1)).norm(), 0, 1e-9);
}

TEST(MapPlan, TurnsTheLongSideAcross) {
  std::vector<Vector3> line;
  for (int k = 0; k <= 20; ++k) line.emplace_back(k, 0, 2.0 * k);
  const MapPlan plan(line, 900, 600, true);
  EXPECT_NEAR(plan.points_per_metre(), 900 / std::hypot(20, 40), 0.1);
  for (const Vector3& p : line) {
    EXPECT_GE(plan.at(p).x(), -1e-6);
    EXPECT_LE(plan.at(p).x(), 900 + 1e-6);
    EXPECT_LE(plan.at(p).y(), plan.height() + 1e-6);
  }
  // The plan is turned, not mirrored: a right turn stays a right turn.
  const Vector2 a = plan.heading(SE3{}), b = plan.heading(SE3{so3_exp(Vector3(0, 0.5, 0)), Vector3::Zero()});
  EXPECT_GT(a.x() * b.y() - a.y() * b.x(), 0);
}

TEST(LabelPlacement, TextsHideNeitherEachOtherNorTheTrajectory) {
  const Box area{{0, 0}, {400, 300}};
  LabelPlacement placement(area);
  std::vector<Vector2> way;
  for (int x = 0; x <= 400; x += 4) way.emplace_back(x, 150);
  for (const Vector2& p : way) placement.avoid(p);
  std::vector<Box> placed;
  for (int k = 0; k < 6; ++k) placed.push_back(placement.place({180.0 + 8 * k, 150}, {70, 16}));
  for (std::size_t i = 0; i < placed.size(); ++i) {
    EXPECT_TRUE(area.contains(placed[i].low) && area.contains(placed[i].high));
    for (std::size_t j = 0; j < i; ++j) EXPECT_FALSE(placed[i].overlaps(placed[j])) << i << " " << j;
    for (const Vector2& p : way) EXPECT_FALSE(placed[i].contains(p));
  }
}

TEST(LabelPlacement, TextsStayInsideTheArea) {
  const Box area{{10, 10}, {200, 100}};
  LabelPlacement placement(area);
  for (const Vector2& anchor : {Vector2(12, 12), Vector2(198, 50), Vector2(100, 98)}) {
    const Box box = placement.place(anchor, {150, 20});
    EXPECT_TRUE(area.contains(box.low) && area.contains(box.high)) << anchor.transpose();
  }
}

}  // namespace
}  // namespace relmap::client
