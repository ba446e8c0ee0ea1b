// relmap-bench answers: questions to a running daemon about the drive that it has mapped, judged by truth.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>

#include "client/relmap_client.h"
#include "tests/support/drive_evaluation.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

constexpr double kRightPlaceMetres = 3;     // a place is right if it was seen from this near
constexpr double kRightPlaceRadians = 0.8;  // and this way
constexpr double kRouteTolerance = 0.1;     // of its length, against the way along the circuit

struct AnswersOptions {
  std::string server, drive;
  int queries = 20;
};

std::string read_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw StatusError(Status(Reason::NO_SUCH_FILE, path));
  std::ostringstream bytes;
  bytes << in.rdbuf();
  return bytes.str();
}

std::string picture_path(const std::string& drive, const char* eye, std::size_t i) {
  const std::string digits = std::to_string(i);
  return drive + '/' + eye + '/' + std::string(6 - std::min<std::size_t>(6, digits.size()), '0') + digits + ".png";
}

// Asks about the drive's pictures, and knows the truth of every frame of its session.
class Judge {
 public:
  Judge(const AnswersOptions& options)
      : options_(options),
        truth_(testing::read_truth(options.drive).or_throw()),
        client_(client::Client::connect(options.server).or_throw()) {
    const auto sessions = client_->sessions().or_throw();
    if (sessions.empty()) throw StatusError(Status(Reason::EMPTY_MAP, "the map holds no session"));
    session_ = sessions.front();
  }

  void run(Report& report) {
    localise_and_match(report);
    route(report);
  }

 private:
  // The true pose of a picture relative to a frame.
  SE3 true_T_frame_picture(FrameId frame, std::size_t picture) {
    return pose_of(frame).inverse() * truth_.poses[picture];
  }

  SE3 pose_of(FrameId frame) {
    const std::int64_t since = client_->frame(frame).or_throw().time_us - session_.first_time_us;
    const auto at = std::lower_bound(truth_.time_us.begin(), truth_.time_us.end(), since - 2000);
    if (at == truth_.time_us.end())
      throw StatusError(Status(Reason::NO_SUCH_FRAME, "no truth for " + frame.to_string()));
    return truth_.poses[static_cast<std::size_t>(at - truth_.time_us.begin())];
  }

  client::View view_of(std::size_t picture, bool stereo) const {
    client::View view;
    view.left = read_file(picture_path(options_.drive, "image_0", picture));
    if (stereo) view.right = read_file(picture_path(options_.drive, "image_1", picture));
    view.camera = session_.number;
    return view;
  }

  void localise_and_match(Report& report) {
    double error_m = 0, error_rad = 0;
    int localised = 0, right = 0;
    const auto queries = static_cast<std::size_t>(options_.queries);
    for (std::size_t q = 0; q < queries; ++q) {
      const std::size_t picture = (2 * q + 1) * truth_.poses.size() / (2 * queries);
      if (const auto answer = client_->localise(view_of(picture, true)); answer.ok()) {
        const SE3 error = true_T_frame_picture(answer->frame, picture).inverse() * answer->T_frame_view;
        error_m += error.t.norm();
        error_rad += rotation_angle(error.R);
        ++localised;
      }
      const auto match = client_->match_image(view_of(picture, false));
      if (!match.ok() || match->places.empty()) continue;
      const SE3 apart = true_T_frame_picture(match->places.front().frame, picture);
      right += apart.t.norm() < kRightPlaceMetres && rotation_angle(apart.R) < kRightPlaceRadians;
    }
    report.add("queries", options_.queries, "pictures asked about");
    report.add("localised", localised, "of them, localised");
    report.add("localise_error_m", localised ? error_m / localised : NAN, "mean error of position in the frame named");
    report.add("localise_error_deg", localised ? error_rad / localised * 180 / M_PI : NAN, "mean error of direction");
    report.add("place_match_right", static_cast<double>(right) / options_.queries,
               "share of pictures whose most probable place is within 3 m");
  }

  // Metres along the drive between two pictures.
  double along(std::size_t a, std::size_t b) const {
    double metres = 0;
    for (std::size_t i = std::min(a, b); i < std::max(a, b); ++i)
      metres += (truth_.poses[i + 1].t - truth_.poses[i].t).norm();
    return metres;
  }

  // A route from a picture of the second lap to a label on the first: it must take the closure, not the way back round.
  void route(Report& report) {
    const std::size_t n = truth_.poses.size();
    const std::size_t from = n * 97 / 100;
    const FrameId goal{session_.number, session_.first + session_.frames / 2};
    const std::string label = "relmap-bench goal";
    (void)client_->set_label(goal, label).or_throw();
    double metres[2] = {NAN, NAN}, seconds[2] = {NAN, NAN};
    for (const auto by : {client::RouteBy::kDistance, client::RouteBy::kTime}) {
      client::RouteRequest request;
      request.from = view_of(from, true);
      request.to = label;
      request.by = by;
      const auto answer = client_->find_route(request);
      if (!answer.ok()) continue;
      const int i = by == client::RouteBy::kTime;
      metres[i] = answer->distance_m;
      seconds[i] = answer->time_s;
    }
    (void)client_->set_label(goal, label, false);
    const double expected = shortest_way(from, goal);
    const bool right = std::abs(metres[0] - expected) < kRouteTolerance * expected + 1 &&
                       metres[1] >= metres[0] - 1e-6 && seconds[1] <= seconds[0] + 1e-6;
    report.add("route_distance_m", metres[0], "from the picture to the label, shortest by distance");
    report.add("route_time_s", seconds[1], "the same, shortest by time");
    report.add("route_expected_m", expected, "the way along the true circuit");
    report.add("route_right", right, "1: both found, within 10 % of the true way");
  }

  // The shorter way round the circuit, by truth: from the first-lap picture nearest to `from`, or back the whole way.
  double shortest_way(std::size_t from, FrameId goal) {
    const SE3 goal_pose = pose_of(goal);
    const auto nearest = [&](const Vector3& position, std::size_t below) {
      std::size_t best = 0;
      for (std::size_t i = 0; i < below; ++i)
        if ((truth_.poses[i].t - position).norm() < (truth_.poses[best].t - position).norm()) best = i;
      return best;
    };
    const std::size_t goal_picture = nearest(goal_pose.t, truth_.poses.size());
    const std::size_t first_lap = nearest(truth_.poses[from].t, from * 7 / 10);
    return std::min(along(first_lap, goal_picture), along(goal_picture, from));
  }

  const AnswersOptions options_;
  const testing::DriveTruth truth_;
  std::unique_ptr<client::Client> client_;
  client::Session session_;
};

}  // namespace

Run declare_answers(CLI::App& app) {
  const auto options = std::make_shared<AnswersOptions>();
  app.add_option("--server", options->server, "data folder or HOST:PORT of the daemon")->required();
  app.add_option("--drive", options->drive, "folder of the drive: pictures, poses.txt, times.txt")->required();
  app.add_option("--queries", options->queries, "pictures to ask about")->check(CLI::Range(1, 1000));
  return [options](Report& report) { Judge(*options).run(report); };
}

}  // namespace relmap::bench
