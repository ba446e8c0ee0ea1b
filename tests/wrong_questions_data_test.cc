// Queries with a mistake: exchanged eyes, a right picture of another time, a wrong camera, a picture that is not
// rectified. None is answered wrongly, and queries without a mistake are answered as before.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/data_test.h"
#include "tests/support/drive_evaluation.h"
#include "tests/support/euroc_truth.h"
#include "tests/support/process.h"
#include "tests/support/streamed_sessions.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;

// Every second pair of a recording is mapped; the pairs in between are queries.
struct Recording {
  std::string name;
  std::string source, left, right;  // layout, and the eyes' folders
  std::vector<std::string> more;    // arguments of relmap-frontend
  int exit_code = 0;
  std::size_t from = 15, step = 4;  // pairs that are asked for
  bool small = false;               // pictures of 320 x 240 pixels
  double metres = 0.15;             // as well as the truth tells the way between two pairs near each other
};

std::string name_of(const ::testing::TestParamInfo<Recording>& info) { return info.param.name; }

// Of a question without a mistake makes one with it.
struct Mistake {
  std::string name;
  std::function<void(client::View& view, std::size_t pair)> make;
  std::vector<Reason> reasons;  // that it may be refused for
  // An answer is no worse than that of the left picture alone: the mistake harms nothing where it is not found.
  bool harmless = false;
  bool slight = false;  // small pictures tell it only now and then
  // Calibrations are no better: it is answered, and the covariance knows of it.
  bool tolerable = false;
};

class WrongQuestions : public DataTest, public ::testing::WithParamInterface<Recording> {
 protected:
  void SetUp() override {
    DataTest::SetUp();
    if (IsSkipped()) return;
    const Recording& recording = GetParam();
    folder_ = data_ + "/" + recording.name;
    sessions_.stream(recording.source, folder_, "first", recording.more, recording.exit_code);
    lefts_ = pictures(recording.left);
    rights_ = pictures(recording.right);
    session_ = sessions_.client().sessions().or_throw().at(0);
    if (recording.source == "euroc")
      truth_ = read_euroc_truth(folder_);
    else if (fs::exists(folder_ + "/poses_gt.txt"))
      truth_ = read_truth(folder_).or_throw();
    for (std::size_t pair = recording.from; pair < lefts_.size(); pair += recording.step)
      if (pair % 2 == 1) asked_.push_back(pair);
    for (const std::size_t pair : asked_)
      if (const auto answer = sessions_.client().localise(question(pair, true)); answer.ok()) well_[pair] = *answer;
  }

  std::vector<std::string> pictures(const std::string& eye) const {
    std::vector<std::string> files;
    for (const auto& entry : fs::directory_iterator(folder_ + "/" + eye))
      if (entry.path().extension() != ".yaml") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
  }

  std::string right(std::size_t pair) const { return read_text(rights_.at(pair)); }
  client::View question(std::size_t pair, bool stereo) const {
    client::View view;
    view.left = read_text(lefts_[pair]);
    if (stereo) view.right = right(pair);
    view.camera = session_.number;
    return view;
  }
  // With a camera that is the session's but for what `change` does to it.
  std::function<void(client::View&, std::size_t)> with_camera(const std::function<void(StereoCamera&)>& change) const {
    StereoCamera camera = session_.camera;
    change(camera);
    return [camera](client::View& view, std::size_t) { view.camera = camera; };
  }

  // Off from the truth; where there is none, from what the pair itself is answered.
  double metres_off(const client::Localisation& answer, std::size_t pair) {
    client::Client& client = sessions_.client();
    if (truth_.poses.empty()) {
      const client::Localisation& well = well_.at(pair);
      const SE3 way =
          answer.frame == well.frame ? SE3() : client.transform_between(answer.frame, well.frame).or_throw().T_ab;
      return (answer.T_frame_view.t - (way * well.T_frame_view).t).norm();
    }
    const std::int64_t time = client.frame(answer.frame).or_throw().time_us - session_.first_time_us - 2000;
    const auto at = std::lower_bound(truth_.time_us.begin(), truth_.time_us.end(), time) - truth_.time_us.begin();
    const SE3 truth = truth_.poses.at(static_cast<std::size_t>(at)).inverse() * truth_.poses.at(pair);
    return (answer.T_frame_view.t - truth.t).norm();
  }

  struct Outcome {
    std::size_t answered = 0, wrong = 0;
    std::map<std::string, int> refused;
    double worst = 0;            // metres
    std::vector<double> sigmas;  // metres
  };
  // Wrong: further off than the truth can be, and than three sigmas.
  Outcome ask(const std::function<client::View(std::size_t)>& view_of) {
    Outcome outcome;
    for (const std::size_t pair : asked_) {
      const auto answer = sessions_.client().localise(view_of(pair));
      if (!answer.ok()) {
        ++outcome.refused[std::string(reason_name(answer.reason()))];
        continue;
      }
      ++outcome.answered;
      const double off = metres_off(*answer, pair);
      const double sigma = std::sqrt(answer->covariance.topLeftCorner<3, 3>().trace());
      outcome.worst = std::max(outcome.worst, off);
      outcome.sigmas.push_back(sigma);
      outcome.wrong += off > std::max(GetParam().metres, 3 * sigma);
    }
    return outcome;
  }
  void print(const std::string& name, Outcome outcome) const {
    std::sort(outcome.sigmas.begin(), outcome.sigmas.end());
    std::printf("%s, %s: %zu of %zu answered, %zu wrong, worst %.2f m, median sigma %.3f m;", GetParam().name.c_str(),
                name.c_str(), outcome.answered, asked_.size(), outcome.wrong, outcome.worst,
                outcome.sigmas.empty() ? 0 : outcome.sigmas[outcome.sigmas.size() / 2]);
    for (const auto& [reason, count] : outcome.refused) std::printf(" %d %s", count, reason.c_str());
    std::printf("\n");
  }

  std::vector<Mistake> mistakes() const {
    const std::vector<Reason> eyes{Reason::NOT_STEREO, Reason::ROWS_APART, Reason::WRONG_CALIBRATION};
    const auto later = [this](std::size_t pairs) {
      return [this, pairs](client::View& view, std::size_t pair) {
        view.right = right(std::min(pair + pairs, rights_.size() - 1));
      };
    };
    std::vector<Mistake> all{
        {"the eyes exchanged", [](client::View& view, std::size_t) { std::swap(view.left, view.right); }, eyes},
        {"the left picture twice", [](client::View& view, std::size_t) { view.right = view.left; }, eyes},
        {"a right picture of the next pair", later(1), eyes, true},
        {"a right picture of three pairs later", later(3), eyes, true},
    };
    if (GetParam().source == "euroc") {
      all.push_back({"raw pictures that are said to be rectified",
                     [](client::View& view, std::size_t) { view.rectified = true; }, eyes});
      return all;
    }
    for (const double factor : {0.8, 0.9, 1.05, 1.1})
      all.push_back({"a focal length " + std::to_string(factor) + " times",
                     with_camera([&](StereoCamera& camera) { camera.f *= factor; }), eyes, false,
                     std::abs(factor - 1) < 0.06});
    for (const double factor : {0.975, 1.025})
      all.push_back({"a focal length " + std::to_string(factor) + " times",
                     with_camera([&](StereoCamera& camera) { camera.f *= factor; }), eyes, false, false, true});
    for (const double share : {0.006})
      all.push_back({"a principal point " + std::to_string(share) + " widths away",
                     with_camera([&](StereoCamera& camera) { camera.cx += share * camera.width; }), eyes, false, false,
                     true});
    for (const double factor : {0.8, 1.25})
      all.push_back({"a baseline " + std::to_string(factor) + " times",
                     with_camera([&](StereoCamera& camera) { camera.baseline *= factor; }), eyes, false, true});
    for (const double share : {0.03})
      all.push_back({"a principal point " + std::to_string(share) + " widths away",
                     with_camera([&](StereoCamera& camera) { camera.cx += share * camera.width; }), eyes, false, true});
    return all;
  }

  StreamedSessions sessions_{{"--deterministic"}};
  std::string folder_;
  std::vector<std::string> lefts_, rights_;
  client::Session session_;
  DriveTruth truth_;
  std::vector<std::size_t> asked_;
  std::map<std::size_t, client::Localisation> well_;  // of the pair without a mistake
};

TEST_P(WrongQuestions, AreNotAnsweredWrongly) {
  Outcome alone;  // the left picture
  for (const bool stereo : {true, false}) {
    const Outcome well = ask([&](std::size_t pair) { return question(pair, stereo); });
    print(stereo ? "a pair" : "a picture", well);
    EXPECT_EQ(well.answered, asked_.size());
    EXPECT_EQ(well.wrong, 0u);
    alone = well;
  }
  std::size_t asked = 0, wrong = 0, slightly = 0, wrong_of_slight = 0;
  for (const Mistake& mistake : mistakes())
    for (const bool stereo : {false, true}) {
      const bool lenient = mistake.slight && GetParam().small;
      const bool of_the_right_eye = !mistake.name.starts_with("a focal") && !mistake.name.starts_with("a principal") &&
                                    !mistake.name.starts_with("raw");
      if (of_the_right_eye && !stereo) continue;
      const Outcome outcome = ask([&](std::size_t pair) {
        client::View view = question(pair, stereo);
        mistake.make(view, pair);
        return view;
      });
      print(mistake.name + (stereo ? "" : ", one picture"), outcome);
      if (mistake.tolerable) {
        slightly += asked_.size();
        wrong_of_slight += outcome.wrong;
        EXPECT_GE(outcome.answered, asked_.size() / 2) << mistake.name;
      } else if (!lenient) {
        asked += asked_.size();
        wrong += outcome.wrong;
      }
      EXPECT_LE(outcome.wrong, lenient ? asked_.size() / 3 : 1) << mistake.name;
      for (const auto& [reason, count] : outcome.refused) {
        const bool named = reason == "TOO_FEW_INLIERS" ||
                           std::any_of(mistake.reasons.begin(), mistake.reasons.end(),
                                       [&](Reason expected) { return reason_name(expected) == reason; });
        EXPECT_TRUE(named) << mistake.name << ": " << reason;
      }
      if (mistake.harmless) {
        EXPECT_LE(outcome.worst, alone.worst + 0.05) << mistake.name;
      } else if (!lenient && !mistake.tolerable) {
        EXPECT_LE(outcome.answered, asked_.size() / 7) << mistake.name;
      }
    }
  std::printf("%s: %zu questions with a mistake that can be told, %zu answered wrongly\n", GetParam().name.c_str(),
              asked, wrong);
  EXPECT_LE(wrong, std::max<std::size_t>(1, asked / 200));
  std::printf("%s: %zu questions with a calibration that is slightly off, %zu answered wrongly\n",
              GetParam().name.c_str(), slightly, wrong_of_slight);
  EXPECT_LE(wrong_of_slight, slightly / 50);
  sessions_.stop();  // throws if a camera is in doubt: none is
}

const Recording kShort[] = {
    {"kitti_odom_06_first51", "kitti", "image_0", "image_1", {"--every", "2"}},
    {"euroc_v101_keyframes100", "euroc", "cam0", "cam1", {"--all-keyframes", "--every", "2"}, 5, 15, 4, false, 0.1},
};
const Recording kLong[] = {
    {"kitti_raw_0926_1405", "kitti", "image_0", "image_1", {"--every", "2"}, 0, 15, 20},
    {"kitti_odom_00_first201", "kitti", "image_0", "image_1", {"--every", "2"}, 0, 15, 20},
    {"karlsruhe_20100309_0019", "kitti", "image_0", "image_1", {"--every", "2"}, 0, 15, 20},
    {"boofcv_backyard", "kitti", "image_0", "image_1", {"--every", "2"}, 0, 15, 20, true, 0.05},
};
INSTANTIATE_TEST_SUITE_P(Recordings, WrongQuestions, ::testing::ValuesIn(kShort), name_of);
INSTANTIATE_TEST_SUITE_P(LongRecordings, WrongQuestions, ::testing::ValuesIn(kLong), name_of);

}  // namespace
}  // namespace relmap::testing
