// Places of real photographs through the programs: mono sessions by relmap-frontend, answers by relmapd with the
// shipped vocabulary and geometry. Floors that look alike are not confused, and pictures of one building by ten people
// find each other among hundreds of other places.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "storage/testing/temporary_folder.h"
#include "tests/support/data_test.h"
#include "tests/support/process.h"
#include "tests/support/published.h"
#include "tests/support/running_daemon.h"
#include "tests/support/simulated_recording.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> pictures_of(const std::string& folder) {
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

// A daemon whose map is mono sessions.
class PhotographedMap {
 public:
  PhotographedMap() : daemon_({.data = folder_ / "map", .lcm = lcm_, .more = {}}), client_(daemon_.client()) {}

  client::Client& client() { return *client_; }

  // A session of these pictures, in this order.
  void add(const std::string& name, const std::vector<std::string>& pictures) {
    const std::string photos = folder_ / ("photos/" + name);
    fs::create_directories(photos);
    char number[24];
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      std::snprintf(number, sizeof number, "%06zu", i);
      fs::create_symlink(pictures[i], photos + "/" + number + fs::path(pictures[i]).extension().string());
    }
    const Finished done =
        run_program({built_program("relmap-frontend"), "--source", "images", "--mono", photos, "--robot", "camera",
                     "--lcm", lcm_, "--spool", folder_ / ("spool " + name), "--quiet"},
                    std::chrono::minutes(2));
    if (done.exit_code != 0) throw std::runtime_error(name + ": " + done.standard_error);
  }
  // By the names that they were added with.
  std::map<SessionNumber, std::string> sessions() {
    std::map<SessionNumber, std::string> names;
    for (const client::Session& session : client_->sessions().or_throw()) names[session.number] = session.name;
    return names;
  }

 private:
  const storage::TemporaryFolder folder_;
  const std::string lcm_ = random_lcm_url();
  RunningDaemon daemon_;
  std::unique_ptr<client::Client> client_;
};

using PlacesData = DataTest;
using LongPlacesData = DataTest;

// Floors of a building that look alike: a session for each walk, named by its floor and itself, and pictures whose
// floor is asked for.
struct Tower {
  struct Question {
    std::string picture, floor;
  };
  std::map<std::string, std::vector<std::string>> walks;
  std::vector<Question> questions;

  void add(const std::string& folder) {
    std::ifstream list(folder + "/dataset.csv");
    std::string line;
    std::getline(list, line);
    while (std::getline(list, line)) {
      std::istringstream fields(line);
      std::string picture, floor, split;
      std::getline(fields, picture, ',');
      std::getline(fields, floor, ',');
      std::getline(fields, split, ',');
      const std::string path = folder + "/" + picture;
      if (split == "query")
        questions.push_back({path, floor});
      else
        walks[floor + " " + fs::path(picture.substr(0, picture.rfind("_frame_"))).filename().string()].push_back(path);
    }
  }
};

struct Counts {
  int questions = 0, verified = 0, wrong = 0, ambiguous = 0;

  void print(const char* what) const {
    std::printf("%s: of %d questions %d verified, %d of them on a wrong floor; %d ambiguous\n", what, questions,
                verified, wrong, ambiguous);
  }
};

// Thresholds (server/place/uniqueness.h) were chosen on six of fourteen floors, and are judged on the others.
struct CountsOnFloors {
  Counts chosen, judged;
};

// Asks every `step`-th question of a map of all floors.
void ask_on_floors(const std::string& data, std::size_t step, CountsOnFloors& floors) {
  const std::set<std::string> chosen_on{"basement0", "basement2", "basement4", "floor4", "floor11", "floor13"};
  Tower tower;
  tower.add(data + "/ie_tower");
  tower.add(data + "/ie_tower_more");
  ASSERT_EQ(tower.questions.size(), 265u);
  PhotographedMap map;
  for (const auto& [name, pictures] : tower.walks) map.add(name, pictures);
  ASSERT_TRUE(map.client().wait_idle().ok());
  const auto names = map.sessions();

  auto& [chosen, judged] = floors;
  for (std::size_t i = 0; i < tower.questions.size(); i += step) {
    const auto& [picture, floor] = tower.questions[i];
    client::View view;
    view.left = read_text(picture);
    const auto answer = map.client().match_image(view, {.max_verified = 20});
    ASSERT_TRUE(answer.ok()) << picture << ": " << answer.status().to_string();
    Counts& counts = chosen_on.count(floor) ? chosen : judged;
    ++counts.questions;
    counts.verified += answer->nothing_verified.ok();
    counts.ambiguous += answer->nothing_verified.reason() == Reason::AMBIGUOUS_PLACE;
    bool wrong = false;
    for (const client::PlaceMatch& place : answer->places)
      if (place.verification != client::Verification::kNone)
        wrong = wrong || !names.at(place.frame.session).starts_with(floor + " ");
    counts.wrong += wrong;
    if (wrong) std::printf("wrong: %s\n", picture.c_str());
  }
  chosen.print("floors that thresholds were chosen on");
  judged.print("floors that they are judged on");
  for (const Counts& counts : {chosen, judged}) {
    EXPECT_LE(counts.wrong, std::max(1, counts.verified / 50));
    EXPECT_GE(4 * counts.verified, counts.questions);
    EXPECT_GT(counts.ambiguous, 0);
  }
}

const char* const kFigures = "docs/figures.md";

// Compares with the row of docs/figures.md that begins with `name`.
void expect_as_published(const Counts& counts, const std::string& name) {
  const auto row = published(kFigures, "\\| " + name + " \\| ([0-9]+) \\| [^|]*\\| ([0-9]+) \\| ([0-9]+) \\|");
  EXPECT_EQ(counts.questions, row.at(0)) << name;
  EXPECT_GE(counts.verified, row.at(1) / 1.5) << name;
  EXPECT_LE(counts.wrong, row.at(2)) << name;
}

TEST_F(PlacesData, OfFourteenFloorsThatLookAlikeVerifiedMeansUnique) {
  CountsOnFloors floors;
  ASSERT_NO_FATAL_FAILURE(ask_on_floors(data_, 4, floors));
  expect_as_published(floors.chosen, "fourteen floors that look alike, the pictures on which thresholds were chosen");
  expect_as_published(floors.judged, "the same floors, the pictures on which the thresholds are tested");
}

TEST_F(LongPlacesData, OfFourteenFloorsThatLookAlikeVerifiedMeansUnique) {
  CountsOnFloors floors;
  ASSERT_NO_FATAL_FAILURE(ask_on_floors(data_, 1, floors));
  const auto all =
      published(kFigures, "Of all ([0-9]+) pictures of the fourteen floors ([0-9]+) are confirmed, one of");
  EXPECT_EQ(floors.chosen.questions + floors.judged.questions, all.at(0));
  EXPECT_GE(floors.chosen.verified + floors.judged.verified, all.at(1) / 1.5);
  EXPECT_LE(floors.chosen.wrong + floors.judged.wrong, 1);
}

TEST_F(PlacesData, APictureOfOneFloorIsNeverConfirmedOnAnother) {
  Tower tower;
  tower.add(data_ + "/ie_tower");
  const auto& [walks, questions] = tower;
  ASSERT_EQ(questions.size(), 48u);

  PhotographedMap map;
  for (const auto& [name, pictures] : walks) map.add(name, pictures);
  ASSERT_TRUE(map.client().wait_idle().ok());
  EXPECT_TRUE(map.client().edges().or_throw().empty()) << "mono sessions stay unconnected";
  const auto names = map.sessions();

  int confirmed = 0, first_right = 0;
  for (const Tower::Question& question : questions) {
    client::View view;
    view.left = read_text(question.picture);
    const auto answer = map.client().match_image(view, {.max_verified = 20});
    ASSERT_TRUE(answer.ok()) << question.picture << ": " << answer.status().to_string();
    const auto on_its_floor = [&](const client::PlaceMatch& place) {
      return names.at(place.frame.session).starts_with(question.floor + " ");
    };
    for (const client::PlaceMatch& place : answer->places) {
      EXPECT_EQ(place.verification == client::Verification::kNone, !place.unverified.ok());
      if (place.verification == client::Verification::kNone) continue;
      EXPECT_TRUE(on_its_floor(place)) << question.picture << " on " << names.at(place.frame.session) << ", "
                                       << place.inliers << " inliers";
      EXPECT_GE(place.inliers, 30u);
    }
    confirmed += answer->nothing_verified.ok();
    first_right += !answer->places.empty() && on_its_floor(answer->places.front());
  }
  std::printf("tower: %zu questions, %d confirmed, none on another floor; %d right by the first place\n",
              questions.size(), confirmed, first_right);
  const auto row = published(kFigures,
                             "\\| two floors that look alike \\(ie_tower\\) \\| ([0-9]+) \\| ([0-9]+) \\| ([0-9]+) \\| "
                             "0 \\|");
  EXPECT_EQ(static_cast<double>(questions.size()), row.at(0));
  EXPECT_GE(first_right, row.at(1) - 2);
  EXPECT_GE(confirmed, row.at(2) - 3);
}

TEST_F(PlacesData, PhotographsOfOneFrontFindEachOtherAmongFiveHundredPlaces) {
  const storage::TemporaryFolder folder;
  record_simulation(folder / "street", {"--seed", "3", "--pairs", "215", "--laps", "1"});
  std::vector<std::string> tower;
  for (const auto& entry : fs::recursive_directory_iterator(data_ + "/ie_tower"))
    if (entry.path().extension() == ".jpg") tower.push_back(entry.path().string());
  std::sort(tower.begin(), tower.end());

  PhotographedMap map;
  map.add("lund", pictures_of(data_ + "/lund_street29/images"));
  map.add("tower", tower);
  map.add("corridor", pictures_of(data_ + "/rtabmap_loop84/images"));
  map.add("street", pictures_of(folder / "street/image_0"));
  // Each by another camera.
  const auto photographs = pictures_of(data_ + "/landmarks/sacre_coeur10");
  ASSERT_EQ(photographs.size(), 10u);
  for (std::size_t i = 0; i < photographs.size(); ++i) map.add("front " + std::to_string(i), {photographs[i]});
  ASSERT_TRUE(map.client().wait_idle().ok());
  const auto names = map.sessions();
  const auto shows_the_front = [&](const client::PlaceMatch& place) {
    return names.at(place.frame.session).starts_with("front");
  };

  int first = 0, confirmed = 0;
  std::size_t others = 0;
  for (const client::Session& session : map.client().sessions().or_throw()) {
    if (!session.name.starts_with("front")) {
      others += session.frames;
      continue;
    }
    client::View view;
    view.frame = FrameId{session.number, session.first};
    const auto answer = map.client().match_image(view, {.max_verified = 20, .thumbnails = true});
    ASSERT_TRUE(answer.ok()) << session.name << ": " << answer.status().to_string();
    first += !answer->places.empty() && shows_the_front(answer->places.front());
    for (const client::PlaceMatch& place : answer->places) {
      EXPECT_NE(place.frame.session, session.number);
      EXPECT_FALSE(place.thumbnail.empty());
      EXPECT_TRUE(place.verification == client::Verification::kNone || shows_the_front(place)) << session.name;
    }
    confirmed += answer->nothing_verified.ok();
  }
  std::printf("front: %d of 10 find another photograph of it first among %zu other places, %d confirmed\n", first,
              others, confirmed);
  const auto row =
      published(kFigures, "among ([0-9]+) other places: [^|]*\\| ([0-9]+) \\| ([0-9]+) \\| ([0-9]+) \\| 0 \\|");
  EXPECT_NEAR(static_cast<double>(others), row.at(0), 7);
  EXPECT_EQ(static_cast<double>(photographs.size()), row.at(1));
  EXPECT_GE(first, row.at(2) - 1);
  EXPECT_GE(confirmed, row.at(3) - 1);
}

}  // namespace
}  // namespace relmap::testing
