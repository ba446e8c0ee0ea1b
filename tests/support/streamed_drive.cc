#include "tests/support/streamed_drive.h"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "storage/graph/path_tree.h"
#include "tests/support/stored_map.h"

namespace relmap::testing {

StreamedDrive::StreamedDrive(const std::string& recording, double rate_hz, int exit_code)
    : recording_(recording), truth_(read_truth(recording).or_throw()) {
  const DaemonOptions options{.data = folder_ / "map", .lcm = random_lcm_url(), .more = {}};
  daemon_ = std::make_unique<RunningDaemon>(options);
  const Finished streamed = run_program(
      {built_program("relmap-frontend"), "--source", "kitti", recording, "--robot", "car", "--lcm", options.lcm,
       "--spool", folder_ / "spool", "--rate", rate_hz > 0 ? std::to_string(rate_hz) : "max", "--json", "--quiet"},
      std::chrono::minutes(3));
  if (streamed.exit_code != exit_code)
    throw std::runtime_error("relmap-frontend ended with " + std::to_string(streamed.exit_code) + ": " +
                             streamed.standard_error);
  summary_ = streamed.standard_output;
  client_ = daemon_->client();
  if (const Status idle = client_->wait_idle(); !idle.ok()) throw StatusError(idle);
  session_ = client_->sessions().or_throw().at(0);
  for (std::uint32_t i = 0; i <= session_.last; ++i)
    frame_times_.push_back(client_->frame({session_.number, i}).or_throw().time_us - session_.first_time_us);
}

double StreamedDrive::summary(const std::string& key) const { return nlohmann::json::parse(summary_).at(key); }

// Recordings may leave numbers out.
std::string StreamedDrive::picture(const char* eye, std::size_t pair) const {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(recording_ + "/" + eye))
    files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return read_text(files.at(pair));
}

client::View StreamedDrive::view(std::size_t pair) const {
  return {.left = picture("image_0", pair), .right = picture("image_1", pair), .camera = session_.number};
}

std::size_t StreamedDrive::pair_of(FrameId frame) const {
  constexpr std::int64_t kSameInstant = 2000;  // us
  const std::int64_t time = frame_times_.at(frame.index);
  const auto at = std::lower_bound(truth_.time_us.begin(), truth_.time_us.end(), time - kSameInstant);
  if (at == truth_.time_us.end() || *at > time + kSameInstant)
    throw std::runtime_error("no truth for frame " + frame.to_string());
  return static_cast<std::size_t>(at - truth_.time_us.begin());
}

SE3 StreamedDrive::true_T_frame_pair(FrameId frame, std::size_t pair) const {
  return truth_.poses[pair_of(frame)].inverse() * truth_.poses[pair];
}

FrameId StreamedDrive::frame_near(std::size_t pair) const {
  const auto distance = [&](std::int64_t time) { return std::abs(time - truth_.time_us.at(pair)); };
  const auto at = std::min_element(frame_times_.begin(), frame_times_.end(),
                                   [&](std::int64_t l, std::int64_t r) { return distance(l) < distance(r); });
  return {session_.number, static_cast<std::uint32_t>(at - frame_times_.begin())};
}

double StreamedDrive::metres_between(std::size_t first, std::size_t second) const {
  double metres = 0;
  for (std::size_t i = first; i < second; ++i) metres += (truth_.poses[i + 1].t - truth_.poses[i].t).norm();
  return metres;
}

storage::Map& StreamedDrive::stop() {
  client_.reset();
  if (daemon_->stop() != 0) throw std::runtime_error("relmapd did not stop well: " + daemon_->log());
  map_ = open_stored_map(folder_ / "map");
  return *map_;
}

std::vector<tracking::PosePair> StreamedDrive::odometry_chain() const {
  std::vector<tracking::PosePair> chain;
  for (std::uint32_t i = 0; i <= session_.last; ++i) {
    const FrameId frame{session_.number, i};
    chain.push_back({truth_.poses[pair_of(frame)], map_->hot(frame)->T_odom_frame});
  }
  return chain;
}

std::vector<tracking::PosePair> StreamedDrive::map_chain() const {
  constexpr auto kAll = std::numeric_limits<std::uint32_t>::max();
  const FrameId root{session_.number, 0};
  const storage::PathTree tree = storage::build_path_tree(*map_, root, {.depth = kAll, .frames = kAll});
  const std::vector<SE3> poses = storage::poses_along(*map_, tree);
  std::vector<tracking::PosePair> chain;
  for (std::uint32_t i = 0; i <= session_.last; ++i) {
    const FrameId frame{session_.number, i};
    const auto found = tree.index.find(frame);
    if (found == tree.index.end()) throw std::runtime_error("frame " + frame.to_string() + " is not connected");
    chain.push_back({truth_.poses[pair_of(frame)], poses[found->second]});
  }
  return chain;
}

}  // namespace relmap::testing
